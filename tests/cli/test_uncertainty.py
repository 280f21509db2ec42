"""Uncertainty through the chain: draws of the master curve, of the spectrum, and intervals in every simulation."""

from __future__ import annotations

import shutil
import tomllib
from pathlib import Path

import numpy as np
import pytest
from processes import SMALL_CHUNKS, Run
from tables import FILM, SCATTER, columns

import dielast as library
from dielast.commands.simulation.uncertainty import _warn_of_draws

UNCERTAIN = "\n[uncertainty]\ndraws = 24\n"
MAP = f"""
kind = "failure-map"
horizon = "1 h"
{FILM.replace("1.9", "[1.7, 1.9]")}
[voltage]
values = ["1 kV", "3.6 kV", "4 kV", "6 kV"]
[breakdown]
prestretch = [1.7, 1.9]
field = ["40 MV/m", "48 MV/m"]
"""
QUICK = MAP.replace("[1.7, 1.9]", "1.9", 1).replace('"1 kV", "3.6 kV", "4 kV", "6 kV"', '"4 kV"').replace("1 h", "1 min")


@pytest.fixture(scope="module")
def made(command: Run, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a master curve, a spectrum and their draws."""
    folder = tmp_path_factory.mktemp("chain")
    (folder / "mc.toml").write_text(command(folder, "new", "mastercurve").stdout + UNCERTAIN)
    assert command(folder, "mastercurve", "mc.toml", "--plot", "none").returncode == 0
    recipe = command(folder, "new", "spectrum").stdout.replace("example:mastercurve", "mc")
    (folder / "sp.toml").write_text(recipe)
    assert command(folder, "spectrum", "sp.toml", "--plot", "none").returncode == 0
    return folder


@pytest.fixture
def folder(made: Path, tmp_path: Path) -> Path:
    """A folder of the test's own with the material and its draws in it."""
    for name in ("material.toml", "draws.csv"):
        shutil.copy(made / "sp" / name, tmp_path / name)
    return tmp_path


def changed(table: str, header: str, value: str) -> str:
    """A table with another value in its third line, draw 1."""
    lines = [line.split(",") for line in table.splitlines()]
    lines[2][lines[0].index(header)] = value
    return "\n".join(",".join(line) for line in lines) + "\n"


def refused(command: Run, folder: Path, *arguments: str) -> str:
    """The one line that the command line says of a mistake."""
    run = command(folder, *arguments)
    assert run.returncode == 2
    (line,) = run.stderr.splitlines()
    return line


def test_the_files_of_the_chain(made: Path) -> None:
    draws, laws, curves = (columns(made / "mc" / name) for name in ("draws.csv", "draw-laws.csv", "draw-curves.csv"))
    summary = tomllib.loads((made / "mc/summary.toml").read_text())
    assert list(draws) == ["draw", "temperature [degC]", "log10_shift_factor [1]", "vertical_shift [1]"]
    assert list(laws) == ["draw", "C1 [1]", "C2 [K]"]
    assert list(curves)[:2] == ["reduced_time [s]", "relaxation_modulus_0 [Pa]"]
    assert len(curves) == 25
    assert np.std(laws["C1 [1]"], ddof=1) == pytest.approx(summary["uncertainty"]["C1_stderr"], rel=1e-6)
    assert summary["uncertainty"]["C1_stderr"] == pytest.approx(summary["shift"]["C1_stderr"], rel=0.6)
    assert sum(file.stat().st_size for file in (made / "mc").iterdir()) < 24 / 200 * 2e6
    spectrum = columns(made / "sp/draws.csv")
    material = library.read_material(made / "sp/material.toml")
    members = library.read_draws(made / "sp/material.toml")
    assert list(spectrum)[:5] == ["draw", "equilibrium_shear_modulus [Pa]", "C1 [1]", "C2 [K]", "shear_modulus_1 [Pa]"]
    assert len(members) == len(spectrum["draw"]) == 24
    # about the fit, not about something else
    level = [member.spectrum.relaxation_modulus(100.0, member.equilibrium_modulus) for member in members]
    main = material.spectrum.relaxation_modulus(100.0, material.equilibrium_modulus)
    assert abs(np.mean(level) - main) < np.std(level)


@pytest.mark.parametrize(
    "kind",
    ["relax", "creep", pytest.param("actuate", marks=pytest.mark.trust), pytest.param("failure-map", marks=pytest.mark.trust)],
)
def test_intervals_stand_beside_unchanged_results(command: Run, folder: Path, made: Path, kind: str) -> None:
    recipe = command(folder, "new", kind).stdout.replace("example:vhb4905.toml", "material.toml")
    (folder / "plain.toml").write_text(recipe)
    (folder / "told.toml").write_text(recipe + UNCERTAIN)
    for name in ("plain", "told"):
        assert command(folder, kind, f"{name}.toml", "--plot", "none").returncode == 0
    plain, told = (columns(folder / name / f"{kind}.csv") for name in ("plain", "told"))
    bounded = 0
    for header, values in plain.items():
        assert np.array_equal(values, told[header], equal_nan=True), header
        name, unit = header.rstrip("]").split(" [") if " [" in header else (header, "")
        if f"{name}_lower [{unit}]" in told:
            low, high = told[f"{name}_lower [{unit}]"], told[f"{name}_upper [{unit}]"]
            assert np.all((low <= high) | np.isnan(high)), header
            inside = ((low <= values) & (values <= high))[np.isfinite(values)]  # not of films that outlive the horizon
            assert np.mean(inside) > 0.9, header
            bounded += 1
    assert bounded >= 3
    assert tomllib.loads((folder / "told/summary.toml").read_text())["uncertainty"]["draws"] == 24


def test_scatter_from_film_to_film_needs_no_draws_and_widens_intervals(command: Run, folder: Path) -> None:
    (folder / "exact.toml").write_text((folder / "material.toml").read_text().replace('draws = "draws.csv"\n', ""))
    widths = []
    for name, material, extra in (("a", "material.toml", ""), ("b", "exact.toml", SCATTER), ("c", "material.toml", SCATTER)):
        recipe = MAP.replace("[1.7, 1.9]", "1.7", 1).replace("material.toml", material) + UNCERTAIN.replace("24", "60") + extra
        (folder / f"{name}.toml").write_text(recipe)
        assert command(folder, "failure-map", f"{name}.toml", "--plot", "none").returncode == 0
        table = columns(folder / name / "failure-map.csv")
        widths.append(table["time_to_failure_upper [s]"][2] / table["time_to_failure_lower [s]"][2])
    assert widths[0] < widths[1]
    assert widths[1] == pytest.approx(widths[2], rel=0.5)
    # who certainly survives, who fails at once
    assert table["failure_probability [1]"][0] == 0
    assert np.isnan(table["time_to_failure_lower [s]"][0])
    assert table["time_to_failure_upper [s]"][3] < 10
    assert table["failure_probability [1]"][3] == 1


def test_draws_tell_of_a_breakdown_that_may_happen(command: Run, folder: Path) -> None:
    recipe = f"""
kind = "actuate"
{FILM}
[[step]]
voltage = "3.2 kV"
[[step]]
hold = "10 min"
[breakdown]
field = "48 MV/m"
"""
    (folder / "a.toml").write_text(recipe + UNCERTAIN.replace("24", "60") + SCATTER)
    assert command(folder, "actuate", "a.toml").returncode == 0
    events = columns(folder / "a/events.csv")
    assert np.all(np.isnan(events["time [s]"]))
    assert 0 < events["probability [1]"][0] < 1
    assert np.isnan(events["time_upper [s]"][0])
    table = columns(folder / "a/actuate.csv")
    surviving = table["surviving [1]"]
    assert surviving[0] > surviving[-1] == pytest.approx(1 - events["probability [1]"][0])
    assert np.all(np.diff(surviving) <= 0)


def test_repeats_in_two_processes_give_the_same_bytes(command: Run, folder: Path) -> None:
    (folder / "m.toml").write_text(MAP.replace('"3.6 kV", ', "") + UNCERTAIN + SCATTER)
    results = []
    for name, options in (("one", ()), ("two", ("--jobs", "2", "--golden", "one"))):
        run = command(folder, "failure-map", "m.toml", "--plot", "none", "-o", name, *options, prelude=SMALL_CHUNKS)
        assert run.returncode == 0, run.stderr
        results.append({path.name: path.read_bytes() for path in (folder / name).iterdir()})
    assert results[0] == results[1]
    other = command(
        folder, "failure-map", "m.toml", "--plot", "none", "-o", "three", "--golden", "one", "--set", "uncertainty.seed=2"
    )
    assert other.returncode == 4
    assert "time_to_failure_lower" in other.stderr


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("\n1,", "\nnan,", 'draw-laws.csv: row 3: column "draw": a number is needed'),
        ("\n1,", "\n1.5,", 'draw-laws.csv: row 3: column "draw": 1.5 is not a whole number'),
        ("C2 [K]", "Q [K]", 'draw-laws.csv: column "C2 [K]" is missing'),
        ("C1 [1]", "-13.7", 'draw-laws.csv: row 3: column "C1 [1]": -13.7: a number above 0 is needed'),
    ],
)
def test_damaged_draws_of_a_master_curve(command: Run, made: Path, tmp_path: Path, old: str, new: str, message: str) -> None:
    shutil.copytree(made / "mc", tmp_path / "mc")
    laws = (tmp_path / "mc/draw-laws.csv").read_text()
    assert old in laws
    (tmp_path / "mc/draw-laws.csv").write_text(laws.replace(old, new, 1) if old != "C1 [1]" else changed(laws, old, new))
    shutil.copy(made / "sp.toml", tmp_path / "sp.toml")
    whole = "sp.toml: mastercurve: mc/summary.toml: draw-laws.csv is not the file that its run wrote"
    assert refused(command, tmp_path, "spectrum", "sp.toml", "--plot", "none").startswith(whole)
    summary = tmp_path / "mc/summary.toml"
    summary.write_text('changed = ["draw-laws.csv"]\n' + summary.read_text())
    assert message in refused(command, tmp_path, "spectrum", "sp.toml", "--plot", "none")
    checked = refused(command, tmp_path, "validate", "sp.toml")
    assert checked.startswith("sp.toml: mastercurve: ")
    assert message in checked


