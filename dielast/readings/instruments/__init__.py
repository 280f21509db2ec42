"""Exports of instruments, recognised by their content and divided into steps; units and names come from the file.

A format is a `Layout`, entered in `FORMATS`. Its `sniff` looks for features that no hand-made table has, so that an ordinary table
is never taken as an export.
"""

from dielast.base.registry import INSTRUMENTS, adopt_all, opened
from dielast.readings.instruments.anton_paar import RHEOCOMPASS, RHEOPLUS
from dielast.readings.instruments.export import ExportedStep, Layout
from dielast.readings.instruments.netzsch import EPLEXOR, PROTEUS
from dielast.readings.instruments.reptate import REPTATE
from dielast.readings.instruments.ta_instruments import RHEOLOGY_ADVANTAGE, TRIOS, UNIVERSAL_ANALYSIS

__all__ = ["FORMATS", "ExportedStep", "Layout", "recognise"]


FORMATS: list[Layout] = [TRIOS, RHEOCOMPASS, RHEOPLUS, UNIVERSAL_ANALYSIS, RHEOLOGY_ADVANTAGE, PROTEUS, EPLEXOR, REPTATE]
opened(INSTRUMENTS, Layout, FORMATS.append)


def recognise(text: str) -> Layout | None:
    """The format of `text`, None if it is not an export."""
    found = next((layout for layout in FORMATS if layout.sniff(text)), None)
    if found is None:
        known = len(FORMATS)
        adopt_all(INSTRUMENTS)
        found = next((layout for layout in FORMATS[known:] if layout.sniff(text)), None)
    return found
