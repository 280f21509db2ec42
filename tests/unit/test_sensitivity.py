"""What drives a life: shares and derivatives against closed forms, of models with known shares and of films."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from films import SOFT
from flat import life_sensitivity
from matplotlib.figure import Figure

from dielast import FilmScatter, InputError, Material, NormalScatter, Sample, Spectrum, WeibullScatter, draw_sample
from dielast.material.damage import InversePower
from dielast.material.material import Breakdown
from dielast.material.sensitivity import Exchange
from dielast.material.shift import NoShift
from dielast.numerics.random_streams import stream
from dielast.numerics.shares import Shares, variance_shares
from dielast.plots.sensitivity import plot_sensitivity
from dielast.simulate.sensitivity import LifeElasticities, LifeShares

Array = np.ndarray
Model = Callable[[Array], Array]
ELASTIC = Material("elastic", 1e6, Spectrum(np.zeros(0), np.zeros(0)), NoShift(20.0), permittivity=4e-11)
SILICONE = replace(ELASTIC, damage=InversePower(80e6, 3600.0, 18.5))
CLAMPED: dict[str, Any] = {"thickness": 0.5e-3, "prestretch": 1.7, "boundary": "clamped", "horizon": 1e12}
CREEPING = replace(SOFT, breakdown=Breakdown((1.0,), (48e6,)))
FILM: dict[str, Any] = {"thickness": 0.5e-3, "prestretch": [1.7, 1.9], "relax": 60.0, "horizon": 1e9}


def shares_of(model: Model, one: Array, other: Array) -> Shares:
    """The shares of a model of inputs (pairs, sources, ...)."""

    def exchanged(keep: Array, take: Array) -> Array:
        results = []
        for source in range(keep.shape[1]):
            inputs = keep.copy()
            inputs[:, source] = take[:, source]
            results.append(model(inputs))
        return np.array(results)

    return variance_shares(model(one), model(other), exchanged(one, other), exchanged(other, one))


def ishigami(x: Array) -> Array:
    """Ishigami and Homma's function, of inputs between -pi and pi."""
    return np.asarray(np.sin(x[:, 0]) + 7 * np.sin(x[:, 1]) ** 2 + 0.1 * x[:, 2] ** 4 * np.sin(x[:, 0]))


def correlated(x: Array) -> Array:
    """Standard normal inputs (2, pairs, sources, ...), the first two with correlation RHO."""
    x[:, :, 1] = RHO * x[:, :, 0] + np.sqrt(1 - RHO**2) * x[:, :, 1]
    return x


SLOPES, SIGMA = np.array([3.0, 1.0, -0.5]), np.array([0.5, 2.0, 1.0])
LINEAR = np.square(SLOPES * SIGMA) / np.sum(np.square(SLOPES * SIGMA))
# the first two drawn together, with this correlation: Li et al., DOI 10.1021/jp9096919
RHO = 0.6
ALONE, SHARED = np.square(SLOPES * SIGMA), RHO * np.prod(SLOPES[:2] * SIGMA[:2])
TOGETHER = ALONE.sum() + 2 * SHARED
V1, V2, V13 = 0.5 * (1 + 0.1 * np.pi**4 / 5) ** 2, 49 / 8, 0.01 * np.pi**8 * (1 / 18 - 1 / 50)
CASES: list[tuple[Model, Callable[[tuple[int, ...]], Array], Array, Array]] = [
    (
        lambda x: np.einsum("s,ps...->p...", SLOPES, x),
        lambda shape: SIGMA[:, None] * stream(1, "test").standard_normal(shape),
        LINEAR,
        LINEAR,
    ),
    (
        lambda x: np.einsum("s,ps...->p...", SLOPES, x),
        lambda shape: SIGMA[:, None] * correlated(stream(6, "test").standard_normal(shape)),
        (ALONE + np.array([SHARED, SHARED, 0.0])) / TOGETHER,
        ALONE / TOGETHER,
    ),
    (
        ishigami,
        lambda shape: np.pi * stream(2, "test").uniform(-1, 1, shape),
        np.array([V1, V2, 0.0]) / (V1 + V2 + V13),
        np.array([V1 + V13, V2, V13]) / (V1 + V2 + V13),
    ),
]


