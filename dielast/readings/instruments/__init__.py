"""Exports of instruments, recognised by their content and divided into steps; units and names come from the file.

A format is a module with a `NAME`, `sniff(text)` and `read(text, source) -> list[ExportedStep]`, entered in `FORMATS`. `sniff`
looks for features that no hand-made table has, so that an ordinary table is never taken as an export.
"""

from typing import Protocol

from dielast.readings.instruments import (
    eplexor,
    proteus,
    reptate,
    rheocompass,
    rheology_advantage,
    rheoplus,
    trios,
    universal_analysis,
)
from dielast.readings.instruments.export import ExportedStep

__all__ = ["FORMATS", "ExportedStep", "Format", "recognise"]


class Format(Protocol):
    """The layout of the exports of one instrument software."""

    @property
    def NAME(self) -> str:
        """The name in the summary."""

    def sniff(self, text: str, /) -> object:
        """A true value if `text` is in this layout, complete or not."""

    def read(self, text: str, source: str) -> list[ExportedStep]:
        """The steps in `text`, in their order; raises `InputError` with `source` and the line."""


FORMATS: tuple[Format, ...] = (trios, rheocompass, rheoplus, universal_analysis, rheology_advantage, proteus, eplexor, reptate)


def recognise(text: str) -> Format | None:
    """The format of `text`, None if it is not an export."""
    return next((layout for layout in FORMATS if layout.sniff(text)), None)
