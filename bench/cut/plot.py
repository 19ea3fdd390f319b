#!/usr/bin/env python3
"""Draws what `bench_cut errors` and `bench_cut speed` printed. Needs matplotlib (package python3-matplotlib).

    bench_cut errors --size 48 --vpls 10000 --errors 0.1 0.05 0.02 0.01 0.005 0.002 0.001 --methods packet \\
        --scenes SCENE... --visibility none > errors_none.csv        (and rays)
    bench_cut speed --size 96 --heap-size 48 --vpls 110 300 1000 3000 10000 30000 100000 300000 1000000 \\
        --scenes SCENE... --methods packet heap --visibility none > sizes_none.txt        (and rays)
    bench/cut/plot.py FOLDER OUT_FOLDER        (draws those of both that FOLDER has the figures for)
"""
import csv
import pathlib
import sys

import matplotlib

matplotlib.use("svg")
import matplotlib.pyplot as plt  # noqa: E402

plt.rcParams["svg.hashsalt"] = "lightcuts"
plt.rcParams["svg.fonttype"] = "none"


def short(scene):
    return scene.split("?")[0].removeprefix("builtin:").split("/")[0]


def read_errors(path):
    rows = {}
    with open(path) as file:
        for row in csv.DictReader(file):
            if row["scene"] != "scene":
                rows.setdefault(short(row["scene"]), []).append(row)
    return rows


def read_sizes(path):
    """(scene, method) -> [(lights, mean size)]"""
    sizes = {}
    for line in open(path):
        cells = [cell.strip() for cell in line.strip().strip("|").split("|")]
        if len(cells) == 13 and cells[2].isdigit():
            sizes.setdefault((short(cells[0]), cells[3]), []).append((int(cells[2]), float(cells[8])))
    return sizes


def errors(folder, out):
    figure, axes = plt.subplots(2, 3, figsize=(13.5, 7.5), sharex=True)
    for line, visibility in zip(axes, ["none", "rays"]):
        for scene, rows in read_errors(folder / f"errors_{visibility}.csv").items():
            bound = [float(r["error"]) for r in rows]
            line[0].plot(bound, [100 * float(r["mean_error"]) for r in rows], marker=".", label=scene)
            line[1].plot(bound, [100 * float(r["p99_error"]) for r in rows], marker=".", label=scene)
            line[2].plot(bound, [float(r["mean_size"]) for r in rows], marker=".", label=scene)
        for axis, name in zip(line, ["mean relative error [%]", "99th percentile [%]", "mean cut [nodes]"]):
            axis.set(xscale="log", yscale="log", title=f"{name}, visibility {visibility}", xlabel="--error")
            axis.grid(True, which="major", alpha=0.3)
        line[0].plot(0.02, 1.5, "kv")
        line[1].plot(0.02, 5, "kv")
    axes[0][2].legend(fontsize=8, loc="upper left", bbox_to_anchor=(1.02, 1))
    figure.tight_layout()
    figure.savefig(out / "cut_error.svg", metadata={"Date": None})


def sizes(folder, out):
    figure, axes = plt.subplots(1, 2, figsize=(12, 4), sharey=True)
    for axis, visibility in zip(axes, ["none", "rays"]):
        for (scene, method), points in read_sizes(folder / f"sizes_{visibility}.txt").items():
            style = "-" if method == "packet" else ":"
            axis.plot(*zip(*points), style, marker=".", label=f"{scene}, {method}")
        axis.set(xscale="log", yscale="log", title=f"mean cut [nodes], visibility {visibility}", xlabel="lights")
        axis.grid(True, which="major", alpha=0.3)
    axes[1].legend(fontsize=8, loc="upper left", bbox_to_anchor=(1.02, 1))
    figure.tight_layout()
    figure.savefig(out / "cut_size.svg", metadata={"Date": None})


folder, out = map(pathlib.Path, sys.argv[1:3])
if (folder / "errors_none.csv").exists():
    errors(folder, out)
if (folder / "sizes_none.txt").exists():
    sizes(folder, out)
