"""What scenes of the literature call "computed", of systems that nothing forces."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import mpmath as mp
import numpy as np
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.optimize import root, root_scalar
from smooth_cycles import cycle, eigenvalues, named


def ikeda() -> dict[str, Any]:
    """The map in complex numbers."""

    def step(x, y):
        z = mp.mpc(x, y)
        z = 1 + mp.mpf("0.9") * z * mp.exp(1j * (mp.mpf("0.4") - 6 / (1 + abs(z) ** 2)))
        return z.real, z.imag

    point = mp.findroot(lambda x, y: [a - b for a, b in zip(step(x, y), (x, y), strict=True)], (0.53, 0.25))
    slopes = [[mp.diff(lambda *p, i=i: step(*p)[i], tuple(point), by) for by in ((1, 0), (0, 1))] for i in (0, 1)]
    return {"x": point[0], "y": point[1], "multiplier1_real": eigenvalues(slopes)[0].real}


def tinkerbell() -> dict[str, Any]:
    a, b, c, d = map(mp.mpf, ("0.9", "-0.6013", "2", "0.5"))
    x, y = mp.findroot(
        lambda x, y: [x * x - y * y + (a - 1) * x + b * y, 2 * x * y + c * x + (d - 1) * y], (1.03, -1.32)
    )
    largest = eigenvalues([[2 * x + a, b - 2 * y], [2 * y + c, 2 * x + d]])[0]
    return {"x": x, "y": y, "multiplier1_real": largest.real}


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


def relay() -> dict[str, Any]:
    """Half a period h: x(h) = -x(0) by the exponential, and z(0) = 0."""
    a, b = np.array([[-1.0, 0, 0], [1, -1, 0], [0, 1, -1]]), np.array([-1.0, 0, 0])

    def at_switching(h):
        e = expm(a * h)
        return -np.linalg.solve(np.eye(3) + e, (e - np.eye(3)) @ np.linalg.solve(a, b))

    half = root_scalar(lambda h: at_switching(h)[2], bracket=(1.0, 3.0), xtol=1e-15).root
    return {"period": 2 * half, "x_max": abs(at_switching(half)[0])}


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


UNFORCED = (
    *(ikeda, tinkerbell, lorenz, van_der_pol, fitzhugh_nagumo, rossler, brusselator, chua),
    *(thomas, lotka_volterra, rocking_block, rimless_wheel, simplest_walker, relay, disc_brake_squeal),
)
