"""Reading and writing files: inputs with their SHA-256, outputs that are written whole or not at all."""

import contextlib
import hashlib
import os
import re
import secrets
import signal
import stat
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from dielast.base.errors import InputError
from dielast.base.signals import ENDING
from dielast.io.spool import PIECE, Content, Spooled

LARGEST = 256 << 20  # bytes of an input file: more than ten million rows
EXAMPLE = "example:"
EXAMPLES = Path(__file__).parents[1] / "examples"
STORE = ".unfinished"
"""The file in which a long run keeps its cells until its result is written."""
KEPT = "what is solved is kept, and the same command goes on from there"
PAUSES = (0.05, 0.1, 0.2, 0.4)  # s after each attempt to replace a file
LONGEST_WAIT = 5.0  # s until another process has written its files; it takes milliseconds
_TEMPORARY = re.compile(r"\.dielast-[0-9a-f]{32}\.part")
# what a depfile cannot hold: make takes these for ends of names, of rules or of lists, or for assignments, and has no way to quote
# them, nor a backslash before a blank or at the end, nor & at the end
_NOT_FOR_MAKE = re.compile(r"[\x00-\x1f\x7f;|%=]|\\(?= |$)|[& ]$")


class Inputs:
    """Reads each input file of a run once, and records its name, path and SHA-256."""

    def __init__(self, folder: Path) -> None:
        """Paths that are not absolute are taken relative to `folder`, which holds the recipe."""
        self.folder = folder
        self.digests: list[tuple[str, str]] = []
        """For each file read, in order: its name in the recipe (the last part of an absolute path), and its SHA-256."""
        self.paths: list[Path] = []
        """Every file read, in the order of reading."""

    def read(self, name: str | Path) -> bytes:
        """The bytes of a file, or of an example that ships with dielast (`example:NAME`).

        Raises `InputError` if it cannot be read.
        """
        path = resolve(self.folder, name)
        content = read_file(path, str(name))
        self.record(name, path, sha256(content))
        return content

    def record(self, name: str | Path, path: Path, digest: str) -> None:
        """Record a file that was read elsewhere, such as in another process, by its name in the recipe, path and SHA-256."""
        # an absolute path belongs to this machine and has no place in a result
        shown = Path(name).name if Path(name).is_absolute() else str(name)
        if (entry := (as_text(shown), digest)) not in self.digests:
            self.digests.append(entry)
        if path not in self.paths:
            self.paths.append(path)


def sha256(content: Content) -> str:
    """The SHA-256 of a file's content, as hexadecimal digits."""
    return content.sha256 if isinstance(content, Spooled) else hashlib.sha256(content).hexdigest()


def resolve(folder: Path, name: str | Path) -> Path:
    """The path of the file `name` that a recipe in `folder` names; raises `InputError` for an unknown example."""
    text = str(name)
    if text.startswith(EXAMPLE):
        root, name, entries = EXAMPLES, text.removeprefix(EXAMPLE), sorted(EXAMPLES.iterdir())
        path = next((entry for entry in entries if entry.stem == name), root / name)  # "example:vhb4905" means vhb4905.toml
        if not path.resolve().is_relative_to(root.resolve()) or not exists(path):
            known = ", ".join(f"{EXAMPLE}{entry.name}" for entry in entries)
            raise InputError(f"no such example; there are {known}", file=text)
        return path
    return folder / text


def read_file(path: Path, name: str) -> bytes:
    """The bytes of a file; raises `InputError` with its `name` if it cannot be read, or is larger than `LARGEST`.

    A named pipe, which may never have a writer, is refused; the pipe of a shell, <(...), is read.
    """
    if _is_named_pipe(path):
        raise InputError("is a named pipe, a file is needed", file=name)
    try:
        with path.open("rb") as file:
            # a larger buffer than the file would take address space
            pieces = [file.read(min(os.fstat(file.fileno()).st_size, LARGEST) + 1)]
            while pieces[-1] and sum(map(len, pieces)) <= LARGEST:
                pieces.append(file.read(PIECE))
            content = b"".join(filter(None, pieces))
    except (OSError, ValueError) as error:  # ValueError: a NUL in the name
        reason = (getattr(error, "strerror", None) or "cannot be read").lower()
        if os.path.isdir(path):
            reason = "is a folder, a file is needed"
        elif isinstance(error, FileNotFoundError):
            reason = f"no such file{of_backslashes(name)}"
        raise InputError(reason, file=name) from None
    if len(content) > LARGEST:
        raise InputError(f"larger than {LARGEST >> 20} MiB, which no table or recipe should be", file=name)
    return content


