"""Tables of the sweeps that `exports` makes, measurements read as a recipe has them read, and whether they are those sweeps."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import exports
import numpy as np
import pytest
from numpy.typing import NDArray

from dielast.io.files import Inputs
from dielast.material.measurement import FrequencySweep, Measurement, RelaxationCurve
from dielast.readings.read import Dataset, read_all
from dielast.readings.recipe import MeasurementData
from dielast.recipe.validate import check


def table(header: str, rows: NDArray[np.float64]) -> str:
    return "\n".join([header, *(",".join(repr(float(cell)) for cell in row) for row in rows)]) + "\n"


def sweep_rows(temperatures: tuple[float, ...] = exports.TEMPERATURES) -> NDArray[np.float64]:
    """Temperature, Hz, storage and loss, low to high frequency."""
    parts = [np.column_stack((np.full(exports.OMEGA.size, T), exports.sweep(T))) for T in temperatures]
    rows = np.concatenate(parts)
    rows[:, 1] /= 2 * np.pi
    return rows


def sweep_file(folder: Path, header: str = "T [degC],f [Hz],E' [Pa],E'' [Pa]", rows: NDArray[np.float64] | None = None) -> Path:
    path = folder / "sweep.csv"
    path.write_text(table(header, sweep_rows() if rows is None else rows))
    return path


def model(folder: Path, **options: Any) -> MeasurementData:
    return check(MeasurementData, options, "recipe.toml: data", folder)


def read(folder: Path, **options: Any) -> Dataset:
    return read_all(model(folder, **options), Inputs(folder))


def relaxation_curves(data: MeasurementData, inputs: Inputs) -> list[RelaxationCurve]:
    """The measurements, which are relaxation tests."""
    found = read_all(data, inputs).measurements
    assert all(isinstance(curve, RelaxationCurve) for curve in found)
    return [curve for curve in found if isinstance(curve, RelaxationCurve)]


def expect_sweeps(found: list[Measurement], per_shear: float = 1.0) -> None:
    assert [one.temperature for one in found] == pytest.approx(list(exports.TEMPERATURES), abs=0.01)
    for one, temperature in zip(found, exports.TEMPERATURES, strict=True):
        assert isinstance(one, FrequencySweep)
        order = np.argsort(one.angular_frequency)
        omega, storage, loss = exports.sweep(temperature).T
        np.testing.assert_allclose(one.angular_frequency[order], omega, rtol=1e-6)
        np.testing.assert_allclose(one.storage_modulus[order], per_shear * storage, rtol=1e-6)
        np.testing.assert_allclose(one.loss_modulus[order], per_shear * loss, rtol=1e-6)
