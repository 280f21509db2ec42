"""Where a spring is stable: where its tension rises with the stretch, so that under a dead load it is at a minimum of energy.

With p the true and s = p/l the nominal stress, ds/dl > 0 is dp/dln l > p. Modes: "uniaxial" (axis 2 free), "equibiaxial",
"pure-shear" (axis 2 held at 1). Laws fitted to tests over a short range, Yeoh's and Ogden's above all, may have a maximum of
tension outside of it.
"""

from __future__ import annotations

import numpy as np

from dielast.material.springs.law import SpringLaw
from dielast.numerics.columns import Flags, Floats

FURTHEST = 30.0  # stretch, or one over it, up to which a law is looked at
POINTS = 400  # of the search on either side, in steps of 0.9 %
BISECTIONS = 40
SECOND = {"uniaxial": -0.5, "equibiaxial": 1.0, "pure-shear": 0.0}  # B = A to this power, by mode


def tension_rises(law: SpringLaw, squared_stretch: Floats, mode: str | None) -> Flags:
    """Whether (...) the tension rises with the stretch at squared stretches (2, ...), on the path of a `mode`; None: in each axis
    while the other is held. Not so beyond the end of the law.
    """
    with np.errstate(all="ignore"):
        (p, q), (k11, k12, k22) = law.tangent(squared_stretch)
        k11, k12, k22 = 2 * k11, 2 * k12, 2 * k22  # in logarithmic stretches
        if mode == "uniaxial":
            # q = 0 on the way, and the free axis is at a minimum itself
            rises = (k22 > 0) & (k11 - k12 * k12 / k22 > p)
        elif mode == "equibiaxial":
            rises = k11 + k12 > p
        else:
            rises = k11 > p
            if mode is None:
                rises &= k22 > q
        return np.asarray(rises & (law.room(squared_stretch) > 0) & np.isfinite(p))


def stable_range(law: SpringLaw, mode: str) -> tuple[float, float]:
    """The stretches about 1 between which a spring with numbers for constants is stable in a `mode`.

    0 and infinity where it is stable as far as is looked. A law with a limit ends at that.
    """
    if law.always_stable and np.all(law.room(np.full((2, 1), FURTHEST**2)) > 0):
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
