"""`spectrum`: master curve -> discrete relaxation spectrum and material file."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dielast.characterise.spectrum import SpectrumFit, fit_spectrum
from dielast.errors import InputError
from dielast.files import Inputs
from dielast.gent import Gent
from dielast.material import Material
from dielast.measured import read_measured
from dielast.recipe.cases import Case
from dielast.recipe.material import breakdown, permittivity, write_material
from dielast.recipe.spectrum import CurveData, MaterialConstants, SpectrumRecipe
from dielast.recipe.validate import parse_toml
from dielast.shift import WLF, Arrhenius, NoShift, ShiftLaw, ShiftTable
from dielast.table import Column, number_columns
from dielast.units import STRESS, TIME
from dielast.workflow.report import Execution, Report

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Curve:
    """A master curve to be fitted: `reduced_time` (s) and `modulus` (Young's, Pa), both (n,), and its shift law."""

    reduced_time: Array
    modulus: Array
    shift: ShiftLaw
    equilibrium_modulus: float | None = None
    glassy_modulus: float | None = None


def run(cases: Sequence[Case[SpectrumRecipe]], inputs: Inputs, execution: Execution) -> Report:
    """Read the master curve, fit the spectrum, report."""
    recipe = cases[0].recipe
    curve = read_master_curve(recipe.mastercurve, inputs) if recipe.mastercurve is not None else read_curve(recipe.data, inputs)
    fit = recipe.fit
    result = fit_spectrum(
        curve.reduced_time,
        curve.modulus,
        method=fit.method,
        branches=fit.branches,
        polynomial_degree=fit.polynomial_degree,
        relaxation_time=(fit.relaxation_time.min, fit.relaxation_time.max),
        equilibrium_modulus=fit.equilibrium_modulus,
        glassy_modulus=fit.glassy_modulus,
        keep=recipe.truncate.keep if recipe.truncate else None,
    )
    material = make_material(result, curve.shift, recipe.material)

    def figure() -> Any:
        from dielast.plots.spectrum import plot_spectrum

        return plot_spectrum(result, recipe.title)

    return Report(tables(result), headline(result), figure, {"material.toml": write_material(material)})


def tables(result: SpectrumFit) -> dict[str, list[Column]]:
    """The tables of a spectrum by file name."""
    return {
        "spectrum.csv": [
            Column("relaxation_time", "s", result.spectrum.relaxation_time),
            Column("shear_modulus", "Pa", result.spectrum.shear_modulus),
        ],
        "fit.csv": [
            Column("reduced_time", "s", result.reduced_time),
            Column("measured", "Pa", result.measured),
            Column("model", "Pa", result.model),
        ],
    }


def headline(result: SpectrumFit) -> dict[str, dict[str, Any]]:
    """The headline numbers of a spectrum by section of the summary."""
    return {
        "fit": {
            "method": result.method,
            "branches": len(result.spectrum),
            "rms_relative_error": result.rms_relative_error,
            "max_relative_error": result.max_relative_error,
            "clipped_branches": result.clipped_branches,
            "polynomial_rms_relative_error": result.polynomial_rms_relative_error,
            "smoothing": result.smoothing,
        },
        "moduli": {
            "equilibrium_shear_Pa": result.equilibrium_shear_modulus,
            "nonequilibrium_shear_Pa": float(np.sum(result.spectrum.shear_modulus)),
            "relaxation_time_min_s": float(result.spectrum.relaxation_time[-1]),
            "relaxation_time_max_s": float(result.spectrum.relaxation_time[0]),
        },
    }


def make_material(result: SpectrumFit, shift: ShiftLaw, constants: MaterialConstants) -> Material:
    """The material that the simulations read: the spectrum, its shift law, and constants that no relaxation test gives."""
    return Material(
        name=constants.name,
        equilibrium_modulus=result.equilibrium_shear_modulus,
        spectrum=result.spectrum,
        shift=shift,
        equilibrium_law=Gent(constants.J_lim.equilibrium or math.inf),
        nonequilibrium_law=Gent(constants.J_lim.nonequilibrium or math.inf),
        permittivity=permittivity(constants),
        breakdown=breakdown(constants.breakdown),
    )


def read_master_curve(folder: str, inputs: Inputs) -> Curve:
    """The master curve in a folder that `mastercurve` wrote; raises `InputError` if it is not one."""
    name = f"{folder}/summary.toml"
    summary = parse_toml(inputs.read(name), name)
    if summary.get("kind") != "mastercurve":
        raise InputError(f'{name}: kind: "{summary.get("kind")}": a folder written by mastercurve is needed')
    name = f"{folder}/mastercurve.csv"
    time, modulus = number_columns(inputs.read(name), name, ["reduced_time [s]", "relaxation_modulus [Pa]"])
    for row in np.flatnonzero(~(np.isfinite(time) & np.isfinite(modulus)))[:1]:
        raise InputError(f"{name}: row {row + 2}: an empty cell")
    try:
        shift, moduli = summary["shift"], summary["modulus"]
        constants = [value for value in shift.values() if isinstance(value, float)]
        if not all(map(math.isfinite, constants)):
            raise ValueError("[shift] has a constant that is not finite")
        reference = float(shift["reference_temperature_degC"])
        law: ShiftLaw
        if shift["law"] == "wlf":
            law = WLF(reference, float(shift["C1"]), float(shift["C2_K"]))
        elif shift["law"] == "arrhenius":
            law = Arrhenius(reference, float(shift["activation_energy_J_per_mol"]))
        else:
            name = f"{folder}/shift-factors.csv"
            temperature, factor = number_columns(inputs.read(name), name, ["temperature [degC]", "log10_shift_factor [1]"])
            known = dict(zip(temperature.tolist(), factor.tolist(), strict=True)) | {reference: 0.0}
            rows = sorted((own, value) for own, value in known.items() if math.isfinite(value))
            law = ShiftTable(reference, *zip(*rows, strict=True))
        return Curve(time, modulus, law, float(moduli["equilibrium_Pa"]), float(moduli["glassy_Pa"]))
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(f"{folder}/summary.toml: {error}: a folder written by mastercurve is needed") from None


def read_curve(data: CurveData | None, inputs: Inputs) -> Curve:
    """A master curve from elsewhere, without a shift law; raises `InputError` naming file and line or column."""
    assert data is not None
    table = read_measured(inputs.read(data.file), data.file, data.text_format(), data.units)
    modulus = table.column(data.columns.modulus, "modulus", STRESS) * (3.0 if data.test == "shear" else 1.0)
    return Curve(table.column(data.columns.time, "time", TIME), modulus, NoShift(data.reference_temperature))
