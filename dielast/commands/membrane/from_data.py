"""The recipes of `relax` and `creep` for given tables."""

from dielast.commands.simulation.from_data import follow

from_data = follow
