"""The rule of a map as C: the operations in the order in which NumPy makes those of the declared map."""

import sympy
from sympy.printing.c import C99CodePrinter

from fmu_models.codegen.c_expression import c_number
from fmu_models.lowering.hybrid_system import HybridSystem
from fmu_models.lowering.iterated import differentiated

_WRAPPED = """/* the rest of a division by a positive number, as Python takes it */
static double wrapped(double value, double turn)
{
    const double rest = fmod(value, turn);
    return rest < 0.0 ? rest + turn : rest == 0.0 ? 0.0 : rest;
}

"""


class _Printer(C99CodePrinter):
    def __init__(self, names: dict[sympy.Basic, str]) -> None:
        super().__init__({"math_macros": {}})  # M_PI_2 and its like are no part of C99
        self._names = names

    def _print_Symbol(self, expr: sympy.Symbol) -> str:
        return self._names.get(expr) or str(expr.name)

    # SymPy's own printers take what is called a Quantity for a physical unit
    _print_Quantity = _print_Symbol

    def _print_NumberSymbol(self, expr: sympy.NumberSymbol) -> str:
        return c_number(expr)

    def _print_Pow(self, expr: sympy.Pow) -> str:
        """A square as NumPy makes it: a product, which pow() need not round to."""
        if expr.exp == 2:
            base = self._print(expr.base)
            return f"(({base})*({base}))"
        return super()._print_Pow(expr)


def rule_functions(system: HybridSystem) -> str:
    """model_iterate, model_iterate_derivative and model_period; of a system that is no map empty ones."""
    names: dict[sympy.Basic, str] = {p: f"p[{i}]" for i, p in enumerate(system.parameters)}
    names |= {x: f"x[{i}]" for i, x in enumerate(system.states)}
    rule, derivative, volume, period, head = [], [], "0.0", "0.0", ""
    if system.rule:
        ordered = {x: system.rule[x] for x in system.states}
        rule, after = _assigned(names, list(ordered.values()))
        for i, (state, text) in enumerate(zip(ordered, after, strict=True)):
            turn = system.modulus.get(state)
            rule.append(f"next[{i}] = {text if turn is None else f'wrapped({text}, {c_number(turn)})'};")
        entries, determinant = differentiated(ordered)
        derivative, (*after, volume) = _assigned(names, [*entries, determinant])
        derivative += [f"jacobian[{i}] = {text};" for i, text in enumerate(after)]
        period = names[system.parameters[-1]]
        head = _WRAPPED if system.modulus else ""
    return "\n".join(
        (
            head + "void model_iterate(const double *p, const double *x, double *next)",
            *_body(["(void)p, (void)x, (void)next;", *rule]),
            "double model_iterate_derivative(const double *p, const double *x, double *jacobian)",
            *_body(["(void)p, (void)x, (void)jacobian;", *derivative, f"return {volume};"]),
            "double model_period(const double *p)",
            *_body(["(void)p;", f"return {period};"]),
        )
    )


def _assigned(names: dict[sympy.Basic, str], expressions: list[sympy.Expr]) -> tuple[list[str], list[str]]:
    """Statements for what expressions share, and the expressions after them."""
    names = dict(names)
    printer, lines = _Printer(names), []
    shared, after = sympy.cse(expressions, list=False)
    for k, (symbol, value) in enumerate(shared):
        lines.append(f"const double part{k} = {printer.doprint(value)};")
        names[symbol] = f"part{k}"
    return lines, [str(printer.doprint(value)) for value in after]


def _body(lines: list[str]) -> list[str]:
    return ["{", *(f"    {line}" for line in lines), "}", ""]
