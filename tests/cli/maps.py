"""The recipe of a failure map that tests change to their needs."""

from __future__ import annotations

MAP = """
kind = "failure-map"
material = "example:vhb4905.toml"
temperature = ["20 degC", "40 degC"]
horizon = "1 h"
[film]
thickness = "0.5 mm"
prestretch = [1.7, 1.8, 1.9]
relax = "10 min"
[voltage]
from = "1 kV"
to = "5 kV"
points = 9
[breakdown]
field = "45 MV/m"
"""


def map_of(points: int, horizon: str = "10 s") -> str:
    """With so many voltages, for two temperatures and three prestretches."""
    return MAP.replace("points = 9", f"points = {points}").replace('"1 h"', f'"{horizon}"')
