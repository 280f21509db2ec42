"""What `dielast validate` reads and checks for `relax` and `creep`."""

from __future__ import annotations

from functools import partial

from dielast.commands.membrane.run import prepared
from dielast.commands.simulation.readings import checked_readings

readings = partial(checked_readings, prepared)
