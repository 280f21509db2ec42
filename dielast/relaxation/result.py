"""The result of a fit: a discrete relaxation spectrum, and the curve to which it was fitted."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from dielast.io.result import TabularResult
from dielast.io.table import Column, Table
from dielast.material.measurement_kind import KINDS, KindName, MeasurementKind
from dielast.material.spectrum import Spectrum
from dielast.numerics.arrays import Floats
from dielast.relaxation.interconversion import RetardationSpectrum

Method = Literal["schwarzl-staverman", "nnls"]
BRANCHES = 30  # the usual number


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class SpectrumFit(TabularResult):
    """A fitted relaxation spectrum, and its agreement with the curve of its `test`: relaxation, oscillation or creep.

    `spectrum` and `equilibrium_shear_modulus` (Pa) are shear; `reduced_time` (s) is (n,), ascending, and `measured` and `model` are
    Young's moduli of relaxation (n,), storage and loss (2, n) in Pa, or tensile creep compliances (n,) in 1/Pa. The reduced time of
    an oscillation is one over its angular frequency. The errors are those of model/measured - 1 over all points with equal weight;
    if only the slowest branches are kept, over the points from the shortest relaxation time kept on, for which they are meant.

    `clipped_branches` is the number of negative moduli that were set to 0. `polynomial_rms_relative_error` is set by
    schwarzl-staverman, `smoothing` by nnls, and `retardation` by creep, which is first fitted with a retardation spectrum; else
    None.
    """

    method: Method
    spectrum: Spectrum
    equilibrium_shear_modulus: float
    rms_relative_error: float
    max_relative_error: float
    reduced_time: Floats
    measured: Floats
    model: Floats
    clipped_branches: int = 0
    polynomial_rms_relative_error: float | None = None
    smoothing: float | None = None
    test: KindName = "relaxation"
    retardation: RetardationSpectrum | None = None

    @property
    def kind(self) -> MeasurementKind:
        """The kind of measurement that the curve was made of."""
        return KINDS[self.test]

    @property
    def reduced_abscissa(self) -> Floats:
        """Reduced time in s or reduced angular frequency in rad/s (n,), in the order of `reduced_time`."""
        return np.asarray(self.reduced_time**self.kind.time_power)

    def columns(self) -> Table:
        """The table of the curve and the model, by ascending abscissa."""
        kind, ascending = self.kind, slice(None, None, self.kind.time_power)
        table = [Column(*kind.reduced_abscissa, self.reduced_abscissa[ascending])]
        channels = zip(kind.ordinates, np.atleast_2d(self.measured), np.atleast_2d(self.model), strict=True)
        for (name, unit), measured, model in channels:
            which = f"_{name.removesuffix('_modulus')}" if len(kind.ordinates) > 1 else ""
            table += [Column(f"measured{which}", unit, measured[ascending]), Column(f"model{which}", unit, model[ascending])]
        return table

    @property
    def branches(self) -> int:
        """Number of processes in the spectrum."""
        return len(self.spectrum)
