"""Expressions as Taylor recurrences: one line of C per operation on series, shared where it occurs twice.

Every expression is brought to the form  c_0 + sum_i c_i s_i  with series s_i and constants c_i (numbers, parameters,
signs of slip). Sums and multiples so need no line of their own; a product, quotient or function of series becomes one
new series ``j->w[n]``, computed from lower orders as engine/model/jets.h says. Beside each line stands that of its
variation, of the same order of the series ``l->w[n]`` of derivatives along directions (engine/tangents/variation.h),
and that of the disc that it maps discs to (``discs.py``).
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field

import sympy

from fmu_models.base.errors import StickslipError
from fmu_models.codegen.c_expression import Expr, divisor_of, is_negative, unsupported
from fmu_models.codegen.constants import Constants
from fmu_models.codegen.discs import Discs
from fmu_models.codegen.variations import Variations, varied
from fmu_models.language.quantities import TIME

_ONE = sympy.S.One
_HALF = sympy.Rational(1, 2)

# name -> the recurrence of jets.h for the series {y} of the operands {0}, {1} ..., and that of its variation in
# pair_jets.h: {v0} is the variation of {0}, {c0} that of the first of its constants
_RECURRENCES = {
    "product": ("jet_product({0}, {1}, k)", "pair_both({0}, {v0}, {1}, {v1}, k)"),
    "square": ("jet_square({0}, k)", "2.0 * pair_product({0}, {v0}, k)"),
    "power": ("jet_power({0}, {1}, {y}, k)", "pair_power({0}, {v0}, {1}, {c0}, {y}, {vy}, k)"),
    "lifted": ("jet_lifted({0}, {1}, {y}, k)", "pair_lifted({0}, {v0}, {1}, {y}, {vy}, k)"),
    "sqrt": ("jet_sqrt({0}, {y}, k)", "pair_sqrt({v0}, {y}, {vy}, k)"),
    "root": ("jet_root({0}, {y}, k)", "pair_root({0}, {v0}, {y}, {vy}, k)"),
    "exp": ("jet_exp({0}, {y}, k)", "pair_product({y}, {v0}, k)"),
    "log": ("jet_log({0}, {y}, k)", "pair_log({0}, {v0}, {vy}, k)"),
    "atan": ("jet_atan({0}, {1}, {y}, k)", "pair_atan({v0}, {1}, {vy}, k)"),
    "reciprocal": (
        "jet_reciprocal({0}, {1}, {2}, {y}, k)",
        "pair_reciprocal({moved}, {c0}, {1}, {c1}, {2}, {v2}, {y}, {square}, k)",
    ),
    "quotient": (
        "jet_quotient({0}, {1}, {2}, {3}, {y}, k)",
        "pair_quotient({v0}[k], {1}, {c0}, {2}, {c1}, {3}, {v3}, {y}, {vy}, k)",
    ),
    "turns": ("jet_turns({0}, {1}, {2}, j->time_rest, k)", "pair_turns({0}, {c0}, {c1}, {2}, {v2}, j->time_rest, k)"),
    "angle": ("jet_angle({0}, {1}, {2}, j->time_rest, k)", "pair_angle({0}, {c0}, {c1}, {2}, {v2}, j->time_rest, k)"),
    "sin": ("jet_sin({0}, {1}, k)", "pair_product({1}, {v0}, k)"),
    "cos": ("jet_cos({0}, {1}, k)", "-pair_product({1}, {v0}, k)"),
    "sin_phase": ("jet_sin_phase({0}, {1}, &j->wave, k)", "pair_phase({1}, {v0}, k)"),
    "cos_phase": ("jet_cos_phase({0}, {1}, &j->wave, k)", "-pair_phase({1}, {v0}, k)"),
    "sinh": ("jet_sinh({0}, {1}, k)", "pair_product({1}, {v0}, k)"),
    "cosh": ("jet_cosh({0}, {1}, k)", "pair_product({1}, {v0}, k)"),
    "tanh": ("jet_tanh({0}, {1}, k)", "{v0}[k] - pair_product({1}, {v0}, k)"),
}
# those that are affine in the states, in harmonics of the time and in what else z of step/linear.c holds
_LINEAR = ("turns", "angle", "sin_phase", "cos_phase")


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
class Slots:
    """Names of new series, ``j->w[0]``, ``j->w[1]``, ..., over all functions of one model.

    ``harmonics``: phase, sine and cosine of each; ``bent``: some series is neither of these nor a sum.
    ``seen``: series whose coefficients tell all; ``moving``: inertia depends on more than parameters (``discs.py``).
    """

    moving: bool = False
    used: int = 0
    reciprocals: int = 0
    harmonics: list[tuple[str, str, str]] = field(default_factory=list)
    bent: bool = False
    linear: bool = False
    driving: tuple[tuple[str, str, str], ...] = ()
    seen: set[str] = field(default_factory=set)

    def freeze(self) -> None:
        """What is made from here on are outputs, which no motion reads."""
        self.linear, self.driving = not self.bent, tuple(self.harmonics)

    def new(self) -> str:
        """The next name."""
        self.used += 1
        return f"j->w[{self.used - 1}]"

    def square(self) -> str:
        """The name of the square of one more reciprocal, which only its variation reads."""
        self.reciprocals += 1
        return f"l->square[{self.reciprocals - 1}]"


class Recurrences:
    """The body of one C function that computes order k of some series.

    Args:
        series: C name of the series that a symbol (or a whole expression computed elsewhere) stands for.
        constants, slots: of the model, shared by its functions.
        rooted: what roots are taken of, of a series that may begin with zeros; sums and products by powers above 1.
    """

    def __init__(
        self,
        series: Mapping[sympy.Basic, str],
        constants: Constants,
        slots: Slots,
        rooted: Collection[sympy.Basic] = (),
    ) -> None:
        self.lines: list[str] = []
        self.variations = Variations()
        self.discs = Discs(slots.seen, slots.moving)
        self._constants = constants
        self._slots = slots
        self._rooted = rooted
        self._forms = {symbol: _alone(name) for symbol, name in series.items()}
        self._variable = {s for s in self._forms if s.is_Symbol}
        self._nodes: dict[tuple[str, ...], str] = {}

    def assign(self, target: str, expression: Expr) -> None:
        """Add the line that sets coefficient k of the series ``target`` to that of the expression."""
        self._set(target, self._affine(sympy.sympify(expression)))

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
            return self._node("exp", self._series(self._affine(e.args[0])))
        if e.func is sympy.log:
            return self._node("log", self._series(self._affine(e.args[0])))
        if e.func in (sympy.sin, sympy.cos, sympy.sinh, sympy.cosh):
            return self._pair(e)
        if e.func is sympy.tan:
            return self._affine(sympy.Mul(sympy.sin(e.args[0]), 1 / sympy.cos(e.args[0]), evaluate=False))
        if e.func is sympy.tanh:
            return self._tanh(self._series(self._affine(e.args[0])))
        if e.func is sympy.atan:
            argument = self._series(self._affine(e.args[0]))
            return self._node("atan", argument, self._name("square", argument))
        raise StickslipError(unsupported(e))

    def _sum(self, summands: list[tuple[Expr, Affine]]) -> Affine:
        constant = sympy.Add(*(factor * form.constant for factor, form in summands))
        terms: dict[str, Expr] = {}
        for factor, form in summands:
            for series, coefficient in form.terms.items():
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

    def _times(self, a: Affine, b: Affine, variation: str = "") -> Affine:
        if not a.terms:
            return self._sum([(a.constant, b)])
        if not b.terms:
            return self._sum([(b.constant, a)])
        (ca, sa), (cb, sb) = self._multiple(a), self._multiple(b)
        if sa == sb:
            return self._sum([(ca * cb, self._node("square", sa))])
        return self._sum([(ca * cb, self._node("product", sa, sb, variation=variation))])

    def _quotient(self, a: Affine, b: Affine) -> Affine:
        if not b.terms:
            return self._sum([(1 / b.constant, a)])
        if b.single:
            name, factor = b.single
            constants = b.constant, factor
        else:
            name, constants = self._series(b), (sympy.S.Zero, _ONE)
        denominator = (*map(self._text, constants), name)
        if not a.terms:
            return self._sum([(a.constant, self._node("reciprocal", *denominator, constants=constants))])
        factor, numerator = self._multiple(a)
        return self._sum([(factor, self._node("quotient", numerator, *denominator, constants=constants))])

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
            by_base = f"{float(exponent)!r} * pair_product({{0}}, {{v1}}, k)"
            return self._times(even, self._affine(base), by_base) if exponent % 2 else even
        if base in self._rooted and not base.is_Symbol and exponent.is_Rational and exponent > 1:
            return self._node("lifted", self._series(self._affine(base)), self._text(exponent))
        if exponent == _HALF:
            return self._node("root" if base in self._rooted else "sqrt", self._series(self._affine(base)))
        if exponent.is_Rational and exponent.q == 2:
            power, root = self._affine(sympy.Pow(base, exponent - _HALF)), self._affine(sympy.sqrt(base))
            by_base = (
                "1.5 * pair_product({1}, {v0}, k)" if exponent - _HALF == 1 and self._multiple(power)[0] == 1 else ""
            )
            return self._times(power, root, by_base)
        argument = self._series(self._affine(base))
        return self._node("power", argument, self._text(exponent), constants=(exponent,))

    def _phase(self, angle: Expr) -> str | None:
        """Series of an angle that grows in proportion to time, reduced exactly, however large; None for others."""
        if angle.free_symbols & self._variable != {TIME}:
            return None
        rate = sympy.diff(angle, TIME)
        if rate.has(TIME) or rate.free_symbols & set(self._constants.held):
            return None
        offset = sympy.expand(angle - rate * TIME)
        frequency = rate / (2 * sympy.pi)
        turns = not frequency.has(sympy.pi)
        name, value = ("turns", frequency) if turns else ("angle", rate)
        operands = self._text(value), self._text(offset), self._series(self._forms[TIME])
        return self._name(name, *operands, constants=(value, offset))

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
            self._compute(s, f"sin{kind}", (argument, c))
            self._compute(c, f"cos{kind}", (argument, s))
            if phase:
                self._slots.harmonics.append((phase, s, c))
        return _alone(self._nodes[sine if e.func in (sympy.sin, sympy.sinh) else cosine])

    def _tanh(self, argument: str) -> Affine:
        """Hyperbolic tangent, which needs the lower orders of its own square."""
        key = ("tanh", argument)
        if key not in self._nodes:
            tanh, square = self._slots.new(), self._slots.new()
            self._nodes |= {key: tanh, ("square", tanh): square}
            self._compute(tanh, "tanh", (argument, square))
            self._compute(square, "square", (tanh,))
        return _alone(self._nodes[key])

    def _node(self, name: str, *operands: str, constants: tuple[Expr, ...] = (), variation: str = "") -> Affine:
        """The series that a recurrence computes; one that is known to vary in a shorter way says how."""
        return _alone(self._name(name, *operands, constants=constants, variation=variation))

    def _name(self, name: str, *operands: str, constants: tuple[Expr, ...] = (), variation: str = "") -> str:
        key = (name, *operands)
        if key not in self._nodes:
            self._nodes[key] = self._slots.new()
            self._compute(self._nodes[key], name, operands, constants, variation)
        return self._nodes[key]

    def _compute(
        self, y: str, name: str, operands: tuple[str, ...], constants: tuple[Expr, ...] = (), shorter: str = ""
    ) -> None:
        value, variation = _RECURRENCES[name]
        self._slots.bent |= name not in _LINEAR
        self.discs.image(y, name, operands)
        self.lines.append(f"{y}[k] = {value.format(*operands, y=y)};")
        changes = {f"v{i}": varied(operand) for i, operand in enumerate(operands)}
        changes |= {f"c{i}": self._change(constant) for i, constant in enumerate(constants)}
        if name == "reciprocal":
            remembered = any(self._constants.by_memories(constant) for constant in constants)
            changes |= {"square": self._slots.square(), "moved": "1" if remembered else "l->moved"}
        self.variations.add(varied(y), (shorter or variation).format(*operands, y=y, vy=varied(y), **changes))

    def _change(self, constant: Expr) -> str:
        """C code of the variation of a constant."""
        changes = [self._constants.by_parameters(constant), self._constants.by_memories(constant)]
        return " + ".join(change for change in changes if change) or "PAIR_ZERO"

    def _set(self, target: str, form: Affine) -> None:
        """The line that sets coefficient k of a series to that of a form, and that of its variation."""
        self.lines.append(f"{target}[k] = {self._coefficient(form)};")
        self.discs.sum(target, {series: self._text(factor) for series, factor in form.terms.items()})
        always = [self._signed_term(factor, f"{varied(series)}[k]") for series, factor in form.terms.items()]
        moved: list[tuple[str, str]] = []
        for series, factor in (*form.terms.items(), ("", form.constant)):
            sign, size = ("-", -factor) if is_negative(factor) else ("+", factor)
            for terms, change in (
                (always, self._constants.by_memories(size)),
                (moved, self._constants.by_parameters(size)),
            ):
                if change:
                    terms.append((sign, f"({change}) * {series}[k]" if series else f"(k == 0 ? {change} : PAIR_ZERO)"))
        self.variations.add(varied(target), _summed(always) or "PAIR_ZERO", _summed(moved))

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
        key = ("", self._coefficient(form))
        if key not in self._nodes:
            self._nodes[key] = self._slots.new()
            self._set(self._nodes[key], form)
        return self._nodes[key]

    def _coefficient(self, form: Affine) -> str:
        """C code of coefficient k of the form."""
        summands = [self._signed_term(factor, f"{series}[k]") for series, factor in form.terms.items()]
        if form.constant != 0:
            sign, text = self._signed(form.constant)
            summands.append((sign, f"(k == 0 ? {text} : 0.0)"))
        return _summed(summands) or "0.0"

    def _signed_term(self, factor: Expr, series: str) -> tuple[str, str]:
        sign, text = self._signed(factor)
        return sign, series if text == "1.0" else f"{text} * {series}"

    def _signed(self, value: Expr) -> tuple[str, str]:
        if is_negative(value):
            return "-", self._text(-value)
        return "+", self._text(value)

    def _text(self, value: Expr) -> str:
        return self._constants.text(value)


def _alone(series: str) -> Affine:
    return Affine(sympy.S.Zero, {series: _ONE})


def _summed(summands: list[tuple[str, str]]) -> str:
    """The sum of texts with their signs; those with a minus last, so that it does not begin with one needlessly."""
    text = "".join(f" {sign} {term}" for sign, term in sorted(summands, key=lambda summand: summand[0] == "-"))
    return text.removeprefix(" + ").replace(" - ", "-", 1) if text.startswith(" - ") else text.removeprefix(" + ")
