"""Forty systems of the literature: each runs as its scene says, and what their scenes know is computed here anew.

Values that a scene calls "computed" are those of the functions below: other programs of the same equations, in mpmath
with 30 digits, in closed form, or by SciPy's DOP853 from event to event.
"""

from __future__ import annotations

from collections.abc import Callable

import mpmath as mp
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.optimize import root, root_scalar
from some_nightly import some_nightly

from fmu_models.base import shipped
from fmu_models.fmu.fmu import Fmu
from fmu_models.scene.compute import compare, compute
from fmu_models.scene.read import read_scene
from fmu_models.scene.reduce import built_scene

DAILY = ("circle_map", "henon_attractor")
SCENES = shipped.files(shipped.LITERATURE)


def eigenvalues(jacobian) -> list[float]:
    """Largest modulus first."""
    return sorted(mp.eig(mp.matrix(jacobian), left=False, right=False), key=lambda z: -abs(z))


def ikeda() -> dict[str, float]:
    """The map in complex numbers."""

    def step(x, y):
        z = mp.mpc(x, y)
        z = 1 + mp.mpf("0.9") * z * mp.exp(1j * (mp.mpf("0.4") - 6 / (1 + abs(z) ** 2)))
        return z.real, z.imag

    point = mp.findroot(lambda x, y: [a - b for a, b in zip(step(x, y), (x, y), strict=True)], (0.53, 0.25))
    slopes = [[mp.diff(lambda *p, i=i: step(*p)[i], tuple(point), by) for by in ((1, 0), (0, 1))] for i in (0, 1)]
    return {"x": point[0], "y": point[1], "multiplier1_real": eigenvalues(slopes)[0].real}


def nordmark() -> dict[str, float]:
    """Two free steps, one impact: root of one equation for the depth x of the impact."""
    alpha, gamma, tau2, rho = map(mp.mpf, ("0.65", "0.05", "0.9", "0.12"))

    def after(x, y):
        x, y = -mp.sqrt(x) + y + rho, -gamma * tau2 * x
        for _ in range(2):
            x, y = alpha * x + y + rho, -gamma * x
        return x, y

    depth, second = mp.findroot(lambda x, y: [after(x, y)[0] - x, after(x, y)[1] - y], (0.114, 0.001))
    free = mp.matrix([[alpha, 1], [-gamma, 0]])
    slopes = free * free * mp.matrix([[-1 / (2 * mp.sqrt(depth)), 1], [-gamma * tau2, 0]])
    return {"x_min": -mp.sqrt(depth) + second + rho, "x_max": depth, "multiplier1_real": eigenvalues(slopes)[0].real}


def tinkerbell() -> dict[str, float]:
    a, b, c, d = map(mp.mpf, ("0.9", "-0.6013", "2", "0.5"))
    x, y = mp.findroot(
        lambda x, y: [x * x - y * y + (a - 1) * x + b * y, 2 * x * y + c * x + (d - 1) * y], (1.03, -1.32)
    )
    largest = eigenvalues([[2 * x + a, b - 2 * y], [2 * y + c, 2 * x + d]])[0]
    return {"x": x, "y": y, "multiplier1_real": largest.real}


def flow(rates, start, length):
    """DOP853 with the derivative by the start, of complex steps; the solution as a function of time, the derivative."""
    n = len(start)

    def both(t, y):
        x, slopes = y[:n], y[n:].reshape(n, n)
        steps = [rates(t, x + 1e-30j * e).imag / 1e-30 for e in np.eye(n)]
        return np.concatenate([rates(t, x), (np.stack(steps, axis=1) @ slopes).ravel()])

    y = np.concatenate([start, np.eye(n).ravel()])
    run = solve_ivp(both, (0.0, length), y, method="DOP853", rtol=1e-13, atol=1e-14, dense_output=True)
    return run.sol, run.y[n:, -1].reshape(n, n)


