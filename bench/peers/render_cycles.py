"""Renders an exported scene with Blender's Cycles (light tree on) and prints what that took, as JSON.

    render_cycles.py SCENE.glb OUT.exr --size 128x128 --samples 16 --seed 1 [--threads 2]

The importer's materials are replaced: what Cycles calls principled has a clear coat of reflection that ours have not.
"""

import argparse
import contextlib
import json
import math
import os
import sys
import time


@contextlib.contextmanager
def quiet():
    """Blender prints what it does on stdout; that is ours."""
    sys.stdout.flush()
    kept = os.dup(1)
    with open(os.devnull, "w", encoding="ascii") as nothing:
        os.dup2(nothing.fileno(), 1)
        try:
            yield
        finally:
            sys.stdout.flush()
            os.dup2(kept, 1)
            os.close(kept)


def peak_memory():
    with open("/proc/self/status", encoding="ascii") as status:
        return next(int(line.split()[1]) * 1024 for line in status if line.startswith("VmHWM"))


def make_lambertian(material):
    """A diffuse surface of the same colour; light comes out of the front only, unless the material has two sides."""
    tree = material.node_tree
    surface = next((n for n in tree.nodes if n.type == "BSDF_PRINCIPLED"), None)
    output = next((n for n in tree.nodes if n.type == "OUTPUT_MATERIAL"), None)
    if surface is None or output is None:
        return

    def carry(name, socket):
        source = surface.inputs[name]
        if source.is_linked:
            tree.links.new(source.links[0].from_socket, socket)
        else:
            socket.default_value = source.default_value

    diffuse = tree.nodes.new("ShaderNodeBsdfDiffuse")
    diffuse.inputs["Roughness"].default_value = 0
    carry("Base Color", diffuse.inputs["Color"])
    shader = diffuse.outputs[0]
    strength = surface.inputs["Emission Strength"]
    colour = surface.inputs["Emission Color"]
    if (strength.is_linked or strength.default_value > 0) and (colour.is_linked or max(colour.default_value[:3]) > 0):
        emission = tree.nodes.new("ShaderNodeEmission")
        carry("Emission Color", emission.inputs["Color"])
        carry("Emission Strength", emission.inputs["Strength"])
        light = emission.outputs[0]
        if material.use_backface_culling:
            geometry, front = tree.nodes.new("ShaderNodeNewGeometry"), tree.nodes.new("ShaderNodeMixShader")
            tree.links.new(geometry.outputs["Backfacing"], front.inputs[0])
            tree.links.new(light, front.inputs[1])
            light = front.outputs[0]
            material.cycles.emission_sampling = "FRONT"
        both = tree.nodes.new("ShaderNodeAddShader")
        tree.links.new(shader, both.inputs[0])
        tree.links.new(light, both.inputs[1])
        shader = both.outputs[0]
    alpha = surface.inputs["Alpha"]
    if alpha.is_linked:
        hole, cut = tree.nodes.new("ShaderNodeBsdfTransparent"), tree.nodes.new("ShaderNodeMixShader")
        tree.links.new(alpha.links[0].from_socket, cut.inputs[0])
        tree.links.new(hole.outputs[0], cut.inputs[1])
        tree.links.new(shader, cut.inputs[2])
        shader = cut.outputs[0]
    tree.links.new(shader, output.inputs["Surface"])


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("scene")
    parser.add_argument("output")
    parser.add_argument("--size", default="128x128")
    parser.add_argument("--samples", type=int, nargs="+", default=[16])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--threads", type=int, default=0)
    options = parser.parse_args()

    import bpy
    with quiet():
        bpy.ops.wm.read_factory_settings(use_empty=True)
        start = time.perf_counter()
        bpy.ops.import_scene.gltf(filepath=options.scene, export_import_convert_lighting_mode="RAW")
        loaded = time.perf_counter()
        scene = bpy.context.scene
        for material in bpy.data.materials:
            if material.node_tree is not None:
                make_lambertian(material)
        for light in bpy.data.lights:
            light.use_shadow = True
            if light.type == "SUN":
                light.angle = 0
            else:  # glTF: W/sr; Blender: W over the sphere
                light.energy *= 4 * math.pi
                light.shadow_soft_size = 0
        scene.camera = next(o for o in scene.objects if o.type == "CAMERA")
        world = bpy.data.worlds.new("dark")
        scene.world = world
        world.use_nodes = True
        world.node_tree.nodes["Background"].inputs["Strength"].default_value = 0

        scene.render.engine = "CYCLES"
        width, height = map(int, options.size.split("x"))
        scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = width, height, 100
        if options.threads > 0:
            scene.render.threads_mode, scene.render.threads = "FIXED", options.threads
        cycles = scene.cycles
        cycles.device = "CPU"
        cycles.use_light_tree = True
        cycles.use_adaptive_sampling = False
        cycles.use_denoising = False
        cycles.light_sampling_threshold = 0
        cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0
        cycles.blur_glossy = 0
        cycles.max_bounces = cycles.diffuse_bounces = 65
        cycles.transparent_max_bounces = 64
        cycles.pixel_filter_type, cycles.filter_width = "BOX", 1
        cycles.seed = options.seed
        scene.view_settings.view_transform = "Raw"
        settings = scene.render.image_settings
        settings.file_format, settings.color_depth, settings.color_mode = "OPEN_EXR", "32", "RGB"
        results = []
        for samples in options.samples:
            cycles.samples = samples
            scene.render.filepath = options.output.replace("SAMPLES", str(samples))
            begin, begin_cpu = time.perf_counter(), time.process_time()
            bpy.ops.render.render(write_still=True)
            results.append({"samples": samples, "seconds": time.perf_counter() - begin,
                            "cpu_s": time.process_time() - begin_cpu})
    print(json.dumps({"renderer": f"Cycles (Blender {bpy.app.version_string})", "load_s": loaded - start,
                      "renders": results, "memory_bytes": peak_memory()}))


if __name__ == "__main__":
    main()