def test_draws_beside_a_changed_material(command: Run, made: Path, tmp_path: Path) -> None:
    home = tmp_path / "sp"
    shutil.copytree(made / "sp", home)
    (tmp_path / "m.toml").write_text((QUICK + UNCERTAIN).replace("material.toml", "sp/material.toml"))
    (home / "material.toml").write_text(f"# by hand\n{(home / 'material.toml').read_text()}")
    whole = "sp/summary.toml: material.toml is not the file that its run wrote"
    assert whole in refused(command, tmp_path, "failure-map", "m.toml", "--plot", "none")
    with pytest.raises(library.InputError, match=whole):
        library.read_draws(home / "material.toml")
    (home / "summary.toml").write_text(f'changed = ["material.toml"]\n{(home / "summary.toml").read_text()}')
    assert command(tmp_path, "failure-map", "m.toml", "--plot", "none").returncode == 0


def test_draws_of_another_material_are_doubted(command: Run, folder: Path) -> None:
    (folder / "m.toml").write_text(QUICK + UNCERTAIN)
    material = (folder / "material.toml").read_text()
    assert "make its draws anew" not in command(folder, "failure-map", "m.toml", "--plot", "none").stderr
    before = tomllib.loads(material)["equilibrium"]["shear_modulus"]
    edited = material.replace(f'"{before}"', f'"{2 * float(before.split()[0])} Pa"', 1)
    assert edited != material
    (folder / "material.toml").write_text(edited)
    run = command(folder, "failure-map", "m.toml", "--plot", "none")
    assert run.returncode == 0
    assert run.stderr.count("if the material has been edited, make its draws anew") == 1
    assert "material.toml: a shear modulus of" in run.stderr
    # without [uncertainty] nobody asks for draws
    (folder / "draws.csv").unlink()
    (folder / "m.toml").write_text(QUICK)
    assert command(folder, "failure-map", "m.toml", "--plot", "none").returncode == 0


