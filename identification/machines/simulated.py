"""Motion of a machine with given base parameters, driven by measured efforts; many stretches of logs at once.

    M(q) a = tau - h(q, v),    M, h from the regressor;    with an observer  a + 2 w (v_m - v) + w^2 (q_m - q)

held near the measured motion (q_m, v_m) by w, or free (w = 0). Runge-Kutta of order 4 on the grid of the logs; sgn v of
Coulomb friction is smoothed over `SMOOTH` of the usual speed, which an instrument may be and a prediction notes.
"""

from dataclasses import dataclass

import numpy as np

from identification.machines.regressor import Regressor

SMOOTH = 0.02


@dataclass(frozen=True, eq=False)
class Stretches:
    """Equally long stretches of logs, (stretches, n, joints): measured position, velocity and effort; step: s."""

    step: float
    position: np.ndarray
    velocity: np.ndarray
    effort: np.ndarray


def run(
    regressor: Regressor, values: np.ndarray, stretches: Stretches, observer: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Position, velocity, acceleration (stretches, n, joints). values: (m,) of all monomials; observer: Hz; 0: free."""
    omega = 2 * np.pi * observer
    slow = SMOOTH * np.sqrt(np.mean(stretches.velocity**2, axis=(0, 1)))
    count, joints = stretches.position.shape[1:]
    # the same states without acceleration and with a unit one of each joint
    units = np.concatenate([np.zeros((1, joints)), np.eye(joints)])
    q, v = stretches.position[:, 0].copy(), stretches.velocity[:, 0].copy()
    states = np.empty((3, *stretches.position.shape))
    h = stretches.step

    def acceleration(q: np.ndarray, v: np.ndarray, effort: np.ndarray) -> np.ndarray:
        """(k, joints), where efforts (k, joints) act."""
        repeated = (np.tile(q, (joints + 1, 1)), np.tile(v, (joints + 1, 1)), np.repeat(units, len(q), axis=0))
        tau = (regressor(*repeated, smooth=slow) @ values).reshape(joints + 1, len(q), joints)
        mass = np.moveaxis(tau[1:] - tau[0], 0, -1)  # (k, joints, joints): columns by unit acceleration
        return np.linalg.solve(mass, (effort - tau[0])[..., None])[..., 0]

    def rate(q: np.ndarray, v: np.ndarray, at: float) -> np.ndarray:
        before, beyond, share = min(int(at), count - 1), min(int(at) + 1, count - 1), at - int(at)

        def between(signal: np.ndarray) -> np.ndarray:
            return (1 - share) * signal[:, before] + share * signal[:, beyond]

        a = acceleration(q, v, between(stretches.effort))
        if omega:
            a = a + 2 * omega * (between(stretches.velocity) - v) + omega**2 * (between(stretches.position) - q)
        return a

    for i in range(count):
        a1 = rate(q, v, i)
        states[:, :, i] = q, v, a1
        v2 = v + 0.5 * h * a1
        a2 = rate(q + 0.5 * h * v, v2, i + 0.5)
        v3 = v + 0.5 * h * a2
        a3 = rate(q + 0.5 * h * v2, v3, i + 0.5)
        v4 = v + h * a3
        a4 = rate(q + h * v3, v4, i + 1.0)
        q = q + h / 6 * (v + 2 * v2 + 2 * v3 + v4)
        v = v + h / 6 * (a1 + 2 * a2 + 2 * a3 + a4)
    return states[0], states[1], states[2]
