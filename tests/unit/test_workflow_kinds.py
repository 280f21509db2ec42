"""`mastercurve` run on frequency sweeps and creep tests: tables, summary and figure."""

from __future__ import annotations

import tomllib
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dielast.base.errors import DielastWarning, InputError
from dielast.cli.run import compute
from dielast.commands.registry import read_cases
from dielast.io.table import parse_csv
from dielast.sharing.execution import Execution

ABSCISSA = np.logspace(-1, 2, 16)
TEMPERATURES = (0.0, 10.0, 20.0, 30.0)


def recipe(folder: Path, columns: str, header: str, *values: Any, shift: str = "") -> Path:
    """A recipe and its data: `values` of the abscissa are measured, 20 degC and below slower by a decade in 20 K."""
    lines = [header]
    for temperature in TEMPERATURES:
        scale = 10 ** ((20 - temperature) / 20)
        for x in ABSCISSA.tolist():
            reduced = x * scale if "w [rad/s]" in header else x / scale
            lines.append(",".join(f"{number:.9g}" for number in (temperature, x, *(value(reduced) for value in values))))
    (folder / "data.csv").write_text("\n".join(lines) + "\n")
    path = folder / "recipe.toml"
    path.write_text(
        f'kind = "mastercurve"\n[data]\nfile = "data.csv"\ncolumns = {{ temperature = "T", {columns} }}\n'
        f'[shift]\nreference_temperature = "20 degC"\n{shift}\n'
    )
    return path


def sweeps(folder: Path, shift: str = "") -> Path:
    def storage(x: float) -> float:
        return 1e5 * x**2 / (1 + x**2) + 1e3

    def loss(x: float) -> float:
        return 1e5 * x / (1 + x**2)

    columns = 'angular_frequency = "w", storage = "S", loss = "L"'
    return recipe(folder, columns, "T [degC],w [rad/s],S [Pa],L [Pa]", storage, loss, shift=shift)


def creep(folder: Path, shift: str = "") -> Path:
    def compliance(x: float) -> float:
        return 1e-6 * (x**0.3 + 0.2 * x**0.9)

    return recipe(folder, 'time = "t", compliance = "J"', "T [degC],t [s],J [1/Pa]", compliance, shift=shift)


def run(path: Path, *plots: str) -> tuple[dict[str, bytes], dict[str, Any]]:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DielastWarning)
        found = compute("mastercurve", read_cases(path, "mastercurve", ()), path, plots, Execution())[0]
    return found, tomllib.loads(found["summary.toml"].decode())


def test_sweeps_give_a_table_over_reduced_frequency(tmp_path: Path) -> None:
    found, summary = run(sweeps(tmp_path), "png")
    table = parse_csv(found["mastercurve.csv"], "mastercurve.csv")
    assert list(table) == [
        "temperature [degC]",
        "angular_frequency [rad/s]",
        "reduced_angular_frequency [rad/s]",
        "storage_modulus [Pa]",
        "loss_modulus [Pa]",
    ]
    reduced = np.array(table["reduced_angular_frequency [rad/s]"], dtype=float)
    assert np.all(np.diff(reduced) >= 0)
    np.testing.assert_allclose(np.array(table["loss_modulus [Pa]"], dtype=float), 1e5 * reduced / (1 + reduced**2), rtol=3e-3)
    assert summary["shift"]["on"] == "moduli"
    assert summary["data"]["measurement"] == "oscillation"
    assert summary["data"]["points"] == 64
    np.testing.assert_allclose(summary["data"]["decades"], 3 + 1.5, atol=1e-3)
    np.testing.assert_allclose(summary["modulus"]["glassy_Pa"], 1.01e5, rtol=0.01)
    shift = parse_csv(found["shift-factors.csv"], "shift-factors.csv")
    np.testing.assert_allclose(np.array(shift["log10_shift_factor [1]"], dtype=float), [1, 0.5, 0, -0.5], atol=1e-3)
    assert found["mastercurve.png"].startswith(b"\x89PNG")


def test_a_recipe_may_say_what_to_shift_on(tmp_path: Path) -> None:
    for on in ("moduli", "tan-delta", "storage"):
        assert run(sweeps(tmp_path, f'on = "{on}"'))[1]["shift"]["on"] == on
    with pytest.raises(InputError, match=r'toml: shift.on: "moduli" is for frequency sweeps; creep curves have one'):
        run(creep(tmp_path, 'on = "moduli"'))


def test_creep_gives_a_table_of_compliances(tmp_path: Path) -> None:
    found, summary = run(creep(tmp_path), "svg")
    table = parse_csv(found["mastercurve.csv"], "mastercurve.csv")
    assert list(table) == ["temperature [degC]", "time [s]", "reduced_time [s]", "creep_compliance [1/Pa]"]
    reduced = np.array(table["reduced_time [s]"], dtype=float)
    compliance = np.array(table["creep_compliance [1/Pa]"], dtype=float)
    np.testing.assert_allclose(compliance, 1e-6 * (reduced**0.3 + 0.2 * reduced**0.9), rtol=3e-3)
    assert "on" not in summary["shift"]
    assert summary["data"]["measurement"] == "creep"
    assert b"<svg" in found["mastercurve.svg"]
