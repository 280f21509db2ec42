"""Random programmes of edges and electrodes, as dielast takes them, and as the membrane peer does.

A spring of stiffness k at an edge is to the peer an energy k (l - 1)^2/2 of the film, whose stress is then that at the other end of
the spring.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from flat import actuate
from numpy.typing import NDArray
from peers.membrane import Course, History, Piece, Run, State, at_rest, constant, ramp
from springs import EPS, MU, SPRINGS, Springs

from dielast import FilmStep, Waveform
from dielast.material.dielectric import Leakage

THICKNESS, AREA, LOOKS = 0.5e-3, 1e-4, 4
SECONDS, HIGHEST = (0.3, 4.0), 3e3  # of a step; in V
EDGES = ["stretch", "pair", "stress", "mixed", "wave", "none"]


@dataclass(frozen=True)
class Programme:
    """`steps` on a film with `springs`, held by edge springs of `stiffness` (2,) in Pa, behind a `resistance` in ohm and with a
    leakage of this `conductivity` in S/m, and what the peer finds at `times` (T,) in s. `events` are the times in s of breakdown,
    at this field in V/m, and of each loss of tension and of the pull-in, with which a programme ends.
    """

    springs: Springs
    steps: list[FilmStep]
    stiffness: tuple[float, float]
    resistance: float | None
    conductivity: float
    breakdown: float
    times: NDArray[np.float64]
    there: History
    events: dict[str, list[float]]
    mode: str

    @property
    def arguments(self) -> dict[str, Any]:
        """The arguments of `flat.actuate`, besides material and steps."""
        stated: dict[str, Any] = {} if self.resistance is None else {"resistance": self.resistance, "electrode_area": AREA}
        if self.conductivity:
            stated["leakage"] = Leakage(self.conductivity)
        if any(self.stiffness):
            stated["spring"] = tuple(stiffness or None for stiffness in self.stiffness)
        return {"thickness": THICKNESS, "mode": self.mode, "breakdown_field": self.breakdown, "times": self.times, **stated}

    def differences(self, rtol: float = 1e-9) -> dict[str, float]:
        """The worst relative differences of dielast from the peer: stretches, stresses, voltage, charge, and events by name."""
        here = actuate(self.springs.material, self.steps, rtol=rtol, stop_at="pull-in", **self.arguments)
        there = self.there

        def off(ours: NDArray[np.float64], theirs: NDArray[np.float64]) -> float:
            return float(np.max(np.abs(ours - theirs), initial=0.0) / np.max(np.abs(theirs), initial=1e-30))

        stretch = np.stack((here.stretch_1[0], here.stretch_2[0]))
        found = {
            "stretch": float(np.max(np.abs(stretch / there.stretch - 1))),
            "stress": off(np.stack((here.nominal_stress_1[0], here.nominal_stress_2[0])), there.stress),
            "voltage": off(here.voltage[0] / THICKNESS, there.field),
            "charge": off(here.charge_density[0], there.charge),
        }
        for name in sorted({event.name for event in here.events[0]} | set(self.events)):
            ours, theirs = _apart([event.time for event in here.events[0] if event.name == name]), _apart(self.events.get(name, []))
            found[name] = np.inf if len(ours) != len(theirs) else float(np.max(np.abs(np.divide(ours, theirs) - 1)))
        return found


def _apart(times: list[float]) -> list[float]:
    """Ascending times, without those of a second axis that loses its tension together with the first."""
    return [time for time, before in zip(times, [-np.inf, *times], strict=False) if time > before + 1e-9 * time]


def programme(seed: int, rtol: float = 1e-8) -> Programme | None:
    """The random programme of this seed; None if its film has no equilibrium somewhere."""
    draw = np.random.default_rng(seed)
    springs = SPRINGS[tuple(SPRINGS)[seed % len(SPRINGS)]]
    stiffness = _stiffness(draw)
    mode = str(draw.choice(["equibiaxial", "uniaxial"] if stiffness[1] else ["equibiaxial", "uniaxial", "pure-shear"]))
    conductivity = float(draw.choice([0.0, 2e-13, 2e-12]))
    resistance = float(10 ** draw.uniform(8, 10)) if draw.random() < 0.4 else None
    film = springs.film
    if conductivity:
        film = replace(film, leakage=lambda field: conductivity * field)
    if any(stiffness):
        alone, (first, second) = film.equilibrium, stiffness
        film = replace(film, equilibrium=lambda l1, l2: alone(l1, l2) + 0.5 * (first * (l1 - 1) ** 2 + second * (l2 - 1) ** 2))
    per_resistance = np.inf if resistance is None else resistance * AREA / THICKNESS
    state, source, controls, drive = at_rest(film), 0.0, ["stress", "stress"], "voltage"
    began, rising = 0.0, False  # when the voltage or charge of the source began to rise, and whether it does
    steps: list[FilmStep] = []
    runs: list[Run] = []
    count = int(draw.integers(4, 7))
    for number in range(count):
        lasts = float(draw.uniform(*SECONDS))
        fails = number == count - 1 and draw.random() < 0.6
        edges = _edges(draw, mode, stiffness, ["stretch"] if number == 0 else ["stress", "mixed"] if fails else EDGES)
        electrodes = _electrodes(draw, resistance is None and not conductivity, number)
        if fails:
            electrodes = {"voltage": float(draw.uniform(8, 16)) * HIGHEST}
        waves = any(isinstance(value, Waveform) for value in edges.values())
        edges = {key: replace(value, period=lasts / 2) if waves else value for key, value in edges.items()}
        steps.append(FilmStep(**edges, **electrodes, duration=None if waves else lasts))
        targets = _targets(edges, mode, controls, state)
        axes = []
        for axis, (control, target) in enumerate(targets):
            before = float(np.exp(state.log_stretch[axis])) if control == "stretch" else float(state.stress[axis])
            axes.append((control, _course(before, target, waves, lasts)))
        controls = [control for control, _ in targets]
        begin = source if drive == "voltage" and resistance is not None else state.field
        if "voltage" in electrodes:
            drive, end = "voltage", electrodes["voltage"] / THICKNESS
            source = end
        elif "circuit" in electrodes or "charge" in electrodes:
            drive, begin = "charge", state.charge
            end = electrodes.get("charge", begin)
        else:
            end = begin if drive == "voltage" else state.charge
            begin = end
        if abs(end) > abs(begin) and not rising:
            began = state.time
        rising = abs(end) > abs(begin)
        electric: tuple[str, Any] = ("field", ramp(begin, end, lasts))
        if drive == "charge":
            electric = ("source", constant(0.0)) if conductivity else ("charge", ramp(begin, end, lasts))
        elif resistance is not None:
            electric = ("source", ramp(begin, end, lasts))
        piece = Piece(lasts, (axes[0], axes[1]), electric, per_resistance if drive == "voltage" else np.inf)
        try:
            runs.append(Run(film, [piece], state, theta=_watched(began), rtol=rtol, until_pull_in=True))
        except (FloatingPointError, ValueError):
            return None
        state = runs[-1].final
        if runs[-1].pulled_in is not None:
            break
    return _looked_at(springs, steps, stiffness, resistance, conductivity, mode, runs, draw)


def _course(before: float, target: Any, waves: bool, lasts: float) -> Course:
    """The load along an axis, from its value `before` a step; beside an axis that follows a waveform it is constant."""
    if isinstance(target, Waveform):
        low, high, period = float(target.low), float(target.high), float(target.period)
        return lambda t: low + (high - low) * np.sin(np.pi * t / period) ** 2
    target = before if target is None else target
    return constant(target) if waves else ramp(before, target, lasts)


def _watched(began: float) -> Course:
    """The time scale of pull-in in s: 1 % of the time since the source `began` to rise."""
    return lambda t: 0.01 * (t - began)


def _stiffness(draw: np.random.Generator) -> tuple[float, float]:
    """The stiffness of the springs at the edges of both axes in Pa, 0 for none."""
    held = draw.random() < 0.3
    first, second = 10 ** draw.uniform(3, 4.5, 2)
    return (float(first) if held else 0.0, float(second) if held and draw.random() < 0.5 else 0.0)


def _edges(draw: np.random.Generator, mode: str, stiffness: tuple[float, float], kinds: list[str]) -> dict[str, Any]:
    """What a random step of one of these `kinds` does to the edges; those with a spring take a stress."""
    kind = str(draw.choice(kinds))
    if any(stiffness) and kind in ("stretch", "pair", "wave"):
        kind = "stress"
    if kind == "wave":
        low, high = np.sort(draw.uniform(1.2, 2.4, 2))
        return {"stretch": Waveform(float(low), float(high), 1.0, 2)}
    if kind == "stretch":
        return {"stretch": float(draw.uniform(1.2, 2.4))}
    if kind == "pair":
        return {"stretch": (float(draw.uniform(1.2, 2.4)), float(draw.uniform(1.1, 1.9)))}
    value = float(draw.uniform(2e4, 5e4)) + stiffness[0]
    if kind == "stress" or (kind == "mixed" and stiffness[1]):
        return {"stress": (value, value * float(draw.uniform(0.5, 1.0))) if mode == "equibiaxial" else value}
    return {"stress": (value, None), "stretch": (None, float(draw.uniform(1.1, 1.9)))} if kind == "mixed" else {}


def _electrodes(draw: np.random.Generator, may_charge: bool, number: int) -> dict[str, Any]:
    """What a random step does to the electrodes; the second one closes the circuit, so that there is a voltage."""
    kind = "voltage" if number == 1 else str(draw.choice(["voltage", "open", "charge" if may_charge else "voltage", "none"]))
    if kind == "voltage":
        return {"voltage": float(draw.uniform(0.0, HIGHEST))}
    if kind == "open":
        return {"circuit": "open"}
    return {"charge": float(draw.uniform(0.0, 1.2)) * float(np.sqrt(MU * EPS))} if kind == "charge" else {}


def _targets(edges: dict[str, Any], mode: str, controls: list[str], state: State) -> list[tuple[str, float | None]]:
    """Control and target of both axes; None for an axis that stays as it is."""
    if not edges:
        return [(control, None) for control in controls]
    if any(isinstance(value, tuple) for value in edges.values()):
        return [next((control, pair[axis]) for control, pair in edges.items() if pair[axis] is not None) for axis in range(2)]
    ((control, value),) = edges.items()
    second: dict[str, tuple[str, float | None]] = {"equibiaxial": (control, value), "uniaxial": ("stress", 0.0)}
    return [(control, value), second.get(mode, ("stretch", None))]


def _looked_at(
    springs: Springs,
    steps: list[FilmStep],
    stiffness: tuple[float, float],
    resistance: float | None,
    conductivity: float,
    mode: str,
    runs: list[Run],
    draw: np.random.Generator,
) -> Programme:
    """The programme with what the peer finds at random times of every step, and the events."""
    ended, whole, times = runs[-1].pulled_in, runs[0], []
    whole.segments = [segment for run in runs for segment in run.segments]
    for segment in whole.segments:
        shares = np.sort(draw.uniform(0.02, 0.9, LOOKS))
        last = ended is not None and segment is whole.segments[-1]
        times.append(segment.start + segment.piece.duration * (shares if last else np.append(shares, 1.0)))
    there = whole.at(np.concatenate(times))
    breakdown = float(draw.uniform(0.5, 0.9)) * float(np.max(np.abs(there.true_field)))
    whole.film = replace(whole.film, breakdown=breakdown)
    slack = sorted(time for axis in (1, 2) for time in whole.events(f"loss-of-tension-{axis}")[:1])
    found = {"breakdown": whole.events("breakdown")[:1], "loss-of-tension": slack, "pull-in": [] if ended is None else [ended]}
    events = {name: at for name, at in found.items() if at}
    for axis, held in enumerate(stiffness):
        there.stress[axis] -= held * (there.stretch[axis] - 1)
    return Programme(springs, steps, stiffness, resistance, conductivity, breakdown, np.concatenate(times), there, events, mode)
