"""Chunks in several processes: an interrupted map begins no more of them; what another run has kept is taken if it belongs here."""

from __future__ import annotations

import concurrent.futures
import io
import multiprocessing
import threading
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from flat import plan_failure_map
from processes import ENDS

from dielast.commands import unfinished
from dielast.commands.failure_map import resume as partial
from dielast.commands.registry import read_cases
from dielast.io.files import Inputs
from dielast.material.material import Breakdown, Material
from dielast.material.shift import NoShift
from dielast.material.spectrum import Spectrum
from dielast.material.springs import Gent
from dielast.numerics.integrate import Status
from dielast.sharing import processes
from dielast.sharing.execution import Execution
from dielast.sharing.versions import VERSIONS
from dielast.simulate.failure_map import assembled
from dielast.simulate.map_plan import MapPlan, SolvedCells

BRANCH = Spectrum(np.array([100.0]), np.array([9e4]))
SOLID = Material("soft", 26e3, BRANCH, NoShift(20.0), Gent(110.0), Gent(55.0), 4e-11, Breakdown((1.7,), (40e6,)))
CELLS = 200
MAP = """
kind = "failure-map"
material = "example:vhb4905"
horizon = "1 h"
voltage = { from = "3 kV", to = "4 kV", points = 8 }
[film]
thickness = "0.5 mm"
prestretch = [1.7]
"""


class Pool(concurrent.futures.ProcessPoolExecutor):
    """A pool that remembers what it was given to do."""

    given: list[concurrent.futures.Future[Any]]

    def submit(self, task: Callable[..., Any], /, *args: Any, **keywords: Any) -> concurrent.futures.Future[Any]:
        future = super().submit(task, *args, **keywords)
        Pool.given.append(future)
        return future


def planned(cells: int, **more: Any) -> MapPlan:
    voltage = np.linspace(3e3, 4e3, cells)
    return plan_failure_map(SOLID, voltage=voltage, prestretch=[1.7], thickness=5e-4, relax=600.0, horizon=3600.0, **more)


def load(store: Path, key: str, plan: MapPlan) -> tuple[dict[int, SolvedCells], str]:
    return unfinished.load(partial.CELLS, store, key, plan, plan.chunks(partial.CHUNK))


def test_an_interrupt_begins_no_more_chunks(monkeypatch: pytest.MonkeyPatch) -> None:
    plan = planned(CELLS)
    monkeypatch.setattr(partial, "CHUNK", 1)
    monkeypatch.setattr(processes, "ProcessPoolExecutor", Pool)
    Pool.given = []

    def interrupt(done: int, cells: int, what: str) -> None:
        raise KeyboardInterrupt

    kept: list[str] = []
    with pytest.raises(KeyboardInterrupt):
        partial.solve(plan, "key", Execution(jobs=2, progress=interrupt, keep=kept.append))
    assert kept == ["no cell was solved yet; the same command begins anew"]  # and none has a folder to be kept in
    assert len(Pool.given) == CELLS
    concurrent.futures.wait(Pool.given, timeout=ENDS)
    assert sum(future.cancelled() for future in Pool.given) > CELLS // 2


def test_nothing_of_the_pool_outlives_the_last_chunk(monkeypatch: pytest.MonkeyPatch) -> None:
    # a thread that still closes its pipe while the interpreter ends makes the interpreter fail
    monkeypatch.setattr(partial, "CHUNK", 2)
    threads, children = set(threading.enumerate()), set(multiprocessing.active_children())
    partial.solve(planned(4), "key", Execution(jobs=2))
    assert set(threading.enumerate()) <= threads
    assert set(multiprocessing.active_children()) <= children


