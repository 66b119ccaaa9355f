"""Every friction law, by its declaration alone; a new one is found by itself.

A law is taken as a contact takes it: ``LAW.around(...)`` of Conti's law, its parameters at their declared defaults.
"""

from __future__ import annotations

from dataclasses import fields, is_dataclass, replace
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import mpmath
import numpy as np
import pytest
import sympy
from compiled_model import CompiledModel

from fmu_models.base.errors import StickslipError
from fmu_models.codegen.law_functions import NotACoefficientError
from fmu_models.language.friction import Friction
from fmu_models.language.law_parameter import declared_in
from fmu_models.language.laws import LAWS
from fmu_models.language.laws.conti import Conti
from fmu_models.language.mechanism import Mechanism
from fmu_models.language.quantities import TIME, Coordinate, Parameter
from fmu_models.scene.read import read_scene
from identification.fit.fit import fit_friction
from identification.laws import find_law
from identification.laws.law import FittableLaw
from identification.measurement.pooling import pool
from rig_io.bench.emulation import Disc, Emulation
from rig_io.bench.emulator import emulate

# a stop pushes along its depth; what a stop's law must do is in tests/unit/lowering/test_stops.py
STOPS = ("kelvin_voigt", "lankarani_nikravesh")
NAMES = [name for name in LAWS.names() if name not in STOPS]

N = Parameter("N", 4.905, "N", "normal force", positive=True)
m = Parameter("m", 1.25, "kg", "mass", positive=True)
x = Coordinate("x", "m", "displacement", velocity="v")
SPEEDS = (1e-6, 1e-3, 0.05, 0.3, 1.0, 5.0)  # m/s
ORDER = 10


@pytest.fixture(scope="module", params=NAMES)
def name(request: pytest.FixtureRequest) -> str:
    """Of a law, as ``LAWS`` has it."""
    return request.param


@pytest.fixture(scope="module")
def law(name: str) -> Any:
    """The law in a contact."""
    return LAWS.load(name).around(Conti.around(SimpleNamespace(N=N)))


@pytest.fixture(scope="module")
def fitted(name: str) -> FittableLaw:
    """The law as a fit takes it."""
    try:
        return find_law(name)
    except NotACoefficientError as error:
        pytest.skip(str(error))


def mechanism(law: Any) -> Mechanism:
    """A mass that slides."""
    return Mechanism(
        name="pad",
        title="pad",
        source="test",
        coordinates=[x],
        kinetic_energy=m * x.v**2 / 2,
        potential_energy=sympy.S.Zero,
        contacts=[Friction(name="pad", slip=x.v, law=law)],
    )


def defaults(law: Any) -> dict[sympy.Symbol, float]:
    """Values of its parameters."""
    pad = mechanism(law)
    return {symbol: symbol.value for symbol in (*pad.parameters, *pad.inputs)}


def at_rest(law: Any, slip: float, sign: float) -> dict[sympy.Symbol, float]:
    """States of the law in steady slip."""
    values = defaults(law)
    rates = [rate.xreplace(values) for rate in law.rates(sympy.Float(slip), sympy.Float(sign))]
    solutions = [sympy.solve(rate, state) for state, rate in zip(law.states, rates, strict=True)]
    # a clock of the stick stands still
    return {state: max(map(float, found), default=0.0) for state, found in zip(law.states, solutions, strict=True)}


def steady(law: Any, slip: float) -> float:
    """Force, N, in steady slip."""
    sign = float(np.sign(slip))
    force = sympy.sympify(law.force(sympy.Float(slip), sympy.Float(sign)))
    return float(force.xreplace(defaults(law) | at_rest(law, slip, sign)))


def test_friction_opposes_slip_and_is_odd(law: Any) -> None:
    for speed in SPEEDS:
        force = steady(law, speed)
        assert force < 0
        assert steady(law, -speed) == pytest.approx(-force, rel=1e-12)


def test_friction_begins_at_the_capacity_or_at_nothing(law: Any) -> None:
    capacity = float(sympy.sympify(law.capacity).xreplace(defaults(law) | at_rest(law, 1e-15, 1.0)))
    assert capacity > 0
    if not law.sticks and not law.states:
        assert abs(steady(law, 1e-12)) < 1e-6 * capacity
    else:
        assert -steady(law, 1e-15) == pytest.approx(capacity, rel=1e-6)


