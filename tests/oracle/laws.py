"""Laws of friction and of stops, written once more from their published equations.

Friction: lambda along positive slip at the speed y of sign s; the largest lambda and -lambda of a contact that sticks;
the rates of internal states, for which s = 0 in stick.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import sympy


@dataclass(frozen=True)
class FrictionLaw:
    """Expressions in the slip speed Y, its sign S and the internal states; ``width``: of what it does around rest, a
    slip speed."""

    force: sympy.Expr
    states: tuple[sympy.Symbol, ...] = ()
    rates: tuple[sympy.Expr, ...] = ()
    starts: tuple[float, ...] = ()
    sticks: bool = True
    renewed: bool = False
    capacities: tuple[sympy.Expr, sympy.Expr] | None = None
    width: sympy.Expr | None = None

    @property
    def capacity(self) -> tuple[sympy.Expr, sympy.Expr]:
        """Largest lambda, against negative slip, and largest -lambda; of most laws those of slip at no speed."""
        if self.capacities:
            return self.capacities
        at_rest = self.force.subs(Y, 0)
        return at_rest.subs(S, -1), -at_rest.subs(S, 1)


Y, S = sympy.Symbol("Y", real=True), sympy.Symbol("S", real=True)
DEPTH, RATE, ENTRY = sympy.symbols("DEPTH RATE ENTRY", real=True)


def friction(law: Mapping[str, Any], contact: str, read: Any) -> FrictionLaw:
    """A law by name; ``read`` makes an expression of a text."""
    name = law["name"]
    p = {key: value if key in ("name", "law", "steady") else read(value) for key, value in law.items()}
    if name in ("tanh", "arctan"):
        inner = friction(p["law"], contact, read)
        shape = sympy.tanh(Y / p["width"]) if name == "tanh" else 2 / sympy.pi * sympy.atan(Y / p["width"])
        return FrictionLaw(inner.force.subs(S, shape), sticks=False, width=p["width"])
    if name in ("lugre", "lugre_stribeck"):
        z = sympy.Symbol(f"z_{contact}", real=True)
        steady, viscous, width = p["steady"], sympy.S.Zero, None
        if name == "lugre_stribeck":
            viscous, width = read(steady["N"]) * read(steady["mu_v"]) * Y, read(steady["v_s"])
            steady = {**steady, "mu_v": "0"}
        # the steady force against slip of this sign
        g = -S * friction(steady, contact, read).force
        rate = Y - p["sigma0"] * S * Y * z / g
        return FrictionLaw(
            -(p["sigma0"] * z + p["sigma1"] * rate) - viscous, (z,), (rate,), (0.0,), sticks=False, width=width
        )
    if name in ("dieterich", "ruina"):
        theta = sympy.Symbol(f"theta_{contact}", real=True)
        speed = S * Y + p["v_c"]
        aged = (p["a"] + p["weakening"]) * sympy.log(p["v_r"] * theta / p["D_c"])
        mu = p["mu_r"] + p["a"] * sympy.log(speed / p["v_r"]) + aged
        u = speed * theta / p["D_c"]
        rate = 1 - u if name == "dieterich" else -u * sympy.log(u)
        return FrictionLaw(-S * p["N"] * mu, (theta,), (rate,), (1.0,))
    if name == "ageing":
        clock = sympy.Symbol(f"clock_{contact}", real=True)
        slip = friction({**law, "name": "conti"}, contact, read).force
        most = p["N"] * (p["mu_s"] + p["b"] * sympy.log(1 + clock / p["t_0"]) / sympy.log(10))
        return FrictionLaw(slip, (clock,), (1 - S**2,), (0.0,), renewed=True, capacities=(most, most))
    return FrictionLaw(_DRY[name](p, S * Y), width=p.get("v_s"))


def _conti(p: Mapping[str, Any], speed: sympy.Expr, side: str = "") -> Any:
    high, low = p["mu_s" + side], p["mu_k" + side]
    return p["N"] * ((high - low) / (1 + p["p" + side] * speed) + low)


def _stribeck(p: Mapping[str, Any], speed: sympy.Expr) -> Any:
    power = int(p.get("exponent", 2))
    left = sympy.exp(-((speed / p["v_s"]) ** power))
    return -S * p["N"] * (p["mu_k"] + (p["mu_s"] - p["mu_k"]) * left) - p["N"] * p["mu_v"] * Y


_DRY: dict[str, Any] = {
    "coulomb": lambda p, speed: -S * p["N"] * p["mu"],
    "coulomb_viscous": lambda p, speed: -p["N"] * (S * p["mu"] + p["mu_v"] * Y),
    "conti": lambda p, speed: -S * _conti(p, speed),
    "conti_viscous": lambda p, speed: -S * _conti(p, speed) - p["N"] * p["mu_v"] * Y,
    "directional": lambda p, speed: (1 - S) / 2 * _conti(p, speed, "_minus") - (1 + S) / 2 * _conti(p, speed, "_plus"),
    "stribeck": _stribeck,
    "stribeck_cubic": lambda p, speed: -S * p["a0"] + p["a1"] * Y - p["a3"] * Y**3,
    "tustin": lambda p, speed: -S * p["N"] * (p["mu_k"] + (p["mu_s"] - p["mu_k"]) * sympy.exp(-speed / p["v_s"])),
}


def stop(law: Mapping[str, Any], read: Any) -> tuple[Any, Any]:
    """Compressive force of a stop, and a quantity of its sign."""
    p = {key: value if key == "name" else read(value) for key, value in law.items()}
    if p["name"] == "kelvin_voigt":
        return (p["k"] * DEPTH + p["c"] * RATE,) * 2
    damped = 1 + 3 * (1 - p["restitution"] ** 2) / 4 * RATE / ENTRY
    return p["k"] * DEPTH ** p["n"] * damped, damped
