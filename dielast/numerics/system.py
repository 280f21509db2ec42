"""What the stepper asks of the equations that it integrates, and of what drives them."""

from __future__ import annotations

from typing import Any, Protocol, Self

from dielast.numerics.columns import Cases, Flags, Floats


class Linearised(Protocol):
    """The linear system of one step."""

    def increment(self, time: Floats, state: Floats, history: Floats | None, gamma_i: float, out: Floats) -> Floats:
        """u_i (rows, cases) of the stage at `time` and `state`, written to the contiguous array `out`; `history` is sum c_ij u_j,
        None in the first stage.
        """


class System(Protocol):
    """Differential-algebraic equations of index 1 for states of shape (rows, cases); cases never mix."""

    def take(self, cases: Cases) -> Self:
        """The same for some of the cases."""

    def linearise(self, time: Floats, state: Floats, step: Floats, gamma: float) -> Linearised:
        """The linear system at the start of a step (cases,)."""

    def error(self, state: Floats, increment: Floats) -> Floats:
        """The relative error (cases,) that an `increment` to a `state` amounts to."""


class Spans(Protocol):
    """Smooth spans that systems go through one after another; a span may last for no time."""

    @property
    def spans(self) -> int:
        """The number of spans."""

    def lasts(self, cases: Cases, index: Cases) -> Floats:
        """Durations (k,) in s of the spans `index` (k,) of `cases` (k,)."""

    def enter(self, system: Any, columns: Cases, cases: Cases, index: Cases) -> tuple[Any, Floats]:
        """The system with `columns` (k,), which are of `cases` (k,), in the spans `index` (k,); and the spans' durations (k,)."""

    def smooth(self, index: Cases) -> Flags:
        """Whether the load goes on smoothly into the spans `index` (k,) from the spans before."""
