"""Measurements as they come, checked and put into one order, whatever their kind."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from dielast.errors import InputError, warn
from dielast.superposition.measurement import CreepCurve, FrequencySweep, Measurement, RelaxationCurve

Array = NDArray[np.float64]
Index = NDArray[np.intp]
MeasurementName = Literal["relaxation", "creep", "oscillation"]

DIFFERENCE = 1.05  # factor of modulus between two runs at one temperature that is worth a warning,
CONTRADICTION = 1.25  # and that is an error

_NAMES: dict[type, tuple[MeasurementName, str]] = {
    RelaxationCurve: ("relaxation", "relaxation curves"),
    CreepCurve: ("creep", "creep curves"),
    FrequencySweep: ("oscillation", "frequency sweeps"),
}


@dataclass(frozen=True, slots=True, eq=False)
class Gathered:
    """All points (n,), sorted by temperature, position and ordinate; `curve` is the place in the ascending `temperature` (m,).

    `abscissa` is the time in s or the angular frequency in rad/s; `ordinates` (c, n) are the relaxation modulus, the creep
    compliance, or storage and loss modulus. `position` is what they fall along: time, the inverse of the frequency, and for a
    compliance, which rises with time, the inverse of the time. `order` (m,) lists the temperatures as they were measured, which is
    as the curves were given.
    """

    measurement: MeasurementName
    temperature: Array
    curve: Index
    position: Array
    abscissa: Array
    ordinates: Array
    order: Index

    @property
    def good(self) -> NDArray[np.bool_]:
        """Points whose ordinates are all positive (n,)."""
        return np.asarray(np.all(self.ordinates > 0, axis=0))


def gather(curves: Sequence[Measurement]) -> Gathered:
    """Check `curves`, merge those of one temperature, and sort; raises `InputError` as `build_master_curve` says."""
    name = _kind(curves)
    stated = [float(curve.temperature) for curve in curves]
    temperature, first, run_curve = np.unique(stated, return_index=True, return_inverse=True)
    if temperature.size < 2:
        raise InputError(f"a master curve needs at least two temperatures, but {_said(temperature)}")
    columns = [_columns(curve) for curve in curves]
    run = np.repeat(np.arange(len(curves)), [column.shape[1] for column in columns])
    abscissa, *rest = np.concatenate(columns, axis=1)
    ordinates = np.array(rest)
    for k in np.flatnonzero(np.bincount(run_curve) > 1):
        _check_runs(float(temperature[k]), [columns[int(i)] for i in np.flatnonzero(run_curve == k)], _what(name)[0])
    curve = run_curve[run]
    _check_signs(temperature, curve, run, np.any(ordinates <= 0, axis=0), _what(name)[1])
    position = abscissa if name == "relaxation" else 1 / abscissa
    order = np.lexsort((ordinates[0], position, curve))
    order = order[~_copies(name, temperature, curve[order], run[order], abscissa[order], ordinates[:, order])]
    return Gathered(name, temperature, curve[order], position[order], abscissa[order], ordinates[:, order], np.argsort(first))


def _copies(
    name: MeasurementName, temperature: Array, curve: Index, run: Index, abscissa: Array, ordinates: Array
) -> NDArray[np.bool_]:
    """Rows (n,) that the one before says already; warns of them, and of an abscissa that stands twice in a run."""
    again = (np.diff(curve, prepend=-1) == 0) & (np.diff(abscissa, prepend=np.nan) == 0)
    same = again & np.all(np.diff(ordinates, prepend=np.nan) == 0, axis=0)
    other = again & ~same & (np.diff(run, prepend=-1) == 0)
    what, unit = ("angular frequency", "rad/s") if name == "oscillation" else ("time", "s")
    for rows, said in ((same, "with the same values: each is taken once"), (other, "with different values: all are taken")):
        if np.any(rows):
            k, count = int(np.flatnonzero(rows)[0]), int(np.count_nonzero(rows))
            many = f"; {count - 1} more such row{'s' if count > 2 else ''}" if count > 1 else ""
            warn(f"{temperature[curve[k]]:g} degC: {what} {abscissa[k]:g} {unit} stands there twice, {said}{many}")
    return np.asarray(same)


def _kind(curves: Sequence[Measurement]) -> MeasurementName:
    kinds = list(dict.fromkeys(type(curve) for curve in curves))
    if len(kinds) > 1:
        both = " and ".join(_NAMES[kind][1] for kind in kinds)
        raise InputError(f"{both} cannot be shifted together: give the curves of one kind of measurement")
    return _NAMES[kinds[0]][0] if kinds else "relaxation"


def _what(name: MeasurementName) -> tuple[str, str]:
    """What is measured, one and many."""
    return ("compliance", "compliances") if name == "creep" else ("modulus", "moduli")


def _columns(curve: Measurement) -> Array:
    match curve:
        case RelaxationCurve():
            return np.stack((curve.time, curve.modulus))
        case CreepCurve():
            return np.stack((curve.time, curve.compliance))
        case FrequencySweep():
            return np.stack((curve.angular_frequency, curve.storage_modulus, curve.loss_modulus))


def where(curves: Sequence[Measurement], temperature: float) -> str:
    """A temperature as messages name it: with the file it comes from, if that is known and not that of all."""
    sources = dict.fromkeys(curve.source for curve in curves if curve.temperature == temperature)
    known = "" not in sources and len({curve.source for curve in curves}) > 1
    return f"{temperature:g} degC" + (f" ({', '.join(sources)})" if known else "")


def _said(temperature: Array) -> str:
    return f"all curves are at {temperature[0]:g} degC" if temperature.size else "there are no curves"


def _check_signs(temperature: Array, curve: Index, run: Index, wrong: NDArray[np.bool_], many: str) -> None:
    """Some values at a noise floor may be zero or negative, not most."""
    total = np.bincount(curve, minlength=temperature.size)
    below = np.bincount(curve[wrong], minlength=temperature.size)
    for k in np.flatnonzero(below):
        first = int(np.flatnonzero((curve == k) & wrong)[0] - np.searchsorted(run, run[np.flatnonzero(curve == k)[0]]))
        if 2 * below[k] > total[k]:
            raise InputError(
                f"{temperature[k]:g} degC: {below[k]} of {total[k]} {many} are zero or negative, the first at point {first}: "
                f"positive {many} are needed"
            )
        warn(f"{temperature[k]:g} degC: {below[k]} of {total[k]} {many} are zero or negative (noise floor)")


def _check_runs(temperature: float, runs: list[Array], what: str) -> None:
    """Two runs at one temperature are one measurement if they agree where their abscissas overlap; rows as of `_columns`."""
    for i, one in enumerate(runs):
        for other in runs[i + 1 :]:
            here, there = (_sorted_log(run) for run in (one, other))
            if not here[0].size or not there[0].size:
                continue
            inside = (here[0] >= there[0][0]) & (here[0] <= there[0][-1])
            back = (there[0] >= here[0][0]) & (there[0] <= here[0][-1])
            gap = np.concatenate(
                (here[1][inside] - np.interp(here[0][inside], *there), np.interp(there[0][back], *here) - there[1][back])
            )
            factor = 10 ** abs(float(np.median(gap))) if gap.size else 1.0
            many = "moduli" if what == "modulus" else "compliances"
            if factor > CONTRADICTION:
                raise InputError(
                    f"{temperature:g} degC was measured twice and the runs contradict each other: "
                    f"their {many} differ by a factor of {factor:.3g}; leave one out"
                )
            if factor > DIFFERENCE:
                warn(f"{temperature:g} degC: two runs differ by a factor of {factor:.3g} in {what}; they are taken together")


def _sorted_log(run: Array) -> tuple[Array, Array]:
    abscissa, ordinate = run[:2]
    good = ordinate > 0
    order = np.lexsort((ordinate[good], abscissa[good]))
    return np.log10(abscissa[good][order]), np.log10(ordinate[good][order])
