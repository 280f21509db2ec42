"""`actuate`: voltage history -> stretch of a prestretched film, and its failure."""

from collections.abc import Callable, Hashable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from dielast.base.errors import placed
from dielast.commands.actuate.recipe import ActuateRecipe
from dielast.commands.simulation.cases import SimulationBatch, case_result, last, one_or_list
from dielast.commands.simulation.checks import warn_of_films, warn_of_programmes
from dielast.commands.simulation.result import CaseResult, StatedCase, at_event
from dielast.commands.simulation.run import Figures, PreparedCases, Simulation, report_of
from dielast.commands.simulation.timed_steps import TimedSteps
from dielast.handover.law_section import breakdown
from dielast.io.files import Inputs
from dielast.io.table import Column, Table, case_table
from dielast.material.dielectric import Leakage
from dielast.material.material import Material
from dielast.mechanics.criteria import names
from dielast.mechanics.load import FilmStep, Programme, Waveform
from dielast.numerics.arrays import Cases, Floats
from dielast.recipe.cases import Case
from dielast.report.report import RunReport
from dielast.sharing.execution import Execution
from dielast.simulate.actuate import prepare
from dielast.simulate.actuation_history import ActuationHistory
from dielast.simulate.events import event_columns
from dielast.simulate.film_setup import Film
from dielast.simulate.options import MESH_RTOL, Circuit, Failure, Solver
from dielast.simulate.output import Output

PASSIVE_POINTS = 8  # usually; the solver chooses their number


def run(cases: Sequence[Case[ActuateRecipe]], inputs: Inputs, execution: Execution) -> RunReport:
    """Simulate every case, report."""
    return report_of(ActuateSimulation([case.recipe for case in cases]), cases, inputs, execution)


def prepared(cases: Sequence[Case[ActuateRecipe]], inputs: Inputs) -> PreparedCases:
    """The cases, read and checked, but not solved."""
    return PreparedCases.of(ActuateSimulation([case.recipe for case in cases]), cases, inputs)


