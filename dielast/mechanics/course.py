"""Pieces of a history: what each prescribes from the present values on, as smooth spans through which the stepper goes.

A `Piece` knows where a load goes, from step `origin` (from 0) of the history on; which values it starts from is known when the
films come to it, and makes it a `Course`. Rows of prescribed values (3, cases) are the stretch or the nominal stress in Pa of
axes 1 and 2, and the nominal field V/L_3 in V/m. Another form of load is another class in these unions.

A piece has its `controls`, its `target` (values at the end of a line, at the beginning of a path), which rows are `driven` along a
path, the `extremes` of that path, whether it may begin `at_once`, and `take` for some of the cases; `begin` makes it a course.

A course has its `start`, `end` and `duration`, the number of its `spans` and of its `cycles`, and for the spans `index` of `cases`
(k,) their load and duration, `span`, and whether they go on smoothly from the span before, `smooth`. No step through it may take
more than its `longest_step` (cases,) in s. `rows` are the times of output
that suit it, and `rises` those at which the size of the voltage begins to rise; both are (cases, k) in s since it began, or NaN.
"""

from __future__ import annotations

from dielast.mechanics.chain import Chain
from dielast.mechanics.cycles import Cycles
from dielast.mechanics.line import Line, Ramp

Piece = Ramp | Cycles | Chain
Course = Line | Cycles | Chain
