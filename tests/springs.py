"""Films with springs of each law, as dielast and the membrane peer take them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from peers import energies
from peers.energies import Energy
from peers.membrane import Film

from dielast import Gent, Material, Spectrum
from dielast.material.shift import NoShift
from dielast.material.springs import ArrudaBoyce, GentI2, MooneyRivlin, Ogden, SpringLaw, Yeoh

MU, EPS = 26e3, 4e-11
SPECTRUM = Spectrum(np.array([10.0, 0.5]), np.array([3e4, 1e5]))
STIFF = Spectrum(np.array([500.0, 20.0, 0.3, 1e-3]), np.array([2e4, 5e4, 2e5, 1e6]))


@dataclass(frozen=True)
class Springs:
    """A law of the equilibrium spring and one of the branches, and their energies of a modulus of 1 Pa."""

    equilibrium: SpringLaw
    branch: SpringLaw
    energies: tuple[Energy, Energy]
    spectrum: Spectrum = SPECTRUM

    @property
    def material(self) -> Material:
        return Material("film", MU, self.spectrum, NoShift(20.0), self.equilibrium, self.branch, EPS)

    @property
    def film(self) -> Film:
        rest, branch = self.energies
        return Film(lambda l1, l2: MU * rest(l1, l2), branch, self.spectrum.shear_modulus, self.spectrum.relaxation_time, EPS)


def gent(limit: float) -> Energy:
    return lambda l1, l2: energies.gent(l1, l2, 1.0, limit)


def gent_i2(limit: float, share: float, exponent: float) -> Energy:
    return lambda l1, l2: energies.gent_i2(l1, l2, 1 - share, limit, share, exponent)


def yeoh(c2: float, c3: float) -> Energy:
    return lambda l1, l2: energies.yeoh(l1, l2, 0.5, 0.5 * c2, 0.5 * c3)


def arruda_boyce(locking: float) -> Energy:
    return lambda l1, l2: energies.arruda_boyce(l1, l2, 1.0, locking)


def mooney_rivlin(share: float) -> Energy:
    return lambda l1, l2: energies.mooney_rivlin(l1, l2, 0.5 * (1 - share), 0.5 * share)


def ogden(mu: tuple[float, ...], alpha: tuple[float, ...]) -> Energy:
    modulus = 0.5 * sum(m * a for m, a in zip(mu, alpha, strict=True))
    return lambda l1, l2: energies.ogden(l1, l2, [m / modulus for m in mu], alpha)


SPRINGS = {
    "gent": Springs(Gent(110.0), Gent(55.0), (gent(110.0), gent(55.0)), STIFF),
    "yeoh": Springs(Yeoh(1.0, -0.01, 2e-4), Yeoh(1.0, 0.02), (yeoh(-0.01, 2e-4), yeoh(0.02, 0.0))),
    "arruda-boyce": Springs(ArrudaBoyce(5.0), ArrudaBoyce(3.0), (arruda_boyce(5.0), arruda_boyce(3.0))),
    "mooney-rivlin": Springs(MooneyRivlin(9.0, 1.0), MooneyRivlin(8.0, 2.0), (mooney_rivlin(0.1), mooney_rivlin(0.2))),
    "ogden": Springs(
        Ogden((18.0, -2.0), (1.6, -2.5)),
        Ogden((3.0, 0.01), (1.8, 5.0)),
        (ogden((18.0, -2.0), (1.6, -2.5)), ogden((3.0, 0.01), (1.8, 5.0))),
    ),
    "mixed": Springs(Ogden((18.0, -2.0), (1.6, -2.5)), ArrudaBoyce(4.0), (ogden((18.0, -2.0), (1.6, -2.5)), arruda_boyce(4.0))),
    "gent-i2": Springs(GentI2(110.0, 0.4, 0.9), GentI2(55.0, 0.2), (gent_i2(110.0, 0.4, 0.9), gent_i2(55.0, 0.2, 0))),
}
