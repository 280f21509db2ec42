"""Time to failure over voltage for films of a failure map, with the exponential or the inverse power law and bands."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.transforms import ScaledTranslation
from numpy.typing import NDArray

from dielast.plots.looks import Panel
from dielast.plots.style import SHADE, entry, line_look, open_marker, row_legend, say, spread_indices
from dielast.plots.texts import degrees, limits, log_axis, number, prestretched, ticks_within, unit_for
from dielast.simulate.failure_map import FailureMap
from dielast.simulate.lifetime import EXPONENTIAL_LAW, POWER_LAW, ROOM, LifetimeLine

Pair = tuple[int, int]
MOST_LINES = 6
MOST_PANELS = 6
MOST_MARKERS = 25  # for each line
ROW = 0.04  # share of the height of the axes: a row of arrows or markers beyond the times of the log axis
BESIDE = 4.5  # points from an arrow to the marker of its film
LONGEST_BESIDE = 28  # characters of a label in a legend with two columns


@dataclass(frozen=True, slots=True, eq=False)
class LifetimeCurve:
    """A film in the figure: `time`, and `low` and `high` of its band, over voltage; its `index` sets colour, marker and dashes.

    `high` is infinite beyond the horizon. It `survives` if it lives longer than the horizon at every voltage.
    """

    index: int
    label: str
    time: NDArray[np.float64]
    low: NDArray[np.float64]
    high: NDArray[np.float64]
    line: LifetimeLine
    survives: bool

    @property
    def look(self) -> Any:
        """Colour and dashes of the film."""
        return line_look(self.index)

    @property
    def marker(self) -> Any:
        """The marker of the film."""
        return open_marker(self.index, self.look["color"])

    @property
    def fails(self) -> NDArray[np.bool_]:
        """The voltages at which the film fails after a finite time above 0."""
        return np.isfinite(self.time) & (self.time > 0)

    @property
    def open_above(self) -> NDArray[np.bool_]:
        """The voltages at which the band ends beyond the horizon."""
        return np.asarray(np.isfinite(self.low) & np.isposinf(self.high))

    @property
    def down_to_zero(self) -> NDArray[np.bool_]:
        """The voltages at which the film fails at once, or its band begins at time 0."""
        return np.asarray((self.time == 0) | (self.low == 0))


def arrange(result: FailureMap, most: int) -> list[Panel]:
    """The films in panels, at `most` so many in a panel: one panel for few films, else a panel for each temperature, or for each
    prestretch if there are fewer prestretches.
    """
    temperatures, prestretches = result.failure_mode.shape[:2]
    if temperatures * prestretches <= most:
        return [Panel([(i, j) for i in range(temperatures) for j in range(prestretches)])]
    by_temperature = temperatures <= prestretches
    outer, inner = sorted((temperatures, prestretches))
    per_outer = min(-(-inner // most), MOST_PANELS)
    lines = spread_indices(inner, per_outer * most)
    panels = []
    for place in spread_indices(outer, MOST_PANELS // per_outer):
        for part in np.array_split(lines, per_outer):
            films = [(place, int(line)) if by_temperature else (int(line), place) for line in part]
            panels.append(Panel(films, _shared(result, place, by_temperature)))
    return panels


def _shared(result: FailureMap, place: int, by_temperature: bool) -> str:
    return degrees(result.temperature[place]) if by_temperature else film_in_words(result, place)


def film_in_words(result: FailureMap, place: int) -> str:
    """The prestretch of a film, and its electrode share if films differ in that."""
    shares = result.electrode_share
    several = shares is not None and bool(np.any(shares != shares[0]))
    share = f", electrode share {number(float(shares[place]))}" if shares is not None and several else ""
    return prestretched(result.prestretch[place]) + share


def films_of(
    panel: Panel, result: FailureMap, lines: Sequence[LifetimeLine], bounds: tuple[NDArray[np.float64], NDArray[np.float64]] | None
) -> list[LifetimeCurve]:
    """The films of a panel; the label of a film that fails at no voltage states that."""
    unknown = np.full(result.voltage.size, np.nan)
    drawn = []
    for index, (i, j) in enumerate(panel.cases):
        parts = [film_in_words(result, j)] + [degrees(result.temperature[i])] * (result.temperature.size > 1)
        label = ", ".join(part for part in parts if part != panel.title)
        survives = bool(np.all(result.failure_mode[i, j] == "none"))
        if not np.any(np.isfinite(result.time_to_failure[i, j])):
            label += ": survives" if survives else ": no failure found"
        low, high = (unknown, unknown) if bounds is None else (bounds[0][i, j], bounds[1][i, j])
        line = lines[i * len(result.prestretch) + j]
        drawn.append(LifetimeCurve(index, label, result.time_to_failure[i, j], low, high, line, survives))
    return drawn


def draw_panels(all_axes: Sequence[Axes], result: FailureMap, all_films: Sequence[Sequence[LifetimeCurve]]) -> None:
    """Draw the panels, with one scale of time."""
    unit, factor = unit_for("V", float(result.voltage.max()))
    voltage = result.voltage * factor
    every = [film for films in all_films for film in films]
    above = max(sum(bool(film.open_above.any()) for film in films) for films in all_films)
    below = max(sum(bool(film.down_to_zero.any()) for film in films) for films in all_films)
    # the times of the axis; values beyond them stand in separate rows
    shown = _span(every, result, above > 0)
    for axes, films in zip(all_axes, all_films, strict=True):
        axes.set_yscale("log")
        for film in films:
            _band(axes, voltage, film, *shown)
            _times(axes, result.voltage, factor, film)
        axes.set_xlabel(f"voltage [{unit}]")
        if above or below or len(all_axes) > 1 or not any(film.fails.any() for film in every):
            axes.set_ylim(*limits(shown, _share(above), _share(below)))
            # the same voltages in all panels, and in a panel in which no film fails
            axes.update_datalim([(voltage.min(), shown[0]), (voltage.max(), shown[0])])
            axes.autoscale_view(scaley=False)
        log_axis(axes, "y")
        if above or below:
            _rows(axes, voltage, films, below)
            ticks_within(axes, shown)
        if not any(film.fails.any() or np.isfinite(film.low).any() for film in films):
            say(axes, _without_times(films))
        if above:
            axes.axhline(result.horizon, color="0.5", linestyle=":", linewidth=0.8)


def _without_times(films: Sequence[LifetimeCurve]) -> str:
    """What became of films without a time to failure above 0."""
    times = np.concatenate([film.time for film in films])
    if np.all(times == 0):
        return "every film fails at once"
    return "every film survives" if all(film.survives for film in films) else "no time to failure to show"


def _span(films: Sequence[LifetimeCurve], result: FailureMap, opened: bool) -> tuple[float, float]:
    """The shortest and the longest time of the axis, with a margin."""
    values = [np.array([result.horizon])] if opened else []
    for film in films:
        values += [film.time, film.low, film.high]
        if film.line.drawn_law:
            values.append(film.line.drawn(result.voltage[film.fails]))
    joined = np.concatenate(values)
    positive = joined[np.isfinite(joined) & (joined > 0)]
    if not positive.size:
        return result.horizon / 1e3, result.horizon
    return float(positive.min()) / ROOM, float(positive.max()) * ROOM if not opened else 1.2 * float(positive.max())


def _share(rows: int) -> float:
    """Share of the height of the axes for so many rows and a margin."""
    return ROW * (rows + 0.5) if rows else 0.0


def _band(axes: Axes, voltage: NDArray[np.float64], film: LifetimeCurve, low: float, high: float) -> None:
    """Draw the band of a film; an open band extends to the end of the axis."""
    within = np.isfinite(film.low) & ~np.isnan(film.high)
    down, up = film.low.clip(low, high), film.high.clip(low, high)
    look: Any = {"color": film.look["color"], "alpha": SHADE}
    axes.fill_between(voltage, down, up, where=within, linewidth=0.0, **look)
    # a single voltage between others without a band has no area
    alone = within & ~np.append(within[1:], False) & ~np.append(False, within[:-1])
    if alone.any():
        axes.vlines(voltage[alone], down[alone], up[alone], linewidth=4.0, **look)


def _times(axes: Axes, voltage: NDArray[np.float64], factor: float, film: LifetimeCurve) -> None:
    """Draw the times of a film, and the line through them."""
    fails = film.fails
    if not fails.any():
        return
    # at even intervals: a gap would look like a film that survives
    every = list(range(0, int(np.count_nonzero(fails)), max(1, -(-int(np.count_nonzero(fails)) // MOST_MARKERS))))
    axes.plot(voltage[fails] * factor, film.time[fails], linestyle="none", zorder=3, markevery=every, **film.marker)
    if film.line.drawn_law:
        along = np.linspace(voltage[fails][0], voltage[fails][-1], 2 if film.line.drawn_law == EXPONENTIAL_LAW else 50)
        axes.plot(along * factor, film.line.drawn(along), linewidth=0.9, **film.look)


def _rows(axes: Axes, voltage: NDArray[np.float64], films: Sequence[LifetimeCurve], below: int) -> None:
    """Draw a row for each film at its voltages: arrows at open bands, with the marker of the film beside the first, or markers."""
    top = foot = 0
    for film in films:
        if film.open_above.any():
            _arrows(axes, voltage[film.open_above], 1 - ROW * (top + 1), r"$\uparrow$", film)
            top += 1
        if film.down_to_zero.any():
            up = ROW * (foot + 1)
            at_once = film.time == 0
            _arrows(axes, voltage[film.down_to_zero & ~at_once], up, r"$\downarrow$", film)
            along = _thinned(voltage[at_once])
            if along.size:
                place: Any = {"transform": axes.get_xaxis_transform(), "linestyle": "none", "zorder": 3}
                axes.plot(along, np.full(along.size, up), **film.marker, **place)
            foot += 1
    if below:
        axes.plot([0, 1], [_share(below)] * 2, color="0.5", linestyle=":", linewidth=0.8, transform=axes.transAxes)
        axes.text(-0.02, _share(below) / 2, "0", transform=axes.transAxes, ha="right", va="center", fontsize=7.5)


def _arrows(axes: Axes, along: NDArray[np.float64], up: float, marker: str, film: LifetimeCurve) -> None:
    if not along.size:
        return
    along, place = _thinned(along), axes.get_xaxis_transform()
    arrow: Any = {"marker": marker, "markersize": 4.8, "markeredgewidth": 0.2, "color": film.look["color"]}
    axes.plot(along, np.full(along.size, up), transform=place, linestyle="none", zorder=3, **arrow)
    shifted = place + ScaledTranslation(-BESIDE / 72, 0, axes.figure.dpi_scale_trans)
    axes.plot(along[:1], [up], transform=shifted, linestyle="none", zorder=3, **{**film.marker, "markersize": 2.8})


def _thinned(along: NDArray[np.float64]) -> NDArray[np.float64]:
    return along[:: max(1, -(-along.size // MOST_MARKERS))]


def legend(axes: Axes, films: Sequence[LifetimeCurve], note: str | None) -> None:
    """The legend of a panel and a `note`, below the axes, as the curves leave no corner within them free."""
    handles = []
    for film in films:
        dashes: Any = film.look["linestyle"] if film.line.drawn_law else "none"
        handles.append(entry(linestyle=dashes, linewidth=0.9, label=film.label, **film.marker))
    # a legend wider than the figure would spoil its layout
    columns = 2 if len(films) > 1 and max(len(film.label) for film in films) <= LONGEST_BESIDE else 1
    place: Any = {"loc": "upper center", "bbox_to_anchor": (0.5, -0.2)}
    row_legend(axes, handles, columns, title=note, title_fontsize=7, fontsize=6.5, handlelength=3.0, **place)


def notes(all_films: Sequence[Sequence[LifetimeCurve]], interval: str | None, left_out: str | None) -> str | None:
    """The note on lines, bands, arrows and markers at zero, and on the films that are `left_out`."""
    films = [film for panel in all_films for film in panel]
    laws = [law for law in (EXPONENTIAL_LAW, POWER_LAW) if any(film.line.drawn_law == law for film in films)]
    drawn = f"lines: {laws[0]} law" if len(laws) == 1 else "lines: exponential or power law"
    first = [drawn] * bool(laws) + [f"bands: {interval}"] * (interval is not None)
    lineless = any(film.line.points > 2 and not film.line.drawn_law for film in films)
    arrows = ["\N{UPWARDS ARROW} beyond the horizon (dotted)"] * any(film.open_above.any() for film in films)
    arrows += ["\N{DOWNWARDS ARROW} down to 0"] * any(np.any(film.down_to_zero & (film.time != 0)) for film in films)
    at_once = any(np.any(film.time == 0) for film in films)
    lines = [
        "; ".join(first),
        "without a line: no law meets all points" if lineless else "",
        "bands open: " + ", ".join(arrows) if arrows else "",
        "markers at 0: fails at once" if at_once else "",
    ]
    return "\n".join(line for line in (*lines, left_out) if line) or None
