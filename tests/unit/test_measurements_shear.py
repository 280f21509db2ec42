"""Columns whose names are those of shear are doubted where nothing is said of the test, for tension is the default."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest
from readings import read, sweep_file, table

from dielast.base.errors import DielastWarning


@pytest.mark.parametrize(
    ("names", "doubted"),
    [
        (("G'", "G''"), "G'"),
        (("G\u2032", "G\u2033"), "G\u2032"),
        (("E'", "G''"), "G''"),
        (("G1", "G2"), "G1"),
        (("G_storage", "G_loss"), "G_storage"),
        (("|G*|", "shear loss"), "|G*|"),
        (("Scherspeichermodul", "b"), "Scherspeichermodul"),
        (("E'", "E''"), None),
        (("storage", "loss"), None),
        (("glass", "gain"), None),
    ],
)
def test_names_of_shear_are_not_read_as_tension_without_a_word(tmp_path: Path, names: tuple[str, str], doubted: str | None) -> None:
    sweep_file(tmp_path, f"T [degC],f [Hz],{names[0]} [Pa],{names[1]} [Pa]")
    columns = {"temperature": "T", "frequency": "f", "storage": names[0], "loss": names[1]}
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        plain = read(tmp_path, file="sweep.csv", columns=columns)
    assert plain.deformation == "tension"
    said = [str(one.message) for one in caught]
    assert [f'column "{doubted}" looks like a quantity in shear' in one for one in said] == ([] if doubted is None else [True])
    assert all('test = "shear" or test = "tension"' in one for one in said)
    for test in ("shear", "tension"):  # stated: no doubt
        assert read(tmp_path, file="sweep.csv", columns=columns, test=test).deformation == test


@pytest.mark.parametrize(
    ("role", "name"), [("compliance", "J(t)"), ("compliance", "J"), ("modulus", "G"), ("modulus", "shear modulus")]
)
def test_over_time_names_of_shear_are_doubted_too(tmp_path: Path, role: str, name: str) -> None:
    unit = "1/Pa" if role == "compliance" else "Pa"
    rows = np.array([[20, 1, 2], [20, 2, 3], [20, 4, 5], [40, 1, 4], [40, 2, 6], [40, 4, 8.0]])
    (tmp_path / "time.csv").write_text(table(f"T [degC],time [s],{name} [{unit}]", rows))
    with pytest.warns(DielastWarning, match="looks like a quantity in shear, but is read as in tension, which differs"):
        read(tmp_path, file="time.csv", columns={"temperature": "T", role: name})
