"""The rig with one disc whose normal force, spring, damping and drive have the factors of disturbances, as an FMU."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from identification.disturbances.term import DAMPING, DRIVE, FRICTION, SPRING, DisturbanceTerm

if TYPE_CHECKING:
    import sympy

    from fmu_models.fmu.fmu import Fmu
    from fmu_models.language.quantities import Input, Parameter
    from fmu_models.lowering.hybrid_system import HybridSystem

# inputs: angle of the drive, rad; normal force by a load cell over its mean; temperature over its mean, K
TURNED, LOAD, WARMER = "turned", "load", "warmer"
MIDDLE_ANGLE = "middle_angle"  # rad, a parameter: the reference of the terms
MIDDLE, DURATION = "middle", "duration"  # s, parameters: of the log
SIDE = "side"  # 1 or -1, a parameter: which way the disc slips


def disturbed_oscillator(disc: str, law: str, terms: Sequence[DisturbanceTerm]) -> Fmu:
    """The rig with one disc ("disc0") under these terms: a parameter for each effect and order, and the inputs and
    parameters that their formulas depend on."""
    from fmu_models.codegen.package import built_of, kept_as, kept_by_name
    from fmu_models.fmu.fmu import Fmu

    parameters = {term.parameter: term for term in terms if not term.of_sensor}
    name = "_".join(["disturbed", *parameters])
    files = {__file__, *(term.effect.formula.__code__.co_filename for term in parameters.values())}

    def oscillator() -> HybridSystem:
        return _oscillator(name, disc, law, list(parameters.values()))

    if not kept_by_name("disc_rig", {disc: law}):
        return Fmu.open(built_of(oscillator()))
    key = (name, disc, law, *(Path(file).read_bytes() for file in sorted(files)))
    return Fmu.open(kept_as(name, key, oscillator))


class _Symbols:
    """Whereabouts as symbols; what no formula asks for is no variable of the oscillator."""

    def __init__(self, angle: sympy.Expr, speed: sympy.Expr) -> None:
        self._angle, self.speed = angle, speed

    @cached_property
    def turned(self) -> Input:
        from fmu_models.language.quantities import Input

        return Input(TURNED, 0.0, "rad", "angle of the drive")

    @cached_property
    def angle(self) -> sympy.Expr:
        from fmu_models.language.quantities import Parameter

        return self._angle - Parameter(MIDDLE_ANGLE, 0.0, "rad", "angle at which friction is that of the law")

    @cached_property
    def share(self) -> sympy.Expr:
        from fmu_models.language.quantities import TIME, Parameter

        return (TIME - Parameter(MIDDLE, 0.0, "s", "middle of the log")) / self.duration

    @cached_property
    def duration(self) -> Parameter:
        from fmu_models.language.quantities import Parameter

        return Parameter(DURATION, 1.0, "s", "duration of the log", positive=True)

    @cached_property
    def side(self) -> Parameter:
        from fmu_models.language.quantities import Parameter

        return Parameter(SIDE, 1.0, "1", "which way the disc slips")

    @cached_property
    def load(self) -> Input:
        from fmu_models.language.quantities import Input

        return Input(LOAD, 1.0, "1", "normal force by a load cell over its mean")

    @cached_property
    def warmer(self) -> Input:
        from fmu_models.language.quantities import Input

        return Input(WARMER, 0.0, "K", "temperature over its mean")


def _oscillator(name: str, disc: str, law: str, terms: Sequence[DisturbanceTerm]) -> HybridSystem:
    import sympy

    from fmu_models.codegen.package import variant
    from fmu_models.language.friction import Friction
    from fmu_models.language.laws.conti import Conti
    from fmu_models.language.quantities import Parameter
    from fmu_models.lowering.lower import lower
    from fmu_models.oscillators import disc_rig

    rig = variant("disc_rig", [disc])
    (contact,), (theta,) = rig.contacts, rig.coordinates
    assert isinstance(contact, Friction) and isinstance(contact.law, Conti)
    symbols, factors = _Symbols(theta, theta.v), defaultdict[str, dict[str, Any]](dict)
    for term in terms:
        effect, order = term.effect, term.order
        unit = effect.unit(order).replace("^", "")
        value = Parameter(term.parameter, term.first, unit, effect.meaning(order))
        sums, factor = factors[effect.acts], effect.factor or effect.name
        sums[factor] = sums.get(factor, sympy.Integer(1)) + value * effect.formula(symbols, order, sympy)
    friction, spring, damping, drive = (
        sympy.Mul(*factors[acts].values()) for acts in (FRICTION, SPRING, DAMPING, DRIVE)
    )
    R, r = disc_rig.R, disc_rig.r
    turning = r * next(one for one in contact.slip.free_symbols if str(one) == f"w{disc[-1]}")
    more = disc_rig.k * theta * (1 - spring) + disc_rig.c * theta.v * (1 - damping)
    driven = rig.with_law(**{disc: replace(contact.law, N=contact.law.N * friction)})
    (rubbing,) = driven.contacts
    assert isinstance(rubbing, Friction)
    rubbing = replace(rubbing, slip=turning * drive - R * theta.v) if drive != 1 else rubbing
    driven = replace(driven, name=name, applied={theta: more}, contacts=[rubbing], outputs=())
    return lower(variant(driven, laws={disc: law}))
