"""Recipes of `actuate`."""

from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from dielast.base.errors import InputError, Mistakes, Problem
from dielast.base.units import (
    CHARGE,
    CHARGE_DENSITY,
    CONDUCTIVITY,
    FIELD,
    RESISTANCE,
    STIFFNESS,
    STRESS,
    VOLTAGE,
)
from dielast.commands.actuate.steps import Repetition, SourceStep
from dielast.commands.simulation.film_recipe import SHARE_TEXT, FilmBase, FilmSolver, OneFilm, PullInSection, Share
from dielast.commands.simulation.recipe import LoadingMode, OutputSection, SimulationRecipe
from dielast.commands.simulation.step_recipe import AnyOf, starting
from dielast.commands.simulation.uncertainty_recipe import SENSITIVITY_TEXT, FilmUncertainty
from dielast.handover.law_section import BreakdownField
from dielast.mechanics.criteria import END, names
from dielast.recipe.fields import AscendingTimes, Length, OneOf, Pair, Section, WithUnit
from dielast.simulate.quantities import ELECTRODE, FILMS, LEAKAGE, ON_REQUEST, SOURCE, Quantity

Resistance = Annotated[float, WithUnit(RESISTANCE, at_least=0.0)]
Conductivity = Annotated[float, WithUnit(CONDUCTIVITY, at_least=0.0)]
Stiffness = Annotated[tuple[float, str], AnyOf((STIFFNESS, STRESS), "a stiffness")]
LeakageField = Annotated[float, WithUnit(FIELD, above=0.0)]


class Stop(Section):
    """When a simulation ends."""

    at: Annotated[str, OneOf(lambda: [*names(), END])] | None = Field(
        None,
        description="The event at which the simulation stops, or the end of the last step. Default: breakdown, or the first "
        "failure where no breakdown field is known. With breakdown, or by default, a film whose boundary is clamped along an axis, "
        "frame or strip also stops at loss of tension; where only steps hold its edges it goes on, and the event is listed.",
    )


class SourceSection(Section):
    """The source of the voltage."""

    resistance: Resistance = Field(
        description="Resistance between the source and the electrode; needs film.electrode_diameter. The voltage of the electrode "
        "is that of the source minus resistance times current. A disturbance over a time (pull_in.timescale) shorter "
        "than the time constant of the circuit is at constant charge, a longer one at constant voltage; a film that "
        "runs away only as fast as the circuit charges it has no pull-in."
    )


class LeakageSection(Section):
    """Current through the film: the current density is conductivity exp(field/E_c) times the true field."""

    conductivity: Conductivity = Field(description="Conductivity at a small field.")
    field: LeakageField | None = Field(
        None,
        description="Increase E_c of the true field over which the conductivity grows by a factor e. Default: constant "
        "conductivity.",
    )


class FilmOutput(OutputSection):
    """The times of the result."""

    electrical: bool | None = Field(
        None,
        description="Whether to write charge, current, work of the edges and energies, and the efficiency of cycles. Default: true "
        "with charges, [source], [leakage], or steps that move the edges, open the circuit or repeat. Charge and current are per "
        "undeformed area; with film.electrode_diameter also in C and A. "
        'Not with boundary = "frame" or "strip".',
    )
    profile: AscendingTimes | None = Field(
        None,
        description="Times at which profile.csv holds stretches and stresses over the radius of a film in a frame, or along a "
        "strip. Its column radius [1] is the radius over that of the electrode, or the place along the strip over half the length "
        "of the electrode; 1 stands there twice, for both sides of the electrode's edge.",
    )


class SpringSection(Section):
    """A spring between the edges of the film and a wall. The film's nominal stress when the programme begins is that of the dead
    load; from then on it falls as the film stretches. A stress or a force in a step is that of the spring at the stretch at which
    the programme began.
    """

    stiffness: Stiffness = Field(
        description="Force over displacement, which needs length and film.width; or nominal stress over the change of stretch."
    )
    length: Length | None = Field(None, description="Undeformed length of the film between its edges along the axis of the spring.")
    axis: Literal[1, 2] | None = Field(None, description="Axis along which it acts. Default: both.")

    def check_film(self, film: FilmBase) -> None:
        """`InputError` for a spring that cannot hold this film."""
        if self.stiffness[1] == STRESS.unit and self.length is not None:
            raise InputError("has no effect beside a stiffness in Pa: leave it out", key="film.spring.length")
        if self.stiffness[1] != STRESS.unit and self.length is None:
            instead = f"{STIFFNESS.unit} needs the length of the film between its edges, or state a stiffness in Pa"
            raise InputError(instead, key="film.spring.length")
        if self.stiffness[1] != STRESS.unit and film.width is None:
            raise InputError(f"a spring in {STIFFNESS.unit} needs the width of the film", key="film.width")
        if self.stiffness[0] <= 0:
            raise InputError(f"{self.stiffness[0]:g}: it must be positive", key="film.spring.stiffness")
        if film.shares is not None:
            raise InputError(f'boundary = "{film.boundary[0]}" holds the film: leave it out', key="film.spring")
        for axis in self.axes:
            if film.boundary[axis] != "dead-load":
                raise InputError(f'a spring along axis {axis + 1} is for boundary "dead-load" alone', key="film.spring")

    @property
    def axes(self) -> tuple[int, ...]:
        """The axes, from 0, along which it acts."""
        return (0, 1) if self.axis is None else (self.axis - 1,)

    def in_pascal(self, film: FilmBase, thickness_factor: float) -> tuple[float | None, float | None]:
        """The stiffness in Pa along both axes of a film, whose thickness is multiplied by the factor."""
        found: list[float | None] = [None, None]
        for axis in self.axes:
            stiffness, unit = self.stiffness
            if unit != STRESS.unit and self.length is not None:
                stiffness *= self.length / (thickness_factor * film.thickness * film.width_across(axis))
            found[axis] = stiffness
        return found[0], found[1]


