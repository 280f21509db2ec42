"""Measurements of any kind, checked and put into one order."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from dielast.errors import InputError, warn
from dielast.io.table import spoken
from dielast.material.measurement import Measurement
from dielast.material.measurement_kind import MeasurementKind
from dielast.numerics.arrays import Flags, Floats, Index

NOTABLE_DIFFERENCE = 1.05  # factor of modulus between two runs at one temperature that is warned of,
CONTRADICTION = 1.25  # and factor that is an error


@dataclass(frozen=True, slots=True, eq=False)
class Gathered:
    """All points (n,), sorted by temperature, position and ordinate; `curve` is the place in the ascending `temperature` (m,).

    `abscissa` is the time in s, which is `offset` s less than measured, or the angular frequency in rad/s. `ordinates` (c, n) are
    the relaxation modulus, the creep compliance, or storage and loss modulus. The ordinates fall along `position`: time, the
    inverse of the frequency, or for a compliance, which rises with time, the inverse of the time. `order` (m,) lists the
    temperatures in the order of the curves given, which is that of the measurements.
    """

    kind: MeasurementKind
    temperature: Floats
    curve: Index
    position: Floats
    abscissa: Floats
    ordinates: Floats
    offset: Floats
    order: Index

    @property
    def good(self) -> Flags:
        """Points whose ordinates are all positive (n,)."""
        return np.asarray(np.all(self.ordinates > 0, axis=0))

    @property
    def log_time(self) -> Floats:
        """log10 of the time in s, or of the inverse of the angular frequency, of each point (n,)."""
        return self.kind.time_power * np.log10(self.abscissa)


def gather(curves: Sequence[Measurement]) -> Gathered:
    """Check `curves`, merge those of one temperature, and sort; raises `InputError` as `build_master_curve` says."""
    kinds = list(dict.fromkeys(curve.KIND for curve in curves))
    if len(kinds) > 1:
        both = " and ".join(kind.curves for kind in kinds)
        raise InputError(f"{both} cannot be shifted together: give the curves of one kind of measurement")
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
    abscissa, *rest = np.concatenate(columns, axis=1)
    ordinates, curve = np.array(rest), run_curve[run]
    _check_signs(temperature, curve, run, np.any(ordinates <= 0, axis=0), kind)
    position = abscissa**kind.falling_power
    order = np.lexsort((ordinates[0], position, curve))
    order = order[~_repeated(kind, temperature, curve[order], run[order], abscissa[order], ordinates[:, order])]
    offset = np.array([measured.time_offset for measured in curves])[run]
    rows = (curve[order], position[order], abscissa[order], ordinates[:, order], offset[order])
    return Gathered(kind, temperature, *rows, np.argsort(first))


def _repeated(kind: MeasurementKind, temperature: Floats, curve: Index, run: Index, abscissa: Floats, ordinates: Floats) -> Flags:
    """Rows (n,) equal to the row before; warns of them, and of an abscissa that stands twice in a run with other values."""
    again = (np.diff(curve, prepend=-1) == 0) & (np.diff(abscissa, prepend=np.nan) == 0)
    same = again & np.all(np.diff(ordinates, prepend=np.nan) == 0, axis=0)
    other = again & ~same & (np.diff(run, prepend=-1) == 0)
    name, unit = kind.abscissa
    for rows, outcome in ((same, "with the same values: each is taken once"), (other, "with different values: all are taken")):
        if np.any(rows):
            k, count = int(np.flatnonzero(rows)[0]), int(np.count_nonzero(rows))
            many = f"; {count - 1} more such row{'s' if count > 2 else ''}" if count > 1 else ""
            place = f"{temperature[curve[k]]:g} degC: {spoken(name)} {abscissa[k]:g} {unit}"
            warn(f"{place} appears twice, {outcome}{many}")
    return np.asarray(same)


def where(curves: Sequence[Measurement], temperature: float) -> str:
    """A temperature as messages name it, with its file if the curves come from several."""
    sources = dict.fromkeys(curve.source for curve in curves if curve.temperature == temperature)
    known = "" not in sources and len({curve.source for curve in curves}) > 1
    return f"{temperature:g} degC" + (f" ({', '.join(sources)})" if known else "")


def _check_signs(temperature: Floats, curve: Index, run: Index, wrong: Flags, kind: MeasurementKind) -> None:
    """Raise `InputError` where most values of a curve are zero or negative; warn of fewer, as a noise floor gives them."""
    total = np.bincount(curve, minlength=temperature.size)
    below = np.bincount(curve[wrong], minlength=temperature.size)
    for k in np.flatnonzero(below):
        first = int(np.flatnonzero((curve == k) & wrong)[0] - np.searchsorted(run, run[np.flatnonzero(curve == k)[0]]))
        problem = f"{temperature[k]:g} degC: {below[k]} of {total[k]} {kind.values} are zero or negative"
        if 2 * below[k] > total[k]:
            raise InputError(f"{problem}, the first at point {first}: positive {kind.values} are needed")
        warn(f"{problem} (noise floor)")


def _check_runs(temperature: float, runs: list[Floats], kind: MeasurementKind) -> None:
    """Two runs at one temperature are one measurement if they agree where their abscissas overlap; runs are (1 + c, n)."""
    for one, other in combinations(map(_sorted_log, runs), 2):
        if not one[0].size or not other[0].size:
            continue
        gap = np.concatenate((_gap(one, other), -_gap(other, one)))
        factor = 10 ** abs(float(np.median(gap))) if gap.size else 1.0
        if factor > CONTRADICTION:
            raise InputError(
                f"{temperature:g} degC was measured twice and the runs contradict each other: "
                f"their {kind.values} differ by a factor of {factor:.3g}; leave one out"
            )
        if factor > NOTABLE_DIFFERENCE:
            warn(f"{temperature:g} degC: two runs differ by a factor of {factor:.3g} in {kind.value}; they are taken together")


def _gap(run: tuple[Floats, Floats], other: tuple[Floats, Floats]) -> Floats:
    """log10 of the ordinates of a run over those of another, where it lies within the other's abscissas."""
    inside = (run[0] >= other[0][0]) & (run[0] <= other[0][-1])
    return np.asarray(run[1][inside] - np.interp(run[0][inside], *other))


def _sorted_log(run: Floats) -> tuple[Floats, Floats]:
    abscissa, ordinate = run[:2]
    good = ordinate > 0
    order = np.lexsort((ordinate[good], abscissa[good]))
    return np.log10(abscissa[good][order]), np.log10(ordinate[good][order])
