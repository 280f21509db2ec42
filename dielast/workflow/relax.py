"""`relax`: prescribed stretch -> stress."""

from dielast.workflow.simulation import run

__all__ = ["run"]
