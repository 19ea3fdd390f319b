#!/usr/bin/env python3
"""Draws the plots of `lightcuts bench study` and writes its page.

    study_report.py DIR    DIR holds study.json and pictures/, as the command leaves them

Writes DIR/plots/*.svg and *.png and DIR/index.html, which embeds all it shows. Needs matplotlib; exit status 3 without it.
"""

import base64
import html
import io
import json
import math
import pathlib
import sys

try:
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    from matplotlib.patches import Rectangle
    from PIL import Image
except ImportError:
    sys.exit(3)

# Colours that people with any colour vision tell apart (Okabe and Ito).
BLUE, ORANGE, GREEN, RED, PURPLE, SKY, GREY = (
    "#0072b2", "#e69f00", "#009e73", "#d55e00", "#cc79a7", "#56b4e9", "#7f7f7f")
METRICS = ["distance", "distance-color", "distance-direction", "distance-color-direction"]
METRIC_COLOURS = dict(zip(["walter"] + METRICS, [BLUE, ORANGE, GREEN, RED, PURPLE]))

plt.rcParams.update({
    "font.size": 10, "axes.spines.top": False, "axes.spines.right": False, "axes.grid": True, "grid.alpha": 0.25,
    "lines.linewidth": 1.8, "lines.markersize": 5, "legend.frameon": False, "legend.fontsize": 9,
    "svg.fonttype": "path", "figure.dpi": 110, "svg.hashsalt": "lightcuts"})


class Report:
    """What the run found, and what has been drawn of it."""

    def __init__(self, folder):
        self.folder = pathlib.Path(folder)
        self.data = json.loads((self.folder / "study.json").read_text(encoding="utf-8"))
        self.facts = self.data["facts"]
        (self.folder / "plots").mkdir(exist_ok=True)

    def rows(self, table, **wanted):
        """Rows of a table as dictionaries, those that have the wanted values."""
        found = self.data["tables"].get(table)
        if not found:
            return []
        rows = [dict(zip(found["columns"], row)) for row in found["rows"]]
        return [r for r in rows if all(r.get(k) == v for k, v in wanted.items())]

    def measured(self, table, **wanted):
        return self.rows(table, source="measured", **wanted)

    def published(self, table, **wanted):
        return self.rows(table, source="published", **wanted)

    def save(self, figure, name):
        figure.tight_layout()
        for ending in ("svg", "png"):
            metadata = {"Date": None} if ending == "svg" else None
            figure.savefig(self.folder / "plots" / f"{name}.{ending}", dpi=160, metadata=metadata)
        plt.close(figure)


def series(rows, x, y, low=None, high=None):
    """Sorted x, y and error bars of rows that have both."""
    good = sorted((r for r in rows if r[x] is not None and r[y]), key=lambda r: r[x])
    bars = None
    if low and all(r.get(low) is not None for r in good):
        bars = [[max(0, r[y] - r[low]) for r in good], [max(0, r[high] - r[y]) for r in good]]
    return [r[x] for r in good], [r[y] for r in good], bars


def draw(axes, rows, x, y, label, colour, style="o-", spread=True):
    xs, ys, bars = series(rows, x, y, "low" if spread else None, "high")
    if xs:
        axes.errorbar(xs, ys, yerr=bars, fmt=style, color=colour, label=label, capsize=2)
    return xs, ys


def log_log(axes, x, y):
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlabel(x)
    axes.set_ylabel(y)


# The plots, one function each. Each returns False where the run has nothing to show.

def plot_table_1(report):
    ours = report.measured("table-1")
    if not ours:
        return False
    figure, axes = plt.subplots(figsize=(6.4, 3.8))
    draw(axes, report.published("table-1"), "vpls", "seconds", "study (published)", GREY, "s--", False)
    draw(axes, ours, "vpls", "seconds", "ours", BLUE)
    log_log(axes, "VPLs made", "seconds")
    axes.legend()
    report.save(figure, "table-1")
    return True


