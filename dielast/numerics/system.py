"""The interface of the stepper to the equations that it integrates, and to the spans of the load."""

from __future__ import annotations

from typing import Any, Protocol, Self

from dielast.numerics.arrays import Cases, Flags, Floats


class Linearised(Protocol):
    """The linear system of one step."""

    def increment(self, time: Floats, state: Floats, history: Floats | None, gamma_i: float, out: Floats) -> Floats:
        """The increment u_i (rows, cases) of the stage at `time` and `state`, written to the contiguous array `out`.

        `history` is sum_j c_ij u_j, None in the first stage.
        """


class System(Protocol):
    """Differential-algebraic equations of index 1 for states of shape (rows, cases); the cases are independent."""

    def take(self, cases: Cases) -> Self:
        """The equations of the selected cases (k,)."""

    def linearise(self, time: Floats, state: Floats, step: Floats, gamma: float) -> Linearised:
        """The linear system of a step (cases,) in s that starts at `time` and `state`."""

    def error(self, state: Floats, increment: Floats) -> Floats:
        """The relative error (cases,) of a `state` (rows, cases) that is wrong by an `increment` (rows, cases)."""


class Spans(Protocol):
    """The spans of the load, one after another; the load is smooth within a span. The duration of a span may be 0."""

    @property
    def spans(self) -> int:
        """The number of spans."""

    def lasts(self, cases: Cases, index: Cases) -> Floats:
        """Durations (k,) in s of the spans `index` (k,) of `cases` (k,)."""

    def enter(self, system: Any, columns: Cases, cases: Cases, index: Cases) -> tuple[Any, Floats]:
        """The system whose `columns` (k,), of `cases` (k,), enter the spans `index` (k,), and the durations (k,) of these spans."""

    def smooth(self, index: Cases) -> Flags:
        """Whether the load is smooth (without a kink) at the beginning of the spans `index` (k,)."""
