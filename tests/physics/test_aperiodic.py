"""What motions without a period are: maps and flows whose exponents and kinds are known."""

from __future__ import annotations

import math

import numpy as np
import pytest
import sympy

from fmu_models import Automaton, Fmu, Iteration, Parameter, State, Strobe, Switch, basins, orbit_diagram
from fmu_models.analyses.aperiodic import CHAOS, NOT_DECIDED, STRANGE, TORUS, judged, sign_of
from fmu_models.analyses.basins import Basins
from fmu_models.analyses.chart import chart
from fmu_models.analyses.clouds import Cloud
from fmu_models.codegen.package import built_of
from fmu_models.families.execution import Execution, Runner
from fmu_models.language.maps import Map
from fmu_models.lowering.lower import lower
from fmu_models.maps.henon import MAP as HENON
from fmu_models.maps.logistic import MAP as LOGISTIC
from fmu_models.maps.tent import MAP as TENT
from fmu_models.sections.iteration import iterate

GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)


def delayed_logistic() -> Map:
    """Aronson, Chory, Hall, McGehee 1982: an invariant circle is born at a = 2; at 2.27 there is chaos."""
    a = Parameter("a", 2.1, "1", "growth")
    x, y = State("x", "1", "now", start=0.5), State("y", "1", "before", start=0.5)
    return Map(
        name="delayed_logistic", title="delayed", source="Aronson 1982", states=[x, y],
        rule={x: a * x * (1 - y), y: x}, box={x: (0.0, 1.2), y: (0.0, 1.2)},
    )  # fmt: skip


def gopy() -> Map:
    """Grebogi, Ott, Pelikan, Yorke 1984, sigma = 1.5: a strange attractor whose exponents are 0 and negative."""
    sigma, w = Parameter("sigma", 1.5, "1", "strength"), Parameter("w", GOLDEN, "1", "turns in a step")
    x, t = State("x", "1", "x", start=0.5), State("t", "1", "phase", start=0.1)
    return Map(
        name="gopy", title="driven", source="Grebogi 1984", states=[x, t],
        rule={x: 2 * sigma * sympy.tanh(x) * sympy.cos(2 * sympy.pi * t), t: t + w},
        box={x: (-3.0, 3.0), t: (0.0, 1.0)}, modulus={t: sympy.Integer(1)},
    )  # fmt: skip


def driven_logistic() -> Map:
    """Heagy, Hammel 1994: x -> r (1 + e cos 2 pi t) x (1 - x): a smooth curve over t where r is small."""
    r, w = Parameter("r", 2.5, "1", "growth"), Parameter("w", GOLDEN, "1", "turns in a step")
    x, t = State("x", "1", "x", start=0.5), State("t", "1", "phase", start=0.1)
    return Map(
        name="driven_logistic", title="driven", source="Heagy 1994", states=[x, t],
        rule={x: r * (1 + sympy.cos(2 * sympy.pi * t) / 10) * x * (1 - x), t: t + w},
        box={x: (0.0, 1.0), t: (0.0, 1.0)}, modulus={t: sympy.Integer(1)},
    )  # fmt: skip


def kinds(found: Basins) -> list[str]:
    return [one.word if isinstance(one, Cloud) else str(one.period) for one in found.attractors]


@pytest.mark.nightly_for("delayed torus", "strange without chaos")
@pytest.mark.parametrize(
    ("system", "kind", "exponent"),
    [
        (Iteration.of(HENON), CHAOS, 0.41922),
        (Iteration.of(LOGISTIC, {"r": 4.0}), CHAOS, math.log(2.0)),
        (Iteration.of(delayed_logistic()), TORUS, 0.0),
        (Iteration.of(delayed_logistic(), {"a": 2.27}), CHAOS, None),
        (Iteration.of(gopy()), STRANGE, None),
        (Iteration.of(driven_logistic()), TORUS, None),
        (Iteration.of(driven_logistic(), {"r": 3.6}), CHAOS, None),
        # where flips accumulate
        (Iteration.of(LOGISTIC, {"r": 3.569945672}), NOT_DECIDED, 0.0),
    ],
    ids=[
        "henon",
        "logistic",
        "delayed torus",
        "delayed chaos",
        "strange without chaos",
        "driven torus",
        "driven chaos",
        "feigenbaum",
    ],
)
def test_kinds_of_maps(system, kind, exponent):
    point = iterate(system, system.start({"x": 0.3}), 3000)[-1]
    verdict = judged(Runner(system), system, point)
    assert verdict.kind == kind, verdict
    if exponent is not None:
        assert abs(verdict.exponent - exponent) < 5.0 * verdict.error + 1e-3
    assert (verdict.sign == "positive") == (kind == CHAOS)


def test_an_exponent_has_a_sign_beyond_its_error_alone():
    given = [(0.02, 0.003), (0.02, 0.005), (-0.02, 0.003), (-np.inf, 0.0), (2e-4, 1e-4), (2e-4, 1e-3), (np.nan, np.inf)]
    signs = ["positive", NOT_DECIDED, "negative", "negative", "zero", NOT_DECIDED, NOT_DECIDED]
    assert [sign_of(*one) for one in given] == signs


def test_basins_say_what_has_no_period():
    system = Iteration.of(delayed_logistic())
    found = basins(system, x=np.linspace(0.4, 0.6, 3), y=np.linspace(0.4, 0.6, 3), most=500)
    assert kinds(found) == [TORUS]
    assert (found.labels == 0).all()
    legend = found.plot().get_legend()
    assert legend is not None and {text.get_text() for text in legend.get_texts()} == {"torus (100 %)"}


