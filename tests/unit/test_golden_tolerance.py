"""Golden comparison: what counts as different, and where a golden folder may say so itself."""

from __future__ import annotations

from pathlib import Path

import pytest

from dielast.base.errors import InputError
from dielast.report.golden import differences

TABLE = b"case,time [s],stress [Pa]\n0,1,100\n0,2,200\n"
SUMMARY = b'kind = "relax"\n[fit]\nerror = 0.01\nbranches = 3\n'


def golden(folder: Path, tolerance: str | None = None) -> Path:
    folder.mkdir(exist_ok=True)
    (folder / "relax.csv").write_bytes(TABLE)
    (folder / "summary.toml").write_bytes(SUMMARY)
    if tolerance is not None:
        (folder / "tolerance.toml").write_text(tolerance)
    return folder


def moved(stress: str = "100", error: str = "0.01") -> dict[str, bytes]:
    return {
        "relax.csv": TABLE.replace(b"100", stress.encode()),
        "summary.toml": SUMMARY.replace(b"0.01", error.encode()),
        "relax.png": b"never compared",
    }


def test_the_same_is_the_same_and_each_moved_cell_is_named(tmp_path: Path) -> None:
    folder = golden(tmp_path / "golden")
    assert differences(moved(), folder, 1e-6) == []
    assert differences(moved("100.00005"), folder, 1e-6) == []
    assert differences(moved("100.0002", "0.010001"), folder, 1e-6) == [
        "relax.csv: stress [Pa]: 1 of 2 cells differs: row 2: 100.0002; golden 100, relative difference 2e-06",
        "summary.toml: fit.error: 0.010001; golden 0.01, relative difference 0.0001",
    ]


def test_a_strain_is_compared_as_a_stretch(tmp_path: Path) -> None:
    folder = golden(tmp_path / "golden")
    of_strain = {
        name: content.replace(b"stress [Pa]", b"area_strain [1]").replace(b"100", b"2e-9") for name, content in moved().items()
    }
    (folder / "relax.csv").write_bytes(of_strain["relax.csv"])
    assert differences({**of_strain, "relax.csv": of_strain["relax.csv"].replace(b"2e-9", b"-9e-7")}, folder, 1e-6) == []
    assert len(differences({**of_strain, "relax.csv": of_strain["relax.csv"].replace(b"2e-9", b"2e-6")}, folder, 1e-6)) == 1
    assert len(differences({**of_strain, "relax.csv": of_strain["relax.csv"].replace(b"2e-9", b"2e-6")}, folder, 1e-2)) == 1
    assert len(differences({**of_strain, "relax.csv": of_strain["relax.csv"].replace(b"2e-9", b"3e-9")}, folder, 0.0)) == 1


@pytest.mark.parametrize("sign", ["-", ""])
def test_a_flipped_sign_a_lost_row_and_swapped_columns_differ(tmp_path: Path, sign: str) -> None:
    folder = golden(tmp_path / "golden")
    found = {"relax.csv": TABLE, "summary.toml": SUMMARY}
    assert bool(differences(found | {"relax.csv": TABLE.replace(b",200", f",{sign}200".encode())}, folder, 1e-6)) == bool(sign)
    assert differences(found | {"relax.csv": TABLE[: TABLE.index(b"0,2")]}, folder, 1e-6) == ["relax.csv: 1 rows; golden 2"]
    swapped = TABLE.replace(b"time [s],stress [Pa]", b"stress [Pa],time [s]")
    assert "columns case, stress [Pa], time [s]" in differences(found | {"relax.csv": swapped}, folder, 1e-6)[0]


def test_a_golden_folder_states_tolerances_of_its_own(tmp_path: Path) -> None:
    stated = '["relax.csv"]\n"stress [Pa]" = 1e-3\n["summary.toml"]\n"fit.error" = { atol = 0.001 }\n'
    folder = golden(tmp_path / "golden", stated)
    assert differences(moved("100.09", "0.0109"), folder, 1e-6) == []
    assert len(differences(moved("100.11", "0.0111"), folder, 1e-6)) == 2
    found = moved() | {"relax.csv": TABLE.replace(b"0,2", b"0,2.001")}
    assert differences(found, folder, 1e-6) == [
        "relax.csv: time [s]: 1 of 2 cells differs: row 3: 2.001; golden 2, relative difference 0.0005"
    ]


def test_a_column_of_many_cells_that_differ_is_one_line(tmp_path: Path) -> None:
    rows = [f"{k},{1 + k}" for k in range(3000)]
    (tmp_path / "golden").mkdir()
    (tmp_path / "golden/a.csv").write_text("x [1],y [Pa]\n" + "\n".join(rows) + "\n")
    (tmp_path / "golden/summary.toml").write_text("[a]\nvalues = [1.0, 2.0, 3.0]\n")
    moved = "\n".join(f"{k},{(1 + k) * (1.01 if k else 1.5)}" for k in range(3000))
    found = {"a.csv": f"x [1],y [Pa]\n{moved}\n".encode(), "summary.toml": b"[a]\nvalues = [1.0, 2.2, 3.1]\n"}
    assert differences(found, tmp_path / "golden", 1e-6) == [
        "a.csv: y [Pa]: 3000 of 3000 cells differ, most row 2: 1.5; golden 1, relative difference 0.33",
        "summary.toml: a.values: 2 of 3 numbers differ, most [1]: 2.2; golden 2.0, relative difference 0.091",
    ]


@pytest.mark.parametrize(
    ("stated", "said"),
    [
        ('["other.csv"]\n"x" = 1e-3\n', "other.csv: no such golden file; there are relax.csv, summary.toml"),
        ('["relax.csv"]\n"x" = 1e-3\n', 'relax.csv: no "x" to compare in this file'),
        ('["relax.csv"]\n"case" = -1\n', 'relax.csv: "case": rtol = -1: a number of at least 0 is needed'),
        ('["relax.csv"]\n"case" = true\n', 'relax.csv: "case": rtol = True: a number'),
        ('["relax.csv"]\n"case" = { tol = 1 }\n', 'relax.csv: "case": rtol, atol or both are needed'),
        ('"relax.csv" = 1\n', "relax.csv: a table of tolerances by column is needed"),
        ("relax.csv", "tolerance.toml"),
    ],
)
def test_a_wrong_tolerance_is_one_line(tmp_path: Path, stated: str, said: str) -> None:
    folder = golden(tmp_path / "golden", stated)
    with pytest.raises(InputError) as caught:
        differences(moved(), folder, 1e-6)
    assert said in str(caught.value)
    assert "tolerance.toml" in str(caught.value)
