"""How well curves superpose: their distance from the master curve beyond noise, and where it is largest."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dielast.errors import warn
from dielast.material.measurement_kind import MeasurementKind
from dielast.numerics.arrays import Floats, Index

PARTS = 4  # number of parts of each curve, of equal length in log time
VISIBLE = 0.01  # decades of modulus; usual differences of specimens and instruments
SURE = 4.0  # standard errors of the correlation of neighbours
WORST = 3  # number of temperatures in a message
STANDS_OUT = 1.4  # ratio to the misfit of all parts, above which a part of the curves is mentioned


@dataclass(frozen=True, slots=True, eq=False)
class Misfit:
    """Root mean squares of the misfit in decades of modulus, of all points, `by_curve` (m,) and `by_part` of the curves (PARTS,).

    `noise` is the root mean square of the scatter, and `part` (n,) the part of its curve that contains a point. A misfit is `sure`
    if chance does not explain it. It `matters` if it also exceeds the noise and usual differences between specimens, or if it
    changes the shift factors.
    """

    rms: float
    noise: float
    by_curve: Floats
    by_part: Floats
    part: Index
    sure: bool
    matters: bool


def find_misfit(series: Index, curve: Index, log_time: Floats, residual: Floats) -> Misfit:
    """The misfit from the `residual` (n,) of points sorted by series (a channel of a curve), then time.

    Neighbouring points share the misfit but not the noise. So the mean product of their residuals is the square of the misfit, and
    the difference of their residuals is due to noise.
    """
    bounds = np.searchsorted(series, np.arange(series[-1] + 2))
    begin, end = log_time[bounds[:-1]], log_time[bounds[1:] - 1]
    along = (log_time - begin[series]) / np.maximum(end - begin, 1e-12)[series]
    part = np.minimum((PARTS * along).astype(np.intp), PARTS - 1)
    joined = np.flatnonzero(series[1:] == series[:-1])
    product = residual[joined] * residual[joined + 1]
    noise = float(np.sqrt(np.median(np.diff(residual)[joined] ** 2) / 2 / 0.455))
    rms = _root(float(np.mean(product)))
    by_curve = _root(np.bincount(curve[joined], product) / np.bincount(curve[joined]))
    count = np.bincount(part[joined], minlength=PARTS)
    by_part = _root(np.bincount(part[joined], product, minlength=PARTS) / np.maximum(count, 1))
    sure = rms**2 > SURE / np.sqrt(residual.size) * float(np.mean(residual**2))
    return Misfit(float(rms), noise, by_curve, by_part, part, bool(sure), bool(sure and rms > max(VISIBLE, noise)))


def _root(square: Floats | float) -> Floats:
    return np.sqrt(np.maximum(square, 0.0))


def warn_if_misfit(temperature: Floats, misfit: Misfit, vertical: bool, kind: MeasurementKind) -> None:
    """Warn of curves that do not superpose, with the distance, the worst temperatures, and possible remedies."""
    if not misfit.matters:
        return
    worst = sorted(k for k in np.argsort(-misfit.by_curve, kind="stable")[:WORST] if misfit.by_curve[k] > misfit.rms)
    where = "most at " + ", ".join(f"{temperature[k]:g}" for k in worst) + " degC" if worst else "at all temperatures alike"
    early, late = misfit.by_part[0] > STANDS_OUT * misfit.rms, misfit.by_part[-1] > STANDS_OUT * misfit.rms
    where += f" and at {kind.regions[0]}" if early else f" and at {kind.regions[1]}" if late else ""
    remedies = [
        kind.remedy,
        "" if vertical else 'try vertical = "free"',
        "one shift factor for a temperature may be too little for this material",
    ]
    warn(
        f"the curves do not superpose: they miss the master curve by {_percent(misfit.rms)} rms over and above their "
        f"noise of {_percent(misfit.noise)}, {where} (the standard errors allow for it): "
        f"{'; or '.join(filter(None, remedies))}"
    )


def _percent(decades: float) -> str:
    return f"{100 * (10**decades - 1):.2g} %"
