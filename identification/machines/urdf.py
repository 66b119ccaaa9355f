"""A robot's kinematics from a URDF, as a declared mechanism whose inertial and friction parameters are to be found.

Each link i has a mass m, first moments sx, sy, sz and six inertias about its joint; each joint a rotor inertia Ia,
viscous friction fv, Coulomb friction fs and an offset of its effort. What the file says of masses and inertias becomes
their declared values, those of links at fixed joints with those of the link that carries them. Energies are built link
by link in the links' own frames and never multiplied out.

Source of the form: Khalil, Dombre, Modeling, Identification and Control of Robots (2002), chapters 3 and 9.
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from xml.etree import ElementTree

import numpy as np
import sympy

from fmu_models.base.errors import StickslipError
from fmu_models.base.files import existing
from fmu_models.language.friction import Friction
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
    mimics: str


@dataclass(frozen=True)
class _Body:
    """mass, first moments (3,) and inertia (3, 3) about the joint, in its frame."""

    mass: float
    moments: np.ndarray
    inertia: np.ndarray

    def with_body(self, added: _Body, turn: np.ndarray, offset: np.ndarray) -> _Body:
        """This body together with another, whose frame is turned and moved in this one's."""
        moments, (m, p) = turn @ added.moments, (added.mass, offset)
        product = np.outer(p, moments)
        about = turn @ added.inertia @ turn.T + (m * p @ p + 2 * p @ moments) * np.eye(3)
        inertia = about - m * np.outer(p, p) - product - product.T
        return _Body(self.mass + m, self.moments + moments + m * p, self.inertia + inertia)


@dataclass(frozen=True)
class _Link:
    """What one joint moves, with all that is fixed to it. carrier: number of the link that carries it, None for the
    base; turn (3, 3), offset (3,): of the joint's frame in the carrier's."""

    joint: _Joint
    carrier: int | None
    turn: np.ndarray
    offset: np.ndarray
    body: _Body


def mechanism_from_urdf(
    path: str | os.PathLike[str], *, gravity: Sequence[float] = GRAVITY, friction: bool = True
) -> Mechanism:
    """A robot, serial or branched. gravity: m/s^2 in the frame of the base, which a wall or a ceiling turns.

    Coordinates are named q1, q2, ... from the base on, branch after branch as the file has them, efforts tau1, tau2,
    ...; links at fixed joints belong to those that carry them. StickslipError: it is no URDF; its joints are no tree,
    neither turn nor slide, copy others, or lead to no link.
    """
    file = existing(path, "URDF")
    try:
        root = ElementTree.parse(file).getroot()
    except ElementTree.ParseError as error:
        raise StickslipError(f"'{path}' is no URDF ({error}).") from error
    if root.tag != "robot":
        raise StickslipError(f"'{path}' is no URDF: it begins with <{root.tag}>, a URDF with <robot>.")
    bodies = {str(link.get("name")): _body(link) for link in root.findall("link")}
    joints = [_joint(element) for element in root.findall("joint")]
    links = _links(os.fspath(path), joints, bodies)
    if not links:
        raise StickslipError(f"No joint of '{path}' moves: there is nothing to find.")
    name = re.sub(r"\W", "_", root.get("name") or file.stem, flags=re.ASCII)  # as a declaration takes it
    return _declared(name if name[0].isalpha() else f"robot_{name}", links, np.array(gravity, dtype=float), friction)


