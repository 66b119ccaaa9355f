"""Measured series against closed forms: maps whose exponents are known, tones, tori, noise, sets of known dimension."""

import json

import numpy as np
import pytest
from benchmarks.bench_series import BLIND, Blind, flow, held, henon, logistic, noisy, roessler, tones
from typer.testing import CliRunner

from fmu_models import StickslipError
from fmu_models.base.record import record
from identification import Series, level_crossings, read_series, series_invariants
from identification.commands import application
from identification.series.divergence import divergences
from identification.series.embedding import delayed, false_neighbours, mutual_information, noise_level
from identification.series.invariants import correlation_dimension, recurrence, surrogate, zero_one_test
from identification.series.tangent import growth

RANDOM = np.random.default_rng(5)
QUICK = (
    "overtones",
    "stick-slip",
    "logistic 3.5",
    "torus fast",
    "circle map",
    "logistic 4",
    "henon",
    "transient logistic",
)


@pytest.mark.parametrize("name", QUICK)
def test_named_right_and_held(name):
    blind = BLIND[name]()
    found = series_invariants(noisy(blind, 3), whole=False)
    assert found.verdict == blind.verdict, found.sentence
    assert held(blind, found) is not False, found.sentence


def test_a_flow_is_chaos_within_a_tenth():
    values, step = flow(roessler(5.7), [1.0, 1.0, 0.0], 0.147, 12000)
    found = series_invariants(noisy(Blind(values, step, "chaos"), 0), whole=False)
    assert found.exponent == pytest.approx(0.0714, rel=0.1)
    assert found.interval is not None and found.interval[0] < 0.0714 < found.interval[1]


def driven(count: int) -> np.ndarray:
    """A damped oscillator that noise drives."""
    values = np.zeros(count)
    for i in range(2, count):
        values[i] = 1.8 * values[i - 1] - 0.9 * values[i - 2] + RANDOM.standard_normal()
    return values


def test_noise_and_what_it_drives_are_no_chaos():
    white = RANDOM.standard_normal(3000)
    for values in (white, driven(6000)):
        assert series_invariants(Series("noise", values, 1.0), whole=False).verdict == "noise"


def test_too_short_says_how_long():
    values, step = flow(roessler(5.7), [1.0, 1.0, 0.0], 0.147, 320)
    found = series_invariants(noisy(Blind(values, step, "chaos"), 0), whole=False)
    assert found.verdict == "too short"
    assert found.needed is not None and found.needed > 2 * found.cycles
    assert f"needs about {found.needed} cycles" in found.sentence


def test_all_methods_agree_on_the_logistic_map():
    found = series_invariants(Series("logistic", logistic(4.0), 1.0))
    for name, one in found.methods.items():
        assert one["value"] == pytest.approx(np.log(2), rel=0.15), name
    assert found.zero_one is not None and found.zero_one[0] > 0.95
    assert found.recurrence is not None and found.recurrence.rate == pytest.approx(0.05, abs=0.005)
    assert record(found)["verdict"] == "chaos" and set(record(found)["recurrence"]) >= {"rate", "longest"}


def test_the_growth_of_one_map_is_its_largest_eigenvalue():
    matrix = np.array([[1.3, 0.4, 0.0], [0.2, 0.9, 0.1], [0.0, 0.3, 0.5]])
    rates = growth(np.broadcast_to(matrix, (200, 3, 3)))
    assert rates[50:].mean() == pytest.approx(np.log(np.max(np.abs(np.linalg.eigvals(matrix)))), abs=1e-12)


def test_neighbours_of_the_doubling_map_part_by_ln_2():
    digits = RANDOM.integers(0, 2, 4052)  # of angles to base 2, which a map of floating numbers would use up
    angles = np.lib.stride_tricks.sliding_window_view(digits, 52) @ 0.5 ** np.arange(1, 53)
    rosenstein, kantz, _ = divergences(
        np.column_stack([np.cos(2 * np.pi * angles), np.sin(2 * np.pi * angles)]), 1, 0.0
    )
    for one in (rosenstein, kantz):
        assert one.value == pytest.approx(np.log(2), rel=0.1), one.method
        assert one.error < 0.1


def test_dimensions_of_a_circle_and_a_square():
    at = np.arange(6000)
    circle = np.column_stack([np.cos(0.7 * at), np.sin(0.7 * at)])
    square = RANDOM.uniform(size=(6000, 2))
    assert correlation_dimension(circle, 5, 0.0).value == pytest.approx(1.0, abs=0.05)
    assert correlation_dimension(square, 5, 0.0).value == pytest.approx(2.0, abs=0.15)


def test_the_dimension_does_not_count_neighbours_in_time():
    walk = np.cumsum(RANDOM.standard_normal((4000, 3)), axis=0) * 1e-3 + RANDOM.uniform(size=3)
    slow = np.column_stack([np.sin(np.arange(4000) / 700), np.cos(np.arange(4000) / 900)])
    near, far = (correlation_dimension(np.column_stack([slow, walk]), apart, 0.0).value for apart in (0, 600))
    assert far > near


