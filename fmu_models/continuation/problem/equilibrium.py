"""What a branch of equilibria is followed of: the rates of an oscillator, in the contact states that hold at a point.

    f(x, p) = 0,    J = df/dx

The problem is that of periodic motions whose map is one of a short time: f times that, and exp(lambda t) for the
multipliers, so that a branch of equilibria is followed like one of motions. A fold is that of both; a Hopf point is a
Neimark-Sacker point. The word is the states of all contacts.

Where a contact sticks the states stay on a surface, across which J is without meaning: lT J = 0 for its normal l. What
leaves the surface comes back at once, and counts as an eigenvalue of minus infinity. So does what leaves the wall of a
closed contact. A coordinate upon which nothing depends has the eigenvalue zero, and stays where it is.
"""

from dataclasses import dataclass, replace

import numpy as np

from fmu_models.base.arrays import Complex
from fmu_models.base.errors import StickslipError
from fmu_models.continuation.problem.imported_field import ImportedField
from fmu_models.continuation.problem.node import Node
from fmu_models.continuation.problem.problem import OscillatorProblem, Problem, Seen, Vector
from fmu_models.fmu.fmu import Fmu
from fmu_models.importer.flow import constants_of
from fmu_models.language.contact_kinds import STICK, TOUCHING
from fmu_models.sections.strobe import Strobe
from fmu_models.simulation.field import VectorField, is_forced
from fmu_models.simulation.run import check_names, check_value

AT_ONCE = 1e4  # of the eigenvalue of a direction that leaves what sticks, over the rest: exp(-this) is zero
ROUNDING = 1e-16  # of the size of a state: less is the rounding of zero
ZERO = 1e-10  # singular values below this share of the largest are zero


@dataclass(frozen=True, eq=False)
class EquilibriumProblem(OscillatorProblem):
    """Equilibria of an FMU.

    Args:
        field: its rates.
        strobe: the oscillator, with values of parameters and inputs that are not at their default.
        over: the parameter.
        share: s, the short time.
        sizes: (n,) of the states.
    """

    field: VectorField | ImportedField
    strobe: Strobe
    over: str
    share: float
    sizes: Vector
    second: str = ""
    still = True

    @property
    def _rigid(self) -> list[bool]:
        """Of each contact whether it is a wall that does not give way."""
        states = (self.field.fmu.variables.get(f"{name}_state") for name in self.field.contacts)
        return [getattr(getattr(state, "declaredType", None), "name", "") == "ImpactState" for state in states]

    def opened(self, second: str) -> Problem:
        check_names(self.field.fmu, "parameter or input", {second: None}, self.strobe.parameters)
        return replace(self, second=second)

    def present(self, name: str) -> float:
        value = super().present(name)
        check_value(self.field.fmu, name, value)
        return value

    def _point(self, z: Vector) -> Vector:
        """(n,) the states of z; what is rounding of zero is zero: at a speed of 1e-30 nothing sticks."""
        x = z[: len(self.states)]
        return np.where(np.abs(x) < ROUNDING * self.sizes, 0.0, x)

    def see(self, z: Vector) -> Seen:
        n, constants, point = len(self.states), self.values(z), self._point(z)
        sample = self.field.at(point, constants)
        slopes = self.field.slopes(point, self.parameters, constants)
        rates, sticks = sample.rates, sample.contacts.count(STICK)
        closed = sum(state == TOUCHING and rigid for state, rigid in zip(sample.contacts, self._rigid, strict=True))
        normals, pins, walls = _held(slopes[:, :n], sticks, closed, self.cyclic)
        if len(pins):
            # what holds takes these rates away: what is left of them is rounding of the forces, over an inertia
            slopes, rates = slopes - normals.T @ (normals @ slopes), rates - normals.T @ (normals @ rates)
        else:
            normals = pins = _normals(slopes[:, :n], sticks)
        j, residual, jacobian = slopes[:, :n].copy(), self.share * rates, self.share * slopes
        if len(normals):
            jacobian[:, :n] += normals.T @ pins  # no step leaves the surface, or the wall, that the start is on
            j -= AT_ONCE / self.share * (normals.T @ normals + walls.T @ walls)
        word = tuple((name, s, s) for name, s in zip(self.field.contacts, sample.contacts, strict=True))
        return Seen(residual, jacobian, j, self.share, word)

    def indicators(self, z: Vector) -> Vector:
        """Those of all events, positive while contacts keep their states."""
        return self.field.at(self._point(z), self.values(z)).indicators

    def along_surfaces(self, z: Vector) -> Vector:
        """(n + 1, n + 1) symmetric: from directions of z to their parts along the surfaces of what sticks."""
        n, constants = len(self.states), self.values(z)
        projector = np.eye(len(z))
        sticks = self.field.at(z[:n], constants).contacts.count(STICK)
        if sticks:
            normals = _normals(self.field.slopes(z[:n], (), constants), sticks)
            projector[:n, :n] -= normals.T @ normals
        return projector

    def how(self, z: Vector, seen: Seen) -> str:
        if isinstance(self.field, VectorField):
            return ""
        return self.field.how(z[: len(self.states)], self.values(z))

    def scales(self, z: Vector, between: tuple[float, float]) -> Vector:
        return np.append(np.maximum(np.abs(z[: len(self.states)]), self.sizes), abs(between[1] - between[0]))

    def folded(self, times: int, growth: float = 1.0) -> Problem:
        return self

    def multipliers(self, monodromy: Vector) -> Complex:
        """exp(lambda t) of the eigenvalues."""
        return np.exp(self.share * ordered(monodromy))

    def eigenvalues(self, j: Vector) -> Complex:
        """(n,) by falling real part; minus infinity across what sticks."""
        spectrum = ordered(j)
        spectrum[np.real(spectrum) < -0.5 * AT_ONCE / self.share] = -np.inf
        return spectrum


