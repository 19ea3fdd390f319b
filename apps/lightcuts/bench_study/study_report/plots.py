"""The plots of the study, one function each. Each returns False where the run has nothing to show."""

import matplotlib
import matplotlib.pyplot as plt
from matplotlib.patches import Rectangle

from style import (BLUE, GREEN, GREY, ORANGE, PALE_GREEN, PALE_GREY, PALE_ORANGE, PURPLE, RED, SKY, Panels, curve,
                   legend_below, log_log, series)
from words import METRICS, VISIBILITY_NAMES, about, is_told, short

METRIC_COLOURS = dict(zip(["walter"] + METRICS, [BLUE, ORANGE, GREEN, RED, PURPLE]))


def table_1(report):
    ours = report.measured("table-1")
    if not ours:
        return False

    def draw(axes):
        curve(axes, report.published("table-1"), "vpls", "seconds", "study (published)", GREY, "s--", False)
        curve(axes, ours, "vpls", "seconds", "ours", BLUE)
        log_log(axes, "VPLs made", "seconds")
        axes.legend()

    panels = Panels(5.2, 3.6)
    panels.add(draw)
    return panels.save(report.plots, "table-1")


def bars_of_metrics(axes, report, lights):
    """Mean cut by metric, the study's beside ours."""
    for i, metric in enumerate(METRICS + ["walter"]):
        then = report.published("table-2-3", lights=lights, metric=metric)
        now = report.measured("table-2-3", lights=lights, metric=metric, builder="agglomerative")
        if then:
            axes.bar(i - 0.2, then[0]["mean_cut"], 0.38, color=PALE_GREY, label="study" if i == 0 else None)
        if now:
            axes.bar(i + (0.2 if then else 0), now[0]["mean_cut"], 0.38, yerr=now[0]["deviation"], capsize=3, color=BLUE,
                     label="ours" if i == 0 else None)
    axes.set_xticks(range(5), ["distance", "+ colour", "+ direction", "+ both", "Walter's"], rotation=30, ha="right")
    axes.set_title(f"{lights} lights", fontsize=10)
    axes.set_ylabel("mean cut")
    axes.grid(axis="x", visible=False)
    axes.margins(y=0.25)
    axes.legend(loc="upper right", ncols=2)


def cuts_by_lights(axes, report):
    for metric, colour in METRIC_COLOURS.items():
        rows = report.measured("table-2-3", metric=metric, builder="agglomerative")
        curve(axes, rows, "lights", "mean_cut", metric, colour, spread=False)
    axes.set_xscale("log")
    axes.set_xlabel("lights")
    axes.set_ylabel("mean cut")
    axes.legend(fontsize=8)


def tables_2_3(report):
    ours = report.measured("table-2-3")
    if not ours:
        return False
    panels = Panels(3.8, 3.9)
    for lights in (110, 930):
        if any(r["lights"] == lights for r in ours):
            panels.add(bars_of_metrics, report, lights)
    panels.add(cuts_by_lights, report)
    return panels.save(report.plots, "table-2-3")


def table_4(report):
    ours = report.measured("table-4")
    if not ours:
        return False
    ways = dict(zip(sorted({r["way"] for r in ours}, reverse=True), (ORANGE, BLUE, GREEN, RED)))

    def texels(rows):
        return [r | {"texels": r["side"] ** 2} for r in rows]

    def draw(axes):
        curve(axes, texels(report.published("table-4")), "texels", "seconds", "study, CUDA (published)", GREY, "s--")
        for way, colour in ways.items():
            curve(axes, texels(r for r in ours if r["way"] == way), "texels", "seconds", f"ours: {way}", colour)
        log_log(axes, "texels of the atlas", "seconds")
        legend_below(axes, 2)

    panels = Panels(5.2, 4.2)
    panels.add(draw)
    return panels.save(report.plots, "table-4")


FRAME_STYLES = {"all lights": (ORANGE, "all lights"), "cut by heap": (GREEN, "cut, a heap a pixel"),
                "cut by heap, 4096 threads": (GREEN, "cut, 4096 heaps at once"),
                "cut by heap, 32768 threads": (PURPLE, "cut, 32768 heaps at once"),
                "cut by packet": (BLUE, "cut, packets")}


def per_pixel(rows):
    """Rows with times in microseconds a pixel, under `us` and its spread."""
    out = []
    for r in rows:
        scale = 1e6 / r["side"] ** 2
        spread = {k: scale * r[k] for k in ("low", "high") if r[k] is not None}
        out.append(r | spread | {"us": scale * r["seconds"]})
    return out