@pytest.mark.parametrize(("model", "inputs", "first", "total"), CASES, ids=["linear", "correlated", "ishigami"])
def test_shares_are_those_of_the_closed_form(model: Model, inputs: Callable[..., Array], first: Array, total: Array) -> None:
    """300 repetitions of 200 pairs: no bias beyond that of the ratio, of order 1/pairs, and honest standard errors."""
    repeats, pairs = 300, 200
    one, other = inputs((2, pairs, 3, repeats))
    found = shares_of(model, one, other)
    for values, errors, expected in (
        (found.first_order, found.first_order_stderr, first),
        (found.total, found.total_stderr, total),
    ):
        spread = values.std(axis=1)
        assert np.all(np.abs(values.mean(axis=1) - expected) < 4 * spread / np.sqrt(repeats) + 1 / pairs)
        assert errors.mean(axis=1) == pytest.approx(spread, rel=0.25)


def test_the_estimator_is_saltellis_and_jansens() -> None:
    """The formulas of SALib 1.6, of which there is one for either order of a pair, with the variance that is unbiased."""
    pairs = 64
    one, other = np.pi * stream(3, "test").uniform(-1, 1, (2, pairs, 3, 1))
    found = shares_of(ishigami, one, other)
    a, b = ishigami(one)[:, 0], ishigami(other)[:, 0]
    middle, variance = np.mean([a, b]), np.var([a, b], ddof=1)
    for source in range(3):
        first, total = [], []
        for keep, take, f, g in ((one, other, a, b), (other, one, b, a)):
            mixed = keep.copy()
            mixed[:, source] = take[:, source]
            h = ishigami(mixed)[:, 0]
            first.append(np.mean((g - middle) * (h - f)) / variance)
            total.append(0.5 * np.mean((f - h) ** 2) / variance)
        assert found.first_order[source, 0] == pytest.approx(np.mean(first), rel=1e-10)
        assert found.total[source, 0] == pytest.approx(np.mean(total), rel=1e-10)


def test_what_does_not_vary_has_no_shares_and_one_pair_no_errors() -> None:
    still = shares_of(lambda x: 0 * x[:, 0], *np.ones((2, 5, 2, 1)))
    assert np.all(np.isnan(still.total))
    lone = shares_of(lambda x: x.sum(axis=1), *stream(4, "test").random((2, 1, 2, 1)))
    assert np.all(np.isfinite(lone.total))
    assert np.all(np.isnan(lone.total_stderr))


def test_a_film_that_does_not_creep_has_the_shares_of_its_damage_law() -> None:
    """ln t = const + n ln(thickness) + ln(D), with Var ln D = pi^2/(6 beta^2) of Weibull's distribution."""
    sample = draw_sample([SILICONE], 1000, scatter=FilmScatter(thickness=NormalScatter(0.01), damage=WeibullScatter(5.0)))
    found = life_sensitivity(SILICONE, sample, voltage=[9e3, 1e4], **CLAMPED)
    assert isinstance(found, LifeShares)
    variances = np.array([(18.5 * 0.01) ** 2, np.pi**2 / (6 * 5.0**2)])
    assert [source.name for source in found.sources] == ["thickness", "damage"]
    for values, errors in ((found.first_order, found.first_order_stderr), (found.total, found.total_stderr)):
        assert np.all(np.abs(values - (variances / variances.sum())[:, None]) < 4 * errors)
    assert found.spread == pytest.approx(np.sqrt(variances.sum()) / np.log(10), rel=0.1)
    assert np.all(found.censored == 0)
    frame = found.to_frame()
    assert list(frame["source"]) == ["thickness", "damage"] * 2
    assert frame["voltage [V]"].tolist() == [9e3, 9e3, 1e4, 1e4]


