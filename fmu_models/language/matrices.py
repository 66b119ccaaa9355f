"""Linear structures given by their matrices, as finite elements write them, and fewer coordinates that move as they do.

    M u'' + C u' + K u = f

    kept degrees of freedom b, all others i:   u_i = Psi u_b + Phi eta
    Psi = -K_ii^-1 K_ib,   K_ii Phi = M_ii Phi omega^2,   Phi^T M_ii Phi = 1

Where forces act on kept degrees alone, statics is exact, and so nearly is what happens well below the lowest omega
that is left out. With none kept these are the modes of the structure, and what a force bends them by is too little by
the residual flexibility of what is left out.

Source: Craig and Bampton, Coupling of substructures for dynamic analyses, AIAA Journal 6 (1968).
"""

from __future__ import annotations

import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
import sympy
from numpy.typing import ArrayLike, NDArray

from fmu_models.base.errors import StickslipError, refuse_unknown

if TYPE_CHECKING:
    from scipy.sparse import csr_array, sparray, spmatrix

    from fmu_models.language.quantities import Coordinate

# an array, a sparse matrix, or a file: .mtx, .npy, or file.mat:name
Matrix: TypeAlias = "ArrayLike | spmatrix | sparray | str | os.PathLike[str]"
# in the order of the rows, by row from 0 on, or a file whose lines end in node and direction
Names: TypeAlias = "Sequence[str] | Mapping[str, int] | str | os.PathLike[str]"

_ASYMMETRIC = 1e-8  # of the largest entry: what solvers for finite elements leave
_RIGID = 1e-9  # square of an angular frequency, of the largest stiffness over the largest mass
_ROUNDED = 1e-10  # of the largest stiffness: none between kept degrees and modes
_DENSE = 400  # degrees of freedom up to which all modes are computed


@dataclass(frozen=True, eq=False)
class Reduced:
    """Matrices of fewer coordinates, for ``Mechanism.from_matrices``.

    Attributes:
        M, C, K: (m, m), in the units of the ones given.
        names: of the coordinates: those kept, then ``mode1``, ``mode2``, ...
        basis: (n, m), the degrees of freedom u from these coordinates.
        omega: rad/s of the modes kept, with the kept degrees held; if diagonal, of the reduced structure.
        left_out: rad/s of the lowest mode left out, with the kept degrees held; infinite if there is none.
        degrees: names of all degrees of freedom.
    """

    M: NDArray[np.float64]
    C: NDArray[np.float64]
    K: NDArray[np.float64]
    names: tuple[str, ...]
    basis: NDArray[np.float64]
    omega: NDArray[np.float64]
    left_out: float
    degrees: tuple[str, ...]
    _stiffness: Any = field(repr=False)

    def place(self, degree: str, q: Mapping[str, Coordinate]) -> sympy.Expr:
        """A degree of freedom, written by the coordinates; of their velocities ``speed`` is the same. StickslipError:
        none is called so."""
        row = self.basis[self._row(degree)]
        return sympy.Add(*(sympy.Float(float(x)) * q[name] for name, x in zip(self.names, row, strict=True) if x))

    def speed(self, degree: str, q: Mapping[str, Coordinate]) -> sympy.Expr:
        """The rate of a degree of freedom, likewise."""
        return self.place(degree, {name: x.v for name, x in q.items()})  # pyright: ignore[reportArgumentType]

    def residual(self, degree: str) -> float:
        """The share of its static flexibility, in percent, that a degree of freedom lacks: 0 of those kept.
        StickslipError: none is called so, or nothing holds the structure."""
        from scipy.sparse.linalg import splu

        row = self._row(degree)
        force = np.zeros(len(self.degrees))
        force[row] = 1.0
        try:
            flexibility = splu(self._stiffness.tocsc()).solve(force)[row]
            kept_flexibility = self.basis[row] @ np.linalg.solve(self.K, self.basis[row])
        except (RuntimeError, np.linalg.LinAlgError):
            raise StickslipError("Nothing holds the structure: it has no static flexibility") from None
        return float(100.0 * (1.0 - kept_flexibility / flexibility))

    def _row(self, degree: str) -> int:
        refuse_unknown(degree, self.degrees, f"No degree of freedom is called '{degree}'.")
        return self.degrees.index(degree)


