"""Constants of the recurrences: parameters, what follows from them alone, and what is constant over one step."""

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
            factors = [factor for factor in value.args if factor.free_symbols & set(self.held)]
            constant = sympy.Mul(*(factor for factor in value.args if factor not in factors))
            if constant.free_symbols:
                return f"{self.text(constant)} * {c_factor(sympy.Mul(*factors), {**self.names, **self.held})}"
        return c_factor(value, {**self.names, **self.held})

    def by_parameters(self, value: Expr) -> str:
        """C code of the part of the variation of a constant that parameters make; empty if they have none."""
        factors, constant = self._split(value)
        if factors.free_symbols - set(self.held):
            parameters = sorted(value.free_symbols - set(self.held), key=lambda q: self.names[q])
            return " + ".join(f"{self._factor(sympy.diff(value, q))} * {varied(self.names[q])}" for q in parameters)
        if not constant.free_symbols:
            return ""
        if not factors.free_symbols:
            return varied(self.text(value))
        return f"{self._factor(factors)} * {varied(self.text(constant))}"

    def by_memories(self, value: Expr) -> str:
        """C code of the part that speeds of entry make of that variation; a sign of slip has none."""
        factors, constant = self._split(value)
        memories = [q for q in factors.free_symbols & set(self.held) if "memory" in self.held[q]]
        memories.sort(key=lambda q: self.held[q])
        factor = "" if constant == 1 else f"{self._factor(constant)} * "
        return " + ".join(f"{factor}{self._factor(sympy.diff(factors, q))} * {varied(self.held[q])}" for q in memories)

    def _split(self, value: Expr) -> tuple[Expr, Expr]:
        """The factors of a constant that only ``held`` makes, and the others."""
        factors = [factor for factor in sympy.Mul.make_args(value) if factor.free_symbols & set(self.held)]
        others = [factor for factor in sympy.Mul.make_args(value) if factor not in factors]
        return sympy.Mul(*factors), sympy.Mul(*others)

    def _factor(self, value: Expr) -> str:
        return f"({self.text(value)})"
