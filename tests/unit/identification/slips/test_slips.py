"""Slip events against the engine's own events, and statistics of series whose truth is known."""

from __future__ import annotations

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from machine_log import FRICTION, coloured, recipe_of
from typer.testing import CliRunner
from whole_application import app

from fmu_models.base.errors import StickslipError
from fmu_models.codegen.package import built
from fmu_models.fmu.fmu import Fmu
from fmu_models.simulation.run import simulate
from identification.measurement.recipe import read_recipe
from identification.measurement.signals import GRAVITY
from identification.slips.block_on_belt import fit_slip_model
from identification.slips.events import find_slips
from identification.slips.statistics import SETTINGS, SlipStatistics, Statistic, slip_statistics, statistic
from rig_io.readers.csv_log import write

M, K, V = 0.5, 50.0, 0.01  # kg, N/m, m/s
MU_S, MU_K = 0.6, 0.45
STEP = 1e-3  # s
PERIOD = 2 * np.pi * np.sqrt(M / K)
RECIPE = f"""title = "slider"
{FRICTION}
[slips]
mass = "0.5 kg"
stiffness = 50
speed = "10 mm/s"
"""


@pytest.fixture(scope="module")
def run():
    """A block on a belt for 60 s: friction over weight from the spring, and the engine's events."""
    fmu = Fmu.open(built("block_on_belt"))
    time = np.arange(0.0, 60.0, STEP)
    parameters = {"m": M, "k": K, "c": 0.0, "N": M * GRAVITY, "mu_s": MU_S, "mu_k": MU_K, "p": 2000.0}
    done = simulate(
        fmu, time[-1], output_times=time, parameters=parameters, inputs={"v_belt": V}, start={"x": 0.04, "v": V}
    )
    return done, done["x"] * K / (M * GRAVITY)


def tears(run) -> np.ndarray:
    """Times at which the engine lets the block go."""
    return np.array([event.time for event in run.events if event.before == 0])


@pytest.mark.parametrize("noise", [0.0, 0.002], ids=["clean", "noisy"])
def test_every_tear_of_the_engine_is_found_at_its_time(run, noise):
    done, friction = run
    rng = np.random.default_rng(1)
    seen = friction + noise * rng.normal(size=len(friction))
    spikes = rng.integers(0, len(seen), 50 if noise else 0)
    seen[spikes] += 0.05  # glitches of single samples, as recorders have them
    found = find_slips([(done.time, seen)], STEP, 0.1 * PERIOD)
    expected = tears(done)
    assert len(found.time) == len(expected) > 10
    # a peak is as sharp as its noise lets it be: 6 standard deviations at the loading rate
    late = found.time - expected
    assert np.max(np.abs(late)) < 0.03 + 6 * noise / (K * V / (M * GRAVITY))
    assert np.median(found.peak) == pytest.approx(MU_S, abs=1e-3 + 2 * noise)
    # a steep law without damping overshoots as far as it fell
    assert np.median(found.after) == pytest.approx(2 * MU_K - MU_S, abs=0.02)
    assert np.nanmedian(found.loading) == pytest.approx(K * V / (M * GRAVITY), rel=0.01)


def test_noise_alone_has_no_slips():
    for seed in range(10):
        rng = np.random.default_rng(seed)
        steady = 0.4 + 0.01 * rng.normal(size=20_000)
        assert len(find_slips([(np.arange(20_000) * STEP, steady)], STEP, 20 * STEP).time) == 0


@given(
    drops=st.lists(st.floats(0.05, 0.2), min_size=6, max_size=20),
    gain=st.floats(0.2, 5.0),
    shift=st.floats(-1.0, 1.0),
    resolution=st.sampled_from([0.0, 0.002]),
)
@settings(max_examples=30, deadline=None)
def test_a_saw_gives_its_teeth_in_any_unit_and_resolution(drops, gain, shift, resolution):
    """Rise of any size, then a fall within 20 samples: peaks, valleys and intervals are those of the saw."""
    rise = np.array(drops)
    heights = [np.linspace(0, up, 200, endpoint=False) for up in rise]
    falls = [np.linspace(up, 0, 20, endpoint=False) for up in rise]
    saw = np.concatenate(
        [part for pair in zip(heights, falls, strict=True) for part in pair] + [np.linspace(0, 0.3, 300)]
    )
    if resolution:
        saw = np.round(saw / resolution) * resolution
    time = np.arange(len(saw)) * STEP
    found = find_slips([(time, gain * saw + shift)], STEP, 5 * STEP, share=0.1)
    assert len(found.time) == len(rise)
    assert found.drop == pytest.approx(gain * rise, abs=gain * (0.012 + resolution))
    assert found.interval[1:] == pytest.approx(0.22, abs=0.01 + 0.02 * (resolution > 0))


