"""Micro-slip in stick: found where the truth is elastic, silent where it is rigid, whatever the scales and the law."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identification.fit.fit import fit_friction
from identification.measurement.pooled import Pool
from identification.measurement.pooling import pool
from identification.measurement.presliding import PreSliding, presliding
from rig_io.bench.emulation import MicroSlip
from rig_io.bench.emulator import emulate, standard_set
from rig_io.logs.log import EncoderCalibration

MU_S = 0.65
SPEED = "drive0_speed"


def bench(stiffness: float) -> Pool:
    """Two logs of paper/rubber, rigid or with bristles of that stiffness (N/m)."""
    micro = MicroSlip(stiffness) if stiffness else None
    settings = standard_set("paper/rubber", (0.41, 0.83), micro_slip=micro, duration=10.0)[:2]
    return pool([emulate(one, 4, number) for number, one in enumerate(settings)])


@pytest.fixture(scope="module")
def rigid() -> Pool:
    return bench(0.0)


@pytest.fixture(scope="module")
def elastic() -> Pool:
    return bench(5e4)


def found(ready: Pool, coefficient: float = MU_S) -> PreSliding:
    one = presliding(ready, coefficient)
    assert one is not None
    return one


def test_a_rigid_contact_is_silent(rigid: Pool) -> None:
    one = found(rigid)
    assert not one.elastic and one.stiffness is None and one.warnings == ()
    assert abs(one.compliance) < 2e-6  # a tenth of what bristles of 5e4 N/m show


def test_bristles_are_found_with_their_stiffness(elastic: Pool) -> None:
    one = found(elastic)
    assert one.elastic and one.compliance > 10 * np.hypot(one.noise_deviation, one.scale_deviation)
    # inertia and the ringing after the begin of a stick are left out of the model, which its deviation says
    assert abs(one.compliance - 1 / 5e4) < 2 * one.deviation
    (said,) = one.warnings
    assert "pre-sliding stiffness" in said and "lugre" in said and "cycle of the rigid model is wrong" in said


@pytest.mark.parametrize("coefficient", [0.3, 2.0, 10.0])
def test_a_law_that_is_far_off_at_rest_makes_no_elastic_contact(rigid: Pool, coefficient: float) -> None:
    one = presliding(rigid, coefficient)
    assert one is None or not one.elastic


@pytest.mark.nightly
def test_slip_shooting_follows_some_cycles_with_bristles_for_their_stiffness(elastic: Pool) -> None:
    one = fit_friction(elastic).presliding
    assert one is not None and one.stiffness is not None and one.stiffness_deviation is not None
    assert one.stiffness_deviation < 0.05 * 5e4 and one.model_deviation < 0.03 * one.compliance
    assert abs(one.stiffness - 5e4) < 3 * one.stiffness_deviation
    unknown = replace(one, at_least=True)
    assert "± at least" in unknown.warnings[0] and "at least" not in one.warnings[0]


def test_an_error_of_scale_counts_as_uncertainty(rigid: Pool) -> None:
    # r off by twice its standard uncertainty looks like bristles, but not surely
    r = next(prior for prior in rigid.priors if prior.name == "r")
    longer = replace(r, value=r.value + 2 * r.standard_uncertainty)
    moved = replace(rigid, priors=tuple(longer if prior is r else prior for prior in rigid.priors))
    one = found(moved)
    moved_by = one.compliance - found(rigid).compliance
    assert not one.elastic
    # r, R and what the encoder leaves open of the gain: r alone is most of it
    assert moved_by / 2 == pytest.approx(one.scale_deviation, rel=0.25)


def test_without_long_sticks_nothing_is_said(rigid: Pool) -> None:
    assert presliding(replace(rigid, motions=()), MU_S) is None
    assert presliding(replace(rigid, threshold=1e-6), MU_S) is None


def test_the_speed_of_the_drive_serves_where_no_encoder_is(elastic: Pool) -> None:
    def bare(name: str) -> bool:
        return not name.startswith("drive0")

    motions = tuple(
        replace(m, log=replace(m.log, columns={n: c for n, c in m.log.columns.items() if bare(n)} | {SPEED: m.drive}))
        for m in elastic.motions
    )
    one = found(replace(elastic, motions=motions))
    assert one.compliance == pytest.approx(found(elastic).compliance, rel=0.15)
    assert isinstance(elastic.motions[0].log.calibration.drive0, EncoderCalibration)
