"""Bouc and Wen's hysteresis with fatigue and pinching, after Baber and Noori.

    F = k z,    z' = h (x' - nu |z|^n (gamma x' + beta |x'| sgn(z)))/eta,    e' = z x'
    nu = 1 + delta_nu e,    eta = 1 + delta_eta e,    h = 1 - zeta_1 exp(-((z sgn(x') - q z_u)/zeta_2)^2)
    zeta_1 = zeta_s (1 - exp(-p e)),    zeta_2 = (psi + delta_psi e)(xi + zeta_1),    z_u = (nu (beta + gamma))^(-1/n)

e hysteretic energy over k; nu takes strength, eta stiffness; h narrows the loops about a small z as cracks close:
zeta_s how much of the slope is lost, p how soon, q where, psi and xi how wide.

Source: Baber and Noori, Modeling general hysteresis behavior and random vibration application, Journal of Vibration,
Acoustics, Stress and Reliability in Design 108 (1986); Foliente, Hysteresis modeling of wood joints and structural
systems, Journal of Structural Engineering 121 (1995), equations (12) to (17).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import sympy

from fmu_models.language.hysteresis.bouc_wen import BoucWen
from fmu_models.language.hysteresis.law import Expr
from fmu_models.language.quantities import InternalState


@dataclass(frozen=True, kw_only=True)
class BoucWenBaberNoori(BoucWen):
    """As in the module: delta_nu, delta_eta and p in 1/m^2, psi in m, delta_psi in 1/m, zeta_s, q and xi numbers."""

    delta_nu: Expr = 0
    delta_eta: Expr = 0
    zeta_s: Expr = 0
    p: Expr = 0
    q: Expr = 0
    psi: Expr = 1
    delta_psi: Expr = 0
    xi: Expr = 1

    def states(self, name: str, unit: str) -> tuple[InternalState, ...]:
        """The hysteretic displacement, and the energy that went through it."""
        energy = InternalState(f"{name}_e", unit if unit == "1" else f"{unit}2", f"hysteretic energy over k of {name}")
        return (*super().states(name, unit), energy)

    def rates(self, speed: Expr, z: Sequence[Expr], signs: Mapping[str, Expr]) -> tuple[Expr, ...]:
        x, energy = z
        nu, eta = 1 + self.delta_nu * energy, 1 + self.delta_eta * energy
        severity = self.zeta_s * (1 - sympy.exp(-self.p * energy))
        width = (self.psi + self.delta_psi * energy) * (self.xi + severity)
        (ultimate,) = self.full
        ultimate = ultimate * nu ** (-1 / self._exponent)
        narrowed = 1 - severity * sympy.exp(-(((x * signs["speed"] - self.q * ultimate) / width) ** 2))
        return narrowed * (speed - nu * self.giving_way(speed, x, signs)) / eta, x * speed