def test_a_fall_whose_begin_or_end_was_not_recorded_is_no_event():
    tooth = np.concatenate([np.linspace(0, 0.2, 200), np.linspace(0.2, 0, 20)])
    saw = np.tile(tooth, 8)
    cut = saw[207:-5]  # from the middle of the first fall to that of the last
    found = find_slips([(np.arange(len(cut)) * STEP, cut)], STEP, 3 * STEP)
    assert len(found.time) == 6
    assert found.time[0] == pytest.approx(0.213, abs=0.003)


def test_partial_slips_are_counted_apart():
    rng = np.random.default_rng(0)
    rises = np.tile([0.2, 0.2, 0.03], 10)
    parts = [np.concatenate([np.linspace(0, up, 200), np.linspace(up, 0, 20)]) for up in rises]
    saw = np.concatenate([*parts, np.linspace(0, 0.3, 300)]) + 1e-3 * rng.normal(size=30 * 220 + 300)
    pieces = [(np.arange(len(saw)) * STEP, saw)]
    assert (len(find_slips(pieces, STEP, 5 * STEP).time), find_slips(pieces, STEP, 5 * STEP).beyond_noise) == (20, 30)
    assert find_slips(pieces, STEP, 5 * STEP).partial == 10
    assert len(find_slips(pieces, STEP, 5 * STEP, share=0.0).time) == 30


def test_a_whole_slip_that_the_end_of_the_log_cuts_off_is_no_partial_one():
    tooth = np.concatenate([np.linspace(0, 0.2, 200), np.linspace(0.2, 0, 20)])
    cut = np.concatenate([np.tile(tooth, 8), np.linspace(0, 0.05, 50)])  # the last rise is seen to a quarter
    found = find_slips([(np.arange(len(cut)) * STEP, cut)], STEP, 3 * STEP)
    assert (len(found.time), found.beyond_noise, found.partial) == (7, 8, 0)


def test_a_slip_of_few_samples_takes_as_long_as_one_of_many(run):
    """90 % of the same fall, to a tenth of the sample interval, wherever the samples happen to lie."""
    done, friction = run
    fine = find_slips([(done.time, friction)], STEP, 0.06)
    assert np.all(fine.end > fine.time + fine.duration)
    for begin in (0, 4, 9, 14):
        rough = find_slips([(done.time[begin::20], friction[begin::20])], 20 * STEP, 0.06)
        assert np.median(rough.duration) == pytest.approx(np.median(fine.duration), abs=2 * STEP)


def test_slips_that_repeat_themselves_are_not_called_irregular(tmp_path, run):
    done, friction = run
    noise = np.random.default_rng(3).normal(size=len(friction))
    wander = np.interp(done.time, np.arange(0.0, 61.0, 2.0), np.random.default_rng(4).normal(size=31))
    for disturbed, said in ((1e-3 * noise, "so do these slips"), (0.03 * wander, "no law of slip speed alone")):
        write(tmp_path / "log.csv", {"time": done.time, "f": friction + disturbed})
        statistics, _ = slip_statistics(read_recipe(recipe_of(tmp_path, RECIPE)), tmp_path / "log.csv")
        model = fit_slip_model(statistics)
        assert model is not None
        assert said in model.verdict


@pytest.mark.nightly
def test_the_model_is_smoothed_as_the_log_was(tmp_path, run):
    """A long window takes much off the peaks; off those of the model too, so that its coefficients stay."""
    done, friction = run
    write(tmp_path / "log.csv", {"time": done.time, "f": friction})
    recipe = read_recipe(recipe_of(tmp_path, RECIPE))
    statistics, _ = slip_statistics(recipe, tmp_path / "log.csv", {"smoothing": 0.3})
    assert statistics.peak.value < MU_S - 0.01
    model = fit_slip_model(statistics)
    assert model is not None
    assert (model.mu_s, model.mu_k) == pytest.approx((MU_S, MU_K), rel=0.01)