def test_the_0_1_test_tells_regular_from_chaotic_in_noise():
    noise = 0.05 * RANDOM.standard_normal(3000)
    chaotic = zero_one_test(logistic(3.97) + noise, 1)
    regular = zero_one_test(tones((1, 0.1618, 0), count=3000) + noise, 1)
    assert chaotic and chaotic[0] > 0.9
    assert regular and regular[0] < 0.2
    assert zero_one_test(logistic(3.97)[:40], 1) is None


def test_a_surrogate_keeps_spectrum_and_values_alone():
    values = logistic(4.0, count=1024)
    made = surrogate(values, np.random.default_rng(0))
    assert np.array_equal(np.sort(made), np.sort(values))
    ours, theirs = np.abs(np.fft.rfft(values))[1:], np.abs(np.fft.rfft(made))[1:]
    assert np.linalg.norm(ours - theirs) < 0.05 * np.linalg.norm(ours)
    assert abs(np.corrcoef(values[1:], 4 * values[:-1] * (1 - values[:-1]))[0, 1]) > 0.999
    assert abs(np.corrcoef(made[1:], 4 * made[:-1] * (1 - made[:-1]))[0, 1]) < 0.2


def test_recurrence_of_a_circle_is_all_diagonals_and_of_noise_is_not():
    circle = delayed(tones((1, 0.02, 0), count=1200), 12, 2)
    regular, random = recurrence(circle, 1, 10), recurrence(RANDOM.uniform(size=(1200, 2)), 1)
    assert regular.determinism > 0.99 and regular.longest > 1000
    assert random.determinism < 0.2 and random.longest < 6


def test_delay_and_dimension():
    tone = tones((1, 1 / 40, 0), count=4000) + 1e-3 * RANDOM.standard_normal(4000)
    normal = driven(40000)
    for lag, found in enumerate(mutual_information(normal, 6), 1):
        correlation = np.corrcoef(normal[lag:], normal[:-lag])[0, 1]
        assert found == pytest.approx(-np.log(1 - correlation**2) / 2, rel=0.1, abs=0.03)
    assert false_neighbours(tone, 10, 1e-3, 40)[0] > 0.1 > false_neighbours(tone, 10, 1e-3, 40)[1]
    assert noise_level(tone) == pytest.approx(1e-3, rel=0.1)
    assert false_neighbours(henon(), 1, 0.0, 1)[1] < 0.01


def test_noise_crosses_no_level_twice():
    values = tones((1, 0.003, -0.5), count=10000) + 0.1 * RANDOM.standard_normal(10000)
    assert len(level_crossings(values, 0.0)) > 40
    crossings = level_crossings(values, 0.0, 0.4)
    assert len(crossings) == 30
    assert np.max(np.abs(np.diff(crossings) - 1 / 0.003)) < 20


def test_logs(tmp_path):
    def written(times, values):
        path = tmp_path / "run.csv"
        np.savetxt(path, np.column_stack([times, values]), delimiter=",", header="t,x", comments="")
        return path

    times = np.arange(600) * 0.01
    values = np.sin(20 * times)
    (one,) = read_series(written(times, values))
    assert one.step == pytest.approx(0.01) and not one.notes and one.name == "run.csv: x"
    uneven = times + 0.002 * np.sin(np.arange(600))
    (one,) = read_series(written(uneven, np.sin(20 * uneven)), ["x"])
    assert "resampled" in one.notes[0]
    assert one.values == pytest.approx(np.sin(20 * one.step * np.arange(len(one.values))), abs=0.02)
    with pytest.raises(StickslipError, match="samples are missing"):
        read_series(written(np.where(times > 3, times + 1, times), values))
    with pytest.raises(StickslipError, match="has no column 'y'"):
        read_series(written(times, values), ["y"])
    with pytest.raises(StickslipError, match="never changes"):
        read_series(written(times, 0 * values + 3))
    with pytest.raises(StickslipError, match="needs 200"):
        read_series(written(times[:50], values[:50]))
    assert series_invariants(written(times, values), "x", whole=False).period == pytest.approx(np.pi / 10, rel=1e-3)


def test_the_command(tmp_path):
    path, figure = tmp_path / "run.csv", tmp_path / "x.png"
    table = np.column_stack([np.arange(2000) * 0.01, tones((1, 0.021, 0), count=2000), logistic(4.0, count=2000)])
    np.savetxt(path, table, delimiter=",", header="t,x,y", comments="")
    call = ["series", str(path), "--column", "x", "--figure", str(figure), "--json"]
    done = CliRunner().invoke(application.only(call), call)
    assert done.exit_code == 0, done.output
    (found,) = json.loads(done.stdout)["series"]
    assert found["verdict"] == "periodic" and found["period"] == pytest.approx(0.01 / 0.021, rel=1e-6)
    assert figure.read_bytes().startswith(b"\x89PNG")
    again = CliRunner().invoke(application.only(call), call)
    assert again.exit_code and "--overwrite" in str(again.exception) + again.output
    both = ["series", str(path), "--figure", str(tmp_path / "y.png")]
    assert "Name one --column" in str(CliRunner().invoke(application.only(both), both).exception)
