"""Friction laws of coefficients as laws of friction force, which a log of efforts shows."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from identification.laws import slip_laws
from identification.laws.law import FittableLaw

BY_DIRECTION = "Coulomb+viscous by direction"  # no function of slip speed alone
COEFFICIENT = "mu"  # parameters of a law that begin so are friction coefficients, or proportional to them


def comparable() -> tuple[str, ...]:
    """Names of the laws of friction force that may be compared."""
    return (*slip_laws(), BY_DIRECTION)


@dataclass(frozen=True, eq=False, kw_only=True)
class ForceLaw(FittableLaw):
    """A law of friction force. coefficients: the law that it is of; scale: N or N m, force of a coefficient of 1;
    factor: (m,) of its parameters over those of the coefficients."""

    coefficients: FittableLaw
    scale: float
    factor: np.ndarray

    def start(self, v: np.ndarray, mu: np.ndarray) -> np.ndarray:
        """First guess, as in `FittableLaw`; mu: rough forces (n,)."""
        return self.factor * self.coefficients.start(v, mu / self.scale)

    def warnings(self, q: np.ndarray) -> tuple[str, ...]:
        """Warnings of the coefficients, whatever the units of the compared parameters, by the names of this law."""
        warnings = self.coefficients.warnings(q)
        for p in self.coefficients.parameters:
            warnings = tuple(warning.replace(f"{p.name} =", f"{_force_name(p.name)} =") for warning in warnings)
        return warnings


def force_law(law: FittableLaw, scale: float, turning: bool) -> ForceLaw:
    """A law of friction coefficients as one of friction force. scale: N or N m, force of a coefficient of 1; turning:
    whether the body turns: rad and N m in place of m and N."""
    factor = np.array([scale if p.name.startswith(COEFFICIENT) else 1.0 for p in law.parameters])
    shape = (-1, 1)
    parameters = tuple(
        replace(
            p,
            name=_force_name(p.name),
            unit=_force_unit(p.name, p.unit, turning),
            minimum=by * p.minimum,
            maximum=by * p.maximum,
        )
        for p, by in zip(law.parameters, factor, strict=True)
    )
    changes: dict[str, Any] = {
        "parameters": parameters,
        "value": lambda v, q: scale * law.value(v, q / factor),
        "gradient": lambda v, q: scale * law.gradient(v, q / factor) / factor.reshape(shape),
    }
    return ForceLaw(**vars(law) | changes, coefficients=law, scale=scale, factor=factor)


def _force_name(name: str) -> str:
    return "F" + name.removeprefix(COEFFICIENT) if name.startswith(COEFFICIENT) else name


def _force_unit(name: str, unit: str, turning: bool) -> str:
    """Unit of a parameter of a law where friction is an effort and the slip speed that of the coordinate."""
    turned = unit.replace("s/m", "s/rad").replace("m/s", "rad/s") if turning else unit
    if not name.startswith(COEFFICIENT):
        return turned
    effort = "N m" if turning else "N"
    return effort if unit == "1" else f"{effort} {turned}"
