"""Constants of the recurrences: parameters, what follows from them alone, and what is constant over one step."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import sympy

from fmu_models.codegen.c_expression import Expr, c_factor
from fmu_models.codegen.variations import varied


@dataclass
class Constants:
    """Constants of one model: parameters ``p[i]``, what is derived from parameters alone, ``d[i]``, and ``held``.

    ``held`` are the constants of one step: signs of slip and speeds of entry.
    """

    names: Mapping[sympy.Basic, str]
    held: Mapping[sympy.Basic, str]
    derived: dict[Expr, str] = field(default_factory=dict)

    def text(self, value: Expr) -> str:
        """C code of a constant; anything but a single parameter or number is computed once, in ``d``."""
        if value in self.held:
            return self.held[value]
        if value in self.names:
            return self.names[value]
        if not value.free_symbols:
            return c_factor(value, {})
        if not value.free_symbols & set(self.held):
            return self.derived.setdefault(value, f"d[{len(self.derived)}]")
        if value.is_Mul:
            own = [factor for factor in value.args if factor.free_symbols & set(self.held)]
            rest = sympy.Mul(*(factor for factor in value.args if factor not in own))
            if rest.free_symbols:
                return f"{self.text(rest)} * {c_factor(sympy.Mul(*own), {**self.names, **self.held})}"
        return c_factor(value, {**self.names, **self.held})

    def by_parameters(self, value: Expr) -> str:
        """C code of the part of the variation of a constant that parameters make; empty if they have none."""
        own, rest = self._parts(value)
        if own.free_symbols - set(self.held):
            found = sorted(value.free_symbols - set(self.held), key=lambda q: self.names[q])
            return " + ".join(f"{self._factor(sympy.diff(value, q))} * {varied(self.names[q])}" for q in found)
        if not rest.free_symbols:
            return ""
        if not own.free_symbols:
            return varied(self.text(value))
        return f"{self._factor(own)} * {varied(self.text(rest))}"

    def by_memories(self, value: Expr) -> str:
        """The same of the part that speeds of entry make; a sign of slip has no variation."""
        own, rest = self._parts(value)
        memories = [q for q in own.free_symbols & set(self.held) if "memory" in self.held[q]]
        memories.sort(key=lambda q: self.held[q])
        factor = "" if rest == 1 else f"{self._factor(rest)} * "
        return " + ".join(f"{factor}{self._factor(sympy.diff(own, q))} * {varied(self.held[q])}" for q in memories)

    def _parts(self, value: Expr) -> tuple[Expr, Expr]:
        """The factors of a constant that only ``held`` makes, and the others."""
        own = [factor for factor in sympy.Mul.make_args(value) if factor.free_symbols & set(self.held)]
        rest = [factor for factor in sympy.Mul.make_args(value) if factor not in own]
        return sympy.Mul(*own), sympy.Mul(*rest)

    def _factor(self, value: Expr) -> str:
        return f"({self.text(value)})"