def test_friction_does_not_drive_however_fast_the_slip(law: Any) -> None:
    v = sympy.Float(1e9)  # m/s: beyond any, and logarithms have not turned yet
    force = -law.magnitude(v) if law.states else law.force(v, sympy.S.One)
    assert sympy.sympify(force).xreplace(defaults(law)) <= 0


def test_defaults_meet_the_requirements_and_lie_in_the_bounds(law: Any) -> None:
    for needed in law.requirements:
        margin = sympy.sympify(needed.expression).xreplace(defaults(law))
        assert margin > 0 if needed.strict else margin >= 0, needed.sentence
    for _, one in declared_in(law):
        assert one.minimum <= one.value <= one.maximum and one.description


def test_units_match_and_no_others_do(law: Any) -> None:
    pad = mechanism(law)
    for symbol in [symbol for symbol, _ in declared_in(law)]:
        wrong = Parameter(symbol.name, symbol.value, f"kg {symbol.unit}", "in another unit")
        with pytest.raises(StickslipError):
            pad.with_law(pad=swapped(law, symbol, wrong))


def test_the_force_may_change_along_the_motion(name: str, law: Any) -> None:
    """What the parameters must satisfy is judged before it, without the factor that changes."""
    swell = 2 + sympy.sin(Parameter("w", 1.0, "rad/s", "angular frequency") * TIME)
    moved = LAWS.load(name).around(Conti.around(SimpleNamespace(N=N * swell)))
    if "a0" in (one.name for one in fields(moved)):
        moved = replace(moved, a0=moved.a0 * swell)
    assert TIME in mechanism(moved).symbols
    assert len(mechanism(moved).all_requirements) == len(mechanism(law).all_requirements)


def swapped(law: Any, old: Any, new: Any) -> Any:
    """The law with another parameter."""
    changes = {}
    for one in fields(law):
        value = getattr(law, one.name)
        if value is old:
            changes[one.name] = new
        elif is_dataclass(value):
            changes[one.name] = swapped(value, old, new)
    return replace(law, **changes)


def test_generated_series_are_the_taylor_coefficients(law: Any) -> None:
    model = CompiledModel(mechanism(law))
    rng = np.random.default_rng(3)
    paths: dict[sympy.Symbol, np.ndarray] = {x.v: 0.4 * rng.uniform(-1, 1, ORDER + 1) * 0.5 ** np.arange(ORDER + 1)}
    paths |= {state: state.nominal * rng.uniform(-1, 1, ORDER + 1) for state in law.states}
    paths |= {state: np.array([abs(first), *rest]) for state, (first, *rest) in paths.items() if state is not x.v}
    paths[x.v][0] = 0.3
    for sign in (1.0, -1.0):
        path = paths | {x.v: sign * paths[x.v]}
        for place, state in enumerate(model.system.states):
            model.series("x", place)[:] = 0.0
            model.series("x", place)[: ORDER + 1] = next((path[q] for q in path if q.name == state.name), 0.0)
        for place, signal in enumerate(model.system.inputs):
            model.series("u", place)[:] = [signal.value, *[0.0] * (len(model.series("u", place)) - 1)]
        for k in range(ORDER + 1):
            model.order(k, signs=[sign])
        expected = np.array(taylor(law, path, sign))
        size = np.maximum.accumulate(np.abs(expected))
        # rounding of some tens of operations
        assert np.all(np.abs(model.series("f")[: ORDER + 1] - expected) <= 1e-12 * size)


def taylor(law: Any, path: dict[sympy.Symbol, np.ndarray], sign: float) -> list[float]:
    """Coefficients of the force along a path by mpmath, which knows nothing of recurrences."""
    values = defaults(law)
    force = sympy.lambdify([*path, *values], law.force(x.v, sympy.Float(sign)), modules="mpmath")
    with mpmath.workdps(50):
        polynomials = [[mpmath.mpf(float(c)) for c in reversed(series)] for series in path.values()]
        numbers = [mpmath.mpf(value) for value in values.values()]
        along = mpmath.taylor(lambda t: force(*(mpmath.polyval(c, t) for c in polynomials), *numbers), 0, ORDER)
        return [float(c) for c in along]


