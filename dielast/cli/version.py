"""The version of dielast, with the commit of a checkout, read from git's files (gitrepository-layout(5))."""

import re
from pathlib import Path

from dielast import __version__

TOP = Path(__file__).parents[2]
"""The folder that holds the package: the top of a checkout, or `site-packages`."""
SHOWN = 12  # digits of a commit
_COMMIT = re.compile(r"[0-9a-f]{40}(?:[0-9a-f]{24})?")


def version(top: Path = TOP) -> str:
    """The version, with the commit of a checkout at `top`; git need not be installed. Uncommitted changes do not show."""
    checked_out = commit(top) if (top / "pyproject.toml").is_file() else None
    return f"dielast {__version__}" + (f", checkout of commit {checked_out[:SHOWN]}" if checked_out else "")


def commit(top: Path) -> str | None:
    """The commit that is checked out at `top`, as hexadecimal digits; None if there is none."""
    try:
        folder = top / ".git"
        if folder.is_file():  # in a worktree or a submodule
            folder = top / _text(folder).removeprefix("gitdir:").strip()
        head = _text(folder / "HEAD")
        if not head.startswith("ref:"):
            return _checked(head)
        name = head.removeprefix("ref:").strip()
        common = folder / _text(folder / "commondir") if (folder / "commondir").is_file() else folder
        for place in (folder, common):
            if (place / name).is_file():
                return _checked(_text(place / name))
        packed = (line.split() for line in _text(common / "packed-refs").splitlines())
        return next((_checked(words[0]) for words in packed if words[1:] == [name]), None)
    except (OSError, ValueError):
        return None


def _text(path: Path) -> str:
    return path.read_text(encoding="utf-8").strip()


def _checked(text: str) -> str | None:
    return text if _COMMIT.fullmatch(text) else None
