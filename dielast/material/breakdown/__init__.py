"""The breakdown laws, one module each."""

from __future__ import annotations

from dielast.material.breakdown.power import PowerBreakdown
from dielast.material.breakdown.table import Breakdown
from dielast.material.law import BreakdownLaw, Registry

__all__ = ["BREAKDOWNS", "Breakdown", "BreakdownLaw", "PowerBreakdown"]

BREAKDOWNS: Registry[type[BreakdownLaw]] = Registry("breakdown law", Breakdown, PowerBreakdown)
