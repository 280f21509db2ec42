"""The summary: a table with units for a person at a terminal, plain lines for a script."""

from __future__ import annotations

import os
import pty
import re
import threading
from contextlib import suppress
from pathlib import Path

import pytest
from processes import Run

from dielast.report.summary import rows

WARNED = 'kind = "relax"\nmaterial = "example:vhb4905.toml"\n[[step]]\nhold = "10 s"\n' + (
    '[[compare]]\nfile = "m.csv"\nx = "time [s]"\ny = "stretch_1 [1]"\n'
)


def on_a_terminal(dielast: Run, *arguments: str, **environment: str | bool) -> tuple[str, str]:
    """Standard output as a terminal gets it, and standard error."""
    ours, theirs = pty.openpty()
    shown: list[bytes] = []

    def read() -> None:
        with suppress(OSError):  # once the other end is closed
            while piece := os.read(ours, 65536):
                shown.append(piece)

    reader = threading.Thread(target=read)
    reader.start()
    terminal = {"TERM": "xterm-256color", "COLUMNS": "80", "PYTHONUTF8": "1"}
    done = dielast(*arguments, to=theirs, **{**terminal, **environment})
    os.close(theirs)
    reader.join()
    os.close(ours)
    assert done.returncode == 0, done.stderr
    return b"".join(shown).decode(), done.stderr


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ({"equilibrium_Pa": 77163.0}, ("equilibrium", "77.16 kPa")),
        ({"glassy_Pa": 2.8524e8}, ("glassy", "285.2 MPa")),
        ({"true_field_V_per_m": [4.8e7, 4e7]}, ("true field", "48 MV/m, 40 MV/m")),
        ({"activation_energy_J_per_mol": 1.2e5}, ("activation energy", "120 kJ/mol")),
        ({"first_work_J_per_m3": 1234.0}, ("first work", "1.234 kJ/m³")),
        ({"reference_temperature_degC": 20.0}, ("reference temperature", "20 °C")),
        ({"time_s": 646.52}, ("time", "646.5 s")),
        ({"time_s": 9999.96}, ("time", "1e+04 s")),
        ({"relaxation_time_min_s": 3.0059e-7}, ("relaxation time min", "300.6 ns")),
        ({"relaxation_time_max_s": 1.6022e5}, ("relaxation time max", "44.51 h")),
        ({"time_s": 0.0}, ("time", "0 s")),
        ({"shear_Pa": 999.97}, ("shear", "1 kPa")),
        ({"shear_Pa": -2000.0}, ("shear", "-2 kPa")),
        ({"rms_relative_error": 0.021589}, ("rms relative error", "2.159 %")),
        ({"C2_K": 186.55, "C2_K_stderr": 0.65086}, ("C2", "186.55 ± 0.65 K")),
        (
            {"activation_energy_J_per_mol": 1.2e5, "activation_energy_J_per_mol_stderr": 900.0},
            ("activation energy", "120 ± 0.9 kJ/mol"),
        ),
        ({"branches": 30}, ("branches", "30")),
        ({"law": "wlf"}, ("law", "wlf")),
        ({"interrupted": True}, ("interrupted", "true")),
        ({"cases": [0, 2]}, ("in case", "0, 2")),
        ({"stretch_1": [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]}, ("stretch 1", "1, 2, 3, 4, 5, … 6 in all")),
    ],
)
def test_numbers_are_shown_in_units_that_suit_them(values: dict[str, object], expected: tuple[str, str]) -> None:
    assert list(rows(values)) == [expected]


def test_a_terminal_gets_a_table_and_a_script_gets_lines(dielast: Run, tmp_path: Path) -> None:
    (tmp_path / "r.toml").write_text(
        'kind = "spectrum"\nmastercurve = "example:mastercurve"\n[fit]\nmethod = "schwarzl-staverman"\n'
    )
    shown, errors = on_a_terminal(dielast, "spectrum", "r.toml", "--plot", "none", TERM="dumb")
    assert errors.startswith("warning: the curve ends before its plateau")
    lines = [line.split() for line in shown.splitlines()]
    assert lines[0] == ["spectrum:", "results", "in", "r"]
    assert ["fit", "method", "schwarzl-staverman"] in lines
    assert ["moduli", "equilibrium", "shear", "25.7", "kPa"] in lines
    assert max(map(len, shown.splitlines())) <= 80
    plain = dielast("spectrum", "r.toml", "--plot", "none").stdout
    (modulus,) = re.findall(r"^moduli.equilibrium_shear_Pa = (\S+)$", plain, re.MULTILINE)
    assert f"{float(modulus) / 1e3:.1f}" == "25.7"
    assert all(" = " in line for line in plain.splitlines())


def test_no_colour_where_none_is_wanted(dielast: Run, tmp_path: Path) -> None:
    (tmp_path / "r.toml").write_text('kind = "spectrum"\nmastercurve = "example:mastercurve"\n')
    shown, _ = on_a_terminal(dielast, "spectrum", "r.toml", "--plot", "none", NO_COLOR="1")
    # bold and dim are no colours
    assert not any(f"\x1b[{code}m" in shown for code in (*range(30, 38), *range(90, 98)))
    assert "\x1b[38" not in shown


def test_a_terminal_without_unicode_gets_what_it_can_write(dielast: Run, tmp_path: Path) -> None:
    (tmp_path / "r.toml").write_text(
        'kind = "mastercurve"\n[data]\nfile = "example:relaxation-test.csv"\nramp = "1 s"\n'
        'columns = { temperature = "temperature", modulus = "relaxation_modulus" }\n[shift]\nreference_temperature = "20 degC"\n'
    )
    ascii_only = {"PYTHONUTF8": "0", "PYTHONIOENCODING": "ascii", "LC_ALL": "C", "TERM": "dumb", "fresh": True}
    shown, errors = on_a_terminal(dielast, "mastercurve", "r.toml", "--plot", "none", **ascii_only)
    assert errors == ""
    assert "20 degC" in shown
    assert " +- " in shown


def test_warnings_come_below_the_summary(dielast: Run, tmp_path: Path) -> None:
    (tmp_path / "r.toml").write_text(WARNED)
    (tmp_path / "m.csv").write_text("time [s],stretch_1\n1,1\n20,1\n")
    with (tmp_path / "both").open("wb") as both:
        dielast("relax", "r.toml", "--plot", "none", to=both.fileno(), errors_to=both.fileno())
    *above, last = (tmp_path / "both").read_text().splitlines()
    assert last.startswith("warning: m.csv: the simulation does not reach 1 of 2 points")
    assert above[0] == "relax.cases = 1"


@pytest.mark.parametrize(
    ("words", "offered"),
    [
        (
            "dielast new ",
            {"mastercurve", "spectrum", "calibrate", "relax", "creep", "actuate", "failure-map", "design", "measure", "lifetime"},
        ),
        ("dielast new fa", {"failure-map"}),
        ("dielast fai", {"failure-map"}),
    ],
)
def test_a_shell_offers_kinds(words: str, offered: set[str], dielast: Run) -> None:
    done = dielast(_DIELAST_COMPLETE="complete_bash", COMP_WORDS=words, COMP_CWORD=str(len(words.split(" ")) - 1))
    assert set(done.stdout.split()) == offered
    assert done.stderr == ""
