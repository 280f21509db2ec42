"""What `dielast validate` reads for `actuate`: the files of every case."""

from dielast.commands.simulation.readings import simulation_readings as readings

__all__ = ["readings"]
