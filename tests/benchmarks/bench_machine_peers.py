"""A robot of a URDF by this suite, by plain least squares on Pinocchio's regressor, and by FIGAROH, on the same logs.

Run:  python tests/benchmarks/bench_machine_peers.py [--logs 2] [--cutoff 10] [--noise 0] [--links 7]
(needs the extra ``bench``: pin, and figaroh, which is left out where it is not there)

Logs of the emulated two-link arm, of which the truth is known; one more is held out. ``--noise``: rad, white on the
positions on top. Printed for each: Coulomb and viscous friction with their deviations, and how many deviations they are
off; error of inertia and weight (efforts without friction over random motion, % of the true ones); error on the
held-out log; CPU time, over that of plain least squares. Below: what it takes to declare a spatial chain of ``--links``
links and to make its regressor, and a row of it, over Pinocchio's.
"""

from __future__ import annotations

import argparse
import importlib
import importlib.util
import sys
import tempfile
import time
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "helpers"))

from emulated_arm import ARM, log, torques
from scipy.signal import butter, decimate, sosfiltfilt
from urdf_robots import arm, robot

from identification.machines.inverse import identify_machine
from identification.machines.motion import MachineLog
from identification.machines.regressor import regressor_of
from identification.machines.urdf import mechanism_from_urdf

pinocchio: Any = importlib.import_module("pinocchio")
FRICTION = {"fv1": "b1", "fv2": "b2", "fs1": "f1", "fs2": "f2"}
URDF = arm().replace("continuous", "revolute")  # which Pinocchio counts with two numbers
THINNED = 5
QUARTER = 4  # FIGAROH's low-pass takes a quarter of the cutoff that it is given

Regress = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]


@dataclass(frozen=True)
class Found:
    """values, deviations: by name of friction; efforts: (n, 2) of motion by these values, with friction or without."""

    values: dict[str, float]
    deviations: dict[str, float]
    efforts: Callable[[np.ndarray, np.ndarray, np.ndarray, bool], np.ndarray]


def ours(logs: Sequence[MachineLog], cutoff: float, method: str, path: Path) -> Found:
    """By this suite."""
    mechanism = mechanism_from_urdf(path)
    fit = identify_machine(mechanism, logs, cutoff=cutoff, method=method)
    regressor = regressor_of(mechanism)
    places = [regressor.names.index(one.name) for one in fit.parameters]

    def efforts(q: np.ndarray, v: np.ndarray, a: np.ndarray, friction: bool) -> np.ndarray:
        values = np.array([one.value if friction or not one.frictional else 0.0 for one in fit.parameters])
        return regressor(q, v, a)[:, :, places] @ values

    found = {one.name: one for one in fit.parameters}
    return Found(
        {name: found[name].value for name in FRICTION},
        {name: found[name].standard_deviation for name in FRICTION},
        efforts,
    )


def with_friction(inertial: Regress) -> Regress:
    """Columns of Pinocchio and, behind them, fv, fs, ia and offset of each joint, as FIGAROH has them."""

    def whole(q: np.ndarray, v: np.ndarray, a: np.ndarray) -> np.ndarray:
        each = [np.concatenate([np.diag(x) for x in part]) for part in (v, np.sign(v), a, np.ones_like(v))]
        return np.hstack([inertial(q, v, a).reshape(2 * len(q), -1), *each]).reshape(len(q), 2, -1)

    return whole


def pinocchios() -> Regress:
    """Y (n, 2, 20) of Pinocchio."""
    model = pinocchio.buildModelFromXML(URDF)
    data = model.createData()

    def inertial(q: np.ndarray, v: np.ndarray, a: np.ndarray) -> np.ndarray:
        rows = [pinocchio.computeJointTorqueRegressor(model, data, *one).copy() for one in zip(q, v, a, strict=True)]
        return np.array(rows)

    return inertial


