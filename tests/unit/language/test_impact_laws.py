"""Impacts of random mechanisms against an independent solver of the laws of impact.

M v+ = M v- + J' Lambda with gap speeds and slips gamma = J v. Every assignment {no impulse, sticks, slips forward,
slips backward} is solved here as one linear system and checked against the laws; the engine must find the solution that
loses most energy, and an error where there is none. Where contacts act along more directions than there are
coordinates their impulses are not determined one by one, and so neither is the expansion of Poisson's law: there only
the laws are checked.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
import sympy
from quick_export import quick_export

from fmu_models.base.errors import StickslipError
from fmu_models.fmu.fmu import Fmu
from fmu_models.language.impacts import Impact, Newton, Poisson
from fmu_models.language.mechanism import Mechanism
from fmu_models.language.quantities import Coordinate, Parameter
from fmu_models.simulation.run import simulate

DRAWS = 40
IMPACT_TIME = 0.25  # exact in binary


@dataclass(frozen=True)
class Structure:
    """What has to be compiled anew: coordinates, which contacts have friction, the law of restitution."""

    coordinates: int
    friction: tuple[bool, ...]
    law: type[Newton] | type[Poisson]
    backwards: bool = False  # contacts declared in reverse

    @property
    def determined(self) -> bool:
        """Whether velocities follow from the laws: an expansion needs every impulse of the compression by itself."""
        directions = len(self.friction) + sum(self.friction)
        return self.law is Newton or directions <= self.coordinates

    def __str__(self) -> str:
        contacts = "".join("F" if rough else "o" for rough in self.friction)
        return f"{self.coordinates}{contacts}{self.law.__name__}{'-reversed' if self.backwards else ''}"


@dataclass(frozen=True)
class Draw:
    """Numbers of one impact: mass matrix (n, n), directions (contacts, n), velocities (n,)."""

    mass: np.ndarray
    normals: np.ndarray
    tangents: np.ndarray
    restitution: np.ndarray
    mu: np.ndarray
    before: np.ndarray


STRUCTURES = [
    Structure(2, (False,), Newton),
    Structure(2, (True,), Poisson),
    Structure(2, (True, True), Newton),
    Structure(2, (False, False, False), Newton),
    Structure(3, (True, False), Poisson),
    Structure(3, (False, False, False), Poisson),
    Structure(3, (False, True, True), Newton),
    Structure(3, (True, True, True), Poisson),
]


def mechanism(structure: Structure) -> Mechanism:
    """Free motion between walls through the origin, every number a parameter."""

    def number(name: str, value: float) -> Parameter:
        return Parameter(name, value, "1", name)

    n = structure.coordinates
    q = [Coordinate(f"q{i}", "m", "coordinate", velocity=f"v{i}") for i in range(n)]
    upper = {(i, j): Parameter(f"m{i}{j}", float(i == j), "kg", "mass") for i in range(n) for j in range(i, n)}
    energy = sympy.Add(*(upper[min(i, j), max(i, j)] * q[i].v * q[j].v / 2 for i in range(n) for j in range(n)))
    contacts = []
    for c, rough in enumerate(structure.friction):
        normal = [number(f"n{c}{i}", float(i == 0)) for i in range(n)]
        tangent = [number(f"t{c}{i}", float(i == 1)) for i in range(n)] if rough else []
        contacts.append(
            Impact(
                name=f"wall{c}",
                gap=sympy.Add(*(a * x for a, x in zip(normal, q, strict=True))),
                restitution=structure.law(number(f"e{c}", 0.5)),
                slip=sympy.Add(*(a * x.v for a, x in zip(tangent, q, strict=True))) if rough else None,
                mu=number(f"mu{c}", 0.3) if rough else None,
            )
        )
    return Mechanism(
        name="walls",
        title="walls",
        source="test",
        coordinates=q,
        kinetic_energy=energy,
        contacts=contacts[::-1] if structure.backwards else contacts,
    )


@pytest.fixture(scope="module")
def fmus(tmp_path_factory: pytest.TempPathFactory) -> dict[Structure, Fmu]:
    """FMUs made so far."""
    return Built(tmp_path_factory.mktemp("walls"))


class Built(dict[Structure, Fmu]):
    """FMU of a structure, made when first asked for."""

    def __init__(self, folder: Path) -> None:
        super().__init__()
        self.folder = folder

    def __missing__(self, structure: Structure) -> Fmu:
        path = self.folder / str(structure) / "walls.fmu"
        path.parent.mkdir()
        quick_export(mechanism(structure), path)
        self[structure] = Fmu.open(path)
        return self[structure]


def draw(structure: Structure, random: np.random.Generator, *, rough: float = 1.0) -> Draw:
    """An impact in which every contact arrives at its wall; mu up to ``rough``."""
    n, contacts = structure.coordinates, len(structure.friction)
    root = random.normal(size=(n, n))
    before = random.normal(size=n)
    normals = random.normal(size=(contacts, n))
    normals *= -np.sign(normals @ before)[:, None]
    restitution = random.choice([0.0, 1.0, *random.uniform(size=4)], size=contacts)
    mu = random.uniform(0.0, rough, size=contacts) * structure.friction
    return Draw(root @ root.T + np.eye(n), normals, random.normal(size=(contacts, n)), restitution, mu, before)


def phase(
    d: Draw, structure: Structure, gamma: np.ndarray, target: np.ndarray, given: np.ndarray
) -> tuple[np.ndarray, float] | None:
    """Impulses (2 contacts, normal before tangential) and their work, of the solution that loses most energy."""
    contacts = len(structure.friction)
    jacobian = np.vstack([d.normals, d.tangents])
    G = jacobian @ np.linalg.solve(d.mass, jacobian.T)
    best: tuple[np.ndarray, float] | None = None
    choices = [
        [(held, way) for held in (True, False) for way in ((0, 1, -1) if rough and (held or given[c] > 0) else (None,))]
        for c, rough in enumerate(structure.friction)
    ]
    for assignment in itertools.product(*choices):
        A, b = np.eye(2 * contacts), np.zeros(2 * contacts)
        for c, (held, way) in enumerate(assignment):
            t = contacts + c
            if held:
                A[c], b[c] = G[c], target[c] - gamma[c]
            else:
                b[c] = given[c]
            if way == 0:
                A[t], b[t] = G[t], -gamma[t]
            elif way is not None:
                A[t, c] = way * d.mu[c]
        impulse = np.linalg.lstsq(A, b, rcond=1e-11)[0]
        after = gamma + G @ impulse
        if np.abs(A @ impulse - b).max() > 1e-9 or not obeys(d, assignment, impulse, after, target, given):
            continue
        work = float(impulse @ (gamma + after)) / 2
        if best is None or work < best[1] - 1e-9 * abs(best[1]):
            best = impulse, work
    return best


def obeys(
    d: Draw, assignment: tuple, impulse: np.ndarray, after: np.ndarray, target: np.ndarray, given: np.ndarray
) -> bool:
    """Whether a solution of the equations of an assignment keeps its inequalities."""
    contacts, small = len(assignment), 1e-9
    for c, (held, way) in enumerate(assignment):
        t = contacts + c
        if (impulse[c] < given[c] - small) if held else (after[c] < target[c] - small):
            return False
        if way == 0 and abs(impulse[t]) > d.mu[c] * impulse[c] + small:
            return False
        if way and way * after[t] < -small:
            return False
    return True


def expected(d: Draw, structure: Structure) -> tuple[np.ndarray, float] | None:
    """Velocities after the impact and the work of its impulses; None without solution."""
    contacts = len(structure.friction)
    jacobian = np.vstack([d.normals, d.tangents])
    v, total = d.before, 0.0
    given = np.zeros(contacts)
    for stage in range(1 if structure.law is Newton else 2):
        gamma = jacobian @ v
        target = np.zeros(contacts) if structure.law is Poisson else -d.restitution * gamma[:contacts]
        solution = phase(d, structure, gamma, target, given)
        if solution is None:
            return None
        impulse, work = solution
        v = v + np.linalg.solve(d.mass, jacobian.T @ impulse)
        total += work
        given = d.restitution * impulse[:contacts] if stage == 0 else given
    return v, total


def numbers(d: Draw, structure: Structure) -> dict[str, float]:
    """Parameters of an FMU of the structure."""
    n = structure.coordinates
    values = {f"m{i}{j}": d.mass[i, j] for i in range(n) for j in range(i, n)}
    for c, rough in enumerate(structure.friction):
        values |= {f"n{c}{i}": d.normals[c, i] for i in range(n)} | {f"e{c}": d.restitution[c]}
        values |= ({f"t{c}{i}": d.tangents[c, i] for i in range(n)} | {f"mu{c}": d.mu[c]}) if rough else {}
    return {name: float(value) for name, value in values.items()}


def impact(fmu: Fmu, d: Draw, structure: Structure) -> tuple[np.ndarray, float]:
    """Velocities after a flight to the common edge of the walls, and the work of the events there."""
    start = {f"v{i}": float(v) for i, v in enumerate(d.before)}
    start |= {f"q{i}": float(-v * IMPACT_TIME) for i, v in enumerate(d.before)}
    run = simulate(fmu, 2 * IMPACT_TIME, parameters=numbers(d, structure), start=start, output_times=[2 * IMPACT_TIME])
    assert [event.time for event in run.events] == pytest.approx([IMPACT_TIME] * len(run.events), rel=1e-12)
    after = np.array([run[f"v{i}"][0] for i in range(structure.coordinates)])
    return after, sum(event.work for event in run.events)


@pytest.mark.parametrize("structure", STRUCTURES, ids=str)
def test_impacts_obey_the_laws(fmus: dict[Structure, Fmu], structure: Structure) -> None:
    random = np.random.default_rng(1)
    solved = 0
    for _ in range(DRAWS):
        d = draw(structure, random)
        solution = expected(d, structure)
        if solution is None:
            with pytest.raises(StickslipError, match="no impulses of 'wall"):
                impact(fmus[structure], d, structure)
            continue
        after, work = impact(fmus[structure], d, structure)
        if structure.determined:
            assert after == pytest.approx(solution[0], rel=1e-8, abs=1e-8)
        energies = [v @ d.mass @ v / 2 for v in (d.before, after)]
        assert work == pytest.approx(energies[1] - energies[0], rel=1e-9, abs=1e-9)
        assert (d.normals @ after > -1e-9).all()
        if structure.law is Poisson or not any(structure.friction):
            assert work <= 1e-12 * energies[0]
        solved += 1
    assert solved > DRAWS / 2


@pytest.mark.parametrize("structure", [s for s in STRUCTURES if len(s.friction) > 1 and s.determined], ids=str)
def test_the_order_of_declaration_does_not_matter(fmus: dict[Structure, Fmu], structure: Structure) -> None:
    random = np.random.default_rng(2)
    reverse = Structure(structure.coordinates, structure.friction, structure.law, backwards=True)
    for _ in range(10):
        d = draw(structure, random, rough=0.3)
        if expected(d, structure) is not None:
            after, work = impact(fmus[structure], d, structure)
            other, other_work = impact(fmus[reverse], d, structure)
            assert after == pytest.approx(other, rel=1e-9, abs=1e-9)
            assert work == pytest.approx(other_work, rel=1e-9, abs=1e-12)


def test_a_jam_names_the_contacts(fmus: dict[Structure, Fmu]) -> None:
    structure, random = Structure(3, (False, True, True), Newton), np.random.default_rng(3)
    draws = (draw(structure, random, rough=10.0) for _ in range(1000))
    d = next(d for d in draws if expected(d, structure) is None)
    with pytest.raises(StickslipError, match="no impulses of 'wall0', 'wall1', 'wall2' obey the laws"):
        impact(fmus[structure], d, structure)
