"""Piecewise linear motions over ten periods, in lanes and one by one, against closed forms of 40 digits."""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np
import pytest
from forty_digits import Field, Guard, Mode, follow

from fmu_models.families.jobs import Jobs
from fmu_models.fmu.load import load
from fmu_models.sections.strobe import Strobe
from fmu_models.simulation.run import KeptRun

pytestmark = pytest.mark.digits

GO = np.zeros(1, np.int32)
PERIODS = 10


def support(p: dict[str, Any]) -> dict[str, Mode]:
    k, c, f0, w, ks, cs, g = (p[name] for name in ("k", "c", "f0", "omega", "ks", "cs", "g"))
    return {
        "free": Mode(Field(c, k, 0, f0, w), (Guard(lambda t, x, v, m: g - x, lambda t, x, v: ("on", g, v)),)),
        "on": Mode(
            Field(c + cs, k + ks, ks * g, f0, w),
            (Guard(lambda t, x, v, m: ks * (x - g) + cs * v, lambda t, x, v: ("off", x, v)),),
        ),
        # it has let go and is not yet back
        "off": Mode(Field(c, k, 0, f0, w), (Guard(lambda t, x, v, m: x - g, lambda t, x, v: ("free", g, v)),)),
    }


def wall(sign: int, place: Any, speed: Any, e: Any) -> Guard:
    """A wall on one side of a particle, at place(t, functions)."""
    return Guard(
        lambda t, x, v, m: sign * (place(t, m) - x),
        lambda t, x, v: ("free", place(t, mpmath), -e * v + (1 + e) * speed(t, mpmath)),
    )


def ball(p: dict[str, Any]) -> dict[str, Mode]:
    A, w, e = p["A"], p["omega"], p["e"]
    table = wall(-1, lambda t, m: A * m.sin(w * t), lambda t, m: A * w * m.cos(w * t), e)
    return {"free": Mode(Field(b=-p["g"]), (table,))}


def pair(p: dict[str, Any]) -> dict[str, Mode]:
    A, w, e, D = p["A"], p["omega"], p["e"], p["D"]
    walls = (
        wall(s, lambda t, m, s=s: A * m.sin(w * t) + s * D / 2, lambda t, m: A * w * m.cos(w * t), e) for s in (1, -1)
    )
    return {"free": Mode(Field(), tuple(walls))}


def fermi(p: dict[str, Any]) -> dict[str, Mode]:
    A, w, e, L = p["A"], p["omega"], p["e"], p["L"]
    moving = wall(-1, lambda t, m: A * m.sin(w * t), lambda t, m: A * w * m.cos(w * t), e)
    return {"free": Mode(Field(), (moving, wall(1, lambda t, m: L, lambda t, m: 0, 1)))}


def domains(p: dict[str, Any]) -> dict[str, Mode]:
    sides = {}
    for name, other, sign, i in (("left", "right", -1, 1), ("right", "left", 1, 2)):
        field = Field(2 * p["d"], p[f"w{i}"] ** 2, p[f"b{i}"], p[f"Q{i}"], p["W"])
        leaves = Guard(lambda t, x, v, m, s=sign: s * x, lambda t, x, v, o=other: (o, mpmath.mpf(0), v))
        sides[name] = Mode(field, (leaves,))
    return sides


# model: its modes; the first; forcing; values that are not its defaults; what is varied, and over which range
SYSTEMS = {
    "discontinuous_support": (support, "free", "omega", {"ks": 300.0, "cs": 0.6, "g": 1.6}, "omega", (0.8, 1.0)),
    "bouncing_ball": (ball, "free", "omega", {}, "A", (2.7e-3, 3.7e-3)),
    "impact_pair": (pair, "free", "omega", {}, "D", (4.0, 9.0)),
    "fermi_accelerator": (fermi, "free", "omega", {}, "L", (50.0, 110.0)),
    "two_domain_oscillator": (domains, "right", "W", {}, "w2", (1.2, 1.9)),
}
LANES = 16


def errors_of(name: str, lanes: int, *, alone: bool = False) -> np.ndarray[Any, Any]:
    """(lanes,) of the point after ten periods, in parts of the largest of its numbers; or of as many runs alone."""
    modes, first, forcing, values, varied, (low, high) = SYSTEMS[name]
    fmu = load(name)
    system = Strobe(fmu, forcing=forcing, parameters=values)
    start = system.start({"x": 0.0, "v": 0.0} if name == "discontinuous_support" else {})
    over = np.linspace(low, high, lanes)
    made = np.empty((lanes, 2))
    if not alone:
        rows = system.run(Jobs(np.tile(start, (lanes, 1)), {varied: over}, transient=PERIODS - 1, rows=1), GO)
        assert rows.in_lanes.tolist() == [PERIODS] * lanes
        made = rows.points[:, 0]
    found = np.empty((lanes, 2))
    for i, one in enumerate(over.tolist()):
        given = {n: float(fmu.variables[n].start or 0.0) for n in fmu.parameters} | values | {varied: one}
        # the period as the engine has it
        period = 2.0 * np.pi / given[forcing]
        found[i] = follow(modes, given, (first, *start.tolist()), period, PERIODS)
        if alone:
            end = PERIODS * period
            began = dict(zip(fmu.states, start.tolist(), strict=True))
            run = KeptRun(fmu)(end, parameters={**values, varied: one}, start=began, output_times=[end])
            made[i] = [run[state][-1] for state in fmu.states]
    return np.abs(made - found).max(axis=1) / np.abs(found).max(axis=1)


@pytest.mark.nightly_for("two_domain_oscillator", "fermi_accelerator")
@pytest.mark.parametrize("name", SYSTEMS)
def test_ten_periods_are_those_of_forty_digits(name):
    errors = errors_of(name, LANES)
    assert np.median(errors) < 5e-14
    assert errors.max() < 1e-11


@pytest.mark.nightly_for("two_domain_oscillator", "fermi_accelerator")
@pytest.mark.parametrize("name", SYSTEMS)
def test_runs_alone_are_those_of_forty_digits(name):
    """Their steps are sums that are probed once per mode."""
    errors = errors_of(name, 4, alone=True)
    assert np.median(errors) < 5e-14
    assert errors.max() < 1e-11
