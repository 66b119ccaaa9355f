"""One period of the woodpecker toy with 25 digits: its modes are linear, so each is a Taylor series of any order.

    M q'' = h(q) + sum of w lambda      one contact at most, whose lambda is linear in q, since its gap, and where it
                                        sticks its slip, stay at zero

The order of the modes is given, and about how long each lasts; where one ends is found by secants.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import cache
from typing import Any

from mpmath import mp, mpf

mp.dps = 25
M_M, J_M, M_S, J_S, G, C_PHI, MU = map(mpf, ("0.0003", "5e-9", "0.0045", "7e-7", "9.81", "0.0056", "0.3"))
R_0, R_M, H_M, L_M, L_G, H_S, L_S = map(mpf, ("0.0025", "0.0031", "0.0058", "0.010", "0.015", "0.020", "0.0201"))
MASS = mp.matrix(
    [
        [M_M + M_S, M_S * L_M, M_S * L_G],
        [M_S * L_M, J_M + M_S * L_M**2, M_S * L_M * L_G],
        [M_S * L_G, M_S * L_M * L_G, J_S + M_S * L_G**2],
    ]
)
INVERSE = MASS**-1
# per contact its directions of gap and slip, and the gap of the toy upright
NORMAL = {"beak": [0, 0, -H_S], "lower": [0, H_M, 0], "upper": [0, -H_M, 0]}
SLIP = {"beak": [1, L_M, L_G - L_S], "lower": [1, R_M, 0], "upper": [1, R_M, 0]}
UPRIGHT = {"beak": L_M + L_G - L_S - R_0, "lower": R_M - R_0, "upper": R_M - R_0}

Row = list[Any]
# a contact and how it slips: +1, -1, or 0 where it sticks
Mode = tuple[str, int] | None


def dot(a: Sequence[Any], b: Sequence[Any]) -> Any:
    return sum(x * y for x, y in zip(a, b, strict=True))


def by_mass(w: Sequence[Any]) -> Row:
    return list(INVERSE * mp.matrix(w))


def gap(contact: str, x: Row) -> Any:
    return UPRIGHT[contact] + dot(NORMAL[contact], x[:3])


def gap_rate(contact: str, x: Row) -> Any:
    return dot(NORMAL[contact], x[3:])


def slip(contact: str, x: Row) -> Any:
    return dot(SLIP[contact], x[3:])


@cache
def linear(mode: Mode) -> tuple[list[Row], list[Row]]:
    """Accelerations, and forces of the contact, of a mode: constants, and factors of both angles."""
    ways, bounds = [], []
    if mode:
        n, t = NORMAL[mode[0]], SLIP[mode[0]]
        ways = [[a - mode[1] * MU * b for a, b in zip(n, t, strict=True)]] if mode[1] else [n, t]
        bounds = [n] if mode[1] else [n, t]
    loads = [[-(M_M + M_S) * G, -M_S * G * L_M, -M_S * G * L_G], [mpf(0), -C_PHI, C_PHI], [mpf(0), C_PHI, -C_PHI]]
    rates, forces = [], []
    for load in loads:
        free = by_mass(load)
        force: Row = []
        if ways:
            matrix = mp.matrix([[dot(bound, by_mass(way)) for way in ways] for bound in bounds])
            force = list(mp.lu_solve(matrix, mp.matrix([-dot(bound, free) for bound in bounds])))
        rates.append(
            [a + sum(f * by_mass(way)[i] for f, way in zip(force, ways, strict=True)) for i, a in enumerate(free)]
        )
        forces.append(force)
    return rates, forces


def force(mode: Mode, x: Row, which: int = 0) -> Any:
    """Normal force of the contact, or that of its friction (1), in a mode."""
    constant, of_sleeve, of_bird = linear(mode)[1]
    return constant[which] + of_sleeve[which] * x[1] + of_bird[which] * x[2]


def flow(mode: Mode, x: Row, time: Any) -> Row:
    """The state (y, phi_M, phi_S, and their rates) some s later."""
    (constant, of_sleeve, of_bird), _ = linear(mode)
    pieces = int(abs(time) / mpf("0.004")) + 1
    dt = time / pieces
    for _ in range(pieces):
        q, v, total = x[:3], x[3:], list(x)
        for k in range(1, 80):
            first = constant if k == 1 else [mpf(0)] * 3
            a = [first[i] + of_sleeve[i] * q[1] + of_bird[i] * q[2] for i in range(3)]
            q, v = [one * dt / k for one in v], [one * dt / k for one in a]
            total = [a + b for a, b in zip(total, q + v, strict=True)]
            if max(abs(one) for one in q + v) < mpf(10) ** (-mp.dps - 2):
                break
        x = total
    return x


def until(mode: Mode, x: Row, ends: Callable[[Row], Any], guess: float) -> Row:
    """The state where something is zero, about so many s later."""
    t0, t1 = mpf(guess), mpf(guess) * (1 + mpf("1e-7"))
    f0 = ends(flow(mode, x, t0))
    for _ in range(30):
        f1 = ends(flow(mode, x, t1))
        if f1 == f0 or abs(t1 - t0) < mpf(10) ** (4 - mp.dps):
            break
        t0, t1, f0 = t1, t1 - f1 * (t1 - t0) / (f1 - f0), f1
    return flow(mode, x, t1)


def impact(x: Row, contact: str, restitution: Any) -> Row:
    """After Newton's impact with Coulomb's friction, which slips."""
    n, t = NORMAL[contact], SLIP[contact]
    for sign in (1, -1):
        way = by_mass([a - sign * MU * b for a, b in zip(n, t, strict=True)])
        impulse = -(1 + restitution) * gap_rate(contact, x) / dot(n, way)
        after = x[:3] + [v + impulse * one for v, one in zip(x[3:], way, strict=True)]
        if impulse > 0 and sign * slip(contact, after) > 0:
            return after
    raise AssertionError("it does not slip")


def to_the_landing(lowest: Any, restitution: Any, times: Iterator[float], flat: bool) -> Row:
    """From the jam in which the bird is farthest back to where the lower edge meets the pole again, just before it
    does; if ``flat``, to where its gap bends from one side to the other."""

    def go(mode: Mode, ends: Callable[[Row], Any]) -> None:
        nonlocal x
        x = until(mode, x, ends, next(times))

    x = [mpf(0), -(R_M - R_0) / H_M, lowest, mpf(0), mpf(0), mpf(0)]
    go(("lower", 0), lambda x: MU * force(("lower", 0), x) - force(("lower", 0), x, 1))
    go(("lower", -1), lambda x: force(("lower", -1), x))
    go(None, lambda x: gap("upper", x))
    x = impact(x, "upper", 0)
    go(None, lambda x: gap("beak", x))
    x = impact(x, "beak", restitution)
    go(None, lambda x: gap("upper", x))
    x = impact(x, "upper", 0)
    slides = ("upper", 1 if slip("upper", x) > 0 else -1)
    go(slides, lambda x: force(slides, x))
    constant, of_sleeve, of_bird = linear(None)[0]
    bends = [dot(NORMAL["lower"], one) for one in (constant, of_sleeve, of_bird)]
    go(None, (lambda x: dot(bends, [1, x[1], x[2]])) if flat else lambda x: gap("lower", x))
    return x


def to_the_jam(x: Row, times: Iterator[float]) -> Any:
    """From the lower edge at the pole, where it slides, to the next jam: the angle of the bird farthest back."""
    x = until(("lower", -1), x, lambda x: slip("lower", x), next(times))
    return until(("lower", 0), x, lambda x: x[5], next(times))[2]
