from __future__ import annotations

import numpy as np
import pytest

from dielast.base.errors import InputError
from dielast.io.table import Column, number_columns, parse_csv, split_header, stacked_table, to_csv

TABLE = [Column("time", "s", np.array([0.1, 1 / 3, -0.0, np.nan])), Column("mode", None, ["none", "a, b", 'say "x"', ""])]


def test_csv_has_nine_digits_no_minus_zero_and_empty_cells_for_nan() -> None:
    assert to_csv(TABLE).decode() == 'time [s],mode\n0.1,none\n0.333333333,"a, b"\n0,"say ""x"""\n,\n'


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
