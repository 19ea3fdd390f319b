"""Draws the plots of `lightcuts bench study` and writes its page.

    python3 study_report DIR    DIR holds study.json and pictures/, as the command leaves them

Writes DIR/plots/*.svg and *.png and DIR/index.html, which embeds all it shows. Needs matplotlib; exit status 3 without it.
"""

import sys

try:
    import matplotlib  # noqa: F401
    import PIL  # noqa: F401
except ImportError:
    sys.exit(3)

from page import SECTIONS, page
from report import Report


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    report = Report(sys.argv[1])
    for old in report.plots.glob("*.svg"):
        old.unlink()  # panels of an earlier run would be taken for this one's
    shown = {name for name, _, plot, _, _ in SECTIONS if plot(report)}
    target = report.folder / "index.html"
    temporary = target.with_suffix(".tmp")
    temporary.write_text(page(report, shown), encoding="utf-8")
    temporary.replace(target)


main()
