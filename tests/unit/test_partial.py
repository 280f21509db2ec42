"""Chunks in several processes: an interrupted map begins no more of them."""

from __future__ import annotations

import concurrent.futures
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from dielast.gent import Gent
from dielast.material import Breakdown, Material
from dielast.prony import Spectrum
from dielast.shift import NoShift
from dielast.simulate.failure_map import plan_failure_map
from dielast.workflow import partial
from dielast.workflow.report import Execution

SOLID = Material(
    "soft",
    26e3,
    Spectrum(np.array([1e4, 100.0, 1.0]), np.array([1e4, 2e4, 9e4])),
    NoShift(20.0),
    Gent(110.0),
    Gent(55.0),
    4e-11,
    Breakdown((1.7,), (40e6,)),
)
CELLS = 200


class Pool(concurrent.futures.ProcessPoolExecutor):
    """A pool that remembers what it was given to do."""

    given: list[concurrent.futures.Future[Any]]

    def submit(self, task: Callable[..., Any], /, *args: Any, **keywords: Any) -> concurrent.futures.Future[Any]:
        future = super().submit(task, *args, **keywords)
        Pool.given.append(future)
        return future


def test_an_interrupt_begins_no_more_chunks(monkeypatch: pytest.MonkeyPatch) -> None:
    plan = plan_failure_map(
        SOLID, voltage=np.linspace(3e3, 4e3, CELLS), prestretch=[1.7], thickness=5e-4, relax=600.0, horizon=3600.0
    )
    monkeypatch.setattr(partial, "CHUNK", 1)
    monkeypatch.setattr(partial, "ProcessPoolExecutor", Pool)
    Pool.given = []

    def interrupt(done: int, cells: int) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        partial.solve(plan, "key", Execution(jobs=2, progress=interrupt))
    assert len(Pool.given) == CELLS
    concurrent.futures.wait(Pool.given, timeout=60)
    assert sum(future.cancelled() for future in Pool.given) > CELLS // 2
