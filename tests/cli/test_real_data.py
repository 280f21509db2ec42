"""What measured files of others asked for that no made-up file had."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from processes import Run

SWEEPS = """
kind = "mastercurve"
[data]
file = "{file}"
columns = {{ frequency = "f", storage = "E_stor", loss = "E_loss", temperature = "T", set = "Set" }}
[shift]
reference_temperature = "-5 degC"
"""
FOUR_TESTS = """
kind = "spectrum"
[data]
file = "{file}"
columns = {{ time = "time", stress = "stress", strain = "stretch", temperature = "temp" }}
units = {{ time = "s", stress = "Pa", temperature = "K", strain = "1" }}
[fit]
branches = 5
"""


def test_glassy_curves_are_not_placed_by_a_law_that_does_not_reach_them(
    dielast: Run, tmp_path: Path, shared_data: Callable[[str], Path]
) -> None:
    (tmp_path / "r.toml").write_text(SWEEPS.format(file=shared_data("ansys_prony/freq_user_raw.csv")))
    refused = dielast("mastercurve", "r.toml", "--plot", "none")
    assert refused.returncode == 2
    assert "-5 degC lies among temperatures whose shift factors are not determined" in refused.stderr
    assert "take 39.969 degC, the nearest temperature with a shift factor" in refused.stderr
    done = dielast("mastercurve", "r.toml", "--plot", "none", "--set", "shift.reference_temperature='39.969 degC'")
    assert done.returncode == 0, done.stderr
    assert "the shift law is extrapolated and does not know log10 a within half a decade: their points are left out" in done.stderr
    decades = next(float(line.split(" = ")[1]) for line in done.stdout.splitlines() if line.startswith("data.decades"))
    assert decades < 30


def test_several_tests_in_one_file_are_not_taken_for_one_in_silence(
    dielast: Run, tmp_path: Path, shared_data: Callable[[str], Path]
) -> None:
    (tmp_path / "r.toml").write_text(FOUR_TESTS.format(file=shared_data("vhb4905/3-creep.csv")))
    assert "are these several tests? Leave the rows of one in the file" in dielast("spectrum", "r.toml", "--plot", "none").stderr


def test_a_stretch_is_one_more_than_the_strain(dielast: Run, tmp_path: Path) -> None:
    rows = [(10.0 ** (row / 8), 78e3 + 1e5 * 10.0 ** (-row / 16)) for row in range(33)]
    found = []
    for role, more in (("strain", 0.0), ("stretch", 1.0)):
        lines = "\n".join(f"{time!r},{more + 0.02!r},{0.02 * modulus!r}" for time, modulus in rows)
        (tmp_path / "test.csv").write_text(f"time [s],{role} [1],stress [Pa]\n{lines}\n")
        data = (
            f'[data]\nfile = "test.csv"\ncolumns = {{ {role} = "{role}", stress = "stress" }}\nreference_temperature = "20 degC"\n'
        )
        (tmp_path / "r.toml").write_text(f'kind = "spectrum"\n{data}[fit]\nbranches = 5\n')
        done = dielast("spectrum", "r.toml", "--plot", "none")
        assert done.returncode == 0, done.stderr
        found.append([float(line.split(" = ")[1]) for line in done.stdout.splitlines() if line.startswith("moduli")])
    assert found[1] == pytest.approx(found[0], rel=1e-9)
