"""Every disturbance that is emulated does what is said of it, and those that nobody knows get no name."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fmu_models.base.errors import StickslipError
from identification.fit.fit import fit_friction
from identification.measurement.free_decay import fit_free_decay
from identification.measurement.pooling import pool
from rig_io.bench.disturbances import KINDS, Disturbances
from rig_io.bench.drive import Ripple
from rig_io.bench.emulation import Emulation
from rig_io.bench.emulator import emulate, free_decay, standard_set
from rig_io.logs.log import RigLog
from rig_io.sensors.encoder import Encoder
from rig_io.sensors.laser import Laser

SIZES = {
    **{"once": 0.05, "twice": 0.05, "angle": 0.05, "per_log": 0.05, "within": 0.05, "direction": 0.05, "warm_up": 0.05},
    **{"offset": 1e-3, "drift": 1e-3, "zero": 5e-3, "laser_bend": 0.02, "vibration": 1e-3, "walk": 1e-3, "late": 0.01},
    **{"spring": 2.0, "damping": 0.05, "drive_encoder": 0.02, "clock": 1e-2, "lost": 3, "body_encoder": 0.02},
    **{"bearing": 0.02, "draft": 0.02, "rocking": 0.02, "magnet": 0.02, "cable": 0.1, "aliasing": 1e-3},
    **{"laser_gain": 5e-3, "overflow": 256, "stamps": 1e-2, "belt": 0.02, "backlash": 5e-3},
    **{"settling": 1e-3},
}
UNKNOWN = {"bearing": 2e-3, "draft": 1e-3, "rocking": 3e-3, "magnet": 8e-3, "aliasing": 1e-4, "stamps": 1e-3}
UNKNOWN |= {"backlash": 1e-3, "settling": 2e-4}
RULED = Encoder(line_error=0.0)
PLAIN = Emulation("a", duration=4.0, laser=Laser(0.0, 0.0, 0.0), encoder=RULED, drive_encoder=RULED, ripple=None)


def emulated(settings: Emulation, **sizes: float) -> RigLog:
    return emulate(replace(settings, disturbances=Disturbances(**sizes)), 3, 1)


@pytest.mark.parametrize("name", KINDS)
def test_a_disturbance_changes_the_log_that_it_is_of(name: str) -> None:
    still, moved = emulated(PLAIN), emulated(PLAIN, **{name: SIZES[name]})
    changed = {one for one in still.columns if not np.array_equal(still.columns[one], moved.columns[one])}
    counts = {
        "drive_encoder": "drive0",
        "belt": "drive0",
        "overflow": "drive0",
        "body_encoder": "encoder",
        "lost": "encoder",
        "backlash": "encoder",
    }
    if name in counts:
        assert changed and all(one.startswith(counts[name]) for one in changed)
    elif KINDS[name].acts in ("laser", "read") or name in ("offset", "drift"):
        assert changed == {"laser"}
    else:
        assert "encoder_edge_time" in changed


def test_a_belt_takes_its_share_of_what_the_motor_turns() -> None:
    on_motor = replace(PLAIN, drive_encoder=replace(RULED, ratio=3.0))
    still, creeping = (np.ptp(emulated(on_motor, belt=creep).column("drive0_count")) for creep in (0.0, 0.02))
    assert creeping == pytest.approx(1.02 * still, abs=1)


def test_a_play_is_said_and_no_clock_is_blamed() -> None:
    (said,) = pool(bench(backlash=1e-3)).warnings
    assert "coupling, or what the laser looks at, has play of 1." in said and "started apart" not in said


def test_a_laser_that_settles_makes_no_torque() -> None:
    decay = fit_free_decay(emulated(free_decay(duration=15.0), settling=2e-4))
    assert decay.pull == 0 and not decay.warnings


def test_a_bent_spring_and_drag_swing_as_stated() -> None:
    quiet = {"laser": Laser(), "encoder": None}
    found = fit_free_decay(emulated(free_decay(duration=15.0, **quiet), spring=0.3 * 2.62, damping=0.1 * 0.055))
    assert found.cubic == pytest.approx((0.3, 0.0), abs=0.03) and found.drag == pytest.approx((0.1, 0.0), abs=0.01)


def test_a_magnet_is_told_by_a_free_decay() -> None:
    pulled, free = (fit_free_decay(emulated(free_decay(duration=15.0), magnet=size)) for size in (5e-3, 0.0))
    assert pulled.pull > 0 and any("a magnet" in one for one in pulled.warnings)
    assert free.pull == 0 and not free.warnings


def bench(**sizes: float) -> list[RigLog]:
    common = {"disturbances": Disturbances(**sizes), "duration": 10.0, "ripple": Ripple(smoothing=0.02)}
    return [emulate(one, 11, number) for number, one in enumerate(standard_set(speeds=(0.41, 0.83, 1.2), **common))]


@pytest.mark.nightly_for(*(name for name in UNKNOWN if name != "draft"))
@pytest.mark.parametrize("name", UNKNOWN)
def test_what_no_estimator_knows_gets_no_name(name: str) -> None:
    fit = fit_friction(bench(**{name: UNKNOWN[name]}))
    assert {cause.name for cause in fit.causes} <= ({"pull"} if name == "magnet" else set())
    assert np.all(np.abs(fit.law_values - [0.65, 0.35, 15]) < 3 * np.array([q.total_deviation for q in fit.parameters]))


def test_a_walk_is_taken_off_with_what_it_leaves_of_the_zero() -> None:
    """Each log begins its own walk, and so does the decay that tells the zero."""
    ready = pool(bench(walk=1e-4))
    fit = fit_friction(ready)
    assert fit.causes == () and all(motion.wander and motion.shift for motion in ready.motions)
    assert np.all(np.abs(fit.law_values - [0.65, 0.35, 15]) < 3 * np.array([q.total_deviation for q in fit.parameters]))


def test_a_wrong_name_lists_them_all() -> None:
    with pytest.raises(StickslipError, match=r"'tide' \(once, .*stamps, belt, backlash, settling\)"):
        Disturbances.said(["tide=1"])
