"""Expressions as plain C, for what is evaluated once: constants, bounds, magnitudes at one instant."""

from __future__ import annotations

from collections.abc import Mapping

import sympy

from fmu_models.errors import StickslipError

_FUNCTIONS = {
    sympy.exp: "exp",
    sympy.log: "log",
    sympy.sin: "sin",
    sympy.cos: "cos",
    sympy.tan: "tan",
    sympy.sinh: "sinh",
    sympy.cosh: "cosh",
    sympy.tanh: "tanh",
    sympy.atan: "atan",
}


def c_number(value: sympy.Expr | float) -> str:
    """A double literal that reads back exactly.

    >>> c_number(sympy.Rational(1, 3)), c_number(2), c_number(-0.5)
    ('0.3333333333333333', '2.0', '-0.5')
    """
    return repr(float(value))


def c_string(text: str) -> str:
    """A C string literal.

    >>> print(c_string('say "no"'))
    "say \\"no\\""
    """
    escaped = text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", " ")
    return f'"{escaped}"'


def c_expression(expression: sympy.Expr, names: Mapping[sympy.Basic, str]) -> str:
    """C code of a double; ``names`` says what each symbol is called there.

    Raises:
        StickslipError: the expression uses a function that C code is not made for.
    """
    if expression in names:
        return names[expression]
    if not expression.free_symbols and expression.is_real:
        return _signed(c_number(expression))
    if expression.is_Add:
        return _sum([c_expression(term, names) for term in expression.args])
    if expression.is_Mul:
        return _product(expression, names)
    if expression.is_Pow:
        return _power(expression, names)
    if expression.func in _FUNCTIONS:
        return f"{_FUNCTIONS[expression.func]}({c_expression(expression.args[0], names)})"
    raise StickslipError(unsupported(expression))


def unsupported(expression: sympy.Expr) -> str:
    """The lesson for an expression that no code is made for."""
    known = ", ".join(["+ - * / **", *sorted(_FUNCTIONS.values()), "sqrt"])
    return (
        f"'{expression}' cannot be turned into code. A model may use {known}; what is not smooth "
        "(an absolute value, a sign, a case distinction) belongs into a contact or its law."
    )


def _signed(number: str) -> str:
    return f"({number})" if number.startswith("-") else number


def _sum(terms: list[str]) -> str:
    return f"({' + '.join(terms)})"


def _product(expression: sympy.Expr, names: Mapping[sympy.Basic, str]) -> str:
    above, below = [], []
    for factor in expression.args:
        if factor.is_Pow and factor.exp.is_Number and factor.exp < 0:
            below.append(c_expression(factor.base**-factor.exp, names))
        else:
            above.append(c_expression(factor, names))
    text = " * ".join(above) or "1.0"
    return f"({text} / ({' * '.join(below)}))" if below else f"({text})"


def _power(expression: sympy.Expr, names: Mapping[sympy.Basic, str]) -> str:
    base, exponent = expression.as_base_exp()
    if exponent.is_Number and exponent < 0:
        return f"(1.0 / {c_expression(base**-exponent, names)})"
    if exponent.is_Integer and exponent <= 4:
        return f"({' * '.join([c_expression(base, names)] * int(exponent))})"
    if exponent == sympy.Rational(1, 2):
        return f"sqrt({c_expression(base, names)})"
    return f"pow({c_expression(base, names)}, {c_expression(exponent, names)})"