def _declared(name: str, links: Sequence[_Link], gravity: np.ndarray, friction: bool) -> Mechanism:
    zero = sympy.zeros(3, 1)
    base = (zero, zero, sympy.Matrix(gravity), sympy.S.Zero)
    # of each link in its frame: velocity, rate of turn, gravity; and its height
    motions: list[tuple[sympy.Matrix, sympy.Matrix, sympy.Matrix, sympy.Expr]] = []
    kinetic, potential, dissipation = sympy.S.Zero, sympy.S.Zero, sympy.S.Zero
    coordinates, contacts, applied = [], [], {}
    for number, link in enumerate(links, 1):
        turns = link.joint.kind != "prismatic"
        q = Coordinate(f"q{number}", "rad" if turns else "m", link.joint.name, velocity=f"w{number}")
        coordinates.append(q)
        v, w, down, height = base if link.carrier is None else motions[link.carrier]
        axis, turn = sympy.Matrix(link.joint.axis), sympy.Matrix(link.turn)
        # the frame of the carrier, then what the joint adds
        reach = sympy.Matrix(link.offset) + (zero if turns else turn * axis * q)
        inverse = (_about(link.joint.axis, q).T if turns else sympy.eye(3)) * turn.T
        height = height - down.dot(reach)
        v, w, down = inverse * (v + w.cross(reach)), inverse * w, inverse * down
        v, w = (v, w + axis * q.v) if turns else (v + axis * q.v, w)
        motions.append((v, w, down, height))
        m, moments, inertia = _parameters(number, link)
        kinetic += (m * v.dot(v) + w.dot(inertia * w)) / 2 + moments.dot(v.cross(w))
        potential += m * height - down.dot(moments)
        unit = "N m" if turns else "N"
        inertial = "kg m2" if turns else "kg"
        kinetic += Parameter(f"Ia{number}", 0.0, inertial, "rotor inertia at the joint", minimum=0.0) * q.v**2 / 2
        applied[q] = Input(f"tau{number}", 0.0, unit, f"effort of joint {number}")
        if friction:
            viscous = Parameter(f"fv{number}", 0.0, f"{unit} s" if turns else "N s/m", "viscous", minimum=0.0)
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


def _parameters(number: int, link: _Link) -> tuple[Parameter, sympy.Matrix, sympy.Matrix]:
    body = link.body
    m = Parameter(f"m{number}", body.mass, "kg", f"mass of {link.joint.child}")
    moments = [
        Parameter(f"s{c}{number}", float(value), "kg m", "mass times centre")
        for c, value in zip("xyz", body.moments, strict=True)
    ]
    terms = {}
    for a, b in PAIRS:
        value = float(body.inertia["xyz".index(a), "xyz".index(b)])
        terms[a + b] = Parameter(f"J{a}{b}{number}", value, "kg m2", f"inertia of {link.joint.child}")
    inertia = sympy.Matrix([[terms["".join(sorted(a + b))] for b in "xyz"] for a in "xyz"])
    return m, sympy.Matrix(moments), inertia


def _links(path: str, joints: Sequence[_Joint], bodies: dict[str, _Body]) -> list[_Link]:
    """The links that move, from the base on."""
    children = {joint.child for joint in joints}
    bases = {joint.parent for joint in joints} - children
    if len(bases) != 1:
        raise StickslipError(f"'{path}' has {len(bases)} bases ({', '.join(sorted(bases))}); a robot has one.")
    _check_joints(path, joints, bodies)
    links: list[_Link] = []
    reached: set[str] = set()
    # joints to go on from: the link that carries each, and the place of its parent's frame there
    ahead: list[tuple[_Joint, int | None, np.ndarray, np.ndarray]] = []

    def go_on(parent: str, carrier: int | None, turn: np.ndarray, offset: np.ndarray) -> None:
        after = [joint for joint in joints if joint.parent == parent]
        ahead.extend((joint, carrier, turn, offset) for joint in reversed(after))

    (base,) = bases
    go_on(base, None, np.eye(3), np.zeros(3))
    while ahead:
        joint, carrier, turn, offset = ahead.pop()
        offset, turn = offset + turn @ joint.offset, turn @ joint.turn
        body = bodies[joint.child]
        if joint.kind == "fixed":
            if carrier is not None:
                merged = links[carrier].body.with_body(body, turn, offset)
                links[carrier] = replace(links[carrier], body=merged)
            go_on(joint.child, carrier, turn, offset)
        else:
            links.append(_Link(joint, carrier, turn, offset, body))
            go_on(joint.child, len(links) - 1, np.eye(3), np.zeros(3))
        reached.add(joint.name)
    loose = [joint.name for joint in joints if joint.name not in reached]
    if loose:
        raise StickslipError(f"Joint '{loose[0]}' of '{path}' is one of a loop: a URDF is a tree from its base on.")
    return links


