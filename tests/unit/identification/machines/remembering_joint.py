"""Logs of a joint with memory in its friction, emulated: the motion is given, and friction follows by DOP853 along it
or by clipping on a fine grid; nothing here is what the estimators compute with."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.integrate import solve_ivp
from sympy import S, cos

from fmu_models import Coordinate, Coulomb, Friction, Input, Mechanism, Parameter
from identification.machines.motion import MachineLog

RATE = 250.0  # Hz
J, WEIGHT, VISCOUS = 0.05, 0.8, 0.02  # kg m2, N m, N m s/rad
SLIDING, STIFF = 0.5, 25.0  # N m, N m/rad


def joint() -> Mechanism:
    """A link on a joint with Coulomb and viscous friction: what a user declares who knows of no memory."""
    q = Coordinate("q", "rad", "angle from hanging", velocity="w")
    inertia = Parameter("J", 0.05, "kg m2", "inertia of the link", positive=True)
    weight = Parameter("G", 0.8, "N m", "weight by length of the link", minimum=0.0)
    viscous = Parameter("b", 0.02, "N m s/rad", "viscous friction", minimum=0.0)
    dry = Parameter("f", 0.5, "N m", "Coulomb friction", minimum=0.0)
    return Mechanism(
        name="link",
        title="Link on a joint",
        source="tests",
        coordinates=[q],
        kinetic_energy=inertia * q.v**2 / 2,
        potential_energy=-weight * cos(q),
        dissipation=viscous * q.v**2 / 2,
        applied={q: Input("tau", 0.0, "N m", "torque")},
        contacts=[Friction(name="dry", slip=q.v, law=Coulomb(N=S.One, mu=dry))],
    )


class Trajectory:
    """A sum of sines, with small swings upon large ones: presliding and sliding."""

    def __init__(self, seed: int) -> None:
        rng = np.random.default_rng(seed)
        self.waves = 2 * np.pi * np.array([0.1, 0.37, 0.9, 1.7]) * rng.uniform(0.9, 1.1, 4)
        self.sizes = np.array([0.3, 0.15, 0.08, 0.04]) * rng.uniform(0.8, 1.2, 4)
        self.phases = rng.uniform(0, 2 * np.pi, 4)

    def __call__(self, t: np.ndarray, order: int = 0) -> np.ndarray:
        turned = np.multiply.outer(t, self.waves) + self.phases + order * np.pi / 2
        return np.sin(turned) @ (self.sizes * self.waves**order)


def dahl(way: Trajectory, time: np.ndarray, z: float) -> np.ndarray:
    """Friction (n,), N m, from an elongation z in rad."""

    def rate(t: float, state: np.ndarray) -> np.ndarray:
        v = way(np.array(t), 1)
        return v - np.abs(v) * STIFF * state / SLIDING

    run = solve_ivp(rate, time[[0, -1]], [z], method="DOP853", t_eval=time, rtol=1e-9, atol=1e-12, max_step=0.01)
    return STIFF * run.y[0]


def maxwell(way: Trajectory, time: np.ndarray, z: float) -> np.ndarray:
    """Friction (n,) of two sliders that give way at .01 and .04 rad, with 20 and 7.5 N m/rad."""
    fine = 20
    steps = np.diff(way(np.linspace(time[0], time[-1], fine * (len(time) - 1) + 1)))
    elongations = np.clip([z, z], [-0.01, -0.04], [0.01, 0.04])
    force = [elongations @ [20.0, 7.5]]
    for number, step in enumerate(steps, 1):
        elongations = np.clip(elongations + step, [-0.01, -0.04], [0.01, 0.04])
        if number % fine == 0:
            force.append(elongations @ [20.0, 7.5])
    return np.array(force)


def lugre(way: Trajectory, time: np.ndarray, z: float) -> np.ndarray:
    """Friction (n,) that falls from .7 to .5 N m with bristles of 25 N m/rad."""

    def rate(t: float, state: np.ndarray) -> np.ndarray:
        v = way(np.array(t), 1)
        return v - np.abs(v) * STIFF * state / (0.5 + 0.2 / (1 + 5 * np.abs(v)))

    run = solve_ivp(rate, time[[0, -1]], [z], method="DOP853", t_eval=time, rtol=1e-9, atol=1e-12, max_step=0.01)
    return STIFF * run.y[0]


def rigid(way: Trajectory, time: np.ndarray, z: float) -> np.ndarray:
    """Coulomb's."""
    return SLIDING * np.sign(way(time, 1))


def log(
    seed: int,
    friction: Callable[[Trajectory, np.ndarray, float], np.ndarray],
    *,
    duration: float = 6.0,
    noise: float = 0.02,
    count: float = 2 * np.pi / 2**17,
    way: Trajectory | None = None,
) -> MachineLog:
    """A log from an unknown elongation on. noise: N m, white; count: rad, of the encoder."""
    rng, way = np.random.default_rng(1000 + seed), way or Trajectory(seed)
    time = np.arange(int(duration * RATE)) / RATE
    q = way(time)
    smooth = J * way(time, 2) + WEIGHT * np.sin(q) + VISCOUS * way(time, 1)
    effort = smooth + friction(way, time, rng.uniform(-0.02, 0.02)) + noise * rng.normal(size=len(time))
    return MachineLog(f"link-{seed}", time, (count * np.round(q / count))[:, None], effort[:, None])
