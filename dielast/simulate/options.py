"""What a simulation is asked for beside its film and its load: how exactly, until when, and with which circuit."""

from collections.abc import Mapping
from dataclasses import MISSING, dataclass, fields
from typing import Any

from numpy.typing import ArrayLike

from dielast.base.errors import InputError
from dielast.io.result import Result
from dielast.material.argument_types import checked
from dielast.material.breakdown import BreakdownLaw
from dielast.material.dielectric import Leakage
from dielast.mechanics.stability import ONE_PERCENT, TimeScale

LEAST_RTOL, MOST_RTOL = 1e-12, 0.1
MESH_RTOL = 1e-6


@dataclass(frozen=True, eq=False, repr=False)
class Options(Result):
    """A dataclass of arguments whose description has those that differ from their defaults."""

    __slots__ = ()

    def described(self) -> Mapping[str, Any]:
        """What the description lists: the fields by name."""
        return {
            field.name: getattr(self, field.name)
            for field in fields(self)
            if field.default is MISSING or getattr(self, field.name) is not field.default
        }


@checked
@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Solver(Options):
    """How exactly the equations are solved.

    `rtol` bounds the local relative error of stretches (not of stretch - 1), of viscous stretches, and of stresses above 1e-4 of
    the equilibrium modulus. `mesh_rtol` is that of the division of the film around a disc in a frame into points (see
    `mechanics.passive.mesh`). The draws of maps and designs are solved to `drawn_rtol`, by default 5e-4 or `rtol` if it is larger.
    """

    rtol: float = 1e-6
    mesh_rtol: float = MESH_RTOL
    drawn_rtol: float | None = None


@checked
@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Failure(Options):
    """When a film fails, and which event ends its simulation.

    `breakdown_field` is in V/m, one number or one per case, or a law, such as a table over prestretch (the square root of the
    product of both axes); the material's by default; without any, there is no breakdown. `pull_in_timescale` is the time over which
    a disturbance must grow. `stop_at` names the event that ends a run of `actuate`, such as "breakdown", "pull-in" or
    "loss-of-tension", or is "end" for the whole programme; by default breakdown, or the first failure if no breakdown field is
    known. A run to breakdown, or by default, also ends where a film whose boundary holds its edges, or a passive part, loses
    tension; one whose edges steps move goes on.
    """

    breakdown_field: ArrayLike | BreakdownLaw | None = None
    pull_in_timescale: TimeScale = ONE_PERCENT
    stop_at: str | None = None


@checked
@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Circuit(Options):
    """What lies between the source and the film: a source of voltage may have a `resistance` in ohm to an electrode of
    `electrode_area` in m^2 on the undeformed film, and the film may have a `leakage`.
    """

    resistance: ArrayLike | None = None
    leakage: Leakage | None = None
    electrode_area: ArrayLike | None = None


def check_tolerance(rtol: float, argument: str = "rtol") -> None:
    """`InputError` for a relative tolerance outside of [`LEAST_RTOL`, `MOST_RTOL`]."""
    if not LEAST_RTOL <= rtol <= MOST_RTOL:
        raise InputError(f"{rtol:g} is not between {LEAST_RTOL:g} and {MOST_RTOL:g}", argument=argument)
