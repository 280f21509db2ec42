"""Figures that a paper could print: legible in grey, units on every axis, the same bytes every time."""

from __future__ import annotations

from dataclasses import replace
from io import BytesIO
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.figure import Figure

from dielast import FrequencySweep, Plateaus, RelaxationCurve, build_master_curve, fit_spectrum, plot_master_curve, plot_spectrum
from dielast.calibration.comparison import Comparison
from dielast.calibration.experiment import MeasuredTest
from dielast.io.table import Column
from dielast.material.shift import NoShift
from dielast.material.spectrum import Spectrum
from dielast.plots.calibration import _draw_correlations, _draw_test
from dielast.plots.mastercurve import _tangent_axis
from dielast.plots.style import COLOURS, LINES, TEMPERATURES, Sheet, panels, spread, style
from dielast.plots.texts import lasting, log_axis, number, typeset
from dielast.relaxation.creep import fit_creep
from dielast.relaxation.fit import fit_oscillation
from dielast.relaxation.interconversion import retardation_from_relaxation
from dielast.relaxation.reduce import reduce_spectrum


def curves(temperatures: np.ndarray) -> list[RelaxationCurve]:
    time = np.geomspace(1, 1000, 30)
    return [RelaxationCurve(float(T), time, 1e6 * (1 + time * 10 ** (T / 20)) ** -0.8 + 1e5) for T in temperatures]


def labels(figure: Figure) -> list[str]:
    return [text for axes in figure.axes for text in (axes.get_xlabel(), axes.get_ylabel()) if text]


def test_few_temperatures_have_a_legend_and_many_a_colour_bar() -> None:
    for count, named in ((3, True), (21, False)):
        measured = curves(np.linspace(-20, 40, count))
        figure = plot_master_curve(build_master_curve(measured, reference_temperature=20.0, law="table"), measured)
        legend = figure.axes[2].get_legend()
        assert legend is not None
        assert ("\N{MINUS SIGN}20 °C" in [text.get_text() for text in legend.get_texts()]) == named
        assert ("temperature [°C]" in labels(figure)[4:]) != named


def lightness(colour: object) -> float:
    """Relative luminance, as a grey print shows it."""
    rgb = np.array(mpl.colors.to_rgb(colour))
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    return float(linear @ [0.2126, 0.7152, 0.0722])


def test_colours_can_be_told_apart_in_grey_and_seen_on_white() -> None:
    ramp = [lightness(TEMPERATURES(share)) for share in np.linspace(0, 1, 20)]
    assert np.all(np.diff(ramp) > 0)
    assert 1.05 / (ramp[-1] + 0.05) > 1.5  # contrast with white
    # neighbours in a legend differ in lightness, and in the pattern of their lines
    light = [lightness(colour) for colour in COLOURS]
    assert min(abs(a - b) for a, b in pairwise(light)) > 0.03
    assert len(set(map(str, LINES))) == len(LINES)


@pytest.mark.parametrize("ends", [(1.0, 1.3), (0.9, 2.8), (2.1, 4.5), (1.0, 20.0), (3.0, 80.0), (0.06, 0.7)])
def test_a_short_log_axis_has_plain_numbers_that_do_not_collide(ends: tuple[float, float]) -> None:
    with style():
        figure, (axes,) = panels(1, None)
        axes.plot([1.0, 2.0], ends)
        log_axis(axes, "y")
        figure.draw_without_rendering()
        low, high = axes.get_ylim()
        ticks = [*axes.yaxis.get_major_ticks(), *axes.yaxis.get_minor_ticks()]
        shown = [tick.label1 for tick in ticks if low <= tick.get_loc() <= high and tick.label1.get_text()]
        assert len(shown) >= 2
        assert all(float(label.get_text()) > 0 for label in shown)
        boxes = sorted((label.get_window_extent().y0, label.get_window_extent().y1) for label in shown)
        assert all(one[1] <= other[0] for one, other in pairwise(boxes))


@pytest.mark.parametrize("count", [41, 54, 79, 80, 81, 125])
def test_points_that_are_evenly_spaced_stay_so(count: int) -> None:
    noise = 0.3 * np.sin(np.arange(count) ** 2)  # a fraction of the distance
    chosen = spread(np.arange(count) + noise, 40)
    assert (chosen[0], chosen[-1]) == (0, count - 1)
    assert 14 <= chosen.size <= 40
    gaps = np.diff(chosen)
    assert gaps.max() - gaps.min() <= 1
    assert np.count_nonzero(gaps != np.median(gaps)) <= 2


def test_dense_sampling_is_spread_evenly_over_the_axis() -> None:
    position = np.log10(np.arange(1.0, 5000.0))
    chosen = spread(position, 40)
    gaps = np.diff(position[chosen])
    assert chosen.size <= 40
    # after the few points of the sparse end
    assert gaps[12:-1].max() < 1.2 * gaps[12:-1].min()
    assert spread(np.zeros(50), 40).size <= 40


