"""Friction by direction, fitted to short emulated logs with drives both ways."""

from __future__ import annotations

import numpy as np
import pytest

from fmu_models.base.errors import StickslipError
from fmu_models.scene.read import read_scene
from identification.fit.fit import fit_friction
from identification.fit.samples import samples_by_disc
from identification.laws import find_law
from identification.laws.joint_law import joint_law
from identification.measurement.pooled import Pool
from identification.measurement.pooling import pool
from identification.report.friction_figure import friction_figure
from rig_io.bench.emulation import Disc, Emulation
from rig_io.bench.emulator import emulate
from rig_io.logs.log import RigLog

LAW = "Conti by direction"
TRUTH = dict(zip(find_law(LAW).names, (0.65, 0.35, 15.0, 0.5, 0.3, 20.0), strict=True))


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> list[RigLog]:
    path = tmp_path_factory.mktemp("rig") / "rig.toml"
    values = ", ".join(f"{name}0 = {value}" for name, value in TRUTH.items())
    path.write_text(
        'title = "rig"\nmodel = "disc_rig"\ncontacts = ["disc0"]\nlaws = { disc0 = "directional" }\nstop_time = 8\n'
        f"free = {{ {values} }}\ndrives = {{ w0 = 0.83 }}\ncompute = {{ kind = 'trajectory' }}\n",
        encoding="utf-8",
    )
    scene = read_scene(path)
    speeds = (0.83, 1.4, -0.41, -0.83)
    settings = [Emulation(f"{w:g}", (Disc(drive_speed=w),), duration=6.0, transient=1.0, scene=scene) for w in speeds]
    return [emulate(one, 5, number) for number, one in enumerate(settings)]


@pytest.fixture(scope="module")
def ready(logs: list[RigLog]) -> Pool:
    return pool(logs, allow_no_stick=True)


@pytest.mark.nightly_for("whole-cycle-0.02", "shooting-0.03", "weak-form-0.02")
@pytest.mark.parametrize(
    ("estimator", "near"), [("weak-form", 0.02), ("savitzky-golay", 0.2), ("shooting", 0.03), ("whole-cycle", 0.02)]
)
def test_every_estimator_finds_both_halves(ready: Pool, estimator: str, near: float) -> None:
    fit = fit_friction(ready, estimator=estimator, law=LAW)
    assert fit.estimator == estimator
    for one in fit.parameters:
        assert one.value == pytest.approx(TRUTH[one.name], rel=near)
        assert abs(one.value - TRUTH[one.name]) < 3 * one.total_deviation


def test_bins_and_figure_have_both_directions(ready: Pool) -> None:
    fit = fit_friction(ready, estimator="weak-form", law=LAW)
    slips = np.array([one.slip for one in fit.bins])
    assert slips.min() < -0.02 and slips.max() > 0.02
    # means of a direction are its own law's
    law, truth = find_law(LAW), np.array(list(TRUTH.values()))
    np.testing.assert_allclose([one.coefficient for one in fit.bins], law.value(slips, truth), atol=0.02)
    axes = friction_figure(fit, samples_by_disc(fit, ready)).axes[0]
    assert axes.get_xlim()[0] < -0.05


def test_logs_of_one_direction_and_two_discs_are_refused(logs: list[RigLog]) -> None:
    with pytest.raises(StickslipError, match="All slips go one way"):
        fit_friction(pool(logs[:2], allow_no_stick=True), law=LAW)
    with pytest.raises(StickslipError, match="one driving disc"):
        joint_law(find_law(LAW), "together")
