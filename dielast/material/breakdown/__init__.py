"""The breakdown laws, one module each."""

from dielast.material.breakdown.power import PowerBreakdown as PowerBreakdown
from dielast.material.breakdown.table import Breakdown as Breakdown
from dielast.material.law import BreakdownLaw as BreakdownLaw
from dielast.registry import Registry

BREAKDOWNS: Registry[type[BreakdownLaw]] = Registry(
    "breakdown law",
    Breakdown,
    PowerBreakdown,
    group="dielast.breakdown",
    base=BreakdownLaw,
)