def test_the_model_of_a_log_of_few_samples_is_smoothed_over_three_of_them(tmp_path, run):
    """12 and 5 samples in a natural period: by a tenth of it the coefficients would be 0.7 and 2.4 % too small."""
    done, friction = run
    recipe = read_recipe(recipe_of(tmp_path, RECIPE))
    for every, near in ((52, 0.005), (125, 0.01)):
        write(tmp_path / "log.csv", {"time": done.time[::every], "f": friction[::every]})
        statistics, _ = slip_statistics(recipe, tmp_path / "log.csv")
        assert statistics.smoothed == pytest.approx(3 * every * STEP)
        model = fit_slip_model(statistics)
        assert model is not None
        assert (model.mu_s, model.mu_k) == pytest.approx((MU_S, MU_K), rel=near)


def test_the_loading_is_the_same_whenever_a_log_was_taken():
    time, saw = np.arange(20 * 220) / 1024, np.tile(np.r_[np.linspace(0, 0.2, 200), np.linspace(0.2, 0, 20)], 20)
    begun, later = (find_slips([(start + time, saw)], 1 / 1024, 0.005).loading for start in (0.0, 2.0**30))
    assert len(begun) > 15 and later == pytest.approx(begun, rel=1e-9, nan_ok=True)


def test_a_log_with_hardly_a_sample_in_stick_says_nothing_of_the_loading(tmp_path):
    time = np.arange(0.0, 30.0, PERIOD / 6)
    write(tmp_path / "log.csv", {"time": time, "f": 0.4 + 0.05 * np.sin(2 * np.pi * time / PERIOD)})
    statistics, _ = slip_statistics(read_recipe(recipe_of(tmp_path, RECIPE)), tmp_path / "log.csv")
    assert "Too few samples lie in stick" in " ".join(statistics.verdicts)
    assert "nan" not in " ".join(statistics.verdicts)


def test_peaks_that_no_coefficients_meet_exactly_have_their_law():
    """The model's peaks lie on samples, so that they jump. Measured ones in closed form, of a slider drawn fast, where
    the search went to and fro: friction falls at once and swings about mu_k with an amplitude that V is part of."""
    speed, frequency = 10 * V, 2 * np.pi / PERIOD
    unit = M * GRAVITY / K  # m of the spring
    fall, carried = MU_S - MU_K, speed / frequency / unit
    swing = np.hypot(fall, carried)
    period = 2 * fall * unit / speed + (np.pi + 2 * np.arctan2(carried, fall)) / frequency
    peak, after, drop, mean, slip = (
        Statistic(one, one, one, 0.0) for one in (MU_K + swing, MU_K - swing, 2 * swing, period, PERIOD / 2)
    )
    known = {"mass": M, "stiffness": K, "speed": speed}
    measured = (peak, after, drop, mean, 0.0, slip, 1.0, 1.0, known, ())
    counted = (10, 10, drop.value / 2, 0.0)
    model = fit_slip_model(SlipStatistics("", "", "", 10 * period, "large", 0.1 * PERIOD, *counted, *measured))
    assert model is not None
    assert (model.mu_s, model.mu_k) == pytest.approx((MU_S, MU_K), rel=0.01)


def test_no_period_reaches_across_a_gap(tmp_path, run):
    done, friction = run
    keep = (done.time < 20) | (done.time > 35)
    write(tmp_path / "log.csv", {"time": done.time[keep], "f": friction[keep]})
    statistics, events = slip_statistics(read_recipe(recipe_of(tmp_path, RECIPE)), tmp_path / "log.csv")
    whole = find_slips([(done.time, friction)], STEP, 0.1 * PERIOD)
    assert np.nanmax(events.interval) < 1.01 * np.nanmax(whole.interval)
    assert np.sum(~np.isfinite(events.interval)) == 2
    assert statistics.period.value == pytest.approx(np.nanmean(whole.interval), rel=0.01)


