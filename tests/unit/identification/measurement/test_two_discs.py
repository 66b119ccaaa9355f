"""Logs of two driving discs: what they state, what the emulator makes of it, and the equations of both laws at once."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_fit import made_fit

from fmu_models.base.errors import StickslipError
from identification.estimators import two_discs
from identification.estimators.base import Options
from identification.estimators.chart import bends_of
from identification.fit.samples import samples_by_disc
from identification.laws import find_law
from identification.laws.joint_law import joint_law
from identification.measurement.pooling import pool
from identification.measurement.slip_segments import long_enough
from rig_io.bench.emulation import RIG, Disc, Emulation
from rig_io.bench.emulator import emulate
from rig_io.bench.materials import MATERIALS
from rig_io.logs.arrangement import Arrangement
from rig_io.logs.log import Experiment, RigLog, StatedQuantity
from rig_io.packages import sidecar
from rig_io.packages.datapackage import read_package, write_package
from rig_io.sensors import Laser, laser_angle

CLEAN = {
    "laser": Laser(noise=0.0, resolution=0.0, gain_error=0.0),
    "encoder": None,
    "drive_encoder": None,
    "ripple": None,
}
PAPER, LINER = MATERIALS["paper/rubber"], MATERIALS["liner/rubber"]
TRUTH = np.array([0.65, 0.35, 15.0, 0.50, 0.33, 20.0])


def log_of(arrangement: Arrangement, w0: float, w1: float, changeover: float = 0.0, **settings: object) -> RigLog:
    """A log of 6 s without noise, disc 0 of paper/rubber, disc 1 of liner/rubber, with converted drive speeds."""
    setting = Emulation(
        f"{arrangement}{w0:g}{w1:g}".replace("-", "m"),
        discs=(Disc(PAPER, w0), Disc(LINER, w1)),
        arrangement=arrangement,
        changeover=changeover,
        duration=6.0,
        **{**CLEAN, **settings},
    )
    log = emulate(setting)
    speeds = {f"drive{i}_speed": np.full(len(log.time), w) for i, w in enumerate((w0, w1))}
    return replace(log, columns={**log.columns, **speeds})


@pytest.fixture(scope="module")
def together() -> list[RigLog]:
    return [log_of("together", *pair) for pair in ((0.83, 0.41), (0.2, 0.83), (1.5, -0.5))]


@pytest.fixture(scope="module")
def sequential() -> list[RigLog]:
    return [log_of("sequential", *pair, changeover=0.07) for pair in ((0.9, 1.15), (0.5, 1.15), (0.3, 0.6))]


@pytest.fixture(scope="module")
def overlapping() -> list[RigLog]:
    return [log_of("overlapping", *pair, changeover=0.15) for pair in ((0.83, 1.4), (-0.5, 1.5))]


def test_a_log_states_its_arrangement(sequential: list[RigLog], tmp_path) -> None:
    write_package(tmp_path / "rig", sequential[:1])
    (read,) = read_package(tmp_path / "rig")
    assert read.experiment == sequential[0].experiment
    assert read.experiment.arrangement == "sequential"
    assert read.experiment.emulation["theta_s"] == 0.07
    with pytest.raises(StickslipError, match=r"arrangement 'sequental' is unknown\. Did you mean 'sequential'"):
        sidecar.experiment({"contacts": ["disc0", "disc1"], "arrangement": "sequental"}, "here")
    with pytest.raises(StickslipError, match=r"are two, but contacts are \['disc0'\]"):
        sidecar.experiment({"contacts": ["disc0"], "arrangement": "overlapping"}, "here")


def test_settings_of_discs_that_cannot_be_are_refused() -> None:
    with pytest.raises(StickslipError, match="'sequential' are two, not 1"):
        Emulation("a", arrangement="sequential")
    with pytest.raises(StickslipError, match="no arrangement 'parallel'"):
        Emulation("a", discs=(Disc(), Disc()), arrangement="parallel")  # type: ignore[arg-type]


def period(log: RigLog) -> float:
    angle = laser_angle(log) - float(np.median(laser_angle(log)))
    rising = np.flatnonzero((angle[:-1] < 0) & (angle[1:] >= 0))
    passed = log.time[rising] - angle[rising] * 1e-3 / (angle[rising + 1] - angle[rising])
    return float(np.mean(np.diff(passed)))


def test_the_emulator_has_the_reference_cycles_of_one_disc_at_a_time_and_of_overlapping_ones() -> None:
    force = StatedQuantity(3.0, "N")
    rig = replace(RIG, N0=force, N1=force, c=StatedQuantity(0.0055, "N*m*s/rad"))
    pair = (Disc(LINER, 0.9), Disc(LINER, 1.15))
    log = emulate(Emulation("c", pair, rig, "sequential", 0.0, start_angle=0.14, transient=25.0, duration=4.0, **CLEAN))
    assert period(log) == pytest.approx(0.928719259537, abs=5e-5)
    pair = (Disc(PAPER, 0.6), Disc(PAPER, 1.0))
    again = Emulation("d", pair, RIG, "overlapping", 0.1, start_angle=0.14, transient=25.0, duration=4.0, **CLEAN)
    log = emulate(again)
    assert period(log) == pytest.approx(0.69236, abs=5e-5)


@pytest.mark.parametrize("logs", ["together", "sequential", "overlapping"])
def test_the_gradient_of_the_averaged_force_is_exact(logs: str, request: pytest.FixtureRequest) -> None:
    ready = pool(request.getfixturevalue(logs), allow_no_stick=True)
    law = joint_law(find_law("Conti"), ready.arrangement)
    segments = long_enough(ready.segments, 0.25)
    logs_of = [ready.log_number(s) for s in segments]
    these = two_discs.joint_equations(segments, logs_of, ready.values, ready.natural_period)
    place = {"theta_s": [0.0703], "alpha": [0.1503]}
    x = np.concatenate([1.1 * TRUTH, place.get(law.changeover or "", [])])
    gradient = these.model_gradient(law, x)
    assert gradient.shape == (len(these.measured), len(law.parameters))
    for place, scale in enumerate(x):
        # the average is piecewise linear in the changeover, smooth in all else
        step = np.zeros(len(x))
        step[place] = 1e-9 if place == 6 else 1e-5 * scale
        slope = (these.model(law, x + step) - these.model(law, x - step)) / (2 * step[place])
        np.testing.assert_allclose(gradient[:, place], slope, rtol=1e-5, atol=1e-6 * np.abs(slope).max())
    assert law.changeover is None or np.abs(gradient[:, 6]).max() > 1.0


def test_the_search_for_both_laws_begins_near_them(together: list[RigLog]) -> None:
    ready = pool(together, allow_no_stick=True)
    segments = long_enough(ready.segments, 0.25)
    logs_of = [ready.log_number(s) for s in segments]
    these = two_discs.joint_equations(segments, logs_of, ready.values, ready.natural_period)
    found = two_discs.first_guess(these, joint_law(find_law("Conti"), "together"))
    assert found == pytest.approx(TRUTH, rel=0.3)


@pytest.mark.parametrize("logs", ["together", "sequential", "overlapping"])
def test_both_laws_and_the_changeover_are_found_without_a_guess(logs: str, request: pytest.FixtureRequest) -> None:
    ready = pool(request.getfixturevalue(logs), allow_no_stick=True)
    law = joint_law(find_law("Conti"), ready.arrangement)
    x = two_discs.estimate(ready, law, Options())[1].values
    # what smoothing of the slip speed leaves; a disc that the angle lets touch for short is seen in few windows
    short, long = [0.06, 0.04, 0.3], [0.01, 0.01, 0.05]
    limits = {"together": [*long, *long], "sequential": [*short, *long], "overlapping": [*short, *short]}
    assert np.all(np.abs(x[:6] / TRUTH - 1) < limits[logs])
    if law.changeover is not None:
        assert x[6] == pytest.approx({"theta_s": 0.07, "alpha": 0.15}[law.changeover], abs=5e-4)


def test_logs_of_one_disc_join_those_of_two(together: list[RigLog]) -> None:
    alone = emulate(Emulation("alone", (Disc(PAPER, 0.83),), duration=6.0, **CLEAN))
    alone = replace(alone, columns={**alone.columns, "drive0_speed": np.full(len(alone.time), 0.83)})
    ready = pool([alone, together[0]])
    assert (ready.contacts, ready.materials) == (("disc0", "disc1"), ("paper/rubber", "liner/rubber"))
    law = joint_law(find_law("Conti"), ready.arrangement)
    found = two_discs.estimate(ready, law, Options())
    x = found[1].values
    assert x[:3] == pytest.approx(TRUTH[:3], rel=0.02)
    assert x[3:5] == pytest.approx(TRUTH[3:5], rel=0.03)
    # a row of the lone disc does not answer to the law of the other
    gradient = found[0].evaluate(x).gradient
    log = found[0].evaluate(x).log
    assert np.all(gradient[log == 0, 3:] == 0) and np.any(gradient[log == 1, 3:] != 0)


def test_two_discs_that_cannot_be_fitted_are_refused(together: list[RigLog], sequential: list[RigLog]) -> None:
    log = together[0]
    with pytest.raises(StickslipError, match="different arrangements of the two discs, 'together' and 'sequential'"):
        pool([log, sequential[0]])
    with pytest.raises(StickslipError, match=r"rig constant N1 .* needed"):
        pool([replace(log, rig=replace(log.rig, N1=None))])
    without = {name: column for name, column in log.columns.items() if name != "drive1_speed"}
    with pytest.raises(StickslipError, match="how disc 1 turned: it needs 'drive1_count'"):
        pool([replace(log, columns=without, experiment=replace(log.experiment, drive_speed=()))])
    turned = replace(log.experiment, materials=("liner/rubber", "paper/rubber"))
    with pytest.raises(
        StickslipError, match=r"\(paper/rubber\) and .* \(liner/rubber\) .* different materials on disc0"
    ):
        pool([together[1], replace(log, experiment=turned)])
    alone = replace(log, experiment=Experiment(contacts=("disc0",)), name="zero")
    other = replace(together[1], experiment=Experiment(contacts=("disc1",)), name="one")
    with pytest.raises(StickslipError, match=r"different discs .* none is of both"):
        pool([alone, other])
    with pytest.raises(StickslipError, match="has no disc in contact"):
        pool([replace(log, experiment=Experiment(contacts=()))])


def test_a_disc_that_never_slips_or_is_never_touched_is_named(together: list[RigLog], sequential: list[RigLog]) -> None:
    log = together[0]
    # as if disc 1 had turned along with the body all the time
    along = 0.125 / 0.06 * np.gradient(laser_angle(log), log.time)
    with pytest.raises(StickslipError, match="no slip on disc1"):
        pool([replace(log, columns={**log.columns, "drive1_speed": along})])
    ready = pool(sequential[:1])
    law = joint_law(find_law("Conti"), ready.arrangement)
    with pytest.raises(StickslipError, match=r"none of the logs .* touch disc0 \(theta_s = -0\.5 rad\)"):
        two_discs.segments_at(ready, law, np.append(TRUTH, -0.5))


def test_discs_that_drag_the_same_way_in_every_log_are_not_told_apart(together: list[RigLog]) -> None:
    law = joint_law(find_law("Conti"), "together")
    same = pool(together[:2])
    with pytest.raises(StickslipError, match=r"drag the body the same way.*turn against one another"):
        two_discs.estimate(same, law, Options())
    # indeed: what is moved from one disc to the other changes no residual
    segments = long_enough(same.segments, 0.25)
    logs_of = [same.log_number(s) for s in segments]
    these = two_discs.joint_equations(segments, logs_of, same.values, same.natural_period)
    moved = TRUTH + 0.05 * np.array([1, 1, 0, -1, -1, 0])
    np.testing.assert_allclose(these.model(law, moved), these.model(law, TRUTH), rtol=1e-13)


@pytest.mark.parametrize(
    ("name", "q"),
    [("Conti", [0.65, 0.35, 15.0]), ("Tustin", [0.6, 0.3, 0.05]), ("Conti+viscous", [0.65, 0.35, 15.0, 0.2])],
)
def test_straight_coordinates_lead_to_the_law_and_back(name: str, q: list[float]) -> None:
    law, count = joint_law(find_law(name), "sequential"), len(q)
    speeds, place = np.tile(np.linspace(0.02, 0.12, 50), 2), np.repeat([0, 1], 50)
    x = np.array([*q, *q, 0.07])
    bends = bends_of(law, ("disc0", "disc1"), x, speeds, place)
    assert [bend.first for bend in bends] == [0, count]
    for bend in bends:
        here = x[bend.places]
        y = bend.coordinates(here)
        assert y[0] == pytest.approx(float(find_law(name).value(np.array(bend.speeds[0]), here)), rel=1e-14)
        assert bend.parameters(y) == pytest.approx(here, rel=1e-12)
        steps = 1e-6 * np.eye(count)
        slope = [(bend.parameters(y + step) - bend.parameters(y - step)) / 2e-6 for step in steps]
        np.testing.assert_allclose(bend.slope(here), np.transpose(slope), rtol=1e-6, atol=1e-8)
    # a law that rises has no such coordinates
    x[:2] = x[1::-1]
    assert [bend.first for bend in bends_of(law, ("disc0", "disc1"), x, speeds, place)] == [count]


@pytest.mark.parametrize("logs", ["sequential", "overlapping"])
def test_what_is_drawn_of_each_disc_lies_on_its_true_law(logs: str, request: pytest.FixtureRequest) -> None:
    """A mean over a window lies above a bent law at the mean slip speed, unless that is taken off."""
    ready = pool(request.getfixturevalue(logs), allow_no_stick=True)
    place = {"sequential": 0.07, "overlapping": 0.15}[logs]
    fit = made_fit(discs=2, theta_s=place)
    truth = [*TRUTH.tolist(), place]
    parameters = tuple(replace(q, value=value) for q, value in zip(fit.parameters, truth, strict=True))
    fit = replace(fit, parameters=parameters, constants=())  # those of the logs
    for number, (contact, seen) in enumerate(samples_by_disc(fit, ready).items()):
        off = seen.coefficient - find_law("Conti").value(seen.slip, TRUTH[3 * number : 3 * number + 3])
        assert len(off) > 20, contact
        assert abs(np.median(off)) < 3e-4 and np.quantile(np.abs(off), 0.9) < 2e-3, contact
