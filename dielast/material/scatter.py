"""The uncertainty of a material, as draws that scatter like measurements, and the scatter from film to film."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from dielast.base.errors import InputError
from dielast.io.result import TabularResult
from dielast.io.table import Column, Table
from dielast.material.argument_types import checked
from dielast.material.intervals import strata_of_materials
from dielast.material.material import Material
from dielast.material.spectrum import Spectrum
from dielast.numerics.arrays import Floats, Index
from dielast.numerics.random_streams import stream


@checked
@dataclass(frozen=True, slots=True)
class NormalScatter:
    """Normal distribution about the stated value, with standard deviation `relative` (1) times this value, cut off at zero.

    Raises `InputError` unless `relative` is at least 0 and below 1.
    """

    relative: float

    def __post_init__(self) -> None:
        if not 0 <= self.relative < 1:
            raise InputError(f"a relative scatter of {self.relative:g}: at least 0 and below 1 is needed")

    def factors(self, quantile: Floats) -> Floats:
        """Factors on the stated value, of the shape of `quantile`, which lies between 0 and 1."""
        if self.relative == 0:
            return np.ones_like(quantile)
        from statistics import NormalDist  # a slow import

        normal = NormalDist()
        below = normal.cdf(-1 / self.relative)
        inside = below + (1 - below) * np.clip(quantile, 1e-15, 1 - 1e-15)
        return np.array([1 + self.relative * normal.inv_cdf(float(p)) for p in inside.ravel()]).reshape(quantile.shape)


@checked
@dataclass(frozen=True, slots=True)
class WeibullScatter:
    """Weibull distribution: a share 1 - exp(-a x^beta) of the films has at most x times the stated value, with the `shape` beta (1)
    and a = `area_ratio` (1), the area of the films over that for which the value is stated: the weakest spot of a larger film is
    weaker. Raises `InputError` for numbers that are not positive.
    """

    shape: float
    area_ratio: float = 1.0

    def __post_init__(self) -> None:
        for name in ("shape", "area_ratio"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0):
                raise InputError(f"{value:g}: a positive number is needed", argument=name)

    @property
    def typical(self) -> float:
        """The factor that 63.2 % of the films, 1 - 1/e, do not exceed, a^(-1/beta). It is 1 for an area ratio of 1."""
        return float(self.area_ratio ** (-1 / self.shape))

    def factors(self, quantile: Floats) -> Floats:
        """Factors on the stated value, with the shape of `quantile`."""
        return np.asarray((-np.log1p(-np.clip(quantile, 1e-15, 1 - 1e-15)) / self.area_ratio) ** (1 / self.shape))


Scatter = NormalScatter | WeibullScatter


@checked
@dataclass(frozen=True, slots=True)
class SpecimenScatter:
    """Scatter of the stiffness of specimens about a calibrated model: a log-normal factor on all moduli, whose width is not known
    exactly: s = `relative` (1) was estimated from few specimens, with this `freedom` (1).

    s^2 is the variance of the specimens' factors plus that of the model's error. The error of the model changes along a curve: its
    variance at a point, over the squared stress, is that of the estimate, and its correlation along the curve is taken as 1. Bands
    of stresses then have the width of those of a test; quantities that are integrals over a history, such as a creep strain or a
    life, have the widest bands that errors of this size give. Raises `InputError` for numbers that are not positive.

    With the estimate s0 and the freedom n, the width has the density p(s) ~ s^(-n-1) exp(-n s0^2/(2 s^2) - s^2/(2 S^2)): the scaled
    inverse chi-square distribution of the estimate, and a weak prior of normal shape with the scale S = `WIDEST` (Gelman 2006, DOI
    10.1214/06-BA117A, on such priors). Without the prior the logarithm of the factor would have Student's distribution, in which
    few specimens allow for factors of 50; with it, the distribution falls off as exp(-|x|/S) (generalised hyperbolic,
    Barndorff-Nielsen 1977, DOI 10.1098/rspa.1977.0041).
    """

    relative: float
    freedom: float = np.inf

    def __post_init__(self) -> None:
        if not 0 < self.relative < np.inf:
            raise InputError(f"{self.relative:g}: a positive number is needed", argument="relative")
        if not self.freedom > 0:
            raise InputError(f"{self.freedom:g}: a positive number is needed", argument="freedom")

    def deviates(self, quantile: Floats) -> Floats:
        """The logarithm of the factors over `relative`, with the shape of `quantile`."""
        from scipy.special import logsumexp, ndtr, ndtri  # a slow import

        normal = ndtri(np.clip(quantile, 1e-15, 1 - 1e-15))
        if self.freedom >= MOST_FREEDOM:
            return np.asarray(normal)
        # the width over its estimate, t, on a logarithmic scale: -n [ln t + 1/(2 t^2)] falls off on both sides of t = 1
        most = np.log(10 * WIDEST / self.relative) if self.relative < WIDEST else 3.0
        reach = min(12 / np.sqrt(self.freedom) + 40 / self.freedom, max(most, 1.0))
        log = np.linspace(-min(10 / np.sqrt(self.freedom), 4.0), reach, 801)
        weight = -self.freedom * (log + 0.5 * np.exp(-2 * log)) - 0.5 * np.square(np.exp(log) * self.relative / WIDEST)
        weight = np.exp(weight - logsumexp(weight))
        place = np.sinh(np.linspace(0, np.arcsinh(9 * np.exp(log[-1])), 500))
        below = ndtr(-place[:, None] * np.exp(-log)) @ weight
        return np.asarray(np.sign(normal) * np.interp(-np.log(ndtr(-np.abs(normal))), -np.log(np.maximum(below, 1e-300)), place))

    def factors(self, quantile: Floats) -> Floats:
        """The factors on all moduli, with the shape of `quantile`."""
        return np.exp(self.relative * self.deviates(quantile))


MOST_FREEDOM = 1e6  # degrees of freedom beyond which no quantile changes
WIDEST = 0.25  # scale of the width: nearly always below 0.5, by which laboratories differ


@checked
@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Sample(TabularResult):
    """Draws of films: the material of each draw, and factors (draws,) on the breakdown field and on the undeformed thickness.

    `specimen_factor` (draws,) is that of each specimen on all moduli of its material, None for the materials themselves.
    `damage_factor` (draws,) is the damage at which a film fails, None unless it has a separate scatter. `typical_damage` is the
    damage at which the film without scatter fails, to which the draws belong; not 1 if its area differs from that for which the
    constants of the damage hold.
    """

    materials: tuple[Material, ...]
    breakdown_factor: Floats
    thickness_factor: Floats
    damage_factor: Floats | None = None
    typical_damage: float = 1.0
    area: float | None = None
    """Area in m^2 of the electrodes on the undeformed films, for which the materials hold; None if it is their reference area."""
    specimen_factor: Floats | None = None

    def typical(self, material: Material) -> Material:
        """The material of the film without scatter, with a damage law whose integral reaches 1 at the `typical_damage`."""
        if self.area is not None:
            material = of_area(material, self.area)
        if self.typical_damage == 1 or material.damage is None:
            return material
        return replace(material, damage=material.damage.lasting(self.typical_damage))

    @property
    def laws(self) -> Index | None:
        """The number (draws,) of the pair of spring laws of each draw, and of the part of the range that its undetermined constants
        are in; None if all have the same: see `interval`.
        """
        pairs = [(material.equilibrium_law.name, material.nonequilibrium_law.name) for material in self.materials]
        number, known = np.zeros(len(pairs), dtype=np.intp), 0
        for pair in dict.fromkeys(pairs):
            rows = np.array([row for row, other in enumerate(pairs) if other == pair])
            alike = [self.materials[row] for row in rows.tolist()]
            calibrated = alike[0].calibrated
            number[rows] = known + strata_of_materials(alike, () if calibrated is None else calibrated.undetermined)
            known = int(np.max(number)) + 1
        return None if known == 1 else number

    def specimens(self) -> tuple[Material, ...]:
        """The material of each draw, with the factor of its specimen on all moduli."""
        if self.specimen_factor is None:
            return self.materials
        pairs = zip(self.materials, self.specimen_factor.tolist(), strict=True)
        return tuple(of_specimen(material, factor) for material, factor in pairs)

    def aged(self) -> tuple[Material, ...]:
        """The material of each specimen, with a damage law whose integral reaches 1 when the film fails.

        Without a separate scatter of the damage, the factor on the breakdown field also applies to the field of the damage law: a
        stronger film lives longer. If that factor has a Weibull distribution of shape m, D at failure then has the shape beta =
        m/n, with n the exponent of the damage law: a fraction 1 - exp(-D^beta) of the films has failed when the damage of a film
        with the stated constants is D.
        """
        factors = (self.breakdown_factor if self.damage_factor is None else self.damage_factor).tolist()
        aged = []
        for material, factor in zip(self.specimens(), factors, strict=True):
            law = material.damage
            if law is not None:
                law = law.scaled(factor) if self.damage_factor is None else law.lasting(factor)
            aged.append(replace(material, damage=law))
        return tuple(aged)

    def __len__(self) -> int:
        return len(self.materials)

    def columns(self) -> Table:
        """The table, one row per film, with the index of its material among those drawn from."""
        numbers = {id(material): number for number, material in enumerate({id(one): one for one in self.materials}.values())}
        return [
            Column("draw", None, np.arange(len(self))),
            Column("material", None, np.array([numbers[id(material)] for material in self.materials])),
            Column("breakdown_factor", "1", self.breakdown_factor),
            Column("thickness_factor", "1", self.thickness_factor),
            *([] if self.damage_factor is None else [Column("damage_factor", "1", self.damage_factor)]),
            *([] if self.specimen_factor is None else [Column("specimen_factor", "1", self.specimen_factor)]),
        ]


@checked
@dataclass(frozen=True, slots=True)
class FilmScatter:
    """What scatters from film to film: the breakdown field, the thickness, and the damage at failure. What is None scatters as the
    laws of the materials state, if they do.
    """

    breakdown_field: Scatter | None = None
    thickness: Scatter | None = None
    damage: WeibullScatter | None = None


def draw_sample(
    members: Sequence[Material],
    draws: int,
    *,
    seed: int = 1,
    scatter: FilmScatter = FilmScatter(),
    share: float | None = None,
    area: float | None = None,
    specimens: bool = True,
) -> Sample:
    """A sample of `draws` films: materials from `members` (a single member is a material known exactly), with scatter.

    The first draws are the members in their order; further draws repeat members at random. Draw k depends only on `seed` and k.
    With a `share`, every film is one that this share of the films of its material fails before, instead of a film at random:
    intervals are then those of a quantile. The members hold for electrodes of this `area` in m^2 (see `of_area`). With `specimens`,
    each draw of a calibrated material is another specimen (see `SpecimenScatter`). Arrays of the sample are (draws,). Raises
    `InputError` if there is nothing to draw.
    """
    if draws < 1 or not members:
        raise InputError(f"{draws} draws of {len(members)} materials: at least one of each is needed")
    again = (stream(seed, "material").random(draws) * len(members)).astype(int)
    which = np.where(np.arange(draws) < len(members), np.arange(draws), again)
    ones = np.ones(draws)
    if share is not None and not 0 < share < 1:
        raise InputError(f"{share:g}: a share between 0 and 1 is needed", argument="share")
    materials = tuple(members[k] for k in which)

    def factors(
        stated: _Law | None, of: Callable[[Material], _Law | None], name: str, share: float | None = share
    ) -> Floats | None:
        """The factors (draws,) by the stated scatter, or else by that of each material; None for neither."""
        laws = [of(material) for material in materials] if stated is None else [stated]
        if all(law is None for law in laws):
            return None
        quantile = stream(seed, name).random(draws) if share is None else np.full(draws, share)
        if len(set(laws)) == 1 and laws[0] is not None:
            return laws[0].factors(quantile)
        parts = [1.0 if law is None else float(law.factors(quantile[k : k + 1])[0]) for k, law in enumerate(laws)]
        return np.array(parts)

    fields, ones = factors(scatter.breakdown_field, field_scatter, "breakdown field"), np.ones(draws)
    return Sample(
        materials,
        ones if fields is None else fields,
        ones if scatter.thickness is None else scatter.thickness.factors(stream(seed, "thickness").random(draws)),
        factors(scatter.damage, damage_scatter, "damage"),
        1.0 if scatter.damage is None else scatter.damage.typical,
        area,
        factors(None, specimen_scatter, "specimen", share=None) if specimens else None,
    )


_Law = Scatter | SpecimenScatter


def field_scatter(material: Material) -> Scatter | None:
    """The scatter of the breakdown field that the law of a material states."""
    law = material.breakdown
    if law is None or (law.shape is None and law.relative is None):
        return None
    return NormalScatter(float(law.relative)) if law.shape is None else WeibullScatter(float(law.shape))  # type: ignore[arg-type]


def damage_scatter(material: Material) -> WeibullScatter | None:
    """The scatter of the damage at failure that the law of a material states."""
    law = material.damage
    return None if law is None or law.shape is None else WeibullScatter(float(law.shape))


def specimen_scatter(material: Material) -> SpecimenScatter | None:
    """The scatter of specimens about the model, as the calibration of the material estimated it; None for other materials."""
    known = material.calibrated
    if known is None:
        return None
    size = float(np.hypot(known.specimen_scatter or 0.0, known.model_error or 0.0))
    return SpecimenScatter(size, known.scatter_freedom or np.inf) if size > 0 else None


def of_specimen(material: Material, factor: float) -> Material:
    """The material of a specimen whose moduli are all larger by a `factor` (1)."""
    spectrum = Spectrum(material.spectrum.relaxation_time, factor * material.spectrum.shear_modulus)
    return replace(material, equilibrium_modulus=factor * material.equilibrium_modulus, spectrum=spectrum)


def of_area(material: Material, area: float) -> Material:
    """The material whose constants hold for films with electrodes of an `area` in m^2: for Weibull scatter about constants that
    hold for a reference area, the weakest of so many more spots. Raises `InputError` if it has no scatter with a reference
    area.
    """
    changed: dict[str, Any] = {}
    for name in ("breakdown", "damage"):
        law = getattr(material, name)
        if law is None or law.shape is None or law.reference_area is None:
            continue
        factor = float((area / law.reference_area) ** (-1 / law.shape))
        scaled = law.scaled(factor) if name == "breakdown" else law.lasting(factor)
        changed[name] = replace(scaled, reference_area=area)
    if not changed:
        raise InputError(
            "the material states no shape with a reference_area, by which its strength depends on the area", argument="area"
        )
    return replace(material, **changed)
