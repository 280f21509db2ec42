"""`[film]` and `[pull_in]`: the film under voltage, in recipes of actuate, failure-map and design."""

from __future__ import annotations

from contextlib import suppress
from math import nan
from sys import float_info
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field, PlainValidator, WithJsonSchema

from dielast.base.errors import InputError, nearest, shown
from dielast.base.units import COMPUTABLE, FORCE, LENGTH, STRAIN, TIME, parse
from dielast.commands.simulation.recipe import Solver
from dielast.recipe.fields import Length, Section, StrainRate, Time, WithUnit, one_or_more, schema_of_one_or_more
from dielast.simulate.options import MESH_RTOL

if TYPE_CHECKING:
    from dielast.mechanics.stability import TimeScale
    from dielast.simulate.film_setup import Film

BOUNDARIES = ("dead-load", "clamped")
PASSIVE = ("frame", "strip")


def _boundary(value: Any) -> tuple[str, str]:
    """The boundary of axes 1 and 2; twice the same for a frame or a strip."""
    if value in PASSIVE:
        return str(value), str(value)
    pair = value if isinstance(value, list) else [value, value]
    if len(pair) != 2 or any(entry not in BOUNDARIES for entry in pair):
        needed = '"dead-load" or "clamped" is needed, or a pair of them, one for each axis; or "frame" or "strip"'
        if isinstance(value, str):
            needed = nearest(value, (*BOUNDARIES, *PASSIVE))
        raise InputError(f"{shown(value)}: {needed}")
    return pair[0], pair[1]


def prestretch_of(value: Any) -> tuple[float, float]:
    """The prestretch of axes 1 and 2."""
    pair = value if isinstance(value, list) else [value, value]
    if len(pair) != 2 or not all(_is_number(entry) and 1 <= entry <= float_info.max for entry in pair):
        strain = next((strain for entry in pair if (strain := _strain(entry)) is not None), None)
        hint = "" if strain is None else f"; a prestretch is 1 + strain: if that is a strain, write {1 + strain:g}"
        raise InputError(f"{shown(value)}: a prestretch of at least 1 is needed, or a pair such as [3.0, 1.0]{hint}")
    return float(pair[0]), float(pair[1])


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _strain(value: Any) -> float | None:
    """The strain that was probably meant: a number between 0 and 1, or per cent; else None."""
    with suppress(InputError):
        return parse(value, STRAIN, COMPUTABLE)
    return float(value) if _is_number(value) and 0 < value < 1 else None


ONE_PRESTRETCH = {"anyOf": [{"type": "number"}, {"type": "array", "items": {"type": "number"}, "minItems": 2, "maxItems": 2}]}
_ONE_BOUNDARY = {"enum": list(BOUNDARIES)}
Boundary = Annotated[
    tuple[str, str],
    PlainValidator(_boundary),
    WithJsonSchema(
        {"anyOf": [{"enum": [*BOUNDARIES, *PASSIVE]}, {"type": "array", "items": _ONE_BOUNDARY, "minItems": 2, "maxItems": 2}]}
    ),
]
Prestretch = Annotated[tuple[float, float], PlainValidator(prestretch_of), WithJsonSchema(ONE_PRESTRETCH)]


def _timescale(value: Any) -> tuple[float, bool]:
    """A share of the time since the voltage came on (True), or a time in s (False)."""
    for dimension, is_share in ((STRAIN, True), (TIME, False)):
        with suppress(InputError):
            if (number := parse(value, dimension, COMPUTABLE)) >= 0:
                return number, is_share
    raise InputError(
        f'{shown(value)}: a share of the time since the voltage came on, such as "1 %", or a time, such as "0 s", is needed'
    )


StatedTimeScale = Annotated[
    tuple[float, bool], PlainValidator(_timescale), WithJsonSchema({"type": "string", "examples": ["1 %", "0 s", "0.1 s"]})
]


class PullInSection(Section):
    """The pull-in criterion: det H = 0, each branch weighted by the part of its stress that outlasts the time scale."""

    timescale: StatedTimeScale = Field(
        default_factory=lambda: (0.01, True),
        description="Time over which a disturbance must grow: a time, or a share of the time since the magnitude of the voltage "
        'last began to rise, after a hold or a fall. "0 s" is the criterion det H = 0 without any relaxation.',
        json_schema_extra={"default": "1 %"},
    )

    @property
    def criterion(self) -> TimeScale:
        """The time scale as the criterion takes it."""
        from dielast.mechanics.stability import TimeScale  # slow to import

        number, is_share = self.timescale
        return TimeScale.fraction(number) if is_share else TimeScale.fixed(number)


