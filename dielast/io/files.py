"""Files read and written: inputs remembered with their SHA-256, outputs that appear whole or not at all."""

from __future__ import annotations

import contextlib
import hashlib
import os
import re
import time
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

from dielast.errors import InputError

LARGEST = 256 << 20  # bytes of a file that is read: more than ten million rows
LONGEST_WAIT = 5.0  # s until another process has moved its files; it takes milliseconds
EXAMPLE = "example:"
STORE = ".unfinished"
"""The file in which a long run keeps its cells until its result is written."""
KEPT = "what is solved is kept, and the same command goes on from there"
_TEMPORARY = re.compile(r"\.(?P<name>.+)\.(?P<process>\d+)\.part")


class Inputs:
    """Reads every input of a run once, and remembers what was read."""

    def __init__(self, folder: Path) -> None:
        """Paths that are not absolute are taken relative to `folder`, which holds the recipe."""
        self.folder = folder
        self.names: list[str] = []
        """The names of all inputs, also of those that could not be read."""
        self._digests: dict[tuple[str, str], None] = {}
        self._paths: list[Path] = []

    def read(self, name: str | Path) -> bytes:
        """The bytes of a file, or of an example that ships with dielast (`example:NAME`).

        Raises `InputError` if it cannot be read.
        """
        path = resolve(self.folder, name)
        self.names.append(str(name))
        content = read_file(path, str(name))
        # an absolute path belongs to this machine and has no place in a result
        shown = Path(name).name if Path(name).is_absolute() else str(name)
        self._digests[as_text(shown), sha256(content)] = None
        if path not in self._paths:
            self._paths.append(path)
        return content

    @property
    def digests(self) -> tuple[tuple[str, str], ...]:
        """The name that the recipe gives each file read (its last part, if that is an absolute path) and its SHA-256, in order."""
        return tuple(self._digests)

    @property
    def paths(self) -> tuple[Path, ...]:
        """Every file read, in the order of reading."""
        return tuple(self._paths)


def sha256(content: bytes) -> str:
    """The SHA-256 of a file's content, as hexadecimal digits."""
    return hashlib.sha256(content).hexdigest()


def resolve(folder: Path, name: str | Path) -> Path:
    """The path that `name` means in a recipe that lies in `folder`."""
    text = str(name)
    if text.startswith(EXAMPLE):
        root = Path(__file__).parents[1] / "examples"
        name, entries = text.removeprefix(EXAMPLE), sorted(root.iterdir())
        path = next((entry for entry in entries if entry.stem == name), root / name)  # vhb4905 is vhb4905.toml
        if not path.resolve().is_relative_to(root.resolve()) or not exists(path):
            known = ", ".join(f"{EXAMPLE}{entry.name}" for entry in entries)
            raise InputError(f"no such example; there are {known}", file=text)
        return path
    return folder / text


def read_file(path: Path, name: str) -> bytes:
    """The bytes of a file; raises `InputError` with its `name` if it cannot be read, or is larger than any table or recipe."""
    try:
        with path.open("rb") as file:
            content = file.read(LARGEST + 1)
    except (OSError, ValueError) as error:  # a name with a NUL in it is a ValueError
        raise InputError(_unreadable(path, error), file=name) from None
    if len(content) > LARGEST:
        raise InputError(f"larger than {LARGEST >> 20} MiB, which no table or recipe should be", file=name)
    return content


def as_text(name: str) -> str:
    """A file's name as text that any file can hold: bytes that are no UTF-8 as escapes."""
    return name.encode("utf-8", "backslashreplace").decode()


def exists(path: Path) -> bool:
    """Whether there is such a file or folder; False for a name that no file can have, such as a very long name."""
    try:
        return path.exists()
    except (OSError, ValueError):
        return False


def _unreadable(path: Path, error: OSError | ValueError) -> str:
    """Why `path` could not be read, in a few words."""
    if os.path.isdir(path):
        return "is a folder, a file is needed"
    reason = getattr(error, "strerror", None) or "cannot be read"
    return "no such file" if isinstance(error, FileNotFoundError) else reason.lower()


