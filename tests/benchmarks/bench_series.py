"""Blind series: how often the motion is named right, and how often the interval of 95 % holds the true value.

Run:  python tests/benchmarks/bench_series.py [--seeds 1] [--only NAME,...]
Each is simulated, noise of 1 % of its rms (or as said) is added, and `series_invariants` is told values and step alone.
True values: of maps and flows from the literature (Sprott, Chaos and Time-Series Analysis, 2003, appendix A), of hinge
and support from two other codes, of periods and tori those they were made with. Printed for each: the answer, the
exponent over the true one, and whether the interval holds it; then the shares of all.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

from fmu_models import simulate
from identification import Series, SeriesInvariants, series_invariants

PER_CYCLE = 40  # samples
DROPPED = 300  # periods of forcing until a motion is on its attractor
SUPPORT = {"m": 1.0, "k": 1.0, "c": 0.05, "f0": 0.5, "cs": 0.6, "ks": 300.0, "g": 1.6}
THIRD = {**SUPPORT, "f0": 0.7, "ks": 1000.0, "g": 2.0}
GOLDEN = (np.sqrt(5) - 1) / 2


@dataclass(frozen=True)
class Blind:
    """values: without noise, at ``step``; truth: exponent, period, or two frequencies; None where nobody knows it."""

    values: np.ndarray
    step: float
    verdict: str
    truth: float | tuple[float, float] | None = None
    noise: float = 0.01


def forced(model: str, frequency: float, parameters: dict[str, float], *, start=(0.0, 0.0), periods: int = 1000):
    """x of an oscillator of this suite, from where it is on its attractor, and the step."""
    step = 1 / (frequency * PER_CYCLE)
    times = step * np.arange(DROPPED * PER_CYCLE, (DROPPED + periods) * PER_CYCLE)
    run = simulate(
        model, times[-1], parameters=parameters, start=dict(zip("xv", start, strict=True)), output_times=times
    )
    return np.asarray(run["x"])[-len(times) :], step


def hinge(f: float, **options) -> tuple[np.ndarray, float]:
    return forced("hinge_clearance", f, {"f": f}, **options)


def support(omega: float, parameters: dict[str, float], **options) -> tuple[np.ndarray, float]:
    return forced("discontinuous_support", omega / (2 * np.pi), {**parameters, "omega": omega}, **options)


def flow(rates: Callable, start: list[float], step: float, count: int, dropped: int = 2000) -> tuple[np.ndarray, float]:
    """First state of a flow, at even steps."""
    times = step * np.arange(dropped, dropped + count)
    run = solve_ivp(rates, (0, times[-1]), start, t_eval=times, rtol=1e-8, atol=1e-10, method="DOP853")
    return run.y[0], step


def lorenz(rho: float) -> Callable:
    return lambda t, u: (10 * (u[1] - u[0]), u[0] * (rho - u[2]) - u[1], u[0] * u[1] - 8 / 3 * u[2])


def roessler(c: float) -> Callable:
    return lambda t, u: (-u[1] - u[2], u[0] + 0.2 * u[1], 0.2 + u[2] * (u[0] - c))


def ueda(damping: float, force: float) -> Callable:
    return lambda t, u: (u[1], -damping * u[1] - u[0] ** 3 + force * np.cos(t))


def logistic(r: float, start: float = 0.3123, count: int = 3000, dropped: int = 100) -> np.ndarray:
    values = [start]
    for _ in range(count + dropped - 1):
        values.append(r * values[-1] * (1 - values[-1]))
    return np.array(values[dropped:])


def henon(count: int = 3000) -> np.ndarray:
    x, y, values = 0.1, 0.1, []
    for _ in range(count + 100):
        x, y = 1 - 1.4 * x * x + y, 0.3 * x
        values.append(x)
    return np.array(values[100:])


def tones(*parts: tuple[float, float, float], count: int = 20000) -> np.ndarray:
    """Sum of amplitude * cos(2 pi frequency t + phase)."""
    at = np.arange(count)
    return sum((a * np.cos(2 * np.pi * f * at + p) for a, f, p in parts), np.zeros(count))


def late_logistic(r: float, least: int) -> np.ndarray:
    """A motion in a window of periods that is chaotic for ``least`` steps at first."""
    for start in np.linspace(0.1, 0.9, 401):
        values = logistic(r, start, 3 * least, 0)
        if np.any(np.abs(values[least + 60 : least + 120] - values[least : least + 60]) > 1e-3):
            return values
    raise AssertionError("no start stays that long")


def stick_slip(period: float, count: int = 20000) -> np.ndarray:
    """Rises slowly and falls quickly: a kink a corner."""
    phase = np.arange(count) / period % 1
    return np.where(phase < 0.85, phase / 0.85, (1 - phase) / 0.15)


def circle(winding: float, coupling: float, count: int = 4000) -> np.ndarray:
    angle, values = 0.1, []
    for _ in range(count):
        angle += winding + coupling / (2 * np.pi) * np.sin(2 * np.pi * angle)
        values.append(np.cos(2 * np.pi * angle) + 0.3 * np.cos(4 * np.pi * angle))
    return np.array(values)


F, G = 1 / 37.3, 1 / 37.3 * np.sqrt(2) / 2
FOURTH = {**THIRD, "f0": 0.45}
BLIND: dict[str, Callable[[], Blind]] = {
    "tone": lambda: Blind(tones((1, F, 0)), 1.0, "periodic", 1 / F, 0.05),
    "overtones": lambda: Blind(tones((1, F, 0), (0.5, 2 * F, 1), (0.3, 5 * F, 2)), 0.1, "periodic", 0.1 / F, 0.1),
    "subharmonic": lambda: Blind(tones((1, F, 0), (0.3, F / 3, 1)), 1.0, "periodic", 3 / F),
    "stick-slip": lambda: Blind(stick_slip(41.7), 0.01, "periodic", 0.417, 0.02),
    "logistic 3.5": lambda: Blind(logistic(3.5), 1.0, "periodic", 4.0),
    "roessler 4": lambda: Blind(*flow(roessler(4.0), [1, 1, 0], 0.15, 16000), "periodic"),
    "hinge .429": lambda: Blind(*hinge(0.429, periods=300), "periodic", 1 / 0.429, 0.03),
    "hinge .398": lambda: Blind(*hinge(0.398, periods=300), "periodic", 3 / 0.398),
    "support fourth": lambda: Blind(
        *support(0.9, FOURTH, start=(1.088193291921281, 0.407062081316524), periods=300), "periodic", 8 * np.pi / 0.9
    ),
    "torus sum": lambda: Blind(tones((1, F, 0), (0.6, F * GOLDEN, 1)), 1.0, "quasiperiodic", (F, F * GOLDEN)),
    "torus weak": lambda: Blind(tones((1, F, 0), (0.1, G, 1)), 1.0, "quasiperiodic", (F, G), 0.02),
    "torus noisy": lambda: Blind(tones((1, F, 0), (0.5, G, 1)), 1.0, "quasiperiodic", (F, G), 0.1),
    "torus modulated": lambda: Blind(tones((1, F, 0), (0.4, F + G / 5, 0), (0.4, F - G / 5, 0)), 1.0, "quasiperiodic"),
    "torus product": lambda: Blind(np.tanh(2 * tones((1, F, 0), (0.5, G, 1))), 1.0, "quasiperiodic", (F, G)),
    "torus fast": lambda: Blind(tones((1, 0.21, 0), (0.7, 0.21 * GOLDEN, 1), count=4000), 1.0, "quasiperiodic"),
    "circle map": lambda: Blind(circle(0.606661, 0.7), 1.0, "quasiperiodic"),
    "hinge .41": lambda: Blind(*hinge(0.41), "chaos", 0.131869),
    "hinge .405": lambda: Blind(*hinge(0.405), "chaos", 0.25799),
    "hinge .37": lambda: Blind(*hinge(0.37), "chaos", 0.252249),
    "support .94": lambda: Blind(*support(0.94, SUPPORT), "chaos", 0.05625),
    "support .93": lambda: Blind(*support(0.93, SUPPORT), "chaos", 0.056905),
    "support third": lambda: Blind(*support(0.9, THIRD), "chaos", 0.037968),
    "roessler": lambda: Blind(*flow(roessler(5.7), [1, 1, 0], 0.147, 20000), "chaos", 0.0714),
    "lorenz": lambda: Blind(*flow(lorenz(28.0), [1, 1, 20], 0.02, 20000), "chaos", 0.9056),
    "ueda": lambda: Blind(*flow(ueda(0.05, 7.5), [1, 1], np.pi / 20, 20000), "chaos", 0.1025),
    "logistic 4": lambda: Blind(logistic(4.0), 1.0, "chaos", np.log(2)),
    "logistic 3.9": lambda: Blind(logistic(3.9), 1.0, "chaos", 0.49600944),
    "henon": lambda: Blind(henon(), 1.0, "chaos", 0.41922449),
    "transient logistic": lambda: Blind(late_logistic(3.9602, 400), 1.0, "transient chaos"),
    "transient lorenz": lambda: Blind(*flow(lorenz(22.5), [1, 1, 20], 0.02, 20000, 0), "transient chaos"),
}


def noisy(blind: Blind, seed: int) -> Series:
    """The series as it is handed over."""
    noise = np.random.default_rng(seed).standard_normal(len(blind.values))
    return Series("blind", blind.values + blind.noise * blind.values.std() * noise, blind.step)


def held(blind: Blind, found: SeriesInvariants) -> bool | None:
    """Whether intervals of 95 % hold the true values; None where there are none, or another motion was named."""
    if blind.truth is None or found.verdict != blind.verdict:
        return None
    if isinstance(blind.truth, tuple):
        misses = np.abs(np.subtract(sorted(found.frequencies), sorted(blind.truth)))
        return bool(np.all(misses <= 2.24 * max(found.frequency_errors)))
    if found.interval is not None:
        return found.interval[0] <= blind.truth <= found.interval[1]
    assert found.period is not None and found.period_error is not None
    return abs(found.period - blind.truth) <= 1.96 * found.period_error


def results(names: list[str], seeds: int) -> Iterator[tuple[str, Blind, SeriesInvariants, float]]:
    """Name, series, answer and seconds of each."""
    for name in names:
        blind = BLIND[name]()
        for seed in range(seeds):
            begin = time.perf_counter()
            found = series_invariants(noisy(blind, seed), whole=False, seed=seed)
            yield name, blind, found, time.perf_counter() - begin


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--only", default=",".join(BLIND))
    asked = parser.parse_args()
    named, covered = [], []
    for name, blind, found, seconds in results(asked.only.split(","), asked.seeds):
        right, inside = found.verdict == blind.verdict, held(blind, found)
        named.append(right)
        covered += [] if inside is None else [inside]
        ratio = f"{found.exponent / blind.truth:.3f}" if found.exponent and isinstance(blind.truth, float) else ""
        said = f"{'right' if right else 'WRONG'} {'' if inside is None else 'held' if inside else 'MISSED'} {ratio}"
        print(f"{name:20} {seconds:5.1f} s  {said:22} {found.sentence}", flush=True)
    print(f"named right: {sum(named)} of {len(named)}; intervals that hold: {sum(covered)} of {len(covered)}")


if __name__ == "__main__":
    main()
