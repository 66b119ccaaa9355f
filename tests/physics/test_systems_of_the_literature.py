"""The systems of the literature: each runs as its scene says, and what their scenes know is computed here anew.

Values that a scene calls "computed" are those of the functions below: other programs of the same equations, in mpmath
with 30 digits, in closed form, or by SciPy's DOP853 from event to event.
"""

from __future__ import annotations

from collections.abc import Callable
from inspect import signature
from typing import Any

import mpmath as mp
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.optimize import root, root_scalar
from some_nightly import some_nightly

from fmu_models import Strobe, branch
from fmu_models.base import shipped
from fmu_models.fmu.fmu import Fmu
from fmu_models.maps import MAPS
from fmu_models.oscillators import MODELS
from fmu_models.scene.compute import compare, compute
from fmu_models.scene.read import read_scene
from fmu_models.scene.reduce import built_scene

DAILY = ("circle_map", "henon_attractor", "buck_converter", "disc_brake")
SCENES = shipped.files(shipped.LITERATURE)


def eigenvalues(jacobian) -> list[Any]:
    """Largest modulus first."""
    return sorted(mp.eig(mp.matrix(jacobian), left=False, right=False), key=lambda z: -abs(z))


def ikeda() -> dict[str, Any]:
    """The map in complex numbers."""

    def step(x, y):
        z = mp.mpc(x, y)
        z = 1 + mp.mpf("0.9") * z * mp.exp(1j * (mp.mpf("0.4") - 6 / (1 + abs(z) ** 2)))
        return z.real, z.imag

    point = mp.findroot(lambda x, y: [a - b for a, b in zip(step(x, y), (x, y), strict=True)], (0.53, 0.25))
    slopes = [[mp.diff(lambda *p, i=i: step(*p)[i], tuple(point), by) for by in ((1, 0), (0, 1))] for i in (0, 1)]
    return {"x": point[0], "y": point[1], "multiplier1_real": eigenvalues(slopes)[0].real}


def nordmark() -> dict[str, Any]:
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


def tinkerbell() -> dict[str, Any]:
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
    values: dict[str, Any] = {"period": length}
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


def named(values, *states: str, only: str) -> dict[str, Any]:
    """Those that are asked for, states by their names."""
    numbers = {state: str(i) for i, state in enumerate(states)}
    return {name: values["_".join([numbers.get(p, p) for p in name.split("_")])] for name in only.split()}


def lorenz() -> dict[str, Any]:
    def rates(t, x):
        return np.array([10 * (x[1] - x[0]), x[0] * (28 - x[2]) - x[1], x[0] * x[1] - 8 / 3 * x[2]])

    start = (-13.763610682134, -19.578751942452, 27.0)
    return named(cycle(rates, start, 1.5586522107162), *"xyz", only="multiplier1_real z_max")


def van_der_pol() -> dict[str, Any]:
    values = cycle(lambda t, x: np.array([x[1], (1 - x[0] ** 2) * x[1] - x[0]]), (2.0, 0.0), 6.66)
    return named(values, only="multiplier2_real")


def fitzhugh_nagumo() -> dict[str, Any]:
    def rates(t, x):
        return np.array([x[0] - x[0] ** 3 / 3 - x[1] + 0.5, 0.08 * (x[0] + 0.7 - 0.8 * x[1])])

    return named(cycle(rates, (1.8, 0.4), 39.5), *"vw", only="period v_max v_min")


def rossler() -> dict[str, Any]:
    def rates(t, x):
        return np.array([-x[1] - x[2], x[0] + 0.2 * x[1], 0.2 + x[2] * (x[0] - 5.7)])

    return named(cycle(rates, (0.0, 6.0917683, 1.2997319), 5.881), *"xyz", only="x_max")


def ueda() -> dict[str, Any]:
    def rates(t, x):
        return np.array([x[1], 7.5 * np.cos(t) - 0.05 * x[1] - x[0] ** 3])

    return named(cycle(rates, (2.27, -0.26), 2 * np.pi, forced=True), *"xv", only="x v multiplier1_real")


def duffing() -> dict[str, Any]:
    def rates(t, x):
        return np.array([x[1], 0.1 * np.cos(t) - 0.25 * x[1] + x[0] - x[0] ** 3])

    return named(cycle(rates, (1.1, 0.03), 2 * np.pi, forced=True), *"xv", only="x v")


def brusselator() -> dict[str, Any]:
    def rates(t, x):
        return np.array([1 + x[0] ** 2 * x[1] - 4 * x[0], 3 * x[0] - x[0] ** 2 * x[1]])

    return named(cycle(rates, (1.23, 4.23), 7.16), *"xy", only="period x_max multiplier2_real")


