"""Expressions as Taylor recurrences: one line of C per operation on series, shared where it occurs twice.

Every expression is brought to the form  c_0 + sum_i c_i s_i  with series s_i and constants c_i (numbers, parameters,
signs of slip). Sums and multiples so need no line of their own; a product, quotient or function of series becomes one
new series ``j->w[n]``, computed from lower orders as engine/jets.h says.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import sympy

from fmu_models.codegen.c_expression import c_expression, c_number, unsupported
from fmu_models.errors import StickslipError

_ONE = sympy.S.One
_HALF = sympy.Rational(1, 2)


@dataclass(frozen=True)
class Affine:
    """c_0 + sum of c_i s_i; ``terms`` maps the C name of the series s_i to c_i."""

    constant: sympy.Expr
    terms: dict[str, sympy.Expr] = field(default_factory=dict)


@dataclass
class Constants:
    """Constants of one model: parameters ``p[i]``, signs, and what is derived from parameters alone, ``d[i]``."""

    names: Mapping[sympy.Basic, str]
    signs: Mapping[sympy.Basic, str]
    derived: dict[sympy.Expr, str] = field(default_factory=dict)

    def text(self, value: sympy.Expr) -> str:
        """C code of a constant; anything but a single parameter or number is computed once, in ``d``."""
        if value in self.signs:
            return self.signs[value]
        if value in self.names:
            return self.names[value]
        if not value.free_symbols:
            return c_number(value)
        if not value.free_symbols & set(self.signs):
            return self.derived.setdefault(value, f"d[{len(self.derived)}]")
        if value.is_Mul:
            own = [factor for factor in value.args if factor in self.signs]
            rest = [factor for factor in value.args if factor not in self.signs]
            if own and rest:
                return " * ".join(self.text(factor) for factor in [*own, sympy.Mul(*rest)])
        return c_expression(value, {**self.names, **self.signs})

    def reduced(self, value: sympy.Expr) -> sympy.Expr:
        """The constant with squares of signs, which are one, removed."""
        if not value.free_symbols & set(self.signs):
            return value
        return value.replace(
            lambda e: e.is_Pow and e.base in self.signs and e.exp.is_Integer, lambda e: e.base ** (e.exp % 2)
        )


@dataclass
class Slots:
    """Names of new series, ``j->w[0]``, ``j->w[1]``, ..., over all functions of one model."""

    used: int = 0

    def new(self) -> str:
        """The next name."""
        self.used += 1
        return f"j->w[{self.used - 1}]"


class Recurrences:
    """The body of one C function that computes order k of some series.

    Args:
        series: C name of the series that a symbol (or a whole expression computed elsewhere) stands for.
        rates: C name of the series whose time derivative a symbol stands for.
        constants, slots: of the model, shared by its functions.
    """

    def __init__(
        self,
        series: Mapping[sympy.Basic, str],
        rates: Mapping[sympy.Basic, str],
        constants: Constants,
        slots: Slots,
    ) -> None:
        self.lines: list[str] = []
        self._constants = constants
        self._slots = slots
        self._forms = {symbol: Affine(sympy.S.Zero, {name: _ONE}) for symbol, name in series.items()}
        self._forms |= {symbol: Affine(sympy.S.Zero, {f"rate of {name}": _ONE}) for symbol, name in rates.items()}
        self._variable = {s for s in self._forms if s.is_Symbol}
        self._nodes: dict[tuple[str, ...], str] = {}

    def assign(self, target: str, expression: sympy.Expr) -> None:
        """Add the line that sets coefficient k of the series ``target`` to that of the expression."""
        self.lines.append(f"{target}[k] = {self._coefficient(self._affine(sympy.sympify(expression)))};")

    def _affine(self, expression: sympy.Expr) -> Affine:
        if expression not in self._forms:
            self._forms[expression] = self._derive(expression)
        return self._forms[expression]

    def _derive(self, e: sympy.Expr) -> Affine:
        if not e.free_symbols & self._variable:
            return Affine(self._constants.reduced(e))
        if e.is_Add:
            return self._sum([(_ONE, self._affine(term)) for term in e.args])
        if e.is_Mul:
            return self._mul(e)
        if e.is_Pow:
            return self._pow(e.base, e.exp)
        if e.func is sympy.exp:
            return self._function("exp", e.args[0], "{y}")
        if e.func is sympy.log:
            return self._function("log", e.args[0], "{y}")
        if e.func in (sympy.sin, sympy.cos, sympy.sinh, sympy.cosh):
            return self._pair(e)
        if e.func is sympy.tan:
            return self._affine(sympy.Mul(sympy.sin(e.args[0]), 1 / sympy.cos(e.args[0]), evaluate=False))
        if e.func is sympy.tanh:
            return self._tanh(self._series(self._affine(e.args[0])))
        if e.func is sympy.atan:
            argument = self._series(self._affine(e.args[0]))
            return self._node("jet_atan({0}, {1}, {y}, k)", argument, self._square(argument))
        raise StickslipError(unsupported(e))

    def _sum(self, parts: list[tuple[sympy.Expr, Affine]]) -> Affine:
        constant = sympy.Add(*(factor * part.constant for factor, part in parts))
        terms: dict[str, sympy.Expr] = {}
        for factor, part in parts:
            for name, coefficient in part.terms.items():
                terms[name] = terms.get(name, sympy.S.Zero) + factor * coefficient
        terms = {name: self._constants.reduced(c) for name, c in terms.items() if c != 0}
        return Affine(self._constants.reduced(constant), terms)

    def _mul(self, e: sympy.Expr) -> Affine:
        """A product: constants outside, series multiplied, then divided by the product of the denominators."""
        constants, above, below = [], [], []
        for factor in e.args:
            if not factor.free_symbols & self._variable:
                constants.append(factor)
            elif factor.is_Pow and factor.exp.is_Number and factor.exp < 0:
                below.append(self._affine(sympy.Pow(factor.base, -factor.exp)))
            else:
                above.append(self._affine(factor))
        result = self._product(above)
        if below:
            result = self._quotient(result, self._product(below))
        return self._sum([(sympy.Mul(*constants), result)])

    def _product(self, factors: list[Affine]) -> Affine:
        if not factors:
            return Affine(_ONE)
        result = factors[0]
        for factor in factors[1:]:
            result = self._times(result, factor)
        return result

    def _times(self, a: Affine, b: Affine) -> Affine:
        if not a.terms:
            return self._sum([(a.constant, b)])
        if not b.terms:
            return self._sum([(b.constant, a)])
        (ca, sa), (cb, sb) = self._multiple(a), self._multiple(b)
        if sa == sb:
            return self._sum([(ca * cb, self._named(self._square(sa)))])
        first, second = sorted((sa, sb))
        return self._sum([(ca * cb, self._node("jet_product({0}, {1}, k)", first, second))])

    def _quotient(self, a: Affine, b: Affine) -> Affine:
        if not b.terms:
            return self._sum([(1 / b.constant, a)])
        if len(b.terms) == 1 and not self._is_rate(b):
            ((series, factor),) = b.terms.items()
            denominator = (self._text(b.constant), self._text(factor), series)
        else:
            denominator = (self._text(sympy.S.Zero), self._text(_ONE), self._series(b))
        if not a.terms:
            return self._sum([(a.constant, self._node("jet_reciprocal({0}, {1}, {2}, {y}, k)", *denominator))])
        factor, numerator = self._multiple(a)
        return self._sum([(factor, self._node("jet_quotient({0}, {1}, {2}, {3}, {y}, k)", numerator, *denominator))])

    def _pow(self, base: sympy.Expr, exponent: sympy.Expr) -> Affine:
        if exponent.free_symbols & self._variable:
            return self._affine(sympy.exp(exponent * sympy.log(base), evaluate=False))
        if exponent.is_Float:
            exponent = sympy.Rational(float(exponent))
        if exponent.is_Number and exponent < 0:
            return self._quotient(Affine(_ONE), self._affine(sympy.Pow(base, -exponent)))
        if exponent.is_Integer:
            half = self._affine(sympy.Pow(base, exponent // 2))
            even = self._times(half, half)
            return self._times(even, self._affine(base)) if exponent % 2 else even
        if exponent == _HALF:
            return self._node("jet_sqrt({0}, {y}, k)", self._series(self._affine(base)))
        if exponent.is_Rational and exponent.q == 2:
            return self._times(self._affine(sympy.Pow(base, exponent - _HALF)), self._affine(sympy.sqrt(base)))
        argument = self._series(self._affine(base))
        return self._node("jet_power({0}, {1}, {y}, k)", argument, self._text(exponent))

    def _function(self, name: str, argument: sympy.Expr, companion: str) -> Affine:
        return self._node(f"jet_{name}({{0}}, {companion}, k)", self._series(self._affine(argument)))

    def _pair(self, e: sympy.Expr) -> Affine:
        """Sine and cosine, circular or hyperbolic: each needs the lower orders of the other."""
        argument = self._series(self._affine(e.args[0]))
        circular = e.func in (sympy.sin, sympy.cos)
        key = ("circular" if circular else "hyperbolic", argument)
        if key not in self._nodes:
            sine, cosine = self._slots.new(), self._slots.new()
            suffix = "" if circular else "h"
            self.lines.append(f"{sine}[k] = jet_sin{suffix}({argument}, {cosine}, k);")
            self.lines.append(f"{cosine}[k] = jet_cos{suffix}({argument}, {sine}, k);")
            self._nodes[key] = sine
            self._nodes[(*key, "cosine")] = cosine
        is_sine = e.func in (sympy.sin, sympy.sinh)
        return self._named(self._nodes[key if is_sine else (*key, "cosine")])

    def _tanh(self, argument: str) -> Affine:
        key = ("tanh", argument)
        if key not in self._nodes:
            tanh, square = self._slots.new(), self._slots.new()
            self.lines.append(f"{tanh}[k] = jet_tanh({argument}, {square}, k);")
            self.lines.append(f"{square}[k] = jet_square({tanh}, k);")
            self._nodes[key] = tanh
            self._nodes[("jet_square({0}, k)", tanh)] = square
        return self._named(self._nodes[key])

    def _square(self, series: str) -> str:
        ((name, _),) = self._node("jet_square({0}, k)", series).terms.items()
        return name

    def _node(self, template: str, *operands: str) -> Affine:
        """The series that a recurrence of jets.h computes; ``{y}`` in the template is the series itself."""
        key = (template, *operands)
        if key not in self._nodes:
            name = self._slots.new()
            self.lines.append(f"{name}[k] = {template.format(*operands, y=name)};")
            self._nodes[key] = name
        return self._named(self._nodes[key])

    def _multiple(self, form: Affine) -> tuple[sympy.Expr, str]:
        """Factor and series whose product is the form; a sum gets a series of its own."""
        if len(form.terms) == 1 and form.constant == 0 and not self._is_rate(form):
            ((name, factor),) = form.terms.items()
            return factor, name
        return _ONE, self._series(form)

    def _series(self, form: Affine) -> str:
        """The form as a series that other recurrences can read."""
        if form.constant == 0 and not self._is_rate(form) and list(form.terms.values()) == [_ONE]:
            return next(iter(form.terms))
        text = self._coefficient(form)
        if ("sum", text) not in self._nodes:
            name = self._slots.new()
            self.lines.append(f"{name}[k] = {text};")
            self._nodes[("sum", text)] = name
        return self._nodes[("sum", text)]

    def _coefficient(self, form: Affine) -> str:
        """C code of coefficient k of the form."""
        parts = [self._term(c, name) for name, c in form.terms.items()]
        if form.constant != 0:
            sign, text = self._signed(form.constant)
            parts.append((sign, text if text == "0.0" else f"(k == 0 ? {text} : 0.0)"))
        if not parts:
            return "0.0"
        (first_sign, first), *others = parts
        head = f"-{first}" if first_sign == "-" else first
        return head + "".join(f" {sign} {text}" for sign, text in others)

    def _term(self, coefficient: sympy.Expr, name: str) -> tuple[str, str]:
        sign, factor = self._signed(coefficient)
        series = f"(k + 1) * {name.removeprefix('rate of ')}[k + 1]" if name.startswith("rate of ") else f"{name}[k]"
        return sign, series if factor == "1.0" else f"{factor} * {series}"

    def _signed(self, value: sympy.Expr) -> tuple[str, str]:
        if value.as_coeff_Mul()[0] < 0:
            return "-", self._text(-value)
        return "+", self._text(value)

    def _text(self, value: sympy.Expr) -> str:
        return self._constants.text(value)

    @staticmethod
    def _is_rate(form: Affine) -> bool:
        return any(name.startswith("rate of ") for name in form.terms)

    @staticmethod
    def _named(name: str) -> Affine:
        return Affine(sympy.S.Zero, {name: _ONE})
