"""`mastercurve`: relaxation tests at several temperatures -> master curve and shift factors."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dielast.characterise.mastercurve import MasterCurve, RelaxationCurve, build_master_curve
from dielast.errors import InputError
from dielast.files import Inputs
from dielast.measured import MeasuredTable, read_measured
from dielast.recipe.cases import Case
from dielast.recipe.mastercurve import MasterCurveRecipe, RelaxationData
from dielast.shift import WLF, Arrhenius
from dielast.table import Column
from dielast.units import STRAIN, STRESS, TEMPERATURE, TIME, ZERO_CELSIUS
from dielast.workflow.report import Execution, Report

Array = NDArray[np.float64]


def run(cases: Sequence[Case[MasterCurveRecipe]], inputs: Inputs, execution: Execution) -> Report:
    """Read the tests, shift them, report."""
    recipe = cases[0].recipe
    curves = read_curves(recipe.data, inputs)
    shift = recipe.shift
    result = build_master_curve(
        curves,
        reference_temperature=shift.reference_temperature,
        law=shift.law,
        vertical=shift.vertical,
        thermal_expansion=shift.thermal_expansion,
    )

    def figure() -> Any:
        from dielast.plots.mastercurve import plot_master_curve

        return plot_master_curve(result, curves, recipe.title)

    return Report(tables(result), headline(result, recipe), figure)


def tables(result: MasterCurve) -> dict[str, list[Column]]:
    """The tables of a master curve by file name."""
    return {
        "shift-factors.csv": [
            Column("temperature", "degC", result.temperature),
            Column("log10_shift_factor", "1", result.log10_shift_factor),
            Column("log10_shift_factor_stderr", "1", result.log10_shift_factor_stderr),
            Column("log10_shift_factor_fit", "1", result.log10_shift_factor_fit),
            Column("vertical_shift", "1", result.vertical_shift),
        ],
        "mastercurve.csv": [
            Column("temperature", "degC", result.point_temperature),
            Column("time", "s", result.time),
            Column("reduced_time", "s", result.reduced_time),
            Column("relaxation_modulus", "Pa", result.relaxation_modulus),
        ],
    }


def headline(result: MasterCurve, recipe: MasterCurveRecipe) -> Mapping[str, Mapping[str, Any]]:
    """The headline numbers of a master curve by section of the summary."""
    fit = result.shift_fit
    constants: dict[str, Any] = {}
    stderr = np.sqrt(np.diag(fit.covariance)) if fit.covariance.size else np.zeros(0)
    match fit.law:
        case WLF():
            constants = {
                "C1": fit.law.C1,
                "C1_stderr": float(stderr[0]),
                "C2_K": fit.law.C2,
                "C2_K_stderr": float(stderr[1]),
                "C1_C2_covariance_K": float(fit.covariance[0, 1]),
            }
        case Arrhenius():
            constants = {
                "activation_energy_J_per_mol": fit.law.activation_energy,
                "activation_energy_J_per_mol_stderr": float(stderr[0]),
            }
    return {
        "shift": {
            "reference_temperature_degC": result.reference_temperature,
            "law": recipe.shift.law,
            "vertical": recipe.shift.vertical,
            **constants,
            "law_misfit": fit.misfit,
            "rms_residual_decades": result.rms_residual_decades,
        },
        "modulus": {"equilibrium_Pa": result.equilibrium_modulus, "glassy_Pa": result.glassy_modulus},
        "data": {
            "temperatures": int(result.temperature.size),
            "points": int(result.time.size),
            "decades": float(np.log10(result.reduced_time[-1] / result.reduced_time[0])),
            "undetermined_temperatures_degC": [entry.temperature for entry in result.undetermined],
        },
    }


def read_curves(data: RelaxationData, inputs: Inputs) -> list[RelaxationCurve]:
    """The relaxation curves that `data` describes, by ascending temperature, ramps dropped.

    Raises `InputError` naming file and line, column or temperature.
    """
    temperatures, times, moduli, sources = [], [], [], []
    for index, name in enumerate([data.file] if data.file else data.files or ()):
        table = read_measured(inputs.read(name), name, data.text_format(), data.units)
        time = table.column(data.columns.time, "time", TIME)
        modulus = _modulus(table, data)
        if data.columns.temperature is not None:
            temperature = table.column(data.columns.temperature, "temperature", TEMPERATURE)
            _refuse(table, temperature <= -ZERO_CELSIUS, "temperature", "is at or below absolute zero")
        else:
            temperature = np.full(time.size, _temperature_of(data, index, name))
        kept = time >= data.first_time if data.first_time > 0 else np.ones(time.size, dtype=bool)
        _refuse(table, (time <= 0) & kept, "time", "is not above zero; discard_before drops the points up to a time")
        if not np.any(kept):
            raise InputError(f"{name}: no points are left from {data.first_time:g} s on (see discard_before and ramp)")
        temperatures.append(temperature[kept])
        # A ramp acts like a step at its middle, to second order in ramp/time: L. J. Zapas and J. C. Phillips, J. Res. Natl. Bur.
        # Stand. A 75 (1971) 33. Counted from its start, the shift factors would come out wrong by tenths of a decade.
        times.append(time[kept] - 0.5 * (data.ramp or 0.0))
        moduli.append(modulus[kept])
        sources.append(np.full(np.count_nonzero(kept), index))
    return _curves(
        np.concatenate(temperatures),
        np.concatenate(times),
        np.concatenate(moduli),
        np.concatenate(sources),
        data.temperature_tolerance,
    )


def _modulus(table: MeasuredTable, data: RelaxationData) -> Array:
    """Young's relaxation modulus in Pa; stress over strain is the paper's definition (Sec. 2.1.1)."""
    columns = data.columns
    if columns.modulus is not None:
        modulus = table.column(columns.modulus, "modulus", STRESS)
    else:
        assert columns.strain is not None
        assert columns.stress is not None
        strain = table.column(columns.strain, "strain", STRAIN)
        _refuse(table, strain == 0, "strain", "is zero, so stress / strain is no modulus")
        modulus = table.column(columns.stress, "stress", STRESS) / strain
    return modulus * (3.0 if data.test == "shear" else 1.0)


def _refuse(table: MeasuredTable, wrong: NDArray[np.bool_], role: str, why: str) -> None:
    if np.any(wrong):
        first = int(np.flatnonzero(wrong)[0])
        count = int(np.count_nonzero(wrong))
        raise InputError(
            f"{table.source}: line {table.lines[first]}: {role} {why}" + (f" ({count} such rows)" if count > 1 else "")
        )


def _temperature_of(data: RelaxationData, index: int, name: str) -> float:
    if data.temperatures is not None:
        return float(data.temperatures[index])
    pattern = re.escape(data.temperature_in_name or "").replace(r"\{degC\}", r"(?P<degC>[+-]?\d+(?:\.\d+)?)")
    match = re.search(pattern.replace(r"\{K\}", r"(?P<K>\d+(?:\.\d+)?)"), Path(name).name)
    if match is None:
        raise InputError(f'{name}: the name does not fit temperature_in_name = "{data.temperature_in_name}"')
    groups = match.groupdict()
    return float(groups["degC"]) if groups.get("degC") else float(groups["K"]) - ZERO_CELSIUS


def _curves(temperature: Array, time: Array, modulus: Array, source: NDArray[np.intp], tolerance: float) -> list[RelaxationCurve]:
    """One curve for each run of a temperature; sorted temperatures part where a gap is wider than `tolerance` (K)."""
    order = np.argsort(temperature, kind="stable")
    starts = np.flatnonzero(np.diff(temperature[order], prepend=-np.inf) > tolerance)
    curves = []
    for members in np.split(order, starts[1:]):
        readings = temperature[members]
        if np.ptp(readings) > 4 * tolerance:
            raise InputError(
                f"temperatures from {readings.min():g} to {readings.max():g} degC run into one another: "
                f"no two are more than temperature_tolerance = {tolerance:g} K apart"
            )
        # readings of one thermostat setting scatter; where they do not, their mean must not add rounding
        level = float(readings[0]) if np.ptp(readings) == 0 else round(float(np.mean(readings)), 6)
        rows = np.sort(members)
        curves += [RelaxationCurve(level, time[run], modulus[run]) for run in _runs(rows, time, source)]
    return curves


def _runs(rows: NDArray[np.intp], time: Array, source: NDArray[np.intp]) -> list[NDArray[np.intp]]:
    """The `rows` of one temperature as the runs they were measured in: another file, or a time that starts anew, is another run.

    Points in no order at all are one run.
    """
    anew = (np.diff(source[rows]) != 0) | (time[rows][1:] < 0.5 * time[rows][:-1])
    runs = np.split(rows, np.flatnonzero(anew) + 1)
    return runs if min(run.size for run in runs) >= 3 else [rows]
