"""What the page says of each part of the study, in plain sentences; figures in them come from the run."""

import math

METRICS = ["distance", "distance-color", "distance-direction", "distance-color-direction"]
VISIBILITY_NAMES = {"ism": "shadow maps", "rays": "shadow rays", "none": "no visibility"}


def short(number, digits=3):
    """12345 as "12 300", three digits that count."""
    number = float(number)
    if number >= 100:
        power = int(math.floor(math.log10(number))) - digits + 1
        number = round(number / 10 ** power) * 10 ** power
        return f"{int(round(number)):,}".replace(",", "\u202f")
    return f"{number:.{digits}g}"


def about(number):
    """Of what was interpolated: two digits count."""
    return short(number, 2)


def seconds_text(value):
    return f"{value:.3g} s" if value >= 1 else f"{1e3 * value:.3g} ms" if value >= 1e-3 else f"{1e6 * value:.3g} µs"


def lit_by(crossing):
    """The visibility of a crossing of two curves in words."""
    name = VISIBILITY_NAMES[crossing["visibility"]]
    return name + {"kept": " made before", "made": " made in that time"}.get(crossing["maps"], "")


# The same for a table's first column.
SHADOWS = {("ism", "kept"): "maps made before", ("ism", "made"): "maps made too", ("rays", None): "rays", ("none", None): "none"}


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


def by_builder(rows):
    """How much larger cuts get over trees that are built faster."""
    most = max((r["lights"] for r in rows), default=0)
    cuts = {r["builder"]: r["mean_cut"] for r in rows if r["lights"] == most and r["metric"] == "walter"}
    if not {"agglomerative", "ploc", "morton"} <= cuts.keys():
        return ""
    more = {b: 100 * (cuts[b] / cuts["agglomerative"] - 1) for b in ("ploc", "morton")}
    return (f" Of {short(most)} lights, cuts through the tree that parallel clustering builds (PLOC, our default) are {more['ploc']:.0f} % larger than "
            f"through the study's agglomerative one, through one that follows a space-filling curve {more['morton']:.0f} %.")


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
                  "Colour alone helps here as there. "))
        if not hurts and found[930, "distance-color-direction"] > found[930, "distance-direction"]:
            text += ("On top of direction it does not, as it did there: our bound is on luminance, so lights of different colours in "
                     "one cluster cost nothing, while keeping them apart makes clusters larger.")
        if found.get((930, "walter")):
            text += f" Walter's metric, which the study replaced, gives {found[930, 'walter']:.0f}: it stays our default."
    text += by_builder(rows)
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


def growth(rows, x, y):
    """Power of x that y grows with, between its first and its last row; None where that cannot be said."""
    rows = sorted((r for r in rows if r[x] and r[y] and r[y] > 0), key=lambda r: r[x])
    if len(rows) < 2 or rows[0][x] == rows[-1][x]:
        return None
    return math.log(rows[-1][y] / rows[0][y]) / math.log(rows[-1][x] / rows[0][x])


def how_maps(report):
    """Whether shadow maps were made in the time of a picture, which is preferred, or only before."""
    return "made" if report.measured("table-5", maps="made") else "kept"


def gain(report, visibility, maps):
    """Where both were measured with the most lights: (lights, seconds of all lights, seconds of a cut by packets), or None."""
    rows = report.measured("table-5", visibility=visibility, maps=maps)
    times = {m: {r["lights"]: r["seconds"] for r in rows if r["method"] == m} for m in ("all lights", "cut by packet")}
    both = times["all lights"].keys() & times["cut by packet"].keys()
    return (max(both), *(times[m][max(both)] for m in times)) if both else None


def agreement_on_growth(report):
    """Where the study's curves and ours have the same shape."""
    last = 2550
    then = growth(report.published("table-5", method="cut by heap, 4096 threads"), "lights", "seconds")
    rows = [r for r in report.measured("table-5", method="cut by packet", visibility="ism") if r["lights"] <= last]
    now = growth([r for r in rows if r["maps"] == how_maps(report)], "lights", "seconds")
    if not now:
        return ""
    return ("\nWe agree that the sum over all lights is linear, that cuts grow more slowly, and that with few lights the sum is faster. "
            f"We do not agree on how slowly: from 110 to {last} lights the study's cuts grew with the power {then:.2f} of the lights, "
            f"ours with {now:.2f}, because ours are smaller (tables 2 and 3), and because neighbouring pixels walk the tree "
            "together instead of each keeping a heap in slow memory. ")