def _share(value: Any) -> float:
    """A share between 0 and 1, as a number or in per cent."""
    number = value if _is_number(value) else nan
    with suppress(InputError):
        number = parse(value, STRAIN, COMPUTABLE)
    if not 0 < number < 1:
        whole = ': an electrode as large as the frame or the strip is boundary = "clamped"' if number == 1 else ""
        raise InputError(f'{shown(value)}: a share between 0 and 1 is needed, such as 0.05 or "5 %"{whole}')
    return float(number)


_SHARE_SCHEMA = {
    "anyOf": [{"type": "number", "exclusiveMinimum": 0, "exclusiveMaximum": 1}, {"type": "string", "examples": ["5 %"]}]
}
SHARE_TEXT = "Radius of the electrode over that of the frame, or length of the electrode over that of the strip."
Share = Annotated[float, PlainValidator(_share), WithJsonSchema(_SHARE_SCHEMA)]
Shares = Annotated[
    tuple[float, ...],
    PlainValidator(lambda value: one_or_more(value, _share, "a share between 0 and 1")),
    WithJsonSchema(schema_of_one_or_more(_SHARE_SCHEMA)),
]


Forces = Annotated[tuple[float, ...], WithUnit(FORCE, at_least=0.0, many=True)]
Widths = Annotated[tuple[float, ...], WithUnit(LENGTH, above=0.0, many=True)]


class FilmSolver(Solver):
    """How exactly the equations of films are solved."""

    mesh_rtol: float = Field(
        MESH_RTOL,
        ge=1e-12,
        le=1e-2,
        description="Relative tolerance of the mesh of the passive film around a disc, for the voltage at which the film is at "
        "rest.",
    )


def _as_tuple(value: float | tuple[float, ...]) -> tuple[float, ...]:
    return value if isinstance(value, tuple) else (value,)


