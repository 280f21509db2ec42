"""Exports of instruments, recognised by their content and divided into steps; units and names come from the file.

A format is a module with a `NAME`, `sniff(text) -> bool` and `read(text, source) -> list[ExportedStep]`, entered in `FORMATS`.
Sniffing looks for marks that no table made by hand has, so that an ordinary table is never taken for an export.
"""

from __future__ import annotations

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
from dielast.readings.instruments.step import ExportedStep

__all__ = ["FORMATS", "ExportedStep", "Format", "recognise"]


class Format(Protocol):
    """One vendor's layout."""

    @property
    def NAME(self) -> str:
        """What the summary calls it."""
        ...

    def sniff(self, text: str) -> bool:
        """Whether `text` is in this layout, damaged or not."""
        ...

    def read(self, text: str, source: str) -> list[ExportedStep]:
        """The steps in `text`, in their order; raises `InputError` naming `source` and the line."""
        ...


FORMATS: tuple[Format, ...] = (trios, rheocompass, rheoplus, universal_analysis, rheology_advantage, proteus, eplexor, reptate)


def recognise(text: str) -> Format | None:
    """The format that `text` is in, None for anything else."""
    return next((known for known in FORMATS if known.sniff(text)), None)