class FilmSection(OneFilm):
    """The film of an actuation experiment."""

    electrode_share: Share | None = Field(None, description=SHARE_TEXT)
    spring: SpringSection | None = Field(None, description="A spring that holds the edges instead of a dead load.")

    @property
    def electrode_area(self) -> float | None:
        """The area of the electrode on the undeformed film in m^2, None if its diameter is not stated."""
        if self.electrode_diameter is None:
            return None
        return float(0.25 * np.pi * self.electrode_diameter**2 / (self.prestretch[0] * self.prestretch[1]))

    def stiffness(self, thickness_factor: float) -> tuple[float | None, float | None]:
        """The stiffness in Pa of the spring along both axes, None without one; the thickness is multiplied by the factor."""
        return (None, None) if self.spring is None else self.spring.in_pascal(self, thickness_factor)


class LimitsSection(Section):
    """limits.csv and limits.png: the voltages over stretch at which the relaxed film breaks down, pulls in or loses tension, with
    the cycle of the programme.
    """

    stretch: Pair[float] = Field(description="Smallest and largest stretch of axis 1 that are shown.")
    points: int = Field(200, ge=2, le=100_000, description="Number of stretches.")
    rupture_stretch: float | None = Field(None, gt=1, description="Stretch at which the film tears. Default: unknown.")

    def _check(self) -> None:
        if not 1 <= self.stretch[0] < self.stretch[1] < float("inf"):
            raise InputError(f"{self.stretch}: two stretches in order, of at least 1, are needed", key="stretch")


