"""Disturbances are files: one of the user's is estimated, written and trusted as a law is."""

from __future__ import annotations

import inspect
from dataclasses import fields
from pathlib import Path
from typing import get_args

import numpy as np
import pytest

from fmu_models.base import trust
from fmu_models.base.errors import StickslipError
from identification.commands import fits
from identification.disturbances import DISTURBANCES
from identification.disturbances.angle import POWER
from identification.disturbances.term import DisturbanceTerm, Whereabouts
from identification.disturbances.terms import ranked, terms_of
from identification.fit.fit import fit_friction
from identification.fit.result import FrictionFit
from identification.measurement.pooling import pool
from rig_io.bench.disturbances import Disturbances
from rig_io.bench.emulator import emulate, standard_set

OWN = """
from identification import Disturbance, DisturbanceTerm, Effect

DUST = Effect("dust", lambda at, order, functions: functions.cos(3 * at.turned))
DISTURBANCE = Disturbance(
    words="dust comes three times a turn of the drive", terms=lambda ready, size: [DisturbanceTerm("dust", DUST)]
)
"""


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
    assert emulated == {field.name for field in fields(Disturbances)}


def test_names_in_the_help_come_from_the_registry() -> None:
    text = inspect.getsource(fits)
    assert not any(name in text for name in ("normal-force", "savitzky-golay"))
    (option,) = get_args(fits.Disturbing)[1:]
    assert all(name in option.help for name in DISTURBANCES.names())


def test_no_terms_where_nothing_is_asked() -> None:
    ready = pool([emulate(settings, 3, i) for i, settings in enumerate(standard_set(duration=4.0))])
    assert terms_of(ready, ()) == ()


def test_an_effect_of_the_angle_is_counted_from_the_reference_of_its_term() -> None:
    angle = np.array([0.1, 0.25, 0.4])
    where = Whereabouts.seen(np.array([0.0, 1.0]), 0, np.zeros(3), angle, np.zeros(3))
    term = DisturbanceTerm("square", POWER, 2, reference=0.1)
    assert term.shape(where) == pytest.approx([0.0, 0.15**2, 0.3**2], abs=1e-15)
