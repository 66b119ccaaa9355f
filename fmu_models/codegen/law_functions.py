"""The steady friction of a law as numpy functions, printed by SymPy from its declaration.

    mu(v; q) = magnitude(|v|)/N,    d mu/d q_i,    and the values q that the declaration warns of

q are the parameters in the order of their fields. Common subexpressions are computed once. The functions of our own
laws are kept in the user's cache as Python text under the hash of the declarations, so that a program that only fits
need not load SymPy.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

from fmu_models.base.cache import cache_folder, digest
from fmu_models.base.errors import StickslipError
from fmu_models.base.files import sealed_text
from fmu_models.base.version import version_of
from fmu_models.language import laws
from fmu_models.language.law_parameter import LawParameter, declared_in

if TYPE_CHECKING:
    import numpy as np
    import sympy


class NotACoefficientError(StickslipError):
    """The friction of a law is no coefficient that its parameters and the slip speed determine."""


@dataclass(frozen=True, eq=False, kw_only=True)
class LawFunctions:
    """The steady friction of a law.

    name: what people call it; reference: what ``language.laws.LAWS`` loads it by; steady: where its steady friction is
    declared, for laws that share it are not told apart by slips; sticks: whether it knows exact stick;
    directed: whether friction depends on the direction of slip;
    spans: the parameter that is the greatest slip speed of logs, of a curve free of any form, "" of others;
    value(v, q): friction coefficients, shape of v (slip speed >= 0, m/s; as `along` makes it), for parameters q (m,);
    gradient(v, q): their derivatives by q, (m, *shape of v);
    linear: of each parameter, whether mu is linear in it and in the other linear ones together;
    warned(q): by how much q meets a requirement of the declaration, and what to say where it does not.
    """

    name: str
    reference: str
    steady: str
    sticks: bool
    directed: bool = False
    spans: str = ""
    parameters: tuple[LawParameter, ...]
    linear: tuple[bool, ...]
    value: Callable[[np.ndarray, np.ndarray], np.ndarray]
    gradient: Callable[[np.ndarray, np.ndarray], np.ndarray]
    warned: Callable[[np.ndarray], Sequence[tuple[float, str]]]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters, in order."""
        return tuple(parameter.name for parameter in self.parameters)

    def along(self, speed: np.ndarray, sign: np.ndarray | float) -> np.ndarray:
        """Slip speeds without sign as ``value`` takes them: with that of the slip, where friction depends on it."""
        import numpy

        return numpy.copysign(speed, sign) if self.directed else speed

    def warnings(self, q: np.ndarray) -> tuple[str, ...]:
        """Sentences about values that no friction law of this form should have."""
        values = dict(zip(self.names, q, strict=True))
        return tuple(sentence.format(law=self.name, **values) for margin, sentence in self.warned(q) if margin < 0)


def law_functions(reference: str) -> LawFunctions:
    """The functions of a law, by its name, file or module.

    Raises:
        NotACoefficientError: its friction is no coefficient.
        StickslipError: there is none, or it fails.
    """
    shipped = own_laws()
    if reference in shipped:
        return shipped[reference]
    law = laws.load(reference)
    with laws.LAWS.running(reference):
        text = _text(reference, law)
    return _run(text)[0]


@cache
def own_laws() -> dict[str, LawFunctions]:
    """The functions of those of our laws that have any, by the names of their files, fewest parameters first."""
    folder = Path(laws.__file__).parents[1]
    sources = [path.read_bytes() for path in (*sorted(folder.rglob("*.py")), Path(__file__))]
    path = cache_folder() / "laws" / f"{digest(*sources, version_of('sympy'))}.py"
    functions = _run(sealed_text(path, lambda: "\n".join(_own_texts())))
    return {law.reference: law for law in sorted(functions, key=lambda law: (len(law.parameters), law.name))}


def _own_texts() -> Iterator[str]:
    for name in laws.LAWS.members():
        with suppress(NotACoefficientError):
            yield _text(name, laws.load(name))


def _run(text: str) -> list[LawFunctions]:
    """The laws that a generated text makes."""
    import numpy

    space: dict[str, Any] = {"numpy": numpy, "inf": math.inf, "made": []}
    space |= {"LawFunctions": LawFunctions, "LawParameter": LawParameter}
    exec(compile(text, "<generated law functions>", "exec"), space)
    return space["made"]