def test_parts_that_compensate_each_other_are_a_material_without_a_share() -> None:
    """A film follows eps/mu: draws in which both are a factor larger have one life; with one of them exchanged, they do not."""
    factors = 1 + 0.02 * stream(5, "test").standard_normal(60)
    members = [
        replace(CREEPING, equilibrium_modulus=f * 26e3, spectrum=replace_moduli(CREEPING.spectrum, f), permittivity=f * 4e-11)
        for f in factors.tolist()
    ]
    sample = draw_sample(members, 60, scatter=FilmScatter(thickness=NormalScatter(0.005)))
    found = life_sensitivity(CREEPING, sample, voltage=3.9e3, **FILM)
    assert isinstance(found, LifeShares)
    part_of = {source.name: source.part_of for source in found.sources}
    assert part_of == {
        "material": "",
        "spectrum": "material",
        "equilibrium spring": "material",
        "permittivity": "material",
        "thickness": "",
    }
    total = dict(zip(part_of, found.total, strict=True))
    first = dict(zip(part_of, found.first_order, strict=True))
    assert np.all(np.abs(total["material"]) < 1e-6)
    assert total["thickness"] == pytest.approx(1.0, abs=0.3)
    # alone, each would move the life, and what it explains does not go with the life
    assert np.all(total["permittivity"] > total["equilibrium spring"])
    assert np.all(total["equilibrium spring"] > 0.1)
    assert np.all(first["permittivity"] < 0.5 * total["permittivity"])


def replace_moduli(spectrum: Spectrum, factor: float) -> Spectrum:
    return Spectrum(spectrum.relaxation_time, factor * spectrum.shear_modulus)


def test_derivatives_are_those_of_the_closed_form() -> None:
    found = life_sensitivity(SILICONE, voltage=[9e3, 1e4], **CLAMPED)
    assert isinstance(found, LifeElasticities)
    elasticity = dict(zip(found.sources, found.elasticity, strict=True))
    field = np.array([9e3, 1e4]) / 0.5e-3 * 1.7**2
    expected = {"damage.field": 18.5, "damage.time": 1.0, "thickness": 18.5, "damage.exponent": 18.5 * np.log(80e6 / field)}
    for name, value in expected.items():
        assert elasticity.pop(name) == pytest.approx(np.broadcast_to(value, 2), rel=1e-6)
    assert set(elasticity) == {"equilibrium.shear_modulus", "dielectric.permittivity"}
    assert np.all(np.abs(list(elasticity.values())) < 1e-9)


def test_derivatives_of_a_creeping_film_have_the_invariants_of_its_equations() -> None:
    """The film moves by eps E^2/mu alone, and breaks down where V/h, times the stretches, reaches E_EB."""
    found = life_sensitivity(CREEPING, voltage=[3.6e3, 4.2e3], **FILM)
    assert isinstance(found, LifeElasticities)
    assert np.all(np.isfinite(found.elasticity))
    of = dict(zip(found.sources, found.elasticity, strict=True))
    moduli, permittivity = of["equilibrium.shear_modulus"] + of["nonequilibrium.scale"], of["dielectric.permittivity"]
    error = found.elasticity_error.max() + 1e-3
    assert np.all(np.abs(moduli + permittivity) < error)
    assert np.all(np.abs(of["thickness"] - of["breakdown field"] + 2 * permittivity) < 3 * error)
    assert np.all(of["breakdown field"] > 1)
    # the second derivative of a smooth life is far smaller than the first over a step
    assert np.all(found.elasticity_error < 0.05 * np.abs(found.elasticity).max(axis=0))


