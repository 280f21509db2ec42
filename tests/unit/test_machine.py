"""What a testing machine writes, extension and force of a specimen, drives a simulation and is compared with it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dielast.base.errors import InputError
from dielast.cli.run import compute
from dielast.commands.registry import COMMANDS, read_cases
from dielast.commands.simulation.compare import read_points
from dielast.commands.simulation.recipe import CompareSection
from dielast.commands.simulation.solver_steps import solver_steps
from dielast.io.files import Inputs
from dielast.mechanics.load import Track
from dielast.sharing.execution import Execution

GAUGE, AREA = 80e-3, 6e-3 * 0.5e-3
SPECIMEN = 'specimen = { gauge_length = "80 mm", width = "6 mm", thickness = "0.5 mm" }\n'
HEAD = 'kind = "{kind}"\nmaterial = "example:vhb4905.toml"\n'
TIME = np.array([0.5, 1.0, 2.0, 5.0])
STRETCH = np.array([1.2, 1.5, 1.4, 1.6])
FORCE = np.array([0.02, 0.05, 0.04, 0.06])


def machine(folder: Path, header: str = "time [s],extension [mm],force [N]", time: float = 1.0) -> None:
    rows = np.column_stack((TIME / time, 1e3 * GAUGE * (STRETCH - 1), FORCE))
    (folder / "machine.csv").write_text(header + "\n" + "\n".join(",".join(map(repr, map(float, row))) for row in rows) + "\n")


def recipe(folder: Path, kind: str, rest: str) -> Any:
    path = folder / "recipe.toml"
    path.write_text(HEAD.format(kind=kind) + rest)
    return read_cases(path)[0].recipe


def followed(folder: Path, kind: str, rest: str) -> tuple[list[float], np.ndarray]:
    (entry,) = solver_steps(recipe(folder, kind, rest), Inputs(folder))
    assert isinstance(entry.step.target, Track)
    return list(entry.step.target.value), np.asarray(entry.step.target.time)


@pytest.mark.parametrize(("kind", "expected"), [("relax", STRETCH), ("creep", FORCE / AREA)])
@pytest.mark.parametrize("renamed", [False, True])
def test_a_machine_s_table_is_a_load(tmp_path: Path, kind: str, expected: np.ndarray, renamed: bool) -> None:
    columns = ""
    machine(tmp_path)
    if renamed:
        machine(tmp_path, "Zeit [min],Weg [mm],Standardkraft [N]", 60.0)
        named = 'extension = "Weg"' if kind == "relax" else 'force = "Standardkraft"'
        columns = f'columns = {{ time = "Zeit", {named} }}\n'
    found, time = followed(tmp_path, kind, SPECIMEN + '[[step]]\ntable = "machine.csv"\n' + columns)
    np.testing.assert_allclose(np.array(found, dtype=float), expected, rtol=1e-12)
    np.testing.assert_allclose(time, TIME, rtol=1e-12)


def test_what_no_column_holds_is_said_with_the_key(tmp_path: Path) -> None:
    machine(tmp_path, "time [s],Weg [mm],Kraft [N]")
    said = 'there are "time", "Weg", "Kraft": state columns.stretch, columns.strain or'
    with pytest.raises(InputError, match=said):
        followed(tmp_path, "relax", SPECIMEN + '[[step]]\ntable = "machine.csv"\n')


def points(folder: Path, x: str, y: str, **options: Any) -> tuple[np.ndarray, np.ndarray]:
    model = CompareSection.model_validate({"file": "machine.csv", "x": x, "y": y, **options}, context={"folder": folder})
    return read_points(model, Inputs(folder))


KNOWN = {"specimen": {"gauge_length": "80 mm", "width": "6 mm", "thickness": "0.5 mm"}}


@pytest.mark.parametrize(
    ("header", "options"),
    [
        ("time [s],extension [mm],force [N]", {}),
        ("time [s],Weg [mm],Kraft [N]", {"columns": {"extension": "Weg", "force": "Kraft"}}),
        ("time [s],Weg [mm],Kraft [N]", {"x_column": "Weg [mm]", "y_column": "Kraft"}),
        ("time [s],Weg,Kraft", {"x_column": "Weg", "y_column": "Kraft", "units": {"x": "mm", "y": "N"}}),
    ],
)
def test_extension_and_force_are_compared_with_stretch_and_stress(tmp_path: Path, header: str, options: dict[str, Any]) -> None:
    machine(tmp_path, header)
    x, y = points(tmp_path, "stretch_1 [1]", "nominal_stress_1 [Pa]", **options, **KNOWN)
    np.testing.assert_allclose(x, STRETCH, rtol=1e-12)
    np.testing.assert_allclose(y, FORCE / AREA, rtol=1e-12)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            {"y_column": "Kraft"},
            'machine.csv: column "Kraft": a force needs the undeformed specimen: specimen = { width = "6 mm", ',
        ),
        ({"y_column": "Kraft", "columns": {"force": "Kraft"}, **KNOWN}, "y_column and columns.force state the same"),
        ({**KNOWN}, 'no column "nominal_stress_1" for y; there are "time [s]", "Weg [mm]", "Kraft [N]": state y_column'),
        ({"y_column": "Weg", **KNOWN}, 'column "Weg" [mm]: a stress or modulus is needed'),
    ],
)
def test_wrong_comparisons_say_what_is_needed(tmp_path: Path, options: dict[str, Any], message: str) -> None:
    machine(tmp_path, "time [s],Weg [mm],Kraft [N]")
    with pytest.raises(ValueError, match=r".") as caught:
        points(tmp_path, "time [s]", "nominal_stress_1 [Pa]", **options)
    assert message in str(caught.value)


def test_a_simulation_agrees_with_its_own_force_and_extension(tmp_path: Path) -> None:
    """A pull and a hold, written as a machine would, drive the same simulation: the misfit is that of straight lines."""
    rest = '[[step]]\nstretch = 1.2\nrate = "5 %/s"\n[[step]]\nhold = "10 s"\n[output]\npoints_per_decade = 5\n'
    path = tmp_path / "recipe.toml"
    path.write_text(HEAD.format(kind="relax") + rest)
    table = compute("relax", read_cases(path), path, (), Execution())[0]["relax.csv"].decode().splitlines()
    names = table[0].split(",")
    rows = np.array([[float(cell or "nan") for cell in line.split(",")] for line in table[1:]])
    time, stretch, stress = (rows[1:, names.index(name)] for name in ("time [s]", "stretch_1 [1]", "nominal_stress_1 [Pa]"))
    lines = [
        f"{t!r},{u!r},{f!r}"
        for t, u, f in zip(time.tolist(), (1e3 * GAUGE * (stretch - 1)).tolist(), (stress * AREA).tolist(), strict=True)
    ]
    (tmp_path / "machine.csv").write_text("\n".join(["time [s],extension [mm],force [N]", *lines]) + "\n")
    compare = '[[compare]]\nfile = "machine.csv"\nx = "time [s]"\ny = "nominal_stress_1 [Pa]"\n'
    path.write_text(HEAD.format(kind="relax") + SPECIMEN + '[[step]]\ntable = "machine.csv"\n' + compare)
    assert COMMANDS["relax"].prepared(read_cases(path), Inputs(tmp_path))
    contents = compute("relax", read_cases(path), path, (), Execution())[0]
    summary = contents["summary.toml"].decode()
    error = float(summary.split("rms_relative_error = ")[1].split("\n")[0])
    assert error < 1e-5


@pytest.mark.parametrize("kind", ["relax", "creep"])
def test_a_number_too_large_for_its_specimen_is_one_line(tmp_path: Path, kind: str) -> None:
    (tmp_path / "machine.csv").write_text("time [s],extension [m],force [N]\n1,0.1,1\n2,1e308,1e308\n")
    with pytest.raises(InputError, match=r"machine.csv: line 3: the (extension|force) is too large a number for its specimen"):
        followed(tmp_path, kind, SPECIMEN + '[[step]]\ntable = "machine.csv"\n')
