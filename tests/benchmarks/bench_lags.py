"""Lags of Newey and West: how often 95 % intervals hold the truth, by the rule that chooses the lags.

Run:  python tests/benchmarks/bench_lags.py RECIPE LOG [--seeds 200]        (emps DATA_EMPS.mat; where from: README)

The motion of the log and the parameters that were fitted to it are kept; the residual is replaced by noise of its
colour (autoregression of an order chosen by AIC). What the rules give stands in `inference.uncertainty.newey_west`.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np
from scipy.linalg import solve_toeplitz
from scipy.signal import lfilter

from identification.inference.uncertainty import QUANTILE, bartlett, newey_west, plain_covariance
from identification.measurement.recipe import read_recipe

sys.path.insert(0, str(Path(__file__).parents[1] / "helpers"))

from recipe_fit import inverse_dynamics

HIGHEST, SETTLE = 60, 2000  # order; samples


def autoregression(residual: np.ndarray) -> tuple[np.ndarray, float]:
    """Coefficients (k,) and deviation of the kicks, by Yule and Walker; k by AIC."""
    n = len(residual)
    r = residual - residual.mean()
    c = np.array([r[: n - lag] @ r[lag:] for lag in range(HIGHEST + 1)]) / n
    found = []
    for order in range(1, HIGHEST + 1):
        a = solve_toeplitz(c[:order], c[1 : order + 1])
        kick = c[0] - a @ c[1 : order + 1]
        found.append((n * np.log(kick) + 2 * order, a, float(np.sqrt(kick))))
    _, a, deviation = min(found, key=lambda one: one[0])
    return a, deviation


def andrews(score: np.ndarray) -> int:
    """Andrews (1991), (6.2), (6.4): each column as a first-order autoregression, the largest counts."""
    a = np.clip(np.sum(score[1:] * score[:-1], axis=0) / np.sum(score**2, axis=0), -0.97, 0.97)
    return int(np.ceil(np.max(1.1447 * (4 * a**2 * len(score) / ((1 - a) ** 2 * (1 + a) ** 2)) ** (1 / 3))))


def zero_crossing(residual: np.ndarray) -> int:
    """Twice the first lag without positive correlation."""
    r, n = residual - residual.mean(), len(residual)
    correlation = np.fft.irfft(np.abs(np.fft.rfft(r, 2 * n)) ** 2)[:n]
    return min(2 * (int(np.argmax(correlation <= 0)) or n), n // 2)


def prewhitened(score: np.ndarray) -> np.ndarray:
    """Covariance of the sum of scores by Andrews and Monahan (1992): first-order whitening, quadratic spectral."""
    n = len(score)
    u, s, v = np.linalg.svd(np.linalg.lstsq(score[:-1], score[1:], rcond=None)[0].T)
    step = u @ np.diag(np.minimum(s, 0.97)) @ v
    rest = score[1:] - score[:-1] @ step.T
    a = np.clip(np.sum(rest[1:] * rest[:-1], axis=0) / np.sum(rest[:-1] ** 2, axis=0), -0.97, 0.97)
    width = 1.3221 * (float(np.mean(4 * a**2 / (1 - a) ** 4)) * n) ** 0.2
    spread = rest.T @ rest
    for lag in range(1, min(int(30 * width) + 1, n - 1)):
        x = 6 * np.pi * lag / (5 * width)
        cross = rest[:-lag].T @ rest[lag:]
        spread = spread + 3 / x**2 * (np.sin(x) / x - np.cos(x)) * (cross + cross.T)
    back = np.linalg.inv(np.eye(len(step)) - step)
    return back @ spread @ back.T


def deviations(design: np.ndarray, residual: np.ndarray) -> dict[str, np.ndarray]:
    """Standard deviations (m,) by rule; those with a share of lags are widened as in `newey_west`."""
    inverse, n = np.linalg.inv(design.T @ design), len(residual)
    score, log = design * residual[:, None], np.zeros(n)

    def of(lags: int, share: float = 0.0) -> np.ndarray:
        wide = float(np.polynomial.polynomial.polyval(share, QUANTILE) / QUANTILE[0])
        return wide * np.sqrt(np.diag(inverse @ bartlett(score, lags, log) @ inverse))

    root = int(np.ceil(1.3 * np.sqrt(n)))
    return {
        "white residuals": np.sqrt(np.diag(plain_covariance(design, residual))),
        "AR(1) of the scores": of(andrews(score @ inverse)),
        "first zero crossing, twice": of(zero_crossing(residual)),
        "1.3 sqrt(n), widened": of(root, root / n),
        "n/20, widened (ours)": np.sqrt(np.diag(newey_west(design, residual))),
        "n/10, widened": of(n // 10, 0.1),
        "prewhitened": np.sqrt(np.diag(inverse @ prewhitened(score) @ inverse)),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("recipe")
    parser.add_argument("log")
    parser.add_argument("--seeds", type=int, default=200)
    asked = parser.parse_args()
    recipe = read_recipe(asked.recipe)
    identified = inverse_dynamics(recipe, asked.log).identified
    assert identified is not None
    rows = identified.rows
    design, seen = rows.columns, rows.residual(identified.best.values)
    a, deviation = autoregression(seen)
    held: dict[str, list[np.ndarray]] = {}
    for seed in range(asked.seeds):
        kicks = deviation * np.random.default_rng(seed).normal(size=len(seen) + SETTLE)
        noise = lfilter([1.0], [1.0, *-a], kicks)[SETTLE:]
        error = np.linalg.lstsq(design, noise, rcond=None)[0]
        for rule, one in deviations(design, noise - design @ error).items():
            held.setdefault(rule, []).append(np.abs(error) < 1.96 * one)
    print(f"{len(seen)} samples, colour of order {len(a)}; truth in 95 % intervals, %")
    print(f"{'':28}", *(f"{name:>8}" for name in rows.names))
    for rule, inside in held.items():
        print(f"{rule:28}", *(f"{100 * share:8.1f}" for share in np.mean(inside, axis=0)))


if __name__ == "__main__":
    main()
