"""A backlash before a law with memory: the law follows the way only where it has gone ``w`` to either side.

    F = law along y,    z_0' = x' inside,    |z_0| <= w,    y = x - z_0

z_0 what the play has taken up, y the way behind it. A law whose rates are in proportion to its speed has no clock of
its own: held at its bound the play hands y' = x' on, inside nothing. Sliders behind a play are differences of two:
stop_D(play_w(x)) = stop_(D + w)(x) - stop_w(x), and stay sliders.

Source: Visintin, Differential Models of Hysteresis (1994), chapter III.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import sympy

from fmu_models.base.errors import StickslipError
from fmu_models.language.contacts import Requirement
from fmu_models.language.hysteresis.law import Expr, HysteresisLaw
from fmu_models.language.hysteresis.sliders import MaxwellSlip, Sliders, size
from fmu_models.language.quantities import InternalState


@dataclass(frozen=True)
class Play(HysteresisLaw):
    """A backlash of ``w`` (m or rad) to either side before ``law``. StickslipError: a law that moves while its way
    stands."""

    law: HysteresisLaw
    w: Expr

    def __post_init__(self) -> None:
        has_memory = isinstance(self.law, HysteresisLaw)
        if not has_memory or not (isinstance(self.law, Sliders) or self._rests()):
            raise StickslipError(
                "Play stands before a law that rests while its way does, such as MaxwellSlip, Dahl or BoucWen; found "
                f"{type(self.law).__name__}. Declare a body without friction between the play and the force."
            )

    def _rests(self) -> bool:
        speed, z = sympy.Dummy("speed"), self.law.states("h", "m")
        sides = {name: sympy.Dummy(name) for name in self.law.switches(speed, z)}
        rates = map(sympy.sympify, self.law.rates(speed, z, sides))
        return all(sympy.expand(rate - speed * rate.subs(speed, 1)) == 0 for rate in rates)

    @property
    def lowered(self) -> HysteresisLaw:
        if not isinstance(self.law, Sliders):
            return self
        k, D = zip(*self.law.elements, strict=True)
        return MaxwellSlip(k=(*k, -sympy.Add(*k)), D=(*(bound + self.w for bound in D), self.w))

    def states(self, name: str, unit: str) -> tuple[InternalState, ...]:
        """What the play has taken up, then those of the law."""
        taken = InternalState(f"{name}_play", unit, f"way that the play of {name} has taken up", nominal=size(self.w))
        return (taken, *self.law.states(name, unit))

    def rates(self, speed: Expr, z: Sequence[Expr], signs: Mapping[str, Expr]) -> tuple[Expr, ...]:
        """The way's, and none: what moves the law is `carried` by the ends of the play."""
        return (speed, *(sympy.S.Zero for _ in z[1:]))

    def force(self, way: Expr, speed: Expr, z: Sequence[Expr], signs: Mapping[str, Expr]) -> Expr:
        return self.law.force(way - z[0], sympy.S.Zero, z[1:], signs)

    def switches(self, speed: Expr, z: Sequence[Expr]) -> dict[str, Expr]:
        """Those of the law but for the speed, whose sign each end of the play knows."""
        return {name: at for name, at in self.law.switches(speed, z[1:]).items() if name != "speed"}

    @property
    def rooted(self) -> tuple[str, ...]:
        return self.law.rooted

    def bounds(self) -> dict[int, Expr]:
        return {0: self.w}

    def carried(self, z: Sequence[Expr], signs: Mapping[str, Expr], bound: int, outward: int) -> dict[int, Expr]:
        sides = {**signs, "speed": sympy.Integer(outward)}
        return dict(enumerate(self.law.rates(sympy.Integer(outward), z[1:], sides), 1))

    @property
    def full(self) -> tuple[Expr, ...]:
        return (self.w, *self.law.full)

    @property
    def requirements(self) -> tuple[Requirement, ...]:
        return self.law.requirements
