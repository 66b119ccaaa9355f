"""Resistance to rolling.

    |M| = mu_r N r sgn(omega) while the body rolls,    |M| < mu_r N r at rest

M moment that brakes the rolling, N normal force, r radius, omega angular speed of the rolling. The coefficient mu_r is
the lever arm of the normal force in units of the radius.

Source: Johnson, Contact mechanics (1985), section 9.3, for the moment as a fraction of N r.
"""

from dataclasses import dataclass, field
from typing import ClassVar

import sympy

from fmu_models.base.errors import StickslipError
from fmu_models.language.contacts import Friction, Law, Requirement
from fmu_models.language.dimensions import way_unit
from fmu_models.language.dry_friction import fixed_factors
from fmu_models.language.laws.coulomb import Coulomb


@dataclass(frozen=True, eq=False, kw_only=True)
class RollingResistance(Friction):
    """A contact of an angle whose capacity is mu_r N r; see the module.

    Attributes:
        slip: angular speed of the rolling, rad/s; affine in the velocities.
        N: normal force, N.
        r: radius, m.
        mu_r: coefficient of rolling resistance.

    Raises:
        StickslipError: ``slip`` is no angular speed.
    """

    exchangeable: ClassVar[bool] = False

    law: Law = field(init=False)
    N: sympy.Expr
    r: sympy.Expr
    mu_r: sympy.Expr

    def __post_init__(self) -> None:
        if way_unit(self.slip) == "m":
            raise StickslipError(
                f"contact '{self.name}': slip = {self.slip} is no angular speed. Rolling resistance brakes the turning "
                "of a body; write it with the velocity of an angle."
            )
        object.__setattr__(self, "law", Coulomb(N=self.N * self.r, mu=self.mu_r))
        super().__post_init__()

    @property
    def requirements(self) -> tuple[Requirement, ...]:
        """A moment that brakes."""
        sentence = f"mu_r times r of contact '{self.name}' must not be negative"
        return (Requirement(fixed_factors(self.mu_r * self.r), sentence),)
