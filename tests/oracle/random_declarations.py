"""Random declarations and values: every kind of contact, law and slot.

Numbers are short binary fractions, so that a start on a boundary is exactly there.
"""

from __future__ import annotations

import math
import random
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from oracle.declaration import Declaration, Values

GRID = 64  # numbers are multiples of its inverse
MOST_FORCE = 100.0  # of a stop at the start


@dataclass
class _Draw:
    """What a declaration is drawn into; ``ranges`` give the values of parameters for every run."""

    random: random.Random
    ranges: dict[str, tuple[Any, ...]] = field(default_factory=dict)
    inputs: list[str] = field(default_factory=list)
    features: list[tuple[str, str]] = field(default_factory=list)
    on_boundary: list[tuple[str, str, str]] = field(default_factory=list)

    def p(self, stem: str, *values: Any) -> str:
        """A new parameter, drawn from an interval (two numbers) or from ("of", a, b, ...)."""
        name = f"{stem}{sum(key.rstrip('0123456789') == stem for key in self.ranges)}"
        self.ranges[name] = values
        return name

    def chance(self, share: float) -> bool:
        return self.random.random() < share

    def wave(self, size: float = 1.0) -> str:
        """A function of time alone, smooth."""
        kind = self.random.choice(("sin", "sin", "cos", "pulse", "step", "input"))
        a = self.p("amp", -size, size)
        if kind == "input":
            if not self.inputs:
                self.inputs.append("u0")
            return f"{a}*u0"
        if kind in ("pulse", "step"):
            centre, width = self.p("tc", 0.5, 2.0), self.p("tw", "of", 0.5, 0.125, 1 / 64, 1 / 256)
            self.features.append((centre, width))
            return f"{a}*exp(-((t - {centre})/{width})**2)" if kind == "pulse" else f"{a}*tanh((t - {centre})/{width})"
        return f"{a}*{kind}({self.p('w', 0.5, 8.0)}*t)"


def declaration(generator: random.Random) -> tuple[Declaration, _Draw]:
    """A declaration, and what draws its values."""
    draw = _Draw(generator)
    if draw.chance(0.2):
        return pruned(_automaton(draw)), draw
    n = generator.choice((1, 1, 2, 2, 3, 4))
    q = [f"q{i}" for i in range(n)]
    kinetic, potential, dissipation = [], [], []
    for i in range(n):
        mass = draw.p("m", 0.5, 2.0)
        kinetic.append(
            generator.choice((f"{mass}*v{i}**2/2",) * 3 + (f"{mass}*(1 + q{generator.randrange(n)}**2/4)*v{i}**2/2",))
        )
        if draw.chance(0.8):
            potential.append(f"{draw.p('k', 0.0, 4.0)}*q{i}**2/2")
        if draw.chance(0.3):
            potential.append(
                generator.choice(
                    (
                        f"{draw.p('f', -2.0, 2.0)}*q{i}",
                        f"{draw.p('b', 0.0, 1.0)}*q{i}**4/4",
                        f"{draw.p('f', 0.0, 3.0)}*(1 - cos(q{i}))",
                    )
                )
            )
        if draw.chance(0.4):
            dissipation.append(f"{draw.p('c', 0.0, 0.5)}*v{i}**2/2")
    for i in range(1, n):
        kind = generator.choice(("none", "spring", "damper", "mass", "pendulum"))
        if kind == "spring":
            potential.append(f"{draw.p('k', 0.0, 4.0)}*(q{i} - q{i - 1})**2/2")
        elif kind == "damper":
            dissipation.append(f"{draw.p('c', 0.0, 0.5)}*(v{i} - v{i - 1})**2/2")
        elif kind == "mass":
            kinetic.append(f"{draw.p('m', 0.25, 1.0)}*(v{i} + v{i - 1})**2/2")
        elif kind == "pendulum":
            kinetic.append(f"{draw.p('h', 0.0, 0.375)}*v{i}*v{i - 1}*cos(q{i} - q{i - 1})")
    applied = {}
    for i in range(n):
        if draw.chance(0.6):
            applied[q[i]] = draw.wave(2.0) + (f" + {draw.p('f', -1.0, 1.0)}" if draw.chance(0.5) else "")
    kinds = generator.choices(("friction", "stop", "impact"), (5, 2, 3), k=generator.choice((1, 1, 2, 2, 3)))
    contacts = [globals()[f"_{kind}"](draw, n, f"on{k}") for k, kind in enumerate(kinds)]
    if draw.chance(0.25):
        contacts.append(_sliders(draw, n, f"on{len(contacts)}"))
    rules = generator.choice(("newton", "poisson"))
    for contact in contacts:
        if contact["kind"] == "impact":
            contact["rule"] = rules
    T, U, D = (" + ".join(terms) or "0" for terms in (kinetic, potential, dissipation))
    return pruned(Declaration(tuple(q), tuple(draw.ranges), tuple(draw.inputs), T, U, D, applied, {}, contacts)), draw