def _text(reference: str, law: type[Any]) -> str:
    """Python text that appends the functions of a law to ``made``. NotACoefficientError: its friction is no
    coefficient."""
    import sympy

    built, N, v = _by_itself(reference, law)
    sign = sympy.Symbol("sign", real=True)
    friction = built.towards(v, sign)
    declared, untold = _fittable(built, v)
    # symbols that print as what the functions are given
    q = {symbol: sympy.Symbol(f"q[{index}]", real=True) for index, (symbol, _) in enumerate(declared)}
    mu = sympy.sympify(friction).xreplace(q).subs(N, 1)
    slopes = [sympy.diff(mu, symbol) for symbol in q.values()]
    shared: Any
    results: Any
    shared, results = sympy.cse([mu, *slopes], symbols=sympy.numbered_symbols("x"))
    value, *gradient = results
    required = [needed for needed in built.requirements if needed.expression.free_symbols <= {*q, N}]
    margins = [_printed(needed.expression.xreplace(q).subs(N, 1)) for needed in required]
    warnings = [needed.warning or f"{needed.sentence}." for needed in required]
    if untold:
        margins.append("-1.0")
        warnings.append(
            f"Steady slip does not tell {' and '.join(untold)} of the {{law}} law: the fitted model has the defaults."
        )
    directed = sign in mu.free_symbols
    head = ["    sign, v = numpy.where(numpy.signbit(v), -1.0, 1.0), numpy.abs(v)"] if directed else []
    return "\n".join(
        [
            "def value(v, q):",
            *head,
            *_assigned(shared, [value]),
            f"    return {_along(value, shared, v)}",
            "def gradient(v, q):",
            *head,
            *_assigned(shared, gradient),
            f"    return numpy.stack([{', '.join(_along(slope, shared, v) for slope in gradient)}])",
            f"warned = lambda q: [{', '.join(f'({m}, {s!r})' for m, s in zip(margins, warnings, strict=True))}]",
            "made.append(LawFunctions(",
            f"    name={getattr(law, 'label', '') or law.__name__!r}, reference={reference!r},",
            f"    steady={law.magnitude.__qualname__!r}, sticks={law.sticks!r}, directed={directed!r},",
            f"    spans={getattr(law, 'spans', '')!r},",
            f"    parameters={tuple(parameter for _, parameter in declared)!r},",
            f"    linear={_linear(mu, tuple(q.values()))!r},",
            "    value=value, gradient=gradient, warned=warned,",
            "))",
            "",
        ]
    )


def _by_itself(reference: str, law: type[Any]) -> tuple[Any, sympy.Symbol, sympy.Symbol]:
    """A law with parameters of its own under a load N at a slip speed v; and both. NotACoefficientError: its friction
    is no coefficient."""
    import sympy

    wrong = f"The law '{reference}' cannot be fitted: "
    if not hasattr(law, "magnitude") or not hasattr(law, "around"):
        raise NotACoefficientError(
            f"{wrong}it declares no steady friction of its own. Copy 'coulomb' for one that does."
        )
    N, v = sympy.Symbol("N", positive=True), sympy.Symbol("v", nonnegative=True)
    built = law.around(SimpleNamespace(N=N))
    force = sympy.sympify(built.magnitude(v))
    if sympy.diff(force, N).has(N) or sympy.simplify(force.subs(N, 0)) != 0:
        raise NotACoefficientError(f"{wrong}its force {force} is not in proportion to the load N.")
    return built, N, v


def _fittable(law: Any, v: sympy.Symbol) -> tuple[list[tuple[Any, LawParameter]], list[str]]:
    """The parameters of a law that are to be fitted; and names of those that slip does not tell.

    What shows in stick alone, of a law that has no exact stick, is for estimators that know it.
    """
    import sympy

    every = tuple(declared_in(law))
    seen = set().union(*(sympy.sympify(law.towards(v, sign)).free_symbols for sign in (1, -1)))
    fitted = [(symbol, parameter) for symbol, parameter in every if symbol in seen or not law.sticks]
    return fitted, [parameter.name for symbol, parameter in every if (symbol, parameter) not in fitted]


def _linear(mu: sympy.Expr, q: Sequence[sympy.Symbol]) -> tuple[bool, ...]:
    """Whether mu is linear in each parameter and in those before that are."""
    import sympy

    linear: list[sympy.Symbol] = []
    for symbol in q:
        slope = sympy.diff(mu, symbol)
        if slope != 0 and all(sympy.diff(slope, earlier) == 0 for earlier in (*linear, symbol)):
            linear.append(symbol)
    return tuple(symbol in linear for symbol in q)


Shared = Sequence[tuple["sympy.Symbol", "sympy.Expr"]]


def _assigned(shared: Shared, results: Sequence[sympy.Expr]) -> list[str]:
    """Statements for the common subexpressions that the results need, in order."""
    needed = set().union(*(result.free_symbols for result in results))
    lines = []
    for symbol, expression in reversed(shared):
        if symbol in needed:
            needed |= expression.free_symbols
            lines.append(f"    {symbol} = {_printed(expression)}")
    return lines[::-1]


def _along(result: sympy.Expr, shared: Shared, v: sympy.Symbol) -> str:
    """A result that has the shape of v, whether v is in it or not."""
    inside = result.free_symbols
    for symbol, expression in reversed(shared):
        if symbol in inside:
            inside |= expression.free_symbols
    return _printed(result) if v in inside else f"numpy.full(numpy.shape(v), float({_printed(result)}))"


def _printed(expression: sympy.Expr) -> str:
    """An expression as text for numpy. StickslipError: numpy has no function for a part of it."""
    from sympy.printing.codeprinter import PrintMethodNotImplementedError
    from sympy.printing.numpy import NumPyPrinter

    try:
        return str(NumPyPrinter({"fully_qualified_modules": True, "strict": True}).doprint(expression))
    except PrintMethodNotImplementedError as error:
        raise StickslipError(f"{expression} cannot be turned into numpy code: {error}.") from error