@pytest.mark.parametrize("labels", [["0.1", "0.2", "0.5"], None])
def test_tan_delta_has_labels_of_one_kind(labels: list[str] | None) -> None:
    with style():
        figure, (axes,) = panels(1, None)
        x = np.linspace(0.0, 1.0, 5)
        axes.plot(x, 0.32 * (1 + 0.1 * x) if labels is None else 0.061 * (0.8 / 0.061) ** x)
        _tangent_axis(axes)
        figure.draw_without_rendering()
        low, high = axes.get_ylim()
        shown = [(tick, text.get_text()) for tick, text in zip(axes.get_yticks(), axes.get_yticklabels(), strict=True)]
        seen = [text for tick, text in shown if low <= tick <= high]
        assert len(seen) >= 2
        assert labels is None or seen == labels
        assert not any(text.get_text() for text in axes.get_yticklabels(minor=True))


@pytest.mark.parametrize("test", ["relaxation", "oscillation", pytest.param("creep", marks=pytest.mark.trust)])
def test_the_reduced_model_is_drawn_in_its_window(test: str) -> None:
    time = np.geomspace(1e-4, 1e4, 60)
    full = Spectrum(np.geomspace(1e4, 1e-4, 17), np.full(17, 1e5))
    if test == "relaxation":
        fit = fit_spectrum(
            time, 3 * full.relaxation_modulus(time, 1e5), method="nnls", branches=17, plateaus=Plateaus(equilibrium_modulus=3e5)
        )
    elif test == "oscillation":
        fit = fit_oscillation(
            time,
            3 * full.storage_modulus(time, 1e5),
            3 * full.loss_modulus(time),
            branches=17,
            plateaus=Plateaus(equilibrium_modulus=3e5),
        )
    else:
        fit = fit_creep(
            time,
            retardation_from_relaxation(full, 1e5).creep_compliance(time) / 3,
            branches=17,
            plateaus=Plateaus(equilibrium_modulus=3e5),
        )
    reduction = reduce_spectrum(fit.spectrum, fit.equilibrium_shear_modulus, NoShift(20.0), window=(0.1, 100.0), tolerance=0.02)
    curve = plot_spectrum(fit, reduction=reduction).axes[1]
    reduced = [line for line in curve.get_lines() if line.get_linestyle() == "--"]
    assert len(reduced) == (2 if test == "oscillation" else 1)
    label = str(reduced[0].get_label())
    assert label == f"reduced to {len(reduction.spectrum)}, in its window"
    abscissa = 1 / fit.reduced_time if test == "oscillation" else fit.reduced_time
    factor = 1e6 if test == "creep" else 1e-6  # into 1/MPa, and MPa
    for line, model in zip(reduced, np.atleast_2d(fit.model), strict=True):
        x, y = np.asarray(line.get_xdata(), dtype=float), np.asarray(line.get_ydata(), dtype=float)
        assert x.min() == pytest.approx(
            abscissa[(abscissa >= 0.01) & (abscissa <= 100)].min() if test == "oscillation" else 0.1, rel=0.4
        )
        here = np.isin(abscissa, x)
        # creep and oscillation are not what was compared, so that they may differ by more
        assert np.max(np.abs(y / (factor * model[here]) - 1)) < {"relaxation": 0.021, "oscillation": 0.4, "creep": 0.1}[test]


def test_the_same_figure_is_the_same_bytes_without_dates(tmp_path: Path) -> None:
    def figure() -> Figure:
        with style():
            figure, (axes,) = panels(1, None)
            axes.plot([1.0, 2.0], [1.0, 2.0])
            axes.fill_between([1.0, 2.0], [1.0, 2.0], [2.0, 3.0])
        return figure

    formats = ("svg", "pdf")  # test_plots_of_cases.py has png
    for form in formats:
        figure().savefig(tmp_path / f"figure.{form}")
    with mpl.rc_context({"savefig.dpi": 50, "font.size": 20, "svg.hashsalt": "mine"}):
        for form in formats:
            with (tmp_path / f"again-{form}").open("wb") as file:
                figure().savefig(file, format=form)
    for form in formats:
        once = (tmp_path / f"figure.{form}").read_bytes()
        assert once == (tmp_path / f"again-{form}").read_bytes(), form
        for word in (b"CreationDate", b"dc:date", b"Matplotlib v", b"matplotlib.org"):
            assert word not in once, form


