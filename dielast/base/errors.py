"""What can go wrong: the errors and the warning of dielast, and how their messages read.

Bad input raises `InputError`, numerics that give up raise `NumericsError`, and input or results that are doubtful but
possible are reported as `DielastWarning`. A predicted failure of the film is none of these: it is a value in a result.

Every error holds its place as data, a `Problem` for each thing found wrong. Whoever knows more about the place of an error than
the function that raises it adds that with `placed`: a command turns arguments of the library into keys of its recipe.
"""

import re
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path
from typing import Any, Self, TypedDict, TypeVar, Unpack

LONGEST = 1000  # characters of a message: more than any that is meant to be read
_ENDLESS = re.compile(r"\S{300,}")
_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")
_SHOWN = 60  # characters of a value, and more than enough entries of a list
_WORD = 3  # characters that a word has at least
_DEEPEST = 9  # lists and tables within each other


class Where(TypedDict, total=False):
    """The fields of a `Problem` that say where it is."""

    file: str | Path | None
    line: int | None
    row: int | None
    case: int | None
    step: int | None
    argument: str | None
    key: str | None
    mentions: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Problem:
    """One thing that is wrong or doubtful: `text` says what, the other fields say where; a field that does not apply is None.

    `file` is a file, folder or address, `line` and `row` (from 1) lead into it. `case` and `step` (from 0) are those of a
    simulation, `argument` is that of a function of the library and `key` that of a recipe. `mentions` are further arguments that
    the text names.
    """

    text: str
    file: str | Path | None = None
    line: int | None = None
    row: int | None = None
    case: int | None = None
    step: int | None = None
    argument: str | None = None
    key: str | None = None
    mentions: tuple[str, ...] = ()

    def __str__(self) -> str:
        """The message: `file: line: step: case: key: text`, or the argument where there is no key."""
        numbered = {"line": self.line, "row": self.row, "step": self.step, "case": self.case}
        places = [self.file, *(f"{name} {number}" for name, number in numbered.items() if number is not None)]
        return _one_line(": ".join(str(part) for part in [*places, self.key or self.argument, self.text] if part))

    def at(self, **place: Unpack[Where]) -> Self:
        """The same with those parts of the `place` that are not known yet."""
        unknown: dict[str, Any] = {name: value for name, value in place.items() if getattr(self, name) is None}
        return replace(self, **unknown)

    def adding(self, more: str) -> Self:
        """The same with `more` behind its text."""
        return replace(self, text=self.text + more)

    def within(self, **place: Unpack[Where]) -> Self:
        """The problem as one of something that leads to it, such as the key of a recipe that names the file with a mistake."""
        return type(self)(str(self), **place)

    def in_keys(self, keys: Mapping[str, str]) -> Self:
        """The same for a reader of a recipe: `keys` maps arguments of the library to keys."""
        text = self.text
        for name in self.mentions:
            text = text.replace(name, keys.get(name, name))
        known = self.key or keys.get(self.argument or "")
        return replace(self, text=text, key=known, mentions=())


Change = Callable[[Problem], Problem]
Made = TypeVar("Made")
_CHANGES: ContextVar[tuple[Change, ...]] = ContextVar("_CHANGES", default=())


class DielastError(Exception):
    """Base of every error that dielast raises on purpose; `problems` holds each thing found wrong, `messages` a line for each."""

    def __init__(self, *problems: str | Problem, **place: Unpack[Where]) -> None:
        self.problems = tuple(problem if isinstance(problem, Problem) else Problem(problem, **place) for problem in problems)
        super().__init__("\n".join(self.messages))

    @property
    def messages(self) -> tuple[str, ...]:
        """A line for each thing found wrong."""
        return tuple(map(str, self.problems))

    def changed(self, change: Change) -> Self:
        """The same error with each problem changed."""
        return type(self)(*map(change, self.problems))

    def at(self, **place: Unpack[Where]) -> Self:
        """The same error with those parts of the `place` that its problems do not know yet."""
        return self.changed(lambda problem: problem.at(**place))

    def adding(self, more: str) -> Self:
        """The same error with `more` behind the text of each problem."""
        return self.changed(lambda problem: problem.adding(more))

    def __reduce__(self) -> tuple[type[Self], tuple[Problem, ...]]:
        """Pickling support."""
        return type(self), self.problems