def chua() -> dict[str, Any]:
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


def thomas() -> dict[str, Any]:
    """At x = y = z, sin x = b x, with eigenvalues -b + cos x times roots of 1: those that are complex cross there."""
    x = mp.findroot(lambda x: mp.tan(x) + x / 2, 2.3)
    return {"Hopf_1": mp.sin(x) / x}


def lotka_volterra() -> dict[str, Any]:
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


def den_hartog(mu: float) -> dict[str, Any]:
    """Released from rest at A where cos(omega t) = A - mu, it comes to rest at -A."""
    w, friction = mp.mpf("0.7"), mp.mpf(mu)
    a = 1 / (1 - w * w)

    def misses(A, length):
        t0 = mp.acos(A - friction) / w
        free, rate = A - friction - a * mp.cos(w * t0), a * w * mp.sin(w * t0)
        t, c, s = t0 + length, mp.cos(length), mp.sin(length)
        x = friction + a * mp.cos(w * t) + free * c + rate * s
        return [x + A, -a * w * mp.sin(w * t) - free * s + rate * c]

    return {"x_max": mp.findroot(misses, {0.8: (1.3, 4.18), 0.95: (0.0164, 1.46)}[mu])[0]}


def rocking_block(r: float) -> dict[str, Any]:
    """Flights of 2 artanh(v) each, whose speeds shrink by r."""
    x = mp.mpf("0.3")
    speed = mp.sqrt(2 * x - x * x)
    return {"last_event": mp.acosh(1 / (1 - x)) + 2 * mp.nsum(lambda k: mp.atanh(speed * mp.mpf(r) ** k), [1, mp.inf])}


def rimless_wheel() -> dict[str, Any]:
    """From w^2 + 2 cos q = constant along a spoke."""
    alpha, gamma = mp.mpf("0.2"), mp.mpf("0.08")
    first = mp.sqrt(4 * mp.sin(gamma) * mp.sin(alpha) / mp.sin(2 * alpha) ** 2) * mp.cos(2 * alpha)
    energy = first**2 + 2 * mp.cos(gamma - alpha)
    period = mp.quad(lambda q: 1 / mp.sqrt(energy - 2 * mp.cos(q)), [gamma - alpha, gamma + alpha])
    return {"period": period, "w_min": mp.sqrt(energy - 2)}


def simplest_walker() -> dict[str, Any]:
    """Newton's method on angle and rate after the impact; the step ends where phi = 2 theta with the foot in front."""
    gamma = 0.009

    def rates(t, x):
        fall = np.sin(x[0] - gamma)
        return [x[2], x[3], fall, fall + x[2] ** 2 * np.sin(x[1]) - np.cos(x[0] - gamma) * np.sin(x[1])]

    def landing(t, x):
        return x[1] - 2 * x[0]

    landing.direction = 1.0  # type: ignore[attr-defined] # as SciPy reads it
    landing.terminal = True  # type: ignore[attr-defined]

    def step(q, u):
        c = np.cos(2 * q)
        start = [q, 2 * q, u, u * (1 - c)]
        away = solve_ivp(rates, (0.0, 0.5), start, method="DOP853", rtol=1e-13, atol=1e-15)
        run = solve_ivp(
            rates, (0.5, 5.0), away.y[:, -1], method="DOP853", rtol=1e-13, atol=1e-15, events=landing, dense_output=True
        )
        end = run.y_events[0][0]
        return [-end[0] - q, end[2] * np.cos(2 * end[0]) - u], run

    found = root(lambda x: step(*x)[0], [0.2003, -0.1998], tol=1e-14).x
    run = step(*found)[1]
    fastest = root_scalar(lambda t: rates(t, run.sol(t))[3], bracket=(1.5, 3.0), xtol=1e-14).root
    return {"period": run.t_events[0][0], "v_min": run.sol(fastest)[3]}


def impact_oscillator() -> dict[str, Any]:
    """x = a cos(omega t) + free motion from the wall back to it: two equations for phase and speed of the impact."""
    w, r = 2.8, 0.8
    a = 1 / (1 - w * w)

    def after(t0, speed, t):
        """Place and speed at t, since an impact at t0 from which it goes at that speed."""
        free = np.array([-a * np.cos(w * t0), speed + a * w * np.sin(w * t0)])
        turn = np.array([[np.cos(t - t0), np.sin(t - t0)], [-np.sin(t - t0), np.cos(t - t0)]])
        return turn @ free + [a * np.cos(w * t), -a * w * np.sin(w * t)]

    period = 2 * np.pi / w
    t0, speed = root(
        lambda u: after(u[0], u[1], u[0] + period) + np.array([0.0, u[1] / r]), [3.06 / w, -0.27], tol=1e-15
    ).x
    x, v = after(t0, speed, period)
    # of x' := -r x' at the wall, with the times of arrival that differ
    push, before = np.cos(w * t0), -speed / r
    jump = np.array([[-r, 0.0], [(1 + r) * push / before, -r]])
    turn = np.array([[np.cos(period), np.sin(period)], [-np.sin(period), np.cos(period)]])
    order = sorted(np.linalg.eigvals(jump @ turn), key=lambda m: -abs(m))
    return {"x": x, "v": v, "multiplier1_real": order[0].real}


