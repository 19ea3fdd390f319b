#include <limits>

#include "cuda/device_scene.h"
#include "cuda/executor.cuh"
#include "kernels/build_wide_bvh.h"
#include "lightcuts/error.h"

namespace lightcuts::cuda {

template <class T>
T* DeviceScene::copy(Device& device, const T* host, std::size_t count) {
  if (host == nullptr || count == 0) return nullptr;
  DeviceBuffer<std::byte> array(device, count * sizeof(T));
  array.upload(reinterpret_cast<const std::byte*>(host), count * sizeof(T));
  arrays_.push_back(std::move(array));
  return reinterpret_cast<T*>(arrays_.back().data());
}

DeviceScene::DeviceScene(Device& device, const Scene& scene, const SceneView& host) : device_(&device), view_(host) {
  std::vector<ImageView> images(host.images, host.images + host.image_count);
  for (ImageView& image : images) {
    image.texels = copy(device, image.texels, std::size_t{1} * image.width * image.height * image.channels);
  }
  std::vector<MeshView> meshes(host.meshes, host.meshes + host.mesh_count);
  for (std::size_t m = 0; m < meshes.size(); ++m) {
    MeshView& mesh = meshes[m];
    const std::size_t vertices = scene.meshes[m].positions.size();
    mesh.positions = copy(device, mesh.positions, vertices);
    mesh.normals = copy(device, mesh.normals, vertices);
    for (const Vec2*& texcoords : mesh.texcoords) texcoords = copy(device, texcoords, vertices);
    mesh.colors = copy(device, mesh.colors, vertices);
    mesh.triangles = copy(device, mesh.triangles, mesh.triangle_count);
  }
  view_.images = copy(device, images.data(), images.size());
  view_.meshes = copy(device, meshes.data(), meshes.size());
  view_.materials = copy(device, host.materials, host.material_count);
  view_.instances = copy(device, host.instances, host.instance_count);
  view_.linear_from_srgb = copy(device, host.linear_from_srgb, 256);
  device.synchronize();  // the host copies above end here

  std::vector<std::uint32_t> instance_begin{0};
  for (std::uint32_t i = 0; i < host.instance_count; ++i) {
    const std::uint64_t end = std::uint64_t{instance_begin.back()} + host.meshes[host.instances[i].mesh].triangle_count;
    if (end > std::numeric_limits<std::uint32_t>::max() / 2) {
      throw Error(Code::out_of_memory,
                  "The scene draws more than two thousand million triangles, instances counted: more than the GPU's "
                  "tree can number. Use --backend cpu, which does not copy instances.");
    }
    instance_begin.push_back(static_cast<std::uint32_t>(end));
  }
  CudaExecutor executor(device);
  WideBvh<CudaExecutor> bvh = build_wide_bvh(executor, view_, instance_begin);
  node_count_ = bvh.node_count;
  triangle_count_ = instance_begin.back();
  nodes_ = std::move(bvh.nodes);
  shadow_nodes_ = std::move(bvh.shadow_nodes);
  leaves_ = std::move(bvh.triangles);
}

void DeviceScene::update_materials(const SceneView& host) {
  if (host.material_count == 0) return;
  check(cudaMemcpyAsync(const_cast<MaterialView*>(view_.materials), host.materials,
                        host.material_count * sizeof(MaterialView), cudaMemcpyHostToDevice, device_->stream()),
        "sending materials");
  device_->synchronize();
}

}  // namespace lightcuts::cuda