def plot_cuts(report):
    ours = report.measured("table-2-3")
    if not ours:
        return False
    sizes = [n for n in (110, 930) if any(r["lights"] == n for r in ours)]
    figure, all_axes = plt.subplots(1, len(sizes) + 1, figsize=(3.4 * (len(sizes) + 1), 3.9))
    for axes, lights in zip(all_axes, sizes):
        for i, metric in enumerate(METRICS):
            then = report.published("table-2-3", lights=lights, metric=metric)
            now = report.measured("table-2-3", lights=lights, metric=metric, builder="agglomerative")
            axes.bar(i - 0.2, then[0]["mean_cut"], 0.38, color="#bbbbbb", label="study" if i == 0 else None)
            axes.bar(i + 0.2, now[0]["mean_cut"], 0.38, yerr=now[0]["deviation"], capsize=3, color=BLUE,
                     label="ours" if i == 0 else None)
        walter = report.measured("table-2-3", lights=lights, metric="walter", builder="agglomerative")
        axes.bar(len(METRICS), walter[0]["mean_cut"], 0.38, yerr=walter[0]["deviation"], capsize=3, color=BLUE)
        axes.set_xticks(range(5), ["distance", "+ colour", "+ direction", "+ both", "Walter's"], rotation=30, ha="right")
        axes.set_title(f"{lights} lights", fontsize=10)
        axes.set_ylabel("mean cut")
        axes.grid(axis="x", visible=False)
        axes.legend()
    axes = all_axes[-1]
    for metric, colour in METRIC_COLOURS.items():
        rows = report.measured("table-2-3", metric=metric, builder="agglomerative")
        draw(axes, rows, "lights", "mean_cut", metric, colour, spread=False)
    axes.set_xscale("log")
    axes.set_xlabel("lights")
    axes.set_ylabel("mean cut")
    axes.legend(fontsize=7)
    report.save(figure, "table-2-3")
    return True


def plot_table_4(report):
    ours = report.measured("table-4")
    if not ours:
        return False
    figure, axes = plt.subplots(figsize=(6.4, 3.8))
    for rows, label, colour, style in (
            (report.published("table-4"), "study, CUDA (published)", GREY, "s--"),
            *((([r for r in ours if r["way"] == way]), f"ours: {way}", colour, "o-")
              for way, colour in zip(sorted({r["way"] for r in ours}, reverse=True), (ORANGE, BLUE, GREEN, RED)))):
        for r in rows:
            r["texels"] = r["side"] ** 2
        draw(axes, rows, "texels", "seconds", label, colour, style)
    log_log(axes, "texels of the atlas", "seconds")
    axes.legend()
    report.save(figure, "table-4")
    return True


FRAME_STYLES = {"all lights": (ORANGE, "all lights"), "cut by heap": (GREEN, "cut, a heap a pixel"),
                "cut by heap, 4096 threads": (GREEN, "cut, 4096 heaps at once"),
                "cut by heap, 32768 threads": (PURPLE, "cut, 32768 heaps at once"),
                "cut by packet": (BLUE, "cut, packets")}
VISIBILITY_NAMES = {"ism": "shadow maps", "rays": "shadow rays", "none": "no visibility"}


def per_pixel(rows):
    for r in rows:
        r["us"] = 1e6 * r["seconds"] / r["side"] ** 2
        if r.get("low") is not None:
            r["us_low"], r["us_high"] = (1e6 * r[k] / r["side"] ** 2 for k in ("low", "high"))
    return rows


def plot_figure_4(report):
    ours = per_pixel(report.measured("table-5"))
    if not ours:
        return False
    present = [v for v in ("ism", "rays", "none") if any(r["visibility"] == v for r in ours)]
    figure, all_axes = plt.subplots(1, len(present), figsize=(3.7 * len(present), 5.2), sharey=True, squeeze=False)
    for axes, visibility in zip(all_axes[0], present):
        if visibility == "ism":
            for method, style in (("all lights, 4096 threads", "s--"), ("cut by heap, 4096 threads", "s--"),
                                  ("all lights, 32768 threads", "D:"), ("cut by heap, 32768 threads", "D:")):
                rows = per_pixel(report.published("table-5", method=method))
                colour = "#c9a25a" if method.startswith("all") else "#7fb8a4"
                draw(axes, rows, "lights", "us", "study: " + method.replace("cut by heap", "cut"), colour, style, False)
        for method, (colour, label) in FRAME_STYLES.items():
            rows = [r for r in ours if r["method"] == method and r["visibility"] == visibility]
            draw(axes, rows, "lights", "us", label, colour, spread=False)
        for c in report.facts.get("crossings", []):
            if c["visibility"] == visibility and c["fast"] == "cut by packet" and c["lights"]:
                axes.axvline(c["lights"], color=RED, linewidth=1, linestyle="-.")
                axes.annotate(f"cut wins from {short(c['lights'])}", (c["lights"], 1), xycoords=("data", "axes fraction"),
                              xytext=(3, -10), textcoords="offset points", color=RED, fontsize=8)
        log_log(axes, "lights", "microseconds a pixel" if axes is all_axes[0][0] else "")
        axes.set_title(VISIBILITY_NAMES[visibility], fontsize=10)
        axes.legend(fontsize=7, loc="upper center", bbox_to_anchor=(0.5, -0.16))
    report.save(figure, "figure-4")
    return True