def _is_named_pipe(path: Path) -> bool:
    try:
        return stat.S_ISFIFO(os.stat(os.path.realpath(path)).st_mode)  # the pipe of a shell has no path of its own
    except (OSError, ValueError):
        return False


def as_text(name: str) -> str:
    """A file's name as text; bytes that are not UTF-8 become escapes, so that every file can hold it."""
    return name.encode("utf-8", "backslashreplace").decode()


def exists(path: Path) -> bool:
    """Whether the file or folder exists; False for a name that no file can have, such as a very long name."""
    try:
        return path.exists()
    except (OSError, ValueError):
        return False


def of_backslashes(name: str) -> str:
    """A hint on what to write instead, if backslashes may be why no file has this name; empty otherwise."""
    if any(escape in name for escape in "\b\t\n\f\r"):
        return "; a backslash in double quotes begins an escape such as \\t: write / between folders, or single quotes"
    if "\\" in name and os.sep == "/":
        return "; write / between folders: it does on every system"
    return ""


def check_targets(targets: Iterable[Path], inputs: Iterable[Path]) -> None:
    """Raise `InputError` if writing `targets` would overwrite one of the `inputs`, or if a folder is in the way."""
    read = {_identity(path) for path in inputs}
    for target in targets:
        if _identity(target) in read:
            raise InputError("is an input of this run; write the results to another folder (see --out)", file=target)
        if os.path.isdir(target):
            raise InputError("is a folder, a file is to be written there", file=target)


def _identity(path: Path) -> tuple[str, tuple[int, int] | None]:
    """A value that is equal for two paths of one file, also where the file system ignores upper and lower case (macOS, Windows)."""
    try:
        status = path.stat()
    except OSError:
        return os.path.realpath(path), None
    return os.path.realpath(path).casefold(), (status.st_dev, status.st_ino)


def check_folder(folder: Path, needed: str) -> None:
    """Raise `InputError` if nothing can be written into `folder`, as far as that shows without writing; it need not exist yet.

    `needed` completes the message "is a file, a folder ...", such as "for the results is needed".
    """
    if os.name == "nt" and names_a_device(folder.name):
        raise InputError("a name that Windows reserves for a device: choose another folder", file=folder)
    nearest = folder
    while not os.path.lexists(nearest) and nearest.parent != nearest:
        nearest = nearest.parent
    if not os.path.isdir(nearest):
        obstacle = "is a file" if os.path.exists(nearest) else "leads nowhere"
        raise InputError(f"{obstacle}, a folder {needed}", file=nearest)
    if not os.access(nearest, os.W_OK | os.X_OK):
        raise InputError("cannot write here: permission denied", file=folder)


def names_a_device(name: str) -> bool:
    """Whether Windows takes a file's or folder's name, with any ending, for a device."""
    stem = name.partition(".")[0].rstrip().upper()
    return stem in ("CON", "PRN", "AUX", "NUL") or bool(re.fullmatch(r"(COM|LPT)[1-9]", stem))


def write_files(
    folder: Path, contents: Mapping[str, bytes | Iterable[bytes]], moved: Callable[[bool], None] = lambda whole: None
) -> None:
    """Write `contents` (name -> bytes, or pieces of them) into `folder`, each file whole or not at all.

    All files are first written beside their targets, then moved into place together: an older result stays as it was if the disk
    is full, or if another program keeps a target open (Windows). Signals that would end the process are `held` meanwhile. `moved`
    is called before the first file is moved, with False, and after the last, with True. After two simultaneous runs all files are
    those of the later run, unless one of them was suspended for longer than `LONGEST_WAIT`. Raises `InputError` if the folder
    cannot be made or written to, or if a file cannot be replaced.
    """
    parts: list[tuple[Path, Path]] = []
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with alone_in(folder) as alone, held():
            try:
                for entry in folder.iterdir() if alone else ():
                    if _is_unfinished(entry):
                        with contextlib.suppress(OSError):
                            entry.unlink()
                for name, content in contents.items():
                    target = folder / name
                    part = target.with_name(f".dielast-{secrets.token_hex(16)}.part")
                    parts.append((part, target))
                    with open(part, "xb", opener=_for_all) as file:
                        file.writelines([content] if isinstance(content, bytes) else content)
                for _, target in parts:
                    if target.is_file():
                        _replace(target, target)  # changes nothing; fails if another program keeps the target open
                moved(False)
                for part, target in parts:
                    _replace(part, target)
                moved(True)
            finally:
                for part, _ in parts:
                    with contextlib.suppress(OSError):
                        part.unlink()
    except OSError as error:
        of_file = (target for _, target in parts if str(target) in (str(error.filename), str(error.filename2)))
        raise InputError(f"cannot write here: {(error.strerror or str(error)).lower()}", file=next(of_file, folder)) from None


