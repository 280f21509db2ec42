"""Registries of laws, criteria, formats, codes and commands by name, to which installed packages add by entry points.

A package names an object in a group of `GROUPS` (`importlib.metadata`), under the name that recipes and files use:

    [project.entry-points."dielast.springs"]
    varga = "my_package.varga:Varga"

It is loaded when that name is wanted and is not one of dielast's, or, for exports of instruments, when no format of dielast fits.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from importlib import import_module
from pathlib import Path
from traceback import walk_tb
from typing import TYPE_CHECKING, Any, ClassVar, Generic, TypeVar

from dielast.base.errors import InputError, nearest, shown, warn

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

Entry = TypeVar("Entry", bound=Any)
GROUPS = tuple(
    f"dielast.{family}"
    for family in ("springs", "shift", "dielectric", "breakdown", "damage", "criteria", "instruments", "cards", "commands")
)
"""The groups of entry points."""
_SECTIONS = {"equilibrium": "springs", "nonequilibrium": "springs"} | {
    family: family for family in ("shift", "dielectric", "breakdown", "damage")
}
INSTRUMENTS = "dielast.instruments"
_REGISTRIES: dict[str, tuple[type, Callable[[Any], object]]] = {}
_ADOPTED: dict[tuple[str, str], str] = {}
_MODULES: dict[tuple[str, str], str] = {}  # outermost, of what was loaded


def opened(group: str, base: type, register: Callable[[Any], object]) -> None:
    """Open a registry to the packages of a `group`: they name instances or subclasses of `base`, which `register` takes."""
    _REGISTRIES[group] = base, register


def adopt(name: object, group: str | None = None) -> bool:
    """Load what installed packages name so, in one group or in those whose registry is in use; returns whether there is anything.

    Raises `InputError` with one line for a package that is broken, and for a name that two packages have.
    """
    found = False
    for point_group, point in _points() if isinstance(name, str) and name else ():
        if point.name != name or point_group != (group or point_group) or point_group not in _REGISTRIES:
            continue
        found = True
        package = _package(point)
        other = _ADOPTED.setdefault((point_group, point.name), package)
        if other != package:
            raise InputError(f"{shown(name)} is of two packages, {other} and {package}: remove one of them")
        _register(point_group, point, package)
    return found


def adopt_all(group: str) -> None:
    """Load all that installed packages name in a group; warns of a package that is broken, which is left out."""
    for name in sorted({point.name for point_group, point in _points() if point_group == group}):
        if (group, name) not in _ADOPTED:
            try:
                adopt(name, group)
            except InputError as error:
                warn(f"{error}: left out")


def adopt_laws(values: Mapping[str, Any]) -> None:
    """Load the laws of installed packages that the tables of a recipe or a material file state."""
    for section, table in values.items():
        law, family = table.get("law") if isinstance(table, Mapping) else None, _SECTIONS.get(section)
        if isinstance(law, str) and family is not None:
            import_module(f"dielast.material.{family}")  # its registry, before the models whose keys are those of its laws
            _ = law in Registry.families[f"dielast.{family}"]


def adopted() -> list[tuple[str, str, str]]:
    """Group, name and package with its version, of all that was loaded from installed packages."""
    return [(group, name, package) for (group, name), package in sorted(_ADOPTED.items())]


def blame(error: BaseException) -> str:
    """A line about an error that nobody foresaw, if the code of installed packages is in use: the last of it that ran, or else all
    whose values went into the computation, which those of instruments do not.

    Empty if there is none.
    """
    text = " ".join(str(error).split()) or "no message"
    frames = [frame for frame, _ in walk_tb(error.__traceback__)]
    theirs = [frame for frame in frames if _outermost(frame.f_globals) in _MODULES.values()]
    for frame in theirs[-1:]:
        name = getattr(frame.f_locals.get("self"), "name", None)
        keys = [key for key, module in _MODULES.items() if module == _outermost(frame.f_globals)]
        group, known = next((key for key in keys if key[1] == name), keys[0])
        place = f"{Path(frame.f_code.co_filename).name}:{frame.f_lineno}"
        return f"{_ADOPTED[group, known]}: {known} of {group}: {type(error).__name__}: {text} ({place})"
    used = [f"{package}: {name} of {group}" for group, name, package in adopted() if group != INSTRUMENTS]
    what = "what it gives" if len(used) == 1 else "what one of these gives"
    return f"{', '.join(used)}: perhaps {what} cannot be used: {type(error).__name__}: {text}" if used else ""


def _outermost(names: Mapping[str, Any]) -> str:
    return str(names.get("__name__", "")).partition(".")[0]


def _points() -> list[tuple[str, EntryPoint]]:
    return _points_on(tuple(sys.path))


@cache
def _points_on(_path: tuple[str, ...]) -> list[tuple[str, EntryPoint]]:
    """What is found on a path of imports: the files of every installed package are read, which takes tens of milliseconds."""
    from importlib.metadata import entry_points  # pydantic has imported it where recipes are read

    points = entry_points()
    return [(group, point) for group in GROUPS for point in points.select(group=group)]


def _package(point: EntryPoint) -> str:
    return f"{point.dist.name} {point.dist.version}" if point.dist is not None else point.value


def _register(group: str, point: EntryPoint, package: str) -> None:
    base, register = _REGISTRIES[group]
    where = f"{package}: entry point {point.name} of {group}"
    try:
        thing = point.load()
    except (Exception, SystemExit) as error:  # whatever the package raises
        del _ADOPTED[group, point.name]
        text = " ".join(str(error).split()) or "no message"
        raise InputError(f"{where}: {point.value} cannot be loaded: {type(error).__name__}: {text}") from None
    called = getattr(thing, "name", None)
    fits = isinstance(thing, base) or (group != INSTRUMENTS and isinstance(thing, type) and issubclass(thing, base))
    if not fits or (group != INSTRUMENTS and called != point.name):
        del _ADOPTED[group, point.name]
        wrong = f"it is called {shown(called)}" if fits else f"a {base.__name__} is needed"
        raise InputError(f"{where}: {point.value}: {wrong}")
    _MODULES[group, point.name] = point.value.partition(":")[0].partition(".")[0]
    register(thing)


class Registry(Generic[Entry]):
    """The entries of one `kind`, by name and in the order of registration; packages may add those of a `group`, see `opened`."""

    families: ClassVar[dict[str, Registry[Any]]] = {}
    """The registries by group."""

    def __init__(self, kind: str, *entries: Entry, group: str = "", base: type = object) -> None:
        self.kind, self.group = kind, group
        self._entries: dict[str, Entry] = {entry.name: entry for entry in entries}
        if group:
            self.families[group] = self
            opened(group, base, self.register)

    def register(self, entry: Entry) -> Entry:
        """Add an entry under its name; also a decorator of a class."""
        self._entries[entry.name] = entry
        return entry

    def __getitem__(self, name: str) -> Entry:
        if name not in self:
            raise InputError(f"{shown(name)}: {self.kind}: {nearest(name, self._entries)}")
        return self._entries[name]

    def __contains__(self, name: object) -> bool:
        return name in self._entries or (bool(self.group) and adopt(name, self.group))

    def __iter__(self) -> Iterator[Entry]:
        return iter(self._entries.values())

    @property
    def names(self) -> tuple[str, ...]:
        """The names of all entries that are loaded."""
        return tuple(self._entries)