def plot_figure_5(report):
    ours = report.measured("table-6")
    if not ours:
        return False
    sides = sorted({r["side"] for r in ours})
    figure, all_axes = plt.subplots(1, len(sides), figsize=(4.8 * len(sides), 5), squeeze=False)
    for axes, side in zip(all_axes[0], sides):
        if side == 50:
            for method, colour in (("all lights", "#c9a25a"), ("cut by heap", "#7fb8a4")):
                draw(axes, report.published("table-6", method=method), "lights", "seconds", f"study: {method}", colour, "s--",
                     False)
        for how, style in (("plain, 1 thread", "o-"), ("SIMD, 1 thread", "^-"), ("SIMD, all threads", "v-")):
            for method, colour in (("all lights", ORANGE), ("cut by heap", GREEN), ("cut by packet", BLUE)):
                rows = [r for r in ours if r["how"] == how and r["method"] == method and r["side"] == side]
                draw(axes, rows, "lights", "seconds", f"{method}, {how}", colour, style)
        log_log(axes, "lights", "seconds")
        axes.xaxis.set_minor_formatter(matplotlib.ticker.NullFormatter())
        lights = sorted({r["lights"] for r in ours})
        axes.set_xticks(lights, [short(n) for n in lights])
        axes.set_title(f"{side}x{side} pixels", fontsize=10)
        axes.legend(fontsize=7, loc="upper center", bbox_to_anchor=(0.5, -0.16), ncols=2)
    report.save(figure, "figure-5")
    return True


def show_pictures(report, ids, name, columns):
    known = {p["id"]: p for p in report.data["pictures"]}
    found = [known[i] for i in ids if i in known and (report.folder / known[i]["file"]).exists()]
    if not found:
        return False
    rows = math.ceil(len(found) / columns)
    figure, all_axes = plt.subplots(rows, columns, figsize=(3 * columns, 3.2 * rows), squeeze=False)
    for axes in all_axes.flat:
        axes.axis("off")
    for axes, picture in zip(all_axes.flat, found):
        axes.imshow(plt.imread(report.folder / picture["file"]), interpolation="nearest")
        axes.set_title(picture["caption"], fontsize=9)
    report.save(figure, name)
    return True


def plot_figure_2(report):
    return show_pictures(report, [f"hole-{i}" for i in range(4)], "figure-2", 4)


def plot_figure_3(report):
    return show_pictures(report, ["map-before", "map-after", "map-ours"], "figure-3", 3)


def plot_figure_1(report):
    tree = report.facts.get("tree")
    if not tree:
        return False
    nodes, lights = tree["nodes"], tree["lights"]
    place, next_leaf = {}, [0]

    def put(i, depth):
        node = nodes[i]
        if node["first"] is None:
            place[i] = (next_leaf[0], -depth)
            next_leaf[0] += 1
        else:
            children = sorted((node["first"], node["second"]))
            for child in children:
                put(child, depth + 1)
            place[i] = (sum(place[c][0] for c in children) / 2, -depth)

    put(0, 0)
    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4), gridspec_kw={"width_ratios": [1.7, 1]})
    most = max(n["intensity"] for n in nodes)
    for i, node in enumerate(nodes):
        x, y = place[i]
        for child in (node["first"], node["second"]):
            if child is not None:
                same = nodes[child]["light"] == node["light"]
                left.plot([x, place[child][0]], [y, place[child][1]], color="#555555" if same else "#bbbbbb",
                          linewidth=1.6 if same else 1, zorder=1)
        left.scatter([x], [y], s=190 + 500 * node["intensity"] / most, color=RED if node["cut"] else "#dfe8f0",
                     edgecolors="#333333", linewidths=0.8, zorder=2)
        left.annotate(str(node["light"]), (x, y), ha="center", va="center", fontsize=8,
                      color="white" if node["cut"] else "black", zorder=3)
    left.axis("off")
    left.set_title("each node: the light that stands for it; area: its intensity; red: one pixel's cut", fontsize=9)
    for i, (x, z, intensity) in enumerate(lights):
        right.scatter([x], [z], s=30 + 300 * intensity / most, color=SKY, edgecolors="#333333", linewidths=0.5, zorder=2)
        right.annotate(str(i), (x, z), fontsize=8, xytext=(4, 4), textcoords="offset points", zorder=3)
    for node in nodes:
        if node["cut"] and node["first"] is not None:
            x0, z0, x1, z1 = node["box"]
            right.add_patch(Rectangle((x0, z0), x1 - x0, z1 - z0, fill=False, edgecolor=RED, linewidth=1.2))
    right.set_xlim(-5.2, 5.2)
    right.set_ylim(5.2, -5.2)
    right.set_aspect("equal")
    right.set_title("the room from above; boxes: clusters of that cut", fontsize=9)
    report.save(figure, "figure-1")
    return True


