"""The base of all results: a short description in a notebook, and tables with the columns of the result files."""

import textwrap
from collections.abc import Mapping
from dataclasses import fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dielast.io.table import Frame, Table, to_frame

WIDTH, LINES = 100, 3  # of a description
LONGEST = 60  # characters of the description of a result within another
UNBROKEN = "\N{NO-BREAK SPACE}"
FEW = 3  # values; an array or list with no more is shown as a whole


class Result:
    """A dataclass whose description has at most three lines: of an array, its shape, and its first and last value."""

    __slots__ = ()

    def described(self) -> Mapping[str, Any]:
        """What the description lists: the fields by name."""
        return {field.name: getattr(self, field.name) for field in fields(self) if field.repr}  # type: ignore[arg-type]

    def __repr__(self) -> str:
        parts = [f"{name}={_short(value)}" for name, value in self.described().items()]
        parts = [part.replace(" ", UNBROKEN) for part in parts]
        text = f"{type(self).__name__}({', '.join(parts)})"
        wrap = textwrap.TextWrapper(WIDTH, subsequent_indent="    ", max_lines=LINES, placeholder=" ...)", break_on_hyphens=False)
        return "\n".join(wrap.wrap(text)).replace(UNBROKEN, " ")


class TabularResult(Result):
    """A result that is a table, both in Python and in its file."""

    __slots__ = ()

    def columns(self) -> Table:
        """The columns of the table, as in the file."""
        raise NotImplementedError

    def to_frame(self) -> Frame:
        """The table as a pandas data frame, with the column names of the files: `name [unit]`."""
        return to_frame(self.columns())


def freeze(result: Result, arrays: Mapping[str, NDArray[np.float64]]) -> None:
    """Set fields of a frozen result to these `arrays`, made read-only; for `__post_init__`."""
    for name, values in arrays.items():
        values.flags.writeable = False
        object.__setattr__(result, name, values)


def _short(value: Any) -> str:
    if isinstance(value, np.ndarray) and value.size > FEW:
        shape = " x ".join(map(str, value.shape))
        return f"<{shape}: {_short(value.flat[0])} ... {_short(value.flat[-1])}>"
    if isinstance(value, np.ndarray):
        value = value.ravel().tolist()
    if isinstance(value, list | tuple | dict):
        text = f"[{', '.join(map(_short, value))}]" if len(value) <= FEW else ""
        return text if 0 < len(text) <= LONGEST else f"<{len(value)}>"
    if isinstance(value, float | np.floating):
        return f"{float(value):.5g}"
    text = str(value) if isinstance(value, np.generic) else repr(value)
    return text if len(text) <= LONGEST else f"<{type(value).__name__}>"
