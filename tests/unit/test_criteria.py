"""A criterion that is registered from outside runs through recipes to events, maps and figures like those that ship."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest
from films import SOFT
from flat import actuate
from matplotlib.axes import Axes

from dielast import Ogden, Spectrum, VoltageStep
from dielast.base.errors import InputError
from dielast.cli.app import application
from dielast.mechanics.criteria import CRITERIA, named, names
from dielast.mechanics.criteria.criterion import Criterion, FilmSnapshot, Signal, WatchedFilms
from dielast.numerics.arrays import Floats

LARGEST = 1.6

MATERIAL = """
name = "soft"
reference_temperature = "20 degC"
[equilibrium]
shear_modulus = "26 kPa"
J_lim = 110.0
[nonequilibrium]
J_lim = 55.0
relaxation_time_s = [1e4, 1.0]
shear_modulus_Pa = [1e4, 9e4]
[shift]
law = "none"
[dielectric]
permittivity = "4e-11 F/m"
[breakdown]
prestretch = [1.5]
field = ["500 MV/m"]
"""
FILM = 'material = "soft.toml"\n[film]\nthickness = "0.5 mm"\nprestretch = 1.5\nrelax = "10 min"\n'
ACTUATE = f'kind = "actuate"\n{FILM}[[step]]\nvoltage = "4 kV"\nduration = "1 s"\n[[step]]\nhold = "1 h"\n'
GRID = FILM.replace("= 1.5", "= [1.5, 1.51, 1.52, 1.53, 1.54]")
MAP = f'kind = "failure-map"\nhorizon = "1 h"\n{GRID}[voltage]\nfrom = "1 kV"\nto = "4 kV"\npoints = 5\n'


class Overstretched(Criterion):
    """The film is stretched further than a stiff electrode follows."""

    name: ClassVar[str] = "overstretched"
    marker: ClassVar[str] = "D"

    def signal(self, films: WatchedFilms) -> Signal:
        def left(moment: FilmSnapshot) -> Floats:
            return LARGEST - np.exp(0.5 * np.max(moment.log_squared_stretch, axis=0))

        return left


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "soft.toml").write_text(MATERIAL)
    CRITERIA.append(Overstretched())
    yield tmp_path
    CRITERIA.pop()


def run(folder: Path, kind: str, recipe: str) -> list[dict[str, str]]:
    """Run a recipe; the rows of its table of events, or of its map."""
    (folder / "recipe.toml").write_text(recipe)
    assert not application(kind)([kind, "recipe.toml", "-o", "out", "-q"], standalone_mode=False)
    with (folder / "out" / ("events.csv" if kind == "actuate" else "failure-map.csv")).open() as file:
        return list(csv.DictReader(file))


def test_a_criterion_from_outside_has_its_event_and_its_mark(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    markers: list[str] = []
    plot = Axes.plot
    monkeypatch.setattr(
        Axes, "plot", lambda self, *at, **look: (markers.append(str(look.get("marker"))), plot(self, *at, **look))[1]
    )
    events = run(folder, "actuate", ACTUATE + '[stop]\nat = "overstretched"\n')
    assert [event["event"] for event in events] == ["overstretched"]
    assert float(events[0]["stretch_1 [1]"]) == pytest.approx(LARGEST, rel=1e-8)
    assert "D" in markers
    assert "\n[overstretched]\ncases = " in (folder / "out" / "summary.toml").read_text()


def test_a_criterion_from_outside_is_a_failure_mode_of_maps(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    named: list[str] = []
    legend = Axes.legend
    monkeypatch.setattr(
        Axes,
        "legend",
        lambda self, *at, **look: (named.extend(one.get_label() for one in look.get("handles", ())), legend(self, *at, **look))[1],
    )
    survives, *_, fails = run(folder, "failure-map", MAP)
    assert (survives["failure_mode"], fails["failure_mode"]) == ("none", "overstretched")
    assert survives["time_to_overstretched [s]"] == ""
    assert float(fails["time_to_overstretched [s]"]) == float(fails["time_to_failure [s]"])
    assert float(fails["time_to_failure [s]"]) < 3600.0
    assert "overstretched first" in named


def test_a_run_stops_at_the_event_of_any_name() -> None:
    film = {"thickness": 5e-4, "prestretch": (2.0, 1.5), "relax": 600.0, "boundary": "clamped", "breakdown_field": 1e12}
    programme = [VoltageStep(2e4, duration=1.0), VoltageStep.hold(10.0)]
    history = actuate(SOFT, programme, stop_at="loss-of-tension", **film)
    (event,) = history.events[0]
    assert (event.name, history.outcome[0].reason) == ("loss-of-tension", "loss-of-tension")
    assert history.outcome[0].time == event.time == history.time[0, np.isfinite(history.stretch_1[0])][-1]
    # by default, and up to breakdown, too: beyond it the film would wrinkle, whether a passive part or held edges lose tension
    for stop in (None, "breakdown"):
        assert actuate(SOFT, programme, stop_at=stop, **film).outcome == history.outcome
    assert actuate(SOFT, programme, stop_at="end", **film).outcome[0].time == 11.0
    with pytest.raises(InputError, match=f"it must be one of {', '.join(names())}, end"):
        actuate(SOFT, programme, stop_at="wrinkling", **film)


def test_a_tension_that_a_voltage_applied_at_once_takes_away_is_lost_at_once() -> None:
    film = {"thickness": 5e-4, "prestretch": (2.0, 1.5), "relax": 600.0, "boundary": "clamped", "breakdown_field": 1e12}
    history = actuate(SOFT, [VoltageStep(2e4), VoltageStep.hold(10.0)], stop_at="end", **film)
    assert [(event.name, event.time) for event in history.events[0]] == [("loss-of-tension", 0.0)]


def test_a_criterion_that_there_is_not_is_refused() -> None:
    assert named("pull-in").name == "pull-in"
    with pytest.raises(InputError, match='"pullin": criterion: did you mean "pull-in"'):
        named("pullin")


def test_the_stability_of_a_film_that_starts_unstable_is_negative() -> None:
    """Under equal dead loads, W = 8 sum l^(1/2) is unstable to unequal stretches beyond 2^(2/3): W11 - W12 = 4/l^3 - 2/l^1.5."""
    law = Ogden((4.0,), (0.5,))
    weak = replace(SOFT, equilibrium_law=law, spectrum=Spectrum(np.array([1.0]), np.array([1.0])))
    film = {"thickness": 5e-4, "prestretch": 2.0, "relax": 600.0, "boundary": "dead-load", "stop_at": "end"}
    history = actuate(weak, [VoltageStep(1.0, duration=1.0)], **film)
    assert history.stability[0, 0] == pytest.approx(-1.0)
