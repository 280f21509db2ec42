"""The smallest spectrum with the response of a full one over a window of times, at stated temperatures.

At every time t in the window, the two spectra must agree in the stress due to a strain that began at time 0, as a step, G(t), or as
a steady ramp of any duration T up to t: the mean of G from t - T to t. At the lower end a of the window, these are the means of G
from any earlier time to a. Together with G(t) after a, they determine the means at all later times, and the relative error of a sum
of positive parts is at most that of the worst part. Agreement in G(t) and in the means up to a is therefore enough. The means also
account for processes faster than the window: these do not contribute to G(t) there, but to the stress soon after a ramp and, as
viscosities, to the stress during a ramp.

For a given number of branches, relaxation times and moduli that minimise the largest relative error are found by successive linear
programmes (K. Madsen, J. Inst. Maths Applics 16 (1975) 321). They start from relaxation times that are even in log time, and from
times that are even in relaxed modulus. The number of branches is the smallest one with an error within the tolerance. The
equilibrium modulus is unchanged.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from dielast.base.errors import InputError, NumericsError
from dielast.io.result import TabularResult
from dielast.io.table import Column, Table
from dielast.material.shift import ShiftLaw
from dielast.material.spectrum import Spectrum
from dielast.numerics.arrays import Floats

_PER_DECADE, _PROOF_PER_DECADE = 16, 60  # times per decade at which the error is minimised, and at which it is then measured
_LEAST_TOLERANCE = 1e-5  # linear programmes are hardly more accurate, and no spectrum is known so accurately
_ROUNDS = 40
_WIDEST, _LEAST = 1.2, 1e-4  # largest change of ln tau in a round, and the one at which the iteration ends
_GAIN = 1e-3  # relative decrease of the error that counts as progress
_REACH = 10.0  # largest relaxation time over the last time of the window
_UNFELT = 0.1  # of the tolerance: faster processes whose contribution to the stress of a ramp is smaller are neglected
_EARLIEST = 1e-9  # of the first time of the window: earlier times do not contribute to the means


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Reduction(TabularResult):
    """A reduced `spectrum` and the proof of its accuracy.

    `max_relative_error` is the largest error of G(t) over the window at all temperatures, and occurs at `temperature` (degC) and
    `time` (s); `max_relative_error_ramp` is that of the stress, within the window, of ramps that end then or earlier. `full` and
    `reduced` (m,) are the compared moduli G (shear, Pa) at `test_temperature` and `test_time`.
    """

    spectrum: Spectrum
    tolerance: float
    max_relative_error: float
    max_relative_error_ramp: float
    temperature: float
    time: float
    test_temperature: Floats
    test_time: Floats
    full: Floats
    reduced: Floats

    def columns(self) -> Table:
        """The table of the compared moduli."""
        return [
            Column("temperature", "degC", self.test_temperature),
            Column("time", "s", self.test_time),
            Column("full", "Pa", self.full),
            Column("reduced", "Pa", self.reduced),
        ]


def reduce_spectrum(
    spectrum: Spectrum,
    equilibrium_modulus: float,
    shift: ShiftLaw,
    *,
    window: tuple[float, float],
    temperatures: Sequence[float] | None = None,
    tolerance: float = 0.01,
) -> Reduction:
    """The smallest spectrum within `tolerance` of the full one over `window` (s, s) at each of `temperatures` (degC).

    The tolerance is that of the stress at times in the window, which count from the beginning of a step or a ramp of strain of any
    duration. Method: K. Madsen, J. Inst. Maths Applics 16 (1975) 321.

    `temperatures` is by default the reference temperature of `shift`; `equilibrium_modulus` is shear, Pa. Raises `InputError` for
    an invalid window or tolerance, a temperature outside of the shift law, a spectrum that relaxes to zero within the window, and
    if no smaller spectrum is accurate enough; `NumericsError` if the linear programmes fail.
    """
    if not 0 <= equilibrium_modulus < np.inf:
        needed = "a finite number of at least 0 is needed"
        raise InputError(f"{equilibrium_modulus:g} Pa: {needed}", argument="equilibrium_modulus")
    temperatures = (shift.reference_temperature,) if temperatures is None else tuple(temperatures)
    log10_shift = _check(window, temperatures, tolerance, shift)
    felt = _UNFELT * tolerance
    spectrum = spectrum.slowest_first()
    responses = _Responses.over(spectrum, equilibrium_modulus, window, log10_shift, _PER_DECADE, felt)
    proof = _Responses.over(spectrum, equilibrium_modulus, window, log10_shift, _PROOF_PER_DECADE, felt / 10)
    few, many, smallest = 0, len(spectrum), None
    while many - few > 1:  # more branches, less error
        number = min((few + many) // 2, 2 * few + 4)
        trials = _candidates(responses, number, spectrum)
        trial = next((reduced for reduced in trials if np.max(np.abs(proof.error(reduced))) <= tolerance), None)
        if trial is None:
            few = number
        else:
            many, smallest = number, trial
    if smallest is None:
        raise InputError(
            f"no spectrum of fewer than {len(spectrum)} branches stays within {tolerance:.3g} of the full one from {window[0]:g} "
            f"to {window[1]:g} s: a larger tolerance or a narrower window is needed"
        )
    step, ramp = np.split(np.abs(proof.error(smallest)), [proof.time.size])
    worst, count = int(np.argmax(step)), step.size // len(temperatures)
    of_step = slice(step.size)
    return Reduction(
        spectrum=smallest,
        tolerance=tolerance,
        max_relative_error=float(step[worst]),
        max_relative_error_ramp=float(ramp.max()),
        temperature=float(temperatures[worst // count]),
        time=float(proof.time[worst] * 10 ** log10_shift[worst // count]),
        test_temperature=np.repeat(temperatures, count),
        test_time=proof.time[of_step] * 10 ** np.repeat(log10_shift, count),
        full=proof.full[of_step],
        reduced=smallest.relaxation_modulus(proof.time, equilibrium_modulus),
    )


def _check(window: tuple[float, float], temperatures: Sequence[float], tolerance: float, shift: ShiftLaw) -> Floats:
    """log10 of the shift factors at the temperatures; raises `InputError` as `reduce_spectrum` does."""
    first, last = window
    if not 0 < first < last < np.inf:
        raise InputError(f"from {first:g} to {last:g} s: two positive times, the shorter one first, are needed", argument="window")
    if not _LEAST_TOLERANCE <= tolerance < 1:
        raise InputError(
            f"{tolerance:g}: a relative error from {_LEAST_TOLERANCE:g} to 1 is needed, such as 0.01", argument="tolerance"
        )
    if not temperatures:
        raise InputError("at least one temperature is needed to reduce a spectrum for", argument="temperatures")
    other_temperatures = [temperature for temperature in temperatures if temperature != shift.reference_temperature]
    if other_temperatures and not shift.depends_on_temperature:
        raise InputError(
            f"{other_temperatures[0]:g} degC: the curve comes without a shift law, so that a spectrum can be reduced for its "
            f"reference temperature, {shift.reference_temperature:g} degC, only",
            argument="temperatures",
        )
    return shift.log10_shift_factor(np.array(temperatures, dtype=float))


@dataclass(frozen=True, slots=True, eq=False)
class _Responses:
    """The responses `full` (m + r,) of the full spectrum: G at reduced times `time` (m,), then its means from `start` to `end`
    (r,).
    """

    time: Floats
    start: Floats
    end: Floats
    full: Floats
    equilibrium: float

    @classmethod
    def over(
        cls, spectrum: Spectrum, equilibrium: float, window: tuple[float, float], log10_shift: Floats, dense: int, felt: float
    ) -> Self:
        """At `dense` times per decade; means begin where the integral of G exceeds `felt` times its value for the longest."""
        count = int(np.ceil(dense * np.log10(window[1] / window[0]))) + 1
        time = (np.geomspace(*window, max(count, 3)) / 10 ** log10_shift[:, None]).reshape(-1)
        starts, ends = [], []
        for end in window[0] / 10**log10_shift:
            before = end * 10 ** np.arange(np.log10(_EARLIEST), -0.5 / dense, 1 / dense)
            area = equilibrium * before - spectrum.relaxation_time * np.expm1(-before[:, None] / spectrum.relaxation_time) @ (
                spectrum.shear_modulus
            )
            starts.append(np.append(0.0, before[area > felt * area[-1]]))
            ends.append(np.full(starts[-1].size, end))
        start, end = np.concatenate(starts), np.concatenate(ends)
        full = equilibrium + _unit_responses(time, start, end, spectrum.relaxation_time) @ spectrum.shear_modulus
        least = 1e-12 * (equilibrium + spectrum.shear_modulus.sum())
        if np.any(relaxed_out := full[: time.size] <= least):
            at = float(time[relaxed_out.argmax()])
            raise InputError(f"the full spectrum has relaxed to nothing at a reduced time of {at:.3g} s: end the window before")
        return cls(time, start, end, full, equilibrium)

    def of_units(self, tau: Floats) -> Floats:
        """The responses of branches of modulus 1 at these relaxation times, (m + r, branches)."""
        return _unit_responses(self.time, self.start, self.end, tau)

    def error(self, spectrum: Spectrum) -> Floats:
        """Relative errors (m + r,) of a spectrum."""
        return (self.equilibrium + self.of_units(spectrum.relaxation_time) @ spectrum.shear_modulus) / self.full - 1

    def slopes(self, tau: Floats) -> Floats:
        """The derivatives of `of_units` with respect to ln tau."""
        share, first, last = (time[:, None] / tau for time in (self.time, self.start, self.end))
        mean = _mean(first, last)
        return np.concatenate([share * np.exp(-share), mean + (first * np.exp(-first) - last * np.exp(-last)) / (last - first)])


def _unit_responses(time: Floats, start: Floats, end: Floats, tau: Floats) -> Floats:
    """exp(-t/tau) at each `time` (m,), followed by its mean from each `start` to its `end` (r,): (m + r, branches)."""
    return np.concatenate([np.exp(-time[:, None] / tau), _mean(start[:, None] / tau, end[:, None] / tau)])


def _mean(first: Floats, last: Floats) -> Floats:
    """The mean of exp(-x) from `first` to `last`."""
    return np.asarray(np.exp(-first) * -np.expm1(first - last) / (last - first))


def _candidates(responses: _Responses, number: int, spectrum: Spectrum) -> Iterator[Spectrum]:
    """Spectra of `number` branches whose largest error is a local minimum, from times that are even in log time and from times that
    are even in relaxed modulus.
    """
    tau, share = spectrum.relaxation_time, (np.arange(number) + 0.5) / number
    fastest, slowest = max(responses.start[responses.start > 0].min(), tau[-1]), min(responses.time.max() * _REACH, tau[0])
    low, high = sorted(np.log([fastest, slowest]).tolist())
    yield _improved(responses, low + share * (high - low), low, high)
    fine, order = np.linspace(low, high, 400), np.argsort(responses.time)
    # the square root of relaxed modulus over modulus: a compromise between even in time and even in modulus
    level = np.interp(fine, np.log(responses.time[order]), responses.full[: responses.time.size][order])
    present = np.exp(-((fine[:, None] - np.log(tau)) ** 2)) @ spectrum.shear_modulus / level
    relaxed = np.cumsum(np.sqrt(present) + 1e-12)
    yield _improved(responses, np.interp(share * relaxed[-1], relaxed, fine), low, high)


def _improved(responses: _Responses, log_tau: Floats, low: float, high: float) -> Spectrum:
    """The spectrum near `log_tau` whose largest relative error is a local minimum with respect to times and moduli."""
    moduli, best = _programme(responses, log_tau, None, 0.0, low, high)[1:]
    trust = _WIDEST
    for _ in range(_ROUNDS):
        new_log_tau, _, _ = _programme(responses, log_tau, moduli, trust, low, high)
        trial_moduli, error = _programme(responses, new_log_tau, None, 0.0, low, high)[1:]
        if error < best * (1 - _GAIN):
            log_tau, moduli, best = new_log_tau, trial_moduli, error
            trust = min(1.5 * trust, _WIDEST)
        else:
            trust /= 3
            if trust < _LEAST:
                break
    return Spectrum(np.exp(log_tau), moduli).slowest_first()


def _programme(
    responses: _Responses, log_tau: Floats, moduli: Floats | None, trust: float, low: float, high: float
) -> tuple[Floats, Floats, float]:
    """ln tau, moduli and the largest relative error from a linear programme: at fixed times, or, if `moduli` are stated, linearised
    about them with changes of ln tau up to `trust`.
    """
    from scipy.optimize import linprog

    tau = np.exp(log_tau)
    unit = responses.of_units(tau) / responses.full[:, None]
    scale = 1 / unit.max(axis=0)
    columns, bounds = unit * scale, [(0.0, None)] * tau.size
    if moduli is not None:
        columns = np.column_stack([columns, responses.slopes(tau) * moduli / responses.full[:, None]])
        bounds += [(max(low - place, -trust), min(high - place, trust)) for place in log_tau.tolist()]
    target = 1 - responses.equilibrium / responses.full
    ones = np.ones((target.size, 1))
    # there is always a solution; if rounding stops one method, another succeeds
    for method in ("highs", "highs-ipm", "highs-ds"):
        solution = linprog(
            np.append(np.zeros(columns.shape[1]), 1.0),
            A_ub=np.block([[columns, -ones], [-columns, -ones]]),
            b_ub=np.concatenate([target, -target]),
            bounds=[*bounds, (0.0, None)],
            method=method,
        )
        if solution.x is not None:
            break
    else:
        raise NumericsError(f"the spectrum could not be reduced to {tau.size} branches: {solution.message}")
    new_log_tau = log_tau + solution.x[tau.size : 2 * tau.size] if moduli is not None else log_tau
    # the programme satisfies its bounds only to about 1e-7
    return new_log_tau, np.maximum(solution.x[: tau.size], 0.0) * scale, float(solution.x[-1])
