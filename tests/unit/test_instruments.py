"""Exports of instruments: what is written comes back, whatever the separator, decimal mark, encoding and order of columns."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import exports
import numpy as np
import pytest
from exports import LAYOUTS, Step
from hypothesis import given, settings, strategies as st

from dielast.base.errors import InputError
from dielast.base.units import TEMPERATURES, conversion
from dielast.io.cells import decode
from dielast.readings.columns_recipe import ROLES
from dielast.readings.instruments import ExportedStep, recognise
from dielast.readings.instruments.export import columns_by_role

# what a column is called, its unit, and what one of that unit is in SI
TRIOS_NAMES = {
    "temperature": ("Temperature", "°C", 1.0),
    "angular_frequency": ("Angular frequency", "rad/s", 1.0),
    "storage": ("Storage modulus", "MPa", 1e6),
    "loss": ("Loss modulus", "kPa", 1e3),
    "complex_viscosity": ("Complex viscosity", "Pa.s", 1.0),
    "time": ("Step time", "min", 60.0),
}
NAMES: dict[str, dict[str, tuple[str, str, float]]] = {
    "TA Instruments TRIOS": TRIOS_NAMES,
    "LIMS": TRIOS_NAMES,
    "Anton Paar RheoCompass": {
        "temperature": ("Temperature", "°C", 1.0),
        "angular_frequency": ("Angular Frequency", "rad/s", 1.0),
        "storage": ("Storage Modulus", "Pa", 1.0),
        "loss": ("Loss Modulus", "kPa", 1e3),
        "tan_delta": ("Loss Factor", "1", 1.0),
        "compliance": ("Creep Compliance", "1/MPa", 1e-6),
    },
    "Anton Paar Rheoplus": {
        "temperature": ("Temperature", "°C", 1.0),
        "angular_frequency": ("Angular Frequency", "1/s", 1.0),
        "storage": ("Storage Modulus", "Pa", 1.0),
        "loss": ("Loss Modulus", "Pa", 1.0),
        "complex_viscosity": ("Complex Viscosity", "mPa·s", 1e-3),
    },
    "TA Instruments Universal Analysis": {
        "time": ("Time", "min", 60.0),
        "temperature": ("Temperature", "°C", 1.0),
        "frequency": ("Frequency", "Hz", 1.0),
        "storage": ("Storage Modulus", "MPa", 1e6),
        "loss": ("Loss Modulus", "MPa", 1e6),
    },
    "TA Instruments Rheology Advantage": {
        "angular_frequency": ("ang. frequency", "rad/s", 1.0),
        "temperature": ("temperature", "C", 1.0),
        "storage": ("G'", "Pa", 1.0),
        "loss": ('G"', "Pa", 1.0),
        "stress": ("osc. stress", "Pa", 1.0),
    },
    "Netzsch Proteus": {
        "temperature": ("Temp.", "°C", 1.0),
        "time": ("Time", "min", 60.0),
        "frequency": ("f", "Hz", 1.0),
        "storage": ("E'", "MPa", 1e6),
        "loss": ("E''", "MPa", 1e6),
        "tan_delta": ("tan d", "", 1.0),
    },
    "Gabo Eplexor": {
        "frequency": ("f", "Hz", 1.0),
        "storage": ("E'", "MPa", 1e6),
        "loss": ("E''", "MPa", 1e6),
        "complex_modulus": ("|E*|", "MPa", 1e6),
        "tan_delta": ("tan delta", "-", 1.0),
        "temperature": ("T", "°C", 1.0),
    },
}
WRITERS = LAYOUTS | {"LIMS": exports.trios_lims}
ONE_STEP = {"Netzsch Proteus", "Gabo Eplexor"}
NOT_A_ROLE = {"stress"}  # an oscillation's stress is not what a time-domain test means by it


def read(content: bytes, source: str = "export.txt") -> list[ExportedStep]:
    text = decode(content, source)
    known = recognise(text)
    assert known is not None
    return known.read(text, source)


def as_written(
    exported_steps: list[ExportedStep], steps: list[Step], names: dict[str, tuple[str, str, float]], order: list[str]
) -> None:
    assert len(exported_steps) == len(steps)
    for exported, step in zip(exported_steps, steps, strict=True):
        found = columns_by_role(exported.table)
        for place, role in enumerate(order):
            if role in NOT_A_ROLE:
                continue
            got = exported.table.column(found[role], role, ROLES[role])
            np.testing.assert_allclose(got, np.array(step.rows)[:, place] * names[role][2], rtol=1e-12)


@pytest.mark.parametrize("layout", list(NAMES))
@settings(max_examples=10)
@given(data=st.data())
def test_what_is_written_is_read(layout: str, data: st.DataObject) -> None:
    names = NAMES[layout]
    first = ["time"] if layout == "TA Instruments Universal Analysis" else []  # ends of steps are marked in the first column
    order = [*first, *data.draw(st.permutations([role for role in names if role not in first]))]
    numbers = st.floats(1e-6, TEMPERATURES[1], allow_nan=False)  # any may be a temperature
    width = st.lists(numbers, min_size=len(order), max_size=len(order))
    count = 1 if layout in ONE_STEP else data.draw(st.integers(1, 3))
    steps = [
        Step(
            f"step {k}",
            [names[role][0] for role in order],
            [names[role][1] for role in order],
            data.draw(st.lists(width, min_size=1, max_size=6)),
        )
        for k in range(count)
    ]
    decimal = data.draw(st.sampled_from([".", ","]))
    options: dict[str, str] = {}
    if layout in ("TA Instruments TRIOS", "Anton Paar RheoCompass", "Netzsch Proteus", "Gabo Eplexor"):
        options["separator"] = data.draw(st.sampled_from("\t;" if decimal == "," else "\t;,"))
    encoding = data.draw(st.sampled_from(["utf-8", "utf-8-sig", "utf-16", "latin-1"]))
    content = WRITERS[layout](steps, decimal=decimal, **options).encode(encoding)
    known = recognise(decode(content, "export.txt"))
    assert known is not None
    wanted = "TA Instruments TRIOS" if layout == "LIMS" else layout
    assert wanted == known.name
    as_written(read(content), steps, names, order)


@pytest.mark.parametrize("name", list(exports.files()))
def test_the_files_in_the_folder_are_those_of_the_writers(name: str) -> None:
    content = (exports.FOLDER / name).read_bytes()
    assert read(content)
    assert decode(content, name) == decode(exports.files()[name], name)


@pytest.mark.parametrize("name", list(exports.files()))
@settings(max_examples=4)
@given(data=st.data())
def test_a_file_cut_anywhere_is_read_as_far_as_it_goes_or_is_an_error_of_one_line(name: str, data: st.DataObject) -> None:
    content = exports.files()[name]
    whole = read(content)
    cut = content[: data.draw(st.integers(0, len(content)))]
    error = ""
    exported_steps = []
    try:
        text = decode(cut, "cut.txt")
        known = recognise(text)
        exported_steps = known.read(text, "cut.txt") if known else []
    except InputError as caught:
        error = str(caught)
    assert not error or (error.startswith("cut.txt: ") and "\n" not in error)
    for exported, full in zip(exported_steps, whole, strict=False):
        rows = exported.table.lines.size
        assert exported.table.lines.tolist() == full.table.lines[:rows].tolist()
        # a cut through the very last number cannot be seen
        for own, complete in zip(exported.table.cells, full.table.cells, strict=True):
            assert own[: rows - 1] == complete[: max(rows - 1, 0)]


@pytest.mark.parametrize(
    ("name", "change", "message"),
    [
        ("trios-sweeps.txt", lambda text: text[: text.rindex("rad/s") - 3], "row of units under the names"),
        ("trios-sweeps.txt", lambda text: text.replace("°C\trad/s\tPa\tPa\n", ""), "the row of units under the names is missing"),
        ("trios-sweeps.txt", lambda text: text[: text.index("[step]")], "without any [step]: the file seems cut off"),
        ("trios-sweeps.txt", lambda text: text.rstrip()[: text.rstrip().rindex("\t")], "3 cells, but step"),
        ("trios-lims-sweeps.txt", lambda text: text[: text.rstrip().rindex("\n") + 1], "ends after 12 of 13 points"),
        ("trios-lims-sweeps.txt", lambda text: text.replace("Units\t°C\trad/s\tPa\tPa\n", ""), "row of units under the names"),
        ("rheocompass-sweeps.csv", lambda text: text[: text.rstrip().rindex("\n") + 1], "ends after 12 of 13 points"),
        ("rheocompass-sweeps.csv", lambda text: text.replace("\t\t[°C]\t[rad/s]\t[Pa]\t[Pa]", ""), "row of units under the names"),
        ("rheocompass-sweeps.csv", lambda text: text[: text.index("Interval data:")], 'without any "Interval data:"'),
        ("rheoplus-sweeps.txt", lambda text: text.replace("\t[°C]\t[1/s]\t[Pa]\t[Pa]\n", ""), "row of units under the names"),
        ("rheoplus-sweeps.txt", lambda text: text[: text.index("Meas. Pts.")], 'without any "Meas. Pts."'),
        ("universal-analysis-sweeps.txt", lambda text: text[: text.index("StartOfData")], "without its signals or StartOfData"),
        (
            "rheology-advantage-sweeps.txt",
            lambda text: text.replace("°C\trad/s\tPa\tPa\tPa\n", ""),
            "row of units under the names",
        ),
        ("proteus-sweeps.csv", lambda text: text[: text.index("##")], "without its line of names"),
        ("eplexor-sweeps.txt", lambda text: text.replace("°C\tHz\tMPa\tMPa\n", ""), "row of units under the names"),
    ],
)
def test_a_damaged_export_says_where(name: str, change: Callable[[str], str], message: str) -> None:
    text = change(decode(exports.files()[name], name))
    with pytest.raises(InputError) as caught:
        read(text.encode(), "export.txt")
    assert message in str(caught.value)
    assert str(caught.value).startswith("export.txt: line ")


@pytest.mark.parametrize(
    "text",
    [
        "# measured on a Gabo Eplexor\nT [C],f [Hz],E' [MPa],E'' [MPa]\n20,1,2,3\n",
        "Sig1\tSig2\n1\t2\n",
        "# step\ntime [s],step [1]\n1,2\n",
        "Interval,data\n1,2\n",
        "Name,Operator,TRIOS\n1,2,3\n",
        "#Temp./°C;Time/min\n1;2\n",
        "Meas. Pts.;T [degC];f [Hz];E' [MPa];E'' [MPa]\n1;20;0.1;2;1\n2;20;1;3;1\n",
        "Meas. Pts. as in the logbook\nT [degC];f [Hz];E' [MPa];E'' [MPa]\n20;0.1;2;1\n20;1;3;1\n",
        "Interval data: 1 to 2\nT [degC];f [Hz];E' [MPa];E'' [MPa]\n20;0.1;2;1\n20;1;3;1\n",
        "Trios version 5 was used\nT [degC];f [Hz];E' [MPa];E'' [MPa]\n20;0.1;2;1\n20;1;3;1\n",
        "Data Series Information from the logbook\nT [degC];f [Hz]\n20;0.1\n20;1\n",
        "# measured on an Eplexor 500 N\nT [degC];f [Hz];E' [MPa];E'' [MPa]\n20;0.1;2;1\n20;1;3;1\n",
    ],
)
def test_a_table_with_a_vendor_s_word_in_it_is_no_export(text: str) -> None:
    assert recognise(text) is None


def test_measured_tables_are_no_exports(shared_data: Callable[[str], Path]) -> None:
    for folder in ("polystyrene", "ansys_prony", "vhb4905"):
        for path in sorted(shared_data(folder).glob("*.csv")):
            assert recognise(decode(path.read_bytes(), path.name)) is None


@pytest.mark.parametrize(
    ("instrument", "test"),
    [
        ("Discovery HR 20", "shear"),
        ("Discovery HR30", "shear"),
        ("AresG2", "shear"),
        ("ARG2", "shear"),
        ("AR 2000", "shear"),
        ("RSA-G2", "tension"),
        ("Discovery DMA850", "tension"),
        ("something new", None),
    ],
)
def test_the_instrument_says_how_the_specimen_is_strained(instrument: str, test: str | None) -> None:
    steps = exports.sweeps(("Temperature", "Angular frequency", "Storage modulus", "Loss modulus"), ("°C", "rad/s", "Pa", "Pa"))
    for text in (exports.trios(steps, instrument=instrument), exports.trios_lims(steps, instrument=instrument)):
        assert {exported.deformation for exported in read(text.encode())} == {test}


def test_a_step_s_own_clock_comes_first() -> None:
    step = Step("Stress relaxation", ("Time", "Step time", "Relaxation modulus"), ("s", "s", "Pa"), [[100.0, 1.0, 5.0]])
    (exported,) = read(exports.trios([step]).encode())
    assert columns_by_role(exported.table) == {"time": 2, "modulus": 3}


def test_every_unit_of_the_vendors_is_known() -> None:
    for names in NAMES.values():
        for role, (_, unit, scale) in names.items():
            if role not in NOT_A_ROLE and unit != "1/s":
                assert conversion(unit or "-", ROLES[role])[0] == pytest.approx(scale, rel=1e-12)


def test_a_row_that_breaks_off_before_a_common_column_lacks_cells_only() -> None:
    text = "#FORMAT:;NETZSCH5\n##Temp./°C;E'(1.0 Hz)/MPa;E''(1.0 Hz)/MPa;Time/min\n20;2\n20;2;1;3\n"
    assert read(text.encode("latin-1"))[0].table.cells[1] == ["", "3"]
