"""The columns of a result as recipes name them."""

from __future__ import annotations

import difflib
from typing import Annotated

from pydantic import AfterValidator, ValidationInfo

from dielast.errors import InputError, shown_path
from dielast.io.table import split_header
from dielast.recipe.fields import on_one_scale
from dielast.recipe.paths import read_path

COLUMNS = (
    "time [s]",
    "stretch_1 [1]",
    "stretch_2 [1]",
    *(f"{what}_stress_{axis} [Pa]" for what in ("nominal", "true") for axis in (1, 2)),
)
# columns of comparisons and plots only: the axes of the electrode as a camera measures them
MAJOR_AXIS, MINOR_AXIS = "major_axis [m]", "minor_axis [m]"

# column of the result -> columns of a testing machine that measure the same
_MEASURED_AS = {
    "time [s]": {"time"},
    "stretch_1 [1]": {"stretch", "strain", "extension"},
    "nominal_stress_1 [Pa]": {"stress", "force"},
}


def roles_of(header: str) -> set[str]:
    """The columns of a testing machine that a column of the result may be compared with."""
    return _MEASURED_AS.get(header, set())


def _column(header: str, info: ValidationInfo) -> str:
    """A column of the result; the model of the recipe lists them as `COLUMNS`."""
    known = (info.context or {}).get("columns")
    if known and header not in known:
        near = [column for column in known if split_header(column)[0] == split_header(header)[0]]
        near = near or difflib.get_close_matches(header, known, n=1, cutoff=0.8)
        hint = f'did you mean "{near[0]}"?' if near else "there are " + ", ".join(known)
        raise InputError(f'"{header}" is no column of the result; {hint}')
    return header


def _abscissa(header: str, info: ValidationInfo) -> str:
    """A column of the result, or a swept key in one spelling."""
    swept = (info.context or {}).get("swept", {})
    key = shown_path(read_path(header) or (header,))
    if key in swept:
        values = swept[key]
        if isinstance(values, list) and on_one_scale(values) is None:
            raise InputError(f"the values of {key} are on no scale: numbers, or quantities of one kind, are needed")
        return key
    try:
        return _column(header, info)
    except InputError as error:
        raise error.adding(f"; swept are {', '.join(swept)}" if swept else "") from None


ResultColumn = Annotated[str, AfterValidator(_column)]
Abscissa = Annotated[str, AfterValidator(_abscissa)]
"""A column of the result, or a swept key."""
