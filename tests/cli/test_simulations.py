from __future__ import annotations

import tomllib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from processes import Run

from dielast.io.table import number_columns

RELAX = """
kind = "relax"
material = "example:vhb4905.toml"
[[step]]
stretch = 2.0
rate = "12.5 %/s"
[[step]]
hold = "2 h"
"""


def column(path: Path, *headers: str) -> list[np.ndarray]:
    return number_columns(path.read_bytes(), path.name, headers)


def test_a_sweep_gives_each_case_what_it_gets_alone(dielast: Run, tmp_path: Path) -> None:
    sweep = '[sweep]\ntemperature = ["0 degC", "20 degC"]\nmode = ["uniaxial", "equibiaxial"]\n'
    (tmp_path / "sweep.toml").write_text(RELAX + sweep)
    (tmp_path / "alone.toml").write_text(RELAX)
    assert dielast("relax", "sweep.toml", "--plot", "none").returncode == 0
    alone = ["--set", "mode=equibiaxial", "--set", "temperature='0 degC'"]
    assert dielast("relax", "alone.toml", "--plot", "none", *alone).returncode == 0
    case, stress = column(tmp_path / "sweep/relax.csv", "case", "nominal_stress_2 [Pa]")
    (one,) = column(tmp_path / "alone/relax.csv", "nominal_stress_2 [Pa]")
    np.testing.assert_array_equal(stress[case == 1], one)
    assert (tmp_path / "sweep/cases.csv").read_text().splitlines() == [
        "case,temperature [degC],mode",
        "0,0,uniaxial",
        "1,0,equibiaxial",
        "2,20,uniaxial",
        "3,20,equibiaxial",
    ]


def test_noise_is_seeded_relative_and_on_what_is_measured(dielast: Run, tmp_path: Path) -> None:
    (tmp_path / "clean.toml").write_text(RELAX)
    (tmp_path / "noisy.toml").write_text(RELAX + "[output]\nnoise = 0.01\n")
    for name in ("clean", "noisy"):
        assert dielast("relax", f"{name}.toml", "--plot", "none").returncode == 0
    headers = ("stretch_1 [1]", "nominal_stress_1 [Pa]", "relaxation_modulus [Pa]")
    (l0, s0, m0), (l1, s1, m1) = (column(tmp_path / f"{name}/relax.csv", *headers) for name in ("clean", "noisy"))
    np.testing.assert_array_equal(l0, l1)
    assert np.std(s1 / s0 - 1) == pytest.approx(0.01, rel=0.3)
    np.testing.assert_allclose(m1 / m0, s1 / s0, rtol=1e-7)
    assert dielast("relax", "noisy.toml", "--plot", "none", "-o", "again").returncode == 0
    assert (tmp_path / "again/relax.csv").read_bytes() == (tmp_path / "noisy/relax.csv").read_bytes()


def test_a_table_is_followed(dielast: Run, tmp_path: Path) -> None:
    (tmp_path / "history.csv").write_text("time [s],force [N]\n0,0\n17,0.17\n100,0.17\n")
    head = 'kind = "creep"\nmaterial = "example:vhb4905.toml"\nspecimen = { width = "6 mm", thickness = "0.5 mm" }\n'
    (tmp_path / "table.toml").write_text(head + '[[step]]\ntable = "history.csv"\n[output]\ntimes = ["17 s", "100 s"]\n')
    steps = '[[step]]\nforce = "0.17 N"\nrate = "0.01 N/s"\n[[step]]\nhold = "83 s"\n'
    (tmp_path / "steps.toml").write_text(head + steps + '[output]\ntimes = ["17 s", "100 s"]\n')
    for name in ("table", "steps"):
        done = dielast("creep", f"{name}.toml", "--plot", "none", "--depfile", "d")
        assert done.returncode == 0, done.stderr
        assert ("history.csv" in (tmp_path / "d").read_text()) == (name == "table")
    (a,), (b,) = (column(tmp_path / f"{name}/creep.csv", "stretch_1 [1]") for name in ("table", "steps"))
    np.testing.assert_allclose(a, b, rtol=1e-6)


def test_measured_loading_curves_are_compared(dielast: Run, tmp_path: Path, shared_data: Callable[[str], Path]) -> None:
    data = shared_data("vhb4905/4-loading.csv")
    recipe = f"""
kind = "relax"
material = "example:vhb4905.toml"
[[step]]
stretch = 4.0
rate = "5 %/s"
[[step]]
stretch = 1.0
rate = "-5 %/s"
[plot]
x = "stretch_1 [1]"
[[compare]]
file = "{data}"
where = {{ id = 117 }}
x = "stretch_1 [1]"
y = "nominal_stress_1 [Pa]"
x_column = "stretch"
y_column = "stress"
units = {{ x = "1", y = "Pa" }}
"""
    (tmp_path / "r.toml").write_text(recipe)
    done = dielast("relax", "r.toml")
    assert done.returncode == 0, done.stderr
    summary = tomllib.loads((tmp_path / "r/summary.toml").read_text())
    # another laboratory's batch: the same order of stress, not the same curve
    assert 0.05 < summary["compare"]["rms_relative_error"] < 1
    assert summary["compare"]["points"] > 20
    assert summary["inputs"][1]["sha256"]