def pruned(declared: Declaration) -> Declaration:
    """Without parameters and inputs that nothing uses."""
    d = declared
    texts = f"{d.kinetic} {d.potential} {d.dissipation} {dict(d.applied)} {dict(d.flows)} {list(d.contacts)}"
    used = set(re.findall(r"[A-Za-z_]\w*", texts))
    parameters, inputs = (tuple(name for name in names if name in used) for names in (d.parameters, d.inputs))
    return replace(d, parameters=parameters, inputs=inputs)


def _direction(draw: _Draw, n: int) -> tuple[str, str]:
    """A way and its speed: of one coordinate, or between two."""
    i = draw.random.randrange(n)
    if n > 1 and draw.chance(0.35):
        j = draw.random.choice([k for k in range(n) if k != i])
        return f"q{i} - q{j}", f"v{i} - v{j}"
    return f"q{i}", f"v{i}"


def _normal_force(draw: _Draw, n: int) -> str:
    base = draw.p("N", "of", 0.0, 0.25, 0.5, 1.0, 1.0, 2.0, 3.0)
    kind = draw.random.choice(("constant", "constant", "wave", "place", "bend"))
    if kind == "wave":
        return f"{base}*(1 + {draw.p('r', 0.0, 0.875)}*sin({draw.p('w', 0.5, 6.0)}*t))"
    if kind == "place":
        return f"({base} + {draw.p('r', 0.0, 1.0)}*q{draw.random.randrange(n)}**2)"
    if kind == "bend":
        centre, width = draw.p("tc", 0.5, 2.0), draw.p("tw", "of", 0.5, 0.125, 1 / 64)
        draw.features.append((centre, width))
        return f"{base}*(1 - {draw.p('r', 0.0, 0.875)}*exp(-((t - {centre})/{width})**2))"
    return base


def _law(draw: _Draw, n: int, inner: bool = False) -> dict[str, Any]:
    dry = (
        "coulomb",
        "coulomb",
        "coulomb_viscous",
        "conti",
        "conti_viscous",
        "directional",
        "stribeck",
        "stribeck_cubic",
        "tustin",
    )
    name = draw.random.choice(
        dry if inner else (*dry, *dry, "tanh", "arctan", "lugre", "lugre_stribeck", "dieterich", "ruina", "ageing")
    )
    if name in ("tanh", "arctan"):
        width = draw.p("width", "of", 0.25, 1 / 16, 1 / 256)
        return {"name": name, "law": _law(draw, n, inner=True) | {}, "width": width}
    N = _normal_force(draw, n)
    low = draw.p("mu", 0.125, 0.5)
    high = f"({low} + {draw.p('dmu', 'of', 0.0, 0.125, 0.25, 0.5)})"
    over = draw.p("vs", "of", 1.0, 0.25, 1 / 16, 1 / 256)
    p = draw.p("p", 0.0, 16.0)
    viscous = draw.p("muv", 0.0, 0.25)
    if name == "lugre_stribeck":
        steady = {"name": "stribeck", "N": f"({N} + 1/8)", "mu_s": high, "mu_k": low, "v_s": over, "mu_v": viscous}
    else:
        steady = {"name": "conti", "N": f"({N} + 1/8)", "mu_s": high, "mu_k": low, "p": p}
    bristles = {"steady": steady, "sigma0": draw.p("sz", "of", 16.0, 256.0), "sigma1": draw.p("sd", "of", 0.0, 1.0)}
    parts: dict[str, dict[str, Any]] = {
        "coulomb": {"N": N, "mu": high},
        "coulomb_viscous": {"N": N, "mu": high, "mu_v": viscous},
        "conti": {"N": N, "mu_s": high, "mu_k": low, "p": p},
        "conti_viscous": {"N": N, "mu_s": high, "mu_k": low, "p": p, "mu_v": viscous},
        "directional": {
            **{"N": N, "mu_s_plus": high, "mu_k_plus": low, "p_plus": p},
            **{"mu_s_minus": f"(2*{low})", "mu_k_minus": low, "p_minus": p},
        },
        "stribeck": {"N": N, "mu_s": high, "mu_k": low, "v_s": over, "mu_v": viscous},
        "stribeck_cubic": {"a0": f"({N})*{low}", "a1": draw.p("b", 0.0, 1.0), "a3": draw.p("b", 0.0, 0.5)},
        "tustin": {"N": N, "mu_s": high, "mu_k": low, "v_s": over},
        "lugre": bristles,
        "lugre_stribeck": bristles,
        "ageing": {
            "N": N,
            "mu_s": high,
            "mu_k": low,
            "p": p,
            "b": draw.p("b", 0.0, 0.25),
            "t_0": draw.p("tt", "of", 0.125, 1 / 64),
        },
    }
    state = {"N": N, "mu_r": high, "weakening": draw.p("b", 0.0, 0.0625), "a": draw.p("b", 0.0, 0.0625)}
    state |= {"D_c": draw.p("D", "of", 0.25, 1 / 32), "v_r": 0.0625, "v_c": draw.random.choice((1 / 64, 1 / 1024))}
    if name == "stribeck" and draw.chance(0.3):
        return {"name": name, **parts[name], "exponent": draw.random.choice((1, 3, 4))}
    return {"name": name, **parts.get(name, state)}