def cycle(rates, start, length, *, forced: bool = False):
    """Newton's method on x(T) = x, and on T where nothing forces it: period, extremes and multipliers."""
    x = np.array(start, float)
    for _ in range(8):
        run, slopes = flow(rates, x, length)
        n, end = len(x), run(length)[: len(x)]
        matrix, miss = slopes - np.eye(n), end - x
        if not forced:
            matrix = np.block([[matrix, rates(0.0, end)[:, None]], [rates(0.0, x), 0.0]])
            miss = np.append(miss, 0.0)
        move = np.linalg.solve(matrix, -miss)
        x, length = x + move[:n], length if forced else length + move[n]
    run, slopes = flow(rates, x, length)
    times = np.linspace(0.0, length, 4001)
    values: dict[str, float] = {"period": length}
    for i in range(len(x)):
        samples = run(times)[i]
        for side, sign in (("min", 1.0), ("max", -1.0)):
            t = times[(sign * samples).argmin()]
            near = {"bracket": (t - length / 4000, t + length / 4000), "xtol": 1e-15}
            top = root_scalar(lambda t, i=i: rates(t, run(t % length)[: len(x)])[i], **near).root
            values[f"{i}_{side}"] = run(top % length)[i]
    order = sorted(np.linalg.eigvals(slopes), key=lambda m: -abs(m))
    values |= {f"multiplier{i}_real": m.real for i, m in enumerate(order, 1)}
    return values | {str(i): value for i, value in enumerate(x)}


def named(values, *states: str, only: str) -> dict[str, float]:
    """Those that are asked for, states by their names."""
    numbers = {state: str(i) for i, state in enumerate(states)}
    return {name: values["_".join([numbers.get(p, p) for p in name.split("_")])] for name in only.split()}


def lorenz() -> dict[str, float]:
    def rates(t, x):
        return np.array([10 * (x[1] - x[0]), x[0] * (28 - x[2]) - x[1], x[0] * x[1] - 8 / 3 * x[2]])

    start = (-13.763610682134, -19.578751942452, 27.0)
    return named(cycle(rates, start, 1.5586522107162), *"xyz", only="multiplier1_real z_max")


def van_der_pol() -> dict[str, float]:
    values = cycle(lambda t, x: np.array([x[1], (1 - x[0] ** 2) * x[1] - x[0]]), (2.0, 0.0), 6.66)
    return named(values, only="multiplier2_real")


def fitzhugh_nagumo() -> dict[str, float]:
    def rates(t, x):
        return np.array([x[0] - x[0] ** 3 / 3 - x[1] + 0.5, 0.08 * (x[0] + 0.7 - 0.8 * x[1])])

    return named(cycle(rates, (1.8, 0.4), 39.5), *"vw", only="period v_max v_min")


def rossler() -> dict[str, float]:
    def rates(t, x):
        return np.array([-x[1] - x[2], x[0] + 0.2 * x[1], 0.2 + x[2] * (x[0] - 5.7)])

    return named(cycle(rates, (0.0, 6.0917683, 1.2997319), 5.881), *"xyz", only="x_max")


def ueda() -> dict[str, float]:
    def rates(t, x):
        return np.array([x[1], 7.5 * np.cos(t) - 0.05 * x[1] - x[0] ** 3])

    return named(cycle(rates, (2.27, -0.26), 2 * np.pi, forced=True), *"xv", only="x v multiplier1_real")


def duffing() -> dict[str, float]:
    def rates(t, x):
        return np.array([x[1], 0.1 * np.cos(t) - 0.25 * x[1] + x[0] - x[0] ** 3])

    return named(cycle(rates, (1.1, 0.03), 2 * np.pi, forced=True), *"xv", only="x v")


def brusselator() -> dict[str, float]:
    def rates(t, x):
        return np.array([1 + x[0] ** 2 * x[1] - 4 * x[0], 3 * x[0] - x[0] ** 2 * x[1]])

    return named(cycle(rates, (1.23, 4.23), 7.16), *"xy", only="period x_max multiplier2_real")


