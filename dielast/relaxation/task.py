"""The common parts of all fits of a spectrum: checks before a fit, the fit of moduli, and the result with its warnings."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from dielast.base.errors import InputError, warn
from dielast.material.measurement_kind import CREEP, MeasurementKind
from dielast.material.spectrum import Spectrum
from dielast.numerics.arrays import Floats, rms
from dielast.relaxation.checks import (
    POOR_FIT,
    Plateaus,
    TimeRange,
    checked_counts,
    checked_moduli,
    checked_times,
    sorted_points,
    what_rises,
    without_strays,
)
from dielast.relaxation.ends import last_quarter, least_modulus, long_time_end, short_time_end, votes
from dielast.relaxation.interconversion import response
from dielast.relaxation.nnls import Known, Total, WeightedCurve, fit_strengths, place_times
from dielast.relaxation.result import BRANCHES, Method, SpectrumFit

SEEN_AWAY = 10.0  # ratio of a time at which a process still affects the curve to the time of the process
# a stated equilibrium modulus so far below the end of a levelled curve, extrapolated by DECADES_BEYOND, is warned of
BELOW_CURVE = 0.1
DECADES_BEYOND = 2.0
LOOKS_LIKE_SHEAR = (2.5, 3.5)  # ratio of two moduli that suggests Young's over shear
LEVEL_SLOPE = 0.045  # decades of modulus per decade of time, about 10 %: a smaller slope at the end is a plateau
MEASURABLE = 0.02  # of the modulus at the end of a curve: a smaller excess over a stated equilibrium modulus may be noise
# The modulus of a stretched exponential of exponent 0.25 over 13 decades, without noise, is missed by up to 0.3 % with 2 branches a
# decade, none negative, 0.15 % with 3, and 0.07 % with 4 or 5, which is less than what noise of 0.5 % leaves open.
PER_DECADE = 5
MOST_BRANCHES = 200  # by default
NEAR_END = 10**0.1  # a curve determines processes up to a tenth of a decade beyond its end


class FitTask:
    """A checked `curve` (shear), its values as `measured` (channels, n), and the requests for its spectrum; `plateau` is the end of
    the curve as a shear modulus with its slope.

    `times` are the shortest and the longest time of the processes in s, None if they follow from the curve; `equilibrium` and
    `glassy` are prescribed shear moduli in Pa. `keep` is the number of `branches` to keep, None for all.
    """

    def __init__(
        self,
        kind: MeasurementKind,
        columns: Sequence[ArrayLike],
        branches: int | None,
        times: TimeRange,
        plateaus: Plateaus,
        keep: int | None,
        method: Method = "nnls",
        fewest: int = 1,
    ) -> None:
        """Raise `InputError` for points or arguments that allow no fit; a `method` needs `fewest` branches.

        By default there are `BRANCHES`, or `PER_DECADE` if these are more, up to `MOST_BRANCHES`, the method is nnls, and all are
        kept. The decades are those of the curve, or from the shortest to the longest of the `times` where they are stated.

        `columns` are abscissa and ordinates (n,) of a master curve in Pa or 1/Pa (Young's or tensile), in any order.
        """
        abscissa, *values = without_strays(kind, *sorted_points(kind, columns))
        self.times = checked_times(times, "retardation_time" if kind is CREEP else "relaxation_time")
        ascending = slice(None, None, kind.time_power)
        time, self.measured = (abscissa**kind.time_power)[ascending], np.stack(values)[:, ascending]
        if branches is None:
            first, last = (end or usual for end, usual in zip(self.times, time[[0, -1]].tolist(), strict=True))
            dense = PER_DECADE * max(float(np.log10(last / first)), 0.0)
            branches = min(max(BRANCHES, int(np.ceil(dense))), MOST_BRANCHES) if method == "nnls" and keep is None else BRANCHES
        self.branches, self.keep = checked_counts(method, branches, fewest, keep)
        self.curve = curve = WeightedCurve(time, self.measured * 3.0**-kind.stiffness_power, votes(np.log10(time)), kind)
        log_time, young = np.log10(time), 3 * curve.stiffness
        ends = least_modulus(log_time, young), short_time_end(log_time, young).modulus
        self.equilibrium, self.glassy = checked_moduli(plateaus, *ends)
        self.plateau = long_time_end(log_time, curve.stiffness)
        self.liquid = plateaus.liquid

    def range_of_times(
        self, default: tuple[float, float], seen_at: tuple[float, float], longest: float | None = None
    ) -> tuple[float, float]:
        """The shortest and the `longest` time of a process in s: as stated, else `default`.

        The shortest and the longest process have their effect on the curve at `seen_at` times their time; warns if that is beyond
        the curve. Of branches of which only the slowest are kept, only their times count.
        """
        time, stated = self.curve.time, (self.times[0], longest or self.times[1])
        first, last = (float(usual if end is None else end) for end, usual in zip(stated, default, strict=True))
        if first >= last:
            raise InputError(f"no relaxation time lies between min = {first:.3g} s and max = {last:.3g} s: state both")
        least = first
        if self.keep is not None and self.branches > 1 and self.curve.kind is not CREEP:  # whose branches follow from a conversion
            least = last * (first / last) ** ((self.keep - 1) / (self.branches - 1))
        if seen_at[0] * least < time[0] / NEAR_END or seen_at[1] * last > time[-1] * NEAR_END:
            warn(
                f"relaxation times from {least:.3g} to {last:.3g} s reach beyond what the curve, from {time[0]:.3g} to "
                f"{time[-1]:.3g} s, determines: the spectrum is extrapolated"
            )
        return first, last

    @property
    def relaxes_later(self) -> bool:
        """Whether a stated equilibrium modulus is so far below the end of the curve that only slower processes lead there.

        The excess E = G - G_e of processes with relaxation times up to t falls as -d ln E/d ln t = t <1/tau> >= 1, the mean being
        weighted by their shares of E(t) (the derivative of E = sum G_k exp(-t/tau_k), Ferry 1980, ch. 3). An excess that falls less
        steeply at the end of the curve therefore demands processes slower than the curve is long. For creep the same holds of
        1/G_e - J; the compliance of a melt rises by its fluidity instead.
        """
        level, slope = self.plateau
        if self.equilibrium is None:
            return False
        excess = 1 - self.equilibrium / level
        if self.curve.kind is CREEP:  # d ln E/d ln t = slope G_e / (G - G_e)
            return self.equilibrium > 0 and excess > MEASURABLE and -slope < level / self.equilibrium - 1
        return excess > MEASURABLE and -slope < excess  # d ln E/d ln t = slope G / (G - G_e)

    def place(self, known: Known, past: float = 1.0, longest: float | None = None) -> Floats:
        """Times of the processes for nnls in s, slowest first, by default up to a factor `past` beyond the ends of the curve.

        Where the material still relaxes after the curve, they reach as far as a process affects the curve. The `longest` time is by
        default that of the task.
        """
        time = self.curve.time
        past_end = SEEN_AWAY if self.relaxes_later else past
        ends = self.range_of_times((time[0] / past, time[-1] * past_end), (SEEN_AWAY, 1 / SEEN_AWAY), longest)
        movable = self.times[0] is None, (longest or self.times[1]) is None
        return place_times(self.curve, self.branches, *ends, movable, known)

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

        `model` (channels, n), shear, is by default the response of the spectrum; `rest` are further fields of `SpectrumFit`. The
        errors of a truncated spectrum are those at the times from its shortest relaxation time on.
        """
        curve, kind = self.curve, self.curve.kind
        if model is None:
            model = response(kind, spectrum, equilibrium, curve.time)
        if truncated is None:
            truncated = self.keep is not None and self.keep < self.branches
        error, compared = model / curve.values - 1, curve
        if truncated:
            shortest = float(spectrum.relaxation_time[-1])
            late = curve.time >= shortest
            if not np.any(late):
                raise InputError(f"the curve ends before {shortest:.3g} s, the shortest relaxation time kept: keep more branches")
            error = error[:, late]
            compared = replace(curve, time=curve.time[late], values=curve.values[:, late], weight=curve.weight[late])
        mean, worst = rms(error), float(np.max(np.abs(error)))
        if mean > POOR_FIT:
            advice = what_rises(compared) or "try more branches or another method"
            warn(f"the spectrum misses the curve by {mean:.1%} rms and {worst:.1%} at worst: {advice}")
        else:
            self._warn_of_end(compared, error)
        pair = (self.measured, model * 3.0**kind.stiffness_power)
        measured, modelled = (values[0] if len(values) == 1 else values for values in pair)
        return SpectrumFit(
            method=method,
            spectrum=spectrum,
            equilibrium_shear_modulus=equilibrium,
            rms_relative_error=mean,
            max_relative_error=worst,
            reduced_time=curve.time,
            measured=measured,
            model=modelled,
            test=kind.name,
            **rest,
        )

    def _warn_of_end(self, compared: WeightedCurve, error: Floats) -> None:
        """Warn if the model, with the relative `error` (channels, n), misses the stiffness at the end of the `compared` curve."""
        last = last_quarter(np.log10(compared.time))
        bias = float(np.average(error[0, last], weights=compared.weight[last]))
        if abs(bias) > POOR_FIT:
            side, at = ("above" if bias > 0 else "below"), compared.time[-1] ** compared.kind.time_power
            warn(
                f"the spectrum is {abs(bias):.1%} {side} the curve at its end, {at:.3g} {compared.kind.abscissa[1]}: check "
                'equilibrium_modulus, state a longer max of relaxation_time, or take method = "nnls"',
                mentions=("equilibrium_modulus", "relaxation_time", "method"),
            )

    def warn_of_equilibrium(self, fitted: float) -> None:
        """Warn if the modulus of a solid (shear, Pa) was `fitted` without a plateau, or is stated and far below a plateau."""
        falling = -self.plateau.slope > LEVEL_SLOPE
        if self.liquid or (self.equilibrium is not None and falling):
            return
        if falling:
            warn(
                f"the curve has not levelled off: it falls by {1 - 10**self.plateau.slope:.0%} in its last decade, so that the "
                f"equilibrium modulus of {3 * fitted:.3g} Pa (Young's) is a guess: state equilibrium_modulus (0 for a melt)",
                mentions=("equilibrium_modulus",),
            )
        # The equilibrium modulus of a levelled curve is near its end: no lower than its last slope leads within a few decades.
        level, equilibrium = 3 * self.plateau.modulus, 3 * fitted
        doubtful = (1 - BELOW_CURVE) * level * 10 ** (DECADES_BEYOND * self.plateau.slope)
        if self.equilibrium is None or equilibrium >= doubtful:
            return
        third = ""
        if equilibrium > 0 and LOOKS_LIKE_SHEAR[0] < level / equilibrium < LOOKS_LIKE_SHEAR[1]:
            third = ", a third of that: it is Young's modulus that is meant, three times the shear modulus"
        warn(
            f"the curve has levelled off at {level:.4g} Pa, far above equilibrium_modulus = {equilibrium:g} Pa{third}",
            mentions=("equilibrium_modulus",),
        )