class ActuateSimulation(Simulation):
    """Films under voltage."""

    measured = "relative_stretch_1 [1]"
    time_scale = "linear"
    warn_before = staticmethod(warn_of_programmes)
    warn = staticmethod(warn_of_films)

    def __init__(self, recipes: Sequence[ActuateRecipe]) -> None:
        # all cases share one table: a column of one case is a column of all
        self.electrical = any(recipe.electrical for recipe in recipes)
        self.has_source = any(recipe.source is not None for recipe in recipes)
        self.has_leakage = any(recipe.leakage is not None for recipe in recipes)
        self.has_area = all(recipe.film.electrode_diameter is not None for recipe in recipes)

    def batches(
        self, cases: Sequence[StatedCase], thickness_factor: Floats | None = None, *, alone: Sequence[int] = ()
    ) -> list[SimulationBatch]:
        """The cases in batches, each with the breakdown law of its recipe in its material: films may differ in it as in others."""
        limited: dict[Hashable, Material] = {}
        used = []
        for case in cases:
            law, material = breakdown(case.recipe.breakdown), case.material
            if law is not None:
                material = limited.setdefault((id(material), law), replace(material, breakdown=law))
            used.append(replace(case, material=material))
        return super().batches(used, thickness_factor, alone=alone)

    def prepare(self, cases: Sequence[StatedCase], thickness_factor: Floats, steps: Sequence[Any]) -> partial[Any]:
        """The simulation of the films of the recipes."""
        recipes = [case.recipe for case in cases]
        recipe, films = recipes[0], [recipe.film for recipe in recipes]
        film = Film(
            np.array([film.thickness for film in films]) * thickness_factor,
            _over_films([film.stretched_to for film in films]),
            None if films[0].prestretch_rate is None else np.array([film.prestretch_rate for film in films]),
            recipe.film.relax,
            recipe.film.boundary,
            None if recipe.film.shares is None else np.array([film.shares for film in films]).ravel(),
            _over_films([film.weights[0] for film in films]),
            _over_films([film.weights[1] for film in films]),
            np.array([case.temperature for case in cases]),
            _over_films([film.stiffness(factor) for film, factor in zip(films, thickness_factor.tolist(), strict=True)]),
        )
        sources, leaks = [recipe.source for recipe in recipes], [recipe.leakage for recipe in recipes]
        leakage = Leakage(
            [0.0 if leak is None else leak.conductivity for leak in leaks],
            [np.inf if leak is None or leak.field is None else leak.field for leak in leaks],
        )
        circuit = Circuit(
            [0.0 if source is None else source.resistance for source in sources] if self.has_source else None,
            leakage if self.has_leakage else None,
            np.array([film.electrode_area for film in films], dtype=float) if self.has_area else None,
        )
        stated = recipe.output
        output = Output(stated.times, stated.points_per_decade, stated.cycles, None, self.electrical, stated.profile)
        # other boundaries than frames may be swept as well
        mesh_rtol = recipe.solver.mesh_rtol if recipe.film.boundary[0] == "frame" else MESH_RTOL
        return partial(
            prepare,
            film=film,
            steps=Programme(steps, recipe.mode, cases[0].steps.repeat),
            circuit=circuit,
            failure=Failure(pull_in_timescale=recipe.pull_in.criterion, stop_at=recipe.stop.at),
            output=output,
            solver=Solver(recipe.solver.rtol, mesh_rtol),
        )

    def result(self, recipe: ActuateRecipe, materials: Sequence[Material]) -> partial[CaseResult]:
        """The result of a case, with the events of the film."""
        return partial(_case, materials=materials, boundary=recipe.film.boundary, stated=_stated(recipe))

    def alike(self, recipe: ActuateRecipe) -> Hashable:
        """Set-up of the films and criteria of failure, which cases that are solved together share."""
        profile = None if recipe.output.profile is None else tuple(recipe.output.profile)
        film, ends = recipe.film, (recipe.pull_in.timescale, recipe.stop.at)
        return (
            film.prestretch_rate is None,
            film.relax,
            film.boundary,
            len(film.force or ()),
            recipe.solver.mesh_rtol,
            profile,
            ends,
            recipe.control,
            recipe.mode,
            None if recipe.repeat is None else repr(recipe.repeat),
            film.spring is not None and film.spring.axis,
            film.spring is None,
        )

    def points(self, recipe: ActuateRecipe) -> int:
        """More than one in a film with a passive part."""
        return 1 if recipe.film.shares is None else PASSIVE_POINTS

    def extras(
        self, cases: Sequence[Case[ActuateRecipe]], stated: Sequence[StatedCase], results: Sequence[CaseResult]
    ) -> tuple[dict[str, Table], Figures]:
        """The tables of events and profiles, and the figure of the first film with a profile."""
        if cases[0].recipe.uncertainty is None:
            tables = {"events.csv": event_columns([result.events or () for result in results])}
        else:
            from dielast.commands.simulation.bounds import bounded_event_columns

            tables = {"events.csv": bounded_event_columns([result.bounded_events for result in results])}
        materials = [case.material for case in stated]
        known = {column.name: column.values for column in tables["events.csv"]}
        for name, prefix in (("time", ""), ("assured_life", "assured_")):
            if name in known:
                more = use_columns(np.asarray(known["case"]), np.asarray(known[name]), stated, prefix)
                tables["events.csv"] = [*tables["events.csv"], *more]
        profiles = [result.profile for result in results if result.profile is not None]
        first, figures = stated[0], dict[str, Any]()
        if cases[0].recipe.limits is not None:
            tables["limits.csv"], figures["limits"] = _limits(first, cases[0], results)
        if not profiles:
            return tables, figures
        shown = next((case for case, profile in enumerate(profiles) if profile["time [s]"].size), 0)

        def figure() -> Any:
            from dielast.commands.simulation.naming import labels, titled
            from dielast.plots.films import plot_profile

            which = labels(cases, materials)[shown]  # named if there is a sweep
            first = cases[shown].recipe
            place = "radius / electrode radius" if first.film.boundary[0] == "frame" else "place / half the electrode's length"
            title = titled(first.title, [cases[shown]], [materials[shown]], which)
            return plot_profile(profiles, title, place)

        return {**tables, "profile.csv": case_table(dict(enumerate(profiles)))}, figures | {"profile": figure}

    def headline(self, cases: Sequence[Case[ActuateRecipe]], results: Sequence[CaseResult]) -> dict[str, dict[str, Any]]:
        """The last relative stretch of each case, and events by name in the cases in which they happen."""
        events = [result.events or () for result in results]
        final: dict[str, list[float]] = {"relative_stretch_1 [1]": [], "relative_stretch_2 [1]": []}
        for case, result in zip(cases, results, strict=True):
            stop = result.stopped
            for header, values in final.items():
                # a table at stated times may lack the end
                column = result.columns[header]
                values.append(last(column) if stop is None else at_event(stop, result.columns, header, case.recipe))
        sections: dict[str, dict[str, Any]] = {
            "actuate": {"cases": len(results)}
            | {f"final_{header.split(' ')[0]}": one_or_list(values) for header, values in final.items()}
        }
        for name in names():
            first = {case: event for case, happened in enumerate(events) for event in reversed(happened) if event.name == name}
            if first:
                sections[name] = {
                    "cases": list(first),
                    "time_s": [event.time for event in first.values()],
                    "stretch_1": [event.stretch_1 for event in first.values()],
                    "true_field_V_per_m": [event.true_field for event in first.values()],
                }
        return sections


