"""The states that an elastic film can be in: the voltage over stretch at which it breaks down, pulls in or loses tension.

The map of a generator (Koh, Keplinger, Li, Bauer and Suo, IEEE/ASME Trans. Mechatron. 16 (2011) 33), for the equilibrium spring
alone, as of a film that has relaxed at each stretch: a cycle inside all limits is one that the relaxed film survives.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from dielast.base.errors import InputError
from dielast.io.result import TabularResult
from dielast.io.table import Column, Table
from dielast.material.law import BreakdownLaw
from dielast.material.material import Material
from dielast.material.spectrum import Spectrum
from dielast.mechanics.jump import jump
from dielast.mechanics.load import Mode
from dielast.mechanics.point_material import PointMaterial
from dielast.mechanics.span import Control, Controls
from dielast.mechanics.stability import stability
from dielast.numerics.arrays import Flags, Floats

HALVINGS, STRONGEST = 60, 1e9  # of the nominal field, and its largest value in V/m
FREE = (Control.STRESS, Control.STRESS)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Limits(TabularResult):
    """Voltages (k,) in V over the `stretch` (k,) of axis 1, at which a film of the given thickness fails: by `breakdown`, by
    `pull_in` under a dead load, or by `loss_of_tension`; infinite where no voltage does it. It tears at the `rupture_stretch`, None
    if that is not known.
    """

    stretch: Floats
    breakdown: Floats
    pull_in: Floats
    loss_of_tension: Floats
    rupture_stretch: float | None = None

    def columns(self) -> Table:
        """The table of all stretches."""
        named = {name: getattr(self, name) for name in ("breakdown", "pull_in", "loss_of_tension")}
        return [Column("stretch_1", "1", self.stretch), *(Column(f"{name}_voltage", "V", values) for name, values in named.items())]


def film_limits(
    material: Material,
    stretch: ArrayLike,
    *,
    thickness: float,
    mode: Mode | str = Mode.EQUIBIAXIAL,
    held: float = 1.0,
    temperature: float | None = None,
    breakdown: BreakdownLaw | None = None,
    rupture_stretch: float | None = None,
) -> Limits:
    """The limits of a film of undeformed `thickness` in m over the `stretch` (k,) of axis 1.

    Axis 2 is that of the mode, at the stretch `held` under pure shear; `breakdown` is by default the law of the material. Raises
    `InputError` for stretches below 1 or beyond the limit of the spring, and without a permittivity.
    """
    at, mode = np.atleast_1d(np.asarray(stretch, dtype=float)), Mode.of(mode)
    if at.ndim != 1 or not np.all(np.isfinite(at) & (at >= 1)):
        raise InputError("stretches of at least 1 are needed", argument="stretch")
    if not material.permittivity:
        raise InputError(f"{material.name!r} has no permittivity, which a film under voltage needs", argument="material")
    there = material.reference_temperature if temperature is None else temperature
    relaxed = replace(material, spectrum=Spectrum(np.zeros(0), np.zeros(0)))
    points = PointMaterial.of(relaxed, np.full(at.size, there), 1e-9)
    second = {Mode.UNIAXIAL: at**-0.5, Mode.PURE_SHEAR: np.full_like(at, held)}.get(mode, at)
    begin = 2 * np.log(np.array((at, second)))
    if np.any(points.law.margin(np.exp(begin[:, None])) <= 0):
        raise InputError(f"stretch {at.max():g} is beyond the limit of the spring", argument="stretch")
    across = Control.STRESS if mode is Mode.UNIAXIAL else Control.STRETCH
    internal = np.zeros((2, 1, at.size))
    law = material.breakdown if breakdown is None else breakdown

    def films(field: Floats) -> tuple[Floats, Floats, Flags]:
        target = np.array((at, np.zeros_like(at) if across is Control.STRESS else second, field))
        return jump(points, (Control.STRETCH, across), target, internal, begin)

    def tense(field: Floats) -> Flags:
        _, stress, stable = films(field)
        tensions = stress[:1] if across is Control.STRESS else stress
        return np.asarray(np.all(tensions > 0, axis=0) & stable)

    def stays(field: Floats) -> Flags:
        log_squared, stress, stable = films(field)
        free: Controls = FREE if mode is not Mode.PURE_SHEAR else (Control.STRESS, Control.STRETCH)
        return np.asarray(stable & (stability(points, free, internal, log_squared, stress, field).margin > 0))

    def withstands(field: Floats) -> Flags:
        log_squared, _, stable = films(field)
        area = np.exp(0.5 * (log_squared[0] + log_squared[1]))
        assert law is not None
        return np.asarray(stable & (field * area < law.of_film(np.sqrt(area), thickness / area)))

    broken = np.full(at.size, np.inf) if law is None else _first(withstands, at.size)
    stable, taut = _first(stays, at.size), _first(tense, at.size)
    return Limits(at, thickness * broken, thickness * stable, thickness * taut, rupture_stretch)


def _first(holds: Callable[[Floats], Flags], count: int) -> Floats:
    """The largest nominal field (count,) in V/m up to which films hold, by halving; infinite where they hold any."""
    low, high = np.zeros(count), np.full(count, STRONGEST)
    endless = holds(high)
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        good = holds(middle)
        low, high = np.where(good, middle, low), np.where(good, high, middle)
    return np.where(endless, np.inf, high)
