"""Signals of many cases at once: what happens to one case is found whatever the others do."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from films import SOFT
from flat import actuate
from numpy.typing import NDArray

from dielast.material.laws_of_cases import FailureLaws
from dielast.material.material import Material
from dielast.material.shift import NoShift
from dielast.material.spectrum import Spectrum
from dielast.material.springs import Gent
from dielast.mechanics.criteria.criterion import FilmSnapshot, Signal, WatchedFilms
from dielast.mechanics.criteria.pull_in import PullIn
from dielast.mechanics.load import VoltageStep
from dielast.mechanics.point import LoadedPoints
from dielast.mechanics.point_material import PointMaterial
from dielast.mechanics.span import Control, Load
from dielast.mechanics.stability import ONE_PERCENT, damped
from dielast.mechanics.watch import Watch
from dielast.numerics.roots import fall, samples
from dielast.numerics.rosenbrock import RODAS5P
from dielast.numerics.stride import TriedStep
from dielast.simulate import actuation_history as module

Array = NDArray[np.float64]
AT, WIDTH = 300.0, 1e-3


def dips(fraction: Array) -> Array:
    """Five signals: a dip below zero, a dip above it, a plain fall, nothing at all, and a dip whose bottom is at a sample."""
    f = np.broadcast_to(fraction, (5,))
    return np.stack(
        (((f[0] - 0.37) / 0.3) ** 2 - 1e-4, ((f[1] - 0.6) / 0.5) ** 2 + 0.01, 0.7 - f[2], 1 + 0 * f[3], (f[4] - 0.5) ** 2 - 1e-6)
    )


def test_samples_follow_each_dip_to_its_bottom_and_leave_the_rest_alone() -> None:
    values, fractions = samples(dips, dips(np.zeros(5)), dips(np.ones(5)))
    assert fractions[[0, -1]].tolist() == [[0.0] * 5, [1.0] * 5]
    assert np.array_equal(values, np.stack([dips(row) for row in fractions]))
    assert np.all(np.diff(fractions, axis=0) > 0)
    assert values[:, 0].min() == pytest.approx(-1e-4, abs=1e-7)
    assert fractions[values[:, 0].argmin(), 0] == pytest.approx(0.37, abs=1e-3)
    assert values[:, 1].min() == pytest.approx(0.01, abs=1e-7)
    assert fractions[values[:, 1].argmin(), 1] == pytest.approx(0.6, abs=1e-3)
    for column in (2, 3):
        assert fractions[:, column].tolist() == [0.0, 0.25, 0.5, 0.75, 1.0]
    assert values[2, 4] == -1e-6
    for column in range(5):
        one = samples(lambda f, c=column: dips(f)[c : c + 1], dips(np.zeros(5))[[column]], dips(np.ones(5))[[column]])
        assert np.array_equal(one[0][:, 0], values[:, column])
        assert np.array_equal(one[1][:, 0], fractions[:, column])


def test_a_root_at_the_edge_or_found_by_chance_is_exact() -> None:
    def signal(fraction: Array) -> Array:
        return np.array([0.5, 1.0, 0.75]) - fraction

    assert fall(signal, np.zeros(3), np.ones(3)) == pytest.approx([0.5, 1.0, 0.75], abs=1e-15)


class Prescribed(PullIn):
    """Six films whose margin is a given function of time: at AT it dips below zero, or only near it, or falls to it, or keeps near
    zero or far from it, or falls from far above to just below.
    """

    def signal(self, films: WatchedFilms) -> Signal:
        def margin(moment: FilmSnapshot) -> Array:
            x = moment.age / AT - 1  # the voltage rises at 0 s
            dip = 0.1 * np.minimum(x**2, 1.0)
            falling, sudden = 0.1 * np.clip(-x, -1, 1), np.clip(-1e6 * x, -0.01, 1.0)
            signals = dip - 0.1 * WIDTH**2, dip + 1e-6, falling, np.full_like(x, 0.1), 1 + 0 * x, sudden
            return np.choose(moment.cases, signals)

        return margin


@pytest.mark.parametrize("voltage", [2e3, 2.2e3])
def test_one_case_dips_while_others_do_not(monkeypatch: pytest.MonkeyPatch, voltage: float) -> None:
    monkeypatch.setattr(module, "CRITERIA", [Prescribed()])
    programme = [VoltageStep(voltage), VoltageStep.hold(1e3)]
    history = actuate(
        SOFT, programme, thickness=np.full(6, 5e-4), prestretch=1.5, relax=10.0, stop_at="pull-in", rtol=1e-4, points_per_decade=5
    )
    assert [len(events) for events in history.events] == [1, 0, 1, 0, 0, 1]
    assert history.events[0][0].time == pytest.approx(AT * (1 - WIDTH), rel=1e-9)
    assert history.events[2][0].time == pytest.approx(AT, rel=1e-9)
    assert history.events[5][0].time == pytest.approx(AT, rel=1e-9)
    assert [outcome.time for outcome in history.outcome] == pytest.approx([AT * (1 - WIDTH), 1e3, AT, 1e3, 1e3, AT])


@dataclass(frozen=True, eq=False)
class Parabolas(PullIn):
    """Margins over a step from 0 to 1 s, one a case: parabolas that dip to `-depth` at `bottom`; both `ends` together are given."""

    bottom: Array
    depth: float
    ends: float

    @property
    def curvature(self) -> Array:
        return np.asarray(self.ends / (self.bottom**2 + (1 - self.bottom) ** 2))

    def signal(self, films: WatchedFilms) -> Signal:
        return lambda moment: self.curvature[moment.cases] * (moment.age - self.bottom[moment.cases]) ** 2 - self.depth


@pytest.mark.parametrize("depth", [1e-5, -1e-5])
@pytest.mark.parametrize("ends", [0.29, 3.0])
def test_a_parabola_that_dips_below_zero_is_found_wherever_it_does(depth: float, ends: float) -> None:
    bottom = np.linspace(0.03, 0.97, 48)
    parabolas = Parabolas(bottom, depth, ends)
    count = bottom.size
    solid = Material("soft", 26e3, Spectrum([1.0], [1e5]), NoShift(20.0), Gent(110.0), Gent(55.0), permittivity=4e-11)
    controls, zero, one, every = (Control.STRESS, Control.STRESS), np.zeros(count), np.ones(count), np.arange(count)
    points = damped(PointMaterial.of(solid, np.full(count, 20.0), 1e-4))
    system = LoadedPoints(points, Load.between(controls, np.zeros((3, count)), np.zeros((3, count)), one))
    state = np.zeros((2 * len(points.modulus) + 2, count))
    films = WatchedFilms(controls, FailureLaws(np.full(count, np.inf)), ONE_PERCENT, np.zeros((2, count)), points.stress_floor)
    watch = Watch(films, [parabolas], ["pull-in"])
    watch.begin(system, state, zero, every >= 0)
    increments = np.zeros((RODAS5P.stages, *state.shape))
    steps = zero, one, one, state, state, increments, 0 * every, zero, one, one
    over = watch(TriedStep(system, RODAS5P, every, every >= 0, *steps))
    watch.finish(lambda cases, load: LoadedPoints(points.take(cases), load))
    time = watch.happened[parabolas].time
    if depth > 0:
        assert time == pytest.approx(bottom - np.sqrt(depth / parabolas.curvature), abs=1e-12)
        assert over is not None
        assert over.all()
    else:
        assert np.isnan(time).all()
        assert over is None
