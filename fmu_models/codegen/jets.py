"""Expressions as Taylor recurrences: one line of C per operation on series, shared where it occurs twice.

Every expression is brought to the form  c_0 + sum_i c_i s_i  with series s_i and constants c_i (numbers, parameters,
signs of slip). Sums and multiples so need no line of their own; a product, quotient or function of series becomes one
new series ``j->w[n]``, computed from lower orders as engine/model/jets.h says.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field

import sympy

from fmu_models.base.errors import StickslipError
from fmu_models.codegen.c_expression import Expr, c_factor, divisor_of, is_negative, unsupported
from fmu_models.language.quantities import TIME

_ONE = sympy.S.One
_HALF = sympy.Rational(1, 2)


@dataclass(frozen=True)
class Affine:
    """c_0 + sum of c_i s_i; ``terms`` maps the C names of the s_i to the c_i."""

    constant: Expr
    terms: dict[str, Expr] = field(default_factory=dict)

    @property
    def single(self) -> tuple[str, Expr] | None:
        """Name and factor of the series, if there is exactly one."""
        if len(self.terms) == 1:
            ((series, factor),) = self.terms.items()
            return series, factor
        return None


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
        constants, slots: of the model, shared by its functions.
        rooted: symbols whose root is taken of a series that may begin with zeros.
    """

    def __init__(
        self,
        series: Mapping[sympy.Basic, str],
        constants: Constants,
        slots: Slots,
        rooted: Collection[sympy.Basic] = (),
    ) -> None:
        self.lines: list[str] = []
        self._constants = constants
        self._slots = slots
        self._rooted = rooted
        self._forms = {symbol: _alone(name) for symbol, name in series.items()}
        self._variable = {s for s in self._forms if s.is_Symbol}
        self._nodes: dict[tuple[str, ...], str] = {}

    def assign(self, target: str, expression: Expr) -> None:
        """Add the line that sets coefficient k of the series ``target`` to that of the expression."""
        self.lines.append(f"{target}[k] = {self._coefficient(self._affine(sympy.sympify(expression)))};")

    def share(self, earlier: Recurrences) -> None:
        """Read what another function of the model has computed by then, to the same order, instead of computing it."""
        self._nodes |= earlier._nodes

    def _affine(self, expression: Expr) -> Affine:
        if expression not in self._forms:
            self._forms[expression] = self._derive(expression)
        return self._forms[expression]

    def _derive(self, e: Expr) -> Affine:
        if not e.free_symbols & self._variable:
            return Affine(e)
        if e.is_Add:
            return self._sum([(_ONE, self._affine(term)) for term in e.args])
        if e.is_Mul:
            return self._mul(e)
        if e.is_Pow:
            return self._pow(e.base, e.exp)
        if e.func is sympy.exp:
            return self._node("jet_exp({0}, {y}, k)", self._series(self._affine(e.args[0])))
        if e.func is sympy.log:
            return self._node("jet_log({0}, {y}, k)", self._series(self._affine(e.args[0])))
        if e.func in (sympy.sin, sympy.cos, sympy.sinh, sympy.cosh):
            return self._pair(e)
        if e.func is sympy.tan:
            return self._affine(sympy.Mul(sympy.sin(e.args[0]), 1 / sympy.cos(e.args[0]), evaluate=False))
        if e.func is sympy.tanh:
            return self._tanh(self._series(self._affine(e.args[0])))
        if e.func is sympy.atan:
            argument = self._series(self._affine(e.args[0]))
            return self._node("jet_atan({0}, {1}, {y}, k)", argument, self._name("jet_square({0}, k)", argument))
        raise StickslipError(unsupported(e))

    def _sum(self, parts: list[tuple[Expr, Affine]]) -> Affine:
        constant = sympy.Add(*(factor * part.constant for factor, part in parts))
        terms: dict[str, Expr] = {}
        for factor, part in parts:
            for series, coefficient in part.terms.items():
                terms[series] = terms.get(series, sympy.S.Zero) + factor * coefficient
        terms = {series: c for series, c in terms.items() if c != 0}
        return Affine(constant, terms)

    def _mul(self, e: Expr) -> Affine:
        """A product: constants outside, series multiplied, then divided by the product of the denominators."""
        constants, above, below = [], [], []
        for factor in e.args:
            divisor = divisor_of(factor)
            if not factor.free_symbols & self._variable:
                constants.append(factor)
            elif divisor is None:
                above.append(self._affine(factor))
            else:
                below.append(self._affine(divisor))
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
            return self._sum([(ca * cb, self._node("jet_square({0}, k)", sa))])
        return self._sum([(ca * cb, self._node("jet_product({0}, {1}, k)", sa, sb))])

    def _quotient(self, a: Affine, b: Affine) -> Affine:
        if not b.terms:
            return self._sum([(1 / b.constant, a)])
        if b.single:
            name, factor = b.single
            denominator = (self._text(b.constant), self._text(factor), name)
        else:
            denominator = ("0.0", "1.0", self._series(b))
        if not a.terms:
            return self._sum([(a.constant, self._node("jet_reciprocal({0}, {1}, {2}, {y}, k)", *denominator))])
        factor, numerator = self._multiple(a)
        return self._sum([(factor, self._node("jet_quotient({0}, {1}, {2}, {3}, {y}, k)", numerator, *denominator))])

    def _pow(self, base: Expr, exponent: Expr) -> Affine:
        if exponent.free_symbols & self._variable:
            return self._affine(sympy.exp(exponent * sympy.log(base), evaluate=False))
        if exponent.is_Float:
            exponent = sympy.Rational(float(exponent))
        if exponent.is_Number and exponent < 0:
            return self._quotient(Affine(_ONE), self._affine(sympy.Pow(base, -exponent)))
        if exponent.is_Integer:  # repeated multiplication also works where the base is zero
            half = self._affine(sympy.Pow(base, exponent // 2))
            even = self._times(half, half)
            return self._times(even, self._affine(base)) if exponent % 2 else even
        if exponent == _HALF:
            root = "jet_root" if base in self._rooted else "jet_sqrt"
            return self._node(f"{root}({{0}}, {{y}}, k)", self._series(self._affine(base)))
        if exponent.is_Rational and exponent.q == 2:
            return self._times(self._affine(sympy.Pow(base, exponent - _HALF)), self._affine(sympy.sqrt(base)))
        argument = self._series(self._affine(base))
        return self._node("jet_power({0}, {1}, {y}, k)", argument, self._text(exponent))

    def _phase(self, angle: Expr) -> str | None:
        """Series of an angle that grows in proportion to time, reduced exactly, however large; None for others."""
        if angle.free_symbols & self._variable != {TIME}:
            return None
        rate = sympy.diff(angle, TIME)
        if rate.has(TIME) or rate.free_symbols & set(self._constants.held):
            return None
        offset = self._text(sympy.expand(angle - rate * TIME))
        frequency = rate / (2 * sympy.pi)
        turns = not frequency.has(sympy.pi)
        name, value = ("jet_turns", frequency) if turns else ("jet_angle", rate)
        template = f"{name}({{0}}, {{1}}, {{2}}, j->time_rest, k)"
        return self._name(template, self._text(value), offset, self._series(self._forms[TIME]))

    def _pair(self, e: Expr) -> Affine:
        """Sine and cosine, circular or hyperbolic: each needs the lower orders of the other."""
        h = "" if e.func in (sympy.sin, sympy.cos) else "h"
        phase = None if h else self._phase(e.args[0])
        argument = phase or self._series(self._affine(e.args[0]))
        sine, cosine = (f"sin{h}", argument), (f"cos{h}", argument)
        kind = "_phase" if phase else h
        if sine not in self._nodes:
            s, c = self._slots.new(), self._slots.new()
            self._nodes |= {sine: s, cosine: c}
            self.lines.append(f"{s}[k] = jet_sin{kind}({argument}, {c}, k);")
            self.lines.append(f"{c}[k] = jet_cos{kind}({argument}, {s}, k);")
        return _alone(self._nodes[sine if e.func in (sympy.sin, sympy.sinh) else cosine])

    def _tanh(self, argument: str) -> Affine:
        """Hyperbolic tangent, which needs the lower orders of its own square."""
        key = ("tanh", argument)
        if key not in self._nodes:
            tanh, square = self._slots.new(), self._slots.new()
            self._nodes |= {key: tanh, ("jet_square({0}, k)", tanh): square}
            self.lines.append(f"{tanh}[k] = jet_tanh({argument}, {square}, k);")
            self.lines.append(f"{square}[k] = jet_square({tanh}, k);")
        return _alone(self._nodes[key])

    def _node(self, template: str, *operands: str) -> Affine:
        """The series that a recurrence of jets.h computes; ``{y}`` in the template is the series itself."""
        return _alone(self._name(template, *operands))

    def _name(self, template: str, *operands: str) -> str:
        key = (template, *operands)
        if key not in self._nodes:
            name = self._slots.new()
            self._nodes[key] = name
            self.lines.append(f"{name}[k] = {template.format(*operands, y=name)};")
        return self._nodes[key]

    def _multiple(self, form: Affine) -> tuple[Expr, str]:
        """Factor and series whose product is the form; a sum gets a series of its own."""
        if form.single and form.constant == 0:
            name, factor = form.single
            return factor, name
        return _ONE, self._series(form)

    def _series(self, form: Affine) -> str:
        """The form as a series that other recurrences can read."""
        if form.single and form.constant == 0 and form.single[1] == 1:
            return form.single[0]
        return self._name("{0}", self._coefficient(form))

    def _coefficient(self, form: Affine) -> str:
        """C code of coefficient k of the form."""
        parts = []
        for series, factor in form.terms.items():
            sign, text = self._signed(factor)
            parts.append((sign, f"{series}[k]" if text == "1.0" else f"{text} * {series}[k]"))
        if form.constant != 0:
            sign, text = self._signed(form.constant)
            parts.append((sign, f"(k == 0 ? {text} : 0.0)"))
        if not parts:
            return "0.0"
        parts.sort(key=lambda part: part[0] == "-")
        (first_sign, first), *others = parts
        head = f"-{first}" if first_sign == "-" else first
        return head + "".join(f" {sign} {text}" for sign, text in others)

    def _signed(self, value: Expr) -> tuple[str, str]:
        if is_negative(value):
            return "-", self._text(-value)
        return "+", self._text(value)

    def _text(self, value: Expr) -> str:
        return self._constants.text(value)


def _alone(series: str) -> Affine:
    return Affine(sympy.S.Zero, {series: _ONE})
