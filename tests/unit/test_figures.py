"""The figures of recipes as a referee reads them: nothing is hidden, nothing promised that is not there, and words are print."""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterator
from functools import cache
from importlib import import_module
from itertools import combinations, pairwise
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from matplotlib.text import Text

from dielast.base.errors import DielastWarning, InputError
from dielast.commands.registry import COMMANDS, read_cases
from dielast.io.files import Inputs
from dielast.plots.events import Curve
from dielast.plots.looks import Swept
from dielast.plots.simulation import plot_cases
from dielast.plots.style import style
from dielast.sharing.execution import Execution

RELAX = 'kind = "relax"\nmaterial = "example:vhb4905.toml"\n[[step]]\nstretch = 2.0\n[[step]]\nhold = "1 h"\n'
FILM = """
kind = "actuate"
material = "example:vhb4905.toml"
[film]
thickness = "0.5 mm"
prestretch = 1.9
relax = "1.5 h"
[[step]]
voltage = "3 kV"
[[step]]
hold = "10 min"
[breakdown]
field = "48 MV/m"
[solver]
rtol = 1e-4
"""
CREEP = 'kind = "creep"\nmaterial = "example:vhb4905.toml"\n[[step]]\nstress = "50 kPa"\n[[step]]\nhold = "1 h"\n'
COARSE = "[output]\npoints_per_decade = 3\n"
VOLTAGES = '[sweep]\n"step.0.voltage" = ["2.5 kV", "2.75 kV", "3 kV", "3200 V", "3.4 kV", "3.5 kV"]\n'
FACTORS = """[sweep]
"step.0.voltage" = ["2 kV", "3 kV", "3.5 kV"]
"film.prestretch" = [1.7, 1.9, [3.0, 1.0]]
temperature = ["-10 degC", "20 degC", "40 degC"]
"""
SCATTER = '[uncertainty]\ndraws = 19\nthickness = "2 %"\n'
MAP = """
kind = "failure-map"
material = "example:vhb4905.toml"
temperature = ["-10 degC", "20 degC"]
horizon = "24 h"
[film]
thickness = "0.5 mm"
prestretch = [1.7, 1.9]
relax = "1.5 h"
[voltage]
values = ["3 kV", "4 kV", "5 kV"]
[solver]
rtol = 1e-4
"""
SWEEPS = """
kind = "mastercurve"
[data]
file = "example:frequency-sweeps.csv"
columns = { temperature = "temperature", frequency = "frequency", storage = "storage_modulus", loss = "loss_modulus" }
[shift]
reference_temperature = "20 degC"
"""
RELAXATION = """
kind = "mastercurve"
[data]
file = "example:relaxation-test.csv"
columns = { temperature = "temperature", time = "time", modulus = "relaxation_modulus" }
[shift]
reference_temperature = "20 degC"
"""
SPECTRUM = """
kind = "spectrum"
mastercurve = "example:mastercurve"
[fit]
equilibrium_modulus = "78 kPa"
[material]
name = "a film"
"""
DATA = Path(__file__).parents[1] / "golden/data"
CURVES = """
kind = "mastercurve"
[data]
file = "{}"
columns = {{ temperature = "temperature", time = "time", {} = "{}" }}
[shift]
reference_temperature = "20 degC"
"""
EVERY = {
    "relaxation": RELAX,
    "one point": RELAX + '[output]\ntimes = ["1 h"]\n',
    "creep": CREEP + COARSE,
    "days": CREEP.replace("1 h", "1 d") + '[[step]]\nstress = "0 kPa"\n[[step]]\nhold = "1 d"\n' + COARSE,
    "three films": FILM + COARSE + '[sweep]\n"film.prestretch" = [1.9, [3.0, 1.0], [2.0, 1.5]]\n',
    "27 films": FILM + COARSE + FACTORS,
    "six bands": FILM + COARSE + VOLTAGES + SCATTER,
    "map": MAP,
    "bands of a map": MAP + SCATTER,
    "sweeps": SWEEPS,
    "master curve": RELAXATION,
    "creep curves": CURVES.format(DATA / "creep.csv", "compliance", "compliance"),
    "shifted curves": CURVES.format(DATA / "relaxation.csv", "modulus", "modulus") + 'vertical = "free"\n',
    "spectrum": SPECTRUM,
}


