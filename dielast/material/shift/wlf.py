"""The law of Williams, Landel and Ferry."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from dielast.base.errors import InputError, warn
from dielast.base.units import TEMPERATURE_DIFFERENCE, ZERO_CELSIUS
from dielast.material.argument_types import checked
from dielast.material.law import Constant
from dielast.material.shift.arrhenius import GAS_CONSTANT, Arrhenius
from dielast.material.shift.law import FittedLaw, MovedLaw, ShiftLaw, fit_factor, reduced_chi_square, refuse_frozen, slower_when_hot
from dielast.numerics.arrays import Floats

# K, C1 C2 = 1 / (ln 10 alpha_f) at any reference temperature; the expansion alpha_f of the free volume is 1e-4 to 4e-3 /K
FREE_VOLUME = 100.0, 4000.0
SMALLEST_C2 = (
    50.0  # K, about the lowest temperature: that of most polymers at the glass transition, the lowest temperature for shifts
)
ASSUMED_C2 = 25  # values of an assumed C2 that are tried
STRAIGHT = 1e6  # K, C2 with which log10 a is a straight line over temperature, within 0.01 % over 100 K
POORLY_KNOWN = 0.25  # relative standard error of C2 above which a warning is given
BEFORE_POLE = 0.98  # of the distance to a pole: the pole lies outside of the measured temperatures
SAME_LAW = 1e-8  # of C2 with which WLF is Arrhenius' law: the digits of a material file
SETTLED = 1e-14  # relative change of the constants with which the search ends


@checked
@dataclass(frozen=True, slots=True)
class WLF(ShiftLaw):
    """log10 a = -C1 (T - T_ref) / (C2 + T - T_ref), Eq. 11 of DOI 10.1115/1.4030850.

    `C1` is dimensionless (decimal logarithm), `C2` in K, `reference_temperature` in degC. At the pole, T = T_ref - C2, the material
    would never relax. Raises `InputError` for invalid constants, and for temperatures at or below the pole.
    """

    reference_temperature: float
    C1: float
    C2: float

    name: ClassVar = "wlf"
    title: ClassVar = "WLF"
    constants: ClassVar = (
        Constant("C1", "Constant C1 of the WLF law.", above=0.0),
        Constant("C2", "Constant C2 of the WLF law.", TEMPERATURE_DIFFERENCE, above=0.0),
    )

    def __post_init__(self) -> None:
        if not np.isfinite(self.C1):  # may be negative: a fit to wrongly assigned temperatures
            raise InputError(f"{self.C1:g}: a finite number is needed", argument="C1")
        if not (np.isfinite(self.C2) and self.C2 > 0):
            raise InputError(f"{self.C2:g}: a number of K above 0 is needed", argument="C2")

    def log10_shift_factor(self, temperature: ArrayLike) -> Floats:
        """log10 a(T); raises `InputError` at or below the pole."""
        distance = np.asarray(temperature, dtype=float) - self.reference_temperature
        pole = self.reference_temperature - self.C2
        where = f"{pole:g} degC, where the WLF law has its pole: C2 = {self.C2:g} K below {self.reference_temperature:g} degC"
        if self.reference_temperature > 200:  # hardly ever a reference temperature in degC
            where += f", which if it were kelvin would be {self.reference_temperature - ZERO_CELSIUS:g} degC"
        refuse_frozen(temperature, self.C2 + distance, where)
        return np.asarray(-self.C1 * distance / (self.C2 + distance))

    def label(self) -> str:
        """Both constants."""
        return f"WLF, $C_1$ = {self.C1 + 0.0:.4g}, $C_2$ = {self.C2 + 0.0:.4g} K"

    def warning(self) -> str:
        """A warning if the constants are not those of a polymer."""
        product, (low, high) = self.C1 * self.C2, FREE_VOLUME
        if product < 0:
            return slower_when_hot(f"WLF with C1 = {self.C1:g} and C2 = {self.C2:g} K", "should C1 be positive?")
        if np.isclose(self.C2, self.reference_temperature + ZERO_CELSIUS, rtol=SAME_LAW):  # no free volume: it is Arrhenius' law
            return Arrhenius(self.reference_temperature, product * GAS_CONSTANT * float(np.log(10))).warning()
        if low <= product <= high:
            return ""
        if self.C2 >= STRAIGHT / 10:
            return f"WLF with C2 = {self.C2:g} K is a straight line over temperature: no polymer follows one far"
        natural = high < product <= high * np.log(10)
        guess = "is C1 for natural logarithms, 2.303 times too large?" if natural else "is one of them in another unit?"
        usual = f"polymers have {low:g} to {high:g} K at any reference temperature"
        return f"WLF with C1 = {self.C1:g} and C2 = {self.C2:g} K: C1 C2 is {product:.3g} K, but {usual}: {guess}"

    @classmethod
    def fit(cls, base: float, distance: Floats, log10_shift: Floats, whiten: Floats) -> FittedLaw:
        """The fit of log10 a = -g d / (1 + k d), d = T - T_base, g = C1/C2, k = 1/C2: regular even if C2 is large.

        If the data do not determine C2, C2 = T_ref in kelvin is assumed. If they refute that by two standard errors of k, because
        they are straighter or curved the other way, the law is the best that has 0 < C2 <= STRAIGHT.
        """
        # no pole among the measured temperatures
        lowest = -BEFORE_POLE / float(distance.max()) if distance.max() > 0 else -np.inf
        highest = -BEFORE_POLE / float(distance.min()) if distance.min() < 0 else np.inf
        g, k = _least_squares(distance, log10_shift, whiten, lowest, highest)
        jacobian = _jacobian(distance, g, k, whiten)
        normal: Floats = jacobian.T @ jacobian
        misfit = reduced_chi_square(whiten @ (log10_shift + g * distance / (1 + k * distance)), 2)
        scale = np.sqrt(np.diag(normal))
        # without any shift, C2 has no effect
        regular = distance.size >= 2 and np.all(scale > 0) and np.linalg.cond(normal / np.outer(scale, scale)) < 1e12
        moments: Floats = np.asarray(np.linalg.inv(normal)) if regular else np.full((2, 2), np.inf)
        spread = float(np.sqrt(moments[1, 1] * max(misfit, 1.0)))
        plausible, assumed = np.zeros((0, 2)), ""
        if k <= max(spread, 0.0):
            bent, upper, k = k < -spread, k + 2 * spread, max(k, 1 / STRAIGHT)
            if upper < (arrhenius := 1 / (base + ZERO_CELSIUS)):
                why = "bend the other way than the WLF law" if bent else "are a straight line over temperature"
                least = f" (it is above {1 / upper:.3g} K)" if upper > 0 else ""
                taken = f"the closest WLF law is taken, C2 = {1 / k:.3g} K{least}, which holds between these temperatures only"
            else:
                k, why = arrhenius, "do not determine the WLF constants C1 and C2 separately"
                taken = "C2 = T_ref in kelvin is assumed, which makes it Arrhenius' law"
            g, variance, response, misfit = fit_factor(whiten, -distance / (1 + k * distance), log10_shift)
            moments = np.array([[variance[0, 0], 0.0], [0.0, 0.0]])
            largest = min(1 / (SMALLEST_C2 + max(-float(distance.min()), 0.0)), upper)
            plausible = _with_k(np.linspace(0.0, max(largest, k), ASSUMED_C2), distance, log10_shift, whiten)
            response = np.vstack((response, np.zeros(response.shape)))
            assumed = f"the shift factors of {distance.size + 1} temperatures {why}: {taken}, and only the ratio C1/C2 is fitted"
        else:
            response = np.asarray(moments @ jacobian.T @ whiten)
            if spread > POORLY_KNOWN * k:
                precision = f"C2 is known to {100 * spread / k:.0f} % only"
                warn(f"these temperatures hardly determine the WLF constants C1 and C2 separately: {precision}")

        def about(move: float) -> MovedLaw:
            pole = 1 + k * move
            if pole <= 0:
                raise InputError(
                    f"{base + move:g} degC is at or below {base - 1 / k:g} degC, the pole of the WLF law",
                    argument="reference_temperature",
                )
            law = cls(base + move, float(g / (k * pole)), float(1 / k + move))
            to_constants = np.array([[1 / (k * pole), -g * (1 + 2 * k * move) / (k * pole) ** 2], [0.0, -1 / k**2]])
            to_origin = np.array([-move / pole, g * move**2 / pole**2])
            poles = 1 + plausible[:, 1] * move
            others = -plausible[:, 0] * move / np.where(poles > 0, poles, np.nan)
            return MovedLaw(law, to_constants, -g * move / pole, to_origin, others)

        return FittedLaw(about, moments, response, misfit, assumed)


def _with_k(k: Floats, distance: Floats, log10_shift: Floats, whiten: Floats) -> Floats:
    """g and k (n, 2) for given k (n,)."""
    columns = -distance / (1 + k[:, None] * distance) @ whiten.T
    return np.stack((columns @ whiten @ log10_shift / np.sum(columns**2, axis=1), k), axis=1)


def _jacobian(distance: Floats, g: float, k: float, whiten: Floats) -> Floats:
    """Derivatives (m, 2) of the whitened log10 a with respect to g and k."""
    pole = 1 + k * distance
    return whiten @ np.stack((-distance / pole, g * distance**2 / pole**2), axis=1)


def _least_squares(distance: Floats, log10_shift: Floats, whiten: Floats, lowest: float, highest: float) -> tuple[float, float]:
    """g and k, k within bounds; the start is the solution of log10_shift (1 + k d) = -g d, which is linear in both."""
    from scipy.optimize import least_squares  # slow to load

    matrix = whiten @ np.stack((-distance, -log10_shift * distance), axis=1)
    g, k = np.linalg.lstsq(matrix, whiten @ log10_shift, rcond=None)[0].tolist()

    def misses(x: Floats) -> Floats:
        return np.asarray(whiten @ (-x[0] * distance / (1 + x[1] * distance) - log10_shift))

    def slopes(x: Floats) -> Floats:
        return _jacobian(distance, float(x[0]), float(x[1]), whiten)

    solution = least_squares(
        misses,
        np.array([g, float(np.clip(k, lowest, highest))]),
        slopes,
        bounds=((-np.inf, lowest), (np.inf, highest)),
        method="dogbox",
        x_scale="jac",
        xtol=SETTLED,
        ftol=None,
        gtol=None,
    )
    return float(solution.x[0]), float(solution.x[1])
