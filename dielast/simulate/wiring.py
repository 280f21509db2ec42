"""The electrical source of films: voltage or charge, its resistance, and the leakage through the film."""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from dielast.base.errors import InputError
from dielast.material.dielectric import Leakage
from dielast.mechanics.cases import of_case, spread
from dielast.mechanics.electric import Drive, FilmCircuit
from dielast.mechanics.point_material import PointMaterial
from dielast.numerics.arrays import Cases, Floats
from dielast.simulate.film_setup import positive
from dielast.simulate.options import Circuit


@dataclass(frozen=True, slots=True, eq=False)
class Wiring:
    """Whether the source prescribes the `charge`, or else a voltage, through a `resistance` r = R A/L_3 (cases,) in ohm m; in a
    `programme` of edges and electrodes it prescribes one after the other.

    `leakage` has constants (cases,); `area` (cases,) is that of the undeformed electrode in m^2, None if unknown. `stated` are the
    arguments that ask for more than an ideal source of voltage, and `electrical` says whether charge, current and energies are
    computed.
    """

    charge: bool
    resistance: Floats
    leakage: Leakage
    area: Floats | None
    stated: tuple[str, ...]
    electrical: bool
    programme: bool = False

    @classmethod
    def of(
        cls,
        charge: bool,
        circuit: Circuit,
        thickness: Floats,
        electrical: bool | None = None,
        programme: bool = False,
    ) -> Self:
        """The wiring of films of `thickness` (cases,) in m; by default `electrical` if there is anything but a voltage.

        Raises `InputError` for values that are impossible or incomplete.
        """
        cases = thickness.size
        resistance, leakage, area = circuit.resistance, circuit.leakage, circuit.electrode_area
        if resistance is not None and charge:
            raise InputError("a source that prescribes the charge takes no resistance: leave it out", argument="resistance")
        ohm = spread(0.0 if resistance is None else resistance, "resistance", cases)
        if np.any(ohm < 0):
            case = int(np.argmin(ohm))
            raise InputError(f"{ohm[case]:g} ohm: it must not be negative", argument="resistance", case=of_case(case, cases))
        areas = None if area is None else positive(area, "electrode_area", "m^2", cases)
        if np.any(ohm > 0) and areas is None:
            needed = "the current that flows through it depends on the area of the electrode: state it, too"
            raise InputError(needed, argument="resistance")
        leak = Leakage() if leakage is None else leakage
        field = np.broadcast_to(np.asarray(leak.field, dtype=float).reshape(-1), (cases,))
        leak = Leakage(spread(leak.conductivity, "leakage", cases), field)
        r = ohm if areas is None else ohm * areas / thickness
        named = {
            "steps": charge or programme,
            "resistance": resistance is not None,
            "leakage": leakage is not None,
            "electrical": electrical,
        }
        stated = tuple(name for name, is_stated in named.items() if is_stated)
        asked = bool(stated) if electrical is None else electrical
        return cls(charge and not programme, r, leak, areas, stated, asked, programme)

    @property
    def kinds(self) -> Cases:
        """The kind of circuit (cases,) of films, from 0, of which films that run together have the same."""
        leaks, resists = np.asarray(self.leakage.conductivity) > 0, self.resistance > 0
        if self.programme:
            return leaks + 2 * resists.astype(np.intp)
        return (leaks if self.charge else resists).astype(np.intp)

    def take(self, cases: Cases) -> Self:
        """The wiring of the films `cases` (k,)."""
        area = None if self.area is None else self.area[cases]
        return replace(self, resistance=self.resistance[cases], leakage=self.leakage.take(cases), area=area)

    def wires(self, cases: Cases) -> FilmCircuit:
        """The circuit, for all drives, of the films `cases` (k,), all of which have the same kind."""
        resistance = self.resistance[cases] if self.resistance[cases].any() else None
        leakage = self.leakage.take(cases) if np.any(np.asarray(self.leakage.conductivity)[cases]) else None
        return FilmCircuit(leakage, resistance)

    def wired(self, points: PointMaterial, cases: Cases) -> PointMaterial:
        """The points of the films `cases` (k,) with their electrical load and circuit at the beginning."""
        wires, drive = self.wires(cases), Drive.CHARGE if self.charge else Drive.VOLTAGE
        return replace(points, electric=wires.acting(drive), circuit=wires.under(drive))