def _friction(draw: _Draw, n: int, name: str) -> dict[str, Any]:
    place, speed = _direction(draw, n)
    law = _law(draw, n)
    kind = draw.random.choice(("belt", "belt", "rest", "wave", "lever"))
    if kind == "belt":
        belt = draw.p("belt", "of", 0.0, 0.5, -0.5, 1.0, 0.5)
        slip = f"{speed} - {belt}"
        if len(speed) == 2:
            draw.on_boundary.append((speed, belt, "="))
    elif kind == "wave":
        slip = f"{speed} - ({draw.wave(1.0)})"
    elif kind == "lever":
        slip = (
            f"(1 + {draw.p('r', 0.0, 0.75)}*sin(q{draw.random.randrange(n)}))*({speed}) - {draw.p('belt', -1.0, 1.0)}"
        )
    else:
        slip = speed
        if len(speed) == 2:
            draw.on_boundary.append((speed, "0", "="))
    contact = {"kind": "friction", "name": name, "slip": slip, "law": law}
    remembers = law["name"] in ("lugre", "lugre_stribeck", "dieterich", "ruina", "ageing")
    if draw.chance(0.25) and not remembers:
        d = draw.p("d", -0.5, 1.0)
        contact["where"] = draw.random.choice(
            (f"{d} - ({place})", f"{d} + {place}", f"{d} - ({place}) + {draw.wave(0.5)}", f"{d} + 1 - ({place})**2")
        )
    return contact


def _gap(draw: _Draw, n: int, waves: bool) -> str:
    place, _ = _direction(draw, n)
    d = draw.p("d", "of", 0.0, 0.25, 0.5, 0.5, 1.0, 0.75)
    sign = draw.random.choice("+-")
    kind = draw.random.choice(("plain", "plain", "wave" if waves else "plain", "bent"))
    if kind == "wave":
        return f"{d} {sign} ({place}) + {draw.p('amp', -0.25, 0.25)}*sin({draw.p('w', 0.5, 8.0)}*t)"
    if kind == "bent":
        return f"{d} {sign} sin({place})" if draw.chance(0.5) else f"{d} {sign} ({place}) + ({place})**2/8"
    if len(place) == 2:
        draw.on_boundary.append((place, d, "-" if sign == "+" else "+"))
    return f"{d} {sign} ({place})"


def _stop(draw: _Draw, n: int, name: str) -> dict[str, Any]:
    k = draw.p("k", "of", 16.0, 1024.0, 2.0**20, 1e9)
    if draw.chance(0.6):
        law = {"name": "kelvin_voigt", "k": k, "c": draw.p("c", "of", 0.0, 0.25, 4.0)}
    else:
        law = {
            "name": "lankarani_nikravesh",
            "k": k,
            "n": draw.random.choice(("1", "3/2", "3/2", "2", "5/2")),
            "restitution": draw.p("e", 0.25, 1.0),
        }
    gap = _gap(draw, n, waves=True)
    if draw.chance(0.2):
        if not draw.inputs:
            draw.inputs.append("u0")
        gap += f" + {draw.p('amp', -0.25, 0.25)}*u0"
    return {"kind": "stop", "name": name, "gap": gap, "law": law, "release": draw.random.choice(("gap", "force"))}


def _sliders(draw: _Draw, n: int, name: str) -> dict[str, Any]:
    way, _ = _direction(draw, n)
    kind = draw.random.choice(("plain", "plain", "wave", "bent"))
    way = f"{way} - ({draw.wave(0.5)})" if kind == "wave" else f"sin({way})" if kind == "bent" else way
    count = draw.random.choice((1, 1, 2, 3))
    stiffness = [draw.p("k", 0.25, 4.0) for _ in range(count)]
    bounds = [draw.p("D", "of", 1 / 16, 1 / 8, 1 / 4, 1 / 2) for _ in range(count)]
    return {"kind": "sliders", "name": name, "way": way, "k": stiffness, "D": bounds}