def figure_4(report):
    ours = report.measured("table-5")
    side = ours[0]["side"] if ours else 0
    text = ("The study's main question: from how many lights on are cuts worth their trouble? It never saw them win on a GPU: at "
            "2550 lights a cut took 11 to 28 times as long as summing all lights, and memory ended the experiment. ")
    for c in report.facts.get("crossings", []):
        if c["fast"] != "cut by packet":
            continue
        name = lit_by(c)
        text += (f"With {name}, cuts win here from about {about(c['lights'])} lights on. " if c["lights"] else
                 f"With {name}, cuts did not win in the range measured here. ")
    heaps = [c for c in report.facts.get("crossings", []) if c["fast"].startswith("cut by heap") and c["visibility"] == "ism"]
    if heaps:
        wins = [c["lights"] for c in heaps if c["lights"]]
        text += ("The study's own way, a heap a pixel, " +
                 (f"wins from about {about(min(wins))}. " if wins else "does not win here either. "))
    text += agreement_on_growth(report)
    on_cpu = report.data["machine"]["device"].startswith("cpu")
    text += "\nA curve ends where the next point would have taken too long. " + (
        "Time includes making the shadow maps; the study's does not say." if on_cpu else
        "Time is the device's, with the shadow maps of the picture before (the study made its maps before, too, as a step of its "
        "own)" + (" and once with everything made anew: points on the surfaces, and the maps of all lights or of those in the cut."
                  if how_maps(report) == "made" else "."))
    if side and side != 1000:
        text += (f" Our pictures have {side}x{side} pixels here instead of 1000x1000, hence time a pixel; shadow maps "
                 "cost the same for any picture, so a small picture makes them look dearer than they are.")
    if on_cpu:
        text += " The published curves are a GPU's of 2009, ours this machine's processor: compare shapes, not heights."
    return text


def figure_5(report):
    text = ("The same race in software. The study saw cuts win from about 5500 lights (interpolated in its table), 1.7 times as "
            "fast at 14 520; we agree that cuts win much sooner here than on its GPU. ")
    for side in sorted({r["side"] for r in report.facts.get("software_ratios", [])}):
        ratios = [f"{about(r['ratio'])} ({r['how']}, {short(r['lights'])} lights)" for r in report.facts["software_ratios"]
                  if r["side"] == side]
        text += f"At {side}x{side} pixels a cut is so many times as fast: {', '.join(ratios)}. "
    then = one(report.published("table-6"), lights=14520, method="all lights")
    now = one(report.measured("table-6"), lights=14520, method="all lights", how="plain, 1 thread", side=50)
    if then and now:
        text += (f"\nAll 14\u202f520 lights, plain: {seconds_text(then['seconds'])} then, {seconds_text(now['seconds'])} now; the gain of a cut is "
                 "larger here because our cuts are smaller and our trees are built by another metric. ")
    return text + "\u201cPlain\u201d is a pixel and a light at a time on one thread, as the study's; SIMD is what the renderer does."


def leaking(report):
    """Rooms whose picture by shadow maps is much further from the path tracer than by rays."""
    rows = report.measured("pictures")
    out = []
    for room in dict.fromkeys(r["room"] for r in rows):
        rays, maps = (one(rows, room=room, method=f"cut, {name}") for name in ("rays", "shadow maps"))
        if rays and maps and maps["relmse"] > 5 * rays["relmse"]:
            out.append(f"{room} (relMSE {maps['relmse']:.3g} against {rays['relmse']:.2g} by rays)")
    return out


def pictures(report):
    text = ("Every method's picture beside the path tracer's, which shares nothing with virtual lights but the scene. "
            "Error pictures: dark violet agrees, yellow is off by half or more; a small number of paths a pixel leaves noise in "
            "the reference, which shows as speckles. Cuts were first compared with the sum over the same lights.")
    leaks = leaking(report)
    if leaks:
        text += (f"\nShadow maps of 64x64 texels leak badly in {' and '.join(leaks)}: a wall or a lamp's housing nearer to the light than "
                 "a texel can tell lets light through.")
    if any(r["room"] == "veach-ajar" for r in report.measured("pictures")):
        text += (" In veach-ajar light comes through the gap of a door; few light paths get through, so that patterns of single "
                 "virtual lights stay visible. Path tracers need very many paths in both Veach rooms.")
    return text


def is_told(row):
    """Whether an error is larger than what is left of its reference's noise."""
    return row["relmse"] > 2 * (row.get("standard_error") or 0)


