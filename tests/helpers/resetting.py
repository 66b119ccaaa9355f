"""Automata whose resets have closed forms, each with the parameters that these use."""

from __future__ import annotations

from typing import Any

import sympy

from fmu_models import TIME, Automaton, Input, Parameter, Reset, State, Switch


def neuron() -> Automaton:
    """Leaky integrate-and-fire: V' = I + A cos(omega t) - V, and V := 0 where V comes to 1."""
    V = State("V", "1", "potential", start=0.1)
    current, amplitude = Parameter("I", 1.2, "1", "current"), Parameter("A", 0.0, "1", "amplitude")
    omega = Parameter("omega", 3.9269908169872414, "rad/s", "frequency of the drive")
    unit = Parameter("tau", 1.0, "s", "time constant")
    spike = Switch(name="spike", function=1 - V, description="threshold")
    flow = (current + amplitude * sympy.cos(omega * TIME) - V) / unit
    return _automaton("neuron", {V: flow}, spike, Reset(spike, "+", {V: sympy.S.Zero}))


def wheel() -> Automaton:
    """Rimless wheel on a slope gamma: q'' = sin q from gamma - alpha to gamma + alpha, where the next spoke lands."""
    q, w = State("q", "rad", "angle", start=0.0), State("w", "rad/s", "rate", start=0.5)
    alpha, gamma = Parameter("alpha", 0.2, "rad", "half the angle"), Parameter("gamma", 0.08, "rad", "slope")
    pull = Parameter("p2", 1.0, "1/s2", "gravity over length")
    spoke = Switch(name="spoke", function=gamma + alpha - q, unit="rad", description="next spoke")
    return _automaton(
        "wheel",
        {q: w, w: pull * sympy.sin(q)},
        spoke,
        Reset(spoke, "+", {q: q - 2 * alpha, w: w * sympy.cos(2 * alpha)}),
    )


def block() -> Automaton:
    """Rocking block: x'' = p^2 (x - sgn x) + A sin(omega t), and v := r v where x comes to zero."""
    x, v = State("x", "1", "tilt", start=0.3), State("v", "1/s", "rate")
    stiffness, keeps = Parameter("p2", 1.0, "1/s2", "p^2"), Parameter("r", 0.5, "1", "what an impact leaves of v")
    push, omega = Parameter("A", 0.0, "1/s2", "amplitude"), Parameter("omega", 0.2, "rad/s", "frequency")
    foot = Switch(name="foot", function=x, description="both corners down")
    flow = stiffness * (x - foot.sign) + push * sympy.sin(omega * TIME)
    return _automaton("block", {x: v, v: flow}, foot, Reset(foot, "both", {v: keeps * v}))


def ball(sense: int = 1) -> Automaton:
    """Ball over a table that shakes, or below a ceiling of the same motion (sense -1), with a lift as input."""
    z, w = State("z", "m", "height", start=1.0 * sense), State("w", "m/s", "speed")
    gravity, e = Parameter("g", 10.0, "m/s2", "gravity"), Parameter("e", 0.5, "1", "restitution")
    shake, omega = Parameter("a", 0.0, "m", "amplitude"), Parameter("omega", 3.0, "rad/s", "frequency")
    lift = Input("lift", 0.0, "m/s2", "force on the ball by its mass")
    wall, speed = shake * sympy.sin(omega * TIME), shake * omega * sympy.cos(omega * TIME)
    table = Switch(name="table", function=z - wall, unit="m", description="where it lands")
    bounce = Reset(table, "+" if sense > 0 else "-", {w: w - (1 + e) * (w - speed)})
    return _automaton(f"ball{'' if sense > 0 else '_below'}", {z: w, w: sense * (lift - gravity)}, table, bounce)


def _automaton(name: str, flows: Any, switch: Switch, reset: Reset) -> Automaton:
    return Automaton(
        name=name, title=name, source="closed form", states=list(flows), flows=flows, switches=[switch], resets=[reset]
    )