def moved(one: MachineLog, cutoff: float) -> tuple[np.ndarray, ...]:
    """Position, velocity, acceleration, effort after the same low-pass, by central differences."""
    step = float(one.time[1] - one.time[0])
    sections = butter(4, 2 * cutoff * step, output="sos")
    q, effort = (sosfiltfilt(sections, x, axis=0, padlen=100) for x in (one.position, one.effort))
    v = np.gradient(q, step, axis=0)
    return q, v, np.gradient(v, step, axis=0), effort


def plain(logs: Sequence[MachineLog], cutoff: float) -> Found:
    """Least squares on Pinocchio's columns as if residuals were white, every fifth sample."""
    regress = with_friction(pinocchios())
    each = zip(*(moved(one, cutoff) for one in logs), strict=True)
    motion = [np.concatenate([x[50:-50:THINNED] for x in part]) for part in each]
    columns, effort = regress(*motion[:3]).reshape(2 * len(motion[0]), -1), motion[3].ravel()
    _, r = np.linalg.qr(columns / np.maximum(np.linalg.norm(columns, axis=0), 1e-12))
    kept = np.flatnonzero(np.abs(np.diag(r)) > 1e-8)
    values = np.zeros(columns.shape[1])
    values[kept] = np.linalg.lstsq(columns[:, kept], effort, rcond=None)[0]
    off = effort - columns @ values
    covariance = np.linalg.inv(columns[:, kept].T @ columns[:, kept]) * (off @ off) / (len(off) - len(kept))
    deviations = np.zeros(len(values))
    deviations[kept] = np.sqrt(np.diag(covariance))
    return standard(regress, values, deviations)


def standard(regress: Regress, values: np.ndarray, deviations: np.ndarray) -> Found:
    """Of values (28,) of Pinocchio's parameters and of friction."""
    places = dict(zip(("fv1", "fv2", "fs1", "fs2"), range(20, 24), strict=True))

    def efforts(q: np.ndarray, v: np.ndarray, a: np.ndarray, friction: bool) -> np.ndarray:
        taken = values.copy()
        if not friction:
            taken[[*range(20, 24), 26, 27]] = 0.0
        return regress(q, v, a) @ taken

    found, known_to = ({name: float(x[place]) for name, place in places.items()} for x in (values, deviations))
    return Found(found, known_to, efforts)


def figarohs(logs: Sequence[MachineLog], cutoff: float, path: Path) -> Found:
    """FIGAROH's filter, differences, regressor, base parameters and deviations."""
    tools, qr, columns_of, robots = (
        importlib.import_module(f"figaroh.{name}")
        for name in ("identification.identification_tools", "tools.qrdecomposition", "tools.regressor", "tools.robot")
    )
    machine = robots.Robot(str(path), [str(path.parent)])
    step = float(logs[0].time[1] - logs[0].time[0])
    asked = {"ts": step, "cut_off_frequency_butterworth": QUARTER * cutoff, "act_idxv": [0, 1]}
    asked |= {"has_friction": True, "has_actuator_inertia": True, "has_joint_offset": True, "is_joint_torques": True}
    columns, effort = [], []
    for one in logs:
        q = tools.low_pass_filter_data(one.position, asked)
        tau = tools.low_pass_filter_data(one.effort, asked)[:-2]
        motion = tools.calculate_first_second_order_differentiation(machine.model, q, asked)
        whole = columns_of.build_regressor_basic(machine, *motion, asked)
        for joint in (0, 1):
            rows = slice(joint * len(tau), (joint + 1) * len(tau))
            columns.append(decimate(whole[rows], THINNED, axis=0))
            effort.append(decimate(tau[:, joint], THINNED))
    names = [f"{i}" for i in range(28)]
    everything, efforts = np.concatenate(columns), np.concatenate(effort)
    reduced, kept = columns_of.eliminate_non_dynaffect(everything, dict.fromkeys(names, 0.0))
    base, named, _, phi = qr.QRDecomposer().double_decomposition(efforts, reduced, kept)
    shares = tools.relative_stdev(base, phi, efforts) / 100
    values, deviations = np.zeros(28), np.zeros(28)
    for name, value, share in zip(named, phi, shares, strict=True):
        place = int(str(name).split()[0].split("*")[-1])
        values[place], deviations[place] = value, share * abs(value)
    return standard(with_friction(pinocchios()), values, deviations)


