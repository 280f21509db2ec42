"""Warnings of a material that is used outside the range of its measurements (temperature, stretch, duration, rate), or at
stretches at which its equilibrium spring is unstable.
"""

from collections.abc import Collection, Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from dielast.base.errors import warn
from dielast.base.units import TIMES
from dielast.material.checks import warn_of_temperature
from dielast.material.material import Material
from dielast.material.springs.stable_range import free_axis_holds, stable_range, tension_rises
from dielast.numerics.arrays import Floats

MARGIN = 5.0  # K beyond the measured temperatures at which a shift law is used without a warning
BEYOND_TESTS = 0.05  # of the largest I1 of the tests: may be exceeded by this share without a warning
LONGER = 2.0  # times the longest test, for which a material is used without a warning
UNTESTED = 0.1  # of I1 - 3 of the tests, in a mode without tests, without a warning


def warn_of_stretches(material: Material, stretch: ArrayLike, mode: str | None) -> None:
    """Warn of stretches (2, points) on the path of a `mode`, None for any, where the material is unstable or was not measured."""
    warn_of_instability(material, stretch, mode)
    warn_of_range(material, stretch, mode)


def warn_of_instability(material: Material, stretch: ArrayLike, mode: str | None) -> None:
    """Warn of stretches (2, points) at which the equilibrium spring is unstable; on the path of a `mode` if stated."""
    law, values = material.equilibrium_law, np.asarray(stretch, dtype=float)
    if law.always_stable or material.equilibrium_modulus == 0 or not values.size:
        return
    unstable = ~tension_rises(law, np.square(values), mode) & np.all(np.isfinite(values), axis=0)
    if not unstable.any():
        return
    at = values[:, [int(np.argmax(unstable))]]
    first, second = at.ravel().tolist()
    if mode is None:
        where, stable = f"stretches of {first:.4g} x {second:.4g}", ""
    else:
        low, high = stable_range(law, mode)
        ends = [f"above {low:.4g}"] * (low > 0) + [f"below {high:.4g}"] * (high < np.inf)
        where, stable = f"a stretch of {first:.4g}", f"; in {mode} loading it is stable {' and '.join(ends)} only"
    if free_axis_holds(law, np.square(at), mode).all():
        why = "its tension falls with the stretch"
    else:
        why = "its free axis is at no minimum of the energy, so that the film grows narrower or wider by itself"
    warn(
        f"at {where} the {law.title} law of the equilibrium spring is unstable: {why}{stable}; check "
        "whether its constants were fitted to such stretches"
    )


def warn_of_range(material: Material, stretch: ArrayLike, mode: str | None) -> None:
    """Warn of stretches (2, points) beyond the tests that a material was calibrated by; on the path of a `mode` if stated."""
    calibrated, values = material.calibrated, np.asarray(stretch, dtype=float)
    if calibrated is None or not values.size:
        return
    first, second = values
    invariant = first**2 + second**2 + (first * second) ** -2.0
    largest = float(np.max(invariant[np.isfinite(invariant)], initial=3.0))
    tested = f"{' and '.join(calibrated.modes)} tests up to I1 = {calibrated.largest_invariant:.4g}"
    where = [f"at I1 = {largest:.4g}"] if largest > calibrated.largest_invariant * (1 + BEYOND_TESTS) else []
    apart = ""
    if is_untested(mode, calibrated.modes) and largest > 3 + UNTESTED * (calibrated.largest_invariant - 3):
        where.insert(0, "in loading with unequal stretches" if mode is None else f"in {mode} loading")
        apart = ": [springs] try of calibrate finds how far laws that fit these tests alike differ there"
        if calibrated.law_spread is not None:
            apart = f"; laws that fit these tests alike differ by a factor of {calibrated.law_spread:.3g} in the voltage of a film"
    if where:
        warn(f"the material was calibrated by {tested} only: {', and '.join(where)} its law is extrapolated{apart}")


def is_untested(mode: str | None, tested: Collection[str]) -> bool:
    """Whether a mode (None: any) is neither `tested` nor between uniaxial and equibiaxial tests, as all modes are: at one I1, the
    I2 of an incompressible material is least in uniaxial and largest in equibiaxial tension.
    """
    return mode not in tested and not {"uniaxial", "equibiaxial"}.issubset(tested)


