"""The help of the commands that run recipes: a recipe to start from, where to find the keys, what the exit codes mean; and what
is said to whoever uses them wrongly.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any

from typer import BadParameter
from typer.core import TyperCommand

from dielast.recipe.models import KINDS, or_kind

UsageError: Any = BadParameter.__base__  # which typer has from click, or as its own

# how typer and click say it -> how recipes have it
_PLAIN = {
    r"Input should be greater than or equal to (\S+)$|[^ ]+ is not in the range x>=(\S+)$": r"at least \1\2 is needed",
    r"Input should be a valid integer.*|\S+ is not a valid integer$": "a whole number is needed",
    r"Input should be a valid number.*|\S+ is not a valid float$": "a number is needed",
}
EXIT_CODES = """\
Exit codes: 0 done (a predicted failure of the film is a result), 2 bad usage,
recipe or data, 3 the numerics gave up, 4 golden mismatch, 130 interrupted,
1 a bug."""
START = """\
To begin:
  dielast new mastercurve > relaxation.toml   a recipe that runs as it is
  dielast mastercurve relaxation.toml         results in the folder relaxation
  dielast mastercurve --help                  options, and a short recipe
"""


class Command(TyperCommand):
    """A command whose usage reads as a user types it."""

    def format_usage(self, ctx: Any, formatter: Any) -> None:
        """Write the usage: arguments by their names, then options."""
        arguments = [str(each.metavar) for each in self.params if each.param_type_name == "argument"]
        formatter.write_usage(ctx.command_path, " ".join([*arguments, "[OPTIONS]"]))


class RecipeCommand(Command):
    """A command that runs recipes of the kind it is named after."""

    def format_epilog(self, ctx: Any, formatter: Any) -> None:
        """Write a short recipe of this kind, and what else there is to know."""
        kind = str(self.name)
        formatter.write(
            f"\nA short recipe, which runs as it is:\n\n{indented(short_recipe(kind))}\n{_pointers(kind)}\n{EXIT_CODES}\n"
        )


def tell_usage(error: Any) -> int:
    """Tell in one line what is wrong with a command, or all there is to know to whoever typed no more than its name."""
    command = error.ctx.command_path if error.ctx is not None else "dielast"
    if type(error).__name__ == "NoArgsIsHelpError":
        error.show()
    else:
        found = " ".join(error.format_message().replace("Value error, ", "").split()).rstrip(".")
        for pattern, words in _PLAIN.items():
            found = re.sub(pattern, words, found)
        if wrong := re.match(r"No such command '(.*?)'", found):
            found = f'no command "{wrong[1]}": {or_kind(wrong[1], ("new", "validate", "schema"))}'
        elif found == "Missing argument 'KIND'":
            found = f"a kind is needed: {', '.join(KINDS)}"
        print(f"{command}: {found[:1].lower()}{found[1:]} (see {command} --help)", file=sys.stderr)
    return int(error.exit_code)


def short_recipe(kind: str) -> str:
    """The shortest useful recipe of `kind`."""
    # importlib.resources takes as long to load as all else that a help page needs
    return (Path(__file__).parents[1] / "starters" / f"{kind}.short.toml").read_text(encoding="utf-8")


def indented(text: str) -> str:
    """The text, each line two blanks in."""
    return "".join(f"  {line}" if line.strip() else line for line in text.splitlines(keepends=True))


def _pointers(kind: str) -> str:
    lines = {
        f"dielast new {kind} > my.toml": "a longer recipe, with comments",
        f"dielast {kind} my.toml -o out": "run it, with results in the folder out",
        "dielast validate my.toml": "check it and the files it names",
        "dielast schema > dielast.json": "every key with its meaning, for editors",
    }
    width = max(map(len, lines))
    return "".join(f"  {command:{width}}   {meaning}\n" for command, meaning in lines.items())
