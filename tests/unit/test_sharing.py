"""Batches of cases in several processes: the same results, the same error, whoever is done first."""

from __future__ import annotations

import pickle
import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pytest

from dielast.commands.simulation.cases import PART, divided, one_or_all
from dielast.errors import DielastError, InputError, NumericsError
from dielast.material.material import Material
from dielast.material.shift import NoShift
from dielast.material.spectrum import Spectrum
from dielast.material.springs import Gent
from dielast.sharing.batches import solve_batches
from dielast.sharing.execution import Execution


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
def test_results_stand_in_the_order_of_the_cases(jobs: int) -> None:
    batches = [Squares([5, 0], 0.2), Squares([3]), Squares([1, 4]), Squares([2], 0.1)]
    seen: list[tuple[int, int, str]] = []
    results = solve_batches(batches, Execution(jobs=jobs, progress=lambda done, of, what: seen.append((done, of, what))))
    assert results == [0, 1, 4, 9, 16, 25]
    assert [own[1:] for own in seen] == [(6, "cases")] * 4
    assert seen[-1][0] == 6
    assert sorted(seen) == seen


@pytest.mark.parametrize("jobs", [1, 2])
def test_the_first_batch_with_an_error_is_told_of(jobs: int) -> None:
    first = InputError("step[0]: one", "step[1]: two")
    batches = [Squares([0]), Squares([1], 0.3, first), Squares([2], 0.0, NumericsError("later, though sooner found"))]
    with pytest.raises(InputError) as caught:
        solve_batches(batches, Execution(jobs=jobs))
    assert caught.value.messages == first.messages


def test_no_batches_and_no_progress_of_a_lone_one() -> None:
    assert solve_batches([], Execution(jobs=2)) == []
    assert solve_batches([Squares([0])], Execution(progress=lambda done, of, what: pytest.fail("one case has no progress"))) == [0]


@pytest.mark.parametrize("kind", [InputError, NumericsError])
def test_errors_travel_whole(kind: type[DielastError]) -> None:
    there = pickle.loads(pickle.dumps(kind("step[0]: one", "step[1]: two")))
    assert type(there) is kind
    assert there.messages == ("step[0]: one", "step[1]: two")
    assert str(there) == "step[0]: one\nstep[1]: two"


def material(branches: int) -> Material:
    spectrum = Spectrum(np.geomspace(1e6, 1e-6, branches), np.full(branches, 1e4))
    return Material("soft", 26e3, spectrum, NoShift(20.0), Gent(110.0), Gent(55.0))


def test_cases_are_divided_by_what_they_cost() -> None:
    few, many = [material(4)] * 10_000, [material(400)] * 100
    assert [len(part) for part in divided(range(10_000), few)] == [PART // 4, PART // 4, 10_000 - PART // 2]
    assert {len(part) for part in divided(range(80), many)} == {PART // 400}
    assert [member for part in divided(range(10_000), few) for member in part] == list(range(10_000))
    assert divided([3, 1, 2], [material(2 * PART)] * 4) == [[3], [1], [2]]


def test_one_material_of_all_cases_is_one() -> None:
    own, other = material(3), material(3)
    assert one_or_all([own, own]) is own
    assert one_or_all([own, other]) == [own, other]