def figure_of(folder: Path, recipe: str) -> Figure:
    """The figure of a recipe."""
    path = folder / "r.toml"
    path.write_text(recipe)
    cases = read_cases(path)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DielastWarning)
        figure = COMMANDS[cases[0].recipe.kind].run(cases, Inputs(folder), Execution()).figure()
    assert isinstance(figure, Figure)
    return figure


@cache
def figure_of_kind(kind: str) -> Figure:
    """The figure of a kind, drawn once."""
    with TemporaryDirectory() as folder:
        figure = figure_of(Path(folder), EVERY[kind])
    FigureCanvasAgg(figure)
    figure.draw_without_rendering()
    return figure


LONG = {"27 films", "bands of a map", "creep curves", "master curve", "sweeps"}


@pytest.fixture(scope="module", params=[pytest.param(kind, marks=[pytest.mark.trust] if kind in LONG else []) for kind in EVERY])
def every(request: pytest.FixtureRequest) -> Figure:
    """One figure of each kind."""
    return figure_of_kind(request.param)


def legends_of(figure: Figure) -> list[Legend]:
    return [*figure.legends, *(legend for axes in figure.axes if (legend := axes.get_legend()) is not None)]


def names_of(figure: Figure) -> list[str]:
    return [text.get_text() for legend in legends_of(figure) for text in legend.get_texts()]


def lines_of(axes: Axes) -> list[Line2D]:
    """Curves, which events and measured points are not."""
    return [line for line in axes.get_lines() if line.get_linestyle() not in ("None", "")]


def words_of(figure: Figure) -> Iterator[str]:
    for text in figure.findobj(Text):
        if isinstance(text, Text) and text.get_visible() and "$" not in text.get_text():
            yield text.get_text()


def test_a_legend_lies_over_no_curve(every: Figure) -> None:
    for legend in legends_of(every):
        box = legend.get_window_extent()
        for axes in every.axes:
            frame = axes.get_window_extent()
            width = min(box.x1, frame.x1) - max(box.x0, frame.x0)
            height = min(box.y1, frame.y1) - max(box.y0, frame.y0)
            assert min(width, height) < 1.0, names_of(every)


def test_words_do_not_lie_over_each_other(every: Figure) -> None:
    texts = [text for legend in legends_of(every) for text in legend.get_texts()]
    texts += [title for axes in every.axes for title in (axes.title, axes._left_title, axes._right_title)]
    texts += [axis.label for axes in every.axes for axis in (axes.xaxis, axes.yaxis) if axis.label.get_visible()]
    boxes = [text.get_window_extent() for text in texts if text.get_text()]
    for box in boxes:
        assert every.bbox.x0 <= box.x0 < box.x1 <= every.bbox.x1
        assert every.bbox.y0 <= box.y0 < box.y1 <= every.bbox.y1
    for one, other in combinations(boxes, 2):
        assert min(one.x1, other.x1) - max(one.x0, other.x0) < 1 or min(one.y1, other.y1) - max(one.y0, other.y0) < 1
    with style():  # on whose font the number of ticks depends
        for axes in every.axes:
            low, high = axes.get_xlim()
            shown = axes.xaxis.get_tick_params()["labelbottom"]
            labels = [
                label for label in axes.get_xticklabels() if shown and label.get_text() and low <= label.get_position()[0] <= high
            ]
            ends = sorted((box.x0, box.x1) for box in (label.get_window_extent() for label in labels))
            assert all(one[1] + 4 < other[0] for one, other in pairwise(ends))


