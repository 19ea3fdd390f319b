#include "render/make_backend.h"

#include "lightcuts/error.h"

namespace lightcuts {
namespace {

#if !defined(LIGHTCUTS_HAS_CUDA)
[[noreturn]] std::unique_ptr<Backend> make_gpu_backend(const RenderOptions&) {
  throw Error(Code::not_built,
              "this build has no CUDA backend, for no CUDA toolkit was found when it was made; choose --backend cpu");
}
bool gpu_answers() { return false; }
#else
std::unique_ptr<Backend> make_gpu_backend(const RenderOptions& options) {
  return make_cuda_backend(options.device, options.memory_bytes);
}
bool gpu_answers() { return cuda_device_count() > 0; }
#endif

}  // namespace

std::unique_ptr<Backend> make_backend(const RenderOptions& options) {
  if (options.backend == BackendKind::cuda) return make_gpu_backend(options);
  if (options.backend == BackendKind::automatic && gpu_answers()) return make_gpu_backend(options);
  return make_cpu_backend(options.threads);
}

}  // namespace lightcuts