class FilmBase(Section):
    """The keys that the films of actuate, failure-map and design share.

    A subclass has the keys `prestretch` and `electrode_share` as well, with a value for one film, or an axis of a grid.
    """

    thickness: Length = Field(description="Undeformed thickness.")
    prestretch_rate: StrainRate | None = Field(
        None, gt=0, description="Rate of the larger prestretch; both axes ramp together. Default: at once."
    )
    relax: Time = Field(0.0, validate_default=False, description="Time at constant prestretch before the voltage.")
    boundary: Boundary = Field(
        default_factory=lambda: ("dead-load", "dead-load"),
        description="What is constant under voltage: the nominal stress (dead-load) or the stretch (clamped), for both axes or "
        "as a pair. Or what carries the passive film around the electrode: a circular frame, or the bars of a strip "
        "of constant width.",
        json_schema_extra={"default": "dead-load"},
    )
    force: Forces | None = Field(
        None,
        description="Weight that hangs on the film from the beginning, along axis 1, or one for each axis: a dead load. State "
        'prestretch 1 for an axis with a weight. "0 N" is an axis free of stress.',
    )
    width: Widths | None = Field(None, description="Undeformed width of the film across each force.")
    electrode_diameter: Length | None = Field(
        None,
        description="Diameter of the electrode on the prestretched film; needed with frame_diameter, for a charge in C, for the "
        "resistance of a source and for measured axes of the electrode.",
    )
    frame_diameter: Length | None = Field(
        None, description="Inner diameter of the rigid frame; with electrode_diameter, instead of electrode_share."
    )

    @property
    def thicknesses(self) -> tuple[float, ...]:
        """The undeformed thickness in m of each film."""
        return _as_tuple(self.thickness)

    @property
    def prestretches(self) -> tuple[tuple[float, float], ...]:
        """The prestretch of axes 1 and 2 of each film."""
        film: Any = self
        return film.prestretch if isinstance(film.prestretch[0], tuple) else (film.prestretch,)

    @property
    def stated_shares(self) -> tuple[float, ...] | None:
        """The values of electrode_share."""
        film: Any = self
        return None if film.electrode_share is None else _as_tuple(film.electrode_share)

    @property
    def weights(self) -> tuple[tuple[float | None, float | None], tuple[float | None, float | None]]:
        """Forces in N and widths in m of axes 1 and 2."""
        weights, count = self.force or (), len(self.force or ())
        forces, widths = ((*values[:count], None, None) for values in (weights, self.width or ()))
        return (forces[0], forces[1]), (widths[0], widths[1])

    def width_across(self, axis: int) -> float:
        """The undeformed width in m across an axis, from 0; the only one, if one is stated."""
        widths = self.width or ()
        return widths[min(axis, len(widths) - 1)]

    def setup(self, **of_films: Any) -> Film:
        """The films as the library takes them, with what else of them is stated: prestretch, electrode share, temperature."""
        from dielast.simulate.film_setup import Film  # slow to import

        force, width = self.weights
        shared = {"prestretch_rate": self.prestretch_rate, "relax": self.relax, "boundary": self.boundary}
        return Film(**{"thickness": self.thickness, **shared, "force": force, "width": width, **of_films})

    def check_weights(self, spare_widths: bool = False) -> None:
        """`InputError` for weights that cannot hang on the film; `spare_widths` are for other forces."""
        forces, widths = self.force or (), self.width or ()
        if spare_widths:
            widths = widths[: len(forces)]
        if len(forces) > 2:
            raise InputError(f"{len(forces)} forces: one, or one for each of two axes", key="film.force")
        if len(forces) != len(widths):
            raise InputError(f"a width for each force is needed: forces {len(forces)}, widths {len(widths)}", key="film.width")
        for axis in range(len(forces)):
            if self.boundary[axis] != "dead-load":
                raise InputError(f'a weight along axis {axis + 1} is for boundary "dead-load" alone', key="film.force")
            if any(pair[axis] != 1 for pair in self.prestretches):
                text = f"axis {axis + 1} is stretched by its weight: its prestretch must be 1"
                raise InputError(text, key="film.prestretch")

    @property
    def shares(self) -> tuple[float, ...] | None:
        """The electrode's share of each film with a passive part: of the diameter of a frame, or of the length of a strip."""
        if self.boundary[0] not in PASSIVE:
            return None
        stated = self.stated_shares
        if stated or self.electrode_diameter is None or self.frame_diameter is None:
            return stated
        return (self.electrode_diameter / self.frame_diameter,)

    def check_boundary(self, solver: FilmSolver, *, swept: bool = False, spare_widths: bool = False) -> None:
        """`InputError` for keys of the boundary that do not fit each other.

        Where the boundary is `swept`, keys that only a film with a passive part needs may stand beside other boundaries as well.
        """
        self.check_weights(spare_widths)
        boundary, stated = self.boundary[0], self.stated_shares
        if boundary != "frame" and not swept and "mesh_rtol" in solver.model_fields_set:
            raise InputError('has no effect without boundary = "frame": leave it out', key="solver.mesh_rtol")
        if boundary in PASSIVE:
            self._check_passive(boundary)
        elif stated is not None and not swept:
            raise InputError('needs boundary = "frame" or "strip", a film with a passive part', key="film.electrode_share")
        elif self.frame_diameter is not None and not swept:
            raise InputError('needs boundary = "frame", a film with a passive part', key="film.frame_diameter")

    def _check_passive(self, boundary: str) -> None:
        """`InputError` unless the keys state one electrode share for a frame or a strip."""
        stated = self.stated_shares
        if self.frame_diameter is not None:
            wrong = None
            if boundary == "strip":
                wrong = "a strip has no frame: state electrode_share, the electrode's share of the length of the strip"
            elif stated is not None:
                wrong = "electrode_share and frame_diameter state the same: leave one of them out"
            elif self.electrode_diameter is None:
                wrong = "the diameter of the electrode is needed as well: state electrode_diameter"
            if wrong is not None:
                raise InputError(wrong, key="film.frame_diameter")
        if self.shares is None:
            ways = "electrode_share, " + ("or electrode_diameter and frame_diameter" if boundary == "frame" else "of its length")
            raise InputError(f"{shown(boundary)} needs the electrode's share of the film: state {ways}", key="film.boundary")
        if stated is None and max(self.shares) >= 1:
            large = f"an electrode of {self.electrode_diameter:g} m leaves no film in a frame of {self.frame_diameter:g} m"
            raise InputError(f'{large}: without a passive film it is boundary = "clamped"', key="film.electrode_diameter")
        if boundary == "frame" and (apart := [pair for pair in self.prestretches if pair[0] != pair[1]]):
            instead = 'a round frame needs an equibiaxial one; for a pair use "strip", or "clamped" and "dead-load"'
            raise InputError(f"{list(apart[0])}: {instead}", key="film.prestretch")


class OneFilm(FilmBase):
    """The keys of a film with one prestretch."""

    prestretch: Prestretch = Field(
        default_factory=lambda: (1.0, 1.0),
        description="Equibiaxial prestretch, or a pair such as [3.0, 1.0].",
        json_schema_extra={"default": 1.0},
    )

    @property
    def stretched_to(self) -> tuple[float | None, float | None]:
        """The prestretch of both axes, None for an axis that a weight stretches."""
        forces, _ = self.weights
        first, second = (None if force is not None else value for value, force in zip(self.prestretch, forces, strict=True))
        return first, second