@pytest.mark.parametrize(
    "form", ["png", pytest.param("svg", marks=pytest.mark.trust), pytest.param("pdf", marks=pytest.mark.trust)]
)
def test_a_saved_figure_is_that_of_matplotlibs_passes(form: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def saved() -> bytes:
        with style():
            figure, (axes,) = panels(1, "a title")
            axes.loglog([1e-3, 1e5], [2e4, 3e6], label="a line")
            axes.set(xlabel="time [s]", ylabel="modulus [Pa]")
            axes.legend()
        content = BytesIO()
        figure.savefig(content, format=form)
        return content.getvalue()

    ours = saved()
    monkeypatch.delattr(Sheet, "draw")
    assert ours == saved()


@pytest.mark.filterwarnings("ignore::dielast.base.errors.DielastWarning")
@pytest.mark.parametrize("swept", [False, True])
def test_the_fitted_curve_ends_where_shifts_are_undetermined(swept: bool) -> None:
    x = np.geomspace(1e-2, 1e2, 30)
    measured: list[RelaxationCurve | FrequencySweep] = []
    for T in (-200.0, -20.0, 0.0, 20.0, 40.0):
        a = 10 ** (-T / 20)
        if swept:
            phase = (1j * x * a) ** 0.5
            modulus = 1e5 + 1e7 * phase / (1 + phase)
            measured.append(FrequencySweep(T, x, modulus.real, modulus.imag + 1e3))
        else:
            measured.append(RelaxationCurve(T, x, 1e5 + 1e7 / (1 + (x / a) ** 0.5)))
    result = build_master_curve(measured, reference_temperature=20.0, law="arrhenius")
    assert [entry.temperature for entry in result.undetermined] == [-200]
    sure = result.reduced_abscissa[result.point_temperature > -200]
    (fitted,) = [line for line in plot_master_curve(result, measured).axes[2].lines if line.get_linestyle() == "-"][:1]
    drawn = np.asarray(fitted.get_xdata(), dtype=float)
    assert sure.min() * 0.999 <= drawn.min()
    assert drawn.max() <= sure.max() * 1.001


@pytest.mark.parametrize(("stderr", "seen"), [(1e-3, False), (0.2, True)])
def test_intervals_are_promised_where_they_are_seen(stderr: float, seen: bool) -> None:
    measured = curves(np.linspace(-20, 40, 5))
    result = build_master_curve(measured, reference_temperature=20.0, law="table")
    result = replace(result, log10_shift_factor_stderr=np.full(5, stderr))
    shift = plot_master_curve(result, measured).axes[1]
    legend = shift.get_legend()
    assert legend is not None
    assert ("interval" in legend.get_texts()[0].get_text()) == seen
    assert bool(shift.collections) == seen  # the bars


def test_text_is_set_with_minus_signs() -> None:
    minus = "\N{MINUS SIGN}"
    assert (
        typeset("at -40 to -.5 degC, 1e-3 s^-1; DC-3145, 2-3")
        == f"at {minus}40 to {minus}.5 °C, 1e{minus}3 s^{minus}1; DC-3145, 2-3"
    )
    assert (number(-2.5), number(-0.0)) == (f"{minus}2.5", "0")
    assert [lasting(seconds) for seconds in (0.01, 1, 90, 5400, 86400)] == ["10 ms", "1 s", "1.5 min", "1.5 h", "1 d"]


def test_correlations_that_round_to_zero_have_no_sign() -> None:
    columns = [Column(name, None, values) for name, values in (("parameter", ["a", "b"]), ("a", [1.0, -0.04]), ("b", [-0.04, 1.0]))]
    names = SimpleNamespace(space=SimpleNamespace(names=("equilibrium.a", "equilibrium.b")))
    calibration: Any = SimpleNamespace(correlation_columns=lambda: columns, fit=names)
    axes = Figure().add_subplot()
    _draw_correlations(axes, calibration, [0, 1])
    assert [text.get_text() for text in axes.texts] == ["0.0", "0.0"]


def test_a_model_that_runs_away_leaves_the_measured_points_apart() -> None:
    stretch = np.linspace(1.1, 3.0, 30)
    stress = 2e4 * (stretch - stretch**-2)
    test = MeasuredTest("pull", 10 * (stretch - 1), stretch, stress, 20.0)
    axes = Figure().subplots()
    close = stress * 1.1
    for model, within in (
        (close, True),
        (np.where(stretch > 2.5, -1e6, close), False),
        (np.where(stretch > 2.5, 1e6, close), False),
    ):
        axes.clear()
        _draw_test(axes, Comparison(test, False, model, model - 1e4, model + 1e4))
        low, high = axes.get_ylim()
        kilo, room = 1e-3 * stress, 1e-3 * np.ptp(stress)
        assert low <= min(0.0, kilo.min())
        assert high >= kilo.max()
        if within:
            assert high > 1e-3 * close.max()
        else:
            assert high - low <= 3.01 * room