def relay() -> dict[str, Any]:
    """Half a period h: x(h) = -x(0) by the exponential, and z(0) = 0."""
    a, b = np.array([[-1.0, 0, 0], [1, -1, 0], [0, 1, -1]]), np.array([-1.0, 0, 0])

    def at_switching(h):
        e = expm(a * h)
        return -np.linalg.solve(np.eye(3) + e, (e - np.eye(3)) @ np.linalg.solve(a, b))

    half = root_scalar(lambda h: at_switching(h)[2], bracket=(1.0, 3.0), xtol=1e-15).root
    return {"period": 2 * half, "x_max": abs(at_switching(half)[0])}


# of the buck converter: v' and i' by v and i, the period, the rise of the ramp, how the switch sees v and i
CIRCUIT, SEEN = np.array([[-1 / (22 * 47e-6), 1 / 47e-6], [-50.0, 0.0]]), np.array([-8.4, 0.0])
TICK, RISE = 400e-6, 4.4 / 400e-6


def converter_jump(before: np.ndarray, source: float) -> np.ndarray:
    """What a comparison makes of a deviation: the source comes, or goes (< 0), where the rates before are these."""
    return np.eye(2) + np.outer([0.0, 50.0 * source], SEEN) / (RISE + SEEN @ before)


def buck_converter() -> dict[str, Any]:
    """Cycles of 1 and 2 periods, off for a part of each and then on: where -1 is a multiplier."""

    def missed(unknown):
        E, parts = unknown[0], unknown[1:]
        rest, x, turn, late = np.array([E, E / 22]), np.zeros(2), np.eye(2), []
        ways = [(expm(CIRCUIT * TICK * part), expm(CIRCUIT * TICK * (1 - part))) for part in parts]
        for off, on in ways:
            x, turn = rest + on @ (off @ x - rest), on @ off @ turn
        x, slopes = np.linalg.solve(np.eye(2) - turn, x), np.eye(2)
        for part, (off, on) in zip(parts, ways, strict=True):
            x = off @ x
            late.append(3.8 + 4.4 * part - 8.4 * (x[0] - 11.3))
            slopes = on @ converter_jump(CIRCUIT @ x, E) @ off @ slopes
            x = rest + on @ (x - rest)
        return [np.linalg.det(slopes + np.eye(2)), *late]

    guesses = ([24.5, 0.5], [31.1, 0.35, 0.87])
    return {f"flip_{n}": root(missed, guess, tol=1e-14).x[0] for n, guess in enumerate(guesses, 1)}


def buck_chaos() -> dict[str, Any]:
    """Exact flows between comparisons, which are looked for on a grid of times; the sum is the divergence."""
    E, periods, damping = 34.0, 16000, -np.trace(CIRCUIT) / 2
    w = np.sqrt(np.linalg.det(CIRCUIT) - damping**2)
    swing, grid = (CIRCUIT + damping * np.eye(2)) / w, np.linspace(0.0, 1.0, 81)
    x, deviation, growth = np.array([12.0, 0.55]), np.array([1.0, 0.3]), 0.0

    def flow(t):
        return np.exp(-damping * t) * (np.cos(w * t) * np.eye(2) + np.sin(w * t) * swing)

    def ahead(s: Any, t: float, y: float, across: float, rest: float) -> Any:
        v = rest + np.exp(-damping * s) * (np.cos(w * s) * y + np.sin(w * s) * across)
        return 3.8 + RISE * (t + s) - 8.4 * (v - 11.3)

    for k in range(-500, periods):
        t, on = 0.0, 3.8 - 8.4 * (x[0] - 11.3) > 0
        while t < TICK:
            rest = np.array([E, E / 22]) * on
            y = x - rest
            here = (t, y[0], (swing @ y)[0], rest[0])
            times = grid * (TICK - t)
            other = np.flatnonzero((ahead(times[1:], *here) > 0) != on)
            step = TICK - t
            if other.size:
                bracket = (times[other[0]] or 1e-6 * times[1], times[other[0] + 1])
                step = root_scalar(ahead, args=here, bracket=bracket, xtol=1e-18).root
            x, deviation = rest + flow(step) @ y, flow(step) @ deviation
            if not other.size:
                break
            deviation = converter_jump(CIRCUIT @ (x - rest), -E if on else E) @ deviation
            t, on = t + step, not on
        size = np.hypot(deviation[0], 20 * deviation[1])
        deviation, growth = deviation / size, growth + (np.log(size) if k >= 0 else 0.0)
    largest = growth / (periods * TICK)
    return {"exponent1": largest, "exponent2": np.trace(CIRCUIT) - largest}