def warn_of_use(material: Material, temperature: ArrayLike) -> None:
    """Warn of temperatures (degC, any shape) that look wrong, or at which the shift law of the material was not measured."""
    warn_of_temperature(temperature, "the temperature is")
    values = np.atleast_1d(np.asarray(temperature, dtype=float))
    calibrated = None if material.calibrated is None else material.calibrated.temperature
    for measured, what in (
        (calibrated, "the material was calibrated by tests"),
        (material.measured_temperature, "the shift law was measured"),
    ):
        if measured is None:
            continue
        (low, high), beyond = measured, np.maximum(measured[0] - values, values - measured[1])
        if np.any(beyond > MARGIN):
            worst, span = float(values.flat[np.argmax(beyond)]), f"at {low:g}" if low == high else f"from {low:g} to {high:g}"
            warn(f"{what} {span} degC: at {worst:g} degC it is extrapolated")
    warn_of_no_shift(material, values)


def warn_of_no_shift(material: Material, temperature: Floats) -> None:
    """Warn of temperatures (k,) in degC at which a material without a shift law relaxes as at its reference temperature."""
    away = temperature[np.abs(temperature - material.reference_temperature) > MARGIN]
    if away.size and len(material.spectrum) and not material.shift.depends_on_temperature:
        as_at = f"at {float(away[0]):g} degC it relaxes as at {material.reference_temperature:g} degC"
        warn(f"the material has no shift law, {as_at}: state [shift] in the material file")


def warn_of_lasting(material: Material, temperature: ArrayLike, time: ArrayLike) -> None:
    """Warn of times in s at temperatures in degC, both (k,), that are longer than what a material was measured or calibrated by;
    times at different temperatures are compared by the shift law. NaN is no time.
    """
    values, heat = np.atleast_1d(np.asarray(time, dtype=float)), np.atleast_1d(np.asarray(temperature, dtype=float))
    values, heat = values[~np.isnan(values)], heat[~np.isnan(values)]
    known, window, calibrated = [], material.window, material.calibrated
    if calibrated is not None:
        tested = calibrated.time[1] / 10 ** float(material.shift.log10_shift_factor(np.array(calibrated.temperature[1])))
        known.append((tested, "the tests that the material was calibrated by, which are"))
    if window is not None:
        known.append((window.time[1], "the measured relaxation, which is"))
    if not known or not values.size:
        return
    longest, what = max(known)
    reach = longest * 10 ** np.asarray(material.shift.log10_shift_factor(heat))
    k = int(np.argmax(values / reach))
    if values[k] <= LONGER * reach[k]:
        return
    unknown = "slower branches are unknown"
    if material.equilibrium_range is not None:
        low, high = material.equilibrium_range
        unknown = f"the plateau was not reached, and the equilibrium shear modulus is between {low:.3g} and {high:.3g} Pa"
    elif window is not None and window.plateau_reached:
        unknown = "the modulus is taken to stay on its plateau"
    known_to = f"{what} equivalent to {reach[k]:.3g} s at this temperature"
    warn(f"{values[k]:.3g} s at {heat[k]:g} degC are longer than {known_to}: {unknown}")


@dataclass(frozen=True, slots=True)
class Pace:
    """A process of `lasting` s in a film whose fastest branch has a relaxation time of `fastest` s at `temperature` degC; `what`
    begins the message, such as "step[0] takes".
    """

    what: str
    lasting: float
    fastest: float
    temperature: float


def fastest_branch(material: Material, temperature: float) -> float:
    """The shortest relaxation time in s of the branches with a modulus above 0; 0 if there is none."""
    carrying = material.relaxation_time(temperature)[material.spectrum.shear_modulus > 0]
    return float(carrying[-1]) if carrying.size else 0.0


def warn_of_paces(paces: Iterable[Pace]) -> None:
    """Warn of the fastest process that is faster than the fastest branch: branches that the spectrum lacks, because it was
    truncated or not measured at such short times, would resist, and the simulated film is too soft.
    """
    hasty = [pace for pace in paces if pace.lasting < pace.fastest]
    if hasty:
        worst = min(hasty, key=lambda pace: pace.lasting / pace.fastest)
        took = f"{worst.fastest:.3g} s" if worst.fastest <= TIMES[1] else f"more than {TIMES[1]:g} s"
        warn(
            f"{worst.what} {worst.lasting:.3g} s, but the fastest branch takes {took} at {worst.temperature:g} degC: the spectrum "
            "lacks faster branches, so that the simulated film is too soft over so short a time"
        )
