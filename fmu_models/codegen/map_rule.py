"""The rule of a map as C: the operations in the order in which NumPy makes those of the declared map."""

from __future__ import annotations

from typing import Any

import sympy
from sympy.printing.c import C99CodePrinter

from fmu_models.codegen.c_expression import c_number
from fmu_models.lowering.hybrid_system import HybridSystem

_WRAPPED = """/* the rest of a division by a positive number, as Python takes it */
static double wrapped(double value, double turn)
{
    const double rest = fmod(value, turn);
    return rest < 0.0 ? rest + turn : rest == 0.0 ? 0.0 : rest;
}

"""


class _Printer(C99CodePrinter):
    def __init__(self, names: dict[sympy.Basic, str]) -> None:
        super().__init__()
        self._names = names

    def _print_Symbol(self, expr: Any) -> str:
        return self._names.get(expr) or str(expr.name)

    # SymPy's own printers take what is called a Quantity for a physical unit
    _print_Quantity = _print_Symbol

    def _print_NumberSymbol(self, expr: Any) -> str:
        return c_number(expr)

    def _print_Pow(self, expr: Any) -> str:
        """A square as NumPy makes it: a product, which pow() need not round to."""
        if expr.exp == 2:
            base = self._print(expr.base)
            return f"(({base})*({base}))"
        return super()._print_Pow(expr)


def rule_functions(system: HybridSystem) -> str:
    """model_iterate and model_period; of a system that is no map empty ones."""
    names: dict[sympy.Basic, str] = {p: f"p[{i}]" for i, p in enumerate(system.parameters)}
    names |= {x: f"x[{i}]" for i, x in enumerate(system.states)}
    printer = _Printer(names)
    lines, period, head = ["(void)p, (void)x, (void)next;"], "0.0", ""
    if system.rule:
        shared, after = sympy.cse([system.rule[x] for x in system.states], list=False)
        for k, (symbol, value) in enumerate(shared):
            lines.append(f"const double part{k} = {printer.doprint(value)};")
            names[symbol] = f"part{k}"
        for i, (state, value) in enumerate(zip(system.states, after, strict=True)):
            text = printer.doprint(value)
            turn = system.modulus.get(state)
            lines.append(f"next[{i}] = {text if turn is None else f'wrapped({text}, {c_number(turn)})'};")
        period = names[system.parameters[-1]]
        head = _WRAPPED if system.modulus else ""
    body = "\n".join(f"    {line}" for line in lines)
    return (
        f"{head}void model_iterate(const double *p, const double *x, double *next)\n{{\n{body}\n}}\n\n"
        f"double model_period(const double *p)\n{{\n    (void)p;\n    return {period};\n}}\n"
    )