def shown(name: str, found: Found, seconds: float, reference: float, held_out: MachineLog, cutoff: float) -> None:
    """One line for each."""
    rng = np.random.default_rng(0)
    motion = rng.uniform(-2, 2, (200, 2)), *rng.normal(0, (3.0,), (2, 200, 2))
    slow = motion[0], np.zeros((200, 2)), motion[2]
    true = torques(*slow)
    inertial = np.linalg.norm(found.efforts(*slow, False) - true) / np.linalg.norm(true)
    q, v, a, effort = (x[50:-50:THINNED] for x in moved(held_out, cutoff))
    off = np.linalg.norm(found.efforts(q, v, a, True) - effort, axis=0) / np.linalg.norm(effort, axis=0)
    parts = []
    for key, of in FRICTION.items():
        value, sd = found.values[key], found.deviations[key]
        parts.append(f"{key} {value:.4f} +- {sd:.4f} ({(value - ARM[of]) / sd:+.1f})")
    print(f"{name:16s} {'; '.join(parts)}")
    held = " ".join(f"{100 * x:.2f}" for x in off)
    times = seconds / reference
    print(f"{'':16s} inertia, weight {100 * inertial:.2f} %; held out {held} %; {seconds:.2f} s, {times:.1f}")


def timed(work: Callable[[], Found]) -> tuple[Found, float]:
    """What it finds, and CPU s."""
    begin = time.process_time()
    return work(), time.process_time() - begin


def chain(links: int, folder: Path) -> None:
    """How long a spatial chain takes."""
    text = robot(range(links), ["revolute"] * links)
    (folder / "chain.urdf").write_text(text)
    begin = time.process_time()
    mechanism = mechanism_from_urdf(folder / "chain.urdf")
    declared = time.process_time()
    regressor = regressor_of(mechanism)
    made = time.process_time()
    motion = np.random.default_rng(1).normal(size=(3, 1000, links))
    regressor(*motion)
    done = time.process_time()
    model = pinocchio.buildModelFromXML(text)
    data = model.createData()
    for row in range(1000):
        pinocchio.computeJointTorqueRegressor(model, data, *motion[:, row])
    theirs = time.process_time() - done
    print(f"{links} spatial links: declared {declared - begin:.1f} s, regressor {made - declared:.1f} s CPU;", end=" ")
    print(f"a row {(done - made):.2f} ms, {(done - made) / theirs:.0f} times Pinocchio's")


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--logs", type=int, default=2)
    parser.add_argument("--cutoff", type=float, default=10.0, help="Hz")
    parser.add_argument("--noise", type=float, default=0.0, help="rad, on the positions")
    parser.add_argument("--links", type=int, default=7)
    asked = parser.parse_args()
    warnings.simplefilter("ignore")
    rng = np.random.default_rng(5)
    every = [log(100 + number) for number in range(asked.logs + 1)]
    noisy = [replace(one, position=one.position + asked.noise * rng.normal(size=one.position.shape)) for one in every]
    seen, held_out = noisy[:-1], every[-1]
    with tempfile.TemporaryDirectory() as name:
        path = Path(name) / "arm.urdf"
        path.write_text(URDF)
        ways: dict[str, Callable[[], Found]] = {
            "plain, Pinocchio": lambda: plain(seen, asked.cutoff),
            "least squares": lambda: ours(seen, asked.cutoff, "least squares", path),
            "instruments": lambda: ours(seen, asked.cutoff, "instruments", path),
        }
        if importlib.util.find_spec("figaroh"):
            ways["FIGAROH"] = lambda: figarohs(seen, asked.cutoff, path)
        else:
            print("FIGAROH is not here: pip install figaroh.")
        found = {way: timed(work) for way, work in ways.items()}
        for way, (one, seconds) in found.items():
            shown(way, one, seconds, found["plain, Pinocchio"][1], held_out, asked.cutoff)
        chain(asked.links, Path(name))


if __name__ == "__main__":
    main()
