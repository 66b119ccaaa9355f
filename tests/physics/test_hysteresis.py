"""Forces with memory in a mechanism against other computations: event-split DOP853."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import sympy
from fmpy import simulate_fmu
from quick_export import quick_export
from scipy.integrate import solve_ivp
from sliders import MassOnSliders, N, driven_mass, k, m, x

from fmu_models import (
    BoucWen,
    BoucWenBaberNoori,
    Coordinate,
    Coulomb,
    Dahl,
    Fmu,
    Friction,
    Hysteresis,
    Impact,
    Input,
    KeptRun,
    LuGre,
    MaxwellSlip,
    Mechanism,
    Newton,
    Parameter,
    Play,
    SensitiveRun,
    Signal,
    StickslipError,
    Strobe,
    load,
    simulate,
    simulate_any,
    simulate_with_error,
)
from fmu_models.codegen.lane_tables import lane_obstacles
from fmu_models.families.jobs import Jobs
from fmu_models.lowering.lower import lower

mu = Parameter("mu", 0.3, "1", "friction", minimum=0)
END = 20.0
STATES = ("x", "v")


def bodily(law: object, *beside: object, name: str = "held_mass", **others: object) -> Mechanism:
    """A driven mass on a spring and a force with memory."""
    return driven_mass(name, Hysteresis(name="h", way=others.pop("way", x), law=law, **others), *beside)  # type: ignore[arg-type]


def of_sliders(n: int, *, rubs: bool) -> Mechanism:
    """On n sliders, with dry friction or without."""
    stiffness = [Parameter(f"k{i}", 3 / n, "N/m", "spring", positive=True) for i in range(n)]
    bound = [Parameter(f"D{i}", 0.1 * (i + 1), "m", "bound", positive=True) for i in range(n)]
    friction = [Friction(name="f", slip=x.v, law=Coulomb(N=N, mu=mu))] if rubs else []
    return bodily(MaxwellSlip(k=stiffness, D=bound), *friction, name=f"mass_on_{n}_sliders")


def drawn(rng: np.random.Generator, n: int) -> tuple[dict[str, float], MassOnSliders]:
    """Parameters of `of_sliders`, and the same system by other means."""
    body = {"m": rng.uniform(0.5, 2), "k": rng.uniform(0.2, 2), "a": rng.uniform(1, 6), "w": rng.uniform(0.3, 3)}
    stiffness, bound, rubbing = rng.uniform(0.1, 2, n) * 3 / n, rng.uniform(0.02, 1, n), rng.uniform(0.05, 0.5)
    values = {f"k{i}": value for i, value in enumerate(stiffness)} | {f"D{i}": v for i, v in enumerate(bound)}
    other = MassOnSliders(body["m"], body["k"], stiffness, bound, rubbing, body["a"], body["w"])
    return {**body, **values, "mu": rubbing, "N": 1.0}, other


def ends(run, n: int) -> np.ndarray:
    """States at the end of a run."""
    springs = ["h_z"] if n == 0 else [f"h_z{i + 1}" for i in range(n)]
    return np.array([run[name][-1] for name in (*STATES, *springs)])


@pytest.mark.nightly_for("10", "3")
@pytest.mark.parametrize("n", [1, 3, 10])
def test_sliders_beside_stick_slip_move_as_event_split_integration_says(n: int) -> None:
    """1e-10 of states of order 1, as DOP853 at 1e-13 is itself."""
    run, rng = KeptRun(load(of_sliders(n, rubs=True))), np.random.default_rng(n)
    for _ in range(6):
        values, other = drawn(rng, n)
        start = {"x": rng.uniform(-0.01, 0.01), "v": rng.uniform(-2, 2)}
        expected, changes = other.run(END, start["x"], start["v"])
        assert changes > 5
        assert ends(run(END, parameters=values, start=start), n) == pytest.approx(expected, abs=1e-10)


Rates = Callable[[float, np.ndarray, float, float], list[float]]


def split(rates: Rates, end: float, y: np.ndarray) -> np.ndarray:
    """States at the end: x, v, z and further; the signs of v and z are constant between events."""
    t, signs = 0.0, (np.sign(y[1]), 1.0)
    while t < end:
        events: list = [lambda t, y, i=i, s=s: y[i] * s for i, s in enumerate(signs, 1)]
        for event in events:
            event.terminal, event.direction = True, -1
        run = solve_ivp(
            lambda t, y, signs=signs: rates(t, y, *signs), (t, end), y, "DOP853", events=events, rtol=1e-13, atol=1e-15,
            max_step=0.02,
        )  # fmt: skip
        t, y = run.t[-1], run.y[:, -1]
        signs = tuple(-s if len(hits) else s for s, hits in zip(signs, run.t_events, strict=True))
    return y


def drive(t: float, y: np.ndarray) -> float:
    """All forces but that with memory, at the parameters' defaults."""
    return 2.0 * np.sin(1.3 * t) - y[0]


