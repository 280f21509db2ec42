"""A package that adds to every registry of dielast by entry points, installed by `install`."""

from __future__ import annotations

from pathlib import Path

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
    """Install the package into `folder`/site, which is returned, as an installer leaves it there."""
    site = folder / "site"
    package, told = site / "toylaws", site / "toy_laws-1.2.dist-info"
    (package / "squares/starters").mkdir(parents=True)
    told.mkdir()
    (told / "METADATA").write_text("Metadata-Version: 2.1\nName: toy-laws\nVersion: 1.2\n")
    groups = {group: f"{POINTS[group]}\n{BROKEN.get(group, '')}".replace('"', "") for group in POINTS}
    (told / "entry_points.txt").write_text("\n".join(f"[dielast.{group}]\n{lines}" for group, lines in groups.items()))
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