def test_the_coefficient_is_the_force_and_its_gradient_the_derivative(law: Any, fitted: FittableLaw) -> None:
    q = truth(fitted)
    v = sympy.Symbol("v")
    declared = [symbol for symbol, _ in declared_in(law)]
    both = [sympy.sympify(law.towards(v, sympy.Integer(sign))) for sign in (1, -1)]
    symbols = [symbol for symbol in declared if not law.sticks or any(symbol in one.free_symbols for one in both)]
    assert [symbol.name for symbol in symbols] == list(fitted.names)
    speeds = np.array([0.0, *SPEEDS])
    for sign, force in zip((1.0, -1.0), both, strict=True):
        exact = sympy.lambdify([*symbols, v], force.xreplace({N: sympy.S.One}), modules="mpmath")
        check_coefficient(fitted, exact, q, speeds, sign)


def check_coefficient(fitted: FittableLaw, exact: Any, q: np.ndarray, speeds: np.ndarray, sign: float) -> None:
    along = fitted.along(speeds, sign)
    value, gradient = fitted.value(along, q), fitted.gradient(along, q)
    with mpmath.workdps(40):
        point = [mpmath.mpf(float(one)) for one in q]
        for place, speed in enumerate(speeds):
            mu = partial(_at, exact, mpmath.mpf(float(speed)))
            assert value[place] == pytest.approx(float(mu(*point)), rel=1e-14)
            for one in range(len(q)):
                order = tuple(int(one == other) for other in range(len(q)))
                slope = float(mpmath.diff(mu, tuple(point), order))
                # 1 - 1/(1 + p v) at small v: numbers near one are subtracted
                assert gradient[one, place] == pytest.approx(slope, rel=1e-13, abs=2 * np.finfo(float).eps)


def _at(function: Any, speed: Any, *point: Any) -> Any:
    return function(*point, speed)


def truth(law: FittableLaw) -> np.ndarray:
    """Parameters to be found: the defaults, or a little of what is zero by default."""
    return np.array([one.value or 0.2 for one in law.parameters]) * (1 - 0.1 * law.directed * np.arange(len(law.names)))


@pytest.mark.nightly_for(
    "free", "conti_viscous", "stribeck", "ageing", "ruina", "tustin", "directional", "dieterich", "coulomb"
)
def test_a_fit_to_emulated_logs_finds_the_parameters(name: str, fitted: FittableLaw, tmp_path: Path) -> None:
    if not fitted.sticks:
        pytest.skip("its bristles show in stick alone: test_whole_cycle.py fits them")
    values = ", ".join(f"{key}0 = {value}" for key, value in zip(fitted.names, truth(fitted), strict=True))
    path = tmp_path / "rig.toml"
    path.write_text(
        f'title = "rig"\nmodel = "disc_rig"\ncontacts = ["disc0"]\nlaws = {{ disc0 = "{name}" }}\nstop_time = 8\n'
        f"free = {{ {values} }}\ndrives = {{ w0 = 0.83 }}\ncompute = {{ kind = 'trajectory' }}\n",
        encoding="utf-8",
    )
    scene = read_scene(path)
    logs = [
        emulate(
            Emulation(f"{speed:g}", (Disc(drive_speed=speed),), duration=6.0, transient=0.0, scene=scene), 5, number
        )
        for number, speed in enumerate((0.83, 1.4, -0.83, -1.4) if fitted.directed else (0.83, 1.4))
    ]
    estimator = "shooting" if fitted.spans else "weak-form"
    found = fit_friction(pool(logs, allow_no_stick=True), estimator=estimator, law=name)
    for one, true in zip(found.parameters, truth(fitted), strict=True):
        # knots of a curve are where the slips are
        assert fitted.spans or abs(one.value - true) < 5 * one.total_deviation, one
    slip = np.linspace(found.logs[-1].least_slip, found.logs[-1].greatest_slip, 20)
    np.testing.assert_allclose(fitted.value(slip, found.law_values), fitted.value(slip, truth(fitted)), atol=0.01)