def test_films_that_may_live_on_have_no_shares_but_say_how_many_do() -> None:
    sample = draw_sample([SILICONE], 40, scatter=FilmScatter(thickness=NormalScatter(0.05)))
    life = 3600.0 * (80e6 * 0.5e-3 / 1.7**2 / 1e4) ** 18.5
    found = life_sensitivity(SILICONE, sample, voltage=[1e4, 2e4], **{**CLAMPED, "horizon": life})
    assert isinstance(found, LifeShares)
    assert 0.2 < found.censored[0] < 0.8
    assert np.all(np.isnan([*found.total[:, 0], found.spread[0]]))
    assert found.censored[1] == 0
    assert np.all(np.isfinite(found.total[:, 1]))
    assert found.left_out == 1
    lone = life_sensitivity(SILICONE, voltage=[1e4, 2e4], **{**CLAMPED, "horizon": life})
    assert lone.left_out == 1


def test_each_source_is_exchanged_and_nothing_else() -> None:
    members = [
        replace(CREEPING, permittivity=eps, equilibrium_modulus=mu) for eps, mu in ((4e-11, 2e4), (5e-11, 3e4), (6e-11, 4e4))
    ]
    sample = Sample(tuple(members * 2), np.linspace(0.9, 1.1, 6), np.ones(6))
    pairs = Exchange.of(sample, seed=3)
    assert [source.name for source in pairs.sources] == ["material", "equilibrium spring", "permittivity", "breakdown field"]
    assert sorted([*pairs.first, *pairs.second]) == list(range(6))
    assert len(pairs.sample) == 6 + 4 * 6
    assert pairs.sample.materials[:6] == sample.materials
    parts = np.arange(6, 30).reshape(4, 2, 3)
    for place, source in enumerate(pairs.sources):
        for keep, take, films in zip((pairs.first, pairs.second), (pairs.second, pairs.first), parts[place], strict=True):
            for a, b, film in zip(keep, take, films, strict=True):
                made, kept, taken = pairs.sample.materials[film], sample.materials[a], sample.materials[b]
                for field in ("equilibrium_modulus", "permittivity", "spectrum", "breakdown"):
                    expected = taken if field in source.material_fields else kept
                    assert getattr(made, field) is getattr(expected, field)
                other = b if source.factor else a
                assert pairs.sample.breakdown_factor[film] == sample.breakdown_factor[other]


def test_nothing_to_share_is_refused() -> None:
    with pytest.raises(InputError, match="at least 4"):
        Exchange.of(draw_sample([SILICONE], 3, scatter=FilmScatter(thickness=NormalScatter(0.1))))
    with pytest.raises(InputError, match="all draws are equal"):
        Exchange.of(draw_sample([SILICONE], 30))
    with pytest.raises(InputError, match="horizon"):
        life_sensitivity(SILICONE, voltage=1e4, **{**CLAMPED, "horizon": -1.0})


def test_figures_show_films_by_their_largest_sources() -> None:
    members = [SILICONE, replace(SILICONE, damage=InversePower(81e6, 3600.0, 18.5))]
    sample = draw_sample(members, 20, scatter=FilmScatter(thickness=NormalScatter(0.01)))
    film = {**CLAMPED, "prestretch": np.linspace(1.5, 1.9, 7)}
    for found in (
        life_sensitivity(SILICONE, sample, voltage=[9e3, 1e4, 1.1e4], **film),
        life_sensitivity(SILICONE, voltage=1e4, **film),
        life_sensitivity(SILICONE, sample, voltage=1e4, **{**CLAMPED, "horizon": 1e-3}),
    ):
        figure = plot_sensitivity(found, "many films")
        assert isinstance(figure, Figure)
        known = 1 if found.left_out else 6
        assert len(figure.axes) == known
    figure = plot_sensitivity(life_sensitivity(SILICONE, voltage=1e4, **CLAMPED))
    labels = [text.get_text() for text in figure.axes[0].get_yticklabels()]
    assert labels[:2] in (["damage.field", "thickness"], ["thickness", "damage.field"])