def test_the_model_that_made_a_log_is_found_again(tmp_path, run):
    done, friction = run
    noise = 0.001 * np.random.default_rng(3).normal(size=len(friction))
    write(tmp_path / "log.csv", {"time": done.time, "f": friction + noise})
    statistics, _ = slip_statistics(read_recipe(recipe_of(tmp_path, RECIPE)), tmp_path / "log.csv")
    model = fit_slip_model(statistics)
    assert model is not None
    assert (model.mu_s, model.mu_k) == pytest.approx((MU_S, MU_K), rel=0.01)
    assert model.predictions[2].ratio == pytest.approx(1.0, abs=0.02)
    # its law falls within about a two-hundredth of the greatest slip speed
    assert model.p * (MU_S - MU_K) * GRAVITY * np.sqrt(M / K) == pytest.approx(200, rel=0.1)
    assert any("stiffness, speed and mass fit the log" in verdict for verdict in statistics.verdicts)


def test_a_slider_that_swings_keeps_its_statistics_and_gets_no_law(tmp_path):
    """Slips at the natural period are those of a swing; in words, beside the statistics, by the command too."""
    time = np.arange(0.0, 30.0, STEP)
    write(tmp_path / "log.csv", {"time": time, "f": 0.4 + 0.05 * np.sin(2 * np.pi * time / PERIOD)})
    recipe = recipe_of(tmp_path, RECIPE)
    statistics, _ = slip_statistics(read_recipe(recipe), tmp_path / "log.csv")
    assert statistics.period.value == pytest.approx(PERIOD, rel=1e-3)
    assert statistics.drop.value == pytest.approx(0.1, rel=2e-2)  # what the running median takes off
    assert any("inertial regime" in verdict for verdict in statistics.verdicts)
    with pytest.raises(StickslipError, match="as fast as the slider swings"):
        fit_slip_model(statistics)
    done = CliRunner().invoke(app, ["slips", str(recipe), str(tmp_path / "log.csv"), "--json"])
    said = json.loads(done.stdout)
    assert (done.exit_code, said["events"], said["model"]) == (0, statistics.events, None)
    assert "as fast as the slider swings" in said["no_model"]


def test_a_wrong_stiffness_shows_in_the_loading(tmp_path, run):
    done, friction = run
    write(tmp_path / "log.csv", {"time": done.time, "f": friction})
    recipe = read_recipe(recipe_of(tmp_path, RECIPE))
    statistics, _ = slip_statistics(recipe, tmp_path / "log.csv", {"stiffness": 100.0})
    assert statistics.loading_expected is not None
    assert statistics.loading / statistics.loading_expected == pytest.approx(0.5, rel=0.02)
    assert any("is not that of this log" in verdict for verdict in statistics.verdicts)


def test_the_interval_of_a_median_grows_with_the_memory_of_the_series():
    """Blocks as long as the memory: for AR(1) of 0.8 the mean varies 3 times as much as for white noise."""
    rng = np.random.default_rng(4)
    white, slow = rng.normal(size=400), coloured(400, 0.8, rng)
    width = {name: s.high - s.low for name, s in (("white", statistic(white, 0)), ("slow", statistic(slow, 0)))}
    assert width["white"] == pytest.approx(2 * 1.96 * 1.2533 / 20, rel=0.3)
    assert 1.7 < width["slow"] / width["white"] < 4
    assert statistic(white, 7) == statistic(white, 7)


@pytest.mark.parametrize("count", [6, 12, 36, 100])
def test_the_interval_of_a_few_periods_holds_the_truth(count):
    """A period is (peak - value after the slip before)/rate: two in succession share the peak, as x[i] + x[i+1] do.

    Of 300 logs 19 in 20 are to be held; 0.91 is three standard deviations of that below, 1.5 blocks are what 6 have.
    """
    rng = np.random.default_rng(5)
    held = 0
    for _ in range(300):
        peaks = rng.normal(size=count + 1)
        found = statistic(peaks[1:] + peaks[:-1] + rng.normal(size=count), 0, mean=True, draws=200)
        held += found.low <= 0 <= found.high
    assert held / 300 > 0.91


def test_where_a_value_stands_in_a_log_does_not_matter_to_its_interval():
    """Blocks of 2 of 6: the outlier is in 3 of 3 with a chance of 1/27, wherever it stands, so that the upper end is
    6 3/6, widened as Student's with 2 degrees of freedom is."""
    wider = 4.302653 / 1.959964 * np.sqrt(3 / 2)
    for place in range(6):
        found = statistic(np.roll([6.0, 0.0, 0.0, 0.0, 0.0, 0.0], place), 0, mean=True, draws=4000)
        assert (found.low, found.high) == pytest.approx((1 - wider, 1 + 2 * wider)), place


