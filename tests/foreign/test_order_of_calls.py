"""FMUs that compute only when asked for their rates, or for anything before these: nothing said before is news."""

from __future__ import annotations

import numpy as np
import pytest
from coupled import wires
from models import Models

from fmu_models.coupling.run import couple
from fmu_models.coupling.system import CoupledSystem, Unit
from fmu_models.importer.flow import FlowDriver
from fmu_models.importer.simulate import simulate_any


@pytest.mark.parametrize("order", ["lazy", "hasty"])
@pytest.mark.parametrize("method", ["dopri5", "dop853", "stiff", "auto"])
@pytest.mark.parametrize(("name", "place"), [("ball", "h"), ("block", "x")])  # one bounces, one slides
def test_an_fmu_that_is_lazy_or_hasty_runs_as_one_that_is_not(
    model: Models, name: str, place: str, method: str, order: str
) -> None:
    honest = simulate_any(model(name), 2.0, method=method)
    late = simulate_any(model(f"{order}_{name}"), 2.0, method=method)
    for column in honest.values:
        assert np.array_equal(late[column], honest[column]), column
    assert late.events == honest.events
    # outputs that are the derivatives under other names
    assert np.array_equal(late["speed"], honest[f"der({place})"])
    assert np.array_equal(late["acceleration"], honest["der(v)"])


@pytest.mark.parametrize("order", ["lazy", "hasty"])
def test_derivatives_are_those_of_the_closed_form(model: Models, order: str) -> None:
    run = simulate_any(model(f"{order}_ball"), 0.4)
    assert run["der(h)"] == pytest.approx(-9.81 * run.time, abs=1e-12)
    assert run["der(v)"] == pytest.approx(-9.81 * np.ones(run.time.size), abs=0.0)


@pytest.mark.parametrize("order", ["lazy", "hasty"])
def test_what_such_a_unit_feeds_is_of_now(model: Models, order: str) -> None:
    units = {"ball": Unit(model(f"{order}_ball")), "path": Unit(model("driven"))}
    run = couple(CoupledSystem("fed", units, wires("ball.speed -> path.u"), tolerance=1e-10, stop_time=1.0))
    # the integral of the speed is the way
    assert run["path.x"] == pytest.approx(run["ball.h"] - 1.0, abs=1e-9)
    assert np.array_equal(run["ball.der(h)"], run["ball.speed"])


def test_motions_between_points_of_a_lazy_fmu(model: Models) -> None:
    flows = []
    for name in ("ball", "lazy_ball"):
        driver = FlowDriver(model(name))
        flows.append(driver.follow({"h": 1.0, "v": 0.0}, 0.0, 1.0, derivative=True, slopes=True, told=True))
        driver.close()
    honest, lazy = flows
    for name in ("states", "rates", "slopes", "indicators", "misses"):
        assert np.array_equal(getattr(lazy, name), getattr(honest, name)), name
    assert lazy.events == honest.events == (0,)