def of_bouc_wen(n: float) -> Rates:
    def rates(t: float, y: np.ndarray, sv: float, sz: float) -> list[float]:
        z = y[2]
        rate = y[1] - abs(z) ** n * (0.4 * y[1] + 1.1 * sv * y[1] * sz)
        return [y[1], drive(t, y) - 3.0 * z, rate]

    return rates


def of_pinched(t: float, y: np.ndarray, sv: float, sz: float) -> list[float]:
    z, e = y[2], y[3]
    nu, eta = 1 + 0.1 * e, 1 + 0.2 * e
    severity = 0.9 * (1 - np.exp(-1.5 * e))
    width = (0.2 + 0.05 * e) * (0.3 + severity)
    h = 1 - severity * np.exp(-(((z * sv - 0.1 / np.sqrt(nu * 1.5)) / width) ** 2))
    rate = h / eta * (y[1] - nu * z * z * (0.4 * y[1] + 1.1 * sv * sz * y[1]))
    return [y[1], drive(t, y) - 3.0 * z, rate, z * y[1]]


def of_dahl(t: float, y: np.ndarray, sv: float, sz: float) -> list[float]:
    return [y[1], drive(t, y) - 3.0 * y[2], y[1] * (1 - sv * 3.0 * y[2] / 0.8)]


PINCHED = BoucWenBaberNoori(
    k=3.0, beta=1.1, gamma=0.4, n=2, delta_nu=0.1, delta_eta=0.2, zeta_s=0.9, p=1.5, q=0.1, psi=0.2, delta_psi=0.05,
    xi=0.3,
)  # fmt: skip
SMOOTH = {
    "bouc_wen_1": (BoucWen(k=3.0, beta=1.1, gamma=0.4, n=1), of_bouc_wen(1), 3),
    "bouc_wen_2": (BoucWen(k=3.0, beta=1.1, gamma=0.4, n=2), of_bouc_wen(2), 3),
    "bouc_wen_3": (BoucWen(k=3.0, beta=1.1, gamma=0.4, n=3), of_bouc_wen(3), 3),
    "bouc_wen_1.5": (BoucWen(k=3.0, beta=1.1, gamma=0.4, n=1.5), of_bouc_wen(1.5), 3),
    "bouc_wen_2.5": (BoucWen(k=3.0, beta=1.1, gamma=0.4, n=2.5), of_bouc_wen(2.5), 3),
    "pinched": (PINCHED, of_pinched, 4),
    "dahl": (Dahl(sigma=3.0, F_c=0.8), of_dahl, 3),
}


@pytest.mark.parametrize("law", SMOOTH)
def test_smooth_laws_move_as_event_split_integration_says(law: str) -> None:
    """1e-10, as above."""
    declared, rates, count = SMOOTH[law]
    run = simulate(bodily(declared, name=law.replace(".", "_")), END, start={"v": 0.5})
    expected = split(rates, END, np.array([0.0, 0.5, 0.0, 0.0][:count]))
    assert ends(run, 0) == pytest.approx(expected[:3], abs=1e-10)


def test_lugre_without_damping_of_bristles_is_dahl() -> None:
    """The same equations by another door: rounding alone differs."""
    bristles = LuGre(steady=Coulomb(N=N, mu=mu), sigma0=sympy.Float(3.0), sigma1=sympy.S.Zero)
    run = simulate(bodily(bristles, name="bristles"), END, start={"v": 0.5}, parameters={"mu": 0.8})
    dahl = simulate(bodily(SMOOTH["dahl"][0], name="dahl"), END, start={"v": 0.5})
    assert run["x"][-1] == pytest.approx(dahl["x"][-1], abs=1e-11)
    assert run["h_force"][-1] == pytest.approx(dahl["h_force"][-1], abs=1e-11)