def test_no_marker_lies_outside_the_frame(every: Figure) -> None:
    for axes in every.axes:
        frame = axes.get_window_extent()
        for line in axes.get_lines():
            if line.get_marker() in ("None", "", None):
                continue
            for x, y in line.get_transform().transform(np.column_stack([line.get_xdata(), line.get_ydata()]).astype(float)):
                if np.isfinite(x) and np.isfinite(y) and not line.get_clip_on():
                    raise AssertionError(f"{line.get_marker()} is not kept within the axes")
                assert not np.isfinite(x + y) or frame.x0 - 1 <= x <= frame.x1 + 1
                assert not np.isfinite(x + y) or frame.y0 - 1 <= y <= frame.y1 + 1


def test_minus_signs_are_no_hyphens_and_words_no_recipe(every: Figure) -> None:
    for text in words_of(every):
        assert not re.search(r"(?<![\w)])-\.?\d", text), text
        assert not re.search(r"[\[{][^\]]*[,=]|degC", text), text


def test_every_figure_says_temperature_and_film(every: Figure, request: pytest.FixtureRequest) -> None:
    head = every.get_suptitle()
    assert "20 °C" in head or "\N{MINUS SIGN}10 °C to 40 °C" in head
    kind = request.node.callspec.params["every"]
    if "film" in kind or "band" in kind or kind == "map":
        assert "VHB 4905 (reconstruction)" in head.replace("\n", " ")
        assert "film 0.5 mm" in head.replace("\n", " ")
        assert "relaxed 1.5 h" in head.replace("\n", " ")
    if kind in ("six bands", "bands of a map", "map"):
        assert "prestretch 1.9" in head.replace("\n", " ") or "prestretch 1.7 to 1.9" in head.replace("\n", " ")
    if kind == "spectrum":
        assert "a film" in head


def test_legends_read_row_by_row_in_order(every: Figure) -> None:
    for legend in legends_of(every):
        texts = legend.get_texts()
        boxes = [text.get_window_extent() for text in texts]
        read = sorted(range(len(texts)), key=lambda index: (-round(boxes[index].y0 / 8), boxes[index].x0))
        assert [texts[index].get_text() for index in read] == [text.get_text() for text in texts]
    quantities = [re.fullmatch(r"(?:\w+ = |prestretch )([\d.]+)(?: kV| °C)?", name) for name in names_of(every)]
    numbers = [float(found[1]) for found in quantities if found is not None]
    by_panel = len({id(legend) for legend in legends_of(every)}) > 1
    assert by_panel or numbers == sorted(numbers)


def test_one_point_has_a_marker() -> None:
    (axes,) = figure_of_kind("one point").axes
    (line,) = axes.get_lines()
    assert line.get_marker() not in ("None", "", None)
    assert np.asarray(line.get_xdata()).tolist() == [3600.0]


@pytest.mark.filterwarnings("ignore::dielast.base.errors.DielastWarning")
def test_a_sweep_of_the_voltage_is_a_curve_of_stretch_over_voltage(tmp_path: Path) -> None:
    recipe = FILM + COARSE + VOLTAGES + '[plot]\nx = "step[0].voltage"\n'
    figure = figure_of(tmp_path, recipe)
    (axes,) = figure.axes
    assert axes.get_xlabel() == "voltage [kV]"
    assert "after 10 min" in figure.get_suptitle()
    (curve,) = lines_of(axes)
    assert curve.get_marker() == "o"
    cases = read_cases(tmp_path / "r.toml")
    report = import_module("dielast.commands.actuate.run").run(cases, Inputs(tmp_path), Execution())
    table = {column.name: np.asarray(column.values) for column in report.tables["actuate.csv"]}
    ends = [table["relative_stretch_1"][table["case"] == case][-1] for case in range(6)]
    # at 3.5 kV it breaks down before
    assert np.asarray(curve.get_xdata()).tolist() == [2.5, 2.75, 3.0, 3.2, 3.4]
    assert np.asarray(curve.get_ydata()) == pytest.approx(ends[:5])
    (failed,) = [line for line in axes.get_lines() if line.get_marker() == "x"]
    assert np.asarray(failed.get_xdata()).tolist() == [3.5]
    assert np.asarray(failed.get_ydata()) == pytest.approx(ends[5])


