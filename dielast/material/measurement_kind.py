"""The kinds of measurement, relaxation, creep and oscillation: their words, columns and units, and the response of a linear solid.

A new kind is an object here, an entry of `KINDS`, and a class of curves in `dielast.material.measurement`; all other modules use
the kind. The response is linear in the strengths of the processes (moduli or compliances) and in one or two constants. For the
equations see J. D. Ferry, Viscoelastic properties of polymers, 3rd ed., Wiley 1980, ch. 3.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from dielast.numerics.arrays import Floats

KindName = Literal["relaxation", "oscillation", "creep"]


@dataclass(frozen=True, slots=True, eq=False)
class MeasurementKind:
    """One kind of measurement.

    `name` is the word in recipes and summaries; `tests` and `curves` are plurals, `value` and `values` the measured quantity, and
    `stiffness` is the modulus by which two curves are compared. `abscissa` and `ordinates` are names and SI units of columns.

    Three powers replace distinctions of kinds: time is the abscissa to the power `time_power`, a stiffness is an ordinate to the
    power `stiffness_power`, and an ordinate falls along the abscissa to the power `falling_power`, their product.

    `processes(time, process_time)` is the response (channels, n, m) of processes of unit strength with the times `process_time`
    (m,), and `constants(time)` that of unit constants, (constants, channels, n). `time` (n,) is in s; in oscillation it is one over
    the angular frequency.
    """

    name: KindName
    tests: str
    curves: str
    value: str
    values: str
    stiffness: str
    abscissa: tuple[str, str]
    ordinates: tuple[tuple[str, str], ...]
    label: str
    """Label of the ordinates in a figure, with their unit."""
    label_factor: float
    """Factor from SI into the unit of `label`."""
    step: str
    """The quantity whose step is the origin of time; empty if there is none."""
    remedy: str
    """Advice for curves that do not superpose."""
    processes: Callable[[Floats, Floats], Floats]
    constants: Callable[[Floats], Floats]
    time_power: int = 1
    stiffness_power: int = 1
    ends: tuple[str, str] = ("short", "long")
    """Adjectives for the ends of short and of long times."""
    regions: tuple[str, str] = ("short times", "long times")
    """Names of the regions of short and of long times."""
    more_overlap: str = "longer"
    """How to measure so that two curves have a modulus in common."""

    @property
    def falling_power(self) -> int:
        """Power of the abscissa along which an ordinate falls."""
        return self.time_power * self.stiffness_power

    @property
    def over_frequency(self) -> bool:
        """Whether the abscissa is an angular frequency, not a time."""
        return self.time_power < 0

    @property
    def reduced_abscissa(self) -> tuple[str, str]:
        """Name and unit of the abscissa of a master curve."""
        return f"reduced_{self.abscissa[0]}", self.abscissa[1]


def _decay(time: Floats, relaxation_time: Floats) -> Floats:
    return np.exp(-time[:, None] / relaxation_time)[None]


def _retard(time: Floats, retardation_time: Floats) -> Floats:
    return -np.expm1(-time[:, None] / retardation_time)[None]


def _oscillate(time: Floats, relaxation_time: Floats) -> Floats:
    phase = relaxation_time / time[:, None]  # angular frequency times relaxation time
    loss = 1 / (phase + 1 / phase)
    return np.stack([phase * loss, loss])


def _over_time(name: KindName, step: str, value: str, values: str, **rest: Any) -> MeasurementKind:
    """A kind of test over the time since a `step` of strain or stress."""
    return MeasurementKind(
        name=name,
        tests=f"{name} tests",
        curves=f"{name} curves",
        value=value,
        values=values,
        abscissa=("time", "s"),
        step=step,
        remedy=f"check that time is counted from the {step} step and that no ramp is left in (ramp, discard_before)",
        **rest,
    )


RELAXATION = _over_time(  # G(t) = G_e + sum G_k exp(-t/tau_k)
    "relaxation",
    "strain",
    "modulus",
    "moduli",
    stiffness="modulus",
    ordinates=(("relaxation_modulus", "Pa"),),
    label="Young's relaxation modulus [MPa]",
    label_factor=1e-6,
    processes=_decay,
    constants=lambda time: np.ones((1, 1, time.size)),
)
CREEP = _over_time(  # J(t) = J_0 + sum J_k (1 - exp(-t/lambda_k)) + t/eta
    "creep",
    "stress",
    "compliance",
    "compliances",
    stiffness="inverse compliance",
    ordinates=(("creep_compliance", "1/Pa"),),
    label="tensile creep compliance [1/MPa]",
    label_factor=1e6,
    stiffness_power=-1,
    processes=_retard,
    constants=lambda time: np.stack([np.ones(time.size), time])[:, None],
)
OSCILLATION = MeasurementKind(  # G'(w) = G_e + sum G_k (w tau_k)^2/(1 + (w tau_k)^2), G''(w) = sum G_k w tau_k/(1 + (w tau_k)^2)
    name="oscillation",
    tests="frequency sweeps",
    curves="frequency sweeps",
    value="modulus",
    values="storage or loss moduli",
    stiffness="storage modulus",
    abscissa=("angular_frequency", "rad/s"),
    ordinates=(("storage_modulus", "Pa"), ("loss_modulus", "Pa")),
    label="Young's storage and loss modulus [MPa]",
    label_factor=1e-6,
    ends=("high-frequency", "low-frequency"),
    regions=("high frequencies", "low frequencies"),
    more_overlap="over more frequencies",
    step="",
    remedy="check that the highest frequencies are free of resonance and inertia, and the stiffest readings of compliance",
    time_power=-1,
    processes=_oscillate,
    constants=lambda time: np.stack([np.ones(time.size), np.zeros(time.size)])[None],
)
KINDS: dict[KindName, MeasurementKind] = {kind.name: kind for kind in (RELAXATION, OSCILLATION, CREEP)}
