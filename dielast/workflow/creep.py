"""`creep`: prescribed force or nominal stress -> stretch."""

from dielast.workflow.simulation import run

__all__ = ["run"]
