"""Raw files of a tensile machine, made here: grips that overshoot, a force that rings, specimens that differ, an offset.

A grip is an oscillator that is carried along by the crosshead: each change of the crosshead's speed lets it swing about its place.
The load cell shows the force of the specimen and, at the same frequency, that of the swinging mass.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import erf

from dielast import Material, MeasuredTest
from dielast.calibration.laboratory import Laboratory

GAUGE, AREA = 0.08, 22e-6  # m and m^2


@dataclass(frozen=True)
class Machine:
    """`frequency` in Hz and `damping` of the grip, the first swing of the `force` in N at a change of speed of 0.02 m/s, its phase,
    the swing of the extension over that of an ideal oscillator, noise of the force over its level, `offset` and force at rest in N.
    """

    frequency: float = 3.0
    damping: float = 0.12
    force: float = 0.5
    phase: float = np.pi / 2
    overshoot: float = 0.6
    noise: float = 0.003
    offset: float = 0.0
    at_rest: float = 0.0


QUIET = Machine(force=0.0, overshoot=0.0)


@dataclass(frozen=True)
class Record:
    """Time in s, extension in m, force in N, the `clean` force of the specimen, and which points a transient moves by over 3 % of
    the largest force.
    """

    time: np.ndarray
    extension: np.ndarray
    force: np.ndarray
    clean: np.ndarray
    disturbed: np.ndarray

    def test(self, name: str = "test", specimen: str = "", force: np.ndarray | None = None) -> MeasuredTest:
        stress = (self.force if force is None else force) / AREA
        return MeasuredTest(name, self.time, 1 + self.extension / GAUGE, stress, 20.0, specimen=specimen)

    def table(self) -> str:
        rows = zip(self.time, 1e3 * self.extension, self.force, strict=True)
        return "Time [s],Extension [mm],Force [N]\n" + "".join(f"{t:.4f},{x:.4f},{f:.5f}\n" for t, x, f in rows)


_KNOWN: dict[tuple[object, ...], tuple[np.ndarray, Material]] = {}


def _stress(material: Material, time: np.ndarray, extension: np.ndarray, slack: str | None) -> np.ndarray:
    """The stress in Pa at `time`, worked out once for records that differ in their noise alone."""
    key = id(material), time.tobytes(), extension.tobytes(), slack
    if key not in _KNOWN:
        blank = MeasuredTest("blank", time, 1 + extension / GAUGE, np.ones(time.size), 20.0, slack=slack)
        answer = Laboratory([blank]).answers([material])[0][0]
        _KNOWN[key] = np.concatenate((np.zeros(time.size - blank.time.size), answer)), material  # which keeps its id
    return _KNOWN[key][0]


def record(
    material: Material,
    corners: list[tuple[float, float]],
    time: np.ndarray,
    machine: Machine,
    random: np.random.Generator,
    factor: float = 1.0,
    slack: str | None = None,
) -> Record:
    """What the machine writes at `time` if the crosshead follows straight lines between corners of time in s and stretch."""
    at, stretch = np.array(corners).T
    ideal = GAUGE * (np.interp(time, at, stretch) - 1)
    speed = np.concatenate(([0.0], np.diff(stretch) / np.diff(at) * GAUGE, [0.0]))
    omega = 2 * np.pi * machine.frequency
    swing, pull = np.zeros((2, time.size))
    for begin, change in zip(at, np.diff(speed), strict=True):
        after = np.maximum(time - begin, 0.0)
        fading = np.exp(-machine.damping * omega * after) * (time > begin)
        swing -= machine.overshoot * change / omega * fading * np.sin(omega * after)
        pull += machine.force * change / 0.02 * fading * np.sin(omega * after + machine.phase)
    extension = np.maximum(ideal + swing, 0.0)
    clean = factor * AREA * _stress(material, time, extension, slack)
    resting = machine.at_rest * (time <= at[0] + 1e-9) if at[0] > 0 else np.zeros(time.size)
    disturbance = pull + resting
    level = np.sqrt(0.5 * np.square(clean) + 0.5 * np.mean(np.square(clean)))
    force = clean + disturbance + machine.offset + machine.noise * level * random.standard_normal(time.size)
    return Record(time, extension, force, clean, np.abs(disturbance) > 0.03 * np.max(clean))


def hold(
    material: Material,
    machine: Machine,
    random: np.random.Generator,
    top: float = 2.0,
    ramp: float = 4.0,
    lasts: float = 600.0,
    factor: float = 1.0,
    rate: float = 20.0,
    wait: float = 0.0,
) -> Record:
    """A ramp and a hold, with points at `rate` in Hz until 2 s after the ramp and then ever rarer."""
    end = wait + ramp
    time = np.concatenate((np.arange(0.0, end + 2.0, 1 / rate), end + np.geomspace(2.0, lasts, 80)))
    return record(material, [(wait, 1.0), (end, top), (end + lasts, top)], time, machine, random, factor)


def cycles(
    material: Material,
    machine: Machine,
    random: np.random.Generator,
    top: float = 2.5,
    ramp: float = 10.0,
    count: int = 2,
    factor: float = 1.0,
    points: int = 60,
    low: float = 1.0,
    slack: str | None = None,
) -> Record:
    """Triangles between the stretches `low` and `top`."""
    corners = [(0.0, 1.0)] + [(ramp * (k + 1), top if k % 2 == 0 else low) for k in range(2 * count)]
    time = np.linspace(0.0, corners[-1][0], 2 * count * points + 1)
    return record(material, corners, time, machine, random, factor, slack)


def quiet(machine: Machine) -> Machine:
    """The same machine without transients."""
    return replace(machine, force=0.0, overshoot=0.0, at_rest=0.0)


def softened(made: Record, share: float, sharpness: float = 0.3) -> Record:
    """The same specimen if it loses this share of its stress below its largest stretch (Ogden and Roxburgh 1999,
    DOI 10.1098/rspa.1999.0431).
    """
    stretch = 1 + made.extension / GAUGE
    energy = stretch**2 + 2 / stretch - 3
    largest = np.maximum.accumulate(energy)
    factor = 1 - share * erf((largest - energy) / (sharpness * np.max(energy) + 0.1 * largest))
    return replace(made, clean=factor * made.clean, force=factor * made.force)