def _is_unfinished(path: Path) -> bool:
    """Whether a killed run of the same user left this file while it wrote."""
    if not _TEMPORARY.fullmatch(path.name):
        return False
    try:
        status = path.lstat()
    except OSError:
        return False
    return stat.S_ISREG(status.st_mode) and (not hasattr(os, "getuid") or status.st_uid == os.getuid())


def _for_all(name: str, flags: int) -> int:
    """Open a file with ordinary rights."""
    return os.open(name, flags | getattr(os, "O_NOFOLLOW", 0), 0o666)


@contextlib.contextmanager
def held() -> Iterator[None]:
    """Hold the first signal that would end the process until the end of this context; a second one of its kind acts at once.

    Only the main thread can hold signals.
    """
    came: list[int] = []
    before: dict[int, Any] = {}

    def hold(number: int, _: object) -> None:
        came.append(number)
        signal.signal(number, before.pop(number))

    for number in ENDING:
        if signal.getsignal(number) not in (signal.SIG_IGN, None):  # None: set by another program, which nobody can restore
            with contextlib.suppress(ValueError):  # not the main thread
                before[number] = signal.signal(number, hold)
    try:
        yield
    finally:
        for number, handler in list(before.items()):
            signal.signal(number, handler)
        for number in came:
            signal.raise_signal(number)


def _replace(part: Path, target: Path) -> None:
    """Move `part` to `target`, repeatedly: a program such as a virus scanner may keep a new file open for a moment."""
    for pause in PAUSES:
        try:
            os.replace(part, target)
            return
        except PermissionError:
            time.sleep(pause)
    raise InputError("cannot be replaced: permission denied; close the program that has it open, if any", file=target)


@contextlib.contextmanager
def alone_in(folder: Path) -> Iterator[bool]:
    """Wait until no other process writes into `folder`, at most `LONGEST_WAIT`; True if this process is then the only one.

    False where folders have no locks, as on Windows, or if another process keeps its lock, as a suspended process does.
    """
    handle = None
    with contextlib.suppress(OSError, ImportError):
        from fcntl import LOCK_EX, LOCK_NB, flock

        handle = os.open(folder, os.O_RDONLY)
    try:
        deadline, alone = time.monotonic() + LONGEST_WAIT, False
        with contextlib.suppress(OSError):  # a file system without locks
            while handle is not None and not alone and time.monotonic() < deadline:
                try:
                    flock(handle, LOCK_EX | LOCK_NB)
                    alone = True
                except BlockingIOError:  # another process has the lock
                    time.sleep(0.01)
        yield alone
    finally:
        if handle is not None:
            os.close(handle)  # releases the lock


def depfile(targets: Iterable[Path], dependencies: Iterable[Path]) -> str:
    """A make rule by which every target depends on every dependency; make accepts that a dependency has been deleted.

    Make compares names, not files: an absolute target also has the rule under its absolute name. Raises `InputError` for a name
    that make cannot hold.
    """
    targets, needed = list(targets), [_make_name(_shortest(path)) for path in dependencies]
    absolute = [str(path) for path in targets if path.is_absolute()]
    named = dict.fromkeys(_make_name(name) for name in (*map(_shortest, targets), *absolute))
    rule = " ".join(named) + ": " + " \\\n  ".join(needed) + "\n"
    return rule + "".join(f"\n{name}:\n" for name in needed)


def _shortest(path: Path) -> str:
    """The path relative to the current folder if it lies inside it, else unchanged."""
    try:
        shown = os.path.relpath(path)
    except ValueError:  # a path on another drive
        shown = str(path)
    return str(path) if shown.startswith("..") and path.is_absolute() else shown


def _make_name(shown: str) -> str:
    if mark := _NOT_FOR_MAKE.search(shown):
        raise InputError(f"make cannot hold {mark[0]!a} there: use another name, or no --depfile", file=as_text(shown))
    drive, rest = os.path.splitdrive(shown)  # make accepts the colon of a drive on Windows
    rest = rest.replace(os.sep, "/").replace("$", "$$").replace("#", "\\#").replace(" ", "\\ ").replace(":", "\\:")
    return drive.replace(os.sep, "/") + rest