def plot_convergence(report):
    ours = report.measured("convergence")
    if not ours:
        return False
    rooms = list(dict.fromkeys(r["room"] for r in ours))
    columns = min(2, len(rooms))
    figure, all_axes = plt.subplots(math.ceil(len(rooms) / columns), columns, squeeze=False,
                                    figsize=(4.8 * columns, 3.4 * math.ceil(len(rooms) / columns)))
    for axes, room in zip(all_axes.flat, rooms):
        for method, colour, style in (("all lights, rays", ORANGE, "o-"), ("cut, rays", BLUE, "o-"),
                                      ("cut, shadow maps", GREEN, "o-"), ("path tracer", PURPLE, "s--")):
            rows = [r for r in ours if r["room"] == room and r["method"] == method and r["relmse"] > 0]
            xs, ys, _ = series(rows, "seconds", "relmse")
            axes.plot(xs, ys, style, color=colour, label=method)
        log_log(axes, "seconds", "relMSE")
        axes.set_title(room, fontsize=10)
    all_axes.flat[0].legend(fontsize=8)
    for axes in list(all_axes.flat)[len(rooms):]:
        axes.axis("off")
    report.save(figure, "convergence")
    return True


STAGES = [("bvh_ms", "acceleration structure", GREY), ("vpls_ms", "VPLs", SKY), ("tree_ms", "light tree", GREEN),
          ("maps_ms", "shadow maps", PURPLE), ("shade_ms", "shading", ORANGE)]


def plot_stages(report):
    ours = report.measured("stages")
    if not ours:
        return False
    methods = list(dict.fromkeys(r["method"] for r in ours))
    figure, all_axes = plt.subplots(1, len(methods) + 1, figsize=(3.2 * (len(methods) + 1), 3.6))
    for axes, method in zip(all_axes, methods):
        rows = sorted((r for r in ours if r["method"] == method), key=lambda r: r["vpls"])
        for key, name, colour in STAGES:
            values = [max(r[key], 0) for r in rows]
            if any(values):
                axes.plot([r["vpls"] for r in rows], [v or None for v in values], "o-", color=colour, label=name)
        log_log(axes, "VPLs", "milliseconds")
        axes.set_title(method, fontsize=10)
        axes.legend(fontsize=7)
    axes = all_axes[-1]
    for method, colour in zip(methods, (BLUE, GREEN, ORANGE)):
        rows = [r for r in ours if r["method"] == method]
        draw(axes, rows, "vpls", "host_mb", f"{method}: host", colour, spread=False)
        if any(r["device_mb"] for r in rows):
            draw(axes, rows, "vpls", "device_mb", f"{method}: device", colour, "s--", False)
    log_log(axes, "VPLs", "megabytes")
    axes.set_title("memory, at most", fontsize=10)
    axes.legend(fontsize=7)
    report.save(figure, "stages")
    return True


# Words

def short(number):
    """12345 as "12 300", three digits that count."""
    number = float(number)
    if number >= 100:
        digits = int(math.floor(math.log10(number))) - 2
        number = round(number / 10 ** digits) * 10 ** digits
        return f"{int(number):,}".replace(",", "\u202f")
    return f"{number:.3g}"


def seconds_text(value):
    return f"{value:.3g} s" if value >= 1 else f"{1e3 * value:.3g} ms" if value >= 1e-3 else f"{1e6 * value:.3g} µs"