@pytest.mark.parametrize(
    ("specimen", "section"), [('gauge_length = "50 mm"', False), ('width = "10 mm"\nthickness = "1 mm"', True)]
)
def test_a_cross_section_is_in_the_title_if_it_is_stated(tmp_path: Path, specimen: str, section: bool) -> None:
    title = figure_of(tmp_path, f"{RELAX}{COARSE}[specimen]\n{specimen}\n").get_suptitle()
    assert ("section 10" in title) is section


def test_isochrones_join_equal_times_across_cases(tmp_path: Path) -> None:
    recipe = RELAX + '[output]\ntimes = ["1 s", "1 min", "1 h"]\n[sweep]\n"step.0.stretch" = [2.0, 1.2, 1.5]\n'
    figure = figure_of(tmp_path, recipe + '[plot]\nx = "step.0.stretch"\n')
    (axes,) = figure.axes
    assert [np.asarray(line.get_xdata()).tolist() for line in lines_of(axes)] == [[1.2, 1.5, 2.0]] * 3
    assert names_of(figure) == ["after 1 s", "after 1 min", "after 1 h"]
    # relaxation: every later line lies lower
    heights = np.array([line.get_ydata() for line in lines_of(axes)])
    assert np.all(np.diff(heights, axis=0) < 0)
    with pytest.raises(InputError, match=r'plot\.x: "step\.1\.hold" is no column of the result; .* swept are step\.0\.stretch$'):
        figure_of(tmp_path, recipe + '[plot]\nx = "step.1.hold"\n')
    with pytest.raises(InputError, match=r"plot\.x: the values of material are on no scale"):
        figure_of(tmp_path, RELAX + '[sweep]\nmaterial = ["example:vhb4905.toml"]\n[plot]\nx = "material"\n')


def test_isochrones_over_a_column(tmp_path: Path) -> None:
    """Stress over strain of creep tests, after equal times."""
    sweep = '[sweep]\n"step.0.stress" = ["10 kPa", "20 kPa", "40 kPa"]\n'
    recipe = CREEP + '[output]\ntimes = ["1 s", "1 h"]\n' + sweep
    axes = '[plot]\nx = "stretch_1 [1]"\ny = "nominal_stress_1 [Pa]"\n'
    figure = figure_of(tmp_path, recipe + axes + 'join = "cases"\n')
    assert [np.asarray(line.get_ydata()).round(6).tolist() for line in lines_of(figure.axes[0])] == [[10, 20, 40]] * 2
    assert names_of(figure) == ["after 1 s", "after 1 h"]
    assert len(lines_of(figure_of(tmp_path, recipe + axes).axes[0])) == 3
    # what is the same at all times of a case is on a line across cases, or one case would be a point
    film = FILM + '[output]\ntimes = ["1 s", "10 min"]\n[sweep]\n"step.0.voltage" = ["1 kV", "2 kV", "3 kV"]\n'
    figure = figure_of(tmp_path, film + '[plot]\nx = "voltage [V]"\n')
    assert [np.asarray(line.get_xdata()).tolist() for line in lines_of(figure.axes[0])] == [[1, 2, 3]] * 2
    for plot, told in (
        ('[plot]\njoin = "cases"\n', 'plot: join = "cases" needs a [sweep] and an x other than time [s]'),
        (
            '[plot]\nx = "step.0.stress"\njoin = "times"\n',
            'plot: join = "times" needs a column of the result as x; over the swept key step.0.stress state join = "cases"',
        ),
    ):
        with pytest.raises(InputError) as caught:
            figure_of(tmp_path, recipe + plot)
        assert any(told in line for line in caught.value.messages)


