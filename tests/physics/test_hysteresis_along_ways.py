"""Forces with memory along given ways: operators of play and stop, closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from emulated_loop import of_dahl as of_dahl_along
from emulated_loop import of_sliders as of_sliders_along
from sliders import m

from fmu_models import (
    BoucWen,
    Coordinate,
    Dahl,
    Hysteresis,
    Input,
    Iwan4,
    MaxwellSlip,
    Mechanism,
    Output,
    Parameter,
    Play,
    Signal,
    simulate,
)


def given_way(law: object, name: str, way: np.ndarray, **more: object) -> np.ndarray:
    """Forces of a law along a way that an input prescribes, at its samples, 1 s apart."""
    u = Input("u", 0.0, "m", "way")
    rest = Coordinate("rest", "m", "a body that nothing moves", velocity="rest_speed")
    held = Hysteresis(name="h", way=u, law=law, **more)  # type: ignore[arg-type]
    model = Mechanism(
        name=name, title="law along a way", source="test", coordinates=[rest], kinetic_energy=m * rest.v**2 / 2,
        contacts=[held], outputs=[Output("F", held.force, "N", "force")],
    )  # fmt: skip
    times = np.arange(len(way), dtype=float)
    return np.asarray(simulate(model, times[-1], inputs={"u": Signal(times, way)}, output_times=times)["F"])


def stop(way: np.ndarray, bound: float) -> np.ndarray:
    """The stop operator: elongations of a spring behind a slider."""
    return of_sliders_along(way, [1.0], [bound])


@pytest.fixture(scope="module")
def way() -> np.ndarray:
    """A random way, m."""
    return np.concatenate([[0.0], np.cumsum(np.random.default_rng(3).uniform(-0.4, 0.4, 400))])


def test_sliders_behind_a_play_follow_it(way: np.ndarray) -> None:
    """The play operator before two stop operators, sample by sample: rounding."""
    play = way - stop(way, 0.3)
    expected = 2.0 * stop(play, 0.1) + 1.0 * stop(play, 0.5)
    law = Play(law=MaxwellSlip(k=[2.0, 1.0], D=[0.1, 0.5]), w=0.3)
    assert given_way(law, "backlash", way) == pytest.approx(expected, abs=1e-12)


def test_laws_behind_a_play_follow_it(way: np.ndarray) -> None:
    """Dahl's and Bouc and Wen's law along the way that the play operator leaves: rounding."""
    played = way - stop(way, 0.3)
    behind = given_way(Play(law=Dahl(sigma=3.0, F_c=0.8), w=0.3), "dahl_backlash", way)
    assert behind == pytest.approx(of_dahl_along(played, 3.0, 0.8), abs=1e-11)
    for n in (1, 1.5, 2):
        law, name = BoucWen(k=3.0, beta=1.1, gamma=0.4, n=n), f"bouc_wen_{int(2 * n)}"
        expected = given_way(law, f"{name}_way", played)
        assert given_way(Play(law=law, w=0.3), f"{name}_backlash", way) == pytest.approx(expected, abs=1e-11)


def test_iwan_comes_to_the_four_parameters(way: np.ndarray) -> None:
    """Sliding force and stiffness at rest are met exactly; the virgin curve to the square of the cells' width."""
    law = Iwan4(F_S=2.0, K_T=5.0, chi=-0.5, beta=0.4, sliders=30)
    k, D = (np.array([float(e[i]) for e in law.elements]) for i in (0, 1))
    assert k.sum() == pytest.approx(5.0, rel=1e-12)
    assert k @ D == pytest.approx(2.0, rel=1e-12)
    share = 0.4 + 0.5 / 1.5
    last = 2.0 * 1.4 / (5.0 * share)
    u = np.linspace(0.0, 1.1 * last, 23)
    r = np.minimum(u / last, 1.0)
    backbone = 5.0 * last * (r - r**1.5 / (1.4 * 1.5))
    assert np.abs(given_way(law, "iwan", u) - backbone).max() < 1e-3 * 2.0
    assert given_way(law, "iwan", way) == pytest.approx(
        sum(s * stop(way, d) for s, d in zip(k, D, strict=True)), abs=1e-11
    )


def test_dahl_on_a_way_is_its_closed_form(way: np.ndarray) -> None:
    """F = s F_c + (F_0 - s F_c) exp(-sigma |dx|/F_c) over each sample: rounding."""
    force = of_dahl_along(way, 3.0, 0.8)
    assert given_way(Dahl(sigma=3.0, F_c=0.8), "dahl_way", way) == pytest.approx(force, abs=1e-11)
    # a load scales the force and not the memory
    load_of = Parameter("load", 2.5, "1", "load")
    assert given_way(Dahl(sigma=3.0, F_c=0.8), "dahl_load", way, load=load_of) == pytest.approx(2.5 * force, abs=1e-11)
