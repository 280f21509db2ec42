"""A subcommand as an object: its name, texts, files and modules."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_args

from dielast.base.errors import InputError

if TYPE_CHECKING:
    from dielast.io.files import Inputs
    from dielast.readings.seen import Given
    from dielast.recipe.base import RecipeBase
    from dielast.recipe.cases import Case
    from dielast.recipe.lines import RecipeLines
    from dielast.report.report import RunReport
    from dielast.sharing.execution import Execution

Run = Callable[[Sequence["Case[Any]"], "Inputs", "Execution"], "RunReport"]
"""Computes the cases of a recipe."""
Prepared = Callable[[Sequence["Case[Any]"], "Inputs"], object]
"""Reads and checks all of the cases that can be known before anything is solved."""


@dataclass(frozen=True, slots=True)
class Command:
    """A subcommand, which runs the recipes whose `kind` is its name.

    Its `package` holds

    - `recipe.py` with the recipe's model, whose `kind` is the command's name,
    - `run.py`, or another `module`, with the functions `run`, of type `Run`, and `prepared`, of type `Prepared`, with which a run
      begins, and which is all that `dielast validate` does,
    - `from_data.py` with the function `from_data(name, given)`, which writes the recipe for given files, if it takes any,
    - `starters/NAME.toml` and `starters/NAME.short.toml`, the recipes that `dielast new` and the help print.

    None of these is imported before it is needed.
    """

    name: str
    package: str
    help: str
    """What the command does."""
    short_help: str
    """The help in the list of commands, at most 61 characters."""
    files: tuple[str, ...]
    """Every file that the command may write, besides its figures and its summary."""
    can_share: bool = False
    """Whether several processes or a cluster can share the work."""
    module: str = "run"
    """The module of the package that runs it."""

    @property
    def model(self) -> type[RecipeBase]:
        """The model of its recipes."""
        for value in vars(import_module(f"{self.package}.recipe")).values():
            kind = getattr(value, "model_fields", {}).get("kind")
            if kind is not None and get_args(kind.annotation) == (self.name,):
                model: type[RecipeBase] = value
                return model
        raise LookupError(f"{self.package}.recipe has no recipe of the kind {self.name}")

    @property
    def run(self) -> Run:
        """The function that computes the cases of a recipe."""
        run: Run = import_module(f"{self.package}.{self.module}").run
        return run

    @property
    def prepared(self) -> Prepared:
        """What a run does with its cases and the files that they name before it solves anything."""
        module = f"{self.package}.{self.module}"
        prepared: Prepared | None = getattr(import_module(module), "prepared", None)
        if prepared is None:
            raise InputError(f"{self.name} cannot be validated: {module} needs a function prepared")
        return prepared

    def from_data(self, given: Given) -> RecipeLines:
        """The recipe for `given` files, as far as they are recognised; raises `InputError` for files that it does not take."""
        if not self.takes_data:
            raise InputError(f"{self.name} takes no measured data: dielast new {self.name}")
        lines: RecipeLines = import_module(f"{self.package}.from_data").from_data(self.name, given)
        return lines

    @property
    def takes_data(self) -> bool:
        """Whether its recipes name measured files."""
        return find_spec(f"{self.package}.from_data") is not None

    def starter(self) -> str:
        """A commented recipe that runs as it is."""
        return self._text(f"{self.name}.toml")

    def short_recipe(self) -> str:
        """The shortest useful recipe."""
        return self._text(f"{self.name}.short.toml")

    def _text(self, name: str) -> str:
        # importlib.resources would double the time of a help page
        return (Path(import_module(self.package).__path__[0]) / "starters" / name).read_text(encoding="utf-8")