def reduced(
    M: Matrix,
    C: Matrix | None,
    K: Matrix,
    *,
    modes: int,
    keep: Sequence[str] = (),
    names: Names | None = None,
    damping: float = 0.0,
    diagonal: bool = False,
) -> Reduced:
    """Keep some degrees of freedom of a structure, and its lowest modes with these held.

    Args:
        M, C, K: (n, n) symmetric; C None: nothing is damped but the modes.
        modes: how many.
        keep: degrees of freedom that contacts and forces act on.
        names: of all degrees of freedom: in their order, by row, or a file as ``from_matrices`` reads it; ``u1``,
            ``u2``, ... if None.
        damping: ratio of each mode to critical damping, added to C.
        diagonal: whether the coordinates are the modes of the reduced structure, ``mode1`` and so on, of unit mass,
            kept degrees being sums of them (``Reduced.place``): many modes then cost no more than their number.

    Raises:
        StickslipError: matrices that do not fit, a name that none has, more modes than there are, or so few that a
            rigid motion is left out.
    """
    mass, dampers, stiffness = matrices_of(M, C, K)
    n = mass.shape[0]
    all_names = names_of(n, names)
    for name in keep:
        refuse_unknown(name, all_names, f"No degree of freedom is called '{name}'.")
    kept_rows = [all_names.index(name) for name in keep]
    inner = np.setdiff1d(np.arange(n), kept_rows)
    if not 0 <= modes <= len(inner):
        raise StickslipError(f"There are {len(inner)} modes with {len(kept_rows)} degrees of freedom kept, not {modes}")
    squares, shapes = _modes(mass[inner][:, inner], stiffness[inner][:, inner], modes)
    basis = np.zeros((n, len(kept_rows) + modes))
    basis[kept_rows, range(len(kept_rows))] = 1.0
    static = _statics(stiffness[inner][:, inner], -stiffness[inner][:, kept_rows].toarray())
    basis[inner] = np.hstack([static, shapes[:, :modes]])
    omega = np.sqrt(np.maximum(squares, 0.0))
    small_mass, small_dampers, small_stiffness = (basis.T @ (A @ basis) for A in (mass, dampers, stiffness))
    at = range(len(kept_rows), len(kept_rows) + modes)
    # what the equations above make diagonal, or zero, is so without rounding: every entry costs
    inside = np.ix_(at, at)
    small_mass[inside], small_stiffness[inside] = np.eye(modes), np.diag(squares[:modes])
    across = small_stiffness[: len(kept_rows), len(kept_rows) :]
    if abs(across).max(initial=0.0) <= _ROUNDED * abs(stiffness).max():
        across[:] = small_stiffness[len(kept_rows) :, : len(kept_rows)] = 0.0
    small_dampers[at, at] += 2.0 * damping * omega[:modes]
    left_out = float(omega[modes]) if len(omega) > modes else np.inf
    if left_out**2 <= _RIGID * abs(stiffness).max() / abs(mass).max():
        raise StickslipError(f"More than {modes} modes are rigid motions, that nothing holds: take more modes")
    coordinates = (*keep, *(f"mode{k + 1}" for k in range(modes)))
    small = Reduced(
        *(small_mass, small_dampers, small_stiffness, coordinates, basis),
        *(omega[:modes], left_out, all_names, stiffness),
    )
    return _diagonal(small, dampers, damping) if diagonal else small


def _diagonal(small: Reduced, dampers: csr_array, damping: float) -> Reduced:
    """The same motions by their own modes."""
    from scipy import linalg

    squares, shapes = linalg.eigh(small.K, small.M)
    omega, basis = np.sqrt(np.maximum(squares, 0.0)), small.basis @ shapes
    return replace(
        small,
        M=np.eye(len(omega)),
        C=basis.T @ (dampers @ basis) + np.diag(2.0 * damping * omega),
        K=np.diag(omega**2),
        names=tuple(f"mode{k + 1}" for k in range(len(omega))),
        basis=basis,
        omega=omega,
    )


