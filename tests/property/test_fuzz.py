"""A short slice of tests/trust/fuzz.py: whatever is read may be damaged, and is then refused in one line that names the file."""

from __future__ import annotations

import importlib
import os
import random
import signal
import sys
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from dielast.base.errors import InputError
from dielast.commands.registry import COMMANDS, read_cases
from dielast.report.golden import differences

INPUTS = 25
HUGE = "1" + 400 * "0"  # beyond every floating-point number, and short enough for Python
FOLDER = str(Path(__file__).parents[1] / "trust")
sys.path.append(FOLDER)
fuzz, fuzz_targets, fuzz_runs = map(importlib.import_module, ("fuzz", "fuzz_targets", "fuzz_runs"))
sys.path.remove(FOLDER)
NAMES = [
    *(f"recipe-{kind}" for kind in COMMANDS),
    *("set", "material", "csv", "measurement", "wide", "curve", "export", "load-table", "machine", "draws", "store"),
    *("folder-summary", "folder-mastercurve", "folder-shift-factors", "folder-draw-laws", "folder-draw-curves"),
    *("golden-failure-map", "golden-summary", "golden-tolerance"),
]
DRAWS = ",".join(("draw,equilibrium_shear_modulus [Pa],C1 [1],C2 [K]", *(f"shear_modulus_{k} [Pa]" for k in range(1, 11))))
SUMMARY = 'kind = "mastercurve"\n[shift]\nreference_temperature_degC = 20.0\nlaw = "wlf"\n'
FACTORS = "temperature [degC],log10_shift_factor [1]"
LAWS = "draw,C1 [1],C2 [K]"
CURVES = ",".join(("reduced_time [s]", *(f"relaxation_modulus_{draw} [Pa]" for draw in (0, 1, 4))))


@pytest.fixture(scope="module")
def targets(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    return dict(fuzz.targets(tmp_path_factory.mktemp("fuzz")))


@pytest.fixture
def clock() -> Iterator[None]:
    """The alarm clock that ends what takes too long."""
    previous = signal.signal(signal.SIGPROF, fuzz.alarm)
    yield
    signal.signal(signal.SIGPROF, previous)


def test_no_target_is_left_out(targets: dict[str, Any]) -> None:
    assert sorted(targets) == sorted(NAMES)


@pytest.mark.usefixtures("clock")
@pytest.mark.parametrize("name", NAMES)
def test_damaged_input_is_refused_in_a_line(name: str, targets: dict[str, Any]) -> None:
    # the same inputs in continuous integration, others everywhere else
    rng = random.Random(zlib.crc32(name.encode()) if os.environ.get("CI") else None)
    for _ in range(INPUTS):
        data = fuzz.damage(targets[name].seeds, rng)
        wrong = targets[name].wrong(data)
        assert wrong is None, f"{wrong}: {data!r}"


@pytest.mark.usefixtures("clock")
@pytest.mark.parametrize(
    ("kind", "inputs"),
    [
        *((kind, 1) for kind in ("relax", "creep", "actuate", "failure-map", "spectrum")),
        *(pytest.param(kind, 40, marks=pytest.mark.trust) for kind in COMMANDS),
    ],
)
def test_runs_of_extreme_numbers_end_in_numbers_and_figures_or_a_line(kind: str, inputs: int, tmp_path: Path) -> None:
    target = fuzz_runs.runs(tmp_path)[f"run-{kind}"]
    rng = random.Random(zlib.crc32(kind.encode()) if os.environ.get("CI") else None)
    for _ in range(inputs):
        data = target.damaged(rng)
        wrong = target.wrong(data)
        assert wrong is None, f"{wrong}: {data!r}"


@pytest.mark.usefixtures("clock")
@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("set", f"film.prestretch={HUGE}", "film.prestretch: 1000"),
        ("folder-summary", f"{SUMMARY}C1 = {HUGE}\nC2_K = 5.0\n", "line 5: not TOML: a number of too many digits"),
        ("folder-summary", f"{SUMMARY}C1 = 13.7\nC2_K = -5.0\n", "shift.C2_K: -5: a number of K above 0 is needed"),
        ("folder-shift-factors", f"{FACTORS}\n0,1\n,0\n", 'row 3: column "temperature [degC]": a number is needed'),
        ("golden-summary", f"[map]\ncells = {HUGE}\n", "line 2: not TOML: a number of too many digits"),
        ("draws", f"{DRAWS}\n0,0,13,187{',0' * 10}\n", "row 2: every shear modulus is zero: the material carries no load"),
        ("folder-draw-laws", f"{LAWS}\ninf,13.7,187.1\n1,13.9,190.2\n", 'row 2: column "draw": a number is needed'),
        ("folder-draw-laws", f"{LAWS}\n0,13.7,187.1\n1,,190.2\n", 'row 3: column "C1 [1]": a number is needed'),
        ("folder-draw-laws", f"{LAWS}\n0,13.7,187.1\n", "1 draws: at least 2 are needed"),
        ("folder-draw-curves", f"{CURVES}\n", "no rows: a folder written by mastercurve is needed"),
        ("folder-draw-curves", f"{CURVES}\n1,2e5,1e400,3e5\n", 'row 2: column "relaxation_modulus_1 [Pa]": a positive number'),
        ("folder-draw-curves", f"{CURVES}\n1,3e5,3e5,3e5\n1,2e5,2e5,2e5\n", 'row 3: column "reduced_time [s]": 1 is not above 1'),
    ],
)
def test_what_was_once_dealt_with_wrongly(name: str, text: str, message: str, targets: dict[str, Any]) -> None:
    """Each of these ended in a traceback, went through unnoticed or was blamed on another file."""
    assert targets[name].wrong(text.encode()) is None
    with pytest.raises(InputError) as caught:
        targets[name].read(text.encode())
    assert len(caught.value.messages) == 1
    assert f": {message}" in caught.value.messages[0]


