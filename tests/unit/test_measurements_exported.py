"""Exports of instruments as measurements: which steps and which modulus, and every mistake in one line."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import exports
import numpy as np
import pytest
from exports import Step
from readings import expect_sweeps, read

from dielast.base.errors import DielastWarning, InputError
from dielast.material.measurement import CreepCurve, FrequencySweep, RelaxationCurve

USUAL = ("Temperature", "Angular frequency", "Storage modulus", "Loss modulus"), ("°C", "rad/s", "Pa", "Pa")
RELAXING = ("Temperature", "Step time", "Relaxation modulus"), ("°C", "s", "Pa")


def export(folder: Path, steps: list[Step], **options: Any) -> str:
    (folder / "export.txt").write_text(exports.trios(steps, **options))
    return "export.txt"


@pytest.mark.parametrize("name", [name for name in exports.files() if "relaxation" not in name and "frequencies" not in name])
def test_a_sweep_s_export_needs_no_columns(name: str) -> None:
    reading = read(exports.FOLDER, file=name)
    assert reading.kind.name == "oscillation"
    # the files of dynamic mechanical analysers hold Young's moduli already
    assert reading.deformation == ("tension" if name.split("-")[0] in ("universal", "proteus", "eplexor") else "shear")
    expect_sweeps(reading.measurements, 3.0)
    assert reading.summary["format"] == reading.formats[0]


def test_steps_that_do_not_fit_are_left_out_and_said() -> None:
    reading = read(exports.FOLDER, file="trios-sweeps.txt")
    assert reading.left_out == ("Conditioning", "Amplitude sweep")
    assert reading.summary["steps_left_out"] == ["Conditioning", "Amplitude sweep"]


def test_steps_are_chosen_by_name_or_number() -> None:
    for steps in (["frequency sweep*"], [3, 4, 5], ["Frequency sweep (0.0 °C)", 4, "*(40.0*"]):
        assert len(read(exports.FOLDER, file="trios-sweeps.txt", steps=steps).measurements) == 3
    with pytest.raises(InputError, match=r'trios-sweeps.txt: no step "creep"; there are 1 "Conditioning", 2 "Amplitude sweep"'):
        read(exports.FOLDER, file="trios-sweeps.txt", steps=["creep"])
    with pytest.raises(InputError, match='step "Conditioning" is empty'):
        read(exports.FOLDER, file="trios-sweeps.txt", steps=[1, 3])
    with pytest.raises(InputError, match='step "Amplitude sweep" has Temperature, Angular frequency'):
        read(exports.FOLDER, file="trios-sweeps.txt", steps=[2])


def test_two_kinds_of_measurement_in_one_export_must_be_told_apart(tmp_path: Path) -> None:
    name = export(tmp_path, exports.sweeps(*USUAL) + exports.relaxations(*RELAXING))
    with pytest.raises(InputError) as caught:
        read(tmp_path, file=name)
    assert str(caught.value) == (
        'there are frequency sweeps (export.txt, "Frequency sweep (0.0 °C)") and relaxation tests (export.txt, "Stress relaxation '
        '(0.0 °C)"): one kind makes a master curve: state measurement = "oscillation" or "relaxation"'
    )
    assert len(read(tmp_path, file=name, measurement="relaxation").measurements) == 3
    assert len(read(tmp_path, file=name, steps=["freq*"]).measurements) == 3
    with pytest.raises(InputError, match=r"export.txt: no creep tests found in this TA Instruments TRIOS export"):
        read(tmp_path, file=name, measurement="creep")


def test_a_recipe_s_word_goes_before_the_export_s(tmp_path: Path) -> None:
    name = export(tmp_path, exports.sweeps(*USUAL), instrument="Discovery HR 20")
    expect_sweeps(read(tmp_path, file=name, test="tension").measurements, 1.0)
    name = export(tmp_path, exports.sweeps(*USUAL), instrument="home made")
    with pytest.raises(
        InputError, match=r'export.txt: the export does not name the kind of modulus: state test = "tension" or "shear"'
    ):
        read(tmp_path, file=name)
    columns = {"temperature": "Temperature", "angular_frequency": "Angular frequency", "storage": "Storage modulus"}
    options = {"columns": columns | {"loss": "Loss modulus"}, "steps": ["Freq*"], "test": "shear"}
    expect_sweeps(read(tmp_path, file=name, **options).measurements, 3.0)


def test_temperatures_come_from_the_column_the_step_s_name_or_the_recipe(tmp_path: Path) -> None:
    bare = [Step(step.name, USUAL[0][1:], USUAL[1][1:], [row[1:] for row in step.rows]) for step in exports.sweeps(*USUAL)]
    expect_sweeps(read(tmp_path, file=export(tmp_path, bare)).measurements, 3.0)
    nameless = [Step("Frequency sweep", step.names, step.units, step.rows) for step in bare]
    with pytest.raises(InputError, match=r'export.txt: step "Frequency sweep" has no temperature: export it, or say temperatures'):
        read(tmp_path, file=export(tmp_path, nameless))
    for step, temperature in zip(nameless, exports.TEMPERATURES, strict=True):
        (tmp_path / f"run_{temperature:g}C.txt").write_text(exports.trios([step]))
    expect_sweeps(read(tmp_path, files="run_*.txt", temperature_in_name="run_{degC}C").measurements, 3.0)
    files = [f"run_{temperature:g}C.txt" for temperature in exports.TEMPERATURES]
    expect_sweeps(read(tmp_path, files=files, temperatures=["0 degC", "20 degC", "40 degC"]).measurements, 3.0)


def test_points_that_were_not_measured_are_left_out_with_a_warning(tmp_path: Path) -> None:
    text = exports.trios(exports.sweeps(*USUAL))
    line = next(line for line in text.splitlines() if line.startswith("0.03\t100.0"))
    (tmp_path / "export.txt").write_text(text.replace(line, "\t".join([*line.split("\t")[:3], "---"])))
    with pytest.warns(
        DielastWarning, match=r'step "Frequency sweep \(0.0 °C\)": 1 point lacks a reading and is left out \(line 12\)'
    ):
        found = read(tmp_path, file="export.txt").measurements
    assert isinstance(found[0], FrequencySweep)
    assert found[0].angular_frequency.size == exports.OMEGA.size - 1


def test_a_clock_that_runs_on_is_refused(tmp_path: Path) -> None:
    names = ("Temperature", "Time", "Relaxation modulus"), ("°C", "s", "Pa")
    late = [
        Step(step.name, *names, [[T, 1000.0 * k + t, modulus] for T, t, modulus in step.rows])
        for k, step in enumerate(exports.relaxations(*names))
    ]
    with pytest.raises(InputError, match=r'export.txt: line 29: column "Time" runs on from the step before into step "Stress'):
        read(tmp_path, file=export(tmp_path, late))
    assert len(read(tmp_path, file=export(tmp_path, exports.relaxations(*names))).measurements) == 3


def test_strain_and_stress_of_an_export_are_a_relaxation_test_by_its_name(tmp_path: Path) -> None:
    names = ("Temperature", "Step time", "Strain", "Stress"), ("°C", "s", "%", "Pa")
    rows = [[20.0, 0.0, 0.0, 0.0], [20.0, 1.0, 2.0, 100.0], [20.0, 2.0, 2.0, 50.0]]
    steps = [
        Step("Peak hold - 1", *names, rows),
        Step("Stress relaxation - 2", *names, rows[1:]),
        Step("Creep - 3", *names, [[20.0, 1.0, 2.0, 100.0], [20.0, 2.0, 4.0, 100.0]]),
    ]
    name = export(tmp_path, steps)
    (relaxed,) = read(tmp_path, file=name, measurement="relaxation", test="tension").measurements
    (crept,) = read(tmp_path, file=name, measurement="creep", test="tension").measurements
    assert isinstance(relaxed, RelaxationCurve)
    assert isinstance(crept, CreepCurve)
    np.testing.assert_allclose(relaxed.modulus, [5000, 2500])
    np.testing.assert_allclose(crept.compliance, [2e-4, 4e-4])
    assert len(read(tmp_path, file=name, steps=[2], test="tension").measurements) == 1


@pytest.mark.parametrize("unit", ["1/Pa", "1/MPa"])
def test_a_creep_test_s_export_needs_no_columns(tmp_path: Path, unit: str) -> None:
    names = ("Temperature", "Interval Time", "Creep Compliance", "Shear Stress"), ("°C", "s", unit, "Pa")
    steps = [Step("Creep", *names, [[T, t, 2e-6 * t**0.3, 100.0] for t in (0.0, 1.0, 10.0, 100.0)]) for T in exports.TEMPERATURES]
    recovery = Step("Recovery", names[0][:2], names[1][:2], [[20.0, 1.0]])
    (tmp_path / "creep.csv").write_bytes(exports.rheocompass([*steps, recovery]).encode("utf-16"))
    reading = read(tmp_path, file="creep.csv")
    assert (reading.kind.name, reading.deformation, reading.left_out) == ("creep", "shear", ("Recovery interval 1",))
    for one in reading.measurements:
        assert isinstance(one, CreepCurve)
        assert one.time.tolist() == [1, 10, 100]  # a reading at no time at all says nothing
        scale = 1e-6 if unit == "1/MPa" else 1.0
        np.testing.assert_allclose(one.compliance, 2e-6 * one.time**0.3 * scale / 3, rtol=1e-12)


def test_a_ramp_is_refused_for_an_export_of_sweeps() -> None:
    with pytest.raises(InputError, match="leave them out for a frequency sweep"):
        read(exports.FOLDER, file="trios-sweeps.txt", ramp="1 s")
