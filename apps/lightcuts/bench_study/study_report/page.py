"""The study's page: one HTML file that embeds all it shows."""

import base64
import html
import io

from PIL import Image

import plots
import words

# Name of the plot, heading, what draws it, what is said of it, tables below it.
SECTIONS = [
    ("table-1", "Table 1: making lights", plots.table_1, words.table_1, ["table-1"]),
    ("figure-1", "Figure 1: a light tree", plots.figure_1, words.figure_1, []),
    ("table-2-3", "Tables 2 and 3: which lights belong together", plots.tables_2_3, words.tables_2_3, ["table-2-3"]),
    ("figure-2", "Figure 2: filling a hole", plots.figure_2, words.figure_2, []),
    ("figure-3", "Figure 3: a shadow map before and after", plots.figure_3, words.figure_3, []),
    ("table-4", "Table 4: filling holes", plots.table_4, words.table_4, ["table-4"]),
    ("figure-4", "Table 5 and figure 4: all lights or a cut?", plots.figure_4, words.figure_4, ["table-5"]),
    ("figure-5", "Table 6 and figure 5: the same in software", plots.figure_5, words.figure_5, ["table-6"]),
    ("convergence", "Error against time", plots.convergence, words.convergence, ["convergence"]),
    ("stages", "Cost of each stage, and memory", plots.stages, words.stages, ["stages"]),
]
# Sections that show pictures instead of a plot.
PICTURES = {"figure-2": plots.FIGURE_2, "figure-3": plots.FIGURE_3}

STYLE = """
:root { color-scheme: light; }
body { font: 16px/1.55 system-ui, sans-serif; color: #1c1c1c; background: #fff; max-width: 72rem; margin: 0 auto; padding: 1rem; }
h1 { font-size: 1.7rem; line-height: 1.2; margin: .6rem 0; } h2 { font-size: 1.2rem; margin-top: 2.5rem; } p, li { max-width: 50rem; }
.verdict { display: grid; grid-template-columns: minmax(0, 1fr) minmax(12rem, 18rem); gap: 1.5rem; align-items: center; margin: 1rem 0; }
.verdict.alone { grid-template-columns: minmax(0, 1fr); }
.box { background: #f4f6f8; border-left: 4px solid #0072b2; padding: .3rem 1rem; } .box p { margin: .6rem 0; }
.box table { font-size: .9rem; margin: .3rem 0 .6rem; } .box td b { color: #0072b2; } .box td, .box th { padding: .2rem .6rem; } .box th { white-space: normal; }
nav { font-size: .9rem; margin: 1rem 0; } a { color: #0072b2; text-decoration: none; }
figure { margin: 0; } figure img { width: 100%; height: auto; }
.plots, .grid { display: grid; gap: .6rem; margin: 1rem 0; }
.plots { grid-template-columns: repeat(auto-fit, minmax(min(21rem, 100%), 1fr)); } .plots.one { max-width: 40rem; }
.plots.even { grid-template-columns: repeat(auto-fit, minmax(min(27rem, 100%), 1fr)); }
.grid.methods { grid-template-columns: repeat(5, 1fr); align-items: start; } .grid.methods figure { margin-bottom: .5rem; }
.grid.large { grid-template-columns: repeat(auto-fill, minmax(13rem, 1fr)); max-width: 58rem; } .grid.large img { image-rendering: pixelated; }
@media (min-width: 60rem) { .side { display: grid; grid-template-columns: 1fr 1.2fr; gap: 1.5rem; align-items: start; } .side .plots { margin: 0; } }
figcaption { font-size: .8rem; line-height: 1.3; }
.table { overflow-x: auto; } table { border-collapse: collapse; font-size: .8rem; }
@media (max-width: 45rem) { .verdict { grid-template-columns: minmax(0, 1fr); } .box table { font-size: .8rem; } .box td, .box th { padding: .2rem .35rem; }
  .box td:first-child { white-space: normal; } .grid.methods { grid-template-columns: repeat(3, 1fr); }
  .grid.large { grid-template-columns: repeat(2, 1fr); } }
th, td { padding: .15rem .5rem; text-align: right; border-bottom: 1px solid #ddd; white-space: nowrap; }
th:first-child, td:first-child { text-align: left; }
tr.published td { color: #777; font-style: italic; }
summary { cursor: pointer; color: #0072b2; } small { color: #555; }
@media print { body { max-width: none; font-size: 10pt; padding: 0; } details[open] summary { color: inherit; }
  .table { overflow: visible; } table { font-size: 6.5pt; } th, td { padding: 0 .3rem; } figure, .box, tr, .methods { break-inside: avoid; }
  h2, h3, p, summary { break-after: avoid; }
  nav { display: none; } .verdict { grid-template-columns: minmax(0, 1fr) 4.5cm; } .box table { font-size: 8pt; }
  .plots { grid-template-columns: repeat(2, 1fr); } .plots.one { grid-template-columns: 1fr; } .grid.large { grid-template-columns: repeat(4, 1fr); }
  .grid.methods { grid-template-columns: repeat(5, 1fr); } }
"""

