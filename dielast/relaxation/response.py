"""How a linear viscoelastic solid answers the three tests: a strain step, an oscillation, a stress step.

Each answer is linear in what the solid is made of: the strengths of its processes (moduli, or compliances) and one or two
constants. Times are reduced times in s; for an oscillation they are 1/omega, so that long times are low frequencies in every test.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Response:
    """A test with one or more measured channels.

    `processes(time (n,), own_time (m,))` is the answer (channels, n, m) of processes of unit strength, `constants(time)` that of
    the unit constants, (constants, channels, n).
    """

    processes: Callable[[Array, Array], Array]
    constants: Callable[[Array], Array]


def _decay(time: Array, relaxation_time: Array) -> Array:
    return np.exp(-time[:, None] / relaxation_time)[None]


def _oscillate(time: Array, relaxation_time: Array) -> Array:
    phase = relaxation_time / time[:, None]  # omega tau
    loss = 1 / (phase + 1 / phase)
    return np.stack([phase * loss, loss])


def _retard(time: Array, retardation_time: Array) -> Array:
    return -np.expm1(-time[:, None] / retardation_time)[None]


# the relaxation modulus, whose constant is the equilibrium modulus
RELAXATION = Response(_decay, lambda time: np.ones((1, 1, time.size)))
# storage and loss modulus; the equilibrium modulus is all storage
OSCILLATION = Response(_oscillate, lambda time: np.stack([np.ones(time.size), np.zeros(time.size)])[None])
# the creep compliance; its constants are the glassy compliance and the fluidity, one over the viscosity
CREEP = Response(_retard, lambda time: np.stack([np.ones(time.size), time])[:, None])