class InputError(DielastError, ValueError):
    """A recipe, a table, a material or an argument is wrong (exit code 2)."""


class NumericsError(DielastError):
    """The numerics gave up on a problem that was well posed (exit code 3)."""


class Mistakes(list[Problem]):
    """Problems of several attempts, which are reported together."""

    def tried(self, make: Callable[[], Made]) -> Made | None:
        """What `make` returns; None where it raises `InputError`, whose problems are then among these."""
        try:
            return make()
        except InputError as error:
            self += error.problems
            return None

    def refuse(self) -> None:
        """Raise `InputError` with all problems, each once, if there are any."""
        if self:
            raise InputError(*dict.fromkeys(self))


class DielastWarning(UserWarning):
    """A result stands, but not as firmly as its digits suggest."""


def warn(text: str, **place: Unpack[Where]) -> None:
    """Issue a `DielastWarning`; the command line prints it and puts it into the summary."""
    problem = Problem(text, **place)
    for change in reversed(_CHANGES.get()):
        problem = change(problem)
    warnings.warn(str(problem), DielastWarning, stacklevel=3)


def messages_of(record: Iterable[warnings.WarningMessage]) -> list[str]:
    """The warnings of dielast in a record of `warnings.catch_warnings`, each once."""
    return list(dict.fromkeys(str(entry.message) for entry in record if issubclass(entry.category, DielastWarning)))