# Paper has no hand to open a table with.
OPEN_FOR_PRINT = "addEventListener('beforeprint', () => document.querySelectorAll('details').forEach(d => d.open = true));"


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


def figure(source, caption=""):
    below = f"<figcaption>{html.escape(caption)}</figcaption>" if caption else ""
    return f"<figure><img loading='lazy' src='{source}' alt='{html.escape(caption)}'>{below}</figure>"


def drawn(report, name):
    """What a section shows: its pictures, or the panels of its plot."""
    if name in PICTURES:
        shown = "".join(figure(embedded(report.folder / p["file"]), p["caption"]) for p in report.pictures(PICTURES[name]))
        return f"<div class='grid large'>{shown}</div>"
    panels = sorted(report.plots.glob(f"{name}-[0-9].svg")) or [report.plots / f"{name}.svg"]
    shown = "".join(figure(embedded(panel)) for panel in panels)
    return f"<div class='plots{' one' if len(panels) == 1 else ' even' if len(panels) % 2 == 0 else ''}'>{shown}</div>"


def paragraphs(text):
    return "".join(f"<p>{html.escape(part.strip())}</p>" for part in text.split("\n"))


def section(report, name, title, said, tables):
    alone = name not in PICTURES and not any(report.plots.glob(f"{name}-[0-9].svg"))  # one panel stands beside its text
    beside = f"<div class='{'side' if alone else ''}'><div>{paragraphs(said)}</div>{drawn(report, name)}</div>"
    return "\n".join([f"<h2 id='{name}'>{html.escape(title)}</h2>", beside] + [table_html(report, t) for t in tables])


def gallery(report):
    rooms = list(dict.fromkeys(r["room"] for r in report.measured("pictures")))
    if not rooms:
        return ""
    out = ["<h2 id='pictures'>Pictures</h2>", paragraphs(words.pictures(report))]
    for room in rooms:
        shown = [p for p in report.data["pictures"] if p["id"].startswith(room + "-") and (report.folder / p["file"]).exists()]
        columns = {}
        for p in shown:  # a method's picture, its error and its cut size below each other
            columns.setdefault(p["id"].removesuffix("-error").removesuffix("-size"), []).append(p)
        stacks = "".join("<div>" + "".join(figure(embedded_picture(report.folder / p["file"]), p["caption"].split(": ")[-1]) for p in column) + "</div>"
                         for column in columns.values())
        out.append(f"<h3>{html.escape(room)}</h3><div class='grid methods'>{stacks}</div>")
    return "\n".join(out + [table_html(report, "pictures")])


def machine_text(report):
    m = report.data["machine"]
    return (f"{m['device']}; {m['processor']}, {m['cores']} threads, {m['memory_gib']:.0f} GiB; load average at the start "
            f"{m['load_at_start']:.1f}; lightcuts {m['version']}, commit {m['commit']}; {m['date']}; scale "
            f"\u201c{report.data['scale']}\u201d")


