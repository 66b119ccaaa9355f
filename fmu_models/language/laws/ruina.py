"""Ruina's friction of rate and state: contacts that change with slip.

    theta' = -u ln u,    u = (|v| + v_c) theta/D_c

the rest as in ``dieterich``: the same friction in steady slip, and another way to it. At rest contacts age by creep at
v_c alone, that is hardly.

Source: Ruina, Slip instability and state variable friction laws, Journal of Geophysical Research 88 (1983).
"""

from dataclasses import dataclass
from typing import ClassVar, final

import sympy

from fmu_models.language.laws.dieterich import RateState


@final
@dataclass(frozen=True)
class Ruina(RateState):
    """Contacts come to their steady age over a slip of D_c, however far they are from it."""

    label: ClassVar[str] = "Ruina"

    def rates(self, slip: sympy.Expr, sign: sympy.Expr) -> tuple[sympy.Expr, ...]:
        u = (sign * slip + self.v_c) * self.age / self.D_c
        return (-u * sympy.log(u),)


LAW = Ruina
