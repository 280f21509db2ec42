"""The range of a calibration: modes, largest stretch, times and temperatures of its tests."""

from __future__ import annotations

from dataclasses import dataclass

from dielast.io.result import Result


@dataclass(frozen=True, slots=True)
class CalibratedRange(Result):
    """The range of the tests to which a material was fitted: `modes` of loading, the largest first invariant I1 of the stretches,
    the shortest and longest `time` in s, and the lowest and highest `temperature` in degC.
    """

    modes: tuple[str, ...]
    largest_invariant: float
    time: tuple[float, float]
    temperature: tuple[float, float]