def test_after_its_slowest_time_a_melt_has_no_modulus_that_draws_could_miss(recwarn: pytest.WarningsRecorder) -> None:
    shift, moduli = library.WLF(20.0, 13.7, 187.1), ([0.0, 1e5], [1e-3, 1e5], [1e3, 1e5])
    melt, slow, other = (library.Material("melt", 0.0, library.Spectrum([9.0, 1.0], each), shift) for each in moduli)
    _warn_of_draws("melt.toml", melt, [slow])
    assert not recwarn.list
    _warn_of_draws("melt.toml", melt, [other])
    assert "make its draws anew" in str(recwarn.pop().message)


def test_relaxation_times_of_another_material_are_doubted(command: Run, folder: Path) -> None:
    (folder / "m.toml").write_text(QUICK + UNCERTAIN)
    material = (folder / "material.toml").read_text()
    times = tomllib.loads(material)["nonequilibrium"]["relaxation_time_s"]
    edited = material
    for time_s in times:
        edited = edited.replace(f"    {time_s!r},\n", f"    {10 * time_s!r},\n", 1)
    assert tomllib.loads(edited)["nonequilibrium"]["relaxation_time_s"] == pytest.approx([10 * time_s for time_s in times])
    own = library.read_draws(folder / "material.toml")
    (folder / "material.toml").write_text(edited)
    assert "make its draws anew" in command(folder, "failure-map", "m.toml", "--plot", "none").stderr
    for before, after in zip(own, library.read_draws(folder / "material.toml"), strict=True):
        np.testing.assert_array_equal(before.spectrum.relaxation_time, after.spectrum.relaxation_time)


def test_a_table_of_draws_may_leave_relaxation_times_to_the_material(folder: Path) -> None:
    own = library.read_draws(folder / "material.toml")
    rows = [line.split(",") for line in (folder / "draws.csv").read_text().splitlines()]
    kept = rows[0].index("relaxation_time_1 [s]")
    (folder / "draws.csv").write_text("\n".join(",".join(row[:kept]) for row in rows) + "\n")
    for before, after in zip(own, library.read_draws(folder / "material.toml"), strict=True):
        np.testing.assert_array_equal(before.spectrum.relaxation_time, after.spectrum.relaxation_time)
        np.testing.assert_array_equal(before.spectrum.shear_modulus, after.spectrum.shear_modulus)


def test_a_material_without_draws_is_not_uncertain(command: Run, folder: Path) -> None:
    (folder / "m.toml").write_text(MAP.replace("material.toml", "example:vhb4905.toml") + UNCERTAIN)
    said = refused(command, folder, "failure-map", "m.toml")
    assert "example:vhb4905.toml names no draws, and no scatter is stated" in said