def frames(axes, report, ours, visibility):
    """Time a pixel by number of lights, one visibility."""
    if visibility == "ism":
        for method, colour in (("all lights", PALE_ORANGE), ("cut by heap", PALE_GREEN)):
            for threads, style in (("4096", "s--"), ("32768", "D:")):
                rows = per_pixel(report.published("table-5", method=f"{method}, {threads} threads"))
                name = method.replace("cut by heap", "cut")
                curve(axes, rows, "lights", "us", f"study: {name}, {threads} threads", colour, style, False)
    kept_too = any(r["maps"] == "kept" for r in ours)
    for method, (colour, label) in FRAME_STYLES.items():
        rows = [r for r in ours if r["method"] == method and r["visibility"] == visibility]
        for maps, style in (("made", "o:" if kept_too else "o-"), ("kept", "o-"), (None, "o-")):
            said = f"{label}, maps made too" if maps == "made" and kept_too else label
            curve(axes, [r for r in rows if r["maps"] == maps], "lights", "us", said, colour, style)
    wins = [c for c in report.facts.get("crossings", [])
            if c["visibility"] == visibility and c["fast"] == "cut by packet" and c["lights"]]
    for c, height in zip(wins, (0.02, 0.1)):
        said = f"cut wins from {about(c['lights'])}" + (", maps made too" if c["maps"] == "made" and kept_too else "")
        axes.axvline(c["lights"], color=RED, linewidth=1, linestyle="-.")
        axes.annotate(said, (c["lights"], height), xycoords=("data", "axes fraction"), fontsize=8, color=RED,
                      xytext=(4, 0), textcoords="offset points")
    log_log(axes, "lights", "microseconds a pixel")
    axes.set_title(VISIBILITY_NAMES[visibility], fontsize=10)
    legend_below(axes, 2 if visibility == "ism" else 1)


def figure_4(report):
    ours = per_pixel(report.measured("table-5"))
    if not ours:
        return False
    panels = Panels(4.2, 4.8, same_y=True)
    for visibility in ("ism", "rays", "none"):
        if any(r["visibility"] == visibility for r in ours):
            panels.add(frames, report, ours, visibility)
    return panels.save(report.plots, "figure-4")


def software(axes, report, ours, side):
    """Time of a picture by number of lights, on the CPU."""
    if side == 50:
        for method, colour in (("all lights", PALE_ORANGE), ("cut by heap", PALE_GREEN)):
            rows = report.published("table-6", method=method)
            curve(axes, rows, "lights", "seconds", f"study: {method}", colour, "s--", False)
    for how, style in (("plain, 1 thread", "o-"), ("SIMD, 1 thread", "^-"), ("SIMD, all threads", "v-")):
        for method, colour in (("all lights", ORANGE), ("cut by heap", GREEN), ("cut by packet", BLUE)):
            rows = [r for r in ours if r["how"] == how and r["method"] == method and r["side"] == side]
            curve(axes, rows, "lights", "seconds", f"{method}, {how}", colour, style)
    log_log(axes, "lights", "seconds")
    axes.xaxis.set_minor_formatter(matplotlib.ticker.NullFormatter())
    lights = sorted({r["lights"] for r in ours})
    axes.set_xticks(lights, [short(n) for n in lights])
    axes.set_title(f"{side}x{side} pixels", fontsize=10)
    legend_below(axes, 2)


def figure_5(report):
    ours = report.measured("table-6")
    panels = Panels(4.6, 5)
    for side in sorted({r["side"] for r in ours}):
        panels.add(software, report, ours, side)
    return panels.save(report.plots, "figure-5")


def place_nodes(nodes):
    """Where each node of a drawn tree goes: leaves side by side, parents in the middle above."""
    place, leaves = {}, 0
    # Children before parents: a stack that visits a node twice, for the tree is a list of nodes from its root on.
    stack = [(0, 0, False)]
    while stack:
        i, depth, children_placed = stack.pop()
        node = nodes[i]
        if node["first"] is None:
            place[i] = (leaves, -depth)
            leaves += 1
            continue
        children = sorted((node["first"], node["second"]))
        if children_placed:
            place[i] = (sum(place[c][0] for c in children) / 2, -depth)
            continue
        stack.append((i, depth, True))
        stack.extend((c, depth + 1, False) for c in reversed(children))
    return place


def drawn_tree(axes, nodes):
    place = place_nodes(nodes)
    most = max(n["intensity"] for n in nodes)
    for i, node in enumerate(nodes):
        x, y = place[i]
        for child in (node["first"], node["second"]):
            if child is not None:
                same = nodes[child]["light"] == node["light"]
                axes.plot([x, place[child][0]], [y, place[child][1]], color="#555555" if same else PALE_GREY,
                          linewidth=1.6 if same else 1, zorder=1)
        axes.scatter([x], [y], s=150 + 400 * node["intensity"] / most, color=RED if node["cut"] else "#dfe8f0",
                     edgecolors="#333333", linewidths=0.8, zorder=2)
        axes.annotate(str(node["light"]), (x, y), ha="center", va="center", fontsize=8,
                      color="white" if node["cut"] else "black", zorder=3)
    axes.axis("off")
    axes.margins(0.06)
    axes.set_title("number: the light that stands for a node\narea: its intensity; red: one pixel's cut", fontsize=9)


