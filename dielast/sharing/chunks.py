"""A plan that is solved in chunks, which know nothing of each other: `solve(plan, first, end)` of each."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

Plan = TypeVar("Plan")
Solved = TypeVar("Solved")
Solve = Callable[[Plan, int, int], Solved]
Chunk = tuple[int, int]
"""The number of its first part of the work, and that after its last part."""
