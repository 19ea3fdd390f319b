#!/usr/bin/env python3
"""Plots what `lightcuts bench frame --json frame.json` measured on a GPU.

Usage: plot.py FRAME.json OUT_FOLDER

Writes gpu_lights.png (time by number of lights: all of them, heaps as the study, packets; below, by shadow maps that were
made before, with the number from which cuts are faster) and gpu_stages.png (a frame's stages at each number of lights).
"""

import json
import pathlib
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

CURVES = {
    "no visibility": {
        "all lights, none": ("all lights", "tab:gray", "s"),
        "heap, none, 32768": ("cut: a heap a pixel, as the study", "tab:red", "^"),
        "packet, none": ("cut: groups of pixels", "tab:blue", "o"),
        "light tree": ("light tree", "tab:green", "."),
    },
    "shadow maps, made before": {
        "all lights, ism": ("all lights", "tab:gray", "s"),
        "packet, ism": ("cut: groups of pixels", "tab:blue", "o"),
    },
}
MOST_LIGHTS = 4194304
STAGES = {
    "vpls": ("light paths", "tab:orange"),
    "light tree": ("light tree", "tab:green"),
    "packet, none": ("cut and shading, no visibility", "tab:blue"),
}


def times(rows, scene, stage):
    """Sorted (lights, median ms) of a stage."""
    return sorted({r["vpls"]: r["median_ms"] for r in rows if r["scene"] == scene and r["stage"] == stage}.items())


def plot_curves(axis, rows, scene, curves):
    """Time by number of lights; that of all lights is continued evenly, dotted."""
    for stage, (label, colour, marker) in curves.items():
        points = times(rows, scene, stage)
        if not points:
            continue
        axis.loglog(*zip(*points), color=colour, marker=marker, label=label)
        lights, ms = points[-1]
        if stage.startswith("all lights") and lights < MOST_LIGHTS:
            axis.loglog([lights, MOST_LIGHTS], [ms, ms * MOST_LIGHTS / lights], color=colour, linestyle=":")


def mark_crossing(axis, rows, scene):
    """The number of lights from which cuts are faster."""
    for row in rows:
        if row["scene"] == scene and row["stage"] == "crossing, ism" and row["crossed"]:
            axis.axvline(row["vpls"], color="tab:blue", linestyle="--", linewidth=1)
            axis.annotate(f"cuts faster from {row['vpls']} lights on", (row["vpls"], 0.97), xycoords=("data", "axes fraction"),
                          xytext=(4, 0), textcoords="offset points", va="top", color="tab:blue", fontsize=9)


def plot_lights(rows, scenes, machine, path):
    size = (6.2 * len(scenes), 4.0 * len(CURVES))
    fig, axes = plt.subplots(len(CURVES), len(scenes), figsize=size, sharex=True, sharey=True, squeeze=False)
    for line, (way, curves) in zip(axes, CURVES.items()):
        for axis, scene in zip(line, scenes):
            plot_curves(axis, rows, scene, curves)
            axis.set_title(f"{scene}, 1000x1000, error 0.02, {way}", fontsize=10)
            axis.grid(True, which="major", alpha=0.3)
        line[0].set_ylabel("time on the device [ms]")
        if line[0].get_legend_handles_labels()[1]:
            line[0].legend()
    for axis, scene in zip(axes[-1], scenes):
        mark_crossing(axis, rows, scene)
        axis.set_xlabel("lights")
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