def one(rows, **wanted):
    return next((r for r in rows if all(r.get(k) == v for k, v in wanted.items())), None)


def words_table_1(report):
    exponent = report.facts.get("table_1_exponent", 0)
    then, now = one(report.published("table-1"), vpls=10000), one(report.measured("table-1"), vpls=10000)
    text = ("How long it takes to shoot light paths and leave a virtual light at each hit. The study found time proportional to "
            f"the number; so do we (time grows as the number to the power {exponent:.2f}).")
    if then and now:
        text += (f" 10 000 lights took the study {seconds_text(then['seconds'])} on a 3 GHz Core Duo with a box test a model; here "
                 f"{seconds_text(now['seconds'])}, {short(then['seconds'] / now['seconds'])} times faster, with a bounding "
                 "volume hierarchy and newer hardware. The study's room is another one.")
    return text


def words_cuts(report):
    text = ("How many clusters light a pixel on average: fewer is faster. The study compared four ways to say which lights "
            "belong together; it made the first three by leaving out terms of the last.")
    rows = report.measured("table-2-3")
    found = {}
    for lights in (110, 930):
        for metric in METRICS + ["walter"]:
            row = one(rows, lights=lights, metric=metric, builder="agglomerative")
            if row:
                found[lights, metric] = row["mean_cut"]
    if all((110, m) in found for m in METRICS):
        low, high = min(found[110, m] for m in METRICS), max(found[110, m] for m in METRICS)
        text += f" At 110 lights we agree: {low:.0f} to {high:.0f} clusters here, 58 to 68 there."
    if all((930, m) in found for m in METRICS):
        low, high = min(found[930, m] for m in METRICS), max(found[930, m] for m in METRICS)
        helps = found[930, "distance-direction"] < found[930, "distance"]
        hurts = found[930, "distance-color"] >= found[930, "distance"]
        text += (f" At 930 lights our cuts are {low:.0f} to {high:.0f}, the study's 220 to 305: our bounds are tighter "
                 "(the study does not say how its own is formed). " +
                 ("Direction helps here as there. " if helps else "Direction does not help here, as it did there. ") +
                 ("Colour, which helped there, does not help here: our bound is on luminance, so lights of different colours in "
                  "one cluster cost nothing, while keeping them apart makes clusters larger." if hurts else
                  "Colour helps here as there."))
        if found.get((930, "walter")):
            text += f" Walter's metric, which the study replaced, gives {found[930, 'walter']:.0f}: it stays our default."
    seeds = sorted({r["seeds"] for r in rows})
    text += f" Bars: standard deviation over {' or '.join(map(str, seeds))} sets of lights (the study: 10, its scatter not printed)."
    side = report.facts.get("cut_side")
    return text + (f" Measured with shadow rays on {side}x{side} pixels, a cut of at most 1000." if side else "")


def words_table_4(report):
    exponent = report.facts.get("table_4_exponent", 0)
    text = (f"Filling the holes of all shadow maps. Linear in the texels there and here (power {exponent:.2f}). ")
    on_gpu = bool(report.measured("table-4", way="fused, CUDA"))
    one_way = report.measured("table-4", way="one texture, CUDA" if on_gpu else "one texture, one thread")
    fused = report.measured("table-4", way="fused, CUDA" if on_gpu else "fused, all threads")
    if one_way and fused:
        a, b = one_way[-1], fused[-1]
        ratio = a["seconds"] / b["seconds"]
        text += (f"The study treated the atlas as one texture, level by level. Taking each map by itself, while it is in the cache, "
                 f"gives the same texels{'' if on_gpu else ' (here on all threads, against one)'}, at {a['side']}x{a['side']} " +
                 (f"{ratio:.1f} times as fast." if ratio > 1.05 else "in about the same time on this machine."))
    then = one(report.published("table-4"), side=3968)
    now = one(one_way, side=3968)
    if on_gpu and then and now:
        text += (f" In the study's way, 3968x3968 texels took its GPU {seconds_text(then['seconds'])} and take this one "
                 f"{seconds_text(now['seconds'])}.")
    return text


