"""The range in which a spring is stable: its tension increases with stretch, so that under a dead load its energy is at a minimum.

With p the true and s = p/l the nominal stress, ds/dl > 0 means dp/dln l > p. Modes: "uniaxial" (axis 2 free), "equibiaxial",
"pure-shear" (axis 2 held at 1). Laws fitted to tests over a short range, in particular Yeoh's and Ogden's, may have a maximum of
tension outside of that range.
"""

import numpy as np

from dielast.material.springs.law import SpringLaw
from dielast.numerics.arrays import Flags, Floats

FURTHEST = 30.0  # largest stretch, and inverse of the smallest one, at which a law is examined
POINTS = 400  # in each of extension and compression, in steps of 0.9 %
BISECTIONS = 40
SECOND = {"uniaxial": -0.5, "equibiaxial": 1.0, "pure-shear": 0.0}  # B = A to this power, by mode


def tension_rises(law: SpringLaw, squared_stretch: Floats, mode: str | None) -> Flags:
    """Whether (...) the tension increases with stretch at squared stretches (2, ...), in a `mode`; if None, in each axis while the
    other is held. False beyond the limit of the law.
    """
    with np.errstate(all="ignore"):
        (p, q), (k11, k12, k22) = law.tangent(squared_stretch)
        k11, k12, k22 = 2 * k11, 2 * k12, 2 * k22  # in logarithmic stretches
        if mode == "uniaxial":
            # q = 0 along the path, and the energy is at a minimum with respect to the free axis
            rises = (k22 > 0) & (k11 - k12 * k12 / k22 > p)
        elif mode == "equibiaxial":
            rises = k11 + k12 > p
        else:
            rises = k11 > p
            if mode is None:
                rises &= k22 > q
        return np.asarray(rises & (law.margin(squared_stretch) > 0) & np.isfinite(p))


def free_axis_holds(law: SpringLaw, squared_stretch: Floats, mode: str | None) -> Flags:
    """Whether (...) the free axis of a `mode` is stable at squared stretches (2, ...): at constant stretch of axis 1 the energy is
    at a minimum with respect to axis 2. True in modes without a free axis.
    """
    if mode != "uniaxial":
        return np.ones(np.shape(squared_stretch)[1:], dtype=bool)
    with np.errstate(all="ignore"):
        return np.asarray(law.tangent(squared_stretch)[1][2] > 0)


def stable_range(law: SpringLaw, mode: str) -> tuple[float, float]:
    """The stretches below and above 1 between which a spring (with numbers for constants) is stable in a `mode`.

    They are 0 and infinity if it is stable at all examined stretches. The range ends at the limit of a law.
    """
    if law.always_stable and np.all(law.margin(np.full((2, 1), FURTHEST**2)) > 0):
        return 0.0, np.inf
    steps = np.linspace(0.0, np.log(FURTHEST), POINTS)
    ends = []
    for direction in (-1.0, 1.0):
        stable = _stable(law, mode, direction * steps)
        if stable.all():
            ends.append(0.0 if direction < 0 else np.inf)
            continue
        first = int(np.argmin(stable))
        inside, outside = steps[max(first - 1, 0)], steps[first]
        for _ in range(BISECTIONS):
            middle = 0.5 * (inside + outside)
            inside, outside = (middle, outside) if _stable(law, mode, direction * np.array([middle]))[0] else (inside, middle)
        ends.append(float(np.exp(direction * inside)))
    return ends[0], ends[1]


def _stable(law: SpringLaw, mode: str, log_stretch: Floats) -> Flags:
    """Whether the law is stable in a mode at stretches (k,)."""
    return tension_rises(law, np.exp(2 * np.stack((log_stretch, SECOND[mode] * log_stretch))), mode)
