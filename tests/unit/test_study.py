"""Studies: the same results and the same error whoever is done first; an interrupted one goes on from what it has kept."""

from __future__ import annotations

import concurrent.futures
import errno
import hashlib
import importlib
import multiprocessing
import os
import pickle
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from multiprocessing import resource_tracker, util
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from flat import plan_failure_map

from dielast.base.errors import DielastError, InputError, NumericsError
from dielast.cli.run import compute
from dielast.commands.grids import design as designs, failure_map as maps
from dielast.commands.registry import read_cases
from dielast.commands.simulation import cases
from dielast.commands.simulation.cases import PART, divided
from dielast.io.files import STORE, Inputs
from dielast.material.material import Breakdown, Material
from dielast.material.shift import NoShift
from dielast.material.spectrum import Spectrum
from dielast.material.springs import Gent
from dielast.sharing import kept as store_of, processes, study
from dielast.sharing.execution import Execution
from dielast.sharing.kept import Kept, load
from dielast.sharing.processes import solve_in_processes
from dielast.sharing.study import Study, Work
from dielast.simulate.map_plan import MapPlan, SolvedCells, solve_cells

BRANCH = Spectrum(np.array([100.0]), np.array([9e4]))
SOLID = Material("soft", 26e3, BRANCH, NoShift(20.0), Gent(110.0), Gent(55.0), 4e-11, Breakdown((1.7,), (40e6,)))
CELLS = Work(solve_cells, "cells")
FILM = """
material = "example:vhb4905"
[film]
thickness = "0.5 mm"
prestretch = {prestretch}
relax = "10 min"
"""
DRAWN = """
[uncertainty]
draws = 20
thickness = "5 %"
breakdown_field = { law = "weibull", shape = 20 }
"""
BREAKDOWN = """
[breakdown]
field = "48 MV/m"
"""
STEPS = """
[[step]]
voltage = "3 kV"
duration = "10 s"
[[step]]
hold = "10 s"
"""
SWEEP = """
[sweep]
"step.0.voltage" = ["1 kV", "4.5 kV"]
"""
RECIPES = {
    "map": (
        'kind = "failure-map"\nhorizon = "1 h"\nvoltage.values = ["4 kV"]\nstretch.at = ["1 s", "1 h"]\n',
        "[1.7, 1.9]",
        DRAWN + BREAKDOWN,
    ),
    "design": (
        'kind = "design"\ngoal = { relative_stretch = 1.05, at = "1 min", horizon = "1 h" }\n',
        "[1.7, 1.9]",
        DRAWN + BREAKDOWN,
    ),
    "actuate": ('kind = "actuate"\n', "1.9", DRAWN + BREAKDOWN + STEPS),
    "sweep": ('kind = "actuate"\nsensitivity = true\n', "1.9", BREAKDOWN + STEPS + SWEEP),
}


def planned(cells: int, **more: Any) -> MapPlan:
    voltage = np.linspace(3e3, 4e3, cells)
    return plan_failure_map(SOLID, voltage=voltage, prestretch=[1.7], thickness=5e-4, relax=600.0, horizon=3600.0, **more)