@contextmanager
def without_warnings() -> Iterator[None]:
    """No `DielastWarning` comes from within the block, which repeats what has been warned of, or is not about a user's data."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DielastWarning)
        yield


@contextmanager
def placed(change: Change) -> Iterator[None]:
    """Errors and warnings from within the block have their problems changed, as a rule to say more about the place."""
    token = _CHANGES.set((*_CHANGES.get(), change))
    try:
        yield
    except DielastError as error:
        raise error.changed(change) from None
    finally:
        _CHANGES.reset(token)


@contextmanager
def reached_by(key: str) -> Iterator[None]:
    """Errors from within the block name the `key` of the recipe that leads to the file with the mistake; a mistake without a file
    keeps its own key of the recipe.
    """
    try:
        yield
    except DielastError as error:
        raise error.changed(lambda problem: problem.within(key=key) if problem.file or not problem.key else problem) from None


def located(**place: Unpack[Where]) -> AbstractContextManager[None]:
    """Errors and warnings from within the block have those parts of the `place` that are not known yet."""
    return placed(lambda problem: problem.at(**place))


def in_keys(keys: Mapping[str, str]) -> AbstractContextManager[None]:
    """Errors and warnings from within the block name keys of a recipe; `keys` holds the key of each argument of the library."""
    return placed(lambda problem: problem.in_keys(keys))


def in_a_draw(**place: Unpack[Where]) -> AbstractContextManager[None]:
    """Errors from within the block begin with "in a draw"; `place` is where draws are requested."""
    # the case is then the number of a draw, which means nothing to the user
    return placed(lambda problem: Problem(f"in a draw: {replace(problem, case=None)}", **place))


def nearest(wrong: object, names: Iterable[str]) -> str:
    """Advice for a `wrong` name: the nearest of the `names`, whatever its case, spaces and underscores; or the name of which it is
    one word; or else all names.
    """
    known = list(names)
    near = similar(wrong, known)
    return f"one of {', '.join(known)} is needed" if near is None else f'did you mean "{near}"?'


def similar(wrong: object, names: Iterable[str]) -> str | None:
    """The one of the `names` that is probably meant by a `wrong` one, whatever its case, blanks, dashes and underscores; None if
    none is.

    At most a third of its characters are other ones, or it begins like the wrong name, or has all its words.
    """
    plain = _plain(wrong)
    words, ranked = set(plain.split()), list[tuple[float, int, int, str]]()
    for order, name in enumerate(names):
        other = _plain(name)
        length, short = max(len(plain), len(other), 1), min(len(plain), len(other))
        changes = _changes(plain, other) if 3 * (length - short) <= length <= _SHOWN else 0 if plain == other else length
        others = set(other.split())
        if changes == 0 or (length >= _WORD and changes <= max(1, length // 3)):
            ranked.append((changes / length, -len(other), order, name))
        elif short >= _WORD and (plain.startswith(other) or other.startswith(plain) or words <= others or others <= words):
            ranked.append((1 + (length - short) / length, -len(other), order, name))
    return min(ranked)[-1] if ranked else None


def _plain(name: object) -> str:
    """A name without case, and with blanks in the place of dashes and underscores."""
    return " ".join(str(name).casefold().replace("_", " ").replace("-", " ").split())


def _changes(one: str, other: str) -> int:
    """How many characters differ: inserted, left out, replaced, or swapped with their neighbours (Damerau, CACM 7 (1964) 171)."""
    before, above = list[int](), list(range(len(other) + 1))
    for i, mine in enumerate(one):
        row = [i + 1]
        for j, theirs in enumerate(other):
            row.append(min(above[j + 1] + 1, row[j] + 1, above[j] + (mine != theirs)))
            if i and j and mine == other[j - 1] and one[i - 1] == theirs:
                row[-1] = min(row[-1], before[j - 1] + 1)
        before, above = above, row
    return above[-1]


def and_more(others: int, noun: str = "") -> str:
    """The end of a message about the first of several items: the number of `others`, with their `noun`; empty for no others."""
    return f" (and {others} more{noun and f' {noun}'})" if others > 0 else ""


def listed(names: Iterable[str], word: str = "or") -> str:
    """The names as a sentence lists them: a, b or c."""
    *first, last = names
    return f"{', '.join(first)} {word} {last}" if first else last


def shown(value: Any) -> str:
    """A value as an error message shows it: as TOML has it, in one line, cut if long."""
    text = _printable(as_toml(value, _SHOWN))
    return text if len(text) <= _SHOWN else text[: _SHOWN - 3] + "..."


def shown_path(keys: Iterable[str]) -> str:
    """A path of keys as TOML has it: dotted, in quotes what is no bare key."""
    return ".".join(key if _BARE_KEY.fullmatch(key) else quoted(key) for key in keys)


def quoted(text: str) -> str:
    """Text in quotes as TOML has it: double ones, or single ones if something in it would have to be escaped."""
    if text.isprintable() and not {'"', "\\"} & {*text}:
        return f'"{text}"'
    if text.isprintable() and "'" not in text:
        return f"'{text}'"
    import json  # slow to import

    return json.dumps(text, ensure_ascii=False)


def as_toml(value: Any, entries: int | None = None, depth: int = _DEEPEST) -> str:
    """A value as TOML has it: of lists and tables so many `entries`, and of those within each other down to a `depth`."""
    match value:
        case str():
            return quoted(value)
        case bool():
            return str(value).lower()
        case list() | tuple() | dict() if depth == 0:
            return "..."
        case list() | tuple():
            return f"[{', '.join(as_toml(entry, entries, depth - 1) for entry in value[:entries])}]"
        case dict():
            first = islice(value.items(), entries)
            pairs = (f"{shown_path([str(key)])} = {as_toml(entry, entries, depth - 1)}" for key, entry in first)
            return f"{{ {', '.join(pairs)} }}" if value else "{}"
    return str(value)


def _one_line(message: str) -> str:
    """The message without line breaks and control characters that came from a file, and without endless words."""
    line = _ENDLESS.sub(lambda word: word[0][:200] + "..." + word[0][-60:], _printable(message))
    return line if len(line) <= LONGEST else line[: LONGEST - 3] + "..."


def _printable(text: str) -> str:
    return text if text.isprintable() else "".join(mark if mark.isprintable() else ascii(mark)[1:-1] for mark in text)
