"""Renders the same scenes with lightcuts, Mitsuba 3 and Cycles, and says how far they agree and what each takes.

    compare.py [--lightcuts build/bin/lightcuts] [--rooms FOLDER] [--output out/peers] [--size 128x128] [--samples 64]

Run by `./dev peers`, in the environment that it makes. Every scene is exported by `lightcuts export`, so that geometry,
materials, lights and camera are the same. Finished pictures are kept and not rendered again for the same options.

Agreement: two pictures of different seeds by each renderer; the mean over pixels and channels of (a1 - b1) (a2 - b2) /
(b^2 + 0.01 m^2) is the relMSE without either's noise, zero if both converge to the same picture. b is taken from the pixels
around, whose noise is another. Errors in time: the same measure against our path tracer's reference.
"""

import argparse
import json
import math
import os
import pathlib
import resource
import subprocess
import sys

import numpy as np

HERE = pathlib.Path(__file__).resolve().parent
RENDERERS = ("lightcuts", "mitsuba", "cycles")


def read_exr(path):
    import mitsuba as mi
    if mi.variant() is None:
        mi.set_variant("scalar_rgb")
    bitmap = mi.Bitmap(str(path))
    planes = {name: np.array(part) for name, part in bitmap.split()} if bitmap.channel_count() > 4 else {"": np.array(bitmap)}
    return next(iter(planes.values()))[..., :3].astype(np.float64)


def neighbours_mean(image):
    """Mean of the eight pixels around each; at borders of those that there are."""
    total = np.zeros_like(image)
    count = np.zeros(image.shape[:2] + (1,))
    height, width = image.shape[:2]
    for dy in (-1, 0, 1):
        for dx in (-1, 0, 1):
            if dx == dy == 0:
                continue
            to = (slice(max(0, -dy), height - max(0, dy)), slice(max(0, -dx), width - max(0, dx)))
            of = (slice(max(0, dy), height + min(0, dy)), slice(max(0, dx), width + min(0, dx)))
            total[to] += image[of]
            count[to] += 1
    return total / count


def relmse_without_noise(a, b):
    """Of two pairs of pictures; the value and its standard error."""
    reference = (b[0] + b[1]) / 2
    scale = neighbours_mean(reference) ** 2 + 0.01 * (reference @ [0.2126, 0.7152, 0.0722]).mean() ** 2
    pixels = ((a[0] - b[0]) * (a[1] - b[1]) / scale).mean(axis=2)
    return pixels.mean(), pixels.std() / math.sqrt(pixels.size)


def relmse(a, b):
    scale = b ** 2 + 0.01 * (b @ [0.2126, 0.7152, 0.0722]).mean() ** 2
    return ((a - b) ** 2 / scale).mean()


def ratio_of_means(a, b):
    """Means of a over those of b, and the standard error of the ratio of luminance."""
    ratio = [(a[0] + a[1])[..., c].mean() / (b[0] + b[1])[..., c].mean() for c in range(3)]
    weights = [0.2126, 0.7152, 0.0722]
    variances = [((p[0] - p[1]) @ weights).var() / 4 / p[0][..., 0].size for p in (a, b)]
    mean = ((b[0] + b[1]) / 2 @ weights).mean()
    return ratio, math.sqrt(sum(variances)) / mean


# Does Mitsuba trace a ray on a GPU? It needs CUDA's driver and OptiX, which comes with the driver.
PROBE = """
import mitsuba as mi
mi.set_variant("cuda_ad_rgb")
scene = mi.load_dict({"type": "scene", "shape": {"type": "rectangle"}})
assert scene.ray_test(mi.Ray3f([0, 0, 2], [0, 0, -1])).numpy().all()
"""


def refusal(words):
    """The last line that a program says if it fails; "" if it does not."""
    done = subprocess.run(list(map(str, words)), capture_output=True, text=True, check=False)
    said = (done.stderr or done.stdout).strip().splitlines()
    return "" if done.returncode == 0 else said[-1] if said else f"status {done.returncode}"