def _limits(stated: StatedCase, case: Case[ActuateRecipe], results: Sequence[CaseResult]) -> tuple[Table, Callable[[], Any]]:
    """The table of the limits of the first film, and their figure with the course of all films."""
    from dielast.simulate.limits import film_limits

    recipe, asked = case.recipe, case.recipe.limits
    assert asked is not None
    with placed(lambda problem: problem.within(key="limits")):
        found = film_limits(
            stated.material,
            np.linspace(asked.stretch[0], asked.stretch[1], asked.points),
            thickness=recipe.film.thickness,
            mode=recipe.mode,
            held=recipe.film.prestretch[1],
            temperature=stated.temperature,
            breakdown=breakdown(recipe.breakdown),
            rupture_stretch=asked.rupture_stretch,
        )

    def figure() -> Any:
        from dielast.commands.simulation.naming import titled
        from dielast.plots.films import plot_limits

        return plot_limits(found, [result.columns for result in results], titled(recipe.title, [case], [stated.material]))

    return found.columns(), figure


def _stated(recipe: ActuateRecipe) -> tuple[str, ...]:
    """Columns that do not depend on the material: those that the source prescribes, unless charge leaks."""
    if recipe.programme:
        return ("time [s]",)
    if recipe.control == "charge":
        leaks = recipe.leakage is not None and recipe.leakage.conductivity > 0
        delivered = ("current_density [A/m^2]", "current [A]")
        return ("time [s]", *delivered, *(() if leaks else ("charge_density [C/m^2]", "charge [C]")))
    behind = recipe.source is not None and recipe.source.resistance > 0
    return ("time [s]", "source_voltage [V]", *(() if behind else ("voltage [V]",)))


def _over_films(pairs: Sequence[tuple[float | None, float | None]]) -> tuple[Floats | None, Floats | None]:
    """Numbers of the axes of films as arrays (cases,); None for an axis without a number."""
    first, second = (None if values[0] is None else np.array(values, dtype=float) for values in zip(*pairs, strict=True))
    return first, second


def _case(
    history: ActuationHistory, row: int, *, materials: Sequence[Material], boundary: tuple[str, str], stated: tuple[str, ...]
) -> CaseResult:
    result = case_result(history, row, history.case(row), materials[row], "dead-load" in boundary, history.events[row])
    outcome = history.outcome[row]
    stopped = next((event for event in result.events or () if outcome.completed and event.name == outcome.reason), None)
    profile = None if history.profiles is None else history.profiles.cases[row]
    return replace(result, stated=stated, profile=profile, stopped=stopped)


def use_columns(case: Cases, time: Floats, stated: Sequence[StatedCase], prefix: str = "") -> Table:
    """Columns of what a device does in a life: the cycles, if a programme has any, and the time in s under voltage or charge, both
    (rows,), up to a `time` (rows,) in s in the programme of each `case` (rows,); a life without an end has no end in either.
    """
    used = np.array([_used(stated[k].steps, at) for k, at in zip(case.tolist(), time.tolist(), strict=True)]).reshape(-1, 2).T
    cycling = any(one.steps.repeat is not None or any(isinstance(timed.driven, Waveform) for timed in one.steps) for one in stated)
    return [
        *([Column(f"{prefix}cycles", "1", used[0])] if cycling else []),
        Column(f"{prefix}actuated_time", "s", used[1]),
    ]


def _used(steps: TimedSteps, time: float) -> tuple[float, float]:
    """The cycles up to a time in s, and the time in which voltage or charge is not 0."""
    if not np.isfinite(time):
        return time, time
    runs = list(steps.runs())
    laps = [sum(run.lasts for run in runs if run.lap == lap) for lap in (1, 2)]
    cycles = under = begin = 0.0
    before = steps[0].before
    for timed, _, lap, lasts in runs:
        passed, of_lap = min(time - begin, lasts), laps[lap > 1]
        if time <= begin:
            break
        cycles += passed / of_lap if lap and of_lap else 0.0
        if isinstance(timed.step, FilmStep) and timed.step.charge is not None:
            under += passed
        elif isinstance(timed.driven, Waveform):
            cycles += passed / float(np.max(timed.driven.period))
            under += passed if before or any(value for value, _ in timed.corners) else 0.0
        else:
            for value, to_value in timed.corners:
                under += min(passed, to_value) if before or value else 0.0
                before, passed = value, max(passed - to_value, 0.0)
        before, begin = timed.after if timed.driven is not None else before, begin + lasts
    return cycles, under
