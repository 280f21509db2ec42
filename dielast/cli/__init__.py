"""The command line: a thin shell on the library. Nothing heavier than typer is imported before a command runs."""

from __future__ import annotations


def main() -> None:
    """Run the command line: exit 0 done, 2 bad input, 3 the numerics gave up, 4 golden mismatch, 130 interrupted, 1 a bug."""
    from dielast.cli.app import app

    app()
