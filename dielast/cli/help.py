"""The help of the commands that run recipes: a short recipe, where to find the keys, exit codes; and messages about wrong usage."""

import re
import sys
import textwrap
from typing import Any

from typer import BadParameter
from typer.core import TyperCommand

from dielast.base.errors import nearest
from dielast.commands.registry import COMMANDS

UsageError: Any = BadParameter.__base__  # typer imports it from click, or defines it itself

# messages of typer and click -> messages of recipes
_PLAIN = {
    r"Input should be greater than or equal to (\S+)$|[^ ]+ is not in the range x>=(\S+)$": r"at least \1\2 is needed",
    r"Input should be a valid integer.*|\S+ is not a valid integer$": "a whole number is needed",
    r"Input should be a valid number.*|\S+ is not a valid float$": "a number is needed",
}
EXIT_CODES = """\
Exit codes: 0 done (a predicted failure of the film is a result), 2 bad usage,
recipe or data, 3 the numerics gave up, 4 golden mismatch, 130 interrupted
(129 by SIGHUP, 143 by SIGTERM), 1 a bug."""
START = """\
To begin:
  dielast new mastercurve > relaxation.toml   a recipe that runs as it is
  dielast mastercurve relaxation.toml         results in the folder relaxation
  dielast mastercurve --help                  options, and a short recipe
"""


class PlainUsage(TyperCommand):
    """A command whose usage line shows the arguments by name."""

    def format_usage(self, ctx: Any, formatter: Any) -> None:
        """Write the usage line: names of arguments, then options."""
        arguments = [str(parameter.metavar) for parameter in self.params if parameter.param_type_name == "argument"]
        formatter.write_usage(ctx.command_path, " ".join([*arguments, "[OPTIONS]"]))


class RecipeCommand(PlainUsage):
    """A command that runs recipes; its name is their kind."""

    def format_epilog(self, ctx: Any, formatter: Any) -> None:
        """Write a short recipe of this kind, and where to find more."""
        kind = str(self.name)
        recipe = textwrap.indent(COMMANDS[kind].short_recipe(), "  ")
        pointers = {
            f"dielast new {kind} > my.toml": "a longer recipe, with comments",
            f"dielast {kind} my.toml -o out": "run it, with results in the folder out",
            "dielast validate my.toml": "check it and the files it names",
            "dielast schema > dielast.json": "every key with its meaning, for editors",
        }
        width = max(map(len, pointers))
        listed_pointers = "".join(f"  {command:{width}}   {meaning}\n" for command, meaning in pointers.items())
        formatter.write(f"\nA short recipe, which runs as it is:\n\n{recipe}\n{listed_pointers}\n{EXIT_CODES}\n")


def report_usage(error: Any) -> int:
    """Print in one line what is wrong with a command; for a command without arguments, print its help."""
    command = error.ctx.command_path if error.ctx is not None else "dielast"
    if type(error).__name__ == "NoArgsIsHelpError":
        error.show()
    else:
        wrong = " ".join(error.format_message().replace("Value error, ", "").split()).rstrip(".")
        for pattern, words in _PLAIN.items():
            wrong = re.sub(pattern, words, wrong)
        if unknown := re.match(r"No such command '(.*?)'", wrong):
            wrong = f'no command "{unknown[1]}": {nearest(unknown[1], (*COMMANDS, "new", "validate", "report", "schema"))}'
        print(f"{command}: {wrong[:1].lower()}{wrong[1:]} (see {command} --help)", file=sys.stderr)
    return int(error.exit_code)
