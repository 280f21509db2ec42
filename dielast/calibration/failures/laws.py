"""Laws that failures are fitted to: their parameters, their material, and further films under them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from dielast.base.units import GAS_CONSTANT, ZERO_CELSIUS
from dielast.calibration.failures.exposures import Aged, Envelope
from dielast.calibration.failures.histories import Histories
from dielast.calibration.failures.law_names import DAMAGE_LAWS
from dielast.calibration.failures.likelihood import FailureModel, Location
from dielast.io.result import Result
from dielast.material.breakdown import Breakdown, PowerBreakdown
from dielast.material.damage import EyringDamage, InversePower
from dielast.material.material import Material
from dielast.numerics.arrays import Cases, Floats

BARRIER = 1e4  # J/mol, in which activation energies are coordinates
HOUR = 3600.0


@dataclass(frozen=True, slots=True)
class LawOptions(Result):
    """Options of a fit: the `scatter` by name, the `time` in s for which `damage.field` holds, the `nodes` of a table of
    breakdown fields over prestretch (by default all prestretches with failures), and the area in m^2, temperature in degC and
    relative humidity for which constants hold; of area and humidity, None is the geometric mean of the specimens. `known` are
    values of coordinates that are not fitted.
    """

    scatter: str = "weibull"
    time: float = HOUR
    nodes: tuple[float, ...] | None = None
    reference_area: float | None = None
    reference_temperature: float = 20.0
    reference_humidity: float | None = None
    known: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class LawParameter:
    """A parameter by its path in a material file, with the `coordinate` that it is a function of: factor e^(sign x), or factor
    x^sign if it is `linear`.
    """

    name: str
    unit: str
    coordinate: int
    factor: float = 1.0
    sign: int = 1
    linear: bool = False

    def value(self, x: Any) -> Any:
        """The value at coordinates of any shape."""
        if self.linear:
            return self.factor * (x if self.sign > 0 else 1 / np.asarray(x, dtype=float))
        return self.factor * np.exp(self.sign * np.asarray(x, dtype=float))

    def slope(self, x: float) -> float:
        """The magnitude of the derivative of the value."""
        if self.linear:
            return abs(self.factor) if self.sign > 0 else abs(self.factor) / x**2
        return abs(float(self.value(x)))


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class LawModel(Result):
    """A law by `name` with its likelihood `model` for the specimens `rows`, its `parameters` and coordinates `known` by name."""

    name: str
    model: FailureModel
    rows: Cases
    parameters: tuple[LawParameter, ...]
    known: Mapping[str, float]
    options: LawOptions
    nodes: tuple[float, ...] = ()
    reference_thickness: float | None = None
    has_energy: bool = False

    @property
    def is_damage(self) -> bool:
        """Whether failures come by damage."""
        return self.name in DAMAGE_LAWS

    def material(self, material: Material, at: Floats) -> Material:
        """The material with this law at coordinates (p,), and without any other law of failure."""
        numbers = {parameter.name: float(parameter.value(at[parameter.coordinate])) for parameter in self.parameters}
        options, section = self.options, "damage" if self.is_damage else "breakdown"
        scatter = {name: numbers.get(f"{section}.{name}") for name in ("shape", "relative")}
        area = options.reference_area if scatter["shape"] is not None else None
        if self.name == "table":
            several = [numbers[f"breakdown.field[{k}]"] for k in range(len(self.nodes))] if len(self.nodes) > 1 else []
            fields = tuple(several or [numbers["breakdown.field"]])
            law: Any = Breakdown(self.nodes, fields, **scatter, reference_area=area)
        elif self.name == "power":
            exponents = {key: numbers.get(f"breakdown.{key}", 0.0) for key in ("stretch_exponent", "thickness_exponent")}
            known = {f"{key}": self.known[key] for key in exponents if key in self.known}
            thick = self.reference_thickness if (exponents | known)["thickness_exponent"] else None
            more_of: Any = scatter | exponents | known
            law = PowerBreakdown(numbers["breakdown.field"], **more_of, reference_thickness=thick, reference_area=area)
        else:
            energy = numbers.get("damage.activation_energy") if self.has_energy else None
            more = {"shape": scatter["shape"], "reference_area": area, "activation_energy": energy}
            if self.name == "eyring":
                law = EyringDamage(numbers["damage.field"], options.time, numbers["damage.activation_field"], **more)
            else:
                law = InversePower(numbers["damage.field"], options.time, numbers["damage.exponent"], **more)
        return replace(material, breakdown=None if self.is_damage else law, damage=law if self.is_damage else None)

    def along(self, histories: Histories, prestretch: Floats, thickness: Floats, temperature: Floats, at: Floats) -> Floats:
        """v (k, films, rows) along the histories of further films, of a mean batch and the reference humidity, at coordinates
        (k, p).

        `prestretch` sqrt(l1 l2), undeformed `thickness` in m and `temperature` in degC are (films,).
        """
        films, rows = histories.time.shape
        own, slope, _ = self.model.parts(at)
        location = self._location_of(prestretch, temperature)
        place = location.at(own, slope)[0]
        if self.is_damage:
            assert isinstance(self.model.exposure, Aged)
            aged = Aged.at_rows(histories, self.model.exposure.ageing)
            y = aged.at(slope).y.reshape(at.shape[0], films, rows)
            return np.asarray(y - place[:, :, None])
        with np.errstate(divide="ignore"):
            y = np.log(histories.field)[None]
        if self.name == "power":
            assert isinstance(self.model.exposure, Envelope)
            a, b = slope[:, 0, None, None], slope[:, 1, None, None]
            thinner = np.log((self.reference_thickness or 1.0) / thickness)[None, :, None] if self.reference_thickness else 0.0
            y = y - (a + 2 * b) * np.log(histories.stretch) - b * thinner
        return np.maximum.accumulate(np.broadcast_to(y, (at.shape[0], films, rows)), axis=2) - place[:, :, None]

    def _location_of(self, prestretch: Floats, temperature: Floats) -> Location:
        """The location of films of a mean batch."""
        known, films = self.model.location, prestretch.size
        factors = np.zeros((films, known.factors.shape[1]))
        if self.has_energy:
            factors[:, known.of_factors.index("activation_energy")] = barrier(temperature, self.options.reference_temperature)
        return known.elsewhere(factors, interpolating(prestretch, self.nodes))


def interpolating(prestretch: Floats, nodes: Sequence[float]) -> Floats:
    """The weights (n, nodes) by which values at nodes are interpolated, constant outside."""
    if len(nodes) < 2:
        return np.ones((prestretch.size, 1))
    return np.array([np.interp(prestretch, nodes, row) for row in np.eye(len(nodes))]).T


def barrier(temperature: Floats, reference: float) -> Floats:
    """The factor of an activation energy in units of `BARRIER` in the log of a life (Arrhenius)."""
    return np.asarray(BARRIER / GAS_CONSTANT * (1 / (temperature + ZERO_CELSIUS) - 1 / (reference + ZERO_CELSIUS)))
