"""The draws of a material, made of those of its master curve."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from dielast.handover.mastercurve_folder import ReadDraws, ReducedCurve
from dielast.handover.material_draws import draw_columns
from dielast.io.table import Table
from dielast.material.material import Material
from dielast.material.spectrum import Spectrum
from dielast.numerics.arrays import Floats
from dielast.relaxation.result import SpectrumFit
from dielast.relaxation.spectrum_draws import CurveDraws, draw_spectra


@dataclass(frozen=True, slots=True, eq=False)
class DrawnMaterials:
    """The draws of a material as a table, and their section of the summary."""

    table: Table
    headline: dict[str, Any]


def drawn_materials(
    material: Material, curve: ReducedCurve, read: ReadDraws, fit: SpectrumFit, refit: Callable[[Floats, Floats], SpectrumFit]
) -> DrawnMaterials:
    """A material for each draw of the `curve`, whose whole spectrum is `fit`; `refit` fits other points the same way."""
    abscissa, *ordinates = curve.columns
    curves = CurveDraws(read.abscissa, read.ordinates)
    spectra = draw_spectra(abscissa, np.array(ordinates), curves, fit, refit, spectrum=material.spectrum)
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
