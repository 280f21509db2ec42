"""Figures show what was simulated and measured: many cycles by their numbers, the voltage, and no more than there is."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

from dielast import fit_spectrum
from dielast.commands.registry import COMMANDS, read_cases
from dielast.io.files import Inputs
from dielast.plots.events import Curve
from dielast.plots.looks import Swept
from dielast.plots.simulation import plot_cases
from dielast.plots.spectrum import plot_spectrum
from dielast.sharing.execution import Execution

FILM = """
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
RELAX = 'kind = "relax"\nmaterial = "m.toml"\n[solver]\nrtol = 1e-3\n[output]\npoints_per_decade = 2\n'
RUBBER = """
reference_temperature = "20 degC"
equilibrium.shear_modulus = "30 kPa"
nonequilibrium = { relaxation_time_s = [0.3], shear_modulus_Pa = [1e4] }
shift.law = "none"
"""


def figure_of(folder: Path, steps: str, head: str = FILM) -> tuple[Figure, dict[str, Any]]:
    path = folder / "a.toml"
    path.write_text(head + steps)
    kind = "actuate" if head == FILM else "relax"
    report = COMMANDS[kind].run(read_cases(path, kind), Inputs(folder), Execution())
    return report.figure(), dict(report.headline)


def test_many_cycles_are_drawn_and_named_by_their_numbers(tmp_path: Path) -> None:
    (tmp_path / "m.toml").write_text(RUBBER)
    figure, summary = figure_of(tmp_path, CYCLES.format(101), RELAX)
    labels = [axes.get_ylabel() for axes in figure.axes]
    assert labels == ["amplitude of the nominal stress [kPa]", "phase [rad]", "work [kJ/m³]"]
    assert all(axes.lines[0].get_xdata()[-1] == 101 for axes in figure.axes)
    assert summary["cycles"]["cycles"] == 101
    assert summary["cycles"]["last_amplitude_Pa"] > 1e3
    assert {"first_phase_rad", "last_phase_rad", "first_work_J_per_m3", "last_work_J_per_m3"} <= summary["cycles"].keys()
    few, summary = figure_of(tmp_path, CYCLES.format(3), RELAX)
    assert len(few.axes) == 1
    assert "cycles" not in summary


def test_the_title_states_the_voltage(tmp_path: Path) -> None:
    figure, _ = figure_of(
        tmp_path, '[[step]]\nvoltage = "2 kV"\nduration = "1 s"\n[[step]]\nvoltage = "3.2 kV"\nduration = "1 s"\n'
    )
    assert "up to 3.2 kV" in figure.get_suptitle().replace("\N{NO-BREAK SPACE}", " ")


def test_the_panels_of_a_sweep_share_y() -> None:
    x, y = "time [s]", "stretch_1 [1]"
    time = np.linspace(1.0, 2.0, 5)
    cases = [{x: time, y: 1 + time * (1.0 if case % 2 else 1e-3)} for case in range(16)]
    factors = [Swept("a", tuple(float(case % 2) for case in range(16))), Swept("b", tuple(float(case // 2) for case in range(16)))]
    figure = plot_cases([Curve(str(number), case[x], case[y]) for number, case in enumerate(cases)], x, y, swept=factors)
    shown = {axes.get_ylim() for axes in figure.axes if axes.lines}
    assert len(shown) == 1


@pytest.mark.parametrize(("measured", "reduced"), [("master curve", True), ("measured", False), ("", False)])
def test_a_test_at_one_temperature_is_no_master_curve(measured: str, reduced: bool) -> None:
    time = np.geomspace(1e-2, 1e3, 40)
    result = fit_spectrum(time, 1e5 + 1e6 * np.exp(-(time**0.4)), method="nnls", branches=6)
    curve = plot_spectrum(result, measured=measured).axes[1]
    assert ("reduced" in curve.get_xlabel()) == reduced
    texts = [text.get_text() for text in curve.get_legend().get_texts()]
    assert texts == [*([measured] if measured else []), "discrete model"]
