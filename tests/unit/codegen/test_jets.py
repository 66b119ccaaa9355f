"""Taylor recurrences of generated code against mpmath's Taylor coefficients of the same expressions in 50 digits."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest
import sympy
from compiled_model import CompiledModel
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from fmu_models.base.errors import StickslipError
from fmu_models.codegen.c_source import sources
from fmu_models.language.declaration import Output
from fmu_models.language.mechanism import Mechanism
from fmu_models.language.quantities import TIME, Coordinate, Input, Parameter
from fmu_models.lowering.lower import lower
from fmu_models.oscillators import load

ORDER = 12
# rounding of some tens of operations on numbers of order one
TOLERANCE = 1e-12

m = Parameter("m", 1.25, "1", "mass", positive=True)
e = Parameter("e", 0.7, "1", "exponent")
u = Input("u", 0.3, "1", "input")
x = Coordinate("x", "1", "coordinate")
v = x.v


def expression_model(expressions: list[sympy.Expr]) -> CompiledModel:
    """A mass whose outputs are the expressions."""
    outputs = [Output(f"y{i}", expression, "1", "expression") for i, expression in enumerate(expressions)]
    return CompiledModel(
        Mechanism(
            name="expressions",
            title="expressions",
            source="test",
            coordinates=[x],
            kinetic_energy=m * v**2 / 2,
            potential_energy=e * u * x**2,
            outputs=outputs,
        )
    )


def function_body(text: str, name: str) -> str:
    """The text of one function of model.c."""
    start = text.index(f"void model_{name}(")
    return text[start : text.index("\n}", start)]


def paths() -> dict[sympy.Symbol, list[float]]:
    """Polynomials in time along which the expressions are expanded; values near one, an input with a slope."""
    rng = np.random.default_rng(7)
    decay = 0.6 ** np.arange(ORDER + 1)
    coefficients: dict[sympy.Symbol, list[float]] = {q: list(rng.uniform(-1, 1, ORDER + 1) * decay) for q in (x, v)}
    coefficients[x][0], coefficients[v][0] = 0.8, -0.6
    coefficients[u] = [0.3, 0.4] + [0.0] * (ORDER - 1)
    coefficients[TIME] = [0.2, 1.0] + [0.0] * (ORDER - 1)
    return coefficients


def computed(model: CompiledModel, count: int) -> np.ndarray:
    """Coefficients of the first outputs, (count, ORDER + 1)."""
    for symbol, (kind, i) in {x: ("x", 0), v: ("x", 1), u: ("u", 0), TIME: ("t", 0)}.items():
        series = model.series(kind, i)
        series[:] = 0.0
        series[: ORDER + 1] = paths()[symbol]
    for k in range(ORDER + 1):
        model.order(k)
    return np.array([model.series("y", i)[: ORDER + 1] for i in range(count)])


def reference(expression: sympy.Expr) -> list[float]:
    """Taylor coefficients by mpmath, which knows nothing of recurrences."""
    symbols = [x, v, u, TIME, m, e]
    function = sympy.lambdify(symbols, expression, modules="mpmath")
    with mpmath.workdps(50):
        polynomials = [[mpmath.mpf(c) for c in reversed(paths()[s])] for s in (x, v, u, TIME)]

        def along(time):
            return function(*(mpmath.polyval(c, time) for c in polynomials), mpmath.mpf(m.value), mpmath.mpf(e.value))

        return [float(c) for c in mpmath.taylor(along, 0, ORDER)]


def assert_agrees(expressions: list[sympy.Expr]) -> None:
    found = computed(expression_model(expressions), len(expressions))
    for expression, row in zip(expressions, found, strict=True):
        expected = np.array(reference(expression))
        size = np.maximum.accumulate(np.abs(expected))
        assert np.all(np.abs(row - expected) <= TOLERANCE * size), f"{expression}: {row} instead of {expected}"


EVERY_OPERATION = [
    sympy.Integer(3) + 0 * x,
    m * x - 2 * v + 3 * u - TIME / 3 + e,
    x * v,
    (1 + x) * (2 - v) * u,
    x**2,
    (x - v) ** 3,
    x**7,
    1 / (1 + m * x),
    1 / (1 + m * x + v**2),
    m / x,
    (1 + v) / (3 + x),
    x * v / ((2 + x) * (3 + v)),
    1 / x**2,
    v / x**3,
    sympy.sqrt(x),
    sympy.sqrt(1 + v**2),
    x ** sympy.Rational(3, 2),
    1 / sympy.sqrt(x),
    x**e,
    (1 + v**2) ** 0.3,
    x**-0.5,
    x**2.0,
    (TIME - sympy.Float(0.2)) ** 2.0,  # a base that is zero
    (TIME - sympy.Float(0.2)) ** 3 + x,
    m**x,
    x**v,
    sympy.exp(x),
    sympy.exp(-(v**2)),
    sympy.log(x),
    sympy.log(2 + v) * m,
    sympy.sin(x),
    sympy.cos(x) * sympy.sin(x) + sympy.cos(x),
    sympy.sin(TIME * e) * u,
    sympy.tan(v),
    sympy.sinh(v) - sympy.cosh(v) * x,
    sympy.tanh(x) + sympy.tanh(x) ** 2,
    sympy.atan(m * v) + sympy.atan(x),
    sympy.sqrt(2) * sympy.pi * x,
    sympy.sin(m) * x + sympy.cos(sympy.exp(e)) * v,
]


def test_every_operation_has_the_right_taylor_coefficients():
    assert_agrees(EVERY_OPERATION)


def expressions() -> st.SearchStrategy[sympy.Expr]:
    """Smooth expressions that stay of order one: denominators, roots and logarithms see 1 + (...)^2."""
    leaves = st.sampled_from([x, v, u, TIME, m, e, sympy.Integer(2), sympy.Rational(1, 3)])

    def above(inner: st.SearchStrategy[sympy.Expr]) -> st.SearchStrategy[sympy.Expr]:
        pair = st.tuples(inner, inner)
        return st.one_of(
            pair.map(lambda p: p[0] + p[1]),
            pair.map(lambda p: p[0] * p[1]),
            pair.map(lambda p: p[0] / (1 + p[1] ** 2)),
            inner.map(lambda a: -a / (1 + a**2) ** 2),
            inner.map(lambda a: sympy.sqrt(1 + a**2)),
            inner.map(lambda a: (1 + a**2) ** e),
            inner.map(lambda a: sympy.log(1 + a**2)),
            inner.map(lambda a: sympy.exp(-(a**2))),
            inner.map(sympy.sin),
            inner.map(sympy.cos),
            inner.map(sympy.tanh),
            inner.map(sympy.atan),
        )

    return st.recursive(leaves, above, max_leaves=6)


# every example is compiled: few of them, with many expressions each
@settings(max_examples=8, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow])
@given(st.lists(expressions(), min_size=8, max_size=12))
def test_random_expressions_have_the_right_taylor_coefficients(drawn):
    assert_agrees(drawn)


@pytest.mark.parametrize(
    "wrong",
    [abs(x), sympy.sign(v), sympy.Max(x, 0), sympy.besselj(1, x), abs(e) * x, sympy.I * x, sympy.zoo * x],
    ids=str,
)
def test_what_is_not_smooth_or_real_is_refused_with_a_lesson(wrong):
    with pytest.raises(StickslipError, match="cannot be turned into code"):
        expression_model([wrong])


def test_shared_operations_are_computed_once():
    model = expression_model([x * v, 2 * x * v + 1, sympy.sin(x) + x * v, sympy.cos(x), 1 / (1 + x), 3 / (1 + x)])
    body = function_body(model.sources["model_kind.c"], "outputs")
    assert [body.count(name) for name in ("jet_product(j->x[0], j->x[1]", "jet_sin", "jet_cos", "jet_reciprocal")] == [
        1,
        1,
        1,
        1,
    ]


def test_conti_costs_one_quotient_per_disc_and_nothing_else():
    text = sources(lower(load("disc_rig")))["model_kind.c"]
    motion = text.replace(function_body(text, "outputs"), "")
    assert motion.count("jet_reciprocal(") == 2
    assert motion.count("jet_") == 2
    assert "pow(" not in text


def test_a_slip_speed_is_one_line():
    text = sources(lower(load("disc_rig")))["model_kind.c"]
    assert "    j->slip[0][k] = p[4] * j->u[0][k] - p[3] * j->x[1][k];\n" in text
