"""What tests of results share: a film of material.toml, its scatter from film to film, and how tables are read."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

from dielast.io.table import number_columns, parse_csv

FILM = """
material = "material.toml"
[film]
thickness = "0.5 mm"
prestretch = 1.9
relax = "10 min"
"""
SCATTER = 'breakdown_field = { law = "weibull", shape = 20 }\nthickness = "2 %"\n'


def rows(path: Path) -> list[dict[str, str]]:
    """The rows of a table, cells by their headers."""
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def columns(path: Path) -> dict[str, np.ndarray]:
    """The numbers of a table by their headers."""
    content = path.read_bytes()
    headers = [header for header in parse_csv(content, path.name) if header not in ("event", "failure_mode", "reached")]
    return dict(zip(headers, number_columns(content, path.name, headers), strict=True))
