"""Phase planes against closed forms: cycles of both kinds, sliding, points of rest, what manifolds come to."""

from __future__ import annotations

import json
import math
from functools import cache
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure
from wells import well

from fmu_models import Automaton, Fmu, Parameter, State, StickslipError, Switch, load, phase_plane


@cache
def planar(name: str, **parts: Any) -> Fmu:
    """x' = f, y' = g, made of x, y and of the sign of y."""
    x, y = State("x", "1", "x", start=0.1), State("y", "1", "y", start=0.1)
    side = Switch(name="side", function=y)
    rate = Parameter("rate", 1.0, "1/s", "rate", positive=True)
    flows = FLOWS[name](x, y, side.sign)
    switches = [side] if any(flow.has(side.sign) for flow in flows) else []
    declared: Any = {x: rate * flows[0], y: rate * flows[1]}
    return load(Automaton(name=name, title=name, source="here", states=[x, y], flows=declared, switches=switches))


def _rings(x, y, _):
    growth = (x**2 + y**2 - 1) * (4 - x**2 - y**2) / 50
    return growth * x - 2 * y, growth * y + 2 * x


FLOWS: dict[str, Any] = {
    "two_rings": _rings,
    "spring": lambda x, y, _: (y, -9 * x),
    "slide": lambda x, y, s: (0.3 - x + 0.2 * s, x - s),
    "joined": lambda x, y, s: (y, -9 * x + s * y**3),
    "leave": lambda x, y, s: (-0.3 + x - 0.2 * s, s - x),
}


def test_cycles_are_found_stable_or_not():
    """r' = r (r^2 - 1)(4 - r^2)/50 at two turns a 2 pi: cycles at 1 and 2."""
    plane = phase_plane(planar("two_rings"))
    (rest,) = plane.rests
    assert rest.kind == "stable focus" and rest.eigenvalues == pytest.approx([-0.08 + 2j, -0.08 - 2j], abs=1e-12)
    found = sorted((cycle.high[0], cycle.multiplier, cycle.period, cycle.stable) for cycle in plane.cycles)
    growths = [(1.0, 6.0 / 50.0, False), (2.0, -24.0 / 50.0, True)]
    for (radius, multiplier, period, stable), (r, slope, kind) in zip(found, growths, strict=True):
        assert radius == pytest.approx(r, rel=1e-12) and stable is kind
        assert multiplier == pytest.approx(math.exp(math.pi * slope), rel=1e-10)
        assert period == pytest.approx(math.pi, rel=1e-12)


def test_motions_about_a_centre_are_no_cycles_of_their_own():
    plane = phase_plane(planar("spring"), box={"x": (-1.0, 1.0), "y": (-3.0, 3.0)})
    assert [rest.kind for rest in plane.rests] == ["centre"] and not plane.cycles
    ((low, high),) = plane.centres
    assert low < 1e-4 and high == pytest.approx(1.0)


def test_a_surface_across_which_slopes_are_the_same_says_nothing_of_a_point_of_rest():
    (rest,) = phase_plane(planar("joined"), box={"x": (-0.1, 0.1), "y": (-0.1, 0.1)}, lines=1).rests
    assert rest.kind == "centre" and rest.eigenvalues == pytest.approx([3j, -3j], abs=1e-12)


@pytest.mark.parametrize(("name", "attracts"), [("slide", True), ("leave", False)])
def test_a_surface_that_attracts_and_its_reverse(name, attracts):
    """On y = 0 the sign is x, for |x| < 1: x' = .3 - .8 x. The other flow is this one backward."""
    plane = phase_plane(planar(name), box={"x": (-2.0, 3.0), "y": (-1.0, 1.0)})
    (part,) = plane.slidings
    assert part.attracting is attracts and part.contact == "side"
    assert sorted(part.points[[0, -1], 0]) == pytest.approx([-1.0, 1.0], abs=1e-9)
    assert np.abs(part.points[:, 1]).max() < 1e-12
    (rest,) = [rest for rest in plane.rests if "pseudo" in rest.kind]
    assert rest.kind == f"{'stable' if attracts else 'unstable'} pseudo-equilibrium"
    assert rest.point == pytest.approx([0.375, 0.0], abs=1e-9)
    assert rest.eigenvalues == pytest.approx([-0.8 if attracts else 0.8], rel=1e-6)


def test_a_block_at_rest_has_a_set_that_sticks():
    """mu N / k both sides of where the spring is free; no belt moves."""
    block = load("block_on_belt")
    plane = phase_plane(block, parameters={"v_belt": 0.0})
    ends = [rest for rest in plane.rests if rest.kind == "end of a set that sticks"]
    values = {name: block.start_of(name) for name in block.parameters}
    reach = values["mu_s"] * values["N"] / values["k"]
    assert [rest.point[0] for rest in ends] == pytest.approx([-reach, reach], rel=1e-8)
    assert all(rest.stable for rest in ends) and not plane.cycles


def test_the_manifolds_of_a_saddle_come_to_what_is_there():
    plane = phase_plane(well(), box={"x": (-2.0, 2.0), "v": (-2.0, 2.0)})
    assert [rest.kind for rest in plane.rests] == ["stable focus", "saddle", "stable focus"]
    assert plane.points[:, 0] == pytest.approx([-1.0, 0.0, 1.0], abs=1e-12)
    ends = {half.end for half in plane.manifolds if half.kind == "unstable"}
    assert ends == {"comes to the stable focus at (-1, 0)", "comes to the stable focus at (1, 0)"}


def test_what_is_said_and_drawn():
    plane = phase_plane(planar("two_rings"), lines=3)
    assert "unstable cycle of 3.14159 s" in plane.summary()
    said = json.loads(json.dumps(plane.record()))
    assert [cycle["stable"] for cycle in said["cycles"]] == [cycle.stable for cycle in plane.cycles]
    assert list(plane.frame.columns) == ["kind", "x", "y"]
    axes = Figure().subplots()
    plane.plot(axes)
    legend = axes.get_legend()
    assert legend is not None
    drawn = {text.get_text(): line.get_linestyle() for text, line in zip(legend.texts, legend.get_lines(), strict=True)}
    assert [drawn[f"{kind} cycle of 3.14159 s"] for kind in ("stable", "unstable")] == ["-", "--"]
    assert sum(line.get_color() == "0.75" for line in axes.lines) >= 9


@pytest.mark.parametrize(
    ("model", "how", "why"),
    [
        ("forced_stick_slip", {}, r"is forced.*Set the amplitude of the force to zero"),
        ("woodpecker", {}, r"has 6 states .* a phase plane is of two"),
        ("planar_hopf", {"box": {"x1": (1.0, -1.0)}}, "'x1' must be two ascending numbers"),
        ("planar_hopf", {"box": {"y": (0.0, 1.0)}}, r"has no state 'y'"),
        ("planar_hopf", {"parameters": {"nu": 1.0}}, r"'nu'"),
    ],
)
def test_what_has_no_phase_plane_is_refused(model, how, why):
    with pytest.raises(StickslipError, match=why):
        phase_plane(load(model), **how)
