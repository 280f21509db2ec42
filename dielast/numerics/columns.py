"""Arrays whose last axis is a set of cases, and the rule by which columns are chosen from them."""

from __future__ import annotations

import numpy as np

from dielast.numerics.arrays import Flags, Floats, Index

__all__ = ["Cases", "Flags", "Floats", "paired", "where"]

Cases = Index


def paired(columns: Cases) -> Cases:
    """The same columns (k,), a lone one twice.

    numpy adds up an array of shape (n, 1) in another order than an array of shape (n, 2), and so rounds differently. No result may
    depend on how many cases run together, so columns are taken in pairs at least wherever sums over springs or stages follow.
    Results are written back to both columns, which is the same column.
    """
    return np.repeat(columns, 2) if columns.size == 1 else columns


def where(mask: Flags) -> Cases:
    """The columns (k,) in which a mask is true, as `paired`."""
    return paired(np.flatnonzero(mask))
