"""Disturbances are files: one of the user's is estimated, written and trusted as a law is."""

from __future__ import annotations

import inspect
from pathlib import Path
from typing import get_args

import numpy as np
import pytest

from fmu_models.base import trust
from fmu_models.base.errors import StickslipError
from identification.commands import fits
from identification.disturbances import DISTURBANCES
from identification.disturbances.angle import POWER
from identification.disturbances.term import DAMPING, FRICTION, SPRING, DisturbanceTerm, Effect, Whereabouts, disturbed
from identification.disturbances.terms import ranked, terms_of, undisturbed
from identification.fit.fit import fit_friction
from identification.fit.result import FrictionFit
from identification.measurement.pooled import rig_values
from identification.measurement.pooling import pool
from rig_io.bench.disturbances import KINDS
from rig_io.bench.emulator import emulate, standard_set

OWN = """
from identification import Disturbance, DisturbanceTerm, Effect

DUST = Effect("dust", lambda at, order, functions: functions.cos(3 * at.turned))
DISTURBANCE = Disturbance(
    words="dust comes three times a turn of the drive", terms=lambda ready, size: [DisturbanceTerm("dust", DUST)]
)
"""


@pytest.mark.nightly_for("shooting")
@pytest.mark.parametrize("estimator", ["weak-form", "shooting"])
def test_a_disturbance_of_the_user_is_estimated_and_read_back(tmp_path: Path, monkeypatch, estimator: str) -> None:
    file = tmp_path / "my_dust.py"
    file.write_text(OWN)
    ready = pool([emulate(settings, 3, i) for i, settings in enumerate(standard_set(duration=5.0))])
    fit = fit_friction(ready, estimator=estimator, disturbances=[str(file)], law_spread="none")
    (cause,) = fit.causes
    (dust,) = (parameter for parameter in fit.nuisance if parameter.name == "dust")
    assert cause.name == str(file) and cause.words == "dust comes three times a turn of the drive"
    assert abs(dust.value) < 5 * dust.standard_deviation
    monkeypatch.setattr(trust, "_process", trust._Process(command=("report",)))
    with pytest.raises(StickslipError, match=r"it names the Python file '.*my_dust\.py'"):
        FrictionFit.from_json(fit.to_json())
    assert FrictionFit.from_json(fit.to_json(), trust=True).causes == fit.causes


def test_each_says_which_sizes_emulate_it() -> None:
    emulated = {size for disturbance in ranked().values() for size in disturbance.emulated}
    # what an encoder or a laser beside tells is no disturbance that is sought
    assert emulated == {name for name, kind in KINDS.items() if kind.known} - {"clock", "lost"}


def test_names_in_the_help_come_from_the_registry() -> None:
    text = inspect.getsource(fits)
    assert not any(name in text for name in ("normal-force", "savitzky-golay"))
    (option,) = get_args(fits.Disturbing)[1:]
    assert all(name in option.help for name in DISTURBANCES.names())


def test_no_terms_where_nothing_is_asked() -> None:
    ready = pool([emulate(settings, 3, i) for i, settings in enumerate(standard_set(duration=4.0))])
    assert terms_of(ready, ()) == ()


def test_terms_of_one_factor_are_added_and_factors_multiplied() -> None:
    where = Whereabouts.seen(np.array([0.0, 4.0]), 0, np.arange(5.0), np.linspace(-0.3, 0.2, 5), np.zeros(5))
    squared = Effect("b", lambda at, order, functions: at.angle**2, factor="a")
    terms = [
        DisturbanceTerm("a", Effect("a", lambda at, order, functions: at.angle)),
        DisturbanceTerm("b", squared),
        DisturbanceTerm("c", Effect("c", lambda at, order, functions: at.share)),
        DisturbanceTerm("d", Effect("d", lambda at, order, functions: at.share, acts=SPRING)),
    ]
    value, slopes = disturbed(terms, np.array([0.2, -0.5, 0.1, 0.3]), where)
    angle, share = where.angle, where.share
    first, second = 1 + 0.2 * angle - 0.5 * angle**2, 1 + 0.1 * share
    np.testing.assert_allclose(value, first * second, rtol=1e-15)
    for slope, expected in zip(slopes, (angle * second, angle**2 * second, share * first, 0.0), strict=True):
        np.testing.assert_allclose(slope, np.broadcast_to(expected, slope.shape), rtol=1e-15)
    spring, _ = disturbed(terms, np.array([0.2, -0.5, 0.1, 0.3]), where, SPRING)
    np.testing.assert_allclose(spring, 1 + 0.3 * share, rtol=1e-15)


def test_friction_by_inverse_dynamics_is_freed_of_what_disturbs_it() -> None:
    """A torque balance whose spring, damping and normal force are others than those that are known."""
    rig = rig_values({"J": 0.05, "k": 2.6, "c": 0.06, "R": 0.125, "r": 0.06, "N0": 4.9})
    time, mu = np.linspace(0.0, 1.0, 7), np.linspace(0.6, 0.4, 7)
    angle, speed, sign = 0.2 * np.sin(5 * time), np.cos(5 * time), np.array([1.0, 1, 1, -1, -1, 1, 1])
    sizes = {FRICTION: 0.02, SPRING: 0.03, DAMPING: -0.2}
    accelerating = sign * rig.R * rig.N * 1.02 * mu - 1.03 * rig.k * angle - 0.8 * rig.c * speed
    seen = sign * (accelerating + rig.k * angle + rig.c * speed) / (rig.R * rig.N)
    terms = [DisturbanceTerm(acts, Effect(acts, lambda at, order, functions: 1.0, acts=acts)) for acts in sizes]
    where = Whereabouts.seen(time, 0, time, angle, speed)
    np.testing.assert_allclose(undisturbed(terms, np.array([*sizes.values()]), seen, sign, where, rig), mu, rtol=1e-12)


def test_an_effect_of_the_angle_is_counted_from_the_reference_of_its_term() -> None:
    angle = np.array([0.1, 0.25, 0.4])
    where = Whereabouts.seen(np.array([0.0, 1.0]), 0, np.zeros(3), angle, np.zeros(3))
    term = DisturbanceTerm("square", POWER, 2, reference=0.1)
    assert term.shape(where) == pytest.approx([0.0, 0.15**2, 0.3**2], abs=1e-15)
