"""Automata with periodic signals: a converter that was published, and an oscillator pushed by a comparator."""

from __future__ import annotations

from fmu_models import Automaton, Output, Parameter, PeriodicSignal, Reset, State, Switch


def buck() -> Automaton:
    """Buck converter under voltage control: a ramp from 3.8 to 8.2 V every T; the source is on below it."""
    v, i = State("v", "V", "voltage", start=12.0), State("i", "A", "current", start=0.55)
    R, L, C = Parameter("R", 22.0, "ohm", "load"), Parameter("L", 20e-3, "H", "coil"), Parameter("C", 47e-6, "F", "")
    source, f = Parameter("E", 24.0, "V", "source"), Parameter("f", 2500.0, "Hz", "frequency", positive=True)
    gain, wanted = Parameter("a", 8.4, "1", "gain"), Parameter("Vref", 11.3, "V", "wanted voltage")
    low, high = Parameter("low", 3.8, "V", "ramp from"), Parameter("high", 8.2, "V", "ramp to")
    ramp = PeriodicSignal.sawtooth("ramp", "V", "ramp", period=1 / f, low=low, high=high)
    comparator = Switch(name="comparator", function=ramp - gain * (v - wanted), unit="V")
    on = (1 + comparator.sign) / 2
    return Automaton(
        name="buck",
        title="Buck converter",
        source="Fossas and Olivar, IEEE Transactions on Circuits and Systems I 43 (1996)",
        states=[v, i],
        flows={v: (i - v / R) / C, i: (source * on - v) / L},
        switches=[comparator],
        outputs=[Output("ramp_now", ramp, "V", "ramp")],
    )


def pushed() -> Automaton:
    """x'' = -x - 2 d x' + k sgn(s - x) + s, s a signal of four knots with a parameter each."""
    x, v = State("x", "1", "place", start=0.4), State("v", "1", "speed", start=0.1)
    damping, push = Parameter("d", 0.15, "1", "damping"), Parameter("k", 0.5, "1", "push")
    T, start = Parameter("T", 1.7, "s", "period", positive=True), Parameter("t0", 0.3, "s", "start")
    unit = Parameter("tau", 1.0, "s", "unit of time", positive=True)
    places = [0, Parameter("p1", 0.3, "1", "place"), Parameter("p2", 0.3, "1", "place"), 1]
    values = [Parameter(f"s{n}", s, "1", "value") for n, s in enumerate((1.0, -0.4, 0.6, 0.1))]
    s = PeriodicSignal("s", "1", "signal", period=T, knots=list(zip(places, values, strict=True)), start=start)
    side = Switch(name="side", function=s - x)
    return Automaton(
        name="pushed",
        title="Oscillator pushed by a comparator",
        source="test",
        states=[x, v],
        flows={x: v / unit, v: (-x - 2 * damping * v + push * side.sign + s) / unit},
        switches=[side],
        outputs=[Output("s_now", s, "1", "signal")],
    )


def follower() -> Automaton:
    """x' = -2 sgn(x - s) of a ramp s from 0 to 1 each second, and y := x where a clock goes up, at .25, 1.25, ..."""
    x, y = State("x", "1", "follower"), State("y", "1", "what it was at the clock")
    rate = Parameter("rate", 2.0, "1/s", "rate of the follower")
    second, late = Parameter("T", 1.0, "s", "period", positive=True), Parameter("late", 0.25, "s", "start of the clock")
    s = PeriodicSignal.sawtooth("s", "1", "ramp", period=second)
    clock = PeriodicSignal.square("clock", "1", "clock", period=second, low=-1, start=late)
    side, up = Switch(name="side", function=x - s), Switch(name="up", function=clock)
    return Automaton(
        name="follower",
        title="Follower of a ramp",
        source="test",
        states=[x, y],
        flows={x: -rate * side.sign, y: 0 * rate},
        switches=[side, up],
        resets=[Reset(up, "-", {y: x})],
    )
