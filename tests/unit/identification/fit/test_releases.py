"""Where sticks let go, from emulated logs whose breakaway ages or does not; holds tell how fast."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from checkout import ROOT
from some_nightly import some_nightly

from fmu_models.base.errors import StickslipError
from fmu_models.language.law_parameter import T_0
from fmu_models.scene.read import read_scene
from identification.fit.fit import fit_friction
from identification.fit.result import FrictionFit
from identification.fitted_model.model import fmu_parameters
from identification.measurement.pooling import pool
from identification.next_step.design import _holds
from identification.report.fit_summary import certainty
from rig_io.bench.drive import RAMP, RUN, Ripple, held_duration, with_holds
from rig_io.bench.emulation import Disc, Emulation
from rig_io.bench.emulator import emulate, free_decay, standard_set
from rig_io.bench.scenes import emulations
from rig_io.logs.log import RigLog
from rig_io.packages.datapackage import read_package

RIGS = ROOT / "data" / "rigs" / "paper_rubber"
B = 0.02
SMOOTH = Ripple(smoothing=0.02)


def lacking(logs: list[RigLog], parts: tuple[str, ...]) -> list[RigLog]:
    """The logs without columns that have such parts in their names."""
    columns = [{name: one for name, one in log.columns.items() if not any(p in name for p in parts)} for log in logs]
    return [replace(log, columns=kept) for log, kept in zip(logs, columns, strict=True)]


def fitted(
    folder: Path, b: float, holds: tuple[float, ...] = (), seed: int = 0, estimator: str = "shooting"
) -> FrictionFit:
    path = folder / "rig.toml"
    path.write_text(
        'title = "rig"\nmodel = "disc_rig"\ncontacts = ["disc0"]\nlaws = { disc0 = "ageing" }\nstop_time = 8\n'
        f"free = {{ mu_s0 = 0.65, mu_k0 = 0.35, p0 = 15, b0 = {b} }}\ndrives = {{ w0 = 0.83 }}\n"
        "compute = { kind = 'trajectory' }\n",
        encoding="utf-8",
    )
    scene = read_scene(path)
    common = {"transient": 3.0, "scene": scene, "ripple": SMOOTH}
    runs = [Emulation(f"{w:g}", (Disc(drive_speed=w),), duration=10.0, **common) for w in (0.41, 0.83, 1.4)]
    if holds:
        disc = (Disc(drive_speed=0.41),)
        runs.append(Emulation("holds", disc, duration=held_duration(holds), holds=holds, **common))
    logs = [emulate(one, seed, number) for number, one in enumerate([*runs, free_decay()])]
    return fit_friction(pool(logs, allow_no_stick=True), law="Conti+ageing", estimator=estimator)


@pytest.fixture(scope="module")
def held(tmp_path_factory: pytest.TempPathFactory) -> FrictionFit:
    return fitted(tmp_path_factory.mktemp("held"), B, (0.3, 3.0, 30.0, 5.0, 15.0, 1.0))


@pytest.mark.nightly
def test_every_stick_lets_go_at_the_level_of_its_age(held: FrictionFit) -> None:
    assert held.breakaway is not None
    found = held.breakaway.releases
    levels = np.array([one.level for one in found])
    np.testing.assert_allclose(levels, [0.65 + B * np.log10(1 + one.stick / T_0) for one in found], atol=0.008)


def test_holds_over_two_decades_tell_the_growth(held: FrictionFit) -> None:
    seen = held.breakaway
    assert seen is not None and seen.growth is not None and seen.growth_deviation is not None
    assert seen.growth == pytest.approx(B, rel=0.1)
    assert abs(seen.growth - B) < 3 * seen.growth_deviation < 0.01
    assert any("Breakaway ages: it grows by" in warning for warning in held.warnings)
    assert fmu_parameters(held)["b0"] == seen.growth
    assert "b0" not in fmu_parameters(replace(held, breakaway=replace(seen, growth=None)))
    again = FrictionFit.from_json(held.to_json())
    assert again.breakaway == seen
    assert any("let go at" in said for said in certainty(held))


@pytest.mark.nightly
def test_a_growth_of_one_per_cent_a_decade_is_told_by_holds(tmp_path: Path) -> None:
    seen = fitted(tmp_path, 0.01, (0.3, 3.0, 30.0, 5.0, 15.0, 1.0), estimator="weak-form").breakaway
    assert seen is not None and seen.ages and seen.growth is not None and seen.growth_deviation is not None
    assert abs(seen.growth - 0.01) < 3 * seen.growth_deviation < 0.003


SENSORS = {"with edge times": (), "without edge times": ("_edge_time",), "laser alone": ("encoder",)}


@pytest.mark.parametrize("without", SENSORS.values(), ids=SENSORS)
@pytest.mark.parametrize("seed", some_nightly([1, 4, 9], [1]))
def test_sensors_that_tell_less_raise_no_alarm(without: tuple[str, ...], seed: int) -> None:
    logs = [emulate(one, seed, number) for number, one in enumerate(standard_set(duration=8.0, ripple=SMOOTH))]
    fit = fit_friction(lacking(logs, without), estimator="weak-form")
    seen = fit.breakaway
    assert seen is not None and not seen.ages
    # upward by noise, were x sought and not its square: 0.01 and more without edge times
    assert abs(seen.level - 0.65) < 3 * seen.deviation < 0.04


def test_an_encoder_alone_does_not_tell_where_sticks_let_go() -> None:
    logs = [emulate(one, 3, number) for number, one in enumerate(standard_set(duration=8.0, laser=None))]
    assert fit_friction(logs, estimator="weak-form").breakaway is None


@pytest.mark.nightly
def test_the_example_without_edge_times_does_not_age() -> None:
    logs = lacking(read_package(RIGS), ("_edge_time",))
    seen = fit_friction(logs, estimator="weak-form").breakaway
    assert seen is not None and not seen.ages and seen.level == pytest.approx(0.65, abs=3 * seen.deviation)


def test_a_log_that_never_sticks_is_passed_over() -> None:
    runs = standard_set(speeds=(0.41, 0.83, 3.0), duration=8.0, ripple=SMOOTH)
    logs = [emulate(one, 5, number) for number, one in enumerate(runs)]
    seen = fit_friction(pool(logs, allow_no_stick=True), estimator="weak-form").breakaway
    assert seen is not None and {one.log for one in seen.releases} == {0, 1}


def test_ageing_shows_without_holds_but_not_how_fast(tmp_path: Path) -> None:
    fit = fitted(tmp_path, B)
    seen = fit.breakaway
    assert seen is not None and seen.growth is None and seen.ages
    assert seen.excess == pytest.approx(B * np.log10(1 + 0.2 / T_0), abs=3 * seen.excess_deviation)
    assert "record holds" in seen.warnings[0]
    assert "holds over two decades" in _holds(fit)


@pytest.mark.nightly
def test_sticks_that_do_not_age_raise_no_alarm(tmp_path: Path) -> None:
    fit = fitted(tmp_path, 0.0)
    assert fit.breakaway is not None and not fit.breakaway.ages and not fit.breakaway.warnings
    assert abs(fit.breakaway.excess) < 3 * fit.breakaway.excess_deviation


def test_a_drive_that_holds_stands_still_as_long_as_asked() -> None:
    time, speed = with_holds(np.array([0.0, 60.0]), np.array([0.5, 0.5]), (2.0, 10.0), 1.0)
    assert time[-1] == pytest.approx(60.0)
    still = np.diff(np.flatnonzero(np.diff((speed < 1e-6).astype(int)))) * 1e-3
    np.testing.assert_allclose(still[::2], (2.0, 10.0), atol=0.01)
    assert speed[np.searchsorted(time, 1.0 + RUN - 0.1)] == 0.5
    assert held_duration((2.0, 10.0)) == pytest.approx(12.0 + 3 * RUN + 4 * RAMP)


def test_a_scene_asks_for_holds_and_a_log_without_room_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "rig.toml"
    path.write_text(
        'title = "rig"\nmodel = "disc_rig"\ncontacts = ["disc0"]\nlaws = { disc0 = "ageing" }\nstop_time = 8\n'
        'drives = { w0 = 0.41 }\ncompute = { kind = "trajectory" }\n'
        '[sensors]\nholds = ["300 ms", 3]\nsmoothing = "20 ms"\n',
        encoding="utf-8",
    )
    (one,) = emulations(read_scene(path))
    assert one.holds == (0.3, 3.0) and one.ripple == SMOOTH and one.duration == held_duration(one.holds)
    with pytest.raises(StickslipError, match="no room for 2 holds"):
        Emulation("short", holds=(3.0, 30.0))
    path.write_text(path.read_text().replace('["300 ms", 3]', "3"))
    with pytest.raises(StickslipError, match="must be a list of times"):
        emulations(read_scene(path))
