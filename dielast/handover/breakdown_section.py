"""The table that states a breakdown law, in material files and in recipes alike."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dielast.handover.law_section import LawSection, law_section
from dielast.material.breakdown import BREAKDOWNS, BreakdownLaw


class BreakdownSection(LawSection):
    """Breakdown field: one for all prestretches, a table over prestretch, or a law over the present stretch and thickness."""


def breakdown_section() -> type[BreakdownSection]:
    """The table with the keys of the laws that are registered at present."""
    return law_section(BreakdownSection, BREAKDOWNS, "table", law="Law of the breakdown field. Default: table.")


def breakdown(section: BreakdownSection | None) -> BreakdownLaw | None:
    """The law of the breakdown field; None if none is stated."""
    if section is None:
        return None
    law: BreakdownLaw = section.stated()
    return law


if TYPE_CHECKING:
    BreakdownField = BreakdownSection
else:
    BreakdownField = breakdown_section()
