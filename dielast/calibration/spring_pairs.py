"""Spring laws to try for the equilibrium spring and the branches: where their constants start, and between which bounds they are.

Starts and bounds follow from x = I1 - 3, the largest of the tests: limits of chains begin beyond x, coefficients of (I1 - 3)^n are
such that they change the stiffness at x by a few times its size. Branches flow before they lock: their limits may be lower.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np

from dielast.base.errors import InputError, nearest
from dielast.calibration.experiment import Experiment, MeasuredTest
from dielast.calibration.parameters import SPRING_KEYS, Free
from dielast.calibration.voltage import VoltageTest
from dielast.material.material import Material
from dielast.material.springs import SPRINGS, SpringLaw

# Choices: wide enough to hold rubbers, narrow enough for starts to be near a fit.
CLOSE = 1.02  # least limit over the largest value of the tests
LOOSE = 0.05  # the same for branches, which flow
WIDE = 100.0  # largest limit over the same
CURVED = 3.0  # largest change of the stiffness at x by a coefficient

Pair = tuple[str, str]


def pairs_of(stated: str | Sequence[str | Sequence[str]]) -> list[Pair]:
    """The pairs of laws, of the equilibrium spring and the branches: all with "all", of all laws in a list with each other, and the
    pairs in a list; raises `InputError` for an unknown law.
    """
    names = [law.name for law in SPRINGS]
    entries = names if stated == "all" else [stated] if isinstance(stated, str) else list(stated)
    single = [entry for entry in entries if isinstance(entry, str)]
    double = [entry for entry in entries if not isinstance(entry, str)]
    for name in (*single, *(name for pair in double for name in pair)):
        if name not in names:
            raise InputError(f"{name!r}: {nearest(str(name), names)}")
    for pair in double:
        if len(pair) != 2:
            raise InputError(f"{list(pair)}: a pair is that of the equilibrium spring and of the branches")
    return list(dict.fromkeys([*product(single, single), *((first, second) for first, second in double)]))


def reach_of(tests: Sequence[Experiment], material: Material) -> float:
    """The largest I1 - 3 of tests whose stretch is known beforehand."""
    reached = [test.largest_invariant for test in tests if isinstance(test, MeasuredTest)]
    reached += [test.reach(material)[1] for test in tests if isinstance(test, VoltageTest)]
    return max(reached, default=6.0) - 3


def trial(material: Material, pair: Pair, free: Mapping[str, Free], reach: float) -> tuple[Material, dict[str, Free]]:
    """The material with a pair of laws at the start, and its free constants by path: those that are stated, if it has them, and
    those of the shape of both springs.
    """
    modulus = material.equilibrium_modulus or 1.0
    laws, stated = [], dict[str, Free]()
    for section, name in zip(SPRING_KEYS, pair, strict=True):
        law, shape = _start(SPRINGS[name], modulus if section == "equilibrium" else None, reach)
        laws.append(law)
        kept = {path: each for path, each in free.items() if path.partition(".")[0] == section}
        known = {path.partition(".")[2].partition("[")[0] for path in kept}
        for path, each in kept.items():
            key = path.partition(".")[2].partition("[")[0]
            if (key in SPRING_KEYS[section] and (section != "equilibrium" or law.takes_modulus)) or key in shape:
                stated[path] = each
        stated |= {f"{section}.{key}": each for key, each in shape.items() if key not in known}
    stated |= {path: each for path, each in free.items() if path.partition(".")[0] not in SPRING_KEYS}
    return replace(material, equilibrium_law=laws[0], nonequilibrium_law=laws[1]), stated


def _start(kind: type[SpringLaw], modulus: float | None, x: float) -> tuple[SpringLaw, dict[str, Free]]:
    """A law at the start, and its free constants; `modulus` is that of the equilibrium spring, None for branches."""
    least = CLOSE if modulus is not None else LOOSE
    unit = 1.0 if modulus is None else modulus
    limit = Free(min=least * x, max=WIDE * x, start=3 * x)
    chains = float(np.sqrt(1 + x / 3))
    curved = {f"C{n}0": Free(min=-CURVED * 0.5 * unit / x ** (n - 1), max=CURVED * 0.5 * unit / x ** (n - 1)) for n in (2, 3)}
    values: dict[str, dict[str, Any]] = {
        "gent": {"J_lim": 3 * x},
        "yeoh": {"C10": 0.5 * unit, "C20": 0.0, "C30": 0.0},
        "arruda-boyce": {"locking_stretch": 2 * chains},
        "mooney-rivlin": {"C10": 0.4 * unit, "C01": 0.1 * unit},
        "ogden": {"mu": (unit,), "alpha": (2.0,)},
        "gent-i2": {"J_lim": 3 * x, "I2_share": 0.2, "I2_exponent": 0.5},
    }
    shapes: dict[str, dict[str, Free]] = {
        "gent": {"J_lim": limit},
        "yeoh": curved,
        "arruda-boyce": {"locking_stretch": Free(min=1 + least * (chains - 1), max=30 * chains, start=2 * chains)},
        "mooney-rivlin": {"C01": Free(min=0.0, max=CURVED * unit)}
        | ({} if modulus is None else {"C10": Free(min=0.0, max=WIDE * unit)}),
        "ogden": {"alpha": Free(min=0.2, max=8.0)} | ({} if modulus is None else {"mu": Free(min=unit / WIDE, max=WIDE * unit)}),
        "gent-i2": {"J_lim": limit, "I2_share": Free(min=0.0, max=1.0), "I2_exponent": Free(min=0.0, max=1.0)},
    }
    return kind(**values.get(kind.name, {})), shapes.get(kind.name, {})
