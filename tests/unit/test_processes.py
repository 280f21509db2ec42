"""Worker processes that cannot be started."""

import errno
import multiprocessing
import os
import sys
import time
from multiprocessing import resource_tracker, util
from typing import Any

import pytest

from dielast.base.errors import InputError
from dielast.sharing.processes import solve_in_processes

LONG = 60.0  # s


def wait(plan: float, first: int, end: int) -> int:
    time.sleep(plan)
    return end - first


@pytest.mark.skipif(sys.platform == "win32", reason="Windows starts processes by another function")
def test_a_worker_that_cannot_start_is_one_error_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Those that have begun their chunks end too."""
    resource_tracker.ensure_running()
    start, started = util.spawnv_passfds, 0

    def limited(*given: Any) -> int:
        nonlocal started
        started += 1
        if started > 1:
            raise BlockingIOError(errno.EAGAIN, os.strerror(errno.EAGAIN))
        return int(start(*given))  # type: ignore[no-untyped-call]

    monkeypatch.setattr(util, "spawnv_passfds", limited)
    before, begun = set(multiprocessing.active_children()), time.monotonic()
    with pytest.raises(InputError, match=r"^cannot start worker processes: resource temporarily unavailable"):
        list(solve_in_processes(3, wait, LONG, [(0, 1), (1, 2), (2, 3)]))
    assert started == 2
    assert time.monotonic() - begun < LONG / 2
    assert set(multiprocessing.active_children()) <= before
