"""The disc rig typed out: (1), (2), (11) to (16) with sgn written out, for any set of discs that touch."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from replay import Rates, straight

from fmu_models.simulation.signal import Signal

STATES = ["theta", "omega"]
LINER_RUBBER = {f"{name}{i}": value for i in (0, 1) for name, value in (("mu_s", 0.5), ("mu_k", 0.33), ("p", 20.0))}


def normal_forces(N: float) -> dict[str, float]:
    return {"N0": N, "N1": N}


def disc_rates(w0: Signal, w1: Signal) -> Callable[[float, Mapping[str, int]], Rates]:
    """Rates of theta and omega for paper/rubber; in stick the body keeps the disc's speed."""
    J, k, c, R, r, N, mu_s, mu_k, p = 0.0548, 2.62, 0.055, 0.125, 0.06, 4.905, 0.65, 0.35, 15.0

    def within(middle: float, contacts: Mapping[str, int]) -> Rates:
        drives = [straight(w0, middle), straight(w1, middle)]
        states = [contacts["disc0"], contacts["disc1"]]
        touched = [(sign, w) for sign, (w, _) in zip(states, drives, strict=True) if sign != 2]
        if 0 in states:
            slope = drives[states.index(0)][1]
            return lambda t, x: [x[1], r * slope / R]

        def slipping(t, x):
            theta, omega = x
            torque = -c * omega - k * theta
            for sign, w in touched:
                v = r * w(t) - R * omega
                torque += R * N * sign * ((mu_s - mu_k) / (1 + p * sign * v) + mu_k)
            return [omega, torque / J]

        return slipping

    return within