def chua() -> dict[str, float]:
    """Of two linear pieces: exponentials from plane to plane, closed by a root for three times and a point."""
    alpha, beta, m0, m1 = 8.0, 100 / 7, -1 / 7, 2 / 7

    def piece(slope, push):
        """Exact motion of (x, y, z, 1)."""
        matrix = np.zeros((4, 4))
        matrix[:3, :3] = [[-alpha * slope, alpha, 0], [1, -1, 1], [0, -beta, 0]]
        matrix[0, 3] = -alpha * push
        return matrix

    outer, inner = piece(m1, m0 - m1), piece(m0, 0.0)

    def path(unknown):
        out, into, y, z = unknown
        beyond = expm(outer * out) @ [1.0, y, z, 1.0]
        return beyond, expm(inner * into) @ beyond

    def misses(unknown):
        beyond, end = path(unknown)
        return [beyond[0] - 1.0, end[0] - 1.0, end[1] - unknown[2], end[2] - unknown[3]]

    found = root(misses, [1.3, 0.95, 0.3, -0.6], tol=1e-15).x
    values = {"period": found[0] + found[1]}
    for name, matrix, begin, length in (
        ("x_max", outer, [1.0, *found[2:], 1.0], found[0]), ("x_min", inner, path(found)[0], found[1])
    ):  # fmt: skip
        rate = lambda t, matrix=matrix, begin=begin: (matrix @ expm(matrix * t) @ begin)[0]  # noqa: E731
        top = root_scalar(rate, bracket=(1e-3, length - 1e-3), xtol=1e-15).root
        values[name] = (expm(matrix * top) @ begin)[0]
    return values


def thomas() -> dict[str, float]:
    """At x = y = z, sin x = b x, with eigenvalues -b + cos x times roots of 1: those that are complex cross there."""
    x = mp.findroot(lambda x: mp.tan(x) + x / 2, 2.3)
    return {"Hopf_1": mp.sin(x) / x}


def lotka_volterra() -> dict[str, float]:
    """The time by y on both sides of its mean, from y - ln y = 3 - ln 2 - x + ln x, over x = m + r sin u."""
    least = -mp.lambertw(-2 * mp.exp(-2), 0)
    middle, radius = (2 + least) / 2, (2 - least) / 2

    def rate(u):
        """dt/du of both sides."""
        x = middle + radius * mp.sin(u)
        depth = -mp.exp(-(3 - mp.log(2) - x + mp.log(x)))
        sides = [-mp.lambertw(depth, k).real for k in (0, -1)]
        return sum(radius * mp.cos(u) / (x * abs(1 - y)) for y in sides)

    return {
        "period": mp.quad(rate, [-mp.pi / 2, 0, mp.pi / 2], method="gauss-legendre"),
        "x_min": least,
        "x_max": 2,
        "y_min": least,
    }


COMPUTED: dict[str, Callable[[], dict[str, float]]] = {
    function.__name__: function
    for function in (
        *(ikeda, nordmark, tinkerbell, lorenz, van_der_pol, fitzhugh_nagumo, rossler, ueda, duffing, brusselator),
        *(chua, thomas, lotka_volterra),
    )
}


@pytest.mark.parametrize("path", some_nightly(SCENES, [p for p in SCENES if p.stem in DAILY]), ids=lambda p: p.stem)
def test_a_scene_meets_what_is_known(path):
    scene = read_scene(path)
    comparisons = compare(scene, compute(scene, Fmu.open(built_scene(scene))))
    assert len({(c.name, c.at) for c in comparisons}) >= 2
    for comparison in comparisons:
        assert comparison.passed, comparison


@pytest.mark.parametrize("name", COMPUTED)
def test_computed_values_are_those_of_another_program(name):
    with mp.workdps(30):
        values = COMPUTED[name]()
    (known,) = [r for r in read_scene(name).references if r.source.startswith("computed")]
    assert known.values == pytest.approx({n: float(value) for n, value in values.items()}, rel=known.tolerance)


def test_each_system_is_short_and_says_where_it_comes_from():
    for path in SCENES:
        scene = read_scene(path)
        assert scene.source and all(reference.source for reference in scene.references), path.stem
    for path in shipped.files(shipped.LITERATURE, ".py"):
        docstring, code = path.read_text("utf-8").rsplit('"""\n', 1)
        assert "Source: " in docstring, path.stem
        lines = [line for line in code.splitlines() if line and not line.startswith(("import", "from"))]
        assert len(lines) <= 20, (path.stem, len(lines))
        assert (path.with_suffix(".toml")) in SCENES