def ordered(j: Vector) -> Complex:
    """(n,) eigenvalues by falling real part, of a pair the one above the axis first."""
    eigenvalues: Complex = np.linalg.eigvals(j).astype(complex)
    return eigenvalues[np.lexsort((-np.imag(eigenvalues), -np.round(np.real(eigenvalues), 12)))]


def equilibrium_problem(node: Node) -> EquilibriumProblem:
    """Whose equilibrium a node is."""
    assert isinstance(node.problem, EquilibriumProblem)
    return node.problem


def eigenvalues_of(node: Node) -> Complex:
    """(n,) those at an equilibrium."""
    return equilibrium_problem(node).eigenvalues(node.seen.monodromy)


def _normals(j: Vector, sticks: int) -> Vector:
    """(sticks, n) unit normals of the surfaces that the states stay on."""
    if not sticks:
        return np.empty((0, len(j)))
    u, _, _ = np.linalg.svd(j)
    return u[:, -sticks:].T


def _held(j: Vector, sticks: int, closed: int, cyclic: list[int]) -> tuple[Vector, Vector, Vector]:
    """Where contacts keep the states at walls, or what sticks could do so elsewhere along a coordinate upon which
    nothing depends: (k, n) unit normals of the rates that they take away, the same of the coordinates, and of these the
    walls; none where anything else has no rate, or nothing is held."""
    u, sizes, rows = np.linalg.svd(j)
    k = int((sizes < ZERO * sizes[0]).sum())
    nothing = np.empty((0, len(j)))
    along = np.eye(len(j))[[i for i in cyclic if not j[:, i].any()]]
    if not 0 < k <= sticks + closed:
        return nothing, nothing, nothing
    normals = u[:, -k:].T
    # a coordinate's rate is a velocity: what bounds the one bounds the other
    of_coordinates = (np.count_nonzero(j, axis=1) == 1) & (j.max(axis=1) == 1.0)
    pins = np.where(of_coordinates, normals @ j.T, 0.0)
    _, shares, beside = np.linalg.svd(pins - (pins @ along.T) @ along)
    walls = beside[: int((shares > ZERO).sum())]
    if len(walls) > closed or len(walls) + len(along) != k:
        return nothing, nothing, nothing
    alone = np.linalg.matrix_rank(rows[-k:] @ np.concatenate([along, walls]).T) == k
    return (normals, pins, walls) if alone else (nothing, nothing, nothing)


def numbers_of(fmu: Fmu) -> list[str]:
    """Names of parameters and inputs."""
    return [*fmu.parameters, *fmu.inputs] if fmu.ours else constants_of(fmu)


def problem_at(
    field: VectorField | ImportedField,
    over: str,
    constants: dict[str, float],
    point: Vector,
    between: tuple[float, float],
) -> EquilibriumProblem:
    """The problem of a model near a point. StickslipError: no such parameter, one of the values is none that it can
    have, something forces the motion."""
    fmu = field.fmu
    fmu.refuse_cones("equilibria")
    check_names(fmu, "parameter or input", {over: None}, numbers_of(fmu))
    for value in between:
        check_value(fmu, over, value)
    if is_forced(field, point):
        raise StickslipError(
            f"'{fmu.description.modelName}' is forced: its rates depend on time, and it has no equilibrium. Set the "
            "amplitude of the force to zero, or follow its periodic motion with 'branch'."
        )
    sizes = np.array([fmu.size_of(name) for name in fmu.states])
    eigenvalues = np.linalg.eigvals(field.slopes(point, ()))
    fastest = float(np.abs(eigenvalues).max(initial=0.0))
    share = 1.0 / (fastest or 1.0)
    strobe = Strobe(fmu, period=share, autonomous=True, parameters=constants)
    return EquilibriumProblem(field, strobe, over, share, sizes)
