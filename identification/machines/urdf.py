"""A robot's kinematics from a URDF, as a declared mechanism whose inertial and friction parameters are to be found.

Each link i has a mass m, first moments sx, sy, sz and six inertias about its joint; each joint a rotor inertia Ia,
viscous friction fv, Coulomb friction fs and an offset of its effort. What the file says of masses and inertias becomes
their declared values. Energies are built link by link in the links' own frames and never multiplied out.

Source of the form: Khalil, Dombre, Modeling, Identification and Control of Robots (2002), chapters 3 and 9.
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Sequence
from dataclasses import dataclass
from xml.etree import ElementTree

import numpy as np
import sympy

from fmu_models.base.errors import StickslipError
from fmu_models.base.files import existing
from fmu_models.language.contacts import Friction
from fmu_models.language.laws.coulomb import Coulomb
from fmu_models.language.mechanism import Mechanism
from fmu_models.language.quantities import Coordinate, Input, Parameter

GRAVITY = (0.0, 0.0, -9.81)  # m/s^2, in the frame of the base
SMALL = 1e-9  # of a rotation's entry: what pi/2 in eleven digits leaves of 0
PAIRS = ("xx", "yy", "zz", "xy", "xz", "yz")


@dataclass(frozen=True)
class _Joint:
    name: str
    kind: str
    parent: str
    child: str
    turn: np.ndarray
    offset: np.ndarray
    axis: np.ndarray


@dataclass(frozen=True)
class _Body:
    """mass, first moments (3,) and inertia (3, 3) about the joint, in its frame."""

    mass: float
    moments: np.ndarray
    inertia: np.ndarray


def mechanism_from_urdf(
    path: str | os.PathLike[str], *, gravity: Sequence[float] = GRAVITY, friction: bool = True
) -> Mechanism:
    """A serial robot. Coordinates are named q1, q2, ... from the base on, efforts tau1, tau2, ...

    Raises:
        StickslipError: the file is no URDF, or its joints branch, or neither turn nor slide, or lead to no link.
    """
    file = existing(path, "URDF")
    try:
        root = ElementTree.parse(file).getroot()
    except ElementTree.ParseError as error:
        raise StickslipError(f"'{path}' is no URDF ({error}).") from error
    if root.tag != "robot":
        raise StickslipError(f"'{path}' is no URDF: it begins with <{root.tag}>, a URDF with <robot>.")
    bodies = {str(link.get("name")): _body(link) for link in root.findall("link")}
    chain = _chain(os.fspath(path), [_joint(one) for one in root.findall("joint")])
    for joint in chain:
        if joint.child not in bodies:
            raise StickslipError(
                f"Joint '{joint.name}' of '{path}' leads to '{joint.child}', and no link is called so."
            )
    if all(joint.kind == "fixed" for joint in chain):
        raise StickslipError(f"No joint of '{path}' moves: there is nothing to find.")
    name = _identifier(root.get("name") or file.stem)
    return _declared(name, chain, bodies, np.array(gravity, dtype=float), friction)


def _declared(
    name: str, chain: Sequence[_Joint], bodies: dict[str, _Body], gravity: np.ndarray, friction: bool
) -> Mechanism:
    zero = sympy.zeros(3, 1)
    v, w, down, height = zero, zero, sympy.Matrix(gravity), sympy.S.Zero
    kinetic, potential, dissipation = sympy.S.Zero, sympy.S.Zero, sympy.S.Zero
    coordinates, contacts, applied = [], [], {}
    for joint in chain:
        offset = sympy.Matrix(joint.offset)
        turn, slide, axis = sympy.Matrix(joint.turn).T, zero, sympy.Matrix(joint.axis)
        velocity, along = sympy.S.Zero, zero
        if joint.kind != "fixed":
            number = len(coordinates) + 1
            turns = joint.kind != "prismatic"
            q = Coordinate(f"q{number}", "rad" if turns else "m", joint.name, velocity=f"w{number}")
            coordinates.append(q)
            if turns:
                turn, velocity = _about(joint.axis, q).T * turn, q.v
            else:
                slide, along = axis * q, axis * q.v
        # the frame of the parent, then what the joint adds
        reach = offset + sympy.Matrix(joint.turn) * slide
        height = height - down.dot(reach)
        v, w, down = turn * (v + w.cross(reach)) + along, turn * w + axis * velocity, turn * down
        body = bodies[joint.child]
        if joint.kind == "fixed" and not body.mass:
            continue
        m, moments, inertia = _parameters(len(coordinates), joint, body)
        kinetic += (m * v.dot(v) + w.dot(inertia * w)) / 2 + moments.dot(v.cross(w))
        potential += m * height - down.dot(moments)
    for number, q in enumerate(coordinates, 1):
        unit = "N m" if q.unit == "rad" else "N"
        inertial = "kg m2" if q.unit == "rad" else "kg"
        kinetic += Parameter(f"Ia{number}", 0.0, inertial, "rotor inertia at the joint", minimum=0.0) * q.v**2 / 2
        applied[q] = Input(f"tau{number}", 0.0, unit, f"effort of joint {number}")
        if friction:
            viscous = Parameter(f"fv{number}", 0.0, f"{unit} s" if q.unit == "rad" else "N s/m", "viscous", minimum=0.0)
            dissipation += viscous * q.v**2 / 2
            dry = Parameter(f"fs{number}", 0.0, unit, "Coulomb friction", minimum=0.0)
            contacts.append(Friction(name=f"joint{number}", slip=q.v, law=Coulomb(N=sympy.S.One, mu=dry)))
            applied[q] -= Parameter(f"offset{number}", 0.0, unit, "offset of the effort")
    return Mechanism(
        name=name,
        title=f"{name}, {len(coordinates)} joints",
        source="its URDF",
        coordinates=coordinates,
        kinetic_energy=kinetic,
        potential_energy=potential,
        dissipation=dissipation,
        applied=applied,
        contacts=contacts,
    )


def _parameters(number: int, joint: _Joint, body: _Body) -> tuple[Parameter, sympy.Matrix, sympy.Matrix]:
    tag = f"{number}" if joint.kind != "fixed" else f"{number}_{_identifier(joint.child)}"
    m = Parameter(f"m{tag}", body.mass, "kg", f"mass of {joint.child}")
    moments = [
        Parameter(f"s{c}{tag}", float(value), "kg m", "mass times centre")
        for c, value in zip("xyz", body.moments, strict=True)
    ]
    terms = {}
    for a, b in PAIRS:
        value = float(body.inertia["xyz".index(a), "xyz".index(b)])
        terms[a + b] = Parameter(f"J{a}{b}{tag}", value, "kg m2", f"inertia of {joint.child}")
    inertia = sympy.Matrix([[terms["".join(sorted(a + b))] for b in "xyz"] for a in "xyz"])
    return m, sympy.Matrix(moments), inertia


def _chain(path: str, joints: Sequence[_Joint]) -> list[_Joint]:
    """From the base on; fixed ends without joints after them are kept."""
    children = {joint.child for joint in joints}
    bases = {joint.parent for joint in joints} - children
    if len(bases) != 1:
        raise StickslipError(f"'{path}' has {len(bases)} bases ({', '.join(sorted(bases))}); a robot has one.")
    (at,) = bases
    found: list[_Joint] = []
    while True:
        after = [joint for joint in joints if joint.parent == at]
        if not after:
            return found
        if len(after) > 1:
            raise StickslipError(
                f"'{path}' branches at '{at}' ({', '.join(joint.child for joint in after)}): a serial robot is read. "
                "Declare a tree as a Mechanism."
            )
        (joint,) = after
        if joint.kind not in ("revolute", "continuous", "prismatic", "fixed"):
            raise StickslipError(
                f"Joint '{joint.name}' of '{path}' is '{joint.kind}'; revolute, continuous, prismatic "
                "and fixed ones are read."
            )
        found.append(joint)
        at = joint.child


def _joint(one: ElementTree.Element) -> _Joint:
    parent, child, axis = one.find("parent"), one.find("child"), one.find("axis")
    if parent is None or child is None:
        raise StickslipError(f"Joint '{one.get('name')}' has no parent or no child: this is no whole URDF.")
    turn, offset = _origin(one)
    direction = _numbers("1 0 0" if axis is None else axis.get("xyz", "1 0 0"))
    length = float(np.linalg.norm(direction))
    if length == 0:
        raise StickslipError(f"The axis of joint '{one.get('name')}' is zero.")
    return _Joint(
        str(one.get("name")),
        str(one.get("type")),
        str(parent.get("link")),
        str(child.get("link")),
        turn,
        offset,
        direction / length,
    )


def _body(link: ElementTree.Element) -> _Body:
    inertial = link.find("inertial")
    if inertial is None:
        return _Body(0.0, np.zeros(3), np.zeros((3, 3)))
    turn, centre = _origin(inertial)
    mass_of, inertia_of = inertial.find("mass"), inertial.find("inertia")
    mass = _number(mass_of, "value", link)
    terms = {pair: _number(inertia_of, f"i{pair}", link) for pair in PAIRS}
    own = np.array([[terms["".join(sorted(a + b))] for b in "xyz"] for a in "xyz"])
    about = turn @ own @ turn.T + mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
    return _Body(mass, mass * centre, about)


def _origin(one: ElementTree.Element) -> tuple[np.ndarray, np.ndarray]:
    """Rotation (3, 3) and offset (3,) of a frame in the one before."""
    origin = one.find("origin")
    if origin is None:
        return np.eye(3), np.zeros(3)
    roll, pitch, yaw = _numbers(origin.get("rpy") or "0 0 0")
    turn = _turned((0, 0, 1), yaw) @ _turned((0, 1, 0), pitch) @ _turned((1, 0, 0), roll)
    turn[np.abs(turn) < SMALL] = 0.0
    turn[np.abs(np.abs(turn) - 1) < SMALL] = np.sign(turn[np.abs(np.abs(turn) - 1) < SMALL])
    return turn, _numbers(origin.get("xyz") or "0 0 0")


def _number(one: ElementTree.Element | None, name: str, link: ElementTree.Element) -> float:
    """An attribute; 0 where the file says nothing."""
    text = "0" if one is None else one.get(name, "0")
    try:
        found = float(text)
    except ValueError:
        found = math.nan
    if not math.isfinite(found):
        raise StickslipError(f"The {name} in the inertial part of link '{link.get('name')}' is '{text}', no number.")
    return found


def _identifier(name: str) -> str:
    """A name as a declaration takes it: letters, digits and underscores."""
    found = re.sub(r"\W", "_", name, flags=re.ASCII)
    return found if found[0].isalpha() else f"robot_{found}"


def _numbers(text: str) -> np.ndarray:
    try:
        found = np.array([float(one) for one in text.split()])
    except ValueError as error:
        raise StickslipError(f"'{text}' is not three numbers: this is no URDF that can be read ({error}).") from error
    if len(found) != 3 or not np.all(np.isfinite(found)):
        raise StickslipError(f"'{text}' is not three numbers: this is no URDF that can be read.")
    return found


def _turned(axis: Sequence[float], angle: float) -> np.ndarray:
    return np.array(_about(np.array(axis), sympy.Float(angle)).tolist(), dtype=float)


def _about(axis: np.ndarray, angle: sympy.Expr) -> sympy.Matrix:
    """Rotation about an axis (3,) by an angle."""
    x, y, z = (sympy.nsimplify(one) if one in (-1.0, 0.0, 1.0) else sympy.Float(float(one)) for one in axis)
    k = sympy.Matrix([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return sympy.eye(3) + sympy.sin(angle) * k + (1 - sympy.cos(angle)) * k * k
