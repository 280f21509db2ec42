"""The tables of mistakes: a valid recipe or material file, and its wrong variants, each with the messages that refuse it.

A table is a text file. It begins with the files of a folder that is in order. Every mistake is a change of the first of them:

    @@ file r.toml
    kind = "relax"
    ...
    @@ mistakes
    - a line of the file
    + what stands in its place; without a line that goes, at the end of the file
    > a line of the message that refuses it
      a line that stays, two blanks before it: what follows comes after it
    @@ in film.toml       the changes that follow, to the end of the mistake, are those of another file
    % a setting, as --set has it
    > a line of the message; one that ends in " ..." goes on with a list that grows
"""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from dielast.base.errors import DielastError
from dielast.cli.run import compute
from dielast.commands.plan import warnings_of
from dielast.commands.registry import read_cases
from dielast.sharing.execution import Execution

RECIPE = "r.toml"


@dataclass
class Mistake:
    """One mistake: its `changes` by file, in lines with their marks, settings of the command line, and messages."""

    changes: dict[str, list[str]] = field(default_factory=dict)
    overrides: list[str] = field(default_factory=list)
    messages: list[str] = field(default_factory=list)


def parse(text: str) -> tuple[dict[str, str], list[Mistake]]:
    """The files in order, and the mistakes."""
    head, _, rest = text.partition("@@ mistakes\n")
    sections = (section.partition("\n") for section in head.split("@@ file ")[1:])
    files = {name: content for name, _, content in sections}
    mistakes: list[Mistake] = []
    for line in rest.splitlines():
        mark, said = line[:2], line[2:]
        if mark == "> ":
            mistakes[-1].messages.append(said)
            continue
        if not mistakes or mistakes[-1].messages:
            mistakes.append(Mistake())
            file = next(iter(files))
        if mark == "% ":
            mistakes[-1].overrides.append(said)
        elif line.startswith("@@ in "):
            file = line.removeprefix("@@ in ")
        else:
            mistakes[-1].changes.setdefault(file, []).append(line)
    return files, mistakes


def written(files: dict[str, str], mistakes: list[Mistake]) -> str:
    """The text of a table."""
    lines = []
    for mistake in mistakes:
        for name, changes in mistake.changes.items():
            lines += [*([] if name == next(iter(files)) else [f"@@ in {name}"]), *changes]
        lines += [f"% {override}" for override in mistake.overrides] + [f"> {message}" for message in mistake.messages]
    return "".join(f"@@ file {name}\n{content}" for name, content in files.items()) + "@@ mistakes\n" + "\n".join(lines) + "\n"


def kept(said: list[str], found: list[str]) -> list[str]:
    """The messages that are found, those that were said to go on as they were said."""
    short = [old if old.endswith(" ...") and new.startswith(old[:-3]) else new for old, new in zip(said, found, strict=False)]
    return short + found[len(short) :]


def changed(content: str, changes: list[str]) -> str:
    """The file with the changes."""
    lines = content.splitlines()
    at: int | None = None
    for change in changes:
        mark, line = change[:2], change[2:]
        if mark == "+ ":
            at = len(lines) if at is None else at
            lines.insert(at, line)
            at += 1
        else:
            at = lines.index(line, at or 0) + (mark == "  ")
            if mark == "- ":
                del lines[at]
    return "".join(f"{line}\n" for line in lines)


def refusals(path: Path, overrides: list[str], runs: bool) -> Iterator[list[str]]:
    """The messages of all that refuse the file: `validate`, and the run of a recipe, which ends before anything is solved."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            if not overrides:
                warnings_of(path)
        except DielastError as error:
            yield list(error.messages)
        try:
            if runs and path.name == RECIPE:
                cases = read_cases(path, None, overrides)
                compute(cases[0].recipe.kind, cases, path, (), Execution())
        except DielastError as error:
            yield list(error.messages)


def found(files: dict[str, str], mistake: Mistake, folder: Path, runs: bool = True) -> list[list[str]]:
    """The messages for a mistake, of `validate` and, if it `runs`, of the run."""
    folder.mkdir()
    for name in {**files, **mistake.changes}:
        (folder / name).write_text(changed(files.get(name, ""), mistake.changes.get(name, [])), encoding="utf-8")
    there, before = sorted(folder.iterdir()), Path.cwd()
    os.chdir(folder)
    try:
        return list(refusals(Path(next(iter(files))), mistake.overrides, runs))
    finally:
        os.chdir(before)
        assert sorted(folder.iterdir()) == there
