"""Read tables of voltage and stretch of an actuated film."""

import numpy as np

from dielast.base.errors import InputError, in_keys, located
from dielast.base.units import NUMBER, STRAIN, VOLTAGE
from dielast.calibration.proposals import approach
from dielast.calibration.voltage import VoltageTest
from dielast.commands.calibrate.film_recipe import PredictedFilm, TestFilm
from dielast.commands.calibrate.recipe import TestData
from dielast.io.files import Inputs
from dielast.io.text_table import read_measured
from dielast.mechanics.span import Control
from dielast.numerics.arrays import Floats, Index
from dielast.readings.quantities import check_area_strain, read_extent, role_in
from dielast.simulate.film_setup import Film


def read_voltage_test(test: TestData, inputs: Inputs, temperature: float, name: str) -> VoltageTest:
    """The voltage test of a table; `temperature` in degC is the default. Raises `InputError` naming the file and the line."""
    assert test.file is not None
    assert test.film is not None
    table = read_measured(inputs.read(test.file), test.file, test.text_format(), test.units)
    rows = table.rows_where(test.where)
    voltage = table.column(test.columns.voltage or "voltage", "voltage", VOLTAGE, rows)
    measure, column = role_in(table, "actuation", test.columns)
    place = table.find(column, measure)
    if measure == "area_strain":
        stretch = read_extent(table, place, measure, STRAIN, rows, of_length="state columns.stretch or columns.relative_stretch")
        check_area_strain(voltage, stretch, table.names[place], test.file)
    else:
        stretch = read_extent(table, place, measure, NUMBER, rows, of_area="state columns.area_strain")
    lines, film = table.lines[rows], test.film
    least = -1.0 if measure == "area_strain" else 0.0
    for row in np.flatnonzero(stretch <= least)[:1]:
        raise InputError(f"{measure} {stretch[row]:g}: a number above {least:g} is needed", file=test.file, line=int(lines[row]))
    _check_rising(np.abs(voltage), lines, test.file)
    if measure != "area_strain" and stretch.size:
        _check_begin(float(stretch[int(np.argmin(np.abs(voltage)))]), measure, table.names[place], film.prestretch[0], test.file)
    at = temperature if test.temperature is None else test.temperature
    with located(file=test.file):
        return VoltageTest(
            name,
            voltage,
            stretch,
            _film(film),
            np.array(test.ramp),
            at,
            np.array(film.relax) if len(film.relax) > 1 else None,
            np.array(film.shares) if film.shares is not None and len(film.shares) > 1 else None,
            measure,
            test.specimen_id or name,
        )


def _check_rising(voltage: Floats, lines: Index, file: str) -> None:
    """Raise `InputError` with the file and the line for voltages (rows,) that rise, and then fall: a loop. The points of a curve
    may be in any other order.
    """
    top = int(np.argmax(voltage)) if voltage.size else 0
    back = voltage[top:] < voltage[top]
    if top > 1 and np.count_nonzero(back) > 1 and np.all(np.diff(voltage[: top + 1]) >= 0) and np.all(np.diff(voltage[top:]) <= 0):
        wrong = f"the voltage falls from {voltage[top]:g} V on, and the film of such a table is under a rising voltage"
        other = "delete the rows of the way back, or state the test as a recipe of actuate"
        raise InputError(f"{wrong}: {other}", file=file, line=int(lines[top + int(np.argmax(back))]))


def _check_begin(begins: float, measure: str, name: str, rest: float, file: str) -> None:
    """Raise `InputError` with the file if the stretch at the lowest voltage is in per cent, or counts from another length than the
    `measure` of its column; `rest` is the prestretch.
    """
    if begins > 10 * rest:
        odd = f"{measure} {begins:g} at the lowest voltage"
        raise InputError(f'{odd}: if it is in per cent, call the column "{name} [%]"', file=file)
    relative = measure == "relative_stretch"
    if bool(abs(np.log(begins)) > abs(np.log(begins / rest))) == relative and rest > 1:
        begin = f"{measure} begins at {begins:g} at the lowest voltage"
        if relative:
            wrong = f"{begin}, and one over that before the voltage begins at 1: state columns.stretch"
        else:
            wrong = f"{begin}, and film.prestretch is {rest:g}: one of them is wrong, or columns.relative_stretch is to be stated"
        raise InputError(wrong, file=file)


def predicted_test(stated: PredictedFilm, temperature: float) -> VoltageTest:
    """The prediction that a recipe asks for, by default at a `temperature` in degC; `InputError` for an impossible film."""
    stretch = approach(stated.relative_stretch)
    at = temperature if stated.temperature is None else stated.temperature
    film = _film(stated.film)
    if film.controls[0] is Control.STRETCH:
        raise InputError("axis 1 is clamped, and has no stretch at a voltage: clamp axis 2", key="prediction.film.boundary")
    keys = {key: f"prediction.film.{key}" for key in ("thickness", "electrode_share", "force", "prestretch")}
    with in_keys(keys):
        return VoltageTest(
            "prediction", np.full(stretch.size, 2e4), stretch, film, np.array(stated.ramp), at, measure="relative_stretch"
        )


def _film(film: TestFilm) -> Film:
    """The film as the library takes it; the middle of a range stands for an unknown condition."""
    share = None if film.shares is None else film.shares[0]
    return film.setup(prestretch=film.stretched_to, relax=film.relax[0], electrode_share=share)
