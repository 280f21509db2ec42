"""What dashpots dissipate, by a quadrature of its own."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from dielast.mechanics.criteria.criterion import Criterion, WatchedFilms
from dielast.mechanics.equations import Films
from dielast.mechanics.watch import Watch
from dielast.numerics.stride import DenseSteps, TriedStep

NODES, WEIGHTS = np.polynomial.legendre.leggauss(8)


class Dashpots(Watch):
    """Adds up what dashpots dissipate, and a resistance r, per undeformed volume, by quadrature apart from that of the meter."""

    def __init__(self, films: WatchedFilms, resistance: NDArray[np.float64], criteria: Iterable[Criterion] = ()) -> None:
        super().__init__(films, criteria, ())
        self.resistance, self.dissipated, self.lost = resistance, 0.0, 0.0

    def __call__(self, stride: TriedStep) -> NDArray[np.bool_] | None:
        if stride.accepted[0]:
            system = stride.system
            assert isinstance(system, Films)
            for node, weight in zip(0.5 * (1 + NODES), 0.5 * WEIGHTS, strict=True):
                steps = DenseSteps.of(stride, slice(None), np.arange(stride.time.size))
                state, time = steps.state(np.full(stride.time.size, node)), stride.time + node * stride.step
                driven = system.driven(time, state)
                log_squared, _ = system.membrane(state, driven)
                points = system.points
                stress = points.law.stress(points.springs(system.internal(state), log_squared))
                flow = points.flow.fluidity * (3 * stress - stress.sum(axis=0))
                # without the damper, whose strain is less than the error of the dense output
                power = 0.5 * np.sum(points.undamped().modulus * stress * flow, axis=(0, 1))
                self.dissipated += float(weight * (power * stride.step)[0])
                if points.circuit is not None and points.circuit.resistance is not None:
                    drop = system.load.value(time)[2] - points.nominal(log_squared, driven[2])[0]
                    self.lost += float(weight * (drop**2 / points.circuit.resistance * stride.step)[0])
        return super().__call__(stride)