def _statics(inside: csr_array, across: NDArray[np.float64]) -> NDArray[np.float64]:
    """What degrees of freedom do that follow others, a column for each of these."""
    from scipy.sparse.linalg import splu

    if not across.size:
        return across
    try:
        return splu(inside.tocsc()).solve(across)
    except RuntimeError:  # exactly singular: a rigid motion, which is among the modes
        return np.linalg.lstsq(inside.toarray(), across)[0]


def _modes(mass: csr_array, stiffness: csr_array, count: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Squares of the lowest angular frequencies, one more than asked for if there is one; shapes of unit mass."""
    from scipy import linalg
    from scipy.sparse.linalg import eigsh

    n = mass.shape[0]  # pyright: ignore[reportOptionalSubscript]
    needed = min(count + 1, n)
    if not n:
        return np.zeros(0), np.zeros((0, 0))
    if n <= _DENSE or needed >= n - 1:
        return linalg.eigh(stiffness.toarray(), mass.toarray(), subset_by_index=(0, needed - 1))
    # below zero, so that a structure that nothing holds has a factor
    below = -1e-6 * abs(stiffness).max() / abs(mass).max()
    squares, shapes = eigsh(stiffness, needed, mass, sigma=below)
    order = np.argsort(squares)
    return squares[order], shapes[:, order]


def matrices_of(M: Matrix, C: Matrix | None, K: Matrix) -> tuple[Any, Any, Any]:
    """Checked and symmetric, sparse; C of zeros if None. StickslipError: a file or matrix that is none, shapes that
    differ, asymmetry, or a mass that is not positive."""
    mass, stiffness = _symmetric("M", M), _symmetric("K", K)
    dampers = 0.0 * mass if C is None else _symmetric("C", C)
    if not mass.shape == dampers.shape == stiffness.shape:
        raise StickslipError(f"M is {mass.shape}, C {dampers.shape} and K {stiffness.shape}: all must have one size")
    if not _is_definite(mass):
        raise StickslipError("M is not positive definite: each degree of freedom needs a mass")
    return mass, dampers, stiffness


def _is_definite(matrix: csr_array) -> bool:
    """Whether a symmetric matrix has positive pivots alone, on the diagonal."""
    from scipy.sparse.linalg import splu

    if not (matrix.diagonal() > 0.0).all():
        return False
    try:
        options = {"SymmetricMode": True}
        factor = splu(matrix.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options)
    except RuntimeError:  # exactly singular
        return False
    return bool((factor.perm_r == factor.perm_c).all() and (factor.U.diagonal() > 0.0).all())


def names_of(n: int, names: Names | None) -> tuple[str, ...]:
    """Of degrees of freedom, by row. StickslipError: not one for each, or a file that cannot be read."""
    if names is None:
        return tuple(f"u{k + 1}" for k in range(n))
    if isinstance(names, str | os.PathLike):
        names = _names_from(Path(names))
    elif isinstance(names, Mapping):
        if sorted(names.values()) != list(range(len(names))):
            raise StickslipError(f"Names by row need each of the rows 0 to {len(names) - 1} once")
        names = sorted(names, key=names.__getitem__)
    if len(names) != n:
        raise StickslipError(f"There are {len(names)} names for {n} degrees of freedom")
    return tuple(names)


def _names_from(path: Path) -> list[str]:
    """Names ``node:direction`` from a file whose lines end in these two, as programs for finite elements list the
    rows of their matrices; a heading is left out."""
    try:
        rows = [re.split(r"[\s,;]+", line.strip()) for line in path.read_text("utf-8").splitlines() if line.strip()]
    except (OSError, UnicodeDecodeError) as error:
        raise StickslipError(f"Names cannot be read from {path}: {error}") from None
    if short := next((row for row in rows if len(row) < 2), None):
        raise StickslipError(f"{path}: the line '{short[0]}' must end in node and direction, such as 17, uz")
    return [f"{row[-2]}:{row[-1]}" for row in rows if re.search(r"\d", row[-2])]


def identifier(name: str) -> str:
    """The name of a coordinate for a degree of freedom: what begins with a number is a node.

    >>> identifier("17:uz"), identifier("tip")
    ('n17_uz', 'tip')
    """
    text = re.sub(r"\W", "_", name)
    return text if text[:1].isalpha() else f"n{text}"


def narrow_order(matrix: csr_array) -> list[int]:
    """The order of rows, of three, in which the fewest entries lie between the first of a row and its diagonal."""
    from scipy import sparse
    from scipy.sparse.csgraph import reverse_cuthill_mckee

    pattern = sparse.csr_array(matrix != 0)
    natural = np.arange(pattern.shape[0])  # pyright: ignore[reportOptionalSubscript]
    by_count = np.argsort(np.diff(pattern.indptr), kind="stable")

    def envelope(order: NDArray[Any]) -> int:
        rows = sparse.coo_array(pattern[order][:, order])
        first = natural.copy()
        np.minimum.at(first, rows.coords[0], rows.coords[1])
        return int((natural - first).sum())

    orders = [natural, by_count, reverse_cuthill_mckee(pattern, symmetric_mode=True)]
    return min(orders, key=envelope).tolist()


def quadratic(matrix: csr_array, vector: Sequence[Any]) -> sympy.Expr:
    """Half of x^T A x, of what is not zero."""
    from scipy import sparse

    upper = sparse.triu(matrix).tocoo()
    terms = [
        sympy.Float(float(value)) * (vector[i] ** 2 / 2 if i == j else vector[i] * vector[j])
        for i, j, value in zip(upper.row, upper.col, upper.data, strict=True)
        if value != 0.0
    ]
    return sympy.Add(*terms)


def _symmetric(letter: str, source: Matrix) -> csr_array:
    from scipy import sparse

    read: Any = _read(letter, source) if isinstance(source, str | os.PathLike) else source
    try:
        matrix: Any = sparse.csr_array(read, dtype=float)
    except (TypeError, ValueError) as error:
        raise StickslipError(f"{letter} is no matrix of numbers: {error}") from None
    if matrix.ndim != 2 or matrix.shape[0] != matrix.shape[1] or not matrix.shape[0]:
        raise StickslipError(f"{letter} must be square, it is {matrix.shape}")
    if not np.isfinite(matrix.data).all():
        raise StickslipError(f"{letter} holds numbers that are not finite")
    largest = abs(matrix).max()
    if abs(matrix - matrix.T).max() > _ASYMMETRIC * largest:
        raise StickslipError(
            f"{letter} is not symmetric. Forces that are no gradient, and gyroscopic ones, belong to 'applied'"
        )
    return sparse.csr_array((matrix + matrix.T) / 2)


def _read(letter: str, source: str | os.PathLike[str]) -> NDArray[Any] | spmatrix | sparray:
    """A matrix from a file."""
    from scipy import io

    text = os.fspath(source)
    file_name, _, key = text.rpartition(":") if ".mat:" in text else (text, "", "")
    path = Path(file_name)
    try:
        if path.suffix == ".mtx":
            return io.mmread(path)
        if path.suffix == ".npy":
            return np.load(path, allow_pickle=False)
        if path.suffix == ".mat" and key:
            return io.loadmat(path, variable_names=[key])[key]
    except (OSError, ValueError, NotImplementedError) as error:
        raise StickslipError(f"{letter} cannot be read from {path}: {error}") from None
    except KeyError:
        variables = ", ".join(name for name, *_ in io.whosmat(path))
        raise StickslipError(f"{path} has no '{key}'; it holds {variables}") from None
    raise StickslipError(f"{letter}: {text} is no .mtx, .npy or file.mat:name")
