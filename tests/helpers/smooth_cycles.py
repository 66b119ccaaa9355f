"""Cycles of smooth rates by other means than this suite's: DOP853 and Newton's method."""

from __future__ import annotations

from typing import Any

import mpmath as mp
import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import root_scalar


def eigenvalues(jacobian) -> list[Any]:
    """Largest modulus first."""
    return sorted(mp.eig(mp.matrix(jacobian), left=False, right=False), key=lambda z: -abs(z))


def flow(rates, start, length):
    """DOP853 with the derivative by the start, of complex steps; the solution as a function of time, the derivative."""
    n = len(start)

    def both(t, y):
        x, slopes = y[:n], y[n:].reshape(n, n)
        steps = [rates(t, x + 1e-30j * e).imag / 1e-30 for e in np.eye(n)]
        return np.concatenate([rates(t, x), (np.stack(steps, axis=1) @ slopes).ravel()])

    y = np.concatenate([start, np.eye(n).ravel()])
    run = solve_ivp(both, (0.0, length), y, method="DOP853", rtol=1e-13, atol=1e-14, dense_output=True)
    return run.sol, run.y[n:, -1].reshape(n, n)


def cycle(rates, start, length, *, forced: bool = False):
    """Newton's method on x(T) = x, and on T where nothing forces it: period, extremes and multipliers."""
    x = np.array(start, float)
    for _ in range(8):
        run, slopes = flow(rates, x, length)
        n, end = len(x), run(length)[: len(x)]
        matrix, miss = slopes - np.eye(n), end - x
        if not forced:
            matrix = np.block([[matrix, rates(0.0, end)[:, None]], [rates(0.0, x), 0.0]])
            miss = np.append(miss, 0.0)
        move = np.linalg.solve(matrix, -miss)
        x, length = x + move[:n], length if forced else length + move[n]
    run, slopes = flow(rates, x, length)
    times = np.linspace(0.0, length, 4001)
    values: dict[str, Any] = {"period": length}
    for i in range(len(x)):
        samples = run(times)[i]
        for side, sign in (("min", 1.0), ("max", -1.0)):
            t = times[(sign * samples).argmin()]
            near = {"bracket": (t - length / 4000, t + length / 4000), "xtol": 1e-15}
            top = root_scalar(lambda t, i=i: rates(t, run(t % length)[: len(x)])[i], **near).root
            values[f"{i}_{side}"] = run(top % length)[i]
    order = sorted(np.linalg.eigvals(slopes), key=lambda m: -abs(m))
    values |= {f"multiplier{i}_real": m.real for i, m in enumerate(order, 1)}
    return values | {str(i): value for i, value in enumerate(x)}


def named(values, *states: str, only: str) -> dict[str, Any]:
    """Those that are asked for, states by their names."""
    numbers = {state: str(i) for i, state in enumerate(states)}
    return {name: values["_".join([numbers.get(p, p) for p in name.split("_")])] for name in only.split()}
