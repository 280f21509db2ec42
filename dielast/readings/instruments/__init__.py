"""Exports of instruments, recognised by their content and divided into steps; units and names come from the file.

A format is a module with a `NAME`, `sniff(text)` and `read(text, source) -> list[ExportedStep]`, entered in `FORMATS`. `sniff`
looks for features that no hand-made table has, so that an ordinary table is never taken as an export.
"""

from typing import Protocol, runtime_checkable

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
from dielast.registry import INSTRUMENTS, adopt_all, opened

__all__ = ["FORMATS", "ExportedStep", "Format", "recognise"]


@runtime_checkable
class Format(Protocol):
    """The layout of the exports of one instrument software."""

    @property
    def NAME(self) -> str:
        """The name in the summary."""

    def sniff(self, text: str, /) -> object:
        """A true value if `text` is in this layout, complete or not."""

    def read(self, text: str, source: str) -> list[ExportedStep]:
        """The steps in `text`, in their order; raises `InputError` with `source` and the line."""


FORMATS: list[Format] = [trios, rheocompass, rheoplus, universal_analysis, rheology_advantage, proteus, eplexor, reptate]
opened(INSTRUMENTS, Format, FORMATS.append)


def recognise(text: str) -> Format | None:
    """The format of `text`, None if it is not an export."""
    found = next((layout for layout in FORMATS if layout.sniff(text)), None)
    if found is None:
        known = len(FORMATS)
        adopt_all(INSTRUMENTS)
        found = next((layout for layout in FORMATS[known:] if layout.sniff(text)), None)
    return found