def choose_hardware(options, folder):
    """Both on a GPU where one answers both, else both on the CPU, so that they run on equal hardware; says which."""
    why = []
    if options.backend == "auto":
        why.append(refusal([options.lightcuts, "render", "builtin:study", "--quiet", "--backend", "cuda", "--size", "8x8", "--vpls", 10,
                            "-o", folder / "probe.exr"]))
    if options.variant == "auto" and options.backend != "cpu" and not any(why):
        why.append(refusal([sys.executable, "-c", PROBE]))
    on_gpu = not any(why)
    if options.backend == "auto":
        options.backend = "cuda" if on_gpu and options.variant in ("auto", "cuda_ad_rgb") else "cpu"
    if options.variant == "auto":
        options.variant = "cuda_ad_rgb" if on_gpu and options.backend == "cuda" else "llvm_ad_rgb"
    print(f"lightcuts: --backend {options.backend}; Mitsuba: {options.variant}; Cycles: CPU" +
          "".join(f" (no GPU: {reason})" for reason in why if reason) + "\n", flush=True)


class Peers:
    def __init__(self, options):
        self.options = options
        self.folder = pathlib.Path(options.output)
        self.folder.mkdir(parents=True, exist_ok=True)
        choose_hardware(options, self.folder)
        self.kept_file = self.folder / f"kept-{options.size}-{options.backend}-{options.variant}.json"
        if options.backend == "cuda":
            # Kernels are loaded before anything is timed: Mitsuba's are compiled by a first picture.
            os.environ["CUDA_MODULE_LOADING"] = "EAGER"
        self.kept = json.loads(self.kept_file.read_text()) if self.kept_file.exists() else {}
        self.missing = {}

    def run(self, words, key, needs, stats=None):
        """Runs a program that prints JSON last; returns that with its processor time, kept from an earlier run if its files are there.

        `stats`: a JSON file that the program writes, returned under that name.
        """
        if key in self.kept and all(pathlib.Path(f).exists() for f in needs):
            return self.kept[key]
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        done = subprocess.run(list(map(str, words)), capture_output=True, text=True, check=False)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        if done.returncode != 0:
            reason = (done.stderr or done.stdout).strip().splitlines() or [f"status {done.returncode}"]
            raise RuntimeError(f"{pathlib.Path(str(words[0])).name} {key}: {reason[-1]}")
        lines = [line for line in done.stdout.splitlines() if line.startswith("{")]
        result = json.loads(lines[-1]) if lines else {}
        if stats:
            result["stats"] = json.loads(stats.read_text())
        result["process_cpu_s"] = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        self.kept[key] = result
        temporary = self.kept_file.with_suffix(".tmp")
        temporary.write_text(json.dumps(self.kept, indent=1))
        temporary.replace(self.kept_file)
        return result

    def export(self, name, spec):
        for ending in ("xml", "glb"):
            target = self.folder / f"{name}.{ending}"
            if not target.exists():
                subprocess.run([self.options.lightcuts, "export", spec, target, "--camera", "0"], check=True, capture_output=True)

    def ours(self, name, spec, samples, seed, extra=("--method", "path"), tag="path", repeat=0):
        """One picture; seconds are those of the stages, loading and writing left out. `repeat` tells runs of the same apart."""
        out = self.folder / f"{name}-lightcuts-{self.options.backend}-{tag}-{samples}-{seed}.exr"
        stats = out.with_suffix(".json")
        words = [self.options.lightcuts, "render", spec, "--quiet", "--backend", self.options.backend, "--size", self.options.size,
                 "--samples", samples, "--seed", seed, "-o", out, "--stats", stats, *extra]
        if self.options.threads:
            words += ["--threads", self.options.threads]
        result = self.run(words, out.name + again(repeat), [out], stats)
        found = result["stats"] if "stats" in result else json.loads(stats.read_text())
        times = found["time_ms"]
        # What is left of the program's processor time without that of loading is the stages'.
        result.update(seconds=sum(times[k] for k in ("bvh", "vpls", "tree", "shadow_maps", "shade")) / 1e3,
                      cpu_s=max(0, result["process_cpu_s"] - self.loading(spec)),
                      memory_bytes=found["memory_bytes"]["host_peak"])
        return out, result

    def loading(self, spec):
        """Processor seconds that our program takes to open a scene: the least of a few runs that do nothing else."""
        runs = [self.run([self.options.lightcuts, "info", spec], f"{spec} opened {i}", []) for i in range(3)]
        return min(run["process_cpu_s"] for run in runs)

    def theirs(self, renderer, name, samples, seed, repeat=0):
        """Pictures of several numbers of samples by one program."""
        script = HERE / f"render_{renderer}.py"
        scene = self.folder / f"{name}.{'xml' if renderer == 'mitsuba' else 'glb'}"
        variant = f"-{self.options.variant}" if renderer == "mitsuba" else ""
        out = self.folder / f"{name}-{renderer}{variant}-SAMPLES-{seed}.exr"
        files = [str(out).replace("SAMPLES", str(s)) for s in samples]
        words = [sys.executable, script, scene, out, "--size", self.options.size, "--seed", seed, "--samples", *samples]
        if self.options.threads:
            words += ["--threads", self.options.threads]
        if renderer == "mitsuba":
            words += ["--variant", self.options.variant]
        return files, self.run(words, f"{name}-{renderer}-{'-'.join(map(str, samples))}-{seed}{again(repeat)}", files)

    def halves(self, renderer, name, spec, samples):
        """Two pictures of different seeds."""
        if renderer == "lightcuts":
            return [read_exr(self.ours(name, spec, samples, seed)[0]) for seed in (11, 12)]
        return [read_exr(self.theirs(renderer, name, [samples], seed)[0][0]) for seed in (11, 12)]

    def try_halves(self, renderer, name, spec, samples):
        try:
            return self.halves(renderer, name, spec, samples)
        except RuntimeError as error:
            self.missing[f"{renderer}, {name}"] = str(error)
            print(f"left out: {error}", file=sys.stderr)
            return None

    def agreement(self, rooms):
        rows = []
        for name, spec in rooms:
            self.export(name, spec)
            pictures = {r: self.try_halves(r, name, spec, self.options.samples) for r in RENDERERS}
            for renderer in RENDERERS[1:]:
                if pictures[renderer] is None or pictures["lightcuts"] is None:
                    continue
                ours, theirs = pictures["lightcuts"], pictures[renderer]
                value, error = relmse_without_noise(ours, theirs)
                ratio, ratio_error = ratio_of_means(ours, theirs)
                rows.append({"room": name, "renderer": renderer, "relmse": value, "standard_error": error,
                             "with_noise": relmse(sum(ours) / 2, sum(theirs) / 2), "ratio": ratio, "ratio_error": ratio_error,
                             "agrees": abs(value) <= 3 * error})
                print(agreement_line(rows[-1]), flush=True)
        return rows

    def race(self, rooms, counts, vpls):
        """Error against time, and memory. The same picture is made several times; times are medians with their spread."""
        rows = []
        repeats = range(self.options.repeats)
        for name, spec in rooms:
            self.export(name, spec)
            truth = self.halves("lightcuts", name, spec, self.options.reference)

            def add(renderer, what, found, memory, file, room=name, reference=truth):
                image = read_exr(file)
                value, error = relmse_without_noise([image, image], reference)
                rows.append({"room": room, "renderer": renderer, "samples": what, "repeats": len(found),
                             **spread_of(found, "seconds"), **spread_of(found, "cpu_s"), "relmse": value,
                             "standard_error": error, "memory_bytes": max(memory)})
                print(race_line(rows[-1]), flush=True)

            def add_ours(renderer, what, *words, room=name, scene=spec):
                made = [self.ours(room, scene, *words, repeat=r) for r in repeats]
                found = [result for _, result in made]
                add(renderer, what, found, [f["memory_bytes"] for f in found], made[0][0])

            for count in counts:
                add_ours("lightcuts path", f"{count} paths", count, 3)
            for count in vpls:
                add_ours("lightcuts cut", f"{count} VPLs, 4 samples", 4, 3, ("--method", "lightcuts", "--vpls", count), f"cut-{count}")
            for renderer in RENDERERS[1:]:
                try:
                    made = [self.theirs(renderer, name, counts, 3, r) for r in repeats]
                except RuntimeError as error:
                    self.missing[f"{renderer}, {name}"] = str(error)
                    continue
                for i, (count, file) in enumerate(zip(counts, made[0][0])):
                    add(made[0][1]["renderer"], f"{count} paths", [result["renders"][i] for _, result in made],
                        [result["memory_bytes"] for _, result in made], file)
        return rows


