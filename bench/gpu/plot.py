#!/usr/bin/env python3
"""Plots what `lightcuts bench frame --json frame.json` measured on a GPU.

Usage: plot.py FRAME.json OUT_FOLDER

Writes gpu_lights.png (time by number of lights: all of them, heaps as the study, packets) and gpu_stages.png (a frame's
stages at each number of lights).
"""

import json
import pathlib
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

CURVES = {
    "all lights, none": ("all lights", "tab:gray", "s"),
    "heap, none, 32768": ("cut: a heap a pixel, as the study", "tab:red", "^"),
    "packet, none": ("cut: groups of pixels", "tab:blue", "o"),
    "light tree": ("light tree", "tab:green", "."),
}
STAGES = {
    "vpls": ("light paths", "tab:orange"),
    "light tree": ("light tree", "tab:green"),
    "packet, none": ("cut and shading, no visibility", "tab:blue"),
}


def times(rows, scene, stage):
    """Sorted (lights, median ms) of a stage."""
    return sorted({r["vpls"]: r["median_ms"] for r in rows if r["scene"] == scene and r["stage"] == stage}.items())


def plot_lights(rows, scenes, machine, path):
    fig, axes = plt.subplots(1, len(scenes), figsize=(6.2 * len(scenes), 4.4), sharey=True, squeeze=False)
    for axis, scene in zip(axes[0], scenes):
        for stage, (label, colour, marker) in CURVES.items():
            points = times(rows, scene, stage)
            if points:
                axis.loglog(*zip(*points), color=colour, marker=marker, label=label)
            if stage == "all lights, none" and points:
                lights, ms = points[-1]
                axis.loglog([lights, 4194304], [ms, ms * 4194304 / lights], color=colour, linestyle=":")
        axis.set_title(f"{scene}, 1000x1000, error 0.02, no visibility")
        axis.set_xlabel("lights")
        axis.grid(True, which="major", alpha=0.3)
    axes[0][0].set_ylabel("time on the device [ms]")
    axes[0][0].legend()
    fig.text(0.5, 0.005, machine, ha="center", fontsize=7)
    fig.tight_layout(rect=(0, 0.02, 1, 1))
    fig.savefig(path, dpi=110)
    plt.close(fig)


def plot_stages(rows, scenes, machine, path):
    fig, axes = plt.subplots(1, len(scenes), figsize=(6.2 * len(scenes), 3.2), sharex=True, squeeze=False)
    for axis, scene in zip(axes[0], scenes):
        lights = sorted({n for n, _ in times(rows, scene, "vpls")})
        left = [0.0] * len(lights)
        for stage, (label, colour) in STAGES.items():
            found = dict(times(rows, scene, stage))
            widths = [found.get(n, 0.0) for n in lights]
            axis.barh([f"{n:,}".replace(",", " ") for n in lights], widths, left=left, color=colour, label=label)
            left = [a + b for a, b in zip(left, widths)]
        axis.set_title(scene)
        axis.set_xlabel("time on the device [ms]")
    axes[0][0].set_ylabel("lights")
    axes[0][0].legend(loc="lower right", fontsize=8)
    fig.text(0.5, 0.005, machine, ha="center", fontsize=7)
    fig.tight_layout(rect=(0, 0.03, 1, 1))
    fig.savefig(path, dpi=110)
    plt.close(fig)


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    data = json.loads(pathlib.Path(sys.argv[1]).read_text(encoding="utf-8"))["frame"]
    out = pathlib.Path(sys.argv[2])
    rows = data["rows"]
    scenes = list(dict.fromkeys(r["scene"] for r in rows))
    machine = "bench frame" + (f", {data['machine'].get('device', '')}" if isinstance(data.get("machine"), dict) else "")
    plot_lights(rows, scenes, machine, out / "gpu_lights.png")
    plot_stages(rows, scenes, machine, out / "gpu_stages.png")


if __name__ == "__main__":
    main()
