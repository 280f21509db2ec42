"""Specimens of a test to failure, and their simulation up to their ends: all films that share a history in one batch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from dielast.base.errors import InputError, NumericsError, Problem, and_more, warn
from dielast.calibration.failures.histories import Histories
from dielast.calibration.failures.likelihood import Seen
from dielast.io.result import Result
from dielast.material.material import Material
from dielast.mechanics.load import Track, VoltageStep, Waveform
from dielast.mechanics.stability import ONE_PERCENT, TimeScale
from dielast.numerics.arrays import Cases, Floats
from dielast.simulate.actuate import prepare
from dielast.simulate.film_setup import Film
from dielast.simulate.options import Failure, Solver
from dielast.simulate.output import KEPT_WHOLE, Output

POINTS_PER_DECADE = 50
CYCLES_PER_DECADE = 20  # by number, of more than `KEPT_WHOLE`
PULL_IN = "pull-in"


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Specimens(Result):
    """Specimens, arrays (n,): `name`, what was `seen` of each (`Seen`), and the `time` in s of its end since the voltage began.

    The voltage rises at a `ramp` in V/s (infinite: at once) to `voltage` in V and stays; a specimen that fails on the way has
    its voltage at failure. `programme` (n,) is the index of its steps in `programmes`, -1 for a ramp and hold. `intact` is the
    time in s at which a specimen that failed between two looks was last seen intact, else NaN. `prestretch` (n, 2), `thickness`
    in m of the undeformed film, `temperature` in degC, `area` in m^2 of the electrode on the undeformed film (NaN if unknown),
    relative `humidity` (NaN if unknown), `batch` and `mode` ("" if not stated).
    """

    name: tuple[str, ...]
    seen: Cases
    time: Floats
    voltage: Floats
    ramp: Floats
    prestretch: Floats
    thickness: Floats
    temperature: Floats
    intact: Floats
    area: Floats
    humidity: Floats
    batch: tuple[str, ...]
    mode: tuple[str, ...]
    programme: Cases
    programmes: tuple[Sequence[VoltageStep], ...] = ()
    places: tuple[dict[str, Any], ...] = ()
    """Where each specimen is stated, for messages: fields of a `Problem`."""

    def __len__(self) -> int:
        return len(self.name)

    @property
    def equibiaxial(self) -> Floats:
        """sqrt(l1 l2) (n,) of the prestretch."""
        return np.asarray(np.sqrt(self.prestretch[:, 0] * self.prestretch[:, 1]))

    def problem(self, row: int, text: str) -> Problem:
        """A problem of one specimen."""
        return Problem(f"specimen {self.name[row]}: {text}", **(self.places[row] if self.places else {}))


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Simulated(Result):
    """Specimens that have been simulated: their `histories`, the number `film` (n,) of that of each, and the `end` (n,) in s to
    which it can be followed, that of a film that pulls in before.

    `voltage` in V (n,) is that at the end; `pulled_in` (n,) is the time in s of pull-in, infinite where there is none.
    """

    specimens: Specimens
    histories: Histories
    film: Cases
    end: Floats
    voltage: Floats
    pulled_in: Floats
    seen: Cases
    voltages: Histories | None = None
    """The voltages in V, in the place of fields."""
    points_per_decade: int = POINTS_PER_DECADE
    """The rows of the histories, from the beginning of each step."""

    @property
    def state(self) -> tuple[Floats, Floats]:
        """True field in V/m and stretch (n,) at the end of each specimen."""
        values = self.histories.at(self.film, self.end)
        return values[0], values[1]


def simulate_specimens(
    material: Material,
    specimens: Specimens,
    *,
    film: Film,
    pull_in_timescale: TimeScale = ONE_PERCENT,
    solver: Solver | None = None,
    points_per_decade: int = POINTS_PER_DECADE,
) -> Simulated:
    """Simulate every specimen up to its end, as a `film` with the thickness, the prestretch and the temperature of the specimen.

    Specimens of one programme, film and temperature share a history. Raises `InputError` with a line for each specimen that is said
    to fail after the end of its programme or whose film pulls in before it is said to break down; warns of survivors that pull in.
    """
    plain = replace(material, breakdown=None, damage=None)
    keys = [_key(specimens, row) for row in range(len(specimens))]
    members: dict[tuple[Any, ...], list[int]] = {}
    for row, key in enumerate(keys):
        members.setdefault(key, []).append(row)
    groups: dict[int, list[tuple[Any, ...]]] = {}
    for key in members:
        groups.setdefault(key[0], []).append(key)
    columns: list[tuple[Floats, ...]] = []
    number: dict[tuple[Any, ...], int] = {}
    ended: list[tuple[float, float, str]] = []
    for programme, alike in groups.items():
        first = [members[key][0] for key in alike]
        longest = np.array([specimens.time[members[key]].max() for key in alike])
        steps = _steps(specimens, programme, np.array(first), longest)
        waves = _waves(steps)
        # an axis on which a weight hangs has no prestretch of its own
        pair = specimens.prestretch[first].T
        first_axis, second_axis = (None if force is not None else axis for force, axis in zip(film.forces, pair, strict=True))
        run = prepare(
            plain,
            replace(
                film,
                thickness=specimens.thickness[first],
                prestretch=(first_axis, second_axis),
                temperature=specimens.temperature[first],
            ),
            steps,
            failure=Failure(pull_in_timescale=pull_in_timescale, stop_at=PULL_IN),
            output=Output(points_per_decade=points_per_decade, cycles=_kept(waves)),
            solver=solver or Solver(),
        )
        history = run()
        for row, key in enumerate(alike):
            number[key] = len(columns)
            stretch = np.sqrt(history.stretch_1[row] * history.stretch_2[row])
            columns.append(
                (history.time[row], history.true_field[row], stretch, history.voltage[row], _skipped(history.time[row], waves))
            )
            outcome = history.outcome[row]
            pulled = next((event.time for event in history.events[row] if event.name == PULL_IN), np.inf)
            ended.append((outcome.time, pulled, "" if outcome.completed else outcome.reason))
    most = max(part[0].size for part in columns)
    time, true_field, stretch, volt, skipped = (
        np.array([np.pad(part[k], (0, most - part[k].size), constant_values=np.nan) for part in columns]) for k in range(5)
    )
    which = np.array([number[key] for key in keys])
    gaps = skipped if np.any(skipped > 0) else None
    histories = Histories.padded(time, true_field, stretch, gaps)
    volts = Histories.padded(time, volt, np.ones_like(volt), gaps)
    pulled_in = np.array([ended[k][1] for k in which])
    tested = _checked(specimens, histories, which, ended, pulled_in)
    return replace(tested, voltage=volts.at(which, tested.end)[0], voltages=volts, points_per_decade=points_per_decade)


def _key(specimens: Specimens, row: int) -> tuple[Any, ...]:
    """What specimens with one history share; the first entry is the programme, or -1 for a hold and -2 for a ramp."""
    film = (*specimens.prestretch[row].tolist(), float(specimens.thickness[row]), float(specimens.temperature[row]))
    programme = int(specimens.programme[row])
    if programme >= 0:
        return (programme, *film)
    ramp, voltage = float(specimens.ramp[row]), float(specimens.voltage[row])
    if np.isfinite(ramp) and specimens.time[row] <= voltage / ramp * (1 + 1e-9):
        return (-2, ramp, 0.0, *film)
    return (-1, ramp, voltage, *film)


def _steps(specimens: Specimens, programme: int, first: Cases, longest: Floats) -> Sequence[VoltageStep]:
    if programme >= 0:
        return specimens.programmes[programme]
    ramp, voltage = specimens.ramp[first], specimens.voltage[first]
    if programme == -2:
        return [VoltageStep(voltage=ramp * longest, duration=longest)]
    rise = np.where(np.isfinite(ramp), voltage / ramp, 0.0)
    # a film that is dead at once still needs a moment under voltage
    return [VoltageStep(voltage=voltage, duration=rise), VoltageStep.hold(np.maximum(longest - rise, 1e-6))]


def _waves(steps: Sequence[VoltageStep]) -> list[tuple[float, float, int]]:
    """When each waveform of a programme of all films begins in s, its period in s and its number of cycles."""
    begin, voltage, waves = 0.0, 0.0, list[tuple[float, float, int]]()
    for step in steps:
        target = step.target
        if isinstance(target, Waveform):
            waves.append((begin, float(np.max(target.period)), int(target.cycles)))
        if isinstance(target, Waveform | Track):
            begin, voltage = begin + target.duration, float(np.max(target.last))
            continue
        goal = voltage if target is None else float(np.max(target))
        if step.duration is not None:
            begin += float(np.max(step.duration))
        elif step.rate is not None:
            begin += abs((goal - voltage) / float(np.max(np.abs(step.rate))))
        voltage = goal
    return waves


def _kept(waves: Sequence[tuple[float, float, int]]) -> list[int] | None:
    """The numbers of the cycles whose course is kept, None for all: of more than `KEPT_WHOLE`, those evenly spaced by log."""
    counts = [count for *_, count in waves]
    if max(counts, default=0) <= KEPT_WHOLE:
        return None
    kept = [np.geomspace(1, count, 1 + int(np.ceil(CYCLES_PER_DECADE * np.log10(count)))) for count in counts]
    return [int(number) for number in np.unique(np.round(np.concatenate(kept)))]


def _skipped(time: Floats, waves: Sequence[tuple[float, float, int]]) -> Floats:
    """The period (rows,) in s of the cycles that are left out after each row, 0 elsewhere."""
    result, width = np.zeros(time.size), np.diff(time, append=np.nan)
    for begin, period, count in waves:
        end = begin + count * period
        inside = (time >= begin + 0.999 * period) & (time + width <= end * (1 + 1e-9))
        result[inside & (width > 0.999 * period)] = period
    return result


def _checked(
    specimens: Specimens, histories: Histories, which: Cases, ended: Sequence[tuple[float, float, str]], pulled_in: Floats
) -> Simulated:
    """The specimens with their ends; raises `InputError` for each that its film does not reach."""
    problems, lost, end, seen = list[Problem](), list[str](), specimens.time.copy(), specimens.seen.copy()
    outlived = list[str]()
    for row, k in enumerate(which.tolist()):
        last, pulled, reason = ended[k]
        late = specimens.time[row] > max(last, 0.0) * (1 + 1e-9) + 1e-12
        if specimens.time[row] > pulled * (1 + 1e-9):
            if seen[row] == Seen.SUSPENDED:
                outlived.append(specimens.name[row])
                end[row] = pulled
            else:
                problems.append(
                    specimens.problem(
                        row,
                        f"its film pulls in after {pulled:.4g} s, before its stated failure after {specimens.time[row]:.4g} s: "
                        "state it as suspended, or check voltage, prestretch and material",
                    )
                )
        elif late and reason:
            lost.append(f"specimen {specimens.name[row]}: given up at {last:.4g} s: {reason}")
        elif late:
            problems.append(
                specimens.problem(
                    row, f"its end after {specimens.time[row]:.4g} s lies after the end of its programme at {last:.4g} s"
                )
            )
    off = (histories.at(which, np.minimum(end, histories.end[which]))[0] == 0) & (seen == Seen.FAILED) & (end > 0)
    if not problems:
        problems = [
            specimens.problem(
                int(row),
                f"it fails after {end[row]:.4g} s, when there is no voltage: if it was found failed then, state when it was last "
                "seen intact",
            )
            for row in np.flatnonzero(off)
        ]
    if problems:
        raise InputError(*problems)
    if lost:
        raise NumericsError(*lost)
    if outlived:
        warn(
            f"specimen {outlived[0]}{and_more(len(outlived) - 1)}: the film pulls in before the end of the test, and counts as a "
            "survivor up to its pull-in alone"
        )
    return Simulated(specimens, histories, which, np.minimum(end, histories.end[which]), np.zeros(end.size), pulled_in, seen)
