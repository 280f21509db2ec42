"""Films under voltage in a calibration: the voltage at a stretch, against the simulation of `actuate` and closed forms."""

from functools import cache
from typing import Any

import numpy as np
import pytest

from dielast import Gent, Material, NoShift, Spectrum, VoltageTest
from dielast.base.errors import InputError
from dielast.calibration.laboratory import Laboratory
from dielast.material.material import VACUUM_PERMITTIVITY
from dielast.mechanics.load import VoltageStep
from dielast.simulate.actuate import actuate
from dielast.simulate.actuation_history import ActuationHistory
from dielast.simulate.film_setup import Film
from dielast.simulate.options import Failure, Solver
from dielast.simulate.output import Output

PERMITTIVITY = 4.2 * VACUUM_PERMITTIVITY
FILM = Material("film", 20e3, Spectrum([100.0, 3.0], [2e4, 4e4]), NoShift(20.0), Gent(110.0), Gent(55.0), permittivity=PERMITTIVITY)
RATE, END = 50.0, 8000.0  # V/s, V
STRETCHES = np.array([1.004, 1.02, 1.05, 1.1, 1.17])
FORMS = {
    "dead-load": Film(1e-3, 3.0, relax=600.0),
    "frame": Film(1e-3, 3.0, 0.1, relax=600.0, boundary="frame", electrode_share=0.25),
    "strip": Film(1e-3, (3.0, 2.0), relax=600.0, boundary="strip", electrode_share=0.4),
    "one axis": Film(1e-3, (2.0, 3.0), relax=600.0, boundary=("dead-load", "clamped")),
    "weight": Film(1e-3, (None, 3.0), relax=600.0, boundary=("dead-load", "clamped"), force=2.0, width=0.1),
}


@cache
def driven(form: str) -> ActuationHistory:
    """A film by `actuate`, with rows at many times."""
    steps, output = [VoltageStep(voltage=END, rate=RATE)], Output(times=np.linspace(0, END / RATE, 4001))
    return actuate(FILM, FORMS[form], steps, output=output, failure=Failure(stop_at="end"), solver=Solver(rtol=1e-6))


def measured(form: str, measure: str) -> VoltageTest:
    """The voltages of a film at its stretches."""
    history = driven(form)
    relative = history.relative_stretch_1[0]
    wanted = {
        "relative_stretch": STRETCHES,
        "area_strain": np.interp(STRETCHES, relative, history.area_strain[0]),
        "stretch": STRETCHES * history.stretch_1[0, 0],
    }[measure]
    voltage = np.interp(STRETCHES, relative, RATE * history.time[0])
    return VoltageTest("film", voltage, wanted, FORMS[form], RATE, 20.0, measure=measure)


@pytest.mark.parametrize(
    ("form", "measure"),
    [
        *((form, "relative_stretch") for form in FORMS),
        *(("dead-load", "stretch"), ("one axis", "area_strain")),
        *(pytest.param(form, "stretch", marks=pytest.mark.trust) for form in FORMS if form != "dead-load"),
    ],
)
def test_voltages_are_those_of_actuate(form: str, measure: str) -> None:
    test = measured(form, measure)
    (found,) = Laboratory([test], rtol=1e-6).answers([FILM])
    assert found[0] == pytest.approx(test.voltage, rel=3e-5)


@pytest.mark.parametrize("boundary", ["dead-load", "frame", "strip"])
def test_a_film_that_no_voltage_extends_is_refused(boundary: Any) -> None:
    share = None if boundary == "dead-load" else 0.4
    film = Film(1e-3, 3.5, boundary=boundary, electrode_share=share)
    with pytest.raises(InputError, match="no stretch above 0 V is beyond the prestretch"):
        VoltageTest("film", np.array([2e3, 3e3, 4e3]), np.array([3.03, 3.1, 3.2]), film, RATE, 20.0)
