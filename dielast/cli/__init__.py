"""The command line: a thin shell on the library. Nothing heavier than typer is imported before a command runs."""

from __future__ import annotations

import sys


def main() -> None:
    """Run the command line: exit 0 done, 2 bad input, 3 the numerics gave up, 4 golden mismatch, 130 interrupted, 1 a bug."""
    try:
        from dielast.cli.app import app

        app(prog_name="dielast")
    except KeyboardInterrupt:  # before a command began
        print("interrupted", file=sys.stderr)
        sys.exit(130)