def test_a_second_factor_makes_lines_of_its_own(tmp_path: Path) -> None:
    recipe = RELAX + '[sweep]\n"step.0.stretch" = [1.2, 1.5, 2.0]\ntemperature = ["0 degC", "20 degC"]\n'
    figure = figure_of(tmp_path, recipe + COARSE + '[plot]\nx = "step.0.stretch"\n')
    (axes,) = figure.axes
    assert [len(np.asarray(line.get_xdata())) for line in lines_of(axes)] == [3, 3]
    assert names_of(figure) == ["temperature = 0 °C", "temperature = 20 °C"]


def test_six_bands_have_a_panel_each_and_27_films_one_for_each_pair_of_factors(tmp_path: Path) -> None:
    figure = figure_of_kind("six bands")
    assert [axes.get_title("left") for axes in figure.axes] == [f"voltage = {value} kV" for value in (2.5, 2.75, 3, 3.2, 3.4, 3.5)]
    assert [sum(isinstance(own, PolyCollection) for own in axes.collections) for axes in figure.axes] == [1] * 6
    figure = figure_of(tmp_path, EVERY["27 films"])
    assert len(figure.axes) == 9
    for axes in figure.axes:
        assert len(lines_of(axes)) == 3
        # in grey
        assert len({str(line.get_linestyle()) for line in lines_of(axes)}) == 3
    times = " \N{MULTIPLICATION SIGN} "
    assert [axes.get_title("left") for axes in figure.axes][:3] == [
        f"voltage = 2 kV, prestretch = {value}" for value in ("1.7", "1.9", f"3{times}1")
    ]
    assert names_of(figure)[:3] == ["temperature = \N{MINUS SIGN}10 °C", "temperature = 20 °C", "temperature = 40 °C"]


def test_a_band_ends_open_where_too_many_films_have_failed(tmp_path: Path) -> None:
    figure = figure_of(tmp_path, FILM.replace("3 kV", "3.5 kV") + SCATTER.replace("2 %", "5 %"))
    (axes,) = figure.axes
    (band,) = [own for own in axes.collections if isinstance(own, PolyCollection)]
    ends = max(np.asarray(path.vertices)[:, 0].max() for path in band.get_paths())
    (curve,) = lines_of(axes)[:1]
    assert ends < np.max(np.asarray(curve.get_xdata(), dtype=float))
    (arrow,) = [line for line in axes.get_lines() if line.get_marker() == r"$\uparrow$"]
    assert np.asarray(arrow.get_xdata()) == pytest.approx([ends])
    assert any("open: too many films have failed" in name for name in names_of(figure))


def test_after_a_failure_the_line_is_dimmed(tmp_path: Path) -> None:
    figure = figure_of(tmp_path, FILM.replace("3 kV", "3.5 kV") + COARSE + '[stop]\nat = "end"\n')
    (axes,) = figure.axes
    before, after = lines_of(axes)
    (breakdown,) = [line for line in axes.get_lines() if line.get_marker() == "x"]
    assert before.get_alpha() is None
    assert to_rgba(str(before.get_color())) == to_rgba(str(after.get_color()))
    assert float(after.get_alpha() or 1) < 0.5
    (at,) = np.asarray(breakdown.get_xdata(), dtype=float)
    assert np.asarray(before.get_xdata())[-1] == at == np.asarray(after.get_xdata())[0]


@pytest.mark.parametrize(
    ("recipe", "scale"),
    [
        (CREEP, "log"),
        (CREEP + '[[step]]\nstress = "0 kPa"\n[[step]]\nhold = "1 h"\n', "linear"),
        (CREEP + '[[step]]\nstress = "0 kPa"\n[[step]]\nhold = "1 h"\n[plot]\nx_scale = "log"\n', "log"),
        (RELAX, "log"),
        (RELAX + '[[step]]\nstretch = 1.5\nrate = "-1 %/s"\n', "linear"),
    ],
)
def test_a_history_that_goes_on_after_a_hold_is_on_a_linear_axis(tmp_path: Path, recipe: str, scale: str) -> None:
    (axes,) = figure_of(tmp_path, recipe + COARSE).axes
    assert axes.get_xscale() == scale


