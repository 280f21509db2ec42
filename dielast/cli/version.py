"""The version of dielast, with the commit of a checkout, if git is there to name it."""

import subprocess
from pathlib import Path

from dielast import __version__

TOP = Path(__file__).parents[2]
"""The folder that holds the package: the top of a checkout, or `site-packages`."""


def version(top: Path = TOP) -> str:
    """The version, with the commit of a checkout at `top`. Uncommitted changes do not show."""
    commit, command = "", ("git", "--git-dir=.git", "rev-parse", "--short=12", "HEAD")
    if (top / "pyproject.toml").is_file() and (top / ".git").exists():  # not the repository in which dielast is installed
        try:
            done = subprocess.run(command, cwd=top, capture_output=True, text=True, check=True)
            commit = f", checkout of commit {done.stdout.strip()}"
        except (OSError, subprocess.CalledProcessError):
            pass
    return f"dielast {__version__}{commit}"
