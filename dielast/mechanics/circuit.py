"""The circuit that a film's electrodes are part of, where the charge is an unknown: a source with a resistance, or a charge that
the source delivers, and a leak through the film.

Per undeformed area of the electrode, with the nominal charge density D~ in C/m^2, the nominal field E~ = D~/C, the capacitance
C = eps lambda_1^2 lambda_2^2 (of unit undeformed thickness, in F/m) and the true field E = E~ lambda_1 lambda_2, charge is
conserved:

    dD~/dt = i - j(E) lambda_1 lambda_2,    i = (E_s - E~)/r,  or  i = dD_s/dt,

E_s the source's voltage over the undeformed thickness L_3, r = R A/L_3 in ohm m for a resistance R and an undeformed area A, D_s
the charge that the source has delivered. D_s constant is an open circuit. With C constant D~ goes to C E_s as exp(-t/(r C)); with
a constant conductivity sigma the open film discharges as exp(-sigma t/eps), whatever its stretch.

Derivatives in Lambda_i = 2 ln lambda_i, with g_i = d ln C/dLambda_i = 1 + d ln eps/dLambda_i:

    d i/dLambda_i = E~ g_i/r,    d(j lambda_1 lambda_2)/dLambda_i = lambda_1 lambda_2 (j/2 - dj/dE E (g_i - 1/2)).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dielast.material.leakage import Leakage
from dielast.numerics.columns import Cases, Floats


@dataclass(frozen=True, slots=True, eq=False)
class Circuit:
    """A `leakage` with numbers (cases,), and the source: its `resistance` r (cases,) in ohm m, or None where it delivers a charge.

    A `source` below is what the load prescribes, E_s in V/m or D_s in C/m^2, and `slope` its rate, both (cases,). `permittivity` is
    that of the film as it is stretched, `share` are g_i (2, cases).
    """

    leakage: Leakage
    resistance: Floats | None = None

    def take(self, cases: Cases) -> Circuit:
        """Those of some of the films."""
        resistance = None if self.resistance is None else self.resistance[cases]
        return Circuit(self.leakage.take(cases), resistance)

    def charge_after(self, charge: Floats, before: Floats, after: Floats) -> Floats:
        """D~ (cases,) after the source jumps: through a resistance no charge flows at once."""
        return charge if self.resistance is not None else charge + (after - before)

    def leak(self, permittivity: Floats, log_area: Floats, charge: Floats) -> Floats:
        """The current density through the film per undeformed area, j lambda_1 lambda_2 (cases,) in A/m^2."""
        area = np.exp(0.5 * log_area)
        return np.asarray(self.leakage.current_density(charge / (permittivity * area)) * area)

    def supply(self, permittivity: Floats, log_area: Floats, charge: Floats, source: Floats, slope: Floats) -> Floats:
        """The current density i (cases,) in A/m^2 that the source sends into the film, per undeformed area."""
        if self.resistance is None:
            return slope
        return (source - charge * np.exp(-log_area) / permittivity) / self.resistance

    def supply_change(self, slope: Floats, bend: Floats) -> Floats:
        """di/dt (cases,) of a film that stands still; `bend` is the second derivative of what the load prescribes."""
        return bend if self.resistance is None else slope / self.resistance

    def linearised(self, permittivity: Floats, share: Floats, log_area: Floats, charge: Floats) -> tuple[Floats, Floats]:
        """The derivatives of dD~/dt in D~ (cases,), which is never positive, and in Lambda (2, cases)."""
        area = np.exp(0.5 * log_area)
        true = charge / (permittivity * area)
        steep = self.leakage.slope(true)
        by_charge = -steep / permittivity
        by_stretch = area * (steep * true * (share - 0.5) - 0.5 * self.leakage.current_density(true))
        if self.resistance is not None:
            by_charge = by_charge - np.exp(-log_area) / (permittivity * self.resistance)
            by_stretch = by_stretch + share * (charge * np.exp(-log_area) / (permittivity * self.resistance))
        return by_charge, by_stretch

    def released(self, permittivity: Floats, share: Floats, log_area: Floats, charge: Floats, time: Floats) -> Floats:
        """dD~/dLambda (2, cases) a `time` (cases,) in s after a small disturbance of the stretches: 0 at once, when the charge is
        as it was, and later what the circuit lets flow, in the end, through a resistance, as much as under a voltage held.
        """
        by_charge, by_stretch = self.linearised(permittivity, share, log_area, charge)
        flows = by_charge < 0
        flown = -np.expm1(by_charge * time) / np.where(flows, -by_charge, 1.0)
        return np.asarray(by_stretch * np.where(flows, flown, time))