@pytest.mark.parametrize(
    ("text", "setting", "message"),
    [
        (RECIPE, {"stifness": 2.0}, "no setting 'stifness'. Did you mean 'stiffness'"),
        (RECIPE, {"mass": 0.0}, "'mass' must be finite and above 0"),
        (RECIPE, {"stiffness": np.nan}, "'stiffness' must be finite and above 0"),
        (RECIPE, {"stiffness": np.inf}, "'stiffness' must be finite and above 0"),
        (RECIPE, {"mass": 1e9}, "smoothed over .* s, which is more than its 4.999 s"),
        (RECIPE, {"share": 1.2}, "'share' must lie from 0 to below 1"),
        (RECIPE, {"definition": "evry"}, "no definition 'evry'.* Did you mean 'every'"),
        (RECIPE, {"definition": "every", "share": 0.3}, "with the definition 'every' there is none"),
        (RECIPE.replace('mass = "0.5 kg"\n', ""), {}, r"give mass=\.\.\."),
        (RECIPE.split("[slips]")[0] + '[terms]\nc = "viscous"\n', {}, r"needs \[slips\]"),
    ],
)
def test_what_is_missing_or_wrong_is_said(tmp_path, run, text, setting, message):
    done, friction = run
    write(tmp_path / "log.csv", {"time": done.time[:5000], "f": friction[:5000]})
    with pytest.raises(StickslipError, match=message):
        how = {"definition": setting["definition"]} if "definition" in setting else {}
        said = {name: value for name, value in setting.items() if name != "definition"}
        slip_statistics(read_recipe(recipe_of(tmp_path, text)), tmp_path / "log.csv", said, **how)


def test_slips_with_a_gap_between_them_have_no_period(tmp_path, run):
    done, friction = run
    keep = np.ones(len(done.time), dtype=bool)
    for tear in tears(done):
        keep &= ~((done.time > tear + 2.4) & (done.time < tear + 2.7))
    write(tmp_path / "log.csv", {"time": done.time[keep], "f": friction[keep]})
    with pytest.raises(StickslipError, match=r"a gap of the clock lies between nearly all of its \d+ slip events"):
        slip_statistics(read_recipe(recipe_of(tmp_path, RECIPE)), tmp_path / "log.csv")


def test_constants_of_another_slider_and_a_sensor_the_wrong_way_get_no_law(tmp_path, run):
    done, friction = run
    write(tmp_path / "log.csv", {"time": done.time, "f": friction})
    write(tmp_path / "negative.csv", {"time": done.time, "f": -friction})
    recipe = read_recipe(recipe_of(tmp_path, RECIPE))
    for log, setting, message in (
        ("log.csv", {"mass": 1e-9}, "too much stick to be simulated"),
        ("log.csv", {"speed": 1e-6}, "it slides steadily, or sticks"),
        ("negative.csv", {}, "write gain = -1"),
    ):
        statistics, _ = slip_statistics(recipe, tmp_path / log, setting)
        with pytest.raises(StickslipError, match=message):
            fit_slip_model(statistics)


def test_the_help_tells_every_setting_with_its_unit():
    said = " ".join(CliRunner().invoke(app, ["slips", "--help"], env={"COLUMNS": "200"}).output.split())
    for name, setting in SETTINGS.items():
        assert (name if setting.unit == "1" else f"{name} ({setting.unit})") in said


def test_a_folder_is_no_log(tmp_path):
    with pytest.raises(StickslipError, match="is a folder, where one log is wanted"):
        slip_statistics(read_recipe(recipe_of(tmp_path, RECIPE)), tmp_path)


def test_a_log_without_slips_is_refused(tmp_path):
    time = np.arange(5000) * STEP
    write(tmp_path / "log.csv", {"time": time, "f": 0.4 + 0.01 * np.random.default_rng(0).normal(size=5000)})
    with pytest.raises(StickslipError, match="shows 0 slip events"):
        slip_statistics(read_recipe(recipe_of(tmp_path, RECIPE)), tmp_path / "log.csv")