def brake(mu) -> tuple[Any, Callable[..., Any], Callable[..., Any]]:
    """Slip and stick are linear flows of (x, y, vx, vy, 1), and a cycle begins where stick ends: the flow in slip, the
    state there, and what a cycle with one stick lacks."""
    c, k1, k2, k3, belt = (mp.mpf(text) for text in ("0.1", "11", "20", "11", "0.02"))
    along, across, onto = mp.mpf(3) / 4 * (k1 + k2), mp.sqrt(3) / 4 * (k2 - k1), (k1 + k2) / 4 + k3
    press = [-across, -onto, 0, -c, 0]
    slip = mp.matrix([[0, 0, 1, 0, 0], [0, 0, 0, 1, 0], [-along, mu * k3 - across, -c, 0, mu], press, [0] * 5])
    stick = mp.matrix([[0, 0, 0, 0, belt], [0, 0, 0, 1, 0], [0] * 5, press, [0] * 5])

    def release(y, vy):
        return mp.matrix([(mu * (1 + k3 * y) - across * y - c * belt) / along, y, belt, vy, 1])

    def lack(y, vy, sliding, stuck):
        caught = mp.expm(slip * sliding) * release(y, vy)
        end = mp.expm(stick * stuck) * caught
        return [caught[2] - belt, end[0] - release(end[1], end[3])[0], end[1] - y, end[3] - vy]

    return slip, release, lack


def disc_brake_squeal() -> dict[str, Any]:
    slip, release, lack = brake(mp.mpf("0.6"))
    y, vy, sliding, stuck = mp.findroot(lack, (-0.001, -0.254, 0.825, 0.634))
    turn = mp.findroot(lambda t: (mp.expm(slip * t) * release(y, vy))[2], 0.2)
    farthest = (mp.expm(slip * turn) * release(y, vy))[0]
    return {"period": sliding + stuck, "x_max": farthest, "pad_stick": stuck / (sliding + stuck)}


@pytest.mark.nightly
def test_a_brake_squeals_below_the_threshold_of_its_rest():
    """Stick-slip and steady sliding are both stable between the fold of the cycles and the Hopf point."""
    system = Strobe(
        Fmu.open(built_scene(read_scene("disc_brake_squeal"))), period=1.459, autonomous=True, parameters={"mu": 0.6}
    )
    cycles = branch(system, "mu", (0.3, 0.9), start={"x": 0.03}, settle=True)
    folds = [special.value for special in cycles.special if special.kind == "fold"]
    with mp.workdps(20):

        def friction(stuck):
            return mp.findroot(lambda y, vy, slip, mu: brake(mu)[2](y, vy, slip, stuck), (0.046, 0.02, 1.12, 0.406))[3]

        longest = mp.findroot(lambda stuck: mp.diff(friction, stuck, h=1e-5), (0.29, 0.31), tol=1e-6)
        assert min(folds) == pytest.approx(float(friction(longest)), abs=1e-8)
    assert max(folds) < 0.4774 and cycles.stable[-1]


COMPUTED: dict[str, Callable[..., dict[str, Any]]] = {
    function.__name__: function
    for function in (
        *(ikeda, nordmark, tinkerbell, lorenz, van_der_pol, fitzhugh_nagumo, rossler, ueda, duffing, brusselator),
        *(
            chua,
            thomas,
            lotka_volterra,
            rocking_block,
            rimless_wheel,
            simplest_walker,
            impact_oscillator,
            relay,
            den_hartog,
            buck_converter,
            buck_chaos,
            disc_brake_squeal,
        ),
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
    scene, function = read_scene(name), COMPUTED[name]
    for known in (reference for reference in scene.references if reference.source.startswith("computed")):
        varied = {str(scene.compute.over): known.at} if signature(function).parameters else {}
        with mp.workdps(30):
            values = function(**varied)
        assert known.values == pytest.approx({n: float(value) for n, value in values.items()}, rel=known.tolerance)


def test_all_that_is_called_computed_is_computed_here():
    computed = [path.stem for path in SCENES if "computed" in path.read_text("utf-8")]
    assert sorted(COMPUTED) == computed
    assert len(SCENES) == 45 and not {path.stem for path in SCENES} & {*MODELS.names(), *MAPS.names()}


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