@pytest.fixture(scope="module")
def three(tmp_path_factory):
    """On three sliders with dry friction, as a file."""
    return quick_export(of_sliders(3, rubs=True), tmp_path_factory.mktemp("sliders") / "three.fmu")


@pytest.fixture(scope="module")
def case():
    """Parameters, start, and the states at the end, by other means."""
    values, other = drawn(np.random.default_rng(8), 3)
    start = {"x": 0.01, "v": 1.5}
    return values, start, other.run(END, *start.values())[0]


@pytest.mark.nightly_for("CoSimulation")
@pytest.mark.parametrize("kind", ["CoSimulation", "ModelExchange"])
def test_importers_come_to_the_same_end(three, case, kind: str) -> None:
    """At their tolerances: a master's own errors (1e-9 a step), and CVode's."""
    values, start, expected = case
    names = ["x", "v", "h_z1", "h_z2", "h_z3"]
    run = simulate_fmu(
        three, stop_time=END, start_values=values | start, output=names, fmi_type=kind, relative_tolerance=1e-9
    )
    assert np.array([run[name][-1] for name in names]) == pytest.approx(expected, abs=1e-6)
    ours = simulate_any(three, END, parameters=values, start=start)
    assert [ours[name][-1] for name in names] == pytest.approx(expected.tolist(), abs=1e-8)


def test_derivatives_pass_through_yielding(three, case) -> None:
    """Against central differences of whole runs: 1e-7 by their steps of 1e-5."""
    values, start, _ = case
    by = ["k0", "D0", "D1", "a", "mu", "v", "h_z2"]
    with SensitiveRun(Fmu.open(three), by=by, recorded=["x", "h_force"]) as kept:
        run = kept.run([END], parameters=values, start=start)
    plain, step = KeptRun(Fmu.open(three)), 1e-5
    for column, name in enumerate(by):
        given = {**values, **start, "h_z2": 0.0}
        near = []
        for sign in (1, -1):
            moved = given | {name: given[name] + sign * step}
            end = plain(
                END,
                parameters={name: moved[name] for name in values},
                start={name: moved[name] for name in ("x", "v", "h_z2")},
            )
            near.append(np.array([end["x"][-1], end["h_force"][-1]]))
        differences = (near[0] - near[1]) / (2 * step)
        assert run.derivative[0, :, column] == pytest.approx(differences, abs=2e-7, rel=1e-6)


def test_what_leaves_the_body_is_booked(three, case) -> None:
    """E' = power_input - power_dissipated, integrated by Simpson's rule over 1e-3 s: 1e-7."""
    values, start, _ = case
    times = np.linspace(0.0, END, 20001)
    run = simulate(Fmu.open(three), END, parameters=values, start=start, output_times=times)
    power = run["power_input"] - run["power_dissipated"]
    gained = np.concatenate([[0.0], np.cumsum(power[:-1] + power[1:]) / 2 * (times[1] - times[0])])
    # the trapezium rule misses (1e-3)^2/12 times the change of the power's rate
    assert run["energy"] - run["energy"][0] == pytest.approx(gained, abs=1e-5)


def test_a_spring_beyond_its_bound_yields_at_once() -> None:
    """Back to the bound at unit rate: 1e-3 m in 1e-3 s while the way stands."""
    still = bodily(MaxwellSlip(k=[3.0], D=[0.2]), name="beyond")
    run = simulate(still, 2.0, start={"h_z1": 0.2001}, parameters={"a": 0.0, "k": 0.0, "m": 1e9})
    assert run["h_z1"][-1] == pytest.approx(0.2, abs=1e-8)  # the body of 1e9 kg moves by so much
    assert run.events[0].time == pytest.approx(1e-4, rel=1e-3)


def test_a_way_turns_where_its_speed_is_rounding() -> None:
    """The speeds of the body and of a moving support cancel: with other steps the yielding ended and began for ever."""
    u = Input("u", 0.0, "m", "support")
    law = MaxwellSlip(k=[3.140625], D=[0.25])
    rubs = Friction(name="f", slip=x.v, law=Coulomb(N=N, mu=mu), where=Parameter("d", 0.609375, "m", "edge") + x)
    model = load(bodily(law, rubs, name="supported", way=x - Parameter("b", -0.28125, "1", "share") * u))
    polygon = Signal((0.0, 0.671875, 1.515625, 3.0), (0.546875, 0.328125, 0.140625, -1.0))
    for mass in np.linspace(0.5, 1.5, 40):
        values = {"m": mass, "k": 2.09375, "a": 0.0, "N": 0.25, "mu": 0.6}
        start = {"x": -0.484375, "v": -0.90625}
        run, estimate = simulate_with_error(model, 3.0, parameters=values, start=start, inputs={"u": polygon})
        assert len(run.events) > 2
        assert estimate.relative < 1e-9


