"""Random programmes of edges and electrodes, as dielast takes them, and as the membrane peer does."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from peers.membrane import History, Piece, Run, State, at_rest, constant, ramp
from springs import EPS, MU, SPRINGS, Springs

from dielast import FilmStep
from dielast.material.leakage import Leakage

THICKNESS, AREA, LOOKS = 0.5e-3, 1e-4, 4
SECONDS = (0.3, 4.0)  # of a step


@dataclass(frozen=True)
class Programme:
    """`steps` on a film with `springs`, behind a `resistance` in ohm and with a leakage of this `conductivity` in S/m, and what the
    peer finds at `times` (T,) in s; `events` are the first of each kind, `breakdown` is the field in V/m.
    """

    springs: Springs
    steps: list[FilmStep]
    resistance: float | None
    conductivity: float
    breakdown: float
    times: NDArray[np.float64]
    there: History
    events: dict[str, float]
    mode: str

    @property
    def arguments(self) -> dict[str, Any]:
        """The arguments of `flat.actuate`, besides material and steps."""
        stated: dict[str, Any] = {} if self.resistance is None else {"resistance": self.resistance, "electrode_area": AREA}
        if self.conductivity:
            stated["leakage"] = Leakage(self.conductivity)
        return {"thickness": THICKNESS, "mode": self.mode, "breakdown_field": self.breakdown, "times": self.times, **stated}


def programme(seed: int, rtol: float = 3e-9) -> Programme | None:
    """The random programme of this seed; None if its film has no equilibrium somewhere."""
    draw = np.random.default_rng(seed)
    springs = SPRINGS[tuple(SPRINGS)[seed % len(SPRINGS)]]
    mode = ("equibiaxial", "uniaxial", "pure-shear")[int(draw.integers(3))]
    conductivity = float(draw.choice([0.0, 2e-13, 2e-12]))
    resistance = float(10 ** draw.uniform(8, 10)) if draw.random() < 0.4 else None
    film = springs.film
    if conductivity:
        film = replaced(film, leakage=lambda field: conductivity * field)
    per_resistance = np.inf if resistance is None else resistance * AREA / THICKNESS
    state, source, controls, drive = at_rest(film), 0.0, ["stress", "stress"], "voltage"
    steps: list[FilmStep] = []
    runs: list[Run] = []
    for number in range(int(draw.integers(4, 7))):
        lasts = float(draw.uniform(*SECONDS))
        edges, electrodes = _edges(draw, mode, number == 0), _electrodes(draw, resistance is None and not conductivity, number)
        steps.append(FilmStep(**edges, **electrodes, duration=lasts))
        targets = _targets(edges, mode, controls, state)
        axes = []
        for axis, (control, target) in enumerate(targets):
            before = float(np.exp(state.log_stretch[axis])) if control == "stretch" else float(state.stress[axis])
            axes.append((control, ramp(before, before if target is None else target, lasts)))
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
        electric: tuple[str, Any] = ("field", ramp(begin, end, lasts))
        if drive == "charge":
            electric = ("source", constant(0.0)) if conductivity else ("charge", ramp(begin, end, lasts))
        elif resistance is not None:
            electric = ("source", ramp(begin, end, lasts))
        piece = Piece(lasts, (axes[0], axes[1]), electric, per_resistance if drive == "voltage" else np.inf)
        try:
            runs.append(Run(film, [piece], state, rtol=rtol))
        except (FloatingPointError, ValueError):
            return None
        state = runs[-1].final
    return _looked_at(springs, steps, resistance, conductivity, mode, runs, draw)


def replaced(film: Any, **changes: Any) -> Any:
    """A film of the peer with changes."""
    from dataclasses import replace

    return replace(film, **changes)


def _edges(draw: np.random.Generator, mode: str, first: bool) -> dict[str, Any]:
    """What a random step does to the edges."""
    kind = "stretch" if first else str(draw.choice(["stretch", "pair", "stress", "none"]))
    if kind == "stretch":
        return {"stretch": float(draw.uniform(1.3, 2.2))}
    if kind == "pair":
        return {"stretch": (float(draw.uniform(1.3, 2.2)), float(draw.uniform(1.1, 1.9)))}
    if kind == "stress":
        value = float(draw.uniform(2e4, 5e4))
        return {"stress": (value, value * float(draw.uniform(0.5, 1.0))) if mode == "equibiaxial" else value}
    return {}


def _electrodes(draw: np.random.Generator, may_charge: bool, number: int) -> dict[str, Any]:
    """What a random step does to the electrodes; the first ones close the circuit, so that there is a voltage."""
    kind = "voltage" if number == 1 else str(draw.choice(["voltage", "open", "charge" if may_charge else "voltage", "none"]))
    if kind == "voltage":
        return {"voltage": float(draw.uniform(0.0, 2.5e3))}
    if kind == "open":
        return {"circuit": "open"}
    return {"charge": float(draw.uniform(0.0, 1.2)) * float(np.sqrt(MU * EPS))} if kind == "charge" else {}


def _targets(edges: dict[str, Any], mode: str, controls: list[str], state: State) -> list[tuple[str, float | None]]:
    """Control and target of both axes; None for an axis that stays as it is."""
    if not edges:
        return [(control, None) for control in controls]
    ((control, value),) = edges.items()
    if isinstance(value, tuple):
        return [(control, value[0]), (control, value[1])]
    second: dict[str, tuple[str, float | None]] = {"equibiaxial": (control, value), "uniaxial": ("stress", 0.0)}
    return [(control, value), second.get(mode, ("stretch", None))]


def _looked_at(
    springs: Springs,
    steps: list[FilmStep],
    resistance: float | None,
    conductivity: float,
    mode: str,
    runs: list[Run],
    draw: np.random.Generator,
) -> Programme:
    """The programme with what the peer finds at random times of every step, and the events."""
    begin, parts, times = 0.0, [], []
    for run, step in zip(runs, steps, strict=True):
        lasts = float(np.asarray(step.duration))
        here = begin + lasts * np.append(np.sort(draw.uniform(0.02, 0.98, LOOKS)), 1.0)
        parts.append(run.at(here))
        times.append(here)
        begin += lasts
    there = History(*(np.concatenate([getattr(part, name) for part in parts], axis=-1) for name in History.__slots__))
    breakdown = float(draw.uniform(0.5, 0.9)) * float(np.max(np.abs(there.true_field)))
    events: dict[str, float] = {}
    for run in runs:
        run.film = replaced(run.film, breakdown=breakdown)
        for segment in run.segments:
            segment.film = run.film
        found = run.events("breakdown")
        if found and "breakdown" not in events:
            events["breakdown"] = found[0]
    return Programme(springs, steps, resistance, conductivity, breakdown, np.concatenate(times), there, events, mode)
