"""Whether the two moduli of a frequency sweep are consistent with one material, and its frequencies with the stated unit.

Storage and loss modulus of a causal linear material determine each other. To a good approximation the relation is local: the phase
angle is pi/2 times the slope of log |E*| over log omega: H. C. Booij and G. P. J. M. Thoone, Rheol. Acta 21 (1982) 15. Swapped
columns, and two moduli in different units, violate it.

The relation does not depend on the scale of the frequency, as it contains only slopes over log omega: a sweep in rad/s that is
labelled Hz is still consistent. A check of the scale needs a second quantity that depends on time: a complex viscosity, |eta*| =
|E*| / omega (see `viscosity_factor`), or a column with the other frequency.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from dielast.base.errors import InputError, warn
from dielast.material.measurement import FrequencySweep

SIGNIFICANT_ANGLE = 0.2  # rad; smaller slopes and phases are not compared
CONTRADICTION = 0.5  # difference of the two angles over the larger one; good sweeps have less than 0.1
EXPLAINED = 0.35  # the same after the mistake is corrected
ENOUGH_POINTS = 5
PER_CENT = -2  # decades that a tan delta in per cent is off
UNIT_FACTORS = (-9, -6, -3, PER_CENT, 3, 6, 9)  # decades between Pa, kPa, MPa and GPa


def warn_if_inconsistent(sweeps: Sequence[FrequencySweep]) -> None:
    """Warn if the storage and loss moduli of all `sweeps` together are inconsistent, with the likely reason."""
    data = [_sorted(sweep) for sweep in sweeps]
    if _contradiction(data) <= CONTRADICTION:
        return
    if _contradiction([(omega, loss, storage) for omega, storage, loss in data]) < EXPLAINED:
        warn("storage and loss moduli look swapped: the other way round they fit the slopes of their curves (Kramers-Kronig)")
        return
    misfits = {
        decades: _contradiction([(w, storage, loss * 10.0**decades) for w, storage, loss in data]) for decades in UNIT_FACTORS
    }
    decades = min(misfits, key=lambda key: misfits[key])
    if misfits[decades] < EXPLAINED:
        warn(
            "storage and loss moduli look to be in different units: the loss moduli fit the slopes of the curves if they are "
            f"1e{decades} times as large (Kramers-Kronig)" + (": is tan delta in per cent?" if decades == PER_CENT else "")
        )
        return
    warn("storage and loss moduli do not belong together: the loss does not fit the slopes of the curves (Kramers-Kronig)")


def _sorted(sweep: FrequencySweep) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Frequency and the two moduli by ascending frequency, without negative values and repeated frequencies."""
    good = (sweep.storage_modulus > 0) & (sweep.loss_modulus > 0)
    omega, first = np.unique(sweep.angular_frequency[good], return_index=True)
    return omega, sweep.storage_modulus[good][first], sweep.loss_modulus[good][first]


def _contradiction(data: Sequence[tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]]) -> float:
    """Median, over the points with significant angles, of the difference of the two angles over the larger one."""
    differences = [np.zeros(0)]
    for omega, storage, loss in data:
        if omega.size < 3:
            continue
        slope = np.gradient(np.log(np.hypot(storage, loss)), np.log(omega))
        expected, measured = np.clip(0.5 * np.pi * slope, 0.0, 0.5 * np.pi), np.arctan2(loss, storage)
        larger = np.maximum(expected, measured)
        worth = larger > SIGNIFICANT_ANGLE
        differences.append(np.abs(expected - measured)[worth] / larger[worth])
    relative = np.concatenate(differences)
    return float(np.median(relative)) if relative.size >= ENOUGH_POINTS else 0.0


def viscosity_factor(sweep: FrequencySweep, complex_viscosity: NDArray[np.float64]) -> float:
    """The factor on the frequencies for agreement with a complex viscosity (n,) in Pa s: median |E*| / (omega |eta*|).

    It is 1 in the right unit, 1 / (2 pi) if rad/s were read as Hz, 2 pi in the opposite case. The viscosity is three times the
    shear viscosity, as the moduli are Young's. Raises `InputError` if the lengths differ or no viscosity is positive.
    """
    viscosity = np.asarray(complex_viscosity, dtype=float)
    if viscosity.shape != sweep.angular_frequency.shape:
        raise InputError(f"{viscosity.size} complex viscosities for {sweep.angular_frequency.size} angular frequencies")
    good = viscosity > 0
    if not np.any(good):
        raise InputError("no complex viscosity is positive")
    modulus = np.hypot(sweep.storage_modulus, sweep.loss_modulus)
    return float(np.median(modulus[good] / (sweep.angular_frequency[good] * viscosity[good])))
