"""The registry of the subcommands that run recipes: one line for each subcommand."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dielast.commands.command import Command
from dielast.registry import adopt, opened

if TYPE_CHECKING:
    from dielast.recipe.cases import Case


class Commands(Mapping[str, Command]):
    """The commands by name, in the order of a workflow; a command is imported on first use."""

    def __init__(self) -> None:
        self._homes: dict[str, str | Command] = {}
        opened("dielast.commands", Command, lambda command: self.register(command.name, command))

    def register(self, name: str, home: str | Command) -> None:
        """Add a command, or where it is, stated as `package:ATTRIBUTE`."""
        self._homes[name] = home

    def __getitem__(self, name: str) -> Command:
        home = self._homes[name]
        if isinstance(home, Command):
            return home
        package, attribute = home.split(":")
        command: Command = getattr(import_module(package), attribute)
        return command

    def __iter__(self) -> Iterator[str]:
        return iter(self._homes)

    def __len__(self) -> int:
        return len(self._homes)

    def __contains__(self, name: object) -> bool:
        return name in self._homes or adopt(name, "dielast.commands")


COMMANDS = Commands()
COMMANDS.register("mastercurve", "dielast.commands.mastercurve:MASTERCURVE")
COMMANDS.register("measure", "dielast.commands.measure:MEASURE")
COMMANDS.register("spectrum", "dielast.commands.spectrum:SPECTRUM")
COMMANDS.register("calibrate", "dielast.commands.calibrate:CALIBRATE")
COMMANDS.register("relax", "dielast.commands.membrane:RELAX")
COMMANDS.register("creep", "dielast.commands.membrane:CREEP")
COMMANDS.register("actuate", "dielast.commands.actuate:ACTUATE")
COMMANDS.register("failure-map", "dielast.commands.failure_map:FAILURE_MAP")
COMMANDS.register("lifetime", "dielast.commands.lifetime:LIFETIME")
COMMANDS.register("design", "dielast.commands.design:DESIGN")


def read_cases(
    path: Path, kind: str | None = None, overrides: Sequence[str] = (), content: bytes | None = None
) -> tuple[Case[Any], ...]:
    """The cases of the recipe in the file `path`, see `dielast.recipe.cases.read_cases`."""
    from dielast.recipe import cases

    return cases.read_cases(COMMANDS, path, kind, overrides, content)


def others_in(folder: Path, kind: str) -> list[str]:
    """Other commands with results in the `folder`, whose summary a run of this `kind` replaces."""
    files = {path.name for path in folder.iterdir() if path.suffix and path.is_file()}
    foreign = {name for name in files if not name.startswith((f"{kind}.", "summary.")) and name not in COMMANDS[kind].files}
    if not foreign:  # usually: avoid importing other commands
        return []
    others = {other: command for other, command in COMMANDS.items() if other != kind}
    makers = [[other for other, command in others.items() if name in command.files] for name in foreign]
    return [other for other in others if [other] in makers]
