"""Expressions as plain C, for what is evaluated once: constants, bounds, magnitudes at one instant."""

from collections.abc import Mapping
from typing import Any

import sympy

from fmu_models.base.errors import StickslipError

Expr = Any  # SymPy annotates the arguments of every expression as Basic, which has no arithmetic

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


def c_number(value: Expr | float) -> str:
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


def c_expression(expression: Expr, names: Mapping[sympy.Basic, str]) -> str:
    """C code of a double; ``names`` says what each symbol is called there. StickslipError: the expression uses a
    function that C code is not made for."""
    if expression in names:
        return names[expression]
    if not expression.free_symbols and expression.is_real:
        return c_number(expression)
    if expression.is_Add:
        return _sum(expression, names)
    if expression.is_Mul:
        return _product(expression, names)
    if expression.is_Pow:
        return _power(expression, names)
    if expression.func in _FUNCTIONS:
        return f"{_FUNCTIONS[expression.func]}({c_expression(expression.args[0], names)})"
    raise StickslipError(unsupported(expression))


def c_factor(expression: Expr, names: Mapping[sympy.Basic, str]) -> str:
    """C code that may stand as a factor of a product."""
    text = c_expression(expression, names)
    return f"({text})" if expression.is_Add or text.startswith("-") else text


def unsupported(expression: Expr) -> str:
    """The lesson for an expression that no code is made for."""
    operators = ", ".join(["+ - * / **", *sorted(_FUNCTIONS.values()), "sqrt"])
    return (
        f"'{expression}' cannot be turned into code. A model may use {operators}; what is not smooth "
        "(an absolute value, a sign, a case distinction) belongs into a contact or its law."
    )


def divisor_of(factor: Expr) -> Expr | None:
    """What a factor of a product divides by, if it is a division."""
    if factor.is_Pow and factor.exp.is_Number and factor.exp < 0:
        return sympy.Pow(factor.base, -factor.exp)
    return None


def is_negative(term: Expr) -> bool:
    """Whether a term begins with a minus."""
    return bool(term.as_coeff_Mul()[0] < 0)


def _sum(expression: Expr, names: Mapping[sympy.Basic, str]) -> str:
    """Terms without a minus first, so that the code does not begin with one needlessly."""
    terms = sorted(expression.args, key=is_negative)
    text = c_expression(terms[0], names)
    for term in terms[1:]:
        text += f" - {c_expression(-term, names)}" if is_negative(term) else f" + {c_expression(term, names)}"
    return text


def _product(expression: Expr, names: Mapping[sympy.Basic, str]) -> str:
    number, factors = expression.as_coeff_Mul()
    above, below = [], []
    for factor in sympy.Mul.make_args(factors):
        divisor = divisor_of(factor)
        if divisor is None:
            above.append(c_factor(factor, names))
        else:
            below.append(c_factor(divisor, names))
    if abs(number) != 1 or not above:
        above.insert(0, c_number(abs(number)))
    text = ("-" if number < 0 else "") + " * ".join(above)
    if not below:
        return text
    return f"{text} / ({' * '.join(below)})" if len(below) > 1 or " * " in below[0] else f"{text} / {below[0]}"


def _power(expression: Expr, names: Mapping[sympy.Basic, str]) -> str:
    base, exponent = expression.as_base_exp()
    if exponent.is_Number and exponent < 0:
        return f"1.0 / ({c_expression(base**-exponent, names)})"
    if exponent.is_Integer and exponent <= 4:
        return " * ".join([c_factor(base, names)] * int(exponent))
    if exponent == sympy.Rational(1, 2):
        return f"sqrt({c_expression(base, names)})"
    return f"pow({c_expression(base, names)}, {c_expression(exponent, names)})"