def again(repeat):
    """What tells the repeats of one picture apart among the kept results."""
    return f" again {repeat}" if repeat else ""


def spread_of(found, name):
    """Median of what the repeats took, and its spread."""
    values = sorted(one[name] for one in found)
    return {name: values[len(values) // 2], f"{name}_low": values[0], f"{name}_high": values[-1]}


def agreement_line(r):
    ratios = " ".join(f"{x:.4f}" for x in r["ratio"])
    return (f"| {r['room']} | {r['renderer']} | {r['relmse']:.5f} ± {r['standard_error']:.5f} | {r['with_noise']:.4f} | {ratios} "
            f"| {r['ratio_error']:.4f} | {'yes' if r['agrees'] else 'no'} |")


def race_line(r):
    return (f"| {r['room']} | {r['renderer']} | {r['samples']} | {r['seconds']:.3g} | {r['cpu_s']:.3g} "
            f"({r['cpu_s_low']:.3g} to {r['cpu_s_high']:.3g}) | {r['relmse']:.4f} ± {r['standard_error']:.4f} "
            f"| {r['memory_bytes'] / 1e6:.0f} |")


def plot(rows, path, time):
    """`time`: "cpu_s" or "seconds", which a GPU's work is counted by."""
    try:
        import matplotlib
        matplotlib.use("Agg")
        import matplotlib.pyplot as plt
    except ImportError:
        return
    rooms = list(dict.fromkeys(r["room"] for r in rows))
    columns = min(4, len(rooms))
    lines = -(-len(rooms) // columns)
    figure, all_axes = plt.subplots(lines, columns, figsize=(4 * columns, 3.6 * lines), squeeze=False)
    for axes in all_axes.flat[len(rooms):]:
        axes.axis("off")
    for axes, room in zip(all_axes.flat, rooms):
        for renderer, style in zip(dict.fromkeys(r["renderer"] for r in rows), ("o-", "D-", "s--", "^--")):
            points = [(r[time], r["relmse"]) for r in rows if r["room"] == room and r["renderer"] == renderer and r["relmse"] > 0]
            if points:
                axes.plot(*zip(*points), style, label=renderer)
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.set_xlabel("processor seconds" if time == "cpu_s" else "seconds")
        axes.set_ylabel("relMSE")
        axes.set_title(room)
        axes.grid(alpha=0.3)
    all_axes[0][0].legend(fontsize=7)
    figure.tight_layout()
    figure.savefig(path, dpi=130)


def find_rooms(options):
    rooms = [("study", "builtin:study")]
    folder = pathlib.Path(options.rooms)
    if folder.is_dir():
        rooms += [(p.parent.name, str(p)) for p in sorted(folder.glob("*/scene.gltf"))]
    return [r for r in rooms if not options.only or r[0] in options.only]


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--lightcuts", default="build/bin/lightcuts")
    parser.add_argument("--rooms", default="../shared/scenes/rooms")
    parser.add_argument("--only", nargs="+", help="names of rooms; default: all")
    parser.add_argument("--output", default="out/peers")
    parser.add_argument("--size", default="128x128")
    parser.add_argument("--samples", type=int, default=64, help="paths a pixel of each of the two pictures that are compared; 0: no comparison")
    parser.add_argument("--reference", type=int, default=256, help="paths a pixel of each half of the reference")
    parser.add_argument("--race", nargs="*", help="rooms for error against time; default: all")
    parser.add_argument("--counts", type=int, nargs="+", default=[1, 4, 16, 64], help="paths a pixel there")
    parser.add_argument("--repeats", type=int, default=3, help="of each picture there, for its time")
    parser.add_argument("--threads", type=int, default=0)
    parser.add_argument("--backend", choices=("auto", "cpu", "cuda"), default="auto", help="ours; auto: cuda where a GPU answers both")
    parser.add_argument("--variant", default="auto", help="of Mitsuba; auto: cuda_ad_rgb where ours is on a GPU, too, else llvm_ad_rgb")
    options = parser.parse_args()
    options.lightcuts = os.path.abspath(options.lightcuts)
    peers = Peers(options)
    rooms = find_rooms(options)
    agreement = []
    if options.samples > 0:
        print("| room | against | relmse without noise | with noise | ratio of means R G B | its standard error | within noise |\n"
              "|---|---|---:|---:|---:|---:|---|")
        agreement = peers.agreement(rooms)
    print("\n| room | renderer | | seconds | processor seconds (low to high) | relmse without the reference's noise | memory [MB] |\n"
          "|---|---|---|---:|---:|---:|---:|")
    race = peers.race([r for r in rooms if options.race is None or r[0] in options.race], options.counts, [1000, 10000])
    plot(race, peers.folder / "error-against-time.png", "seconds" if options.backend == "cuda" else "cpu_s")
    report = {"options": vars(options), "agreement": agreement, "race": race, "missing": peers.missing}
    (peers.folder / "peers.json").write_text(json.dumps(report, indent=1, default=float))
    print(f"\nwrote {peers.folder / 'peers.json'} and {peers.folder / 'error-against-time.png'}")


if __name__ == "__main__":
    main()
