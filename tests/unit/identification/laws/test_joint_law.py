"""The law of two driving discs: which of them touches, by the declared rigs, and whose parameters count."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from fmu_models.oscillators import load
from identification.laws import find_law
from identification.laws.joint_law import joint_law, laws_of, touching
from rig_io.logs.arrangement import Arrangement

BOTH = ("disc0", "disc1")


@pytest.mark.parametrize(("arrangement", "at"), [("sequential", 0.2), ("sequential", -0.3), ("overlapping", 0.25)])
def test_discs_touch_where_the_declared_rig_says(arrangement: Arrangement, at: float) -> None:
    law = joint_law(find_law("Conti"), arrangement)
    angle = np.linspace(-1.0, 1.0, 41) + 0.01
    touch = touching(law, BOTH, np.array([*np.ones(6), at]), angle)
    rig = load(f"disc_rig_{arrangement}")
    for disc, contact in enumerate(rig.contacts):
        where: Any = contact.where  # type: ignore[union-attr]
        (theta,) = (symbol for symbol in where.free_symbols if str(symbol) == "theta")
        (edge,) = where.free_symbols - {theta}
        expected = [float(where.subs({edge: at, theta: place})) > 0.0 for place in angle]
        assert touch[disc].tolist() == expected and 0 < sum(expected) < len(angle)


def test_a_guard_widens_both_regions() -> None:
    law, q = joint_law(find_law("Conti"), "sequential"), np.array([*np.ones(6), 0.2])
    angle = np.array([0.05, 0.15, 0.25, 0.35])
    assert touching(law, BOTH, q, angle, 0.1).tolist() == [[True, True, True, False], [False, True, True, True]]
    # one disc alone is never left, nor are two side by side
    assert touching(law, ("disc0",), q, angle).all()
    assert touching(joint_law(find_law("Conti"), "together"), BOTH, q[:6], angle).all()


def test_each_disc_has_its_own_parameters() -> None:
    single = find_law("Conti")
    law, slips = joint_law(single, "sequential"), np.array([[0.01, 0.2], [0.3, -0.04]])
    q = np.array([0.6, 0.4, 9.0, 0.7, 0.3, 20.0, 0.1])
    parts = laws_of(law, BOTH)
    assert [(part.disc, part.suffix, part.force) for part in parts] == [("0", "0", 0), ("1", "1", 1)]
    for disc, part in enumerate(parts):
        assert law.value(slips, q)[:, disc] == pytest.approx(single.value(slips[:, disc], q[part.place]), rel=1e-15)
    # the derivative by each parameter, against differences; the changeover moves no force
    gradient, step = law.gradient(slips, q), 1e-6
    for place in range(7):
        ahead, behind = (law.value(slips, q + way * step * np.eye(7)[place]) for way in (1, -1))
        assert gradient[place] == pytest.approx((ahead - behind) / (2 * step), abs=1e-8)
