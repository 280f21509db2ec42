"""Elastic films in closed form: each stated number of laws.md and device.md from its own equation, with no other module.

Stretches are dimensionless. Stresses are over the shear modulus mu, nominal fields e = sqrt(eps/mu) V/H and nominal charges
d = D~/sqrt(mu eps), so that e^2 and d^2 stand for eps E~^2/mu and D~^2/(mu eps). Scalars in, scalars out, except where said.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.optimize import brentq, minimize_scalar

STEP = 1e-30  # of a complex step
LOOKS = 2000  # points of a curve between which a turn is looked for


def slope(function: Callable[[complex], complex], x: float) -> float:
    """Derivative of an analytic function at x, exact to rounding."""
    return float(np.imag(function(x + 1j * STEP)) / STEP)


def equibiaxial_stress(x: complex, limit: float = np.inf) -> complex:
    """p/mu = (x^2 - x^-4)/(1 - (2 x^2 + x^-4 - 3)/J) of a Gent spring (science.md, Sec. 3); J infinite is neo-Hookean."""
    return (x**2 - x**-4) / (1 - (2 * x**2 + x**-4 - 3) / limit)


def dead_load_field(x: complex, prestretch: float, limit: float = np.inf) -> complex:
    """e^2 at which a film under the dead load of an equibiaxial prestretch is in equilibrium at stretch x.

    s x + e^2 x^4 = p(x) with s = p(lp)/lp (science.md, Sec. 5).
    """
    load = equibiaxial_stress(prestretch, limit) / prestretch
    return (equibiaxial_stress(x, limit) - load * x) / x**4


def locking(limit: float) -> float:
    """Equibiaxial stretch at which a Gent spring is infinitely stiff: 2 x^2 + x^-4 - 3 = J."""
    return float(brentq(lambda x: 2 * x**2 + x**-4 - 3 - limit, 1.0, np.sqrt(limit + 3), xtol=1e-14))


def turns(prestretch: float, limit: float) -> list[tuple[float, float]]:
    """(stretch, e) where the field of `dead_load_field` has a maximum or a minimum, by stretch: pull-in is the first."""
    grid = np.linspace(prestretch, locking(limit), LOOKS + 1)[1:-1]

    def rise(x: float) -> float:
        return slope(lambda z: dead_load_field(z, prestretch, limit), x)

    rises = np.array([rise(x) for x in grid])
    roots = [brentq(rise, grid[i], grid[i + 1], xtol=1e-14) for i in np.flatnonzero(np.sign(rises[1:]) != np.sign(rises[:-1]))]
    return [(float(x), float(np.sqrt(dead_load_field(x, prestretch, limit)))) for x in roots]


def landing(prestretch: float, limit: float) -> float:
    """Stretch to which a Gent film under dead load snaps from its pull-in at the same field."""
    (_, field), (valley, _) = turns(prestretch, limit)
    return float(
        brentq(lambda x: dead_load_field(x, prestretch, limit) - field**2, valley, locking(limit) * (1 - 1e-12), xtol=1e-14)
    )


def last_pull_in(limit: float) -> float:
    """Prestretch above which a Gent film under dead load has no pull-in: the least slope of e^2 over the stretch is zero."""

    def least(prestretch: float) -> float:
        bounds = (1.01 * prestretch, 0.9 * locking(limit))
        found = minimize_scalar(
            lambda x: slope(lambda z: dead_load_field(z, prestretch, limit), x),
            bounds=bounds,
            method="bounded",
            options={"xatol": 1e-10},
        )
        return float(found.fun)

    return float(brentq(least, 1.5, 2.5, xtol=1e-10))


def neo_hookean_pull_in() -> tuple[float, float]:
    """(stretch, e) of a neo-Hookean film without load: e^2 = x^-2 - x^-8 is largest at x = 4^(1/6)."""
    return 4 ** (1 / 6), float(np.sqrt(3 / 4 ** (4 / 3)))


def softening_dielectric_pull_in(coefficient: float) -> tuple[float, float]:
    """(stretch, e) of a neo-Hookean film without load and with eps = eps_1 [1 + c (l1 + l2 - 2)] (Zhao and Suo 2008).

    With s_i = dW/dl_i - eps E~^2 x^3 - E~^2 x^4 (d eps/d l_i)/2 = 0 and d eps/d l_i = c eps_1,
    e^2 = (x - x^-5)/{x^3 [1 + 2 c (x - 1)] + c x^4/2}; e = sqrt(eps_1/mu) V/H. The maximum.
    """

    def field(x: complex) -> complex:
        return (x - x**-5) / (x**3 * (1 + 2 * coefficient * (x - 1)) + coefficient * x**4 / 2)

    stretch = brentq(lambda x: slope(field, x), 1.1, 1.6, xtol=1e-14)
    return float(stretch), float(np.sqrt(field(stretch)))


def charged_stretch(charge_squared: float) -> float:
    """Stretch of a neo-Hookean film without load at nominal charge d: x^6 = 1 + d^2 (from p = d^2 x^-4), at every d one."""
    return float((1 + charge_squared) ** (1 / 6))


def leaking_charge(charge: float, times: float) -> float:
    """Nominal charge of an insulated film of constant conductivity after `times` eps/sigma: d exp(-t sigma/eps)."""
    return float(charge * np.exp(-times))


def pure_shear_stretch(field: float, width: float) -> float:
    """l1 of a neo-Hookean film held at l2 = `width` and free in axis 1: [lp^2 (1 - e^2 lp^2)]^(-1/4)."""
    return float((width**2 * (1 - field**2 * width**2)) ** -0.25)


def damage_exponent(life_ratio: float, field_ratio: float) -> float:
    """n of the inverse power law: a life that falls by `life_ratio` as the field grows by `field_ratio`."""
    return float(np.log(life_ratio) / np.log(field_ratio))


def held_uniaxially(load: float, limit: float) -> float:
    """Stretch at infinite time under a uniaxial dead load s/mu_eq: s = (x - x^-2)/(1 - (x^2 + 2/x - 3)/J) (science.md, Sec. 5)."""
    end = brentq(lambda x: x**2 + 2 / x - 3 - limit, 1.0, np.sqrt(limit + 3), xtol=1e-14)
    return float(brentq(lambda x: (x - x**-2) - load * (1 - (x**2 + 2 / x - 3) / limit), 1.0, end, xtol=1e-14))


def breakdown_stretch(breakdown_field: float, nominal_field: float) -> float:
    """Equibiaxial stretch at which the true field reaches the breakdown field: sqrt(E_EB L_3/V) (Eq. 21)."""
    return float(np.sqrt(breakdown_field / nominal_field))


def dead_load_small_strain(field: float) -> float:
    """Strain of a film under dead load without prestretch, e^2/6."""
    return field**2 / 6


def framed_small_strain(field: float, rho: float) -> float:
    """Strain of a disc in a frame without prestretch, e^2 (1 - rho^2)/8 (device.md, check 1)."""
    return field**2 * (1 - rho**2) / 8
