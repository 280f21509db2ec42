"""A law of each family added from outside goes through recipes, material files, simulations, draws, plots and cards."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from flat import creep
from keys import keys
from processes import Run
from tables import rows
from toys import MATERIAL, Cooling, Eyring, Linear, Power, Varga, register

from dielast import CardOptions, InputError, Material, NoShift, Spectrum, export_card, write_material
from dielast.base.registry import Registry
from dielast.handover.material_file import material_file, parse_material
from dielast.material.breakdown import BREAKDOWNS
from dielast.material.dielectric import DIELECTRICS
from dielast.material.flow import FLOWS, LINEAR_FLOW
from dielast.material.material import material_of, numbers_of
from dielast.material.shift import SHIFTS
from dielast.material.springs import EQUIBIAXIAL, SPRINGS, UNIAXIAL, Gent
from dielast.mechanics.load import Step
from dielast.mechanics.point_material import PointMaterial

TESTS = Path(__file__).parents[1]
PRELUDE = f"import sys; sys.path.insert(0, {str(TESTS)!r}); import toys; toys.register()"
FILM = """\
kind = "actuate"
material = "toy.toml"
temperature = "30 degC"
[film]
thickness = "0.5 mm"
prestretch = 1.5
relax = "1 min"
[[step]]
voltage = "6 kV"
rate = "100 V/s"
[stop]
at = "breakdown"
"""


@pytest.fixture
def registered() -> Iterator[None]:
    families: tuple[Registry[object], ...] = (SPRINGS, SHIFTS, FLOWS, DIELECTRICS, BREAKDOWNS)  # type: ignore[assignment]
    before = [dict(family._entries) for family in families]
    register()
    yield
    for family, entries in zip(families, before, strict=True):
        family._entries.clear()
        family._entries.update(entries)


@pytest.mark.usefixtures("registered")
def test_a_material_file_takes_the_laws_and_is_written_with_them() -> None:
    material = parse_material(MATERIAL.encode(), "toy.toml")
    assert material.shift == Linear(20.0, 0.05)
    assert material.breakdown == Power(20e6, 1.0)
    assert material.permittivity == Cooling(4e-11, 0.02)
    assert PointMaterial.of(material, np.array([20.0, 30.0]), 1e-6).permittivity == pytest.approx([4e-11, 3.2e-11])
    assert isinstance(material.nonequilibrium_law, Varga)
    assert material.nonequilibrium_law.share == 0.7
    assert write_material(parse_material(write_material(material), "again.toml")) == write_material(material)
    paths = {key.path: key.takes for key in keys(material_file())}
    assert paths["equilibrium.law"] == '"gent", "neo-hookean", "yeoh", "arruda-boyce", "mooney-rivlin", "ogden", "gent-i2", "varga"'
    assert {"equilibrium.share", "shift.slope", "breakdown.exponent"} <= paths.keys()
    for old, new, message in (
        ("share = 0.4", "", 'equilibrium: law "varga" needs share'),
        ("share = 0.4", "share = 0.4\nJ_lim = 110", 'equilibrium: law "varga" does not take J_lim'),
        ("share = 0.4", "share = -1", "equilibrium.share: -1: at least 0 is needed"),
        ('field = "20 MV/m"', 'field = ["20 MV/m", "30 MV/m"]', "breakdown: field: one value is needed"),
    ):
        with pytest.raises(InputError) as caught:
            parse_material(MATERIAL.replace(old, new, 1).encode(), "toy.toml")
        assert message in str(caught.value)


@pytest.mark.usefixtures("registered")
def test_a_flow_law_is_stated_varied_and_written() -> None:
    flow = '[flow]\nlaw = "eyring"\nstress = "50 kPa"\n'
    material = parse_material((MATERIAL + flow).encode(), "toy.toml")
    assert material.flow == Eyring(5e4)
    assert '[flow]\nlaw = "eyring"\nstress = "50000 Pa"\n' in write_material(material).decode()
    assert parse_material(write_material(material), "again.toml").flow == material.flow
    numbers = numbers_of(material)  # those that a calibration may free
    assert numbers["flow"] == {"stress": 5e4}
    assert material_of(material, numbers | {"flow": {"stress": 6e4}}).flow == Eyring(6e4)
    linear = parse_material((MATERIAL + '[flow]\nlaw = "linear"\n').encode(), "toy.toml")
    assert linear.flow == parse_material(MATERIAL.encode(), "toy.toml").flow == LINEAR_FLOW
    assert "flow" not in write_material(linear).decode()
    with pytest.raises(InputError, match=r'flow: law "linear" does not take stress: state law = "eyring"'):
        parse_material((MATERIAL + '[flow]\nstress = "50 kPa"\n').encode(), "toy.toml")


def test_a_law_that_nobody_registered_is_refused() -> None:
    with pytest.raises(InputError, match=r'equilibrium.law: "varga": one of "gent", "neo-hookean", .* or "gent-i2" is needed'):
        parse_material(MATERIAL.encode(), "toy.toml")


def test_films_of_the_laws_creep_and_break_down(tmp_path: Path, dielast: Run) -> None:
    (tmp_path / "toy.toml").write_text(MATERIAL)
    (tmp_path / "film.toml").write_text(FILM)
    done = dielast("actuate", "film.toml", "-o", "out", "--plot", "svg", prelude=PRELUDE)
    assert done.returncode == 0, done.stderr
    (event,) = [row for row in rows(tmp_path / "out/events.csv") if row["event"] == "breakdown"]
    assert float(event["true_field [V/m]"]) == pytest.approx(30e6, rel=1e-6)
    assert (tmp_path / "out/actuate.svg").stat().st_size > 1000
    assert dielast("validate", "toy.toml", prelude=PRELUDE).returncode == 0
    assert dielast("validate", "toy.toml").returncode == 2


def test_the_shift_law_is_fitted_drawn_plotted_and_handed_on(tmp_path: Path, dielast: Run) -> None:
    time = np.geomspace(1, 100, 12)
    curves = [(T, t, 3e5 * (1 + t * 10 ** (0.05 * (T - 20))) ** -0.4 + 2e4) for T in (0, 10, 20, 30, 40) for t in time]
    noise = 1 + 0.005 * np.random.default_rng(0).standard_normal(len(curves))
    lines = [f"{T},{float(t)!r},{float(E * error)!r}" for (T, t, E), error in zip(curves, noise.tolist(), strict=True)]
    (tmp_path / "dma.csv").write_text("\n".join(("temperature [degC],time [s],modulus [Pa]", *lines)))
    (tmp_path / "curve.toml").write_text(
        'kind = "mastercurve"\n[data]\nfile = "dma.csv"\n'
        'columns = { temperature = "temperature", time = "time", modulus = "modulus" }\n'
        '[shift]\nreference_temperature = "20 degC"\nlaw = "linear"\n[uncertainty]\ndraws = 4\n'
    )
    done = dielast("mastercurve", "curve.toml", "-o", "out", "--plot", "svg", prelude=PRELUDE)
    assert done.returncode == 0, done.stderr
    shift = tomllib.loads((tmp_path / "out/summary.toml").read_text())["shift"]
    assert shift["slope_1_per_K"] == pytest.approx(0.05, abs=4 * shift["slope_1_per_K_stderr"])
    assert "linear, 0.0" in (tmp_path / "out/mastercurve.svg").read_text()
    (tmp_path / "spectrum.toml").write_text('kind = "spectrum"\nmastercurve = "out"\n[fit]\nbranches = 6\nmethod = "nnls"\n')
    done = dielast("spectrum", "spectrum.toml", "-o", "spectrum", "--plot", "none", prelude=PRELUDE)
    assert done.returncode == 0, done.stderr
    assert 'law = "linear"' in (tmp_path / "spectrum/material.toml").read_text()
    assert "slope [1/K]" in rows(tmp_path / "spectrum/draws.csv")[0]


def test_the_general_spring_follows_any_load_of_the_solver() -> None:
    """A spring that is not a function of I1 alone, with both short forms of a load, one by one and side by side."""
    spectrum = Spectrum(np.array([10.0]), np.array([2e4]))
    films = [Material("toy", 3e4, spectrum, NoShift(20.0), Varga(share), Varga(1 - share)) for share in (0.0, 1.0)]
    gaussian = Material("neo-Hookean", 3e4, spectrum, NoShift(20.0))
    steps = [Step(stress=1e4, duration=1.0), Step.hold(5.0)]
    for mode in ("uniaxial", "equibiaxial", "pure-shear"):
        together = creep(films, steps, mode=mode, points_per_decade=3)
        for case, film in enumerate(films):
            alone = creep(film, steps, mode=mode, points_per_decade=3)
            np.testing.assert_allclose(together.stretch_1[case], alone.stretch_1[0], rtol=1e-8)
    neo = creep(Material("toy", 3e4, spectrum, NoShift(20.0), Varga(0.0), Varga(0.0)), steps, points_per_decade=3)
    np.testing.assert_allclose(neo.stretch_1, creep(gaussian, steps, points_per_decade=3).stretch_1, rtol=1e-6)
    law, front = Varga(0.3), np.array([1.0, 1.5, 3.0])
    for symmetry in (UNIAXIAL, EQUIBIAXIAL):
        step = 1e-6
        stress = [
            law.axial_stress(symmetry, front * factor, (front * factor) ** -symmetry.thinning)
            for factor in (np.exp(-step), np.exp(step))
        ]
        found = law.axial_tangent(symmetry, front, front**-symmetry.thinning)[1]
        assert found == pytest.approx((stress[1] - stress[0]) / (2 * step), rel=1e-8)


@pytest.mark.usefixtures("registered")
def test_cards_refuse_what_they_cannot_hold_and_take_the_rest() -> None:
    toy = parse_material(MATERIAL.encode(), "toy.toml")
    with pytest.raises(InputError, match=r'^hyperelastic: ansys has no "varga" law: no card can hold these springs'):
        export_card(toy, "ansys", CardOptions(temperature=20.0))
    with pytest.raises(InputError, match=r'^hyperelastic: "yeoh" cannot stand for Varga'):
        export_card(toy, "ansys", CardOptions(temperature=20.0, hyperelastic="yeoh"))
    shifted = Material("toy", 3e4, Spectrum(np.array([10.0]), np.array([2e4])), Linear(20.0, 0.05), Gent(50.0), Gent(50.0))
    with pytest.raises(InputError, match=r'^temperature: ansys has no shift function for the law "linear"'):
        export_card(shifted, "ansys")
    assert "hold at 30 degC ONLY" in export_card(shifted, "ansys", CardOptions(temperature=30.0))["material.mac"]
