"""What README.md and the pages of the guide show, taken from real runs: the output of commands, tables, and the list of keys.

`python tests/cli/readme.py --write [FILE...]` brings README.md, the pages of recipes/guide and recipes/KEYS.md up to date, or only
the files named; without --write it prints which differ. The blocks of a page run in order, in a folder that only they use.
"""

from __future__ import annotations

import contextlib
import inspect
import io
import os
import pty
import re
import shlex
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

from typer.main import get_command

from dielast.cli.app import application
from dielast.commands.registry import COMMANDS
from dielast.commands.simulation.recipe import SimulationRecipe
from dielast.handover.material_file import material_file

ROOT = Path(__file__).resolve().parents[2]
sys.path.append(str(ROOT / "tests"))
from keys import Key, keys  # noqa: E402
from processes import DIELAST  # noqa: E402

README = ROOT / "README.md"
GUIDE = ROOT / "recipes/guide"
PAGES = (README, *sorted(GUIDE.glob("*.md")))
KEYS = ROOT / "recipes/KEYS.md"
INTRODUCTION = """\
# Keys

Every key of a recipe and of a material file; `tests/cli/readme.py` writes this page from the models that check them. Anything
with a dimension is text with its unit, such as `"2.5 kV"`; bare numbers are dimensionless. A path is relative to the file that
states it; `example:NAME` is a file that ships with dielast. `step[].rate` is the key `rate` of each `[[step]]`; a key can be set
from the command line by its path and number, `--set step.0.rate='0.1 /s'`. Entries of a recipe are counted from 0 everywhere, in
keys, messages, figures and tables: the first `[[step]]` is `step.0` in a sweep and `step[0]` in a message, the first case is 0.
Columns, sheets and steps of an instrument's export have the numbers that a spreadsheet shows, from 1; cycles as well.
"""
_BLOCK = re.compile(r"(?<=```console\n).*?(?=```)", re.DOTALL)
_RECIPE = re.compile(r"```toml\n# (\S+\.toml)\n(.*?)```", re.DOTALL)
_PYTHON = re.compile(r"(```python\n(.*?)```\n\nprints\n\n```text\n).*?(?=```)", re.DOTALL)
_CONTROL = re.compile(r"\x1b\[[0-9;?]*[A-Za-z]")
_TABLE = re.compile(r"(<!-- (commands|options) -->\n).*?(?=<!-- end -->)", re.DOTALL)


def steps(block: str) -> list[tuple[str, list[str]]]:
    """(command, lines of output) of a console block."""
    found: list[tuple[str, list[str]]] = []
    for line in block.splitlines():
        if line.startswith("$ "):
            found.append((line[2:], []))
        else:
            found[-1][1].append(line)
    return found


def session(text: str) -> list[tuple[str, list[str]]]:
    """The commands of every console block of a page and their output, in order."""
    return [step for block in _BLOCK.findall(text) for step in steps(block)]


def python_blocks(text: str) -> list[tuple[str, str]]:
    """(code, what it prints) of every block of Python of a page."""
    return re.findall(r"```python\n(.*?)```\n\nprints\n\n```text\n(.*?)```", text, re.DOTALL)


class Terminal:
    """Runs commands in `folder` as the reader of a page does, on a terminal of 80 columns beside a checkout.

    The folder holds the files that the page's `text` shows with their name in the first line. `dielast` is the program of that
    name and its first arguments.
    """

    def __init__(self, folder: Path, text: str, dielast: Sequence[str] = DIELAST) -> None:
        self.folder = folder
        launcher = folder / ".bin" / "dielast"
        launcher.parent.mkdir()
        launcher.write_text(f'#!/bin/sh\nexec {shlex.join(dielast)} "$@"\n')
        launcher.chmod(0o755)
        (folder / "dielast").symlink_to(ROOT / "dielast")
        for name, content in _RECIPE.findall(text):
            (folder / name).write_text(content)
        path = f"{launcher.parent}:{os.environ['PATH']}"
        own = {"PATH": path, "COLUMNS": "80", "TERM": "xterm", "LC_ALL": "C.UTF-8"}
        self.environment = {**os.environ, **own, "PYTHONPATH": str(ROOT)}

    def run(self, command: str) -> list[str]:
        """The lines that a command shows: standard output as on a terminal, then standard error."""
        ours, theirs = pty.openpty()
        with tempfile.TemporaryFile() as errors:
            child = subprocess.Popen(
                command, shell=True, cwd=self.folder, env=self.environment, stdin=subprocess.DEVNULL, stdout=theirs, stderr=errors
            )
            os.close(theirs)
            shown = b"".join(_received(ours))
            os.close(ours)
            child.wait(timeout=600)
            errors.seek(0)
            shown += errors.read()
        if child.returncode not in (0, 2):
            raise RuntimeError(f"{command}: exit code {child.returncode}: {shown.decode()}")
        return [line.rstrip() for line in _CONTROL.sub("", shown.decode()).splitlines()]


