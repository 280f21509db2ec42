"""Types of a plan whose work is solved in independent chunks, by a function `solve(plan, first, end)`."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

Plan = TypeVar("Plan")
Solved = TypeVar("Solved")
Solve = Callable[[Plan, int, int], Solved]
Chunk = tuple[int, int]
"""Where a chunk begins and ends: the number of its first cell, and the number after its last cell."""