def test_a_wall_turns_the_way_at_once() -> None:
    """A rigid wall beside: each impact ends the yielding. Against pieces between events by other means."""
    wall = Impact(name="wall", gap=0.3 - x, restitution=Newton(e=0.8))
    run = simulate(bodily(MaxwellSlip(k=[3.0], D=[0.05]), wall, name="walled"), 6.0, start={"v": 2.0})
    t, y, impacts = 0.0, np.array([0.0, 2.0, 0.0]), 0
    while t < 6.0:
        sense = np.sign(y[1])
        yields = sense * y[2] >= 0.05 - 1e-12
        events = [lambda t, y: 0.3 - y[0], lambda t, y, s=sense: s * y[1]]
        events += [] if yields else [lambda t, y, s=sense: 0.05 - s * y[2]]
        for event in events:
            event.terminal, event.direction = True, -1
        piece = solve_ivp(
            lambda t, y, held=yields: [y[1], drive(t, y) - 3.0 * y[2], 0.0 if held else y[1]],
            (t, 6.0), y, "DOP853", events=events, rtol=1e-13, atol=1e-15, max_step=0.02,
        )  # fmt: skip
        t, y = piece.t[-1], piece.y[:, -1].copy()
        if len(piece.t_events[0]):
            y[0], y[1], impacts = 0.3, -0.8 * y[1], impacts + 1
        elif len(piece.t_events[1]):
            y[1] = -sense * 1e-300
        elif t < 6.0:
            y[2] = sense * 0.05
    assert impacts == 2
    assert ends(run, 1) == pytest.approx(y, abs=1e-10)


def test_a_way_between_many_bodies_with_a_mass_matrix_that_is_factored() -> None:
    """A chain whose masses are coupled by inertia: the same in coordinates in which they are not."""
    q = [Coordinate(f"q{i}", "m", f"place {i}", velocity=f"u{i}", v_start=1.0 if i == 0 else 0.0) for i in range(4)]

    def chain(name: str, places: list, way: object) -> Mechanism:
        speeds = [sympy.Add(*(sympy.diff(place, c) * c.v for c in q)) for place in places]
        law = MaxwellSlip(k=[2.0, 1.0], D=[0.05, 0.2])
        rubs = Friction(name="f", slip=speeds[2], law=Coulomb(N=N, mu=mu))
        return Mechanism(
            name=name,
            title="chain",
            source="test",
            coordinates=q,
            kinetic_energy=sympy.Add(*(m * v**2 / 2 for v in speeds)),
            potential_energy=sympy.Add(*(k * (b - c) ** 2 / 2 for b, c in zip(places, [0, *places], strict=False))),
            contacts=[Hysteresis(name="h", way=way, law=law), rubs],
        )

    apart = simulate(chain("apart", list(q), q[3] - q[1]), 8.0)
    # places are sums of steps: the mass matrix is full
    sums = [sum(q[: i + 1]) for i in range(4)]
    coupled = simulate(chain("coupled", sums, sums[3] - sums[1]), 8.0, start={"u1": -1.0})
    assert sum(coupled[f"q{i}"][-1] for i in range(4)) == pytest.approx(apart["q3"][-1], abs=1e-11)
    assert coupled["h_z1"][-1] == pytest.approx(apart["h_z1"][-1], abs=1e-11)
    assert len(coupled.events) == len(apart.events) > 10


@pytest.mark.nightly
def test_one_slider_is_followed_in_lanes() -> None:
    """Piecewise linear with few modes; more sliders have more modes than there are tables for."""
    assert "modes" in lane_obstacles(lower(of_sliders(3, rubs=False)))[0]
    model, period = of_sliders(1, rubs=False), 2 * np.pi / 1.3
    starts = np.array([[0.0, 0.5 + 0.1 * i, 0.0] for i in range(8)])
    rows = Strobe(load(model), period=period).run(Jobs(starts, {}, transient=11, rows=1), np.zeros(1, np.int32))
    assert rows.in_lanes.tolist() == [12] * 8
    run = KeptRun(load(model))
    for start, point in zip(starts, rows.points[:, 0], strict=True):
        end = run(12 * period, start=dict(zip(("x", "v", "h_z1"), start, strict=True)))
        assert point == pytest.approx(ends(end, 1), abs=1e-10)


