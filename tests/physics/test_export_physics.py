"""Every card, read back by a parser that knows nothing but the code's own conventions, gives the material's G(t, T) and E(t, T)."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cards import READERS
from numpy.typing import NDArray

import dielast
from dielast import WLF, Arrhenius, CardOptions, Gent, Material, NoShift, ShiftTable, export_card, read_material

EXAMPLE = replace(
    read_material(Path(dielast.__file__).parent / "examples" / "vhb4905.toml"), equilibrium_law=Gent(), nonequilibrium_law=Gent()
)
LAWS = (
    WLF(20.0, 13.7, 187.1),
    Arrhenius(20.0, 1.2e5),
    ShiftTable(20.0, (-30.0, -5.0, 20.0, 45.0, 70.0), (4.1, 1.9, 0.0, -1.4, -2.6)),
    NoShift(20.0),
)
TEMPERATURES = (-20.0, 7.5, 20.0, 33.0, 60.0)
TIMES = np.logspace(-9, 7, 33)
STRESS = {"SI": 1.0, "mm-t-s": 1e-6, "mm-N-MPa": 1e-6}
KELVIN_ONLY = ("comsol", "mfront")


def material_for(form: str, law: Any) -> Material:
    spectrum = EXAMPLE.spectrum.slowest(6) if form == "febio" else EXAMPLE.spectrum
    return replace(EXAMPLE, spectrum=spectrum, shift=law)


def shear_modulus(material: Material, temperature: float) -> NDArray[np.float64]:
    tau = material.relaxation_time(temperature)
    return np.asarray(material.equilibrium_modulus + np.exp(-TIMES[:, None] / tau) @ material.spectrum.shear_modulus)


@pytest.mark.parametrize("units", STRESS)
@pytest.mark.parametrize("law", LAWS, ids=lambda law: type(law).__name__)
@pytest.mark.parametrize("form", READERS)
def test_a_card_read_back_gives_the_relaxation_modulus(form: str, law: Any, units: str) -> None:
    material = material_for(form, law)
    carried = form in KELVIN_ONLY or (form != "febio" and not isinstance(law, ShiftTable)) or isinstance(law, NoShift)
    stress = 1.0 if form == "comsol" else STRESS[units]
    for scale in ("degC", "K"):
        if form == "ansys" and isinstance(law, Arrhenius) and scale == "degC":
            continue
        for moduli in ("instantaneous", "long-term"):
            base = CardOptions(units=units, temperature_scale=scale, moduli=moduli)
            for temperature in TEMPERATURES:
                options = base if carried else replace(base, temperature=temperature)
                card = READERS[form](export_card(material, form, options))
                at = temperature + (273.15 if scale == "K" or form in KELVIN_ONLY else 0.0)
                shear = card.shear(TIMES, at) / stress
                expected = shear_modulus(material, temperature)
                np.testing.assert_allclose(shear, expected, rtol=1e-6)
                if card.bulk is None:
                    assert form in ("abaqus", "ansys", "comsol")
                    continue
                young = 9 * card.bulk / stress * shear / (3 * card.bulk / stress + shear)
                # as the card says: short of 3 G by G/(3 K), which Poisson's ratio of 0.495 at time zero bounds
                assert np.all(young <= 3 * expected)
                np.testing.assert_allclose(young, 3 * expected / (1 + expected / (3 * card.bulk / stress)), rtol=1e-6)
                assert np.all(3 * expected - young <= 0.0034 * 3 * expected)


@pytest.mark.parametrize("form", READERS)
@pytest.mark.parametrize("units", STRESS)
def test_bulk_modulus_poisson_ratio_and_density(form: str, units: str) -> None:
    material = material_for(form, NoShift(20.0))
    stress = 1.0 if form == "comsol" else STRESS[units]
    options = CardOptions(units=units, bulk_modulus=2e9, density=960.0)
    card = READERS[form](export_card(material, form, options))
    assert card.bulk == pytest.approx(2e9 * stress, rel=1e-12)
    if form != "mfront":
        assert card.density == pytest.approx(960.0 if stress == 1.0 else 960e-12, rel=1e-12)
    card = READERS[form](export_card(material, form, CardOptions(units=units, poisson_ratio=0.4)))
    assert card.bulk is not None
    instantaneous = float(card.shear(np.array([0.0]), 293.15)[0])
    assert (3 * card.bulk - 2 * instantaneous) / (6 * card.bulk + 2 * instantaneous) == pytest.approx(0.4, rel=1e-9)


@pytest.mark.parametrize("form", ["abaqus", "ansys", "comsol"])
def test_yeoh_falls_short_of_gent_by_what_the_card_says(form: str) -> None:
    limit = 60.0
    material = replace(material_for(form, NoShift(20.0)), equilibrium_law=Gent(limit), nonequilibrium_law=Gent(limit))
    law, constants = READERS[form](export_card(material, form, CardOptions(hyperelastic="yeoh"))).law
    assert law == "yeoh"
    modulus = material.equilibrium_modulus + (0.0 if form == "comsol" else float(np.sum(material.spectrum.shear_modulus)))
    above = np.linspace(0, 0.9, 10) * limit
    stiffness = 2 * (constants[0] + 2 * constants[1] * above + 3 * constants[2] * above**2)
    gent = modulus * Gent(limit).stiffness(3 + above)
    np.testing.assert_allclose(1 - stiffness / gent, (above / limit) ** 3, atol=1e-12)


@pytest.mark.parametrize("form", ["ansys", "febio", "comsol", "mfront"])
def test_gent_is_carried_where_the_code_has_it(form: str) -> None:
    material = replace(material_for(form, NoShift(20.0)), equilibrium_law=Gent(60.0), nonequilibrium_law=Gent(60.0))
    files = export_card(material, form)
    law, constants = READERS[form](files).law
    assert law.lower() == "gent"
    if form == "comsol":
        assert "J_m 60 " in files["material-comsol-parameters.txt"]
    elif form == "mfront":
        assert constants[0] == pytest.approx(1 / 60)
    else:
        assert constants[1] == 60.0


CPP = """
#include <cmath>
#include <cstdio>
#include <functional>
#include <stdexcept>
using real = double;
// symmetric second-order tensors as 3 x 3 arrays, fourth-order ones as maps of them: all that the behaviour's code asks of TFEL
struct Stensor {
  double m[3][3] = {};
  static Stensor Id() { Stensor r; for (int i = 0; i < 3; ++i) r.m[i][i] = 1; return r; }
};
using StressStensor = Stensor;
using Tensor = Stensor;
template <class Op> Stensor each(Op op) {
  Stensor r;
  for (int i = 0; i < 3; ++i) for (int j = 0; j < 3; ++j) r.m[i][j] = op(i, j);
  return r;
}
Stensor operator+(const Stensor& a, const Stensor& b) { return each([&](int i, int j) { return a.m[i][j] + b.m[i][j]; }); }
Stensor operator-(const Stensor& a, const Stensor& b) { return each([&](int i, int j) { return a.m[i][j] - b.m[i][j]; }); }
Stensor operator*(double s, const Stensor& a) { return each([&](int i, int j) { return s * a.m[i][j]; }); }
Stensor& operator+=(Stensor& a, const Stensor& b) { return a = a + b; }
Stensor product(const Stensor& a, const Stensor& b) {
  return each([&](int i, int j) { double s = 0; for (int k = 0; k < 3; ++k) s += a.m[i][k] * b.m[k][j]; return s; });
}
Stensor transpose(const Stensor& a) { return each([&](int i, int j) { return a.m[j][i]; }); }
double trace(const Stensor& a) { return a.m[0][0] + a.m[1][1] + a.m[2][2]; }
double inner(const Stensor& a, const Stensor& b) { return trace(product(a, transpose(b))); }
Stensor square(const Stensor& a) { return product(a, a); }
double det(const Stensor& a) {
  const auto& m = a.m;
  return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
         m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
}
using Stensor4 = std::function<Stensor(const Stensor&)>;
using StiffnessTensor = Stensor4;
Stensor4 operator^(const Stensor& a, const Stensor& b) { return [=](const Stensor& h) { return inner(b, h) * a; }; }
Stensor4 operator+(const Stensor4& a, const Stensor4& b) { return [=](const Stensor& h) { return a(h) + b(h); }; }
Stensor4 operator*(double s, const Stensor4& a) { return [=](const Stensor& h) { return s * a(h); }; }
Stensor computeRightCauchyGreenTensor(const Tensor& f) { return product(transpose(f), f); }
Stensor4 computeDeterminantSecondDerivative(const Stensor& c) {
  return [=](const Stensor& h) {
    return product(c, h) + product(h, c) - trace(h) * c - trace(c) * h + (trace(c) * trace(h) - inner(c, h)) * Stensor::Id();
  };
}
Stensor convertSecondPiolaKirchhoffStressToCauchyStress(const Stensor& s, const Tensor& f) {
  return (1 / det(f)) * product(product(f, s), transpose(f));
}
constexpr int Nv = @NV@;
struct Behaviour {
  Stensor Sb, H[Nv], sig, S_;
  Stensor4 dS_dC;
  Tensor F1;
  double T = 0, dT = 0, dt = 0;
  bool computeTangentOperator_ = true;
  void integrate() {
@BODY@
  S_ = S;
  }
};
int main() {
  Behaviour b;
  // each line: dt, T, F1, and H for the tangent's directional derivative
  Stensor h;
  while (std::scanf("%lf %lf", &b.dt, &b.T) == 2) {
    for (auto& row : b.F1.m) for (auto& x : row) if (std::scanf("%lf", &x) != 1) return 1;
    for (auto& row : h.m) for (auto& x : row) if (std::scanf("%lf", &x) != 1) return 1;
    try {
      b.integrate();
    } catch (const std::runtime_error& e) {
      std::printf("%s\\n", e.what());
      return 2;
    }
    const auto d = b.dS_dC(h);
    for (const auto& t : {b.sig, b.S_, d}) for (const auto& row : t.m) for (const auto x : row) std::printf("%.17g ", x);
    std::printf("\\n");
  }
}
"""
Step = tuple[float, float, NDArray[np.float64]]
Compiled = Callable[..., NDArray[np.float64]]


@pytest.fixture(scope="module")
def compiled(tmp_path_factory: pytest.TempPathFactory) -> Callable[[Material, CardOptions], Compiled]:
    """The behaviour's own C++, compiled over lines that stand in for TFEL's tensors: steps (dt, T, F) -> sig, S, dS/dC : h."""
    compiler = shutil.which("g++") or shutil.which("clang++")
    if compiler is None:
        if os.environ.get("CI"):
            pytest.fail("there is no C++ compiler, and CI must not skip what needs it")
        pytest.skip("no C++ compiler")

    def build(material: Material, options: CardOptions) -> Compiled:
        text = export_card(material, "mfront", options)["material.mfront"]
        body = text[text.index("@Integrator {") + len("@Integrator {") : text.index("@TangentOperator")].rstrip().removesuffix("}")
        folder = tmp_path_factory.mktemp("mfront")
        source = CPP.replace("@NV@", str(len(material.spectrum))).replace("@BODY@", body)
        (folder / "behaviour.cpp").write_text(source)
        subprocess.run(
            [compiler, "-std=c++17", "-O0", "-o", folder / "behaviour", folder / "behaviour.cpp"], check=True, capture_output=True
        )

        def run(steps: list[Step], direction: NDArray[np.float64] | None = None) -> NDArray[np.float64]:
            way = np.zeros((3, 3)) if direction is None else direction
            lines = [" ".join(map(repr, map(float, (dt, T, *F.ravel(), *way.ravel())))) for dt, T, F in steps]
            done = subprocess.run([folder / "behaviour"], input="\n".join(lines), capture_output=True, text=True, check=False)
            if done.returncode:
                raise RuntimeError(done.stdout)
            return np.array([[float(x) for x in line.split()] for line in done.stdout.splitlines()]).reshape(-1, 3, 3, 3)

        return run

    return build


@pytest.mark.parametrize("law", LAWS[::2], ids=lambda law: type(law).__name__)
def test_the_mfront_behaviour_relaxes_as_the_material(compiled: Any, law: Any) -> None:
    material = replace(EXAMPLE, shift=law, equilibrium_law=Gent(110.0), nonequilibrium_law=Gent(55.0))
    run = compiled(material, CardOptions())
    strain = 1e-6
    F = np.eye(3)
    F[0, 1] = strain
    for temperature in TEMPERATURES:
        kelvin = temperature + 273.15
        steps = [(0.0, kelvin, F), *((float(dt), kelvin, F) for dt in np.diff(TIMES, prepend=0.0))]
        shear = run(steps)[1:, 0, 0, 1] / strain
        np.testing.assert_allclose(shear, shear_modulus(material, temperature), rtol=1e-6)


def test_the_mfront_behaviour_at_large_stretch(compiled: Any) -> None:
    material = replace(EXAMPLE, shift=NoShift(20.0), equilibrium_law=Gent(110.0), nonequilibrium_law=Gent(55.0))
    run = compiled(material, CardOptions(bulk_modulus=2e9))
    stretch = 3.0
    F = np.diag([stretch, stretch**-0.5, stretch**-0.5])
    at_once, at_last = run([(0.0, 293.15, F), (1e12, 293.15, F)])[:, 0]
    invariant = np.array([stretch**2 + 2 / stretch])
    glassy = float(np.sum(material.spectrum.shear_modulus))
    share = stretch**2 - 1 / stretch
    slow = material.equilibrium_modulus * float(Gent(110.0).stiffness(invariant)[0]) * share
    fast = glassy * float(Gent(55.0).stiffness(invariant)[0]) * share
    assert at_once[0, 0] - at_once[1, 1] == pytest.approx(slow + fast, rel=1e-9)
    assert at_last[0, 0] - at_last[1, 1] == pytest.approx(slow, rel=1e-6)
    with pytest.raises(RuntimeError, match="stretched beyond J_lim"):
        run([(0.0, 293.15, np.diag([8.0, 8**-0.5, 8**-0.5]))])


def test_the_mfront_tangent_is_the_derivative_of_the_stress(compiled: Any) -> None:
    material = replace(EXAMPLE, spectrum=EXAMPLE.spectrum.slowest(10), shift=WLF(20.0, 13.7, 187.1))
    material = replace(material, equilibrium_law=Gent(30.0), nonequilibrium_law=Gent(15.0))
    run = compiled(material, CardOptions(bulk_modulus=1e7))
    generator = np.random.default_rng(5)
    first, F = (np.eye(3) + 0.3 * generator.standard_normal((3, 3)) for _ in range(2))
    way = generator.standard_normal((3, 3))
    way += way.T
    half = 1e-6

    def at(change: float) -> NDArray[np.float64]:
        # C changes by `change * way`: F = R U with another U
        C = F.T @ F + change * way
        values, vectors = np.linalg.eigh(C)
        U = vectors @ np.diag(np.sqrt(values)) @ vectors.T
        return np.asarray(run([(3.0, 300.0, first), (0.5, 300.0, U)], way)[1])

    difference = (at(half)[1] - at(-half)[1]) / (2 * half)
    tangent = at(0.0)[2]
    np.testing.assert_allclose(tangent, difference, rtol=1e-6, atol=1e-7 * np.abs(difference).max())


def test_the_mfront_behaviour_refuses_what_the_shift_law_does_not_know(compiled: Any) -> None:
    for law, kelvin, said in ((LAWS[0], 100.0, "pole of the WLF law"), (LAWS[2], 350.0, "outside of the shift table")):
        with pytest.raises(RuntimeError, match=said):
            compiled(replace(EXAMPLE, shift=law), CardOptions())([(0.0, kelvin, np.eye(3))])
