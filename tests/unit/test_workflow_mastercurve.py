from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from dielast import RelaxationCurve, build_master_curve
from dielast.errors import InputError
from dielast.files import Inputs
from dielast.recipe.measurements import MeasurementData
from dielast.workflow.mastercurve import read_curves

COLUMNS = {"temperature": "T", "time": "t", "modulus": "E"}
TIME = np.geomspace(1, 100, 12)


def rows(temperature: float, factor: float = 1.0) -> list[str]:
    return [f"{temperature},{t!r},{factor * 1e6 * (t * 10 ** (temperature / 20)) ** -0.3!r}" for t in TIME.tolist()]


def read(folder: Path, lines: list[str], **options: object) -> list[RelaxationCurve]:
    (folder / "dma.csv").write_text("\n".join(["T [degC],t [s],E [Pa]", *lines]) + "\n")
    data = MeasurementData.model_validate({"file": "dma.csv", "columns": COLUMNS, **options}, context={"folder": folder})
    return read_curves(data, Inputs(folder))


def test_two_runs_of_one_temperature_stay_two_curves(tmp_path: Path) -> None:
    found = read(tmp_path, rows(0) + rows(20) + rows(20, 1.02))
    assert [curve.temperature for curve in found] == [0, 20, 20]
    found = read(tmp_path, rows(0) + rows(20) + rows(40) + rows(20, 1.02))
    assert [curve.temperature for curve in found] == [0, 20, 20, 40]


@pytest.mark.parametrize("factor", [1.3, 1.5, 3.0])
def test_runs_of_one_temperature_that_contradict_each_other_are_an_error(tmp_path: Path, factor: float) -> None:
    found = read(tmp_path, rows(0) + rows(20) + rows(20, factor) + rows(40))
    with pytest.raises(InputError, match="20 degC"):
        build_master_curve(found, reference_temperature=20.0)


def test_points_in_no_order_are_one_run(tmp_path: Path) -> None:
    lines = rows(0) + rows(20)
    np.random.default_rng(1).shuffle(lines)
    found = read(tmp_path, lines)
    assert [(curve.temperature, curve.time.size) for curve in found] == [(0, 12), (20, 12)]


def test_thermostat_scatter_is_one_temperature(tmp_path: Path) -> None:
    scatter = np.random.default_rng(2).uniform(-0.2, 0.2, 12)
    lines = [f"{20 + d:.3f}" + row[row.index(",") :] for d, row in zip(scatter, rows(20), strict=True)]
    found = read(tmp_path, rows(0) + lines)
    assert len(found) == 2
    assert found[1].temperature == pytest.approx(20, abs=0.2)
    creeping = [f"{T / 10},{t},{1e6}" for T in range(0, 60, 3) for t in (1, 2, 4)]
    with pytest.raises(InputError, match="run into one another"):
        read(tmp_path, creeping)


def test_a_shear_modulus_becomes_youngs(tmp_path: Path) -> None:
    (tension, _), (shear, _) = read(tmp_path, rows(0) + rows(20)), read(tmp_path, rows(0) + rows(20), test="shear")
    np.testing.assert_allclose(shear.modulus, 3 * tension.modulus)


def test_files_state_their_temperature_in_a_list_or_in_their_name(tmp_path: Path) -> None:
    for temperature, kelvin in ((0, 273.15), (20, 293.15)):
        text = "t [s],E [Pa]\n" + "\n".join(row.split(",", 1)[1] for row in rows(temperature))
        (tmp_path / f"run_{temperature}C.csv").write_text(text)
        (tmp_path / f"abs_{kelvin}K.csv").write_text(text)
    columns = {"time": "t", "modulus": "E"}
    for options in (
        {"files": ["run_20C.csv", "run_0C.csv"], "temperatures": ["20 degC", "273.15 K"]},
        {"files": "run_*.csv", "temperature_in_name": "run_{degC}C"},
        {"files": "abs_*.csv", "temperature_in_name": "abs_{K}K"},
    ):
        data = MeasurementData.model_validate({"columns": columns, **options}, context={"folder": tmp_path})
        found = read_curves(data, Inputs(tmp_path))
        assert [round(curve.temperature, 6) for curve in found] == [0, 20]
    data = MeasurementData.model_validate(
        {"columns": columns, "files": "run_*.csv", "temperature_in_name": "x{degC}"}, context={"folder": tmp_path}
    )
    with pytest.raises(InputError, match="the name does not fit"):
        read_curves(data, Inputs(tmp_path))