def words_figure_4(report):
    ours = report.measured("table-5")
    side = ours[0]["side"] if ours else 0
    text = ("The study's main question: from how many lights on are cuts worth their trouble? It never saw them win on a GPU: at "
            "2550 lights a cut took 11 to 28 times as long as summing all lights, and memory ended the experiment. ")
    for c in report.facts.get("crossings", []):
        if c["fast"] != "cut by packet":
            continue
        name = VISIBILITY_NAMES[c["visibility"]]
        text += (f"With {name}, cuts win here from about {short(c['lights'])} lights on. " if c["lights"] else
                 f"With {name}, cuts did not win in the range measured here. ")
    heap = [c for c in report.facts.get("crossings", []) if c["fast"].startswith("cut by heap") and c["visibility"] == "ism"]
    if heap:
        text += ("The study's own way, a heap a pixel, " +
                 (f"wins from about {short(heap[0]['lights'])}. " if heap[0]["lights"] else "does not win here either. "))
    text += ("A curve ends where the next point would have taken too long. Time includes making the shadow maps; the study's does "
             "not say.")
    if side and side != 1000:
        text += (f" Our pictures have {side}x{side} pixels here instead of 1000x1000, hence time a pixel; shadow maps "
                 "cost the same for any picture, so a small picture makes them look dearer than they are.")
    if report.data["machine"]["device"].startswith("cpu"):
        text += " The published curves are a GPU's of 2009, ours this machine's processor: compare shapes, not heights."
    return text


def words_figure_5(report):
    text = ("The same race in software. The study saw cuts win from about 5500 lights (interpolated in its table), 1.7 times as "
            "fast at 14 520. ")
    for r in report.facts.get("software_ratios", []):
        text += (f"{r['side']}x{r['side']}, {r['how']}: a cut is {r['ratio']:.3g} times as fast at {short(r['lights'])} lights. ")
    return text + "\"Plain\" is a pixel and a light at a time on one thread, as the study's; SIMD is what the renderer does."


def words_pictures(report):
    text = ("Every method's picture beside the path tracer's, which shares nothing with virtual lights but the scene. "
            "Error pictures: dark violet agrees, yellow is off by half or more; a small number of paths a pixel leaves noise in "
            "the reference, which shows as speckles.")
    if any(r["room"] == "veach-ajar" for r in report.measured("pictures")):
        text += (" veach-ajar is the known weakness: its light comes through the gap of a door, few light paths get through, "
                 "and shadow maps leak there.")
    return text


def words_convergence(report):
    ours = report.measured("convergence")
    side = ours[0]["side"] if ours else 0
    return ("What the study could not ask: how much error is left after how much time? Lower left is better. Errors are against "
            "long path-traced references, with the references' own noise taken out. Virtual lights flatten where their clamp's "
            f"bias is reached; the path tracer goes on as 1/time. {side}x{side} pixels: shadow maps, made once for a picture, pay "
            "off only with more pixels.")


def words_stages(_report):
    return ("Where the time goes as lights are added, and what it takes in memory: each point is a program of its own. Making "
            "lights, tree and maps is linear; a cut's shading hardly grows.")


def words_figure_3(report):
    holes = report.facts.get("map_holes")
    text = ("One light's shadow map of 128x128 texels in false colour (dark: near, yellow: far, grey: nothing drawn). Left: 16 000 "
            "points about a texel large, as the study drew them; middle: after its pull-push with two coarser levels. Right: "
            "ours, which draws each point as a disc in its surface, so that few holes are left to fill.")
    if holes:
        text += f" Holes: {holes['before']}, then {holes['after']}; ours {holes['ours']}, of {holes['texels']} texels."
    return text


def verdict(report):
    then = ("<b>Then (2010):</b> on the GPU plain Instant Radiosity was much faster at every number of lights that fit in memory; "
            "cuts were sublinear, and expected to win beyond. In software they won from about 5500 lights.")
    device = report.data["machine"]["device"]
    parts = []
    for c in report.facts.get("crossings", []):
        if c["fast"] == "cut by packet" and c["lights"]:
            parts.append(f"{short(c['lights'])} lights with {VISIBILITY_NAMES[c['visibility']]}")
    now = f"<b>Now ({html.escape(device)}):</b> "
    now += ("cuts that a packet of pixels chooses together win from about " + ", ".join(parts) + "." if parts
            else "this run was too small to see cuts win.")
    return then, now


