"""The flow of springs: the rate of their viscous stretches under stress, its linearisation, and how fast stress relaxes.

With p = (p, q) the stress of a spring of unit modulus in axes 1 and 2, x = 2 ln xi its viscous stretches and mu its modulus,

    dx/dt = a F p / (3 tau),    F = [[2, -1], [-1, 2]],    a = a(mu^2 J),    J = p^2 - p q + q^2

(Eqs. 7 and 8 of DOI 10.1115/1.4030850, where a = 1). As dJ/dp = F p, the derivative of the rate in the stress is the symmetric

    G = (a F + da/dJ (F p) (F p)^T) / (3 tau).

Arrays end with the axes springs, cases; stresses and rates begin with the axes of the film. Under a load that keeps every spring
symmetric, axis 1 stands for both: F and G are numbers, F is contained in the fluidity (`over`), and J = p^2.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar, Protocol, Self

import numpy as np

from dielast.material.law import FlowLaw
from dielast.material.laws_of_cases import LawsOfCases
from dielast.material.springs import Symmetry
from dielast.numerics.arrays import ByCase, Floats


class Mobility(Protocol):
    """G, the derivative of a rate of flow in the stress."""

    def through(self, tangent: Floats) -> Floats:
        """G K (axes, axes, n, cases) for the entries 11, 12, 22 of K (3, n, cases), or the only one (1, n, cases)."""

    def times(self, matrix: Floats) -> Floats:
        """G times a `matrix` (axes, axes, n, cases)."""


@dataclass(frozen=True, slots=True, eq=False)
class Flow(ByCase):
    """Linear flow of springs, whose derivative in the stress does not depend on it; `fluidity` (n, cases) is 1/(3 tau) in 1/s, 0
    for a spring that does not flow.
    """

    fluidity: Floats

    depends_on_stress: ClassVar[bool] = False

    @staticmethod
    def of(laws: LawsOfCases[FlowLaw], fluidity: Floats, modulus: Floats) -> Flow:
        """The flow of springs of this `fluidity` and `modulus`, both (n, cases), by `laws` of the cases; no law is linear flow."""
        return ActivatedFlow(fluidity, np.where(fluidity > 0, modulus, 0.0), laws) if laws else Flow(fluidity)

    def over(self, step: Floats, symmetry: Symmetry | None = None) -> Flow:
        """The flow within a `step` (cases,) in s, for arrays with one axis if there is a `symmetry`."""
        return self.of_fluidity((step if symmetry is None else symmetry.flow * step) * self.fluidity)

    def of_fluidity(self, fluidity: Floats) -> Flow:
        """The flow with another fluidity (n, cases)."""
        return Flow(fluidity)

    def rate(self, stress: Floats) -> Floats:
        """dx/dt (axes, n, cases) in 1/s at the stress (axes, n, cases) of springs of unit modulus."""
        return flowing(stress, self.fluidity)

    def mobility(self, stress: Floats) -> Mobility:
        """The derivative of the rate in the stress."""
        return self

    def through(self, tangent: Floats) -> Floats:
        """As in `Mobility`."""
        if len(tangent) == 1:
            return (tangent * self.fluidity)[None]
        k11, k12, k22 = tangent
        block = np.empty((2, 2, *k11.shape))
        twice = tangent + tangent
        np.subtract(twice[::2], k12, out=block.reshape(4, *k11.shape)[::3])
        np.subtract(twice[1], k22, out=block[0, 1])
        np.subtract(twice[1], k11, out=block[1, 0])
        block *= self.fluidity
        return block

    def times(self, matrix: Floats) -> Floats:
        """As in `Mobility`."""
        return flowing(matrix, self.fluidity)

    def retained(self, time: Floats | float, stress: Callable[[], Floats]) -> Floats:
        """The fraction (n, cases) of a small additional stress that springs under a `stress` keep after a `time` in s (cases,), at
        constant stretch: exp(-t/tau).
        """
        return np.exp(self.fluidity * (-3 * time))

    def apart(self) -> Flow:
        """The flow of single springs, spring after spring: (1, n cases)."""
        return Flow(self.fluidity.reshape(1, -1))

    def with_linear(self, fluidity: Floats) -> Self:
        """The flow with one more spring, the last, of linear flow and this fluidity (cases,)."""
        return replace(self, fluidity=np.concatenate((self.fluidity, fluidity[None])))


@dataclass(frozen=True, slots=True, eq=False)
class ActivatedFlow(Flow):
    """Flow by the `laws` (cases,) of a material; `fluidity` is that at small stress, and `modulus` (n, cases) in Pa that of the
    springs, 0 for springs of linear flow.
    """

    modulus: Floats
    laws: LawsOfCases[FlowLaw]

    depends_on_stress: ClassVar[bool] = True

    def rate(self, stress: Floats) -> Floats:
        """a times that of linear flow."""
        return flowing(stress, self.fluidity * self._activation(_invariant(stress))[0])

    def of_fluidity(self, fluidity: Floats) -> Flow:
        """As for linear flow."""
        return ActivatedFlow(fluidity, self.modulus, self.laws)

    def mobility(self, stress: Floats) -> Mobility:
        """As for linear flow, and a dyad."""
        activation, slope = self._activation(_invariant(stress))
        gradient = 2.0 * stress if len(stress) == 1 else flowing(stress, 1.0)
        return _Steepened(Flow(self.fluidity * activation), flowing(stress, self.fluidity * slope), gradient)

    def retained(self, time: Floats | float, stress: Callable[[], Floats]) -> Floats:
        """As for linear flow, with (a + 2 J da/dJ)/tau in place of 1/tau: the rate along F p, an eigenvector of G F^-1."""
        invariant = _invariant(stress())
        activation, slope = self._activation(invariant)
        return np.exp(self.fluidity * (activation + 2 * invariant * slope) * (-3 * time))

    def apart(self) -> Flow:
        """As for linear flow."""
        springs, cases = self.fluidity.shape
        laws = self.laws.take(np.tile(np.arange(cases), springs))
        return ActivatedFlow(self.fluidity.reshape(1, -1), self.modulus.reshape(1, -1), laws)

    def with_linear(self, fluidity: Floats) -> Self:
        """As for linear flow."""
        wider = np.concatenate((self.fluidity, fluidity[None]))
        return replace(self, fluidity=wider, modulus=np.concatenate((self.modulus, np.zeros((1, fluidity.size)))))

    def _activation(self, invariant: Floats) -> tuple[Floats, Floats]:
        """a and da/dJ (n, cases) at J (n, cases)."""
        scale = np.square(self.modulus)
        activation, slope = np.ones_like(invariant), np.zeros_like(invariant)
        for law, columns in self.laws.parts(np.arange(invariant.shape[1])):
            activation[:, columns], slope[:, columns] = law.activation((scale * invariant)[:, columns])
        return activation, slope * scale


@dataclass(frozen=True, slots=True, eq=False)
class _Steepened:
    """G of a `linear` flow plus the dyad of `flow` and `gradient`, both (axes, n, cases)."""

    linear: Flow
    flow: Floats
    gradient: Floats

    def through(self, tangent: Floats) -> Floats:
        """As in `Mobility`."""
        entries = tangent[None] if len(tangent) == 1 else tangent[np.array(((0, 1), (1, 2)))]
        return self._added(self.linear.through(tangent), entries)

    def times(self, matrix: Floats) -> Floats:
        """As in `Mobility`."""
        return self._added(self.linear.times(matrix), matrix)

    def _added(self, product: Floats, matrix: Floats) -> Floats:
        product += self.flow[:, None] * np.einsum("anm,abnm->bnm", self.gradient, matrix)
        return product


def flow_laws(laws: Sequence[FlowLaw], cases: int) -> LawsOfCases[FlowLaw]:
    """The laws that depend on stress, from one law for all cases or one for each; no law is linear flow."""
    return LawsOfCases.of([law if law.depends_on_stress else None for law in laws], cases)


def flowing(stress: Floats, factor: Floats | float) -> Floats:
    """F times the stress (axes, ..., n, cases) times `factor` (n, cases), which contains F if there is one axis."""
    flow: Floats
    if len(stress) == 1:
        flow = stress * factor
        return flow
    flow = 3.0 * stress
    flow -= stress[0] + stress[1]
    flow *= factor
    return flow


def _invariant(stress: Floats) -> Floats:
    """J (n, cases) of the stress (axes, n, cases)."""
    first, second = stress[0], stress[-1]  # the sum below is p^2 as well where p = q
    return np.asarray(first * first - first * second + second * second)