@pytest.mark.parametrize("kind", [pytest.param(kind, marks=pytest.mark.trust if kind == "design" else []) for kind in RECIPES])
def test_interrupts_change_no_byte(kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    begin, prestretch, end = RECIPES[kind]
    (tmp_path / "r.toml").write_text(begin + FILM.format(prestretch=prestretch) + end)
    read = read_cases(tmp_path / "r.toml")

    def files(execution: Execution) -> dict[str, bytes]:
        return compute(read[0].recipe.kind, read, tmp_path / "r.toml", (), execution)[0]

    whole = files(Execution())
    # another division into chunks, which differs from one run to the next
    monkeypatch.setattr(study, "PAUSE", 0.0)
    monkeypatch.setattr(cases, "PART", 30 * 4)
    monkeypatch.setattr(maps, "CHUNK", 4)
    notes: list[str] = []

    def interrupt(done: int, of: int, what: str) -> None:
        if done < of and next(moments):
            raise KeyboardInterrupt

    for run in range(1, 100):
        monkeypatch.setattr(designs, "CHUNK", 5 + run % 3)
        moments = iter([*[False] * {"sweep": 7, "map": 3}.get(kind, 1), True, *[False] * 1000])
        try:
            resumed = files(Execution(folder=tmp_path / "out", progress=interrupt, note=notes.append))
            break
        except KeyboardInterrupt:
            assert [path.name for path in (tmp_path / "out").iterdir()] == [STORE]
    assert run > 2
    assert len(notes) >= run - 1
    assert resumed == whole


@pytest.mark.parametrize(
    ("name", "stated"),
    [
        ("actuate-sine", "output.electrical=true"),
        pytest.param("actuate-frame", "", marks=pytest.mark.trust),
        ("creep-force", ""),
        ("relax-pure-shear", ""),
    ],
)
def test_a_simulation_goes_on_within_a_step_of_its_load(
    name: str, stated: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    recipe = Path(__file__).parents[1] / "golden" / name / "recipe.toml"
    read = read_cases(recipe, None, [stated] if stated else [])

    def files(execution: Execution) -> dict[str, bytes]:
        return compute(read[0].recipe.kind, read, recipe, (), execution)[0]

    whole = files(Execution())
    monkeypatch.setattr(study, "STATE", 0.0)
    monkeypatch.setattr(study, "SAVING", np.inf)
    said: list[str] = []

    def interrupt(line: str) -> None:
        said.append(line)
        if len(said) % 23 == 22:
            raise KeyboardInterrupt

    for _ in range(100):
        try:
            resumed = files(Execution(folder=tmp_path, keep=interrupt))
            break
        except KeyboardInterrupt:
            assert "under way" in said[-1]
    assert len(said) > 2 * 23
    assert resumed == whole


def test_an_interrupt_begins_no_more_chunks(monkeypatch: pytest.MonkeyPatch) -> None:
    given: list[concurrent.futures.Future[Any]] = []

    class Pool(concurrent.futures.ProcessPoolExecutor):
        def submit(self, task: Callable[..., Any], /, *args: Any, **keywords: Any) -> concurrent.futures.Future[Any]:
            given.append(super().submit(task, *args, **keywords))
            return given[-1]

    monkeypatch.setattr(processes, "ProcessPoolExecutor", Pool)
    plan, kept = planned(200), list[str]()

    def interrupt(done: int, cells: int, what: str) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        Study(Execution(jobs=2, progress=interrupt, keep=kept.append)).solve(CELLS, plan, plan.chunks(1))
    assert kept == [study.NOTHING_KEPT]  # and none has a folder to be kept in
    assert len(given) == 200
    assert all(future.done() for future in given)
    assert sum(not future.cancelled() and future.exception() is None for future in given) < 100
    assert not multiprocessing.active_children()


def test_what_is_kept_is_taken_only_if_it_is_whole_and_of_this_run(tmp_path: Path) -> None:
    plan, store = planned(4), tmp_path / STORE
    cells = solve_cells(plan, 0, 4)
    store.write_bytes(whole := b"".join(Kept({"cells": {(0, 4): cells}}).pieces("key")))
    again = load(store, "key")[0].results["cells"][0, 4]
    np.testing.assert_array_equal(again.times["pull-in"], cells.times["pull-in"])
    assert load(store, "other") == (Kept(), store_of.CHANGED.format(4, "cells"))
    for content in (*(whole[:cut] for cut in (0, 31, 40, -1)), whole[:100] + bytes([whole[100] ^ 1]) + whole[101:]):
        store.write_bytes(content)
        assert load(store, "key") == (Kept(), store_of.UNREADABLE)
    # whatever a stranger writes, nothing but arrays and results is made of it
    for harm in (os.system, partial(os.system, "true"), Path("x"), SolvedCells.__init__, np.load):
        content = pickle.dumps(("key", {}, {}, ["cells"], [("cells", (0, 4))])) + pickle.dumps(harm)
        store.write_bytes(content + hashlib.sha256(content).digest())
        assert load(store, "key") == (Kept(), store_of.UNREADABLE)


def test_a_change_of_recipe_material_or_version_begins_anew(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "r.toml"
    path.write_text(RECIPES["actuate"][0] + FILM.format(prestretch="1.9") + STEPS)

    def key(*overrides: str) -> str:
        return store_of.fingerprint(read_cases(path, None, overrides), inputs)

    inputs = Inputs(tmp_path)
    keys = {
        key(),
        key("temperature='20 degC'"),
        key("sweep={'film.prestretch'=[1.8,1.9]}"),
        key("sweep={'film.prestretch'=[1.8,1.95]}"),
    }
    inputs.read("example:vhb4905")
    keys.add(key())
    monkeypatch.setattr(store_of, "VERSIONS", {"dielast": "0.0.9"})
    keys.add(key())
    assert len(keys) == 6


def test_what_no_longer_holds_is_done_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(study, "PAUSE", 0.0)
    notes: list[str] = []
    plan = planned(16)

    def interrupt(done: int, cells: int, what: str) -> None:
        if done == 8:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        Study(Execution(folder=tmp_path, progress=interrupt), "key").solve(CELLS, plan, plan.chunks(4))
    work = Work(solve_cells, "cells", holds=lambda plan, cells: cells.status.size != 4)
    Study(Execution(folder=tmp_path, note=notes.append), "key").solve(work, plan, plan.chunks(4))
    assert notes == []


@dataclass(frozen=True)
class Squares:
    """Squares of its members, after a while; or an error instead."""

    members: Sequence[int]
    seconds: float = 0.0
    error: DielastError | None = None

    def solve(self) -> list[int]:
        time.sleep(self.seconds)
        if self.error is not None:
            raise self.error
        return [member**2 for member in self.members]


@pytest.mark.parametrize("jobs", [1, 2])
def test_results_stand_in_the_order_of_the_cases_and_nothing_of_the_pool_outlives_them(jobs: int) -> None:
    # a thread that still closes its pipe while the interpreter ends makes the interpreter fail
    threads, children = set(threading.enumerate()), set(multiprocessing.active_children())
    batches = [Squares([5, 0], 0.2), Squares([3]), Squares([1, 4]), Squares([2], 0.1)]
    seen: list[tuple[int, int, str]] = []
    results = Study(Execution(jobs=jobs, progress=lambda done, of, what: seen.append((done, of, what)))).batches(batches)
    assert results == [0, 1, 4, 9, 16, 25]
    assert [own[1:] for own in seen] == [(6, "cases")] * 4
    assert seen[-1][0] == 6
    assert sorted(seen) == seen
    assert set(threading.enumerate()) <= threads
    assert set(multiprocessing.active_children()) <= children


def test_results_that_are_too_many_to_keep_are_said_to_be(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(store_of, "LARGEST", 100)
    monkeypatch.setattr(study, "PAUSE", 0.0)
    notes, kept, plan = list[str](), list[str](), planned(8)
    Study(Execution(folder=tmp_path, note=notes.append, keep=kept.append), "key").solve(CELLS, plan, plan.chunks(2))
    assert notes == ["results of more than 1 GiB: an interrupt keeps no more of them than until now"]
    assert kept == [study.NOTHING_KEPT]
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("jobs", [1, pytest.param(2, marks=pytest.mark.trust)])
def test_the_first_batch_with_an_error_is_told_of(jobs: int) -> None:
    first = InputError("step[0]: one", "step[1]: two")
    batches = [Squares([0]), Squares([1], 0.3, first), Squares([2], 0.0, NumericsError("later, though sooner found"))]
    with pytest.raises(InputError) as caught:
        Study(Execution(jobs=jobs)).batches(batches)
    assert caught.value.messages == first.messages


def material(branches: int) -> Material:
    spectrum = Spectrum(np.geomspace(1e6, 1e-6, branches), np.full(branches, 1e4))
    return Material("soft", 26e3, spectrum, NoShift(20.0), Gent(110.0), Gent(55.0))


def test_cases_are_divided_by_what_they_cost() -> None:
    few, many = [material(4)] * 10_000, [material(400)] * 100
    assert [len(part) for part in divided(range(10_000), few)] == [PART // 4, PART // 4, 10_000 - PART // 2]
    assert {len(part) for part in divided(range(80), many)} == {PART // 400}
    assert [member for part in divided(range(10_000), few) for member in part] == list(range(10_000))
    assert divided([3, 1, 2], [material(2 * PART)] * 4) == [[3], [1], [2]]


def test_a_crafted_file_runs_nothing_and_takes_no_memory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(importlib.import_module("dielast.io.workbook"), "subprocess", subprocess, raising=False)
    # a call of subprocess.Popen, by the name that a module of dielast has for it
    name, arguments = (b"dielast.io.workbook", b"subprocess.Popen"), (["touch", str(tmp_path / "harm")],)
    called = b"".join(b"\x8c" + bytes([len(text)]) + text for text in name) + b"\x93"
    content = b"\x80\x04" + called + pickle.dumps(arguments, protocol=2)[2:-1] + b"R."
    store = tmp_path / STORE
    store.write_bytes(hashlib.sha256(content).digest() + content)
    assert load(store, "key")[1] == store_of.UNREADABLE
    time.sleep(0.1)
    assert not (tmp_path / "harm").exists()
    os.truncate(store, 4 << 30)
    assert load(store, "key")[1] == store_of.UNREADABLE


@pytest.mark.parametrize("load_of", ["cycles", "rows of the load"])
def test_a_long_case_shows_how_far_it_is(load_of: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(importlib.import_module("dielast.simulate.follow"), "MANY", 9)
    table = "time [s],stretch [1]\n" + "".join(f"{k},{1 + 0.01 * (k % 2)}\n" for k in range(10))
    (tmp_path / "load.csv").write_text(table)
    step = 'waveform = "sine"\nlow = 1.0\nhigh = 1.1\nperiod = "1 s"\ncycles = 9'
    path = tmp_path / "r.toml"
    step = step if load_of == "cycles" else 'table = "load.csv"'
    path.write_text(f'kind = "relax"\nmaterial = "example:vhb4905"\n[[step]]\n{step}\n[solver]\nrtol = 1e-3\n')
    shown: list[tuple[int, int, str]] = []
    execution = Execution(folder=tmp_path, progress=lambda *state: shown.append(state))
    compute("relax", read_cases(path), path, (), execution)
    own = [done for done, total, what in shown if (total, what) == (9, load_of)]
    assert own == sorted(own)
    assert own[0] <= 1
    assert own[-1] >= 7


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
