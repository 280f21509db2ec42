"""The common parts of all fits of a spectrum: checks before a fit, the fit of moduli, and the result with its warnings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from dielast.material.measurement_kind import MeasurementKind
from dielast.material.spectrum import Spectrum
from dielast.numerics.arrays import Floats
from dielast.relaxation.checks import (
    TimeRange,
    check_counts,
    check_liquid,
    check_moduli,
    check_times,
    fit_errors,
    range_of_times,
    sorted_points,
    warn_of_equilibrium,
)
from dielast.relaxation.ends import End, extremes, long_time_end, votes
from dielast.relaxation.interconversion import answer
from dielast.relaxation.nnls import Known, Total, WeightedCurve, fit_strengths, place_times
from dielast.relaxation.result import Method, SpectrumFit

SEEN_AWAY = 10.0  # ratio of a time at which a process still affects the curve to the time of the process


@dataclass(frozen=True, slots=True, eq=False)
class FitTask:
    """A checked `curve` (shear), its values as `measured` (channels, n), and the requests for its spectrum; `plateau` is the end of
    the curve as a shear modulus with its slope.

    `times` are the shortest and the longest time of the processes in s, None if they follow from the curve; `equilibrium` and
    `glassy` are prescribed shear moduli in Pa. `keep` is the number of `branches` to keep, None for all.
    """

    curve: WeightedCurve
    measured: Floats
    plateau: End
    branches: int
    times: TimeRange
    equilibrium: float | None
    glassy: float | None
    keep: int | None
    liquid: bool

    @classmethod
    def of(
        cls,
        kind: MeasurementKind,
        columns: Sequence[ArrayLike],
        branches: int,
        times: TimeRange,
        equilibrium_modulus: float | None,
        glassy_modulus: float | None,
        keep: int | None,
        liquid: bool,
        *,
        method: Method = "nnls",
        fewest: int = 1,
    ) -> FitTask:
        """Check and sort `columns`, abscissa and ordinates (n,) of a master curve in Pa or 1/Pa (Young's or tensile); check the
        others.

        A `method` needs `fewest` branches. Raises `InputError` for points or arguments that allow no fit.
        """
        abscissa, *values = sorted_points(kind, columns)
        equilibrium = check_liquid(liquid, equilibrium_modulus)
        check_counts(method, branches, fewest, keep)
        check_times(times)
        ascending = slice(None, None, kind.time_power)
        time, measured = (abscissa**kind.time_power)[ascending], np.stack(values)[:, ascending]
        curve = WeightedCurve(time, measured * 3.0**-kind.stiffness_power, votes(np.log10(time)), kind)
        check_moduli(equilibrium, glassy_modulus, *extremes(np.log10(time), 3 * curve.stiffness))
        plateau = long_time_end(np.log10(time), curve.stiffness)
        return cls(curve, measured, plateau, branches, times, _shear(equilibrium), _shear(glassy_modulus), keep, liquid)

    @property
    def kept(self) -> float:
        """The fraction of the decades of times that the kept branches cover."""
        return 1.0 if self.keep is None or self.branches < 2 else (self.keep - 1) / (self.branches - 1)

    def place(self, known: Known, past: float = 1.0, times: TimeRange | None = None, kept: float | None = None) -> Floats:
        """Times of the processes for nnls in s, slowest first, by default up to a factor `past` beyond the ends of the curve.

        `times` and `kept` are by default those of the task.
        """
        curve, times = self.curve, self.times if times is None else times
        default, seen = (curve.time[0] / past, curve.time[-1] * past), (SEEN_AWAY, 1 / SEEN_AWAY)
        shortest, longest = range_of_times(times, default, curve.time, seen, self.kept if kept is None else kept)
        return place_times(curve, self.branches, shortest, longest, (times[0] is None, times[1] is None), known)

    def fit_moduli(self, past: float) -> SpectrumFit:
        """Moduli by non-negative least squares, with equilibrium and glassy modulus where prescribed."""
        known = (self.equilibrium,)
        tau = self.place(known, past)
        solution = fit_strengths(self.curve, tau, known, None if self.glassy is None else Total(self.glassy, (1.0,)))
        equilibrium = float(solution.constants[0])
        self.warn_of_equilibrium(equilibrium)
        spectrum = Spectrum(tau[: self.keep], solution.strength[: self.keep])
        return self.finish("nnls", spectrum, equilibrium, smoothing=solution.smoothing)

    def finish(
        self,
        method: Method,
        spectrum: Spectrum,
        equilibrium: float,
        model: Floats | None = None,
        truncated: bool | None = None,
        **rest: Any,
    ) -> SpectrumFit:
        """The result for a spectrum that may be `truncated`, with a warning if it fits poorly.

        `model` (channels, n), shear, is by default the response of the spectrum; `rest` are further fields of `SpectrumFit`.
        """
        curve, kind = self.curve, self.curve.kind
        if model is None:
            model = answer(kind, spectrum, equilibrium, curve.time)
        if truncated is None:
            truncated = self.keep is not None and self.keep < self.branches
        shortest = float(spectrum.relaxation_time[-1]) if truncated else None
        rms, worst = fit_errors(model / curve.values - 1, curve.time, shortest)
        pair = (self.measured, model * 3.0**kind.stiffness_power)
        measured, answered = (values[0] if len(values) == 1 else values for values in pair)
        return SpectrumFit(
            method=method,
            spectrum=spectrum,
            equilibrium_shear_modulus=equilibrium,
            rms_relative_error=rms,
            max_relative_error=worst,
            reduced_time=curve.time,
            measured=measured,
            model=answered,
            test=kind.name,
            **rest,
        )

    def warn_of_equilibrium(self, equilibrium: float) -> None:
        """Warn of an equilibrium modulus (shear, Pa) that contradicts the end of the curve, unless the material is a liquid."""
        if not self.liquid:
            warn_of_equilibrium(self.equilibrium, equilibrium, self.plateau)


def _shear(modulus: float | None) -> float | None:
    """The shear modulus of an incompressible material from Young's modulus, or None."""
    return None if modulus is None else modulus / 3