def check_targets(targets: Iterable[Path], inputs: Iterable[Path]) -> None:
    """Raise `InputError` if writing `targets` would overwrite one of the `inputs`, or if a folder is in the way."""
    read = {os.path.realpath(path) for path in inputs}
    for target in targets:
        if os.path.realpath(target) in read:
            raise InputError("is an input of this run; write the results to another folder (see --out)", file=target)
        if os.path.isdir(target):
            raise InputError("is a folder, a file is to be written there", file=target)


def check_folder(folder: Path, needed: str) -> None:
    """Raise `InputError` if it is plain without writing that nothing can be written into `folder`, which need not exist yet.

    `needed` says what a folder is needed for.
    """
    nearest = folder.absolute()
    while not os.path.lexists(nearest) and nearest.parent != nearest:
        nearest = nearest.parent
    if not os.path.isdir(nearest):
        obstacle = "is a file" if os.path.exists(nearest) else "leads nowhere"
        raise InputError(f"{obstacle}, a folder {needed}", file=folder)
    if not os.access(nearest, os.W_OK | os.X_OK):
        raise InputError("cannot write here: permission denied", file=folder)


def write_files(folder: Path, contents: Mapping[str, bytes]) -> None:
    """Write `contents` (name -> bytes) into `folder`, each file whole or not at all.

    All files are first written beside their targets, then moved into place together: a full disk leaves an older result as it was,
    and of two runs into one folder all files are those of the later run, unless a run is stopped for long meanwhile. Raises
    `InputError` if the folder cannot be made or written to.
    """
    parts: list[tuple[Path, Path]] = []
    try:
        folder.mkdir(parents=True, exist_ok=True)
        _sweep(folder)
        for name, content in contents.items():
            part = folder / f".{name}.{os.getpid()}.part"
            parts.append((part, folder / name))
            part.write_bytes(content)
        with _alone_in(folder):
            for part, target in parts:
                os.replace(part, target)
    except OSError as error:
        raise InputError(f"cannot write here: {(error.strerror or str(error)).lower()}", file=folder) from None
    finally:
        for part, _ in parts:
            with contextlib.suppress(OSError):
                part.unlink()


@contextlib.contextmanager
def _alone_in(folder: Path) -> Iterator[None]:
    """Wait until no other process moves files into `folder`, where the system has such locks, though not for ever.

    A process that is stopped while it holds the lock keeps it, also this process if Ctrl-C came as it got the lock.
    """
    try:
        import fcntl
    except ImportError:
        yield
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        deadline = time.monotonic() + LONGEST_WAIT
        with contextlib.suppress(OSError):  # a file system without locks
            while time.monotonic() < deadline:
                try:
                    fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
                    break
                except BlockingIOError:
                    time.sleep(0.01)
        yield
    finally:
        os.close(handle)


def depfile(targets: Iterable[Path], dependencies: Iterable[Path]) -> str:
    """A make rule by which every target depends on every dependency; a dependency that vanishes is no error to make."""
    needed = [_make_name(path) for path in dependencies]
    rule = " ".join(_make_name(path) for path in targets) + ": " + " \\\n  ".join(needed) + "\n"
    return rule + "".join(f"\n{name}:\n" for name in needed)


def _make_name(path: Path) -> str:
    shown = os.path.relpath(path)
    if shown.startswith(".."):
        shown = str(path if path.is_absolute() else shown)
    return shown.replace("$", "$$").replace("#", "\\#").replace(" ", "\\ ").replace(":", "\\:")


def _sweep(folder: Path) -> None:
    """Remove the unfinished files of killed runs; a run that is still alive keeps its files."""
    for entry in folder.iterdir():
        match = _TEMPORARY.fullmatch(entry.name)
        if match and not _alive(int(match["process"])):
            with contextlib.suppress(OSError):
                entry.unlink()


def _alive(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except OSError:
        return True
    return process != os.getpid()
