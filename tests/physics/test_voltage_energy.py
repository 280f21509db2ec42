"""Work done by the source and by the load is stored in springs and charge, or dissipated."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from dielast.material.laws_of_cases import FailureLaws
from dielast.material.material import Material
from dielast.material.shift import NoShift
from dielast.material.spectrum import Spectrum
from dielast.material.springs import EQUIBIAXIAL, Gent
from dielast.mechanics.criteria.criterion import WatchedFilms
from dielast.mechanics.equations import Films
from dielast.mechanics.film import FilmState
from dielast.mechanics.history import electrical_pieces
from dielast.mechanics.load import Programme, VoltageStep
from dielast.mechanics.point_material import PointMaterial
from dielast.mechanics.span import Control
from dielast.mechanics.stability import ONE_PERCENT
from dielast.mechanics.watch import Watch
from dielast.numerics.stride import TriedStep
from dielast.simulate.follow import follow
from dielast.simulate.setup import prestretched

PERMITTIVITY, THICKNESS = 3.98e-11, 0.5e-3
SOLID = Material(
    "solid",
    26e3,
    Spectrum(np.geomspace(1e5, 1e-3, 9), np.geomspace(8e3, 3e5, 9)),
    NoShift(20.0),
    Gent(110.0),
    Gent(55.0),
    PERMITTIVITY,
)
NODES, WEIGHTS = np.polynomial.legendre.leggauss(8)
Array = NDArray[np.float64]


class Bookkeeper(Watch):
    """Adds up work and dissipation per undeformed volume over every step, by Gauss quadrature on the dense output."""

    def __init__(self, films: WatchedFilms) -> None:
        super().__init__(films, (), ())
        self.electric = self.mechanical = self.dissipated = self.least = 0.0
        self.stored: list[float] = []

    def __call__(self, stride: TriedStep) -> NDArray[np.bool_] | None:
        if stride.accepted[0]:
            system = stride.system
            assert isinstance(system, Films)
            ends = [self.at(system, stride, fraction)[:2] for fraction in (0.0, 1.0)]
            if not self.stored:
                self.stored.append(ends[0][1])
            self.stored.append(ends[1][1])
            # s_i is constant or l_i is, so the mechanical work needs no quadrature
            nominal, stretch = ends[1][0][0], [end[0][1] for end in ends]
            self.mechanical += float(np.sum(nominal * (stretch[1] - stretch[0])))
            for node, weight in zip(NODES, WEIGHTS, strict=True):
                fraction, small = 0.5 * (1 + node), 1e-4
                power = self.at(system, stride, fraction)[2]
                charge = [self.at(system, stride, fraction + shift)[3] for shift in (-small, small)]
                field_now = system.load.value(stride.time + fraction * stride.step)[2][0]
                self.electric += 0.5 * weight * field_now * (charge[1] - charge[0]) / (2 * small)
                self.dissipated += 0.5 * weight * power * float(stride.step[0])
                self.least = min(self.least, power)
        return super().__call__(stride)

    def at(self, system: Films, stride: TriedStep, fraction: float) -> tuple[tuple[Array, Array], float, float, float]:
        """Nominal stresses and stretches, stored energy, power dissipated, and nominal charge density."""
        every = np.arange(stride.time.size)
        state = stride.dense(slice(None), every, np.full(every.size, fraction))
        driven = system.load.value(stride.time + fraction * stride.step)
        log_squared, nominal = system.membrane(state, driven)
        internal, points = system.internal(state), system.points
        squared = points.springs(internal, log_squared)
        stress = points.law.stress(squared)
        flow = points.flow.fluidity * (3 * stress - stress.sum(axis=0))
        power = 0.5 * np.sum(points.modulus * stress * flow, axis=(0, 1))
        area = np.exp(log_squared[0] + log_squared[1])
        charge = PERMITTIVITY * driven[2] * area
        stored = np.sum(points.modulus * points.law.energy(squared), axis=0) + 0.5 * charge * driven[2]
        return (nominal[:, 0], np.exp(0.5 * log_squared[:, 0])), float(stored[0]), float(power[0]), float(charge[0])


@pytest.mark.parametrize(
    ("first", "second", "controls"),
    [
        pytest.param(1.9, 1.9, (Control.STRESS, Control.STRESS), marks=pytest.mark.trust),
        (2.5, 1.2, (Control.STRESS, Control.STRESS)),
        pytest.param(2.0, 1.5, (Control.STRESS, Control.STRETCH), marks=pytest.mark.trust),
        pytest.param(1.7, 1.7, (Control.STRETCH, Control.STRETCH), marks=pytest.mark.trust),
    ],
)
def test_energy_is_conserved(first: float, second: float, controls: tuple[Control, Control]) -> None:
    points = PointMaterial.of(SOLID, np.array([20.0]), 1e-9)
    symmetry = EQUIBIAXIAL if first == second and controls[0] is controls[1] else None
    rest = FilmState.at_rest(points, symmetry)
    film, _ = prestretched(rest, (np.array([first]), np.array([second])), np.array([5.0]), 600.0, rtol=1e-9)
    watch = Bookkeeper(
        WatchedFilms(controls, FailureLaws(np.array([np.inf])), ONE_PERCENT, film.nominal_stress, points.stress_floor)
    )
    steps = [VoltageStep(2e3, duration=3.0), VoltageStep.hold(200.0), VoltageStep(-1e3, duration=10.0), VoltageStep.hold(50.0)]
    follow(film, electrical_pieces(Programme(steps), controls, np.array([THICKNESS])), rtol=1e-9, watch=watch)
    gained = watch.stored[-1] - watch.stored[0]
    scale = abs(watch.electric) + abs(watch.mechanical)
    assert gained == pytest.approx(watch.electric + watch.mechanical - watch.dissipated, abs=1e-6 * scale)
    assert watch.dissipated > 0
    assert watch.least > -1e-9 * watch.dissipated