def test_what_is_kept_is_taken_only_if_it_belongs_to_the_map(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(partial, "CHUNK", 4)
    plan, store = planned(8), tmp_path / ".unfinished"
    cells = partial.solve(plan, "key", Execution())[0]

    def kept(**changed: Any) -> bool:
        unfinished.save(partial.CELLS, store, "key", [replace(cells, **changed)])
        return bool(load(store, "key", plan)[0])

    assert kept()
    assert load(store, "other key", plan) == ({}, unfinished.CHANGED.format(4, "cells"))
    assert not kept(first=3)
    assert not kept(first=-4)
    assert not kept(status=np.full(4, 99))
    assert not kept(status=np.full(3, Status.COMPLETED))
    assert not kept(status=np.full((2, 2), Status.COMPLETED))
    assert not kept(times=cells.times | {"breakdown": np.full(4, -1.0)})
    assert not kept(times=cells.times | {"pull-in": np.full(4, 4000.0)})
    nothing = np.full(4, np.nan)
    assert not kept(times={"breakdown": nothing, "pull-in": nothing}, status=np.full(4, Status.STOPPED))
    assert not kept(stretched=np.ones((2, 1, 4)))  # at a time that nobody asked for
    # an array of 64 TiB that is not there
    header = io.BytesIO()
    np.lib.format.write_array_header_1_0(header, {"descr": "<f8", "fortran_order": False, "shape": (1 << 43,)})
    store.write_bytes(header.getvalue())
    assert load(store, "key", plan) == ({}, unfinished.UNREADABLE)


@pytest.mark.parametrize("change", ["key", "format"])
def test_what_another_version_of_dielast_has_kept_is_discarded_by_a_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, change: str
) -> None:
    (tmp_path / "m.toml").write_text(MAP)
    (case,), inputs = read_cases(tmp_path / "m.toml"), Inputs(tmp_path)
    monkeypatch.setattr(partial, "CHUNK", 4)
    plan = planned(8)
    half = partial.solve(plan, "", Execution())[:1]
    with monkeypatch.context() as earlier:
        if change == "key":
            earlier.setattr(unfinished, "VERSIONS", {**VERSIONS, "dielast": "0.0.9"})
        unfinished.save(partial.CELLS, tmp_path / ".unfinished", unfinished.fingerprint(case, inputs), half)
    if change == "format":  # without one of today's arrays
        with np.load(tmp_path / ".unfinished") as saved:
            arrays = {name: saved[name] for name in saved.files if name != "status"}
        with (tmp_path / ".unfinished").open("wb") as file:
            np.savez(file, **arrays)
    notes: list[str] = []
    solved = partial.solve(plan, unfinished.fingerprint(case, inputs), Execution(folder=tmp_path, note=notes.append))
    assert notes == [unfinished.CHANGED.format(4, "cells") if change == "key" else unfinished.UNREADABLE]
    assert sum(cells.status.size for cells in solved) == 8


def test_a_map_with_stretches_goes_on_to_the_same_stretches(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(partial, "CHUNK", 4)
    monkeypatch.setattr(unfinished, "PAUSE", 0.0)
    plan = planned(16, stretch_at={"1 s": 1.0, "1 h": 3600.0})
    (whole,) = assembled(plan, partial.solve(plan, "key", Execution()))
    assert np.isfinite(whole.relative_stretch["1 s"]).any()

    def interrupt(done: int, cells: int, what: str) -> None:
        if done == 8:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        partial.solve(plan, "key", Execution(folder=tmp_path, progress=interrupt))
    counted: list[int] = []
    rest = partial.solve(plan, "key", Execution(folder=tmp_path, progress=lambda done, cells, what: counted.append(done)))
    assert counted == [12, 16]
    (result,) = assembled(plan, rest)
    assert list(result.relative_stretch) == ["1 s", "1 h"]
    for name, stretch in whole.relative_stretch.items():
        np.testing.assert_array_equal(result.relative_stretch[name], stretch)
    np.testing.assert_array_equal(result.time_to_failure, whole.time_to_failure)
    # of another number of times, they are of no use
    (store,) = tmp_path.iterdir()
    assert load(store, "key", planned(16, stretch_at=[1.0])) == ({}, unfinished.UNREADABLE)
