"""The breakdown laws, one module each."""

from __future__ import annotations

from dielast.material.breakdown.law import BreakdownLaw
from dielast.material.breakdown.power import PowerBreakdown
from dielast.material.breakdown.table import Breakdown
from dielast.material.law import Registry

__all__ = ["BREAKDOWNS", "Breakdown", "BreakdownLaw", "PowerBreakdown"]

BREAKDOWNS: Registry[type[BreakdownLaw]] = Registry("breakdown law")
BREAKDOWNS.register(Breakdown)
BREAKDOWNS.register(PowerBreakdown)