def test_a_result_compared_with_itself_has_no_misfit_at_any_spacing(dielast: Run, tmp_path: Path) -> None:
    (tmp_path / "r.toml").write_text(RELAX)
    assert dielast("relax", "r.toml", "--plot", "none", "-o", "measured").returncode == 0
    comparison = '[[compare]]\nfile = "measured/relax.csv"\nx = "time [s]"\ny = "nominal_stress_1 [Pa]"\n'
    (tmp_path / "c.toml").write_text(RELAX + comparison)
    for points in ("1", "30"):
        done = dielast("relax", "c.toml", "--plot", "none", "-o", "c", "--set", f"output.points_per_decade={points}")
        assert done.returncode == 0, done.stderr
        assert tomllib.loads((tmp_path / "c/summary.toml").read_text())["compare"]["rms_relative_error"] < 1e-8


def test_load_files_can_be_swept(dielast: Run, tmp_path: Path) -> None:
    (tmp_path / "a.toml").write_text('[[step]]\nstretch = 2.0\nduration = "1 s"\n')
    (tmp_path / "b.toml").write_text('[[step]]\nstretch = 1.5\nduration = "5 s"\n')
    head = 'kind = "relax"\nmaterial = "example:vhb4905.toml"\n[sweep]\nload = ["a.toml", "b.toml"]\n'
    (tmp_path / "r.toml").write_text(head)
    assert dielast("relax", "r.toml", "--plot", "none").returncode == 0
    case, time, stretch = column(tmp_path / "r/relax.csv", "case", "time [s]", "stretch_1 [1]")
    assert [(time[case == k].max(), stretch[case == k].max()) for k in (0, 1)] == [(1, 2), (5, 1.5)]
    (tmp_path / "r.toml").write_text(head.replace("b.toml", "gone.toml"))
    assert "gone.toml" in dielast("relax", "r.toml", "--plot", "none").stderr


def test_a_case_does_not_depend_on_what_the_others_do(dielast: Run, tmp_path: Path) -> None:
    (tmp_path / "r.toml").write_text(RELAX.replace('rate = "12.5 %/s"', 'duration = "0 s"'))
    assert dielast("relax", "r.toml", "--plot", "none", "-o", "alone").returncode == 0
    sweep = '[sweep]\n"step.0.duration" = ["0 s", "1 s"]\n'
    (tmp_path / "s.toml").write_text(RELAX.replace('rate = "12.5 %/s"', 'duration = "0 s"') + sweep)
    assert dielast("relax", "s.toml", "--plot", "none", "-o", "swept").returncode == 0
    alone = (tmp_path / "alone/relax.csv").read_text().splitlines()
    swept = [row for row in (tmp_path / "swept/relax.csv").read_text().splitlines() if row.startswith(("case,", "0,"))]
    assert swept == alone


def test_a_target_that_is_there_already_is_no_mistake(dielast: Run, tmp_path: Path) -> None:
    for target in ("3.7", "6.2", "7.1"):
        step = f'[[step]]\nstretch = {target}\nrate = "10 %/s"\n'
        (tmp_path / "r.toml").write_text(
            'kind = "relax"\nmaterial = "example:vhb4905.toml"\n' + step + '[[step]]\nhold = "3 s"\n' + step
        )
        done = dielast("relax", "r.toml", "--plot", "none")
        assert done.returncode == 0, done.stderr


def test_a_table_is_one_series_that_shows_each_of_its_points(dielast: Run, tmp_path: Path) -> None:
    points = np.linspace(0, 5, 21)
    rows = "\n".join(f"{t},{1 + 0.1 * t}" for t in points)
    (tmp_path / "h.csv").write_text(f"time [s],stretch\n{rows}\n")
    text = 'kind = "relax"\nmaterial = "example:vhb4905.toml"\n[[step]]\ntable = "h.csv"\n[[step]]\nhold = "10 s"\n'
    (tmp_path / "r.toml").write_text(text + "[output]\npoints_per_decade = 5\n")
    assert dielast("relax", "r.toml", "--plot", "none").returncode == 0
    time, stretch = column(tmp_path / "r/relax.csv", "time [s]", "stretch_1 [1]")
    assert np.all(np.diff(time) > 0)
    np.testing.assert_allclose(np.interp(points, time, stretch), 1 + 0.1 * points, rtol=1e-9)
    assert time.size == pytest.approx(6 * 5 + 101, abs=4)
    assert time[-1] == 15
