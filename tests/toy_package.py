"""A package that adds to every registry of dielast by entry points, built and installed by `install`."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

PROJECT = """\
[build-system]
requires = ["setuptools"]
build-backend = "setuptools.build_meta"
[project]
name = "toy-laws"
version = "1.2"
[tool.setuptools]
packages = ["toylaws", "toylaws.squares"]
package-data = {{ "toylaws.squares" = ["starters/*.toml"] }}
{points}
"""
POINTS = {
    "springs": 'varga = "toylaws.laws:Varga"\nraises = "toylaws.more:Raises"\nshapeless = "toylaws.more:Shapeless"',
    "shift": 'linear = "toylaws.laws:Linear"',
    "dielectric": 'cooling = "toylaws.laws:Cooling"',
    "breakdown": 'power-of-prestretch = "toylaws.laws:Power"',
    "damage": 'twice = "toylaws.more:Twice"',
    "criteria": 'wide = "toylaws.more:WIDE"',
    "instruments": 'toymeter = "toylaws.toymeter:TOYMETER"',
    "cards": 'plain = "toylaws.more:PLAIN"',
    "commands": 'squares = "toylaws.squares:SQUARES"\nhollow = "toylaws.more:nothing"',
}
BROKEN = {
    "springs": 'absent = "toylaws.absent:Law"\nwrong = "toylaws.laws:Linear"\nother = "toylaws.laws:Varga"\n'
    'leaves = "toylaws.leaves:Law"',
}
MORE = '''
from typing import ClassVar

import numpy as np

from dielast.handover.export.code import Code
from dielast.material.damage import InversePower
from dielast.mechanics.criteria.criterion import Criterion
from toylaws.laws import Varga


class Twice(InversePower):
    """Damage twice as fast."""

    __slots__ = ()
    name: ClassVar = "twice"
    title: ClassVar = "twice"

    def rate(self, field):
        return 2 * super().rate(field)


class Raises(Varga):
    """A law that fails in use."""

    __slots__ = ()
    name: ClassVar = "raises"

    def tangent(self, squared_stretch):
        raise ZeroDivisionError("division\\nby zero")


class Shapeless(Varga):
    """A law whose stress has a wrong shape."""

    __slots__ = ()
    name: ClassVar = "shapeless"

    def tangent(self, squared_stretch):
        return np.zeros(7), np.zeros((3, 7))


class Wide(Criterion):
    """An area of more than 3.7 times that of the undeformed film."""

    name = "wide"
    marker = "P"
    hatch = "++"

    def signal(self, films):
        return lambda moment: np.log(3.7) - 0.5 * moment.log_area


WIDE = Wide()


def files(card):
    return {"material.txt": "\\n".join(f"{g!r} {tau!r}" for g, tau in card.branches) + "\\n"}


PLAIN = Code("plain", {"gent": lambda spring, card: []}, {"linear": lambda law, card: []}, files, separate_limits=True, flows=True)
'''
METER = """
from dielast.readings.instruments.export import Export, Layout


def sniff(text):
    return text.startswith("TOYMETER")


def read(text, source):
    export = Export.of(text, source, ";")
    names, units = export.rows[1], export.rows[2]
    return [export.step("sweep", (names, units), [row for row in export.rows[3:] if row.has_number], deformation="tension")]


TOYMETER = Layout("Toymeter", sniff, read)
"""


def install(folder: Path, tests: Path) -> Path:
    """Build the package from a folder and install it into `folder`/site, which is returned."""
    source, site = folder / "source", folder / "site"
    package = source / "toylaws"
    (package / "squares/starters").mkdir(parents=True)
    groups = {group: f"{POINTS[group]}\n{BROKEN.get(group, '')}" for group in POINTS}
    points = "\n".join(f'[project.entry-points."dielast.{group}"]\n{lines}' for group, lines in groups.items())
    (source / "pyproject.toml").write_text(PROJECT.format(points=points))
    (package / "__init__.py").write_text("")
    (package / "laws.py").write_text((tests / "toys.py").read_text())
    (package / "more.py").write_text(MORE)
    (package / "leaves.py").write_text("raise SystemExit(7)\n")
    (package / "toymeter.py").write_text(METER)
    command = {"__init__.py": SQUARES, "recipe.py": RECIPE, "run.py": RUN}
    for name, text in command.items():
        (package / "squares" / name).write_text(text)
    for name in ("squares.toml", "squares.short.toml"):
        (package / "squares/starters" / name).write_text('kind = "squares"\nnumbers = [1.0, 2.0, 3.0]\n')
    pip = [sys.executable, "-m", "pip", "install", "--no-index", "--no-deps", "--no-build-isolation", "--quiet"]
    subprocess.run([*pip, "--target", site, source], check=True, capture_output=True, text=True, cwd=folder)
    return site


SQUARES = """
from dielast.commands.command import Command

SQUARES = Command("squares", __name__, "Numbers -> their squares.", "Numbers -> squares.", ("squares.csv",))
"""
RECIPE = '''
from typing import Literal

from pydantic import Field

from dielast.recipe.base import RecipeBase


class SquaresRecipe(RecipeBase):
    """Numbers -> their squares."""

    kind: Literal["squares"] = Field(description="The subcommand that runs this recipe.")
    numbers: list[float] = Field(description="The numbers.")
'''
RUN = """
import numpy as np
from matplotlib.figure import Figure

from dielast.io.table import Column
from dielast.report.report import RunReport


def run(cases, inputs, execution):
    x = np.array(cases[0].recipe.numbers)
    return RunReport({"squares.csv": [Column("x", "1", x), Column("square", "1", x**2)]}, {"squares": {"n": x.size}}, Figure)


def prepared(cases, inputs):
    return None
"""
