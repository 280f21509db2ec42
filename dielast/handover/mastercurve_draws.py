"""Files of draws: those that `mastercurve` writes and `spectrum` reads, and the draws of a material made of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dielast.errors import InputError, located
from dielast.handover.mastercurve_folder import ReducedCurve
from dielast.handover.material_draws import draw_columns
from dielast.handover.tables import finite_columns
from dielast.io.files import Inputs
from dielast.io.table import Column, Table
from dielast.io.toml import parse_toml
from dielast.material.material import Material
from dielast.material.measurement_kind import MeasurementKind
from dielast.material.shift import ShiftLaw
from dielast.material.spectrum import Spectrum
from dielast.relaxation.result import SpectrumFit
from dielast.relaxation.spectrum_draws import CurveDraws, draw_spectra
from dielast.superposition.bootstrap import MasterCurveDraws

Array = NDArray[np.float64]

DRAWS, LAWS, CURVES = "draws.csv", "draw-laws.csv", "draw-curves.csv"


def curve_tables(draws: MasterCurveDraws, kind: MeasurementKind) -> dict[str, Table]:
    """The tables of the draws of a master curve by file name: shift factors, law and smooth curve of each."""
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


def draws_headline(draws: MasterCurveDraws, wanted: int, seed: int) -> dict[str, Any]:
    """The section of a summary that compares the scatter of the draws with the standard errors of the fit."""
    stderr = draws.stderr()
    return {
        "draws": wanted,
        "seed": seed,
        "without_master_curve": wanted - len(draws.number),
        **{f"{name}_stderr": stderr[constant.name] for name, constant in draws.law.summary_names().items()},
        "log10_shift_factor_stderr": np.std(draws.log10_shift_factor, axis=0, ddof=1).tolist(),
    }


@dataclass(frozen=True, slots=True, eq=False)
class ReadDraws:
    """Draws of a master curve as read: `number` (draws,), their smooth curves and their shift laws."""

    number: NDArray[np.int64]
    curves: CurveDraws
    shifts: tuple[ShiftLaw, ...]


def read_curve_draws(folder: str, curve: ReducedCurve, inputs: Inputs) -> ReadDraws | None:
    """The draws in the folder of the master curve `curve`; None if its summary has no section on uncertainty."""
    name = f"{folder}/summary.toml"
    if "uncertainty" not in parse_toml(inputs.read(name), name):
        return None
    name = f"{folder}/{LAWS}"
    headers = curve.shift.drawn_headers()
    number, *constants = finite_columns(inputs.read(name), name, ["draw", *headers])
    for row in np.flatnonzero(number != np.floor(number))[:1]:
        raise InputError(f'column "draw": {number[row]:g} is not a whole number', file=name, row=row + 2)
    rows = np.array(constants).reshape(len(headers), number.size).T
    if number.size < 2:
        raise InputError(f"{number.size} draws: at least 2 are needed", file=name)
    shifts = []
    for row, constants_of_draw in enumerate(rows.tolist()):
        with located(file=name, row=row + 2):
            shifts.append(curve.shift.redrawn(constants_of_draw))
    name = f"{folder}/{CURVES}"
    abscissa, unit = curve.kind.reduced_abscissa
    headers = [
        f"{abscissa} [{unit}]",
        *(f"{ordinate}_{int(k)} [{unit}]" for ordinate, unit in curve.kind.ordinates for k in number),
    ]
    columns = finite_columns(inputs.read(name), name, headers, positive=True)
    first, values = columns[0], columns[1:].reshape(len(curve.kind.ordinates), number.size, -1)
    for row in np.flatnonzero(np.diff(first) <= 0)[:1]:
        raise InputError(f'column "{headers[0]}": {first[row + 1]:g} is not above {first[row]:g}', file=name, row=row + 3)
    if not first.size:
        raise InputError("no rows: a folder written by mastercurve is needed", file=name)
    return ReadDraws(number.astype(np.int64), CurveDraws(first, np.moveaxis(values, 1, 0)), tuple(shifts))


@dataclass(frozen=True, slots=True, eq=False)
class DrawnMaterials:
    """The draws of a material as a table, and their section of the summary."""

    table: Table
    headline: dict[str, Any]


def drawn_materials(
    material: Material, curve: ReducedCurve, read: ReadDraws, fit: SpectrumFit, refit: Callable[[Array, Array], SpectrumFit]
) -> DrawnMaterials:
    """A material for each draw of the `curve`, whose whole spectrum is `fit`; `refit` fits other points the same way."""
    abscissa, *ordinates = curve.columns
    spectra = draw_spectra(abscissa, np.array(ordinates), read.curves, fit, refit, spectrum=material.spectrum)
    tau = material.spectrum.relaxation_time
    members = [
        replace(material, equilibrium_modulus=float(level), spectrum=Spectrum(tau, moduli), shift=read.shifts[place])
        for place, level, moduli in zip(spectra.used, spectra.equilibrium_modulus, spectra.shear_modulus, strict=True)
    ]
    headline = {
        "draws": len(members),
        "without_spectrum": len(read.number) - len(members),
        "curve_scatter": spectra.scatter,
        "model_misfit": spectra.misfit,
    }
    return DrawnMaterials(draw_columns(read.number[spectra.used], members), headline)