@pytest.mark.parametrize("absurd", ["1.7e308", "1e-320"])
@pytest.mark.parametrize("column", ["equilibrium_shear_modulus [Pa]", "C2 [K]", "shear_modulus_3 [Pa]", "relaxation_time_1 [s]"])
def test_absurd_draws_overflow_quietly(absurd: str, column: str, targets: dict[str, Any]) -> None:
    header, *rows = targets["draws"].seeds[0].decode().splitlines()
    place = header.split(",").index(column)
    for row, text in enumerate(rows):
        cells = text.split(",")
        cells[place] = absurd
        rows[row] = ",".join(cells)
    assert targets["draws"].wrong("\n".join((header, *rows, "")).encode()) is None


@pytest.mark.usefixtures("clock")
@pytest.mark.parametrize("text", ["sweep={a=[" + "'2'," * 20_000 + "]}", "film.prestretch=2\na" + ".a" * 40_000 + "=1"])
def test_what_once_took_forever(text: str, targets: dict[str, Any]) -> None:
    assert targets["set"].wrong(text.encode()) is None


def test_the_time_to_read_a_sweep_is_proportional_to_its_cases() -> None:
    starter = fuzz_targets.TOP / "dielast/commands/membrane/starters/relax.toml"
    first, *others = read_cases(starter, "relax", ["sweep={'step.0.stretch'=[1.5, 2.0, 2.5]}"])
    # copied into every case, the values would take the square
    assert len(others) == 2
    assert all(each.recipe.sweep["step.0.stretch"] is first.recipe.sweep["step.0.stretch"] for each in others)


def test_a_damaged_store_is_taken_for_nothing(targets: dict[str, Any]) -> None:
    """Wherever it is damaged or cut."""
    store = targets["store"]
    whole = store.seeds[0]
    assert sorted(store.read(whole).results["cells"]) == [(0, 3), (3, 6)]
    for at in (0, 40, len(whole) // 2, len(whole) - 1):
        assert store.read(whole[:at] + bytes([whole[at] ^ 1]) + whole[at + 1 :]).results == {}
        assert store.read(whole[:at]).results == {}


@pytest.mark.parametrize("name", ["cells.csv", "tolerance.toml"])
def test_a_folder_among_golden_files(name: str, tmp_path: Path) -> None:
    summary = b"[map]\ncells = 1\n"
    (tmp_path / "summary.toml").write_bytes(summary)
    (tmp_path / name).mkdir()
    assert differences({"summary.toml": summary}, tmp_path, 1e-6) == []
