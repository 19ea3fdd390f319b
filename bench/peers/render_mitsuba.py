"""Renders an exported scene with Mitsuba 3's path tracer and prints what that took, as JSON.

    render_mitsuba.py SCENE.xml OUT.exr --size 128x128 --samples 16 --seed 1 [--variant llvm_ad_rgb] [--threads 2]
"""

import argparse
import glob
import json
import os
import re
import time


def find_llvm():
    """The newest libLLVM: Dr.Jit's own search may take one that is too old for its code (before 19, on AVX-512)."""
    found = glob.glob("/usr/lib/*/libLLVM*.so*")
    if "DRJIT_LIBLLVM_PATH" not in os.environ and found:
        def version(path):
            return [int(n) for n in re.findall(r"[0-9]+", os.path.basename(path))]
        os.environ["DRJIT_LIBLLVM_PATH"] = max(found, key=version)


def peak_memory():
    with open("/proc/self/status", encoding="ascii") as status:
        return next(int(line.split()[1]) * 1024 for line in status if line.startswith("VmHWM"))


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("scene")
    parser.add_argument("output")
    parser.add_argument("--size", default="128x128")
    parser.add_argument("--samples", type=int, nargs="+", default=[16])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--variant", default="llvm_ad_rgb")
    parser.add_argument("--threads", type=int, default=0)
    options = parser.parse_args()
    if options.variant.startswith("llvm"):
        find_llvm()

    import mitsuba as mi
    mi.set_variant(options.variant)
    import drjit as dr
    if options.threads > 0:
        dr.set_thread_count(options.threads)
    width, height = options.size.split("x")
    start = time.perf_counter()
    scene = mi.load_file(options.scene, width=width, height=height)
    loaded = time.perf_counter()
    results = []
    for samples in options.samples:
        # The first picture of a number of samples compiles its kernel; that is measured apart.
        mi.render(scene, spp=samples, seed=0).numpy()
        begin, begin_cpu = time.perf_counter(), time.process_time()
        image = mi.render(scene, spp=samples, seed=options.seed)
        pixels = image.numpy()
        results.append({"samples": samples, "seconds": time.perf_counter() - begin,
                        "cpu_s": time.process_time() - begin_cpu})
        path = options.output.replace("SAMPLES", str(samples))
        mi.Bitmap(pixels.astype("float32")).write(path)
    print(json.dumps({"renderer": f"Mitsuba {mi.__version__} ({options.variant})", "load_s": loaded - start,
                      "renders": results, "memory_bytes": peak_memory()}))


if __name__ == "__main__":
    main()
