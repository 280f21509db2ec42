"""Runs of legal but foolish recipes say what looks wrong, in one line each, and their sane neighbours say nothing."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dielast import WLF, InputError, Material, read_material, write_material
from dielast.cli.run import compute
from dielast.commands.plan import warnings_of
from dielast.commands.registry import COMMANDS, read_cases
from dielast.material.spectrum import Spectrum
from dielast.sharing.execution import Execution

EXAMPLE = Path(str(files("dielast") / "examples/vhb4905.toml"))
Run = Callable[..., tuple[list[str], Mapping[str, Any]]]


@pytest.fixture(name="run")
def _run(tmp_path: Path) -> Run:
    """Run a starter, of a film under dead load, with keys set anew: its warnings, and its summary."""

    def run(kind: str, *overrides: str, material: Material | None = None) -> tuple[list[str], Mapping[str, Any]]:
        path = tmp_path / f"{kind}.toml"
        lines = COMMANDS[kind].starter().replace('boundary = "frame"', 'boundary = "dead-load"').splitlines()
        path.write_bytes("\n".join(line for line in lines if not line.startswith(("electrode_", "frame_diameter"))).encode())
        if material is not None:
            (tmp_path / "m.toml").write_bytes(write_material(material))
            overrides = (*overrides, "material=m.toml")
        coarse = ("output.points_per_decade=3",) if kind in ("relax", "creep", "actuate") else ()
        if kind == "failure-map":
            coarse = ('voltage={from="3.4 kV",to="4.6 kV",points=3}',)
        found = compute(kind, read_cases(path, kind, (*coarse, *overrides)), path, (), Execution())
        return found[3], tomllib.loads(found[0]["summary.toml"].decode())

    return run


def truncated(keep: int = 7) -> Material:
    """The example without all branches faster than 393 s."""
    material = read_material(EXAMPLE)
    return replace(material, spectrum=material.spectrum.slowest(keep))


ONE_KILOVOLT_SINE = 'step=[{{waveform="sine",high="1 kV",period="{}",cycles=2}}]'


CHARGED = 'step=[{{charge="{}"}},{{hold="1 s"}}]'


@pytest.mark.parametrize(
    ("kind", "overrides", "said"),
    [
        ("relax", [], "step[0] takes 8 s, but the fastest branch takes 393 s at 20 degC"),
        ("creep", [], "step[0] takes 17 s, but the fastest branch takes 393 s"),
        ("actuate", [], "step[0] takes 10 s, but the fastest branch takes 393 s"),
        ("relax", ["step.0={stretch=2.0}"], "step[0] comes at once, and the first thousandth of what follows takes 7.2 s"),
        ("relax", ["step.0={stretch=2.0}", 'output.times=["10 s"]'], "step[0] is first looked at after 10 s"),
        ("relax", ['output.times=["4 s","1 h"]'], "step[0] takes 8 s"),
        ("relax", ['output.times=["50 s","1 h"]'], "step[0] is first looked at after 50 s"),
        ("actuate", [ONE_KILOVOLT_SINE.format("20 s")], "step[0] goes up or down within 10 s"),
        ("actuate", ['film.relax="10 s"', 'step=[{voltage="2 kV",duration="10 min"}]'], "prestretch and relaxation take 19 s"),
        ("actuate", ['step.0={voltage="3.8 kV"}'], "the film breaks down as the voltage comes on, after 0 s"),
        ("failure-map", [], "4 of 6 cells fail too early for the spectrum, the first after 0 s"),
    ],
)
def test_what_is_faster_than_the_spectrum_is_told_once(run: Run, kind: str, overrides: list[str], said: str) -> None:
    (warning,) = run(kind, *overrides, material=truncated())[0]
    assert said in warning


@pytest.mark.parametrize(
    ("points", "said"),
    [
        ("5,1.2\n6,1.25\n7,1.3", "a stretch of 1.2 at 5 s: until then it goes there evenly, from 1"),
        ("0,1.2\n1,1.25\n2,1.3", "a stretch of 1.2 at 0 s: it goes there at once, from 1"),
        ("1,1.05\n2,1.1\n3,1.15", ""),  # as a machine writes it
        ("5,1\n6,1.1\n7,1.2", ""),
    ],
)
def test_a_load_that_begins_late_or_loaded_is_told(run: Run, tmp_path: Path, points: str, said: str) -> None:
    (tmp_path / "load.csv").write_text(f"time [s],stretch\n{points}\n")
    warnings, summary = run("relax", 'step=[{table="load.csv"}]', 'output.times=["2 s"]')
    assert [line for line in warnings if "the table begins" in line] == (
        [f"load.csv: the table begins with {said}"] if said else []
    )
    assert summary["relax"]["peak_of"] == "the rows at output.times"


@pytest.mark.parametrize(
    ("kind", "overrides"),
    [
        ("relax", ['step.0={stretch=2.0,duration="10 min"}']),
        ("relax", ['output.times=["500 s","1 h"]']),
        ("relax", ["step.0={stretch=2.0}", 'output.times=["500 s"]']),
        ("relax", ["step.0={stretch=2.0}", 'step.1.hold="10 d"']),
        ("relax", ['temperature="60 degC"']),  # where the fastest branch takes 1.5 s
        ("actuate", [ONE_KILOVOLT_SINE.format("20 min")]),
        ("failure-map", ['temperature=["60 degC"]', 'voltage={from="3 kV",to="3.2 kV",points=2}']),
    ],
)
def test_what_is_slower_than_the_spectrum_is_not(run: Run, kind: str, overrides: list[str]) -> None:
    assert run(kind, *overrides, material=truncated())[0] == []


def test_a_whole_spectrum_may_be_loaded_at_once_in_the_cold(run: Run) -> None:
    assert run("relax", "step.0={stretch=1.2}", 'temperature="-40 degC"')[0] == []


@pytest.mark.parametrize(
    ("kind", "overrides", "said"),
    [
        ("relax", ['step.0.rate="1e12 /s"'], ["step[0] takes 1e-12 s"]),
        ("relax", ['temperature="150 degC"'], ["extrapolated"]),
        ("creep", ['temperature="-60 degC"'], ["extrapolated", "step[0] takes 17 s, but the fastest branch takes 681 s"]),
        ("relax", ["step.0={stretch=0.5}"], ["is it a strain, so that the stretch is 1.5?", "goes slack after 0 s"]),
        ("relax", ["step.0={stretch=1.0}"], ["is it a strain of 100 %, so that the stretch is 2?"]),
        ("creep", ['step.0={force="0.17 kN",duration="17 s"}'], ["stretches the film to 10.6"]),
        ("creep", ['specimen={width="6 m",thickness="0.5 m"}'], ["the thickness is 500 mm", "strains the film by less than 1e-05"]),
        ("failure-map", ['film.thickness="0.5 m"'], ["the thickness is 500 mm", "1/1445 of the breakdown field"]),
        ("failure-map", ['voltage={from="3.4 V",to="4.6 V",points=2}'], ["1/1445 of the breakdown field"]),
        ("actuate", ['step.0.voltage="2.5 MV"'], ["376 times the breakdown field"]),
        ("actuate", ['step.0={voltage="100 kV"}'], ["beyond the breakdown field from the start"]),
        ("actuate", ['step.0={voltage="-100 kV"}'], ["as the voltage comes on: it is beyond the breakdown field from the start"]),
        (
            "actuate",
            ['control="charge"', CHARGED.format("-30 mC/m^2")],
            ["as the charge comes on: it is beyond the breakdown field"],
        ),
        ("actuate", ['control="charge"', CHARGED.format("-30 nC/m^2")], ["the highest charge makes a field of 209 V/m"]),
        ("actuate", ['leakage={conductivity="3e-14 S/m",field="40 kV/m"}'], ["the conductivity grows by a factor e^"]),
        ("spectrum", ['material.permittivity="4.5 F/m"'], ["times that of the vacuum"]),
        ("spectrum", ["material={relative_permittivity=560}"], ["560 times that of the vacuum, but elastomers have 2 to 20 times"]),
        ("spectrum", ["material.J_lim={equilibrium=0.1}"], ["J_lim = 0.1 (equilibrium)"]),
        ("spectrum", ['material.breakdown={field="48 V/m"}'], ["a breakdown field of 48 V/m"]),
    ],
)
def test_other_units_and_quantities_are_told(run: Run, kind: str, overrides: list[str], said: list[str]) -> None:
    warnings = run(kind, *overrides)[0]
    assert len(warnings) == len(said)
    for warning, words in zip(warnings, said, strict=True):
        assert words in warning


def test_the_size_of_a_specimen_is_told_with_its_key(tmp_path: Path) -> None:
    starter = COMMANDS["calibrate"].starter().encode().replace(b'"80 mm"', b'"80 km"')
    said = warnings_of(tmp_path / "calibrate.toml", starter)
    assert [line.partition(": ")[0] for line in said] == [
        "test[0].specimen",
        "test[1].specimen",
        "test[2].specimen",
        "validate[0].specimen",
    ]
    (tmp_path / "test.csv").write_text(
        "time [s],extension [mm],force [N]\n" + "".join(f"{t},2,{2 + 1 / t}\n" for t in (1, 2, 4, 8))
    )
    columns = 'columns = { time = "time", extension = "extension", force = "force" }'
    recipe = f'kind = "spectrum"\n[data]\nfile = "test.csv"\nreference_temperature = "20 degC"\n{columns}\n'
    said = warnings_of(
        tmp_path / "r.toml", (recipe + 'specimen = { gauge_length = "50 mm", width = "6 nm", thickness = "1 mm" }').encode()
    )
    assert any(line.startswith("data.specimen: the width is 6e-06 mm") for line in said)


def test_moduli_in_another_unit_are_told_by_the_plateau(run: Run, tmp_path: Path) -> None:
    head, *rows = (files("dielast") / "examples/relaxation-test.csv").read_text().splitlines()
    softer = [",".join([*row.split(",")[:-1], f"{float(row.rpartition(',')[2]) / 1000:.9g}"]) for row in rows]
    (tmp_path / "test.csv").write_text("\n".join([head, *softer]))
    (warning,) = run("mastercurve", "data.file=test.csv")[0]
    assert "levels off at 77.2 Pa" in warning


def test_swapped_columns_and_kelvin_are_told(run: Run, tmp_path: Path) -> None:
    time = np.geomspace(1.0, 1e4, 30)
    rows = [f"{1e5 * (1 + 10 / t**0.3):.6g},{t:.6g}" for t in time.tolist()]
    (tmp_path / "swapped.csv").write_text("time [s],modulus [Pa]\n" + "\n".join(rows) + "\n")
    recipe = 'kind = "spectrum"\n[data]\nfile = "swapped.csv"\nreference_temperature = "20 degC"\n[fit]\nmethod = "nnls"\n'
    (tmp_path / "s.toml").write_text(recipe)
    warnings = compute("spectrum", read_cases(tmp_path / "s.toml", "spectrum"), tmp_path / "s.toml", (), Execution())[3]
    assert any("are the columns of time and modulus swapped?" in warning for warning in warnings)
    material = read_material(EXAMPLE)
    hot = replace(material, shift=WLF(298.0, 13.7, 187.1), measured_temperature=None)
    said = run("relax", 'temperature="298 degC"', material=hot)[0]
    assert any("the reference temperature is 298 degC: was the value in kelvin" in warning for warning in said)


def test_a_card_in_place_of_a_material_is_told_what_reads_it(tmp_path: Path) -> None:
    (tmp_path / "job.inp").write_text("*MATERIAL, NAME=A\n*ELASTIC\n1., 0.5\n")
    with pytest.raises(InputError, match=r'job\.inp: a card of Abaqus: dielast spectrum .* prony = "job\.inp" and prony_units'):
        read_material(tmp_path / "job.inp")


def test_the_peak_is_the_largest_in_magnitude(run: Run) -> None:
    assert run("relax", 'step.0={stretch=0.5,duration="5 s"}', 'slack="pushes"')[1]["relax"]["peak_nominal_stress_1_Pa"] < -1e5
    creep = run("creep", 'step.0={stress="-50 kPa",duration="5 s"}')[1]["creep"]
    assert creep["peak_stretch_1"] == pytest.approx(creep["final_stretch_1"])
    assert creep["peak_stretch_1"] < 0.9


def test_breakdown_at_once_is_a_result(run: Run) -> None:
    warnings, summary = run("actuate", 'step.0={voltage="500 kV"}')
    assert "unfinished" not in summary
    assert summary["breakdown"]["time_s"] == [0.0]
    assert len(warnings) == 2
    warnings, summary = run("failure-map", 'film.thickness="0.5 um"')
    assert "unfinished" not in summary
    assert summary["map"]["breakdown"] == summary["map"]["cells"] == 6
    assert summary["map"]["longest_time_to_failure_s"] == 0
    assert any("6 of 6 cells break down as the voltage comes on" in line for line in warnings)


def test_a_film_that_breaks_only_because_it_moves_is_not_beyond_the_breakdown_field_from_the_start(run: Run) -> None:
    """At the prestretch, 1.2 kV makes 9.6 MV/m and 1.3 kV makes 10.4 MV/m; the film would hold both voltages."""
    elastic = replace(read_material(EXAMPLE), spectrum=Spectrum(np.ones(1), np.zeros(1)))
    film = ("film.prestretch=2", 'film.thickness="0.5 mm"', 'breakdown.field="10 MV/m"')
    for voltage, beyond in (("1.2 kV", False), ("1.3 kV", True)):
        warnings, summary = run("actuate", f'step.0={{voltage="{voltage}"}}', *film, material=elastic)
        assert summary["breakdown"]["time_s"] == [0.0]
        assert any("beyond the breakdown field from the start" in line for line in warnings) == beyond


def test_many_cells_that_are_given_up_for_one_reason_take_one_line(run: Run) -> None:
    (line,) = run("failure-map", 'film.thickness="0.5 nm"')[1]["unfinished"]
    assert line.startswith("20 degC, prestretch 1.7, 3400 V: given up: ")
    assert line.endswith(" (and 5 more cells)")


def test_many_cases_that_are_given_up_for_one_reason_take_one_line(run: Run) -> None:
    melt = replace(read_material(EXAMPLE), equilibrium_modulus=0.0)
    lines = run("creep", 'sweep={"step.0.force"=["0.17 N","0.2 N","0.1 N"]}', material=melt)[1]["unfinished"]
    assert lines[0].startswith("case 0: given up at 2842.")
    assert lines[0].endswith(": without an equilibrium modulus the film flows without limit (and 2 more cases)")
    assert len(lines) == 1


def test_a_branch_that_is_cut_off_is_not_said_to_be_extrapolated(run: Run) -> None:
    fast = 'fit.relaxation_time={min="1e-9 s",max="1e4 s"}'
    stated = ('fit.equilibrium_modulus="0.078 MPa"', 'fit.glassy_modulus="690 MPa"')
    whole, cut = (run("spectrum", fast, *stated, *more)[0] for more in ((), ("truncate.keep=10",)))
    assert any("relaxation times from 1e-09 to 1e+04 s reach beyond what the curve" in line for line in whole)
    assert not any("reach beyond" in line for line in cut)


@pytest.mark.parametrize(
    ("back", "slack"),
    [
        ("{stretch=1.9}", True),
        ('{stretch=1.0,duration="1 d"}', True),
        ('{stretch=1.5,duration="1 d"}', False),
        ('{hold="1 s"}', False),
    ],
)
def test_a_film_that_is_let_back_too_fast(run: Run, back: str, slack: bool) -> None:
    """It follows as far as its equilibrium spring pulls, which takes its time."""
    steps = f'step=[{{stretch=2.0,duration="10 s"}},{{hold="1 h"}},{back}]', "solver.rtol=1e-4"
    said, summary = run("relax", *steps)
    assert ["the specimen goes slack after " in one for one in said] == [True] * slack
    assert ("slack_events" in summary["relax"]) == slack
    said, _ = run("relax", *steps, 'slack="pushes"')
    assert [" by which the film is pushed: a thin one goes slack" in one for one in said] == [True] * slack


def test_slack_phases_are_counted_and_their_cases_named(run: Run) -> None:
    back = '{stretch=1.0,duration="1 s"},{stretch=2.0,duration="1 s"},{stretch=1.0,duration="1 s"}'
    steps = f'step=[{{stretch=2.0,duration="10 s"}},{{hold="1 h"}},{back}]', "solver.rtol=1e-4"
    said, summary = run("relax", *steps, 'sweep={"step.2.stretch"=[1.6,1.9999,1.5,1.4]}')
    assert summary["relax"]["slack_events"] == [3, 1, 3, 3]
    (one,) = (each for each in said if "slack" in each)
    assert one.startswith("case 0 (also 1 to 3): the specimen goes slack 2 times, first after 361")
    said, _ = run("relax", *steps, 'sweep={"step.4.stretch"=[1.9999,1.5,1.5,1.9999,1.5]}', "step.2.stretch=1.9999")
    (one,) = (each for each in said if "slack" in each)
    assert one.startswith("case 1 (also 2, 4): the specimen goes slack after 361")


def test_a_load_that_presses_a_film_is_warned_of(run: Run) -> None:
    said, _ = run("creep", 'step=[{stress="-1 kPa",duration="1 s"}]')
    assert "the load presses by 1e+03 Pa: a thin film buckles instead" in said


def test_warnings_before_an_error_tell_why(dielast: Callable[..., Any], tmp_path: Path) -> None:
    """The temperatures of the example plus 273.15, under a header that says degC."""
    table = (files("dielast") / "examples/relaxation-test.csv").read_text("utf-8").splitlines()
    cells = [line.split(",", 1) for line in table[1:]]
    kelvin = [table[0], *(f"{float(temperature) + 273.15},{rest}" for temperature, rest in cells)]
    (tmp_path / "kelvin.csv").write_text("\n".join(kelvin))
    (tmp_path / "r.toml").write_text(
        'kind = "mastercurve"\n[data]\nfile = "kelvin.csv"\ncolumns = { temperature = "temperature", time = "time", '
        'modulus = "relaxation_modulus" }\n[shift]\nreference_temperature = "20 degC"\n'
    )
    done = dielast("mastercurve", "r.toml")
    *warned, error = done.stderr.splitlines()
    assert (done.returncode, error.split(":")[:2]) == (2, ["r.toml", " shift.reference_temperature"])
    assert warned[0] == "warning: the tests are at 233.15 to 333.15 degC: was the value in kelvin, but stated as degC?"