def test_a_profile_says_which_film_of_a_sweep_it_is_of(tmp_path: Path) -> None:
    recipe = FILM.replace("[film]", '[film]\nboundary = "frame"\nelectrode_share = 0.1') + COARSE + 'profile = ["1 s"]\n'
    (tmp_path / "r.toml").write_text(recipe + '[sweep]\n"film.electrode_share" = [0.3, 0.6]\n')
    cases = read_cases(tmp_path / "r.toml")
    outcome = COMMANDS["actuate"].run(cases, Inputs(tmp_path), Execution())
    figure = outcome.figures["profile"]()
    title = " ".join(text.get_text() for text in figure.findobj(Text))
    assert "electrode share = 0.3" in title.replace("\N{NO-BREAK SPACE}", " ")


def test_no_band_goes_across_cycles_that_are_left_out(tmp_path: Path) -> None:
    waveform = '[[step]]\nwaveform = "triangle"\nhigh = "1 kV"\nperiod = "10 s"\ncycles = 6\n'
    film = FILM[: FILM.index("[[step]]")] + waveform + "[output]\npoints_per_decade = 3\ncycles = [1, 6]\n"
    (axes,) = figure_of(tmp_path, film + SCATTER + "[solver]\nrtol = 1e-4\n").axes
    spans = [np.ptp(path.vertices[:, 0]) for band in axes.collections for path in band.get_paths()]
    assert len(spans) == 2
    assert max(spans) < 11.0


def test_a_band_that_turns_back_is_filled_where_its_parts_overlap() -> None:
    from dielast.plots.style import shade

    figure = Figure()
    axes = figure.subplots()
    x = np.array([1.0, 2.0, 3.0, 2.0, 1.0])
    shade(axes, x, np.array([0.0, 1.0, 2.0, 0.5, 0.0]), np.array([2.0, 3.0, 4.0, 2.5, 2.0]), "k")
    outline = axes.patches[0].get_path()
    areas = []
    for corners in outline.to_polygons(closed_only=True):
        across, up = np.asarray(corners).T
        areas.append(0.5 * np.sum(across[:-1] * up[1:] - across[1:] * up[:-1]))
    assert areas == pytest.approx([4.0, 4.0])  # of one sign: the winding numbers add up


RUBBER = """
reference_temperature = "20 degC"
equilibrium.shear_modulus = "30 kPa"
nonequilibrium = { relaxation_time_s = [0.3], shear_modulus_Pa = [1e4] }
shift.law = "none"
"""

LIVES = """
kind = "lifetime"
material = "m.toml"
[data]
file = "failures.csv"
[film]
thickness = "0.5 mm"
prestretch = 1.9
boundary = "clamped"
[fit]
law = "inverse-power"
[uncertainty]
draws = 0
"""


@pytest.mark.parametrize(
    ("times", "drawn"),
    [
        ((2000, 3000, 4400, 600, 900, 1300, 200, 280, 420), True),
        ((90, 9000, 700, 20, 3000, 12000, 8000, 30, 500), False),
    ],
    ids=["determined", "open"],
)
def test_a_line_over_the_voltage_is_drawn_where_failures_determine_it(times: tuple[int, ...], drawn: bool, tmp_path: Path) -> None:
    rows = [f"{volt},{time}" for volt, time in zip(np.repeat([4.0, 4.2, 4.4], 3), times, strict=True)]
    (tmp_path / "failures.csv").write_text("\n".join(["voltage [kV],time [s]", *rows]))
    (tmp_path / "m.toml").write_text(f'{RUBBER}dielectric.permittivity = "4e-11 F/m"\n')
    _, lives = figure_of(tmp_path, LIVES).axes
    dotted = [line for line in lines_of(lives) if to_rgba(line.get_color()) == to_rgba("0.25")]
    assert [bool(np.all(np.isfinite(np.asarray(line.get_ydata(), dtype=float)))) for line in dotted] == [drawn]