@pytest.mark.parametrize("slope", [2.0001, 2.0002])
def test_chaos_that_does_not_last_has_a_lifetime(slope):
    """Of all points of the unit interval a share of 2/s stays in it each step, evenly spread: 1/ln(s/2) steps."""
    starts = np.linspace(0.11, 0.87, 24)
    found = basins(Iteration.of(TENT, {"s": slope}), x=starts)
    (transient,) = found.transients
    assert abs(transient.lifetime - 1 / math.log(slope / 2)) < 3.0 * transient.error < 0.7 * transient.lifetime
    assert not found.attractors and (found.labels != -1).sum() >= 20
    assert f"{transient.lifetime:.3g} +- {transient.error:.1g} steps" in str(found)
    assert not basins(Iteration.of(TENT, {"s": 1.9999}), x=starts).transients


def test_intermittent_chaos_and_chaos_beside_a_cycle_last():
    """Below 1 + sqrt(8) laminar for long, and again and again; Henon's at 1.07 of four pieces beside six points."""
    laminar = basins(Iteration.of(LOGISTIC, {"r": 3.8282}), x=np.linspace(0.1, 0.9, 9))
    beside = basins(Iteration.of(HENON, {"a": 1.07}), x=np.linspace(-0.5, 0.5, 9), y=[0.0, 0.1])
    assert (kinds(laminar), kinds(beside)) == ([CHAOS], ["6", CHAOS])
    assert not laminar.transients and not beside.transients


def chua() -> Automaton:
    """Matsumoto, Chua, Komuro 1985; alpha = 8: two cycles, mirror images of one another."""
    al, be = Parameter("al", 8.0, "1/s", "alpha"), Parameter("be", 100 / 7, "1/s", "beta")
    m0, m1 = Parameter("m0", -1 / 7, "1", "inner slope"), Parameter("m1", 2 / 7, "1", "outer slope")
    rate = Parameter("rate", 1.0, "1/s", "rate", positive=True)
    x, y, z = (State(name, "1", name, start=start) for name, start in (("x", 0.1), ("y", 0.0), ("z", 0.0)))
    up, down = Switch(name="up", function=x - 1), Switch(name="down", function=x + 1)
    h = m1 * x + (m0 - m1) / 2 * (down.abs - up.abs)
    flows = {x: al * (y - h), y: rate * (x - y + z), z: -be * y}
    states, switches = [x, y, z], [up, down]
    return Automaton(name="chua", title="Chua", source="Matsumoto", states=states, flows=flows, switches=switches)


@pytest.mark.nightly_for("not said")
@pytest.mark.parametrize("autonomous", [False, True], ids=["not said", "autonomous"])
def test_two_mirror_cycles_are_no_clouds_of_chaos(autonomous):
    """Their period is 2.25 to 6 digits, so that each start sees nine places of them in steps of 1 s."""
    system = Strobe(Fmu.open(built_of(lower(chua()))), period=1.0, autonomous=autonomous)
    found = basins(
        system, x=np.linspace(-2, 2, 5), y=np.linspace(-0.5, 0.5, 5), start={"z": 0.1}, execution=Execution(workers=1)
    )
    assert found.words == ["cycle of 2.25 s, mirror image of 2", "cycle of 2.25 s, mirror image of 1"]
    assert found.undecided == 0
    # the mirror image of a start comes to the mirror image; where z = .1 is near enough to 0 for that
    assert found.labels[0, 0] != found.labels[-1, -1] or found.labels[0, -1] != found.labels[-1, 0]
    assert {int(label) for label in found.labels.ravel()} == {0, 1}


def test_chaos_of_what_nothing_forces_stays_chaos():
    """alpha = 9, the double scroll: published exponents .23, 0, -1.78 are per unit of the circuit, .7 of this one."""
    system = Strobe(Fmu.open(built_of(lower(chua()))), period=1.0, autonomous=True, parameters={"al": 9.0})
    found = basins(system, x=np.linspace(-1, 1, 3), start={"z": 0.1}, execution=Execution(workers=1))
    assert kinds(found) == [CHAOS]
    (cloud,) = found.attractors
    assert isinstance(cloud, Cloud)
    assert abs(cloud.verdict.exponent - 0.23 / 0.7) < 5.0 * cloud.verdict.error


def test_charts_and_diagrams_tell_signs_by_errors():
    system = Iteration.of(LOGISTIC)
    r = np.array([2.9, 3.2, 3.569945672, 3.9, 4.0])
    found = orbit_diagram(system, "r", r, start=[0.3], transient=400, exponents=1024)
    signs = ["negative", "negative", NOT_DECIDED, "positive", "positive"]
    assert [found.sign(0, i) for i in (0, 1, 3, 4)] == [signs[i] for i in (0, 1, 3, 4)]
    assert found.sign(0, 2) in ("zero", NOT_DECIDED)
    assert found.exponents[0, 4] == pytest.approx(math.log(2.0), abs=5.0 * found.exponent_errors[0, 4])
    assert (found.exponent_errors[0, :2] == 0.0).all() and (found.exponent_errors[0, 3:] > 0.0).all()
    henon = chart(Iteration.of(HENON), what="exponent", transient=300, a=[1.0, 1.4], b=[0.0, 0.3])
    assert [[henon.classes[i] for i in row] for row in henon.labels] == [["negative"] * 2, ["negative", "positive"]]
