"""Any viscoelastic measurement in a table, over time or frequency, and every mistake in one line."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import exports
import numpy as np
import pytest
from exports import Step
from hypothesis import given, settings, strategies as st
from readings import expect_sweeps, read, sweep_file, sweep_rows, table

from dielast.base.errors import DielastWarning, InputError
from dielast.material.measurement import CreepCurve, FrequencySweep, RelaxationCurve

SWEEP = {"temperature": "T", "frequency": "f", "storage": "E'", "loss": "E''"}


@pytest.mark.parametrize("roles", [("storage", "loss"), ("storage", "tan_delta"), ("complex_modulus", "tan_delta")])
@pytest.mark.parametrize("angular", [False, True])
@pytest.mark.parametrize("test", ["tension", "shear"])
def test_the_moduli_of_a_sweep_are_told_from_any_two(tmp_path: Path, roles: tuple[str, str], angular: bool, test: str) -> None:
    T, hertz, storage, loss = sweep_rows().T
    values = {"storage": storage, "loss": loss, "tan_delta": loss / storage, "complex_modulus": np.hypot(storage, loss)}
    frequency = ("angular_frequency", 2 * np.pi * hertz, "rad/s") if angular else ("frequency", hertz, "Hz")
    units = {"tan_delta": "-"}
    header = f"T [degC],w [{frequency[2]}]," + ",".join(f"{role} [{units.get(role, 'Pa')}]" for role in roles)
    sweep_file(tmp_path, header, np.column_stack((T, frequency[1], *(values[role] for role in roles))))
    columns = {"temperature": "T", frequency[0]: "w"} | {role: role for role in roles}
    reading = read(tmp_path, file="sweep.csv", columns=columns, test=test)
    expect_sweeps(reading.measurements, 3.0 if test == "shear" else 1.0)
    assert reading.summary == {"measurement": "oscillation", "test": test, "format": "table"}


@pytest.mark.parametrize("unit", ["1/Pa", "1/MPa", "MPa^-1", "µm²/N", "m2/N", "cm2/dyn"])
@pytest.mark.parametrize("test", ["tension", "shear"])
def test_a_compliance_is_read_in_any_unit(tmp_path: Path, unit: str, test: str) -> None:
    scale = {"1/Pa": 1, "1/MPa": 1e-6, "MPa^-1": 1e-6, "µm²/N": 1e-12, "m2/N": 1, "cm2/dyn": 10}[unit]
    rows = np.array([[20, 1, 2], [20, 2, 3], [20, 4, 5], [40, 1, 4], [40, 2, 6], [40, 4, 8.0]])
    (tmp_path / "creep.csv").write_text(table(f"T [degC],time [s],J [{unit}]", rows))
    found = read(tmp_path, file="creep.csv", columns={"temperature": "T", "compliance": "J"}, test=test).measurements
    assert all(isinstance(one, CreepCurve) for one in found)
    assert isinstance(found[0], CreepCurve)
    np.testing.assert_allclose(found[0].compliance, np.array([2, 3, 5]) * scale / (3 if test == "shear" else 1), rtol=1e-12)


def test_strain_and_stress_are_relaxation_unless_the_recipe_says_creep(tmp_path: Path) -> None:
    rows = np.array([[20, 1, 10, 200], [20, 2, 10, 100], [40, 1, 20, 100], [40, 2, 20, 50.0]])
    (tmp_path / "test.csv").write_text(table("T [degC],time [s],e [%],s [Pa]", rows))
    options: dict[str, Any] = {"file": "test.csv", "columns": {"temperature": "T", "strain": "e", "stress": "s"}}
    relaxed, crept = read(tmp_path, **options).measurements[0], read(tmp_path, **options, measurement="creep").measurements[0]
    assert isinstance(relaxed, RelaxationCurve)
    assert isinstance(crept, CreepCurve)
    np.testing.assert_allclose(relaxed.modulus, [2000, 1000])
    np.testing.assert_allclose(crept.compliance, [0.0005, 0.001])


@pytest.mark.parametrize("columns", [{"set": "Set"}, {}])
def test_the_wobbling_temperatures_of_an_analyser_are_21_sets(shared_data: Callable[[str], Path], columns: dict[str, str]) -> None:
    path = shared_data("ansys_prony/freq_user_raw.csv")
    names = {"temperature": "T", "frequency": "f", "storage": "E_stor", "loss": "E_loss"}
    found = read(path.parent, file=path.name, columns=names | columns).measurements
    raw = np.genfromtxt(path, delimiter=",", skip_header=2)
    assert len(found) == 21
    for number, one in enumerate(found):
        assert isinstance(one, FrequencySweep)
        own = raw[raw[:, 4] == number]
        assert one.temperature == pytest.approx(own[:, 3].mean(), abs=1e-6)  # the mean of the readings
        np.testing.assert_allclose(one.storage_modulus, 1e6 * own[:, 1], rtol=1e-12)


@settings(max_examples=25)
@given(
    levels=st.lists(st.integers(-10, 20), min_size=2, max_size=6, unique=True),
    order=st.randoms(use_true_random=False),
    scatter=st.floats(0, 0.2),
    by_set=st.booleans(),
)
def test_isothermal_sets_are_found_whatever_their_order(
    tmp_path_factory: pytest.TempPathFactory, levels: list[int], order: Any, scatter: float, by_set: bool
) -> None:
    folder = tmp_path_factory.mktemp("sets")
    rows = [
        [5.0 * level + scatter * order.uniform(-1, 1), f, 1e6 * (level + 11), 1e5 * (level + 11), level]
        for level in levels
        for f in (0.1, 1.0, 10.0)
    ]
    if by_set:
        order.shuffle(rows)
    sweep_file(folder, "T [degC],f [Hz],E' [Pa],E'' [Pa],set", np.array(rows))
    columns = SWEEP | ({"set": "set"} if by_set else {})
    found = read(folder, file="sweep.csv", columns=columns).measurements
    assert len(found) == len(levels)
    for one, level in zip(found, sorted(levels), strict=True):
        assert isinstance(one, FrequencySweep)
        assert one.temperature == pytest.approx(5 * level, abs=scatter + 1e-6)
        assert set(one.storage_modulus) == {1e6 * (level + 11)}


def test_sweeps_up_and_down_and_twice_are_runs_of_their_own(tmp_path: Path) -> None:
    one = sweep_rows((20.0,))
    for rows, count in (
        (np.concatenate((one, one)), 2),
        (np.concatenate((one[::-1], one[::-1])), 2),
        (one[::-1], 1),
        (np.random.default_rng(3).permutation(one), 1),
    ):
        sweep_file(tmp_path, rows=rows)
        assert len(read(tmp_path, file="sweep.csv", columns=SWEEP).measurements) == count


def test_hz_and_rad_per_second_are_never_confused(tmp_path: Path) -> None:
    names = {"temperature": "T", "storage": "E'", "loss": "E''"}
    for unit, role, message in (
        ("rad/s", "frequency", 'column "f" [rad/s]: rad/s is the unit of an angular frequency, but a frequency is needed'),
        ("Hz", "angular_frequency", 'column "f" [Hz]: Hz is the unit of a frequency, but an angular frequency is needed'),
        ("1/s", "frequency", 'column "f" [1/s]: 1/s may mean a frequency or an angular frequency: state Hz or rad/s'),
        ("s^-1", "angular_frequency", "s^-1 may mean a frequency or an angular frequency: state Hz or rad/s"),
        ("Pa", "frequency", 'column "f" [Pa]: a frequency is needed, such as "10 Hz"'),
    ):
        sweep_file(tmp_path, f"T [degC],f [{unit}],E' [Pa],E'' [Pa]")
        with pytest.raises(InputError) as caught:
            read(tmp_path, file="sweep.csv", columns={**names, role: "f"})
        assert message in str(caught.value)
    sweep_file(tmp_path, "T [degC],f [1/s],E' [Pa],E'' [Pa]")
    expect_sweeps(read(tmp_path, file="sweep.csv", columns=SWEEP, units={"frequency": "Hz"}).measurements)
    sweep_file(tmp_path, "T [degC],f,E' [Pa],E'' [Pa]")
    with pytest.raises(InputError, match=r'column "f" has no unit: call it "f \[Hz\]" or state units = { frequency = "Hz" }'):
        read(tmp_path, file="sweep.csv", columns=SWEEP)


def test_all_wrong_columns_are_told_with_their_keys(tmp_path: Path) -> None:
    sweep_file(tmp_path, "T [s],w [rad/s],E' [Pa],E'' [Pa]")
    with pytest.raises(InputError) as caught:
        read(tmp_path, file="sweep.csv", columns=SWEEP | {"frequency": "w", "storage": "G'", "loss": "G''"})
    assert [line.split(":", 1)[1].split("; ")[0] for line in caught.value.messages] == [
        ' column "T" [s]: a temperature is needed, such as "20 degC" (data.columns.temperature)',
        ' column "w" [rad/s]: rad/s is the unit of an angular frequency, but a frequency is needed, such as "10 Hz" '
        "(data.columns.frequency)",
        ' no column "G\'" for storage',
        " no column \"G''\" for loss",
    ]


def test_two_columns_of_frequency_must_agree(tmp_path: Path) -> None:
    rows = sweep_rows()
    columns = SWEEP | {"angular_frequency": "w"}
    header = "T [degC],f [Hz],E' [Pa],E'' [Pa],w [rad/s]"
    sweep_file(tmp_path, header, np.column_stack((rows, 2 * np.pi * rows[:, 1])))
    expect_sweeps(read(tmp_path, file="sweep.csv", columns=columns).measurements)
    sweep_file(tmp_path, header, np.column_stack((rows, rows[:, 1])))
    with pytest.raises(InputError, match=r"sweep.csv: line 2: frequency 0.01592 Hz and angular frequency 0.01592 rad/s contradict"):
        read(tmp_path, file="sweep.csv", columns=columns)


@pytest.mark.parametrize(
    ("role", "unit", "scale", "truth"),
    [("frequency", "Hz", 2 * np.pi, "rad/s"), ("angular_frequency", "rad/s", 1 / (2 * np.pi), "Hz")],
)
def test_a_complex_viscosity_shows_a_wrong_unit_of_frequency(
    tmp_path: Path, role: str, unit: str, scale: float, truth: str
) -> None:
    rows = sweep_rows()
    omega = 2 * np.pi * rows[:, 1]
    viscosity = np.hypot(rows[:, 2], rows[:, 3]) / omega
    columns = {"temperature": "T", "storage": "E'", "loss": "E''", role: "f", "complex_viscosity": "eta"}
    header = f"T [degC],f [{unit}],E' [Pa],E'' [Pa],eta [Pa.s]"
    right = omega / (2 * np.pi) if unit == "Hz" else omega
    sweep_file(tmp_path, header, np.column_stack((rows[:, 0], right, rows[:, 2:], viscosity)))
    expect_sweeps(read(tmp_path, file="sweep.csv", columns=columns).measurements)
    sweep_file(tmp_path, header, np.column_stack((rows[:, 0], right * scale, rows[:, 2:], viscosity)))
    what = role.replace("_", " ")
    with pytest.warns(DielastWarning, match=f"sweep.csv: the complex viscosity fits if what is stated as {what} is in {truth}"):
        read(tmp_path, file="sweep.csv", columns=columns)
    sweep_file(tmp_path, header, np.column_stack((rows[:, 0], right, rows[:, 2:], viscosity / 3)))
    with pytest.warns(DielastWarning, match="complex modulus over angular frequency is 3 times the complex viscosity"):
        read(tmp_path, file="sweep.csv", columns=columns)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({1: 0.0}, "sweep.csv: line 2: frequency is not above zero"),
        ({1: -1.0}, "sweep.csv: line 2: frequency is not above zero"),
        ({1: np.nan}, 'sweep.csv: line 2: column "f": "nan" is not a finite number'),
        ({3: np.inf}, 'sweep.csv: line 2: column "E\'\'": "inf" is not a finite number'),
        ({0: -300.0}, "sweep.csv: line 2: temperature is at or below absolute zero"),
    ],
)
def test_wrong_numbers_say_where(tmp_path: Path, change: dict[int, float], message: str) -> None:
    rows = sweep_rows()
    for column, wrong in change.items():
        rows[0, column] = wrong
    sweep_file(tmp_path, rows=rows)
    with pytest.raises(InputError) as caught:
        read(tmp_path, file="sweep.csv", columns=SWEEP)
    assert str(caught.value).startswith(message)


def test_a_table_needs_columns(tmp_path: Path) -> None:
    sweep_file(tmp_path)
    with pytest.raises(InputError, match=r"sweep.csv: columns are needed: this is no instrument's export that dielast knows"):
        read(tmp_path, file="sweep.csv")
    with pytest.raises(InputError, match=r"sweep.csv: steps are wanted, but this is no instrument's export"):
        read(tmp_path, file="sweep.csv", columns=SWEEP, steps=[1])


@pytest.mark.parametrize(("within", "alternate"), [(0.7, True), (0.2, False), (3.0, False)])
def test_readings_of_one_temperature_that_scatter_are_not_two_temperatures_in_silence(
    tmp_path: Path, within: float, alternate: bool
) -> None:
    """Within the tolerance of 0.5 K they are one; far apart they are two that were measured side by side."""
    rows = sweep_rows()
    rows[: exports.OMEGA.size : 2, 0] += within
    sweep_file(tmp_path, rows=rows)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        read(tmp_path, file="sweep.csv", columns=SWEEP)
    said = [str(entry.message) for entry in caught if "alternate" in str(entry.message)]
    assert bool(said) == alternate
    assert all("0 and 0.7 degC alternate: if they are one temperature whose readings scatter" in text for text in said)


@pytest.mark.parametrize("column", [2, 3])
def test_most_moduli_must_be_positive(tmp_path: Path, column: int) -> None:
    rows = sweep_rows()
    rows[:3, column] *= -1
    sweep_file(tmp_path, rows=rows)
    with pytest.warns(DielastWarning, match=r"line 2: the \w+ modulus at 0 degC is zero or negative here, and in 2 more rows,"):
        assert len(read(tmp_path, file="sweep.csv", columns=SWEEP).measurements) == 3  # left out when they are shifted
    rows[3:30, column] *= -1
    sweep_file(tmp_path, rows=rows)
    with pytest.raises(InputError, match=r"sweep.csv: line 2: 13 of 13 storage or loss moduli at 0 degC are zero or negative"):
        read(tmp_path, file="sweep.csv", columns=SWEEP)


def test_what_is_no_pattern_of_files_is_said(tmp_path: Path) -> None:
    said = r"a glob pattern is needed|: not a glob pattern: |: no file matches"
    for pattern in ("", ".", "./", "/", "/.", "///x", "a**", "x" * 300, "*/" * 900 + "*"):
        with pytest.raises(InputError, match=said):
            read(tmp_path, files=pattern, columns=SWEEP)


@pytest.mark.parametrize(
    ("measurement", "held", "constant", "other"),
    [("relaxation", "stress", "stress", "creep"), ("creep", "strain", "strain", "relaxation")],
)
def test_what_is_held_tells_creep_from_relaxation(tmp_path: Path, measurement: str, held: str, constant: str, other: str) -> None:
    time = np.geomspace(1, 1000, 20)
    rows = [(T, t, *((0.01, 1e4 / t**0.2) if held == "strain" else (0.01 * t**0.2, 1e4))) for T in (20.0, 40.0) for t in time]
    (tmp_path / "dma.csv").write_text(table("T [degC],t [s],strain [1],stress [Pa]", np.array(rows)))
    columns = {"temperature": "T", "time": "t", "strain": "strain", "stress": "stress"}
    with pytest.warns(DielastWarning, match=f'the {constant} is constant .* as in {other}: state measurement = "{other}"'):
        read(tmp_path, file="dma.csv", columns=columns, measurement=measurement)
    read(tmp_path, file="dma.csv", columns=columns, measurement=other)


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
