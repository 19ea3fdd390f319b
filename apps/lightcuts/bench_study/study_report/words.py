"""What the page says of each part of the study, in plain sentences; figures in them come from the run."""

import html
import math

METRICS = ["distance", "distance-color", "distance-direction", "distance-color-direction"]
VISIBILITY_NAMES = {"ism": "shadow maps", "rays": "shadow rays", "none": "no visibility"}


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


def lit_by(crossing):
    """The visibility of a crossing of two curves in words."""
    name = VISIBILITY_NAMES[crossing["visibility"]]
    return name + {"kept": " made before", "made": " made in that time"}.get(crossing["maps"], "")


def one(rows, **wanted):
    return next((r for r in rows if all(r.get(k) == v for k, v in wanted.items())), None)


def table_1(report):
    exponent = report.facts.get("table_1_exponent", 0)
    then, now = one(report.published("table-1"), vpls=10000), one(report.measured("table-1"), vpls=10000)
    linear = ("so do we" if 0.75 < exponent < 1.25 else
              "here small numbers do not fill the machine, and only large ones are proportional")
    text = ("How long it takes to shoot light paths and leave a virtual light at each hit. The study found time proportional to "
            f"the number; {linear} (time grows as the number to the power {exponent:.2f}).")
    if then and now:
        text += (f" 10 000 lights took the study {seconds_text(then['seconds'])} on a 3 GHz Core Duo with a box test a model; here "
                 f"{seconds_text(now['seconds'])}, {short(then['seconds'] / now['seconds'])} times faster, with a bounding "
                 "volume hierarchy and newer hardware. The study's room is another one.")
    return text


def tables_2_3(report):
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


def table_4(report):
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


def figure_4(report):
    ours = report.measured("table-5")
    side = ours[0]["side"] if ours else 0
    text = ("The study's main question: from how many lights on are cuts worth their trouble? It never saw them win on a GPU: at "
            "2550 lights a cut took 11 to 28 times as long as summing all lights, and memory ended the experiment. ")
    for c in report.facts.get("crossings", []):
        if c["fast"] != "cut by packet":
            continue
        name = lit_by(c)
        text += (f"With {name}, cuts win here from about {short(c['lights'])} lights on. " if c["lights"] else
                 f"With {name}, cuts did not win in the range measured here. ")
    heaps = [c for c in report.facts.get("crossings", []) if c["fast"].startswith("cut by heap") and c["visibility"] == "ism"]
    if heaps:
        wins = [c["lights"] for c in heaps if c["lights"]]
        text += ("The study's own way, a heap a pixel, " +
                 (f"wins from about {short(min(wins))}. " if wins else "does not win here either. "))
    on_cpu = report.data["machine"]["device"].startswith("cpu")
    text += "A curve ends where the next point would have taken too long. " + (
        "Time includes making the shadow maps; the study's does not say." if on_cpu else
        "Time is the device's, once with the shadow maps of the picture before (the study made its maps before, too, as a step "
        "of its own) and once with everything made anew: points on the surfaces, and the maps of all lights or of those in the cut.")
    if side and side != 1000:
        text += (f" Our pictures have {side}x{side} pixels here instead of 1000x1000, hence time a pixel; shadow maps "
                 "cost the same for any picture, so a small picture makes them look dearer than they are.")
    if on_cpu:
        text += " The published curves are a GPU's of 2009, ours this machine's processor: compare shapes, not heights."
    return text


def figure_5(report):
    text = ("The same race in software. The study saw cuts win from about 5500 lights (interpolated in its table), 1.7 times as "
            "fast at 14 520. ")
    for r in report.facts.get("software_ratios", []):
        text += (f"{r['side']}x{r['side']}, {r['how']}: a cut is {r['ratio']:.3g} times as fast at {short(r['lights'])} lights. ")
    return text + "\"Plain\" is a pixel and a light at a time on one thread, as the study's; SIMD is what the renderer does."


def pictures(report):
    text = ("Every method's picture beside the path tracer's, which shares nothing with virtual lights but the scene. "
            "Error pictures: dark violet agrees, yellow is off by half or more; a small number of paths a pixel leaves noise in "
            "the reference, which shows as speckles. Cuts were first compared with the sum over the same lights.")
    if any(r["room"] == "veach-ajar" for r in report.measured("pictures")):
        text += (" veach-ajar is the known weakness: its light comes through the gap of a door, few light paths get through, "
                 "and shadow maps leak there.")
    return text


def convergence(report):
    ours = report.measured("convergence")
    side = ours[0]["side"] if ours else 0
    return ("What the study could not ask: how much error is left after how much time? Lower left is better. Errors are against "
            "long path-traced references, with the references' own noise taken out. Virtual lights flatten where their clamp's "
            f"bias is reached; the path tracer goes on as 1/time. {side}x{side} pixels: shadow maps, made once for a picture, pay "
            "off only with more pixels.")


def growth(rows, x, y):
    """Power of x that y grows with, between its first and its last row; None where that cannot be said."""
    rows = sorted((r for r in rows if r[x] and r[y] and r[y] > 0), key=lambda r: r[x])
    if len(rows) < 2 or rows[0][x] == rows[-1][x]:
        return None
    return math.log(rows[-1][y] / rows[0][y]) / math.log(rows[-1][x] / rows[0][x])


def stages(report):
    text = "Where the time goes as lights are added, and what it takes in memory: each point is a program of its own."
    ours = report.measured("stages")
    for method in dict.fromkeys(r["method"] for r in ours):
        rows = sorted((r for r in ours if r["method"] == method), key=lambda r: r["vpls"])
        if len(rows) > 1 and rows[0]["shade_ms"] > 0:
            text += (f" {method}: {rows[-1]['vpls'] / rows[0]['vpls']:.0f} times the lights take "
                     f"{rows[-1]['shade_ms'] / rows[0]['shade_ms']:.3g} times as long to shade with.")
    power = growth([r for r in ours if r["method"].startswith("cut")], "vpls", "tree_ms")
    return text + (f" Building the tree grows with the power {power:.2f} of the lights." if power else "")


def figure_3(report):
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
            parts.append(f"{short(c['lights'])} lights with {lit_by(c)}")
    now = f"<b>Now ({html.escape(device)}):</b> "
    now += ("cuts that a packet of pixels chooses together win from about " + ", ".join(parts) + "." if parts
            else "this run was too small to see cuts win.")
    return then, now


def figure_1(_report):
    return ("Twelve lights (three on the lamp, nine where their light arrives) merged two by two. A pixel is lit by a cut: "
            "nodes that together hold every light once. Here one pixel's, with the bound loosened to 10 % so that it is small.")


def figure_2(_report):
    return ("A corner of the map below. Pull halves the map twice, averaging what is there; push fills each hole from the "
            "coarser level.")