def _check_joints(path: str, joints: Sequence[_Joint], bodies: dict[str, _Body]) -> None:
    carriers: dict[str, str] = {}
    for joint in joints:
        if joint.kind not in ("revolute", "continuous", "prismatic", "fixed"):
            raise StickslipError(
                f"Joint '{joint.name}' of '{path}' is '{joint.kind}'; revolute, continuous, prismatic "
                "and fixed ones are read."
            )
        if joint.mimics:
            raise StickslipError(
                f"Joint '{joint.name}' of '{path}' mimics '{joint.mimics}': joints with one motion share an effort. "
                "Declare the robot as a Mechanism with one coordinate for both, or make the joint fixed."
            )
        if joint.child not in bodies:
            raise StickslipError(
                f"Joint '{joint.name}' of '{path}' leads to '{joint.child}', and no link is called so."
            )
        if joint.child in carriers:
            raise StickslipError(
                f"Link '{joint.child}' of '{path}' hangs on two joints, '{carriers[joint.child]}' and '{joint.name}': "
                "a URDF is a tree. Declare a loop as a Mechanism."
            )
        carriers[joint.child] = joint.name


def _joint(element: ElementTree.Element) -> _Joint:
    parent, child, axis = element.find("parent"), element.find("child"), element.find("axis")
    if parent is None or child is None:
        raise StickslipError(f"Joint '{element.get('name')}' has no parent or no child: this is no whole URDF.")
    turn, offset = _origin(element)
    direction = _numbers("1 0 0" if axis is None else axis.get("xyz", "1 0 0"))
    length, mimic = float(np.linalg.norm(direction)), element.find("mimic")
    if length == 0:
        raise StickslipError(f"The axis of joint '{element.get('name')}' is zero.")
    return _Joint(
        str(element.get("name")),
        str(element.get("type")),
        str(parent.get("link")),
        str(child.get("link")),
        turn,
        offset,
        direction / length,
        "" if mimic is None else str(mimic.get("joint")),
    )


def _body(link: ElementTree.Element) -> _Body:
    inertial = link.find("inertial")
    if inertial is None:
        return _Body(0.0, np.zeros(3), np.zeros((3, 3)))
    turn, centre = _origin(inertial)
    mass_of, inertia_of = inertial.find("mass"), inertial.find("inertia")
    mass = _number(mass_of, "value", link)
    terms = {pair: _number(inertia_of, f"i{pair}", link) for pair in PAIRS}
    central = np.array([[terms["".join(sorted(a + b))] for b in "xyz"] for a in "xyz"])
    about = turn @ central @ turn.T + mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
    return _Body(mass, mass * centre, about)


def _origin(element: ElementTree.Element) -> tuple[np.ndarray, np.ndarray]:
    """Rotation (3, 3) and offset (3,) of a frame in the one before."""
    origin = element.find("origin")
    if origin is None:
        return np.eye(3), np.zeros(3)
    roll, pitch, yaw = _numbers(origin.get("rpy") or "0 0 0")
    turn = _turned((0, 0, 1), yaw) @ _turned((0, 1, 0), pitch) @ _turned((1, 0, 0), roll)
    turn[np.abs(turn) < SMALL] = 0.0
    turn[np.abs(np.abs(turn) - 1) < SMALL] = np.sign(turn[np.abs(np.abs(turn) - 1) < SMALL])
    return turn, _numbers(origin.get("xyz") or "0 0 0")


def _number(element: ElementTree.Element | None, name: str, link: ElementTree.Element) -> float:
    """An attribute; 0 where the file says nothing."""
    text = "0" if element is None else element.get(name, "0")
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise StickslipError(f"The {name} in the inertial part of link '{link.get('name')}' is '{text}', no number.")
    return value


def _numbers(text: str) -> np.ndarray:
    try:
        numbers = np.array([float(word) for word in text.split()])
    except ValueError as error:
        raise StickslipError(f"'{text}' is not three numbers: this is no URDF that can be read ({error}).") from error
    if len(numbers) != 3 or not np.all(np.isfinite(numbers)):
        raise StickslipError(f"'{text}' is not three numbers: this is no URDF that can be read.")
    return numbers


def _turned(axis: Sequence[float], angle: float) -> np.ndarray:
    return np.array(_about(np.array(axis), sympy.Float(angle)).tolist(), dtype=float)


def _about(axis: np.ndarray, angle: sympy.Expr) -> sympy.Matrix:
    """Rotation about an axis (3,) by an angle."""
    x, y, z = (sympy.nsimplify(axi) if axi in (-1.0, 0.0, 1.0) else sympy.Float(float(axi)) for axi in axis)
    k = sympy.Matrix([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return sympy.eye(3) + sympy.sin(angle) * k + (1 - sympy.cos(angle)) * k * k
