"""`mastercurve`: relaxation tests, creep tests or frequency sweeps at several temperatures -> master curve and shift factors."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from dielast.base.errors import InputError, in_keys, reached_by
from dielast.commands.mastercurve.recipe import KEYS, MasterCurveRecipe
from dielast.handover.mastercurve_folder import CURVES, DRAWS, LAWS
from dielast.io.files import Inputs
from dielast.io.table import Column, Table
from dielast.material.checks import USUAL, warn_of_temperature
from dielast.material.measurement_kind import MeasurementKind
from dielast.material.ramp import without_ramp
from dielast.readings.read import Dataset, read_all
from dielast.readings.values import ONE_TEMPERATURE
from dielast.recipe.cases import Case
from dielast.report.report import RunReport
from dielast.sharing.execution import Execution

if TYPE_CHECKING:
    from dielast.relaxation.superposition.bootstrap import MasterCurveDraws
    from dielast.relaxation.superposition.result import MasterCurve


def run(cases: Sequence[Case[MasterCurveRecipe]], inputs: Inputs, execution: Execution) -> RunReport:
    """Read the tests, shift them, report."""
    # `prepared` needs none of these
    from dielast.relaxation.superposition.bootstrap import bootstrap_master_curve
    from dielast.relaxation.superposition.mastercurve import build_master_curve

    recipe = cases[0].recipe
    dataset = prepared(cases, inputs)
    shift, uncertainty = recipe.shift, recipe.uncertainty
    if len({curve.temperature for curve in dataset.in_order}) == 1:
        at = dataset.in_order[0].temperature
        raise InputError(f"a master curve needs at least two temperatures, but all curves are at {at:g} degC; {ONE_TEMPERATURE}")
    warn_of_temperature([curve.temperature for curve in dataset.in_order], "the tests are at")
    if shift.reference_temperature > max(curve.temperature for curve in dataset.in_order):
        warn_of_temperature(shift.reference_temperature, "the reference temperature is")
    with in_keys(KEYS):
        result = build_master_curve(
            dataset.in_order,
            **shift.model_dump(),
            temperature_stderr=recipe.data.temperature_stderr,
            drift=recipe.data.drift or 0.0,
        )
    if not USUAL["largest modulus"].warn(result.glassy_modulus) and _levels_off(result):
        USUAL["plateau"].warn(result.equilibrium_modulus)
    written = {"shift-factors.csv": result.shift_columns(), "mastercurve.csv": result.columns()}
    numbers = headline(result, recipe, dataset)
    if uncertainty is not None:
        drawn = bootstrap_master_curve(
            dataset.in_order,
            result,
            draws=uncertainty.draws,
            seed=uncertainty.seed,
            **shift.model_dump(include={"law", "vertical", "thermal_expansion"}),
            progress=None if (hears := execution.progress) is None else lambda done, of: hears(done, of, "draws"),
        )
        written |= curve_tables(drawn, result.kind)
        numbers["uncertainty"] = draws_headline(drawn, result, uncertainty.draws, uncertainty.seed)

    def figure() -> Any:
        from dielast.plots.mastercurve import plot_master_curve

        return plot_master_curve(result, without_ramp(dataset.measurements, result.ramp), recipe.title)

    return RunReport(written, numbers, figure)


def prepared(cases: Sequence[Case[MasterCurveRecipe]], inputs: Inputs) -> Dataset:
    """The measurements."""
    data = cases[0].recipe.data
    with reached_by("data.file" if data.file else "data.files"):
        return read_all(data, inputs)


def _levels_off(result: MasterCurve) -> bool:
    """Whether the smooth curve has a plateau for its equilibrium modulus."""
    from dielast.relaxation.superposition.checks import LAST_STRETCH, PLATEAU_SLOPE

    log_time = result.kind.time_power * np.log10(result.smooth_abscissa)
    end = np.log10(result.smooth_ordinates[0])[log_time >= np.max(log_time) - LAST_STRETCH]
    return float(np.ptp(end)) <= PLATEAU_SLOPE * LAST_STRETCH


def headline(result: MasterCurve, recipe: MasterCurveRecipe, dataset: Dataset) -> dict[str, dict[str, Any]]:
    """The headline numbers of a master curve by section of the summary."""
    fit, expansion = result.shift_fit, recipe.shift.thermal_expansion if recipe.shift.vertical == "density-temperature" else 0.0
    return {
        "shift": {
            "reference_temperature_degC": result.reference_temperature,
            "law": recipe.shift.law,
            "vertical": recipe.shift.vertical,
            **({"thermal_expansion": f"{expansion:.9g} /K"} if expansion else {}),  # as recipes and material files state it
            **({"on": result.shifted_on} if len(result.ordinates) > 1 else {}),
            **fit.law.summary(fit.covariance),
            "law_misfit": fit.misfit,
            "law_spread": fit.spread,
            "rms_residual_decades": result.rms_residual_decades,
            **({"outlying_points_left_out": result.outlying_points} if result.outlying_points else {}),
            "offset_spread_decades": result.offset_spread,
            "tilt_spread_decades": result.tilt_spread,
        },
        "modulus": {"equilibrium_Pa": result.equilibrium_modulus, "glassy_Pa": result.glassy_modulus},
        "data": {
            **dataset.summary,
            "temperature_stderr_K": result.stated.temperature_stderr,
            **({"drift": result.stated.drift} if result.stated.drift > 0 else {}),
            **({"ramp_found_s": result.ramp} if result.ramp > 0 else {}),
            "temperatures": int(result.temperature.size),
            "points": int(result.abscissa.size),
            "decades": float(np.log10(result.reduced_abscissa[-1] / result.reduced_abscissa[0])),
            "undetermined_temperatures_degC": [entry.temperature for entry in result.undetermined],
        },
    }


def curve_tables(draws: MasterCurveDraws, kind: MeasurementKind) -> dict[str, Table]:
    """The tables of the draws of a master curve by file name: shift factors, laws and smooth curves."""
    curves = [Column(*kind.reduced_abscissa, draws.smooth_abscissa)]
    for channel, (name, unit) in enumerate(kind.ordinates):
        pairs = zip(draws.number, draws.smooth_ordinates[:, channel], strict=True)
        curves += [Column(f"{name}_{number}", unit, values) for number, values in pairs]
    laws = [Column(name, unit, values) for (name, unit), values in zip(draws.law.drawn(), draws.law_parameters.T, strict=True)]
    return {
        DRAWS: draws.columns(),
        LAWS: [Column("draw", None, draws.number), *laws],
        CURVES: curves,
    }


def draws_headline(draws: MasterCurveDraws, result: MasterCurve, requested: int, seed: int) -> dict[str, Any]:
    """The section of a summary that compares the scatter of the draws with the standard errors of the fit.

    What the fit does not determine has an infinite standard error: draws keep to the C2 that the fit assumes.
    """
    scatter, constants = draws.stderr(), draws.law.summary_names()
    stderr = {key: scatter[each.name] if np.isfinite(result.law_stderr[each.name]) else math.inf for key, each in constants.items()}
    shifts = np.std(draws.log10_shift_factor, axis=0, ddof=1)
    return {
        "draws": requested,
        "seed": seed,
        "without_master_curve": requested - len(draws.number),
        **{f"{key}_stderr": value for key, value in stderr.items()},
        "log10_shift_factor_stderr": np.where(np.isfinite(shifts), shifts, np.inf).tolist(),
    }
