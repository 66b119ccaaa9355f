"""LuGre friction: a layer of bristles in front of a steady law.

    lambda = -(sigma0 z + sigma1 z'),    z' = v - sigma0 |v| z / g(|v|)

v slip speed, lambda friction force along positive slip, z mean deflection of the bristles, sigma0 their stiffness,
sigma1 their damping, g the steady friction force (at constant v: lambda = -g(|v|) sgn(v)). Below the breakaway force
the bristles give way elastically: the contact slips a little (micro-slip) and never sticks exactly.

Source: Canudas de Wit, Olsson, Astrom, Lischinsky, A new model for control of systems with friction, IEEE
Transactions on Automatic Control 40 (1995), equations (2) to (4), without viscous friction.
"""

from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import ClassVar, Self

import sympy

from fmu_models.language.contacts import Law, Requirement
from fmu_models.language.dry_friction import DryFriction, fixed_factors, parts_around
from fmu_models.language.law_parameter import declared
from fmu_models.language.laws.conti import Conti
from fmu_models.language.quantities import InternalState


@dataclass(frozen=True)
class LuGre(Law):
    """Bristles of stiffness ``sigma0`` and damping ``sigma1`` whose steady force is that of the law ``steady``."""

    steady: DryFriction
    sigma0: sympy.Expr = field(metadata=declared(2e5, "N/m", "stiffness of the bristles", 1e3, 2e6))
    sigma1: sympy.Expr = field(metadata=declared(100.0, "N s/m", "damping of the bristles", 0.0, 1e4))
    bristle: InternalState = field(default_factory=lambda: _bristle("z"))
    sticks: ClassVar[bool] = False
    kept: ClassVar[type[DryFriction]] = DryFriction
    """A contact's own law that bristles are put before."""
    otherwise: ClassVar[type[DryFriction]] = Conti

    @classmethod
    def around(cls, own: object, suffix: str = "") -> Self:
        """Bristles ``z<suffix>`` before a contact's own law, if it is ``kept``, or before another in its place."""
        steady = own if isinstance(own, cls.kept) else cls.otherwise.around(own, suffix)
        return cls(**parts_around(cls, SimpleNamespace(steady=steady, bristle=_bristle(f"z{suffix}")), suffix))

    @property
    def states(self) -> tuple[InternalState, ...]:
        """The deflection of the bristles."""
        return (self.bristle,)

    @property
    def full(self) -> tuple[sympy.Expr, ...]:
        """The deflection at breakaway."""
        return (self.capacity / self.sigma0,)

    @property
    def capacity(self) -> sympy.Expr:
        """Breakaway force, N."""
        return self.steady.capacity

    @property
    def capacity_minus(self) -> sympy.Expr:
        return self.steady.capacity_minus

    def magnitude(self, speed: sympy.Expr) -> sympy.Expr:
        """Friction force in steady slip, N, for a slip speed without sign, m/s."""
        return self.steady.magnitude(speed)

    def towards(self, speed: sympy.Expr, sign: sympy.Expr) -> sympy.Expr:
        """The same for a slip speed of this sign."""
        return self.steady.towards(speed, sign)

    def force(self, slip: sympy.Expr, sign: sympy.Expr) -> sympy.Expr:
        (rate,) = self.rates(slip, sign)
        return -(self.sigma0 * self.bristle + self.sigma1 * rate)

    def rates(self, slip: sympy.Expr, sign: sympy.Expr) -> tuple[sympy.Expr, ...]:
        speed = sign * slip
        return (slip - self.sigma0 * speed * self.bristle / self.steady.towards(speed, sign),)

    @property
    def requirements(self) -> tuple[Requirement, ...]:
        """Requirements of the steady law, and a steady force that the bristles can lean against."""
        fixed = fixed_factors(self.capacity)
        factors = " or ".join(map(str, sympy.Mul.make_args(fixed)))
        sentence = f"{factors} is zero: LuGre's law divides by the steady friction force"
        return (*self.steady.requirements, Requirement(fixed, sentence, strict=True))


def _bristle(name: str) -> InternalState:
    return InternalState(name, "m", "mean deflection of the bristles", nominal=1e-5)


LAW = LuGre
