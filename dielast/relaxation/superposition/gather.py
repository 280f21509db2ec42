"""Measurements of any kind, checked and sorted, and the selection of those that can be shifted."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from dielast.base.errors import InputError, warn, without_warnings
from dielast.io.table import spoken
from dielast.material.measurement import Measurement
from dielast.material.measurement_kind import MeasurementKind
from dielast.numerics.arrays import Flags, Floats, Index
from dielast.numerics.robust import robust_deviation
from dielast.relaxation.superposition.binning import Binned, bin_channels
from dielast.relaxation.superposition.overlap import find_isolated

MIN_BINS = 3  # number of points of a curve, which are averages over bins of log time
NOTABLE_DIFFERENCE = 1.02  # ratio of the moduli of two runs at one temperature above which a warning is issued,
SIGNIFICANT = 4.0  # and standard errors of the difference
LONGEST_AGEING = 2.0  # decades of time, above which a difference of two runs is none of ageing
CONTRADICTION = 1.25  # ratio above which it is an error


@dataclass(frozen=True, slots=True, eq=False)
class Gathered:
    """All points (n,), sorted by temperature, position and ordinate; `curve` is the index into the ascending `temperature` (m,).

    `abscissa` is the time in s, which is the mean age of a load with a `ramp` in s (n,), or the angular frequency in rad/s.
    `ordinates` (c, n) are the relaxation modulus, the creep compliance, or storage and loss modulus. The ordinates fall along
    `position`: time, the inverse of the frequency, or, for a compliance, which rises with time, the inverse of the time. `order`
    (m,) lists the temperatures in the order of the curves as passed, which is that of the measurements.
    """

    kind: MeasurementKind
    temperature: Floats
    curve: Index
    position: Floats
    abscissa: Floats
    ordinates: Floats
    ramp: Floats
    order: Index

    @property
    def good(self) -> Flags:
        """Mask (n,) of the points whose ordinates are all positive."""
        return np.asarray(np.all(self.ordinates > 0, axis=0))

    @property
    def log_time(self) -> Floats:
        """log10 of the time in s, or of the inverse of the angular frequency, of each point (n,)."""
        return self.kind.time_power * np.log10(self.abscissa)


def usable_curves(curves: Sequence[Measurement]) -> tuple[Gathered, Binned]:
    """All curves that can be shifted, gathered and binned: without those of too few points, or without overlap.

    Warns of each omitted curve; raises `InputError` if fewer than two remain.
    """
    kept, reasons = list(curves), []
    while True:
        with without_warnings():  # the call below issues them once
            data = _gather(kept)
        binned, m = bin_channels(data.curve, data.position, data.ordinates, data.kind.stiffness_power), data.temperature.size
        lost = np.bincount(data.curve[(binned.bin_of_point < 0) & data.good], minlength=m)
        omitted, axis = {}, "frequency" if data.kind.over_frequency else "time"
        for k in np.flatnonzero((count := np.bincount(binned.curve, minlength=m)) < MIN_BINS).tolist():
            floor = f" ({lost[k]} are noise floor)" if lost[k] else ""
            points = "1 distinct point" if count[k] == 1 else f"{count[k]} distinct points"
            omitted[k] = f"only {points} in log {axis}{floor}; at least {MIN_BINS} are needed"
        if not omitted and m > 2:
            omitted = find_isolated(binned, data.kind)
        if not omitted:
            break
        why = {data.temperature[k]: f"{_where(curves, data.temperature[k])}: {reason}" for k, reason in omitted.items()}
        if m - len(why) < 2:
            raise InputError(next(iter(why.values())))
        reasons += list(why.values())
        kept = [curve for curve in kept if curve.temperature not in why]
    for reason in reasons:
        warn(f"{reason}; this curve is left out")
    data = _gather(kept)
    if np.any(lost):
        end = data.kind.ends[1 if data.kind.stiffness_power > 0 else 0]
        places = ", ".join(f"{data.temperature[k]:g} degC ({lost[k]})" for k in np.flatnonzero(lost))
        warn(f"points at the {end} end of curves that are lost in noise are left out: {places}")
    return data, binned


def _gather(curves: Sequence[Measurement]) -> Gathered:
    """Check `curves`, merge those of one temperature, and sort the points; raises `InputError` as `build_master_curve` states."""
    kinds = list(dict.fromkeys(curve.KIND for curve in curves))
    if len(kinds) > 1:
        names = " and ".join(kind.curves for kind in kinds)
        raise InputError(f"{names} cannot be shifted together: give the curves of one kind of measurement")
    temperature, first, run_curve = np.unique(
        [float(curve.temperature) for curve in curves], return_index=True, return_inverse=True
    )
    if temperature.size < 2:
        instead = f"all curves are at {temperature[0]:g} degC" if temperature.size else "there are no curves"
        raise InputError(f"a master curve needs at least two temperatures, but {instead}")
    kind, columns = kinds[0], [curve.columns for curve in curves]
    for k in np.flatnonzero(np.bincount(run_curve) > 1):
        _check_runs(float(temperature[k]), [columns[i] for i in np.flatnonzero(run_curve == k)], kind)
    run = np.repeat(np.arange(len(curves)), [column.shape[1] for column in columns])
    abscissa, *ordinate_rows = np.concatenate(columns, axis=1)
    ordinates, curve = np.array(ordinate_rows), run_curve[run]
    _check_signs(curves, temperature, curve, run, np.any(ordinates <= 0, axis=0), kind)
    position = abscissa**kind.falling_power
    order = np.lexsort((ordinates[0], position, curve))
    order = order[~_repeated(kind, temperature, curve[order], run[order], abscissa[order], ordinates[:, order])]
    ramp = np.array([measured.ramp_taken_out or 0.0 for measured in curves])[run]
    rows = (curve[order], position[order], abscissa[order], ordinates[:, order], ramp[order])
    return Gathered(kind, temperature, *rows, np.argsort(first))


def _repeated(kind: MeasurementKind, temperature: Floats, curve: Index, run: Index, abscissa: Floats, ordinates: Floats) -> Flags:
    """Mask (n,) of rows equal to the preceding row; warns of them, and of equal abscissas in a run with different values."""
    same_abscissa = (np.diff(curve, prepend=-1) == 0) & (np.diff(abscissa, prepend=np.nan) == 0)
    same_values = same_abscissa & np.all(np.diff(ordinates, prepend=np.nan) == 0, axis=0)
    other = same_abscissa & ~same_values & (np.diff(run, prepend=-1) == 0)
    name, unit = kind.abscissa
    for rows, outcome in (
        (same_values, "with the same values: each is taken once"),
        (other, "with different values: all are taken"),
    ):
        if np.any(rows):
            k, count = int(np.flatnonzero(rows)[0]), int(np.count_nonzero(rows))
            many = f"; {count - 1} more such row{'s' if count > 2 else ''}" if count > 1 else ""
            place = f"{temperature[curve[k]]:g} degC: {spoken(name)} {abscissa[k]:g} {unit}"
            warn(f"{place} appears twice, {outcome}{many}")
    return np.asarray(same_values)


def _where(curves: Sequence[Measurement], temperature: float) -> str:
    """A temperature for messages, with its file if the curves come from several files."""
    sources = dict.fromkeys(curve.source for curve in curves if curve.temperature == temperature)
    with_files = "" not in sources and len({curve.source for curve in curves}) > 1
    return f"{temperature:g} degC" + (f" ({', '.join(sources)})" if with_files else "")


def _check_signs(
    curves: Sequence[Measurement], temperature: Floats, curve: Index, run: Index, wrong: Flags, kind: MeasurementKind
) -> None:
    """Raise `InputError` if most values of a curve are zero or negative; warn of fewer, which are left out.

    Of curves with a source there is no warning: the reader of the file names the rows.
    """
    reported = {measured.temperature for measured in curves if measured.source}
    total = np.bincount(curve, minlength=temperature.size)
    below = np.bincount(curve[wrong], minlength=temperature.size)
    for k in np.flatnonzero(below):
        first = int(np.flatnonzero((curve == k) & wrong)[0] - np.searchsorted(run, run[np.flatnonzero(curve == k)[0]]))
        problem = f"{_where(curves, temperature[k])}: {below[k]} of {total[k]} {kind.values} are zero or negative"
        if 2 * below[k] > total[k]:
            raise InputError(f"{problem}, the first at point {first}: positive {kind.values} are needed")
        if temperature[k] not in reported:
            warn(f"{problem}, the first at point {first}: they are left out as a noise floor")


def _check_runs(temperature: float, runs: list[Floats], kind: MeasurementKind) -> None:
    """`InputError` for runs at one temperature that differ where their abscissas overlap; runs are (1 + c, n)."""
    for one, other in combinations(map(_sorted_log, runs), 2):
        if not one[0].size or not other[0].size:
            continue
        gap = np.concatenate((_gap(one, other), -_gap(other, one)))
        middle = abs(float(np.median(gap))) if gap.size else 0.0
        factor = 10**middle
        if factor > CONTRADICTION:
            raise InputError(
                f"{temperature:g} degC was measured twice and the runs contradict each other: "
                f"their {kind.values} differ by a factor of {factor:.3g}; leave one out"
            )
        # gaps in both directions contain every noise twice
        sure = middle > SIGNIFICANT * robust_deviation(gap - np.median(gap)) / np.sqrt(max(gap.size / 2, 1)) if gap.size else False
        if factor > NOTABLE_DIFFERENCE and sure:
            slope = abs(float(np.polyfit(*one, 1)[0])) if one[0].size > 1 else 0.0
            along = kind.abscissa[0].replace("_", " ")
            aged = f", or by {middle / slope:.2g} decades of {along}, as after ageing" if slope > middle / LONGEST_AGEING else ""
            warn(
                f"{temperature:g} degC: two runs differ by a factor of {factor:.3g} in {kind.value}{aged}: they are taken "
                "together; leave out the one that is not of the material as it is used"
            )


def _gap(run: tuple[Floats, Floats], other: tuple[Floats, Floats]) -> Floats:
    """log10 of the ordinates of a run over those of another, within the abscissas of the other."""
    inside = (run[0] >= other[0][0]) & (run[0] <= other[0][-1])
    return np.asarray(run[1][inside] - np.interp(run[0][inside], *other))


def _sorted_log(run: Floats) -> tuple[Floats, Floats]:
    abscissa, ordinate = run[:2]
    good = ordinate > 0
    order = np.lexsort((ordinate[good], abscissa[good]))
    return np.log10(abscissa[good][order]), np.log10(ordinate[good][order])
