"""The regressor of a robot against Pinocchio's, column by column: a tree with turning, sliding and fixed joints."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from urdf_robots import robot

from identification.machines.regressor import Regressor, regressor_of
from identification.machines.urdf import mechanism_from_urdf

pinocchio = pytest.importorskip(
    "pinocchio", reason="Pinocchio is not here: pip install 'stickslip[bench]' brings it (pin)"
)

# as Pinocchio orders the parameters of a body
NAMES = ("m", "sx", "sy", "sz", "Jxx", "Jxy", "Jyy", "Jxz", "Jyz", "Jzz")
GRAVITY = (1.7, -9.3, 2.6)  # of a robot on a wall that leans
KINDS = ("revolute", "revolute", "prismatic", "revolute", "revolute")
CARRIERS = (0, 1, 2, 3, 2)  # the fifth begins a second branch


def both(text: str, folder: Path) -> tuple[Regressor, Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]]:
    """Our regressor, and Pinocchio's as a function of one motion, its rows and columns in our order."""
    (folder / "robot.urdf").write_text(text)
    mechanism = mechanism_from_urdf(folder / "robot.urdf", gravity=GRAVITY, friction=False)
    model = pinocchio.buildModelFromXML(text)
    model.gravity.linear = np.array(GRAVITY)
    data = model.createData()
    # Pinocchio orders the joints of a tree by name
    order = [model.getJointId(q.description) - 1 for q in mechanism.coordinates]
    columns = [10 * joint + parameter for joint in order for parameter in range(len(NAMES))]

    def theirs(*motion: np.ndarray) -> np.ndarray:
        there = [np.zeros(model.nv) for _ in motion]
        for one, values in zip(there, motion, strict=True):
            one[order] = values
        return pinocchio.computeJointTorqueRegressor(model, data, *there)[np.ix_(order, columns)]

    return regressor_of(mechanism), theirs


def test_the_regressor_of_a_tree_is_pinocchios(tmp_path: Path):
    ours, theirs = both(robot(CARRIERS, KINDS), tmp_path)
    motion = np.random.default_rng(3).normal(size=(3, 5, len(KINDS)))
    found = np.zeros((5, len(KINDS), len(KINDS), len(NAMES)))
    for place, values in zip(ours.names, np.moveaxis(ours(*motion), 2, 0), strict=True):
        if place[:-1] in NAMES:
            found[:, :, int(place[-1]) - 1, NAMES.index(place[:-1])] = values
    found = found.reshape(5, len(KINDS), -1)
    for row in range(5):
        assert found[row] == pytest.approx(theirs(*motion[:, row]), abs=1e-10)
    assert np.abs(found).max() > 10


def test_what_the_file_says_of_bodies_is_as_pinocchio_reads_it(tmp_path: Path):
    """Tools at fixed joints among them."""
    text = robot(CARRIERS, KINDS)
    (tmp_path / "robot.urdf").write_text(text)
    mechanism = mechanism_from_urdf(tmp_path / "robot.urdf")
    model = pinocchio.buildModelFromXML(text)
    declared = {p.name: p.value for p in mechanism.parameters}
    for i in range(1, len(KINDS) + 1):
        body = model.inertias[model.getJointId(f"joint{i}")].toDynamicParameters()
        # the first joint turns about an axis at rest: no energy holds all of its link's parameters
        theirs = dict(zip((f"{name}{i}" for name in NAMES), body, strict=True))
        shown = declared.keys() & theirs.keys()
        assert len(shown) == (5 if i == 1 else 10)
        assert {name: declared[name] for name in shown} == pytest.approx({n: theirs[n] for n in shown}, abs=1e-12)