def _received(terminal: int) -> Iterator[bytes]:
    """What arrives at a terminal until nobody writes to it any more."""
    while True:
        try:
            piece = os.read(terminal, 65536)
        except OSError:
            return
        if not piece:
            return
        yield piece


def real_blocks(text: str) -> Iterator[str]:
    """Every console block of a page with the output that its commands have; make is not run."""
    with tempfile.TemporaryDirectory() as folder:
        terminal = Terminal(Path(folder), text)
        for block in _BLOCK.findall(text):
            lines = []
            for command, shown in steps(block):
                lines += [f"$ {command}", *(shown if command.startswith("make") else terminal.run(command))]
            yield "\n".join(lines) + "\n"


def printed(code: str) -> str:
    """What a block of Python prints."""
    with contextlib.redirect_stdout(io.StringIO()) as output:
        exec(compile(code, "page", "exec"), {})
    return output.getvalue()


def command_table() -> str:
    """Every command and what it does."""
    rows = ["| command | what it does |", "|---|---|"]
    for name, command in get_command(application()).commands.items():
        arguments = "".join(f" {each.metavar}" for each in command.params if each.param_type_name == "argument")
        text = " ".join(inspect.cleandoc(command.help or "").split("\n\n")[0].split())
        rows.append(f"| `dielast {name}{arguments}` | {text.rstrip('.')} |")
    return "\n".join(rows) + "\n"


def option_table() -> str:
    """Every option of the commands that run recipes."""
    rows = ["| option | meaning |", "|---|---|"]
    for option in get_command(application()).commands["actuate"].params:
        if option.param_type_name == "option" and not getattr(option, "hidden", False):
            value = f" {option.metavar}" if option.metavar else ""
            rows.append(f"| `{', '.join(option.opts)}{value}` | {option.help.rstrip('.')} |")
    return "\n".join(rows) + "\n"


def keys_page() -> str:
    """Every key of every recipe and of material files."""
    common = keys(SimulationRecipe)
    sections = [INTRODUCTION]
    for kind, command in COMMANDS.items():
        model = command.model
        shared = {key.path for key in common if key.path != "title"} if issubclass(model, SimulationRecipe) else set()
        own = [key for key in keys(model) if key.path not in shared]
        more = "\nAnd [the keys of every simulation](#relax-creep-and-actuate).\n" if shared else ""
        sections.append(f"## {kind}\n\n{inspect.getdoc(model)}\n\n{_rows(own)}{more}")
    sections.append("## relax, creep and actuate\n\n" + _rows([key for key in common if key.path not in ("title", "kind")]))
    sections.append(f"## Material file\n\n{inspect.getdoc(material_file())}\n\n{_rows(keys(material_file()))}")
    return "\n".join(sections)


def _rows(own: list[Key]) -> str:
    rows = ["| key | takes | default | meaning |", "|---|---|---|---|"]
    for key in own:
        default = key.default if key.default in ("", "needed") else f"`{key.default}`"
        path = f"**`{key.path}`**" if key.takes in ("table", "tables") else f"`{key.path}`"
        rows.append(f"| {path} | {key.takes} | {default} | {key.meaning} |")
    return "\n".join(rows) + "\n"


def tables(text: str) -> str:
    """A page with its tables as they should be."""
    made = {"commands": command_table, "options": option_table}
    return _TABLE.sub(lambda match: match[1] + made[match[2]](), text)


def page(text: str) -> str:
    """A page with its tables and all output as they should be."""
    blocks = real_blocks(text)
    text = tables(_BLOCK.sub(lambda match: next(blocks), text))
    return _PYTHON.sub(lambda match: match[1] + printed(match[2]), text)


def main() -> None:
    write = "--write" in sys.argv[1:]
    wanted = {Path(name).resolve() for name in sys.argv[1:] if name != "--write"} or {*PAGES, KEYS}
    for path in (*PAGES, KEYS):
        if path not in wanted:
            continue
        content = keys_page() if path == KEYS else page(path.read_text())
        if not path.exists() or path.read_text() != content:
            print(f"{path.relative_to(ROOT)}: {'written' if write else 'differs'}")
            if write:
                path.write_text(content)


if __name__ == "__main__":
    main()