def lights_from_above(axes, nodes, lights):
    most = max(n["intensity"] for n in nodes)
    for i, (x, z, intensity) in enumerate(lights):
        axes.scatter([x], [z], s=30 + 300 * intensity / most, color=SKY, edgecolors="#333333", linewidths=0.5, zorder=2)
        axes.annotate(str(i), (x, z), fontsize=8, xytext=(4, 4), textcoords="offset points", zorder=3)
    for node in nodes:
        if node["cut"] and node["first"] is not None:
            x0, z0, x1, z1 = node["box"]
            axes.add_patch(Rectangle((x0, z0), x1 - x0, z1 - z0, fill=False, edgecolor=RED, linewidth=1.2))
    axes.set_xlim(-5.2, 5.2)
    axes.set_ylim(5.2, -5.2)
    axes.set_aspect("equal")
    axes.set_title("the room from above;\nboxes: clusters of that cut", fontsize=9)


def figure_1(report):
    tree = report.facts.get("tree")
    if not tree:
        return False
    panels = Panels(4.8, 4)
    panels.add(drawn_tree, tree["nodes"])
    panels.add(lights_from_above, tree["nodes"], tree["lights"])
    return panels.save(report.plots, "figure-1")


def show_picture(axes, report, picture):
    axes.imshow(plt.imread(report.folder / picture["file"]), interpolation="nearest")
    axes.set_title(picture["caption"], fontsize=9)
    axes.axis("off")


def pictures(report, ids, name):
    panels = Panels(3, 3.2)
    for picture in report.pictures(ids):
        panels.add(show_picture, report, picture)
    return panels.save(report.plots, name, 4)


FIGURE_2 = [f"hole-{i}" for i in range(4)]
FIGURE_3 = ["map-before", "map-after", "map-ours"]


def figure_2(report):
    return pictures(report, FIGURE_2, "figure-2")


def figure_3(report):
    return pictures(report, FIGURE_3, "figure-3")


def errors_by_time(axes, ours, room):
    for method, colour, style in (("all lights, rays", ORANGE, "o-"), ("cut, rays", BLUE, "o-"),
                                  ("cut, shadow maps", GREEN, "o-"), ("path tracer", PURPLE, "s--")):
        rows = [r for r in ours if r["room"] == room and r["method"] == method and is_told(r)]
        xs, ys, _ = series(rows, "seconds", "relmse")
        if xs:
            bars = [[max(0, r["seconds"] - r["low"]) for r in sorted(rows, key=lambda r: r["seconds"])],
                    [max(0, r["high"] - r["seconds"]) for r in sorted(rows, key=lambda r: r["seconds"])]]
            axes.errorbar(xs, ys, xerr=bars, fmt=style, color=colour, label=method, capsize=2)
    log_log(axes, "seconds", "relMSE")
    axes.set_title(room, fontsize=10)
    legend_below(axes, 2)


def convergence(report):
    ours = report.measured("convergence")
    panels = Panels(4.6, 4)
    for room in dict.fromkeys(r["room"] for r in ours):
        panels.add(errors_by_time, ours, room)
    return panels.save(report.plots, "convergence", 2)


STAGES = [("bvh_ms", "acceleration structure", GREY), ("vpls_ms", "VPLs", SKY), ("tree_ms", "light tree", GREEN),
          ("maps_ms", "shadow maps", PURPLE), ("shade_ms", "shading", ORANGE)]


def times_of_stages(axes, ours, method):
    rows = sorted((r for r in ours if r["method"] == method), key=lambda r: r["vpls"])
    for key, name, colour in STAGES:
        values = [max(r[key], 0) for r in rows]
        if any(values):
            axes.plot([r["vpls"] for r in rows], [v or None for v in values], "o-", color=colour, label=name)
    log_log(axes, "VPLs", "milliseconds")
    axes.set_title(method, fontsize=10)
    legend_below(axes, 2)


def memory(axes, ours, methods):
    for method, colour in zip(methods, (BLUE, GREEN, ORANGE)):
        rows = [r for r in ours if r["method"] == method]
        curve(axes, rows, "vpls", "host_mb", f"{method}: host", colour, spread=False)
        if any(r["device_mb"] for r in rows):
            curve(axes, rows, "vpls", "device_mb", f"{method}: device", colour, "s--", False)
    log_log(axes, "VPLs", "megabytes")
    axes.set_title("memory, at most", fontsize=10)
    legend_below(axes, 2)


def stages(report):
    ours = report.measured("stages")
    if not ours:
        return False
    methods = list(dict.fromkeys(r["method"] for r in ours))
    panels = Panels(4.4, 4.1)
    for method in methods:
        panels.add(times_of_stages, ours, method)
    panels.add(memory, ours, methods)
    return panels.save(report.plots, "stages", 2)