SECTIONS = [
    ("table-1", "Table 1: making lights", plot_table_1, words_table_1, ["table-1"]),
    ("figure-1", "Figure 1: a light tree", plot_figure_1,
     lambda r: "Twelve lights (three on the lamp, nine where their light arrives) merged two by two. A pixel is lit by a cut: "
               "nodes that together hold every light once. Here one pixel's, with the bound loosened to 10 % so that it is "
               "small.", []),
    ("table-2-3", "Tables 2 and 3: which lights belong together", plot_cuts, words_cuts, ["table-2-3"]),
    ("figure-2", "Figure 2: filling a hole", plot_figure_2,
     lambda r: "A corner of the map below. Pull halves the map twice, averaging what is there; push fills each hole from the "
               "coarser level.", []),
    ("figure-3", "Figure 3: a shadow map before and after", plot_figure_3, words_figure_3, []),
    ("table-4", "Table 4: filling holes", plot_table_4, words_table_4, ["table-4"]),
    ("figure-4", "Table 5 and figure 4: all lights or a cut?", plot_figure_4, words_figure_4, ["table-5"]),
    ("figure-5", "Table 6 and figure 5: the same in software", plot_figure_5, words_figure_5, ["table-6"]),
    ("convergence", "Error against time", plot_convergence, words_convergence, ["convergence"]),
    ("stages", "Cost of each stage, and memory", plot_stages, words_stages, ["stages"]),
]

STYLE = """
:root { color-scheme: light; }
body { font: 16px/1.55 system-ui, sans-serif; color: #1c1c1c; background: #fff; max-width: 60rem; margin: 0 auto; padding: 1rem; }
h1 { font-size: 1.7rem; line-height: 1.2; } h2 { font-size: 1.2rem; margin-top: 2.5rem; }
.box { background: #f4f6f8; border-left: 4px solid #0072b2; padding: .6rem 1rem; margin: 1rem 0; }
figure { margin: 1rem 0; overflow-x: auto; } figure img { width: 100%; height: auto; } figure.plot img { min-width: 36rem; }
.grid { display: grid; grid-template-columns: repeat(auto-fill, minmax(9rem, 1fr)); gap: .6rem; }
.grid figure { margin: 0; } .grid figcaption { font-size: .8rem; line-height: 1.3; }
.table { overflow-x: auto; } table { border-collapse: collapse; font-size: .8rem; }
th, td { padding: .15rem .5rem; text-align: right; border-bottom: 1px solid #ddd; white-space: nowrap; }
th:first-child, td:first-child { text-align: left; }
tr.published td { color: #777; font-style: italic; }
summary { cursor: pointer; color: #0072b2; } small { color: #555; }
@media print { figure.plot img { min-width: 0; } body { max-width: none; font-size: 10pt; } details[open] summary { display: none; }
  figure, .box { break-inside: avoid; } h2 { break-after: avoid; } }
"""


def cell(value):
    if value is None:
        return ""
    if isinstance(value, float):
        return f"{value:.4g}"
    return html.escape(str(value))


def table_html(report, name):
    table = report.data["tables"].get(name)
    if not table:
        return ""
    head = "".join(f"<th>{html.escape(c.replace('_', ' '))}</th>" for c in table["columns"])
    body = "".join(
        f"<tr class='{html.escape(str(row[-1]).replace(' ', '-'))}'>" + "".join(f"<td>{cell(v)}</td>" for v in row) + "</tr>"
        for row in table["rows"])
    return (f"<details><summary>{html.escape(table['title'])} (figures)</summary><div class='table'><table><tr>{head}</tr>{body}"
            "</table></div></details>")


def embedded(path):
    kind = {"svg": "svg+xml", "png": "png"}[path.suffix[1:]]
    return f"data:image/{kind};base64,{base64.b64encode(path.read_bytes()).decode()}"


def embedded_picture(path):
    """As JPEG where that is smaller: a page with all pictures should stay within a few megabytes."""
    jpeg = io.BytesIO()
    Image.open(path).convert("RGB").save(jpeg, "JPEG", quality=85)
    if jpeg.tell() >= path.stat().st_size:
        return embedded(path)
    return f"data:image/jpeg;base64,{base64.b64encode(jpeg.getvalue()).decode()}"


def section(report, name, title, words, tables):
    image = report.folder / "plots" / f"{name}.svg"
    if name in ("figure-2", "figure-3"):
        image = image.with_suffix(".png")
    parts = [f"<h2 id='{name}'>{html.escape(title)}</h2>", f"<p>{html.escape(words)}</p>",
             f"<figure class='plot'><img src='{embedded(image)}' alt='{html.escape(title)}'></figure>"]
    return "\n".join(parts + [table_html(report, t) for t in tables])