ANY_FILM = """
kind = "actuate"
title = "A film"
material = "example:vhb4905.toml"
[film]
thickness = "0.5 mm"
prestretch = 1.9
relax = "10 min"
[solver]
rtol = 1e-3
"""

CYCLES = """
[[step]]
stretch = 1.15
duration = "10 s"
[[step]]
waveform = "sine"
low = 1.15
high = 1.2
period = "1 s"
cycles = {}
"""

ANY_RUBBER = 'kind = "relax"\nmaterial = "m.toml"\n[solver]\nrtol = 1e-3\n[output]\npoints_per_decade = 2\n'


def figure_and_headline(folder: Path, steps: str, head: str = ANY_FILM) -> tuple[Figure, dict[str, Any]]:
    path = folder / "a.toml"
    path.write_text(head + steps)
    kind = "actuate" if head == ANY_FILM else "relax"
    report = COMMANDS[kind].run(read_cases(path, kind), Inputs(folder), Execution())
    return report.figure(), dict(report.headline)


def test_many_cycles_are_drawn_and_named_by_their_numbers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("dielast.commands.simulation.cases.KEPT_WHOLE", 10)  # of which 11 are too many
    (tmp_path / "m.toml").write_text(RUBBER)
    figure, summary = figure_and_headline(tmp_path, CYCLES.format(11), ANY_RUBBER)
    labels = [axes.get_ylabel() for axes in figure.axes]
    assert labels == ["amplitude of the nominal stress [kPa]", "phase [rad]", "work [kJ/m³]"]
    assert all(axes.lines[0].get_xdata()[-1] == 11 for axes in figure.axes)
    assert summary["cycles"]["cycles"] == 11
    assert summary["cycles"]["last_amplitude_Pa"] > 1e3
    assert {"first_phase_rad", "last_phase_rad", "first_work_J_per_m3", "last_work_J_per_m3"} <= summary["cycles"].keys()
    assert summary["cycles"]["of"] == "nominal_stress_1"
    steps = "".join(f'[[step]]\nvoltage = "{volts} V"\nduration = "1 s"\n' for volts in (500, 0))
    repeated, summary = figure_and_headline(tmp_path, f"{steps}[repeat]\ntimes = 11\n")  # these have no amplitude or phase
    assert summary["cycles"]["of"] == "relative_stretch_1"
    assert 1 < summary["cycles"]["first_highest"] < summary["cycles"]["last_highest"]
    assert {"last_lowest", "last_mean", "last_electrical_energy_J_per_m3"} < summary["cycles"].keys()
    labels = [axes.get_ylabel().partition(" [")[0] for axes in repeated.axes]
    assert labels == ["lowest relative stretch", "highest relative stretch", "work"]
    over_stretch, stated = figure_and_headline(tmp_path, f'{steps}[repeat]\ntimes = 11\n[plot]\nx = "stretch_1 [1]"\n')
    assert len(over_stretch.axes) == 1  # as the recipe states
    assert stated == summary
    few, summary = figure_and_headline(tmp_path, CYCLES.format(3), ANY_RUBBER)
    assert len(few.axes) == 1
    assert "cycles" not in summary


def test_the_panels_of_a_sweep_share_y() -> None:
    x, y = "time [s]", "stretch_1 [1]"
    time = np.linspace(1.0, 2.0, 5)
    cases = [{x: time, y: 1 + time * (1.0 if case % 2 else 1e-3)} for case in range(16)]
    factors = [Swept("a", tuple(float(case % 2) for case in range(16))), Swept("b", tuple(float(case // 2) for case in range(16)))]
    figure = plot_cases([Curve(str(number), case[x], case[y]) for number, case in enumerate(cases)], x, y, swept=factors)
    shown = {axes.get_ylim() for axes in figure.axes if axes.lines}
    assert len(shown) == 1