def race_of(report, room):
    """One sentence: how long the path tracer needs for the error of a cut."""
    rows = [r for r in report.measured("convergence", room=room) if is_told(r)]
    cuts = [r for r in rows if r["method"] == "cut, rays"]
    paths = sorted((r for r in rows if r["method"] == "path tracer"), key=lambda r: r["seconds"])
    if not cuts or not paths:
        return ""
    # The cut that the path tracer is worst against: its error should lie among those that the path tracer reached, if any does.
    reached = [c for c in cuts if c["relmse"] >= paths[-1]["relmse"]]
    if not reached:
        c = min(cuts, key=lambda r: r["seconds"])
        return (f" {room}: a cut of {short(c['vpls_or_paths'])} lights has relMSE {c['relmse']:.2g} after {seconds_text(c['seconds'])}, "
                f"which the path tracer has not after {seconds_text(paths[-1]['seconds'])} (there {paths[-1]['relmse']:.2g}).")
    c = min(reached, key=lambda r: r["relmse"])
    needed = next(r for r in paths if r["relmse"] <= c["relmse"])
    best = min(cuts, key=lambda r: r["relmse"])
    return (f" {room}: relMSE {c['relmse']:.2g} takes cuts {seconds_text(c['seconds'])} and the path tracer about "
            f"{seconds_text(needed['seconds'])}; cuts reach {best['relmse']:.2g} in {seconds_text(best['seconds'])}.")


def convergence(report):
    ours = report.measured("convergence")
    side = ours[0]["side"] if ours else 0
    text = ("What the study could not ask: how much error is left after how much time? Lower left is better. Errors are against "
            "long path-traced references, with the references' own noise taken out; where what is left is smaller than the chance "
            "in it, no point is drawn. Virtual lights flatten where their clamp's bias (and the cut's own 2 %) is reached; the path "
            "tracer goes on as 1/time.\n")
    for room in dict.fromkeys(r["room"] for r in ours):
        text += race_of(report, room)
    on_cpu = report.data["machine"]["device"].startswith("cpu")
    return text + (f"\n{side}x{side} pixels: shadow maps, made once for a picture, pay off only with more pixels." if on_cpu else
                   f"\n{side}x{side} pixels. Where shadow maps do not leak they give a coarse picture first, and stop at an error of their own.")


def stages(report):
    on_cpu = report.data["machine"]["device"].startswith("cpu")
    text = ("Where the time goes as lights are added, and what it takes in memory: each point is a program of its own, its time "
            "the median of its runs.\n" if on_cpu else
            "Where the time goes as lights are added: the device's time, once its kernels are loaded. Memory is that of a program "
            "that makes one such picture.\n")
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


THEN = ("On a GPU, no: plain Instant Radiosity was 11 to 28 times as fast at 2550 lights, as many as fit in memory. Cuts grew more "
        "slowly, and were expected to win beyond. In software they won from about 5500 lights.")


def verdict(report):
    """What it comes to now: a sentence, rows of a table (visibility, from how many lights, the most lights that both were
    measured with, time of a cut, of all lights, their ratio), and a reservation."""
    ours = [c for c in report.facts.get("crossings", []) if c["fast"] == "cut by packet"]
    wins = sorted(c["lights"] for c in ours if c["lights"])
    rows = []
    for c in ours:
        most = gain(report, c["visibility"], c["maps"])
        if most:
            lights, all_lights, cut = most
            rows.append((SHADOWS[c["visibility"], c["maps"]], about(c["lights"]) if c["lights"] else "not yet", short(lights), seconds_text(cut),
                         seconds_text(all_lights), about(all_lights / cut)))
    if not wins:
        said = "This run was too small to see cuts win."
    else:
        until = f" to {about(wins[-1])}" if len(wins) > 1 else ""
        said = f"Yes, from {about(wins[0])}{until} lights on, where a packet of pixels chooses its cuts together."
    leaks = leaking(report)
    but = f"What shadow maps gain in time they lose in {' and '.join(leaks)}, where they leak." if leaks else ""
    return said, rows, but


def figure_1(_report):
    return ("Twelve lights (three on the lamp, nine where their light arrives) merged two by two. A pixel is lit by a cut: "
            "nodes that together hold every light once. Here one pixel's, with the bound loosened to 10 % so that it is small.")


def figure_2(_report):
    return ("A corner of the map below. Pull halves the map twice, averaging what is there; push fills each hole from the "
            "coarser level.")