def _impact(draw: _Draw, n: int, name: str) -> dict[str, Any]:
    contact: dict[str, Any] = {"kind": "impact", "name": name, "gap": _gap(draw, n, waves=True), "rule": "newton"}
    contact["e"] = draw.p("e", "of", 0.0, 0.25, 0.5, 0.75, 1.0)
    if n > 1 and draw.chance(0.5):
        _, speed = _direction(draw, n)
        contact |= {"slip": f"{speed} - {draw.p('belt', 'of', 0.0, 0.5)}", "mu": draw.p("mu", 0.0, 0.75)}
    return contact


def _automaton(draw: _Draw) -> Declaration:
    """States pushed by signs of switching functions; perhaps jumps."""
    r = draw.random
    n = r.choice((1, 2, 2, 3))
    states = tuple(f"x{i}" for i in range(n))
    switches: list[dict[str, Any]] = []
    flows = {}
    for k in range(r.choice((1, 1, 2))):
        i = r.randrange(n)
        function = r.choice(
            (
                f"x{i} - {draw.p('d', -0.5, 0.5)}",
                f"x{i} - x{(i + 1) % n} + {draw.p('d', -0.5, 0.5)}" if n > 1 else f"x{i}",
                f"x{i} - ({draw.wave(0.5)})",
                f"x{i} + {draw.p('b', 0.0, 0.5)}*x{(i + 1) % n}**2 - 1/4",
            )
        )
        switches.append({"kind": "switch", "name": f"s{k}", "function": function})
        if draw.chance(0.3):
            to = {f"x{i}": f"-{draw.p('e', 0.25, 0.75)}*x{i} + {draw.p('d', -0.25, 1.0)}"}
            switches[-1] |= {"side": r.choice(("+", "-", "both")), "to": to}
    for i in range(n):
        linear = " + ".join(f"{draw.p('k', -1.0, 1.0)}*x{j}" for j in range(n))
        terms = [f"-x{i}/2", linear, draw.wave(1.0)]
        if draw.chance(0.3):
            terms.append(r.choice((f"sin(x{i})", f"-x{i}**3/4", f"tanh(4*x{r.randrange(n)})")))
        for s in switches:
            if draw.chance(0.8):
                terms.append(
                    f"sign_{s['name']}*({draw.p('f', -2.0, 2.0)}"
                    + (f" + {draw.p('r', 0.0, 0.5)}*x{r.randrange(n)})" if draw.chance(0.3) else ")")
                )
        flows[f"x{i}"] = " + ".join(terms)
    return Declaration(states, tuple(draw.ranges), tuple(draw.inputs), flows=flows, contacts=switches)


def values(declared: Declaration, draw: _Draw, generator: random.Random) -> Values:
    """Numbers for one run of a declaration, which begins outside of walls and not deep inside of stiff stops."""
    while True:
        drawn = _values(declared, draw, generator)
        if all(_may_begin(contact, drawn) for contact in declared.contacts):
            return drawn


def _may_begin(contact: Mapping[str, Any], drawn: Values) -> bool:
    if contact["kind"] not in ("stop", "impact"):
        return True
    known = (
        vars(math)
        | dict(drawn.parameters)
        | dict(drawn.start)
        | {"t": 0.0}
        | {u: x[1][0] for u, x in drawn.inputs.items()}
    )
    gap = eval(contact["gap"], {}, known)
    # a stop that remembers the speed of entry has none if the motion begins inside
    gives = contact["kind"] == "stop" and contact["law"]["name"] == "kelvin_voigt"
    return gap >= 0.0 or (gives and -gap * drawn.parameters[contact["law"]["k"]] < MOST_FORCE)


def _values(declared: Declaration, draw: _Draw, generator: random.Random) -> Values:

    def number(low: float, high: float) -> float:
        return round(generator.uniform(low, high) * GRID) / GRID

    parameters = {}
    for name, spread in draw.ranges.items():
        parameters[name] = float(generator.choice(spread[1:]) if spread[0] == "of" else number(*spread))
    start = {name: number(-0.5, 0.5) for name in declared.states} | {
        name: number(-1.5, 1.5) for name in declared.velocities
    }
    for name, parameter, sign in draw.on_boundary:
        if generator.random() < 0.3:
            level = parameters.get(parameter, 0.0)
            start[name] = -level if sign == "-" else level
            if sign in "+-" and generator.random() < 0.3:
                start[f"v{name[1:]}"] = 0.0
    end = 3.0
    inputs = {}
    for name in declared.inputs:
        inputs[name] = ((0.0, number(0.5, 1.0), number(1.5, 2.0), end), tuple(number(-1.0, 1.0) for _ in range(4)))
    features = tuple((parameters[c], parameters[w]) for c, w in draw.features if w in declared.parameters)
    parameters = {name: parameters[name] for name in declared.parameters}
    return Values(end, parameters, start, inputs, features)
