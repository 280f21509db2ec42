"""The electrical load: the quantity that is prescribed, the Maxwell stress that it causes, and the circuit of the film.

A film of nominal field V/L_3 has the true field E = (V/L_3) lambda_1 lambda_2 and the Maxwell stress eps E^2, equal in axes 1 and 2
(Eq. 6 of DOI 10.1115/1.4030850). Both depend on the stretches through the area, here as
`log_area` = Lambda_1 + Lambda_2 = 2 ln(lambda_1 lambda_2), and through the present permittivity eps. Arrays are of shape (cases,).

The energy U of the dielectric at a prescribed field or charge is a function of the capacitance per undeformed area only, that is,
of L = log_area + ln eps, and eps E^2 = -2 dU/dL. So if the permittivity depends on stretch, with g_i = dL/dLambda_i =
1 + d ln eps/dLambda_i and h_ij = d2 ln eps/dLambda_i dLambda_j, the stresses m_i in both axes and their derivatives are

    m_i = eps E^2 g_i,    dm_i/dLambda_j = d(eps E^2)/dL g_i g_j + eps E^2 h_ij.

Under a prescribed field, m_i/lambda_i = eps E~^2 lambda_1^2 lambda_2^2/lambda_i + E~^2 lambda_1^2 lambda_2^2 (d eps/d lambda_i)/2,
E~ the nominal field: the second term is electrostriction (Zhao and Suo, J. Appl. Phys. 104 (2008) 123530).

A film whose charge is an unknown has a circuit: a source, with a resistance or of a prescribed charge, and leakage through the
film. Per undeformed area of the electrode, charge is conserved:

    dD~/dt = i - j(E) lambda_1 lambda_2,    i = (E_s - E~)/r,  or  i = dD_s/dt.

Here D~ is the nominal charge density in C/m^2, E~ = D~/C the nominal field, C = eps lambda_1^2 lambda_2^2 the capacitance (for unit
undeformed thickness, in F/m) and E = E~ lambda_1 lambda_2 the true field. E_s is the voltage of the source over the undeformed
thickness L_3, r = R A/L_3 in ohm m for a resistance R and an undeformed area A, and D_s the charge that the source has delivered. A
constant D_s is an open circuit. At constant C, D~ approaches C E_s as exp(-t/(r C)); with a constant conductivity sigma, the film
in an open circuit discharges as exp(-sigma t/eps), whatever its stretch.

Derivatives in Lambda_i = 2 ln lambda_i, with g_i = d ln C/dLambda_i = 1 + d ln eps/dLambda_i:

    d i/dLambda_i = E~ g_i/r,    d(j lambda_1 lambda_2)/dLambda_i = lambda_1 lambda_2 (j/2 - dj/dE E (g_i - 1/2)).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from dielast.material.dielectric import Leakage
from dielast.numerics.arrays import ByCase, Floats

ELECTRIC = 2  # row of the prescribed electrical quantity among the values of a load


@dataclass(frozen=True, slots=True)
class FieldControl:
    """The nominal field V/L_3 (V/m) is prescribed, as by a voltage source: eps E^2 = eps (V/L_3)^2 exp(log_area).

    In the methods, `permittivity` is in F/m at the present stretch of the film, and `prescribed` the value of the quantity.
    """

    def stress(self, permittivity: Floats, log_area: Floats, prescribed: Floats) -> Floats:
        """The Maxwell stress eps E^2 in Pa."""
        return np.asarray(permittivity * np.square(prescribed) * np.exp(log_area))

    def linearised(self, permittivity: Floats, log_area: Floats, prescribed: Floats) -> tuple[Floats, Floats, Floats]:
        """eps E^2, and its derivatives in `log_area` (equal to that in ln eps) and in the prescribed quantity."""
        slope = 2 * permittivity * prescribed * np.exp(log_area)
        stress = 0.5 * slope * prescribed
        return stress, stress, slope

    def true_field(self, permittivity: Floats, log_area: Floats, prescribed: Floats) -> Floats:
        """The true field E = (V/L_3) exp(log_area/2) in V/m."""
        return np.asarray(prescribed * np.exp(0.5 * log_area))


@dataclass(frozen=True, slots=True)
class ChargeControl:
    """The nominal charge density D~ (C/m^2), charge per undeformed area, is prescribed: eps E^2 = D~^2/eps exp(-log_area).

    The Maxwell stress decreases as the film expands, so that a charged film never pulls in. Without a load on its edges, a
    neo-Hookean film reaches lambda^6 = 1 + D~^2/(mu eps) (Keplinger, Kaltenbrunner, Arnold and Bauer, PNAS 107 (2010) 4505).
    """

    def stress(self, permittivity: Floats, log_area: Floats, prescribed: Floats) -> Floats:
        """The Maxwell stress eps E^2 in Pa."""
        return np.asarray(np.square(prescribed) / permittivity * np.exp(-log_area))

    def linearised(self, permittivity: Floats, log_area: Floats, prescribed: Floats) -> tuple[Floats, Floats, Floats]:
        """eps E^2, and its derivatives in `log_area` and in the prescribed quantity."""
        slope = 2 * prescribed / permittivity * np.exp(-log_area)
        stress = 0.5 * slope * prescribed
        return stress, -stress, slope

    def true_field(self, permittivity: Floats, log_area: Floats, prescribed: Floats) -> Floats:
        """The true field E = D~/eps exp(-log_area/2) in V/m."""
        return np.asarray(prescribed / permittivity * np.exp(-0.5 * log_area))


FIELD, CHARGE = FieldControl(), ChargeControl()
ElectricalLoad = FieldControl | ChargeControl


class Drive(Enum):
    """What drives the electrodes: a source of voltage, or a prescribed charge, of which an open circuit is a constant one."""

    VOLTAGE = "voltage"
    CHARGE = "charge"


@dataclass(frozen=True, slots=True, eq=False)
class FilmCircuit(ByCase):
    """A `leakage` law with constants (cases,), None without leakage, and the `resistance` r (cases,) in ohm m of a source of
    voltage, None without one, or if the source prescribes the charge.

    In the methods, all arrays (cases,) unless stated: `source` is the prescribed quantity, E_s in V/m or D_s in C/m^2, `slope` its
    rate and `bend` the rate of `slope`; `permittivity` is that of the film at its present stretch, `share` are g_i (2, cases), and
    `log_area` is Lambda_1 + Lambda_2.
    """

    leakage: Leakage | None
    resistance: Floats | None = None

    def under(self, drive: Drive) -> FilmCircuit | None:
        """The circuit under a drive; None where the charge is no unknown, as there is neither the resistance of a voltage nor a
        leak of a charge.
        """
        if drive is Drive.VOLTAGE:
            return None if self.resistance is None else self
        return None if self.leakage is None else replace(self, resistance=None)

    def acting(self, drive: Drive) -> ElectricalLoad:
        """The electrical quantity that acts on films under a drive."""
        return FIELD if drive is Drive.VOLTAGE and self.resistance is None else CHARGE

    def charge_after(self, charge: Floats, before: Floats, after: Floats) -> Floats:
        """D~ (cases,) after the source jumps: no charge flows through a resistance in no time."""
        return charge if self.resistance is not None else charge + (after - before)

    def leak(self, permittivity: Floats, log_area: Floats, charge: Floats) -> Floats:
        """The leakage current density j lambda_1 lambda_2 (cases,) in A/m^2 of undeformed area."""
        if self.leakage is None:
            return np.zeros_like(charge)
        area = np.exp(0.5 * log_area)
        return np.asarray(self.leakage.current_density(charge / (permittivity * area)) * area)

    def supply(self, permittivity: Floats, log_area: Floats, charge: Floats, source: Floats, slope: Floats) -> Floats:
        """The current density i (cases,) from the source in A/m^2 of undeformed area."""
        if self.resistance is None:
            return slope
        return (source - charge * np.exp(-log_area) / permittivity) / self.resistance

    def supply_change(self, slope: Floats, bend: Floats) -> Floats:
        """di/dt (cases,) at constant stretches and charge."""
        return bend if self.resistance is None else slope / self.resistance

    def linearised(self, permittivity: Floats, share: Floats, log_area: Floats, charge: Floats) -> tuple[Floats, Floats]:
        """The derivatives of dD~/dt in D~ (cases,), at most 0, and in Lambda (2, cases)."""
        by_charge, by_stretch = np.zeros_like(charge), np.zeros_like(share)
        if self.leakage is not None:
            area = np.exp(0.5 * log_area)
            true_field = charge / (permittivity * area)
            conductivity = self.leakage.slope(true_field)
            by_charge = -conductivity / permittivity
            by_stretch = area * (conductivity * true_field * (share - 0.5) - 0.5 * self.leakage.current_density(true_field))
        if self.resistance is not None:
            by_charge = by_charge - np.exp(-log_area) / (permittivity * self.resistance)
            by_stretch = by_stretch + share * (charge * np.exp(-log_area) / (permittivity * self.resistance))
        return by_charge, by_stretch

    def released(self, permittivity: Floats, share: Floats, log_area: Floats, charge: Floats, time: Floats) -> Floats:
        """dD~/dLambda (2, cases) at a `time` (cases,) in s after a small disturbance of the stretches.

        It is 0 at time 0, when no charge has flowed yet. Later it is the charge that the circuit lets flow: through a resistance,
        in the limit of long times, as much as at a constant voltage.
        """
        by_charge, by_stretch = self.linearised(permittivity, share, log_area, charge)
        flows = by_charge < 0
        response = -np.expm1(by_charge * time) / np.where(flows, -by_charge, 1.0)
        return np.asarray(by_stretch * np.where(flows, response, time))
