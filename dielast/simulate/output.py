"""The output of a simulation: at which times, and which cycles in full."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self, cast

import numpy as np
from numpy.typing import ArrayLike

from dielast.base.errors import InputError, shown
from dielast.material.argument_types import checked
from dielast.mechanics.cases import of_case
from dielast.mechanics.load import ElectricalStep, Repeat, Step
from dielast.numerics.arrays import Cases, Floats
from dielast.simulate.options import Options

KEPT_WHOLE = 100  # number of cycles in a step up to which all are stored in full by default


@checked
@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Output(Options):
    """What the history of a simulation holds.

    Its rows are at `times` in s since the start, (k,) or (cases, k), or else at times suited to each step, with
    `points_per_decade` from the beginning of the step to its end. Of a waveform, `cycles` are in full: "all", "last", or their
    numbers from 1; by default all of up to 100, or else 1, 2, 5, 10, 20 and so on, and the last.

    Of a film under voltage: a run that ends at an event ends with the state at that event if `with_end`, by default unless `times`
    are stated; charge, current and energies are computed if `electrical`, by default where there is anything but a voltage; films
    with a passive part have `profiles` at the times `profile` in s. Of a specimen: with `internal`, the viscous stretches.
    """

    times: ArrayLike | None = None
    points_per_decade: int = 30
    cycles: str | Sequence[int] | None = None
    with_end: bool | None = None
    electrical: bool | None = None
    profile: ArrayLike | None = None
    internal: bool = False

    def of_cases(self, cases: int, steps: Sequence[Step] | Sequence[ElectricalStep], repeat: Repeat | None = None) -> Self:
        """The same, with times (cases, k), for a simulation of `cases` cases through `steps`, some of which may `repeat`;
        `InputError` for what is invalid.
        """
        if self.points_per_decade < 1:
            raise InputError(f"{self.points_per_decade}: a whole number of at least one is needed", argument="points_per_decade")
        kept, most = _kept_cycles(self.cycles), max((step.cycles for step in steps), default=0)
        most = most if repeat is None else repeat.times
        if isinstance(kept, tuple) and most and max(kept) > most:
            raise InputError(
                f"{max(kept)}: the {'waveform' if repeat is None else 'repetition'} has only {most} cycle{'s' * (most > 1)}",
                argument="cycles",
            )
        return replace(
            self,
            times=None if self.times is None else stated_times(self.times, cases),
            profile=None if self.profile is None else stated_times(self.profile, cases, "profile"),
            cycles=kept,
        )

    @property
    def rows(self) -> Floats | None:
        """The times (cases, k) of the rows, None for those suited to each step."""
        return cast(Floats | None, self.times)

    @property
    def profile_rows(self) -> Floats | None:
        """The times (cases, k) of the profiles, None without."""
        return cast(Floats | None, self.profile)

    @property
    def to_the_end(self) -> bool:
        """Whether a history that ends at an event ends with the state there."""
        return self.times is None if self.with_end is None else self.with_end

    def take(self, cases: Cases) -> Self:
        """The output of the selected cases (k,)."""
        return self if self.rows is None else replace(self, times=self.rows[cases])

    def kept(self, cycles: int) -> Cases:
        """The cycles (k,) stored in full, counted from 0: by default all of up to `KEPT_WHOLE`, else 1, 2, 5, 10, 20 and so on, and
        the last (counted from 1).
        """
        if self.cycles == "all" or (self.cycles is None and cycles <= KEPT_WHOLE):
            return np.arange(cycles)
        if self.cycles == "last":
            return np.array([cycles - 1])
        listed = self.cycles
        if listed is None or isinstance(listed, str):
            listed = (*(digit * 10**power for power in range(len(str(cycles))) for digit in (1, 2, 5)), cycles)
        return np.unique([cycle - 1 for cycle in listed if cycle <= cycles]).astype(np.intp)


def stated_times(times: object, cases: int, argument: str = "times") -> Floats:
    """Output times as an array (cases, k); `InputError` with this `argument` unless they are finite, not negative and never
    decrease.
    """
    array = np.atleast_2d(np.asarray(times, dtype=float))
    if array.ndim != 2 or array.shape[0] not in (1, cases) or not array.size:
        raise InputError(f"one list for all cases, or one for each of {cases} cases, is needed", argument=argument)
    if not np.all(np.isfinite(array)) or np.any(array < 0):
        raise InputError("output times must be finite and not negative", argument=argument)
    if np.any(np.diff(array, axis=1) < 0):
        raise InputError("output times must ascend", argument=argument)
    return np.ascontiguousarray(np.broadcast_to(array, (cases, array.shape[1])))


def _kept_cycles(cycles: object) -> str | tuple[int, ...] | None:
    """The cycles to store in full: None, "all", "last" or their numbers from 1; `InputError` for anything else."""
    if cycles is None or (isinstance(cycles, str) and cycles in ("all", "last")):
        return cycles
    numbers = [cycles] if isinstance(cycles, int) else list(cycles) if isinstance(cycles, Sequence) else []
    if not numbers or any(isinstance(number, bool) or not isinstance(number, int) or number < 1 for number in numbers):
        raise InputError(f'{shown(cycles)}: "all", "last" or a list of their numbers from 1 is needed', argument="cycles")
    return tuple(numbers)


def check_end(times: Floats | None, end: Floats, what: str, argument: str = "times") -> None:
    """`InputError` with this `argument` if output times (cases, k) lie after the `end` (cases,) in s of `what`."""
    if times is not None and np.any(late := times[:, -1] > end * (1 + 1e-12)):
        case = int(np.argmax(late))
        late_by = f"{times[case, -1]:.12g} s lies after the end of the {what} at {end[case]:.12g} s"
        raise InputError(late_by, argument=argument, case=of_case(case, end.size))
