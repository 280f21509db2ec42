"""Pieces of a history: what a step prescribes, as a course of smooth spans through which the stepper goes.

A `Piece` states a load of step `origin` (from 0) of the history. Its start is known only once the films have come to it; `begin`
then turns it into a `Course`. Rows of prescribed values (3, cases) are the stretch or the nominal stress in Pa of axes 1 and 2, and
the nominal field V/L_3 in V/m. A new form of load is a further class in these unions.

A piece has its `controls`, its `target` (values at the end of a ramp, at the beginning of a waveform or table), the rows that are
`driven` by a waveform or table, the `extremes` of their values, `at_once` (whether it may begin with a jump), `take` to select
cases, and `begin`.

A course has its `start`, `end` and `duration`, the number of its `spans` and of its `cycles`; `span` gives the load and the
duration of the spans `index` of `cases` (k,), and `smooth` whether there is no kink at the beginning of a span. No step through it
may take more than its `longest_step` (cases,) in s. `rows` are suitable times of output, and `rises` the times at which the
magnitude of the voltage begins to rise; both are (cases, k) in s since the course began, or NaN.
"""

from __future__ import annotations

from dielast.mechanics.chain import Chain
from dielast.mechanics.cycles import Cycles
from dielast.mechanics.line import Line, Ramp

Piece = Ramp | Cycles | Chain
Course = Line | Cycles | Chain