def gallery(report):
    rooms = list(dict.fromkeys(r["room"] for r in report.measured("pictures")))
    if not rooms:
        return ""
    out = ["<h2 id='pictures'>Pictures</h2>", f"<p>{html.escape(words_pictures(report))}</p>"]
    for room in rooms:
        shown = [p for p in report.data["pictures"] if p["id"].startswith(room + "-") and (report.folder / p["file"]).exists()]
        figures = "".join(f"<figure><img loading='lazy' src='{embedded_picture(report.folder / p['file'])}' alt=''>"
                          f"<figcaption>{html.escape(p['caption'])}</figcaption></figure>" for p in shown)
        out.append(f"<h3>{html.escape(room)}</h3><div class='grid'>{figures}</div>")
    return "\n".join(out + [table_html(report, "pictures")])


def machine_text(report):
    m = report.data["machine"]
    return (f"{m['device']}; {m['processor']}, {m['cores']} threads, {m['memory_gib']:.0f} GiB; load average at the start "
            f"{m['load_at_start']:.1f}; lightcuts {m['version']}, commit {m['commit']}; {m['date']}; scale "
            f"\u201c{report.data['scale']}\u201d")


def page(report, drawn):
    then, now = verdict(report)
    checks = report.data["checks"]
    failed = [c for c in checks if not c["good"]]
    check_text = (f"{len(checks)} results were compared with a reference before they were timed; "
                  + ("all agreed." if not failed else f"{len(failed)} did not: see the end."))
    parts = [
        "<!doctype html><html lang='en'><head><meta charset='utf-8'>",
        "<meta name='viewport' content='width=device-width, initial-scale=1'>",
        f"<title>The study, reproduced</title><style>{STYLE}</style></head><body>",
        "<h1>The study, reproduced: is it worth cutting the light tree?</h1>",
        "<p>In 2010 Clemens Arbesser and Thomas Mühlbacher (Vienna University of Technology) asked whether lightcuts with imperfect "
        "shadow maps are possible and sensible on a graphics card. This page repeats their tables and figures with "
        "<code>lightcuts bench study</code> and goes on where they had to stop.</p>",
        f"<div class='box'><p>{then}</p><p>{now}</p></div>",
        f"<p><small>{html.escape(machine_text(report))}. {html.escape(check_text)} The study's own room (its cover picture) was never "
        "published; <code>builtin:study</code> stands for it: a closed room of 10 x 5 x 10 m, one lamp, 40 boxes. Figures in grey "
        "italics and rows marked \u201cpublished\u201d are the study's own; everything else was measured in this run. Bars show "
        "the smallest and the largest of the repeats. Lights are laid out as in the study (n on the lamp, n more from each), one "
        "bounce; their weights are physical, where the study divided once too often by the squared distance.</small></p>"]
    for name, title, _, words, tables in SECTIONS:
        if name in drawn:
            parts.append(section(report, name, title, words(report), tables))
        if name == "figure-5":
            parts.append(gallery(report))
    if failed:
        parts.append("<h2>What did not agree</h2><ul>" +
                     "".join(f"<li>{html.escape(c['what'])}: {html.escape(c['found'])}</li>" for c in failed) + "</ul>")
    if report.data["notes"]:
        parts.append("<h2>Left out</h2><details><summary>what this run did not measure, and why</summary><ul>" +
                     "".join(f"<li>{html.escape(n)}</li>" for n in report.data["notes"]) + "</ul></details>")
    parts.append("<p><small>To repeat: <code>lightcuts bench study "
                 f"{'' if report.data['scale'] == 'full' else '--scale ' + report.data['scale'] + ' '}--report DIR</code>. "
                 "All figures are beside this page in <code>tables/</code> (CSV) and <code>study.json</code>.</small></p></body></html>")
    return "\n".join(p for p in parts if p)


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    report = Report(sys.argv[1])
    drawn = {name for name, _, plot, _, _ in SECTIONS if plot(report)}
    target = report.folder / "index.html"
    temporary = target.with_suffix(".tmp")
    temporary.write_text(page(report, drawn), encoding="utf-8")
    temporary.replace(target)


if __name__ == "__main__":
    main()
