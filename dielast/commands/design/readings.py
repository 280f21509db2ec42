"""What `dielast validate` reads and checks for a design."""

from __future__ import annotations

from functools import partial

from dielast.commands.design.run import prepared
from dielast.commands.simulation.readings import checked_readings

readings = partial(checked_readings, prepared)