def behind_a_play(end: float, y: np.ndarray, width: float, sigma: float, F_c: float) -> np.ndarray:
    """x, v, what the play has taken up and Dahl's elongation at the end: free or at a side of the play by turns."""
    t, side = 0.0, 0.0
    while t < end:

        def moved(t: float, y: np.ndarray, side: float = side) -> list[float]:
            push = drive(t, y) - sigma * y[3]
            held = side * side
            return [y[1], push, (1 - held) * y[1], held * y[1] * (1 - side * sigma * y[3] / F_c)]

        over: list = [lambda t, y, s=s: s * y[2] - width for s in (1, -1)]
        if side:
            over = [lambda t, y, side=side: -side * y[1]]
        for event in over:
            event.terminal, event.direction = True, 1
        run: Any = solve_ivp(moved, (t, end), y, "DOP853", events=over, rtol=1e-13, atol=1e-15, max_step=0.02)
        t, y = run.t[-1], run.y[:, -1]
        side = 0.0 if side else float(np.sign(y[2]))
    return y


def test_a_body_on_a_backlash_before_a_smooth_law_moves_as_event_split_integration_says() -> None:
    """States to 1e-10, their derivatives to the 1e-7 of differences of the other integration by 1e-5."""
    names = ("x", "v", "h_play", "h_z")
    begin, values = np.array([0.0, 1.0, 0.0, 0.0]), {"width": 0.3, "sigma": 3.0, "F_c": 0.8}
    units = {"width": "m", "sigma": "N/m", "F_c": "N"}
    w, sigma, F_c = (Parameter(name, value, units[name], name, positive=True) for name, value in values.items())
    model = load(bodily(Play(law=Dahl(sigma=sigma, F_c=F_c), w=w), name="mass_on_backlash"))
    run = KeptRun(model)(END, start={"v": 1.0})
    assert [run[name][-1] for name in names] == pytest.approx(behind_a_play(END, begin, **values), abs=1e-10)
    assert len(run.events) > 10
    with SensitiveRun(model, by=list(values), recorded=names) as kept:
        derivative = kept.run([END], start={"v": 1.0}).derivative[0]
    for column, name in enumerate(values):
        near = [behind_a_play(END, begin, **values | {name: values[name] + step}) for step in (1e-5, -1e-5)]
        assert derivative[:, column] == pytest.approx((near[0] - near[1]) / 2e-5, abs=2e-7, rel=1e-6)


@pytest.mark.parametrize(
    ("declare", "said"),
    [
        (lambda: MaxwellSlip(k=[1.0], D=[0.1, 0.2]), "1 stiffnesses and 2 bounds"),
        (lambda: BoucWen(k=1.0, beta=1.0, gamma=0.0, n=1.3), "must be 1, 1.5, 2"),
        (lambda: Play(law=LuGre(Coulomb(N=N, mu=mu), sigma0=1.0, sigma1=0.0), w=0.1), "Play stands before a law"),  # type: ignore[arg-type]
        (lambda: bodily(Coulomb(N=N, mu=mu)), "Coulomb is no law with memory"),
        (lambda: bodily(Dahl(sigma=1.0, F_c=1.0), way=x.v), "it says where the contact is"),
        (lambda: bodily(MaxwellSlip(k=[k], D=[Parameter("D", 0.1, "rad/s", "bound")])), "'h_upper'"),
        (lambda: bodily(MaxwellSlip(k=[m], D=[Parameter("D", 0.1, "m", "bound")])), "the force of contact 'h'"),
    ],
)
def test_what_is_no_law_with_memory_is_said(declare: Callable[[], object], said: str) -> None:
    with pytest.raises(StickslipError, match=said):
        declare()


def test_a_bound_that_is_no_room_is_refused() -> None:
    declared = bodily(MaxwellSlip(k=[k], D=[Parameter("D", 0.1, "m", "bound")]), name="no_room")
    with pytest.raises(StickslipError, match="D must be positive: contact 'h' yields there"):
        simulate(declared, 1.0, parameters={"D": 0.0})