def missing(report, shown):
    """Says which sections this run has nothing of, so that nobody takes a part for the whole."""
    names = [title.split(":")[0] for name, title, _, _, _ in SECTIONS if name not in shown]
    if not report.measured("pictures"):
        names.append("Pictures")
    return f"<p><b>This run is not whole.</b> It has nothing of: {html.escape('; '.join(names))}.</p>" if names else ""


# The picture that stands beside the verdict, where the run made one.
COVER = ["study-cut-rays", "study-all-rays", "study-path"]


def verdict_html(report):
    """The answer, for who reads only the first screen."""
    said, rows, but = words.verdict(report)
    head = ["shadows by", "cuts win from", "with this many lights", "a cut takes", "all lights take", "times as fast"]
    body = "".join(f"<tr><td>{html.escape(r[0])}</td><td><b>{r[1]}</b></td><td>{r[2]}</td><td>{r[3]}</td><td>{r[4]}</td>"
                   f"<td><b>{r[5]}</b></td></tr>" for r in rows)
    table = f"<table><tr>{''.join(f'<th>{h}</th>' for h in head)}</tr>{body}</table>" if rows else ""
    cover = "".join(figure(embedded_picture(report.folder / p["file"]), "builtin:study, which stands for the study\u2019s room")
                    for p in report.pictures(COVER)[:1])
    return (f"<div class='verdict{'' if cover else ' alone'}'><div class='box'><p><b>Then (2010).</b> {html.escape(words.THEN)}</p>"
            f"<p><b>Now ({html.escape(report.data['machine']['device'])}).</b> {html.escape(said)}</p>{table}"
            + (f"<p>{html.escape(but)}</p>" if but else "") + f"</div>{cover}</div>")


def contents(report, shown):
    """Links to the sections that there are."""
    links = []
    for name, title, _, _, _ in SECTIONS:
        if name in shown:
            links.append((name, title.split(":")[0]))
        if name == "figure-5" and report.measured("pictures"):
            links.append(("pictures", "Pictures"))
    return "<nav>" + " \u00b7 ".join(f"<a href='#{name}'>{html.escape(title)}</a>" for name, title in links) + "</nav>"


def command(report):
    """What made this page."""
    backend = "cpu" if report.data["machine"]["device"].startswith("cpu") else "cuda"
    return (f"lightcuts bench study --backend {backend} --scale {report.data['scale']} --budget {report.data['budget_s']:g} "
            "--report DIR")


def page(report, shown):
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
        verdict_html(report), missing(report, shown), contents(report, shown),
        f"<p><small>{html.escape(machine_text(report))}. {html.escape(check_text)} The study's own room (its cover picture) was never "
        "published; <code>builtin:study</code> stands for it: a closed room of 10 x 5 x 10 m, one lamp, 40 boxes. Figures in grey "
        "italics and rows marked \u201cpublished\u201d are the study's own; everything else was measured in this run. Bars show "
        "the smallest and the largest of the repeats. Lights are laid out as in the study (n on the lamp, n more from each), one "
        "bounce; their weights are physical, where the study divided once too often by the squared distance.</small></p>"]
    for name, title, _, say, tables in SECTIONS:
        if name in shown:
            parts.append(section(report, name, title, say(report), tables))
        if name == "figure-5":
            parts.append(gallery(report))
    if failed:
        parts.append("<h2>What did not agree</h2><ul>" +
                     "".join(f"<li>{html.escape(c['what'])}: {html.escape(c['found'])}</li>" for c in failed) + "</ul>")
    if report.data["notes"]:
        parts.append("<h2>Left out</h2><details><summary>what this run did not measure, and why</summary><ul>" +
                     "".join(f"<li>{html.escape(n)}</li>" for n in report.data["notes"]) + "</ul></details>")
    parts.append(f"<p><small>To repeat: <code>{command(report)}</code>. All figures are beside this page in <code>tables/</code> (CSV) "
                 "and <code>study.json</code>.</small></p>")
    parts.append(f"<script>{OPEN_FOR_PRINT}</script></body></html>")
    return "\n".join(p for p in parts if p)
