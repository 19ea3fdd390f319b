"""How plots look, and how a plot of several panels is saved."""

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402  (the backend is to be chosen first)

# Colours that people with any colour vision tell apart (Okabe and Ito).
BLUE, ORANGE, GREEN, RED, PURPLE, SKY, GREY = (
    "#0072b2", "#e69f00", "#009e73", "#d55e00", "#cc79a7", "#56b4e9", "#7f7f7f")
PALE_ORANGE, PALE_GREEN, PALE_GREY = "#c9a25a", "#7fb8a4", "#bbbbbb"

plt.rcParams.update({
    "font.size": 10, "axes.spines.top": False, "axes.spines.right": False, "axes.grid": True, "grid.alpha": 0.25,
    "lines.linewidth": 1.8, "lines.markersize": 5, "legend.frameon": False, "legend.fontsize": 8,
    "svg.fonttype": "path", "figure.dpi": 110, "svg.hashsalt": "lightcuts"})


class Panels:
    """A plot of one or more panels: one picture with all of them, and one for each, which a narrow screen can stack."""

    def __init__(self, width=4.4, height=3.8, same_y=False):
        self.width, self.height, self.same_y = width, height, same_y
        self.drawings = []

    def add(self, draw, *arguments):
        """`draw(axes, *arguments)` draws the panel; it may be called twice."""
        self.drawings.append((draw, arguments))

    def save(self, folder, name, columns=3):
        """Writes NAME.svg and NAME.png, and NAME-1.svg and so on where panels are several. False where there is none."""
        if not self.drawings:
            return False
        columns = min(columns, len(self.drawings))
        rows = -(-len(self.drawings) // columns)
        figure, grid = plt.subplots(rows, columns, figsize=(self.width * columns, self.height * rows), squeeze=False)
        for axes, (draw, arguments) in zip(grid.flat, self.drawings):
            draw(axes, *arguments)
        used = grid.flat[:len(self.drawings)]
        for axes in grid.flat[len(self.drawings):]:
            axes.axis("off")
        limits = [min(a.get_ylim()[0] for a in used), max(a.get_ylim()[1] for a in used)] if self.same_y else None
        if limits:
            for axes in used:
                axes.set_ylim(*limits)
        write(figure, folder / name, ("svg", "png"))
        if len(self.drawings) == 1:
            return True
        for i, (draw, arguments) in enumerate(self.drawings, 1):
            figure, axes = plt.subplots(figsize=(self.width, self.height))
            draw(axes, *arguments)
            if limits:
                axes.set_ylim(*limits)
            write(figure, folder / f"{name}-{i}", ("svg",))
        return True


def write(figure, path, endings):
    """Saves a figure without its date, so that the same figures give the same files."""
    figure.tight_layout()
    for ending in endings:
        figure.savefig(f"{path}.{ending}", dpi=160, metadata={"Date": None} if ending == "svg" else None)
    plt.close(figure)


def series(rows, x, y, low=None, high=None):
    """Sorted x, y and error bars of rows that have both."""
    good = sorted((r for r in rows if r[x] is not None and r[y]), key=lambda r: r[x])
    bars = None
    if low and all(r.get(low) is not None for r in good):
        bars = [[max(0, r[y] - r[low]) for r in good], [max(0, r[high] - r[y]) for r in good]]
    return [r[x] for r in good], [r[y] for r in good], bars


def curve(axes, rows, x, y, label, colour, style="o-", spread=True):
    """Draws rows as a curve with bars from `low` to `high`; nothing where there are none."""
    xs, ys, bars = series(rows, x, y, "low" if spread else None, "high")
    if xs:
        axes.errorbar(xs, ys, yerr=bars, fmt=style, color=colour, label=label, capsize=2)


def log_log(axes, x, y):
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlabel(x)
    axes.set_ylabel(y)


def legend_below(axes, columns=1):
    axes.legend(fontsize=8, loc="upper center", bbox_to_anchor=(0.5, -0.17), ncols=columns,
                columnspacing=1, handlelength=1.6)