class ActuateRecipe(SimulationRecipe):
    """Voltage or charge history -> stretch of a prestretched film, and its failure."""

    QUANTITIES: ClassVar = FILMS

    kind: Literal["actuate"] = Field(description="The subcommand that runs this recipe.")
    film: FilmSection = Field(description="The film, and its prestretch before the voltage.")
    control: Literal["voltage", "charge"] = Field("voltage", description="The quantity that the source prescribes in all steps.")
    mode: LoadingMode = Field(
        "equibiaxial",
        description="What one stretch, stress or force in a step means: equibiaxial, for both axes; uniaxial, for axis 1, and "
        "axis 2 is free of stress; pure-shear, for axis 1, and axis 2 is held at its present stretch.",
    )
    step: Annotated[list[SourceStep], starting(0.0)] = Field(min_length=1, description="Load history.")
    limits: LimitsSection | None = Field(None, description="A map of the states that the film can be in.")
    repeat: Repetition | None = Field(None, description="A cycle of steps, such as that of a generator.")
    source: SourceSection | None = Field(None, description="Source of voltage with a resistance.")
    leakage: LeakageSection | None = Field(None, description="Leakage current through the film. Default: none.")
    output: FilmOutput = Field(FilmOutput(), description="The times of the result, and further tables.")
    breakdown: BreakdownField | None = Field(None, description="Law of the breakdown field. Default: that of the material.")
    pull_in: PullInSection = Field(default_factory=PullInSection, description="The pull-in criterion.")
    solver: FilmSolver = Field(FilmSolver(), description="How exactly the equations are solved.")
    stop: Stop = Field(Stop(), description="When the simulation ends.")
    uncertainty: FilmUncertainty | None = Field(
        None, description="Intervals of actuate.csv and events.csv, from draws of the material and of films."
    )
    sensitivity: bool = Field(False, description=SENSITIVITY_TEXT + " The time to failure is that of the first failure event.")

    @property
    def electrical(self) -> bool:
        """Whether charge, current and energies are written."""
        stated, more = self.output.electrical, (self.control == "charge", self.source, self.leakage, self.programme)
        return any(part not in (None, False) for part in more) if stated is None else stated

    @property
    def programme(self) -> bool:
        """Whether edges move, or the circuit opens, or steps repeat."""
        return self.repeat is not None or self.film.spring is not None or any(step.moves for step in self.step)

    @property
    def held(self) -> tuple[str, ...]:
        """What holds the edges along both axes throughout; empty where steps change it."""
        if any(set(step.moves) - {"circuit"} for step in self.step):
            return ()
        springs = () if self.film.spring is None else self.film.spring.axes
        return tuple("spring" if axis in springs else name for axis, name in enumerate(self.film.boundary))

    def _check(self) -> None:
        super()._check()
        self._check_programme()
        self._check_steps()
        self._check_source_and_boundary()
        if self.output.noise is not None:
            raise InputError("only relax and creep make test data with noise", key="output.noise")

    def lacking(self, quantity: Quantity) -> list[str]:
        """What the quantity needs that the recipe does not state."""
        stated = {
            SOURCE: self.source is not None,
            LEAKAGE: self.leakage is not None,
            ON_REQUEST: self.electrical,
            ELECTRODE: self.film.electrode_diameter is not None,
        }
        return [needed for needed in quantity.needs if not stated[needed]]

    def _check_programme(self) -> None:
        """`InputError` for steps of edges and electrodes that the film, the source or the other steps do not allow."""
        wrong = Mistakes()
        if self.film.shares is not None:
            framed = f'of a film with boundary = "{self.film.boundary[0]}"'
            if self.repeat is not None:
                wrong.append(Problem(f"the steps {framed} do not repeat: state a waveform, or each step", key="repeat"))
            if self.limits is not None:
                text = f"the states {framed} are not those of one stretch: leave it out, or see failure-map and design"
                wrong.append(Problem(text, key="limits"))
        held = f'with boundary = "{self.film.boundary[0]}" the edges of the film stay, and its circuit is closed'
        for index, step in enumerate(self.step):
            if self.film.shares is not None:
                wrong += [Problem(f'{held}: leave it out, or state "dead-load"', key=f"step[{index}].{key}") for key in step.moves]
            elif step.force is not None and self.film.width is None:
                wrong.append(Problem("needs the width of the film: state film.width, or stress", key=f"step[{index}].force"))
            if self.programme and self.source is not None and step.charge is not None:
                instead = "a source with a resistance prescribes a voltage: state a voltage, or leave [source] out"
                wrong.append(Problem(instead, key=f"step[{index}].charge"))
        if self.programme and self.control == "charge":
            text = "each step of this programme states what it prescribes: leave control out"
            wrong.append(Problem(text, key="control"))
        if self.repeat is not None:
            wrong += [Problem(text, key=f"repeat.{key}") for key, text in self.repeat.mistakes(self.step)]
        wrong.refuse()
        if self.film.spring is not None:
            self.film.spring.check_film(self.film)

    def _check_steps(self) -> None:
        """`InputError` for steps that prescribe another quantity than the control, or a charge without the electrode's size."""
        wrong = Mistakes()
        other, mismatch = "charge" if self.control == "voltage" else "voltage", f'does not go with control = "{self.control}"'
        for index, step in enumerate(self.step):
            if step.columns is not None and getattr(step.columns, other) is not None and not self.programme:
                wrong.append(Problem(f"a column of the {other} {mismatch}", key=f"step[{index}].columns.{other}"))
            for key, unit in step.stated.items():
                text = None
                if (unit == VOLTAGE.unit) != (self.control == "voltage") and not self.programme:
                    text = f'a {other} {mismatch}: all steps prescribe {self.control}s, or state control = "{other}"'
                elif unit == CHARGE.unit and self.film.electrode_diameter is None:
                    text = f'a charge needs film.electrode_diameter, or state a charge density, such as "{CHARGE_DENSITY.example}"'
                if text is not None:
                    wrong.append(Problem(text, key=f"step[{index}].{key}"))
        wrong.refuse()

    def _check_source_and_boundary(self) -> None:
        """`InputError` for keys of the film, its source and its output that do not go together."""
        if self.source is not None and self.control == "charge":
            raise InputError(
                'control = "charge" prescribes the current, so that a resistance has no effect: leave [source] out', key="source"
            )
        if self.source is not None and self.source.resistance > 0 and self.film.electrode_diameter is None:
            needed = "the current through it depends on the size of the electrode: state film.electrode_diameter"
            raise InputError(needed, key="source.resistance")
        of_steps = any(step.force is not None for step in self.step) or self.film.spring is not None
        self.film.check_boundary(self.solver, swept="film.boundary" in (self.sweep or ()), spare_widths=of_steps)
        if self.output.profile is not None and self.film.shares is None:
            raise InputError('a profile needs a film with a passive part, boundary = "frame" or "strip"', key="output.profile")
        if self.film.shares is not None:
            stated = {
                "control": self.control == "charge",
                "source": self.source is not None,
                "leakage": self.leakage is not None,
                "output.electrical": bool(self.output.electrical),
            }
            only = f'a film with boundary = "{self.film.boundary[0]}" takes an ideal source of voltage alone'
            text = f'{only}: leave it out, or state "dead-load" or "clamped"'
            Mistakes(Problem(text, key=key) for key, is_stated in stated.items() if is_stated).refuse()
