"""One style for all figures, and a figure that is saved in it as bytes that do not change between runs."""

import os
import re
import textwrap
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path
from typing import Any
from weakref import WeakKeyDictionary

import matplotlib as mpl
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure, SubFigure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from matplotlib.patches import PathPatch
from matplotlib.path import Path as Outline
from matplotlib.ticker import NullFormatter, NullLocator, ScalarFormatter
from numpy.typing import NDArray

from dielast.plots.texts import FIXED, clear_ticks, remainder, typeset

# the colours of Okabe and Ito, ordered so that neighbours also differ in lightness: distinct for the colour-blind and in grey
COLOURS = ("#000000", "#D55E00", "#0072B2", "#E69F00", "#009E73", "#CC79A7", "#56B4E9")
LINES = ("-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)), (0, (9, 2)), (0, (1, 3)))
MARKERS = ("o", "s", "^", "D", "v", "<", ">")  # all of them can be open
# viridis without its lightest end, which is invisible on white; its lightness keeps the order in grey
TEMPERATURES = LinearSegmentedColormap.from_list("temperatures", mpl.colormaps["viridis"](np.linspace(0.0, 0.82, 256)))
SHADE = 0.18  # opacity of a band
COLUMN_WIDTH = 3.4  # inches, one column of a journal page: 86 mm
ACROSS = 3  # panels in a row, at most
LONGEST_LABEL = 58  # characters at column width

STYLE: Any = {
    "font.size": 8,
    "font.family": "DejaVu Sans",
    "mathtext.fontset": "dejavusans",
    "axes.labelsize": 8,
    "axes.titlesize": 8,
    "axes.linewidth": 0.7,
    "axes.unicode_minus": True,
    # smaller and larger numbers have a power of ten, which stands in the label of the axis
    "axes.formatter.limits": (-4, 6),
    "legend.fontsize": 7,
    "legend.frameon": False,
    "lines.linewidth": 1.2,
    "lines.markersize": 3.5,
    "xtick.direction": "in",
    "ytick.direction": "in",
    "xtick.top": True,
    "ytick.right": True,
    "xtick.minor.visible": True,
    "ytick.minor.visible": True,
    "xtick.labelsize": 7.5,
    "ytick.labelsize": 7.5,
    "savefig.dpi": 200,
    # reproducible element names
    "svg.hashsalt": "dielast",
    "svg.fonttype": "path",
    "pdf.fonttype": 42,
}
UNDATED: dict[str, Any] = {
    "png": {"Software": None},
    "svg": {"Date": None, "Creator": None},
    "pdf": {"CreationDate": None, "Producer": None, "Creator": None},
}
"""What each form of file is to hold neither of: dates, versions and names of programs."""


@contextmanager
def style() -> Iterator[None]:
    """Draw in the style of dielast, independent of the user's matplotlib settings."""
    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(STYLE)
        yield


class Layout(ConstrainedLayoutEngine):
    """Constrained layout, in which minor ticks without labels take no part: they need no room, and there are hundreds of them.

    What the numbers at a linear axis leave out, an offset or a power of ten, is put into the label of the axis.
    """

    def __init__(self) -> None:
        super().__init__()
        self._labels: WeakKeyDictionary[Axis, tuple[str, str]] = WeakKeyDictionary()

    def execute(self, fig: Figure) -> None:
        """As matplotlib has it."""
        for axes in fig.axes:
            for axis in (axes.xaxis, axes.yaxis):
                self._complete(axis)
        self._place(fig)
        crowded = [axes for axes in fig.axes if clear_ticks(axes)]
        if crowded:
            self._place(fig)

    def _complete(self, axis: Axis) -> None:
        """Put the offset and the power of ten of the tick labels into the label of the axis."""
        formatter, label = axis.get_major_formatter(), axis.get_label_text()
        plain, complete = self._labels.get(axis, (label, label))
        if not isinstance(formatter, ScalarFormatter) or label not in (complete, plain) or not label:
            return
        formatter.set_locs(list(axis.get_majorticklocs()))
        # matplotlib's text is such as 1e-6+1.2
        power = re.match(r"1e(-?\d+)", formatter.get_offset().replace("\N{MINUS SIGN}", "-"))
        complete = remainder(plain, float(formatter.offset), int(power[1]) if power else 0)
        self._labels[axis] = plain, complete
        axis.set_label_text(complete)
        axis.offsetText.set_visible(False)

    def _place(self, fig: Figure) -> None:
        every = [axis for axes in fig.axes for axis in (axes.xaxis, axes.yaxis)]
        bare: list[Any] = [axis.minor for axis in every if isinstance(axis.minor.formatter, NullFormatter)]
        locators = [ticker.locator for ticker in bare]
        try:
            for ticker in bare:
                ticker.locator = NullLocator()
            super().execute(fig)
        finally:
            for ticker, locator in zip(bare, locators, strict=True):
                ticker.locator = locator


class Sheet(Figure):
    """A figure that is drawn and saved in dielast's style, whoever does so, without dates, versions or random names."""

    def draw(self, renderer: Any) -> None:
        """As matplotlib has it, but for the pass before a figure is saved, which shows nothing: only the layout is needed of it."""
        layout = self.get_layout_engine()
        if isinstance(layout, Layout) and self.canvas.is_saving():
            layout.execute(self)
        else:
            with style():
                super().draw(renderer)

    def savefig(self, fname: Any, **options: Any) -> None:
        """As matplotlib has it; `fname` is a path or an open file."""
        form = options.get("format") or (Path(fname).suffix[1:] if isinstance(fname, str | os.PathLike) else "")
        with style(), warnings.catch_warnings():
            # a figure that matplotlib finds crowded, or a mark that its font lacks, is nothing a user could mend
            warnings.simplefilter("ignore")
            undated = UNDATED.get(form.lower() or "png", {}) | (options.pop("metadata", None) or {})
            super().savefig(fname, **options, metadata=undated or None)


def panels(count: int, title: str | None, widths: Sequence[float] | None = None, height: float = 2.7) -> tuple[Figure, list[Axes]]:
    """A figure with `count` panels in a row, one column wide each, below a title; call within `style()`."""
    figure = sheet(title, count, height)
    return figure, list(figure.subplots(1, count, squeeze=False, width_ratios=widths)[0])


def sheet(title: str | None, columns: float, height: float) -> Sheet:
    """An empty figure of so many column widths, `height` in inches without the `title`, which keeps its line breaks and
    non-breaking spaces. Call within `style()`.
    """
    lines = [line for part in typeset(title or "").splitlines() for line in textwrap.wrap(part, int(56 * columns))]
    figure = Sheet(figsize=(COLUMN_WIDTH * columns, height + 0.17 * len(lines)), layout=Layout())
    if lines:
        # a dollar sign in a text is not the start of a formula
        figure.suptitle("\n".join(lines).replace(FIXED, " "), fontsize=8, parse_math=False)
    return figure


def grid(figure: Figure | SubFigure, count: int, across: int, **shared: Any) -> list[Axes]:
    """The axes of `count` panels, so many `across`; the last row may be shorter: axes without a panel below have tick labels."""
    axes = list(figure.subplots(-(-count // across), across, squeeze=False, **shared).ravel())
    for unused in axes[count:]:
        unused.remove()
    for lowest in axes[max(0, count - across) : count]:
        lowest.tick_params(axis="x", labelbottom=True)
    return axes[:count]


def row_of(count: int) -> int:
    """The number of panels in a row of so many panels."""
    return 2 if count == 4 else min(count, ACROSS)


def letter(axes: Sequence[Axes]) -> None:
    """Give the panels of a figure their letters."""
    for label, place in zip("abcdef", axes, strict=False):
        place.set_title(f"({label})", loc="left")


def line_look(index: int) -> dict[str, Any]:
    """Colour and dashes of the line with this number; they repeat."""
    return {"color": COLOURS[index % len(COLOURS)], "linestyle": LINES[index % len(LINES)]}


def open_marker(index: int, colour: Any) -> dict[str, Any]:
    """The marker of the points with this number, white inside; they repeat."""
    return {"marker": MARKERS[index % len(MARKERS)], "color": colour, "markerfacecolor": "white"}


def spread_indices(count: int, most: int) -> list[int]:
    """At most `most` indices below `count`, evenly spread from the first to the last."""
    return [int(index) for index in np.unique(np.linspace(0, count - 1, min(count, most)).round())]


def say(axes: Axes, words: str) -> None:
    """Words in the middle of axes that have nothing to show."""
    axes.text(0.5, 0.5, words, transform=axes.transAxes, ha="center", va="center", parse_math=False)


def shade(axes: Axes, x: NDArray[np.float64], lower: NDArray[np.float64], upper: NDArray[np.float64], colour: str) -> None:
    """Fill the band from `lower` to `upper` over `x`, all (n,). Where x turns back, as in unloading, the parts of the band may
    overlap: each is outlined in the same sense, as parts in opposite senses would cancel. Where the lower end is minus infinity,
    the band goes down by its whole height below its least end.
    """
    ends = np.concatenate((lower, upper))
    if np.isneginf(lower).any() and np.isfinite(ends).any():
        least, most = float(np.min(ends[np.isfinite(ends)])), float(np.max(ends[np.isfinite(ends)]))
        lower = np.where(np.isneginf(lower), least - (most - least), lower)
    known = np.isfinite(x) & np.isfinite(lower) & np.isfinite(upper)
    x, lower, upper = x[known], lower[known], upper[known]
    if x.size < 2:
        return
    back = np.diff(x) < 0
    turns = [0, *(np.flatnonzero(back[1:] != back[:-1]) + 1).tolist(), x.size - 1]
    outlines = []
    for first, last in pairwise(turns):
        part = np.arange(first, last + 1)[:: -1 if back[first] else 1]
        around = np.concatenate((part, part[::-1], part[:1]))
        height = np.concatenate((lower[part], upper[part[::-1]], lower[part[:1]]))
        outlines.append(Outline(np.column_stack((x[around], height)), closed=True))
    axes.add_patch(PathPatch(Outline.make_compound_path(*outlines), color=colour, alpha=SHADE, linewidth=0))
    axes.autoscale_view()


def entry(label: str, **look: Any) -> Line2D:
    """The entry of a legend for a line, a marker, or both."""
    return Line2D([], [], label=label, **look)


def legend_below(figure: Figure, handles: Sequence[Artist], title: str | None = None) -> Legend:
    """A legend below all axes, clear of the curves."""
    _, columns = grid_of(handles, figure.get_figwidth() / COLUMN_WIDTH)
    return row_legend(figure, handles, columns, loc="outside lower center", fontsize=6.5, title=title, title_fontsize=7)


def row_legend(owner: Figure | Axes, handles: Sequence[Artist], columns: int, **place: Any) -> Legend:
    """A legend of so many columns that is filled row by row; matplotlib fills it column by column."""
    order = [index for first in range(columns) for index in range(first, len(handles), columns)]
    legend = owner.legend(handles=[handles[index] for index in order], ncols=columns, **place)
    columnwise: tuple[list[Any], list[Any]] = (legend.texts, legend.legend_handles)
    for entries in columnwise:
        entries[:] = [entries[order.index(index)] for index in range(len(order))]
    for text in legend.texts:
        # a dollar sign in a text is not the start of a formula
        text.set_parse_math(False)
    return legend


def grid_of(handles: Sequence[Artist], widths: float) -> tuple[int, int]:
    """Rows and columns of a legend below a figure of so many column widths."""
    longest = max((len(str(handle.get_label())) for handle in handles), default=0) + 8
    columns = max(1, min(int(4 * widths), len(handles), int((LONGEST_LABEL + 12) * widths) // longest))
    return -(-len(handles) // columns), columns


def spread(position: NDArray[np.float64], count: int = 60) -> NDArray[np.intp]:
    """Indices of at most `count` points, including the first and the last, evenly spread over `position`: densely sampled points
    must not hide the curve below them, and evenly spaced points stay evenly spaced.
    """
    if position.size <= count:
        return np.arange(position.size)
    order = np.argsort(position, kind="stable")
    ascending = position[order]
    gaps = np.diff(ascending)
    if gaps.max() <= 3 * np.median(gaps):
        # nearly even: take every second, every third, ...
        fewer = (position.size - 1) // -(-position.size // count) + 1
        return np.sort(order[np.linspace(0, position.size - 1, fewer).round().astype(int)])
    apart = float(ascending[-1] - ascending[0]) / (count - 1)
    chosen = [0]
    while (following := int(np.searchsorted(ascending, ascending[chosen[-1]] + apart * (1 - 1e-9)))) < position.size:
        chosen.append(max(following, chosen[-1] + 1))
    if chosen[-1] != position.size - 1:
        chosen[max(1, len(chosen) - 1) :] = [position.size - 1]
    return np.sort(order[chosen])
