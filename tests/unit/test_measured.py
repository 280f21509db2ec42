"""Tables as laboratories write them, and those of results."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st

from dielast.base.errors import InputError
from dielast.base.units import (
    ANGULAR_FREQUENCY,
    FREQUENCY,
    STRAIN,
    STRESS,
    TEMPERATURE,
    TIME,
)
from dielast.io.cells import TextFormat, is_number
from dielast.io.table import Column, number_columns, parse_csv, split_header, stacked_table, to_csv
from dielast.io.text_table import MeasuredTable, read_measured

HEADER_ALONE = "no columns of numbers found: there are no rows below the header"
DATA = [(0.1, 2.5), (1.0, 2.0), (10.5, 1.25)]


def read(text: str, encoding: str = "utf-8", **form: Any) -> MeasuredTable:
    return read_measured(text.encode(encoding), "dma.csv", TextFormat(**form))


def numbers(table: MeasuredTable) -> list[tuple[float, float]]:
    return list(zip(table.column("time", "time", TIME), table.column("E", "modulus", STRESS), strict=True))


def as_si() -> list[tuple[float, float]]:
    return [(time, modulus * 1e6) for time, modulus in DATA]


@pytest.mark.parametrize(("separator", "decimal"), [(",", "."), (";", "."), ("\t", "."), (";", ","), ("\t", ",")])
@pytest.mark.parametrize(("newline", "encoding"), [("\n", "utf-8"), ("\r\n", "utf-8-sig"), ("\n", "utf-16"), ("\r\n", "latin-1")])
@pytest.mark.parametrize(
    "header",
    [
        "time [s]{0}E [MPa]",
        "time (s){0}E (MPa)",
        "time / s{0}E / MPa",
        "time in s{0}E in MPa",
        "time{0}E\ns{0}MPa",
        "Time (total){0}E (storage)\ns{0}MPa",
        "TIME{0}e\n[s]{0}[MPa]",
    ],
)
def test_what_laboratories_write_is_read(separator: str, newline: str, encoding: str, header: str, decimal: str) -> None:
    rows = [separator.join(str(cell).replace(".", decimal) for cell in row) for row in DATA]
    lines = ["Operator: Jörg" if encoding != "utf-8" else "", *header.format(separator).split("\n"), *rows, ""]
    text = newline.join(lines)
    assert numbers(read_measured(text.encode(encoding), "dma.csv")) == as_si()


def test_quoted_cells_may_hold_the_separator() -> None:
    table = read('"time [s]","E, storage [MPa]"\n1,2\n')
    assert table.names == ("time", "E, storage")
    assert numbers(read('time [s],E [MPa]\n"0,1","2,5"\n1,2\n"10,5","1,25"\n')) == as_si()
    with pytest.raises(InputError, match='"1,000" is not a finite number'):  # most likely a thousand
        numbers(read('time [s],E [MPa]\n1,"1,000"\n2,"1,100"\n'))


@pytest.mark.parametrize("name", ["strain", "strain (nominal)", "L / L0", "eps [nominal]", "dL / L (t)", "strain [%]"])
def test_what_is_no_unit_above_a_row_of_units_is_a_part_of_the_name(name: str) -> None:
    table = read(f"t,{name}\ns,%\n0,1\n2,4\n")
    assert table.column(name, "strain", STRAIN).tolist() == [0.01, 0.04]


def test_a_dash_in_the_row_of_units_says_no_unit() -> None:
    table = read("f,T,Set\nHz,C,-\n1,20,0\n2,21,0\n")
    assert table.column("T", "temperature", TEMPERATURE).tolist() == [20, 21]
    assert table.units == ("Hz", "C", "-")


def test_numbers_without_a_header_are_columns_by_number() -> None:
    table = read_measured(b"1 2\n3 4\n", "bare.txt", units={"time": "s"})
    assert table.column(1, "time", TIME).tolist() == [1, 3]
    with pytest.raises(InputError, match="column 3 is wanted for time, but there are 2 columns"):
        table.column(3, "time", TIME)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("time [s],E [MPa]\n1,2\n2,\n3,1\n", 'line 3: column "E": the cell is empty: write a number, or delete the row'),
        ("time [s],E [MPa]\n1,2\n2,nan\n3,inf\n", '"nan" is not a finite number (2 such cells): write a number, or delete'),
        (
            "time [s],E [MPa]\n1,2\ntime [s],E [MPa]\n3,4\n",
            'line 3: column "time": "time [s]" is not a finite number: delete the rows that',
        ),
        ("time [s];E [kPa]\n0,5;1.234\n1,5;999\n", 'line 2: column "E": "1.234" is not a finite number: the decimal mark is ","'),
        ('time [s],E [kPa]\n0.5,"1,234"\n', 'line 2: column "E": "1,234" is not a finite number: the decimal mark is "."'),
        ("time [s],E [kPa]\n00:01:00,1.5\n", 'line 2: column "time": "00:01:00" is not a finite number: write a time as a number'),
        ("T [C],time [s],E [MPa]\n20,1,\n20,2,3\n20,3,4\n", 'line 2: column "E": the cell is empty'),
        ("time [s],E [MPa]\n1,2\n1,2,3\n1,2\n", "line 3: 3 cells, but the table has 2 columns"),
        ("time,E [MPa]\n1,2\n", 'column "time" has no unit: call it "time [s]"'),
        ("time [s],E\nmin,MPa\n1,2\n", 'column "time" [s in the header and min in the row below it]'),
        ("time [kg],E [MPa]\n1,2\n", 'column "time" [kg]: a time is needed, such as "1.5 h"'),
        ("time [parsec],E [MPa]\n1,2\n", 'column "time" [parsec]: unknown unit "parsec"'),
        ("tiem [s],E [MPa]\n1,2\n", 'no column "time" for time; there are "tiem [s]", "E [MPa]"'),
        ("time [s],time [s],E [MPa]\n1,2,3\n", 'column "time" for time appears 2 times'),
        ("", "the file is empty"),
        (" \n\n", "the file is empty"),
        ("time [s],E [MPa]\n", HEADER_ALONE),
        ("time;E\ns;MPa\n", HEADER_ALONE),
        ("what is this\n", "no columns of numbers found; state separator"),
        ("a;b\nc;d\n", "no columns of numbers found; state separator"),
    ],
)
def test_wrong_tables_say_where(text: str, message: str) -> None:
    with pytest.raises(InputError) as caught:
        numbers(read(text))
    assert message in str(caught.value)
    assert str(caught.value).startswith("dma.csv: ")


def test_units_stated_twice_must_agree() -> None:
    table = read_measured(b"time [s],E [MPa]\n1,2\n", "dma.csv", units={"time": "min"})
    with pytest.raises(InputError, match=r"the unit is \[s\] in the header and \[min\] in the recipe's units"):
        table.column("time", "time", TIME)


@pytest.mark.parametrize(("encoding", "message"), [("klingon", "unknown encoding"), ("ascii", "is not ascii text")])
def test_a_stated_encoding_is_held_to(encoding: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        read_measured("zeit [s],Öl [MPa]\n1,2\n".encode(), "dma.csv", TextFormat(encoding=encoding))


# the first bytes of an old workbook are among the examples, and a workbook is read by a process of its own
@given(st.binary(max_size=400))
def test_any_bytes_are_a_table_or_an_input_error(content: bytes) -> None:
    message = "any.csv: "
    try:
        table = read_measured(content, "any.csv")
    except InputError as error:
        message = str(error)
    else:
        assert all(len(cells) == table.lines.size for cells in table.cells)
    assert message.startswith("any.csv: ")


def test_names_that_differ_in_case_alone_are_two_columns() -> None:
    table = read("T [degC],t [s],E [MPa]\n20,1,2\n")
    assert table.column("T", "temperature", TEMPERATURE).tolist() == [20]
    assert table.column("t", "time", TIME).tolist() == [1]
    assert table.column("e", "modulus", STRESS).tolist() == [2e6]


def test_a_header_of_another_width_than_the_rows_is_refused() -> None:
    with pytest.raises(InputError, match="the header has 3 cells, the rows have 2; quote cells"):
        read("time [s],load, static [N]\n1,2\n2,3\n")
    with pytest.raises(InputError, match="the header has 2 cells, the rows have 3"):
        read("time [s],E [MPa]\n1,1,2\n2,2,3\n")


@pytest.mark.parametrize("header", ["time [s],E [MPa]", "time [s],E [MPa],,", "time,E\ns,MPa"])
def test_rows_may_end_in_separators_that_the_header_does_not_have(header: str) -> None:
    table = read(f"{header}\n1,2,\n2,3,\n")
    assert table.column("time", "time", TIME).tolist() == [1, 2]
    assert table.column("E", "modulus", STRESS).tolist() == [2e6, 3e6]


def test_a_strain_without_a_unit_is_not_taken_as_a_fraction() -> None:
    from dielast.base.units import STRAIN

    with pytest.raises(InputError, match='column "strain" has no unit'):
        read("time [s],strain\n1,1\n2,1\n").column("strain", "strain", STRAIN)
    assert read("time [s],strain [%]\n1,1\n2,1\n").column("strain", "strain", STRAIN).tolist() == [0.01, 0.01]
    assert read("time [s],strain [-]\n1,1\n2,1\n").column("strain", "strain", STRAIN).tolist() == [1, 1]


def test_old_macintosh_line_ends_and_typeset_signs_are_read() -> None:
    table = read("T [ºC]\rtime [s]\rx".replace("\r", ",", 2) + " [N/mm²]\r\u22125,1,2\r\u22124,2,3\r")
    assert table.column("T", "temperature", TEMPERATURE).tolist() == [-5, -4]
    assert table.column("x", "modulus", STRESS).tolist() == [2e6, 3e6]


def test_utf_16_is_seen_without_its_mark() -> None:
    text = "\n".join(["Project:\tmodel", "time [s]\tE [MPa]", *(f"{k}\t{k}" for k in range(1, 40))])
    assert read_measured(text.encode("utf-16-le"), "dma.csv").column("time", "time", TIME)[:2].tolist() == [1, 2]


def test_the_recipe_may_settle_what_a_header_leaves_open() -> None:
    table = read_measured(b"w [1/s],E [Pa]\n1,2\n", "dma.csv", units={"frequency": "Hz"})
    assert table.column("w", "frequency", FREQUENCY).tolist() == [1]
    with pytest.raises(InputError, match=r'column "w" \[1/s\]: 1/s may mean'):
        table.column("w", "angular_frequency", ANGULAR_FREQUENCY)
    table = read_measured(b"w [rad/s],E [Pa]\n1,2\n", "dma.csv", units={"frequency": "Hz"})
    with pytest.raises(
        InputError, match=r"the unit is \[rad/s\] in the header and \[Hz\] in the recipe's units; leave the wrong one out"
    ):
        table.column("w", "frequency", FREQUENCY)


def test_a_number_too_large_for_its_unit_is_one_line() -> None:
    table = read_measured(b"t [s],E [GPa]\n1,2\n2,1e303\n", "x.csv")
    with pytest.raises(InputError, match=r'^x.csv: line 3: column "E": the number is too large$'):
        table.column("E", "modulus", STRESS)


@pytest.mark.parametrize("decimal", [".", ","])
def test_endless_digits_are_told_from_a_number_at_once(decimal: str) -> None:
    digits = "1" * 500_000  # with a pattern that can read them in two ways this takes hours
    assert is_number(digits, decimal)
    assert not is_number(digits + "x", decimal)
    for number in ("1", f"1{decimal}", f"{decimal}5", f"-1{decimal}5e-3", "+2E5"):
        assert is_number(number, decimal)
    for other in ("", decimal, "e5", "1e", f"1{decimal}{decimal}", "--1"):
        assert not is_number(other, decimal)


@pytest.mark.parametrize(
    ("header", "wanted"),
    [
        ("E (MPa)", ["E (MPa)", "E [MPa]", "E", "e (MPa)"]),
        ("E [MPa]", ["E (MPa)", "E [MPa]", "E"]),
        ("E / MPa", ["E / MPa", "E [MPa]", "E (MPa)", "E"]),
        ("# E (MPa)", ["E (MPa)", "E"]),
    ],
)
def test_a_column_may_be_called_as_its_header_is_spelled(header: str, wanted: list[str]) -> None:
    table = read(f"{header},time (min)\n2.5,1\n2,10\n")
    for name in wanted:
        assert table.column(name, "modulus", STRESS).tolist() == [2.5e6, 2e6], name
    assert table.column("time (min)", "time", TIME).tolist() == [60.0, 600.0]
    assert table.rows_where({"time (min)": 10}).tolist() == [False, True]


def test_the_spelling_tells_two_columns_of_one_name_apart() -> None:
    table = read("time (s),E (kPa),E [MPa]\n1,2,3\n")
    assert table.column("E (kPa)", "modulus", STRESS).tolist() == [2e3]
    assert table.column("E [MPa]", "modulus", STRESS).tolist() == [3e6]
    with pytest.raises(InputError, match=r'column "E" for modulus appears 2 times'):
        table.find("E", "modulus")


def test_a_ratio_is_called_by_its_first_part_and_contradicting_units_are_of_one_column_alone() -> None:
    table = read("time (s),A / A0,T (C),load (N)\ns,%,degC,kN\n1,120,20,7\n2,130,20,7\n")
    assert [table.find(name, "area_strain") for name in ("A / A0", "A/A0", "A")] == [1, 1, 1]
    assert table.units == ("s", "%", "degC", "N in the header and kN in the row below it")


def test_written_numbers_are_read_back() -> None:
    values = np.random.default_rng(3).lognormal(0, 50, 200)
    (back,) = number_columns(to_csv([Column("x", "Pa", values)]), "x.csv", ["x [Pa]"])
    np.testing.assert_allclose(back, values, rtol=5e-9)


def test_no_text_is_a_formula() -> None:
    formulas = ["=1+1", "@SUM(A1)", "+2", "-2+3+cmd|' /C calc'!A0", "-A1", "--1"]
    text = ["-5 %/s", "-40 degC", "-20 °C", "-1e-05", "-0.1 1/s", "a=b", "a-b"]
    read = parse_csv(to_csv([Column("rate", None, formulas + text)]), "x.csv")["rate"]
    assert read == [f"'{formula}" for formula in formulas] + text


def test_a_column_of_several_cases_is_a_sequence() -> None:
    parts = [np.array([1.0, 2.0]), np.empty(0), np.array([3.0, 4.0, 5.0])]
    values = stacked_table({case: {"time [s]": part} for case, part in enumerate(parts)}, ["time [s]"])[-1].values
    whole = [1.0, 2.0, 3.0, 4.0, 5.0]
    assert list(values) == whole
    assert [values[row] for row in range(-5, 5)] == whole + whole
    for rows in (slice(1, 3), slice(2, 2), slice(4, 1), slice(None, None, 2), slice(None, None, -1), slice(9, None)):
        assert list(values[rows]) == whole[rows]
    for beyond in (5, -6):
        with pytest.raises(IndexError):
            values[beyond]


def test_columns_of_different_length_are_a_bug() -> None:
    with pytest.raises(ValueError, match="differ in length"):
        to_csv([Column("a", "1", np.zeros(2)), Column("b", "1", np.zeros(3))])


def test_a_number_column_names_the_row_that_is_wrong() -> None:
    with pytest.raises(InputError, match=r'x.csv: row 3: column "a \[1\]": "b" is not a number'):
        number_columns(b"a [1]\n1\nb\n", "x.csv", ["a [1]"])
    with pytest.raises(InputError, match='column "c" is missing'):
        number_columns(b"a [1]\n1\n", "x.csv", ["c"])


@pytest.mark.parametrize("name", ["tan(delta)", "tan(d)", "Tan (δ)", "E(t)", "G'(omega)", "E''(f)"])
def test_the_argument_of_a_function_is_not_a_unit(name: str) -> None:
    assert split_header(name) == (name, None)
    assert split_header(f"{name} [Pa]") == (name, "Pa")
    assert split_header(f"{name} (Pa)") == (name, "Pa")
