"""Friction laws of each joint of a machine, compared on its effort: laws of coefficients as laws of friction force.

    of one joint alone     effort = columns of what is no friction + law, all found together
    of joint j of several  tau_j - (Y theta)_j over what is no friction, at its values = offset + law

A law is a function of the joint's own velocity, or remembers its way (`memory`).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import sympy

from fmu_models.base.errors import StickslipError, refuse_unknown
from fmu_models.language.mechanism import Mechanism
from identification.inference.comparison import Comparing, LawComparison, compare_problems, single_law
from identification.inference.problem import Solution, Unknown, solve
from identification.laws import find_law, slip_laws
from identification.laws.law import FittableLaw
from identification.machines.machine_fit import MachineFit
from identification.machines.memory import SEARCH, JointMemory, joint_memory, memory_laws, presliding, resolution_of
from identification.machines.motion import JointMotion, MachineLog, motions
from identification.machines.predicted import cutoffs_of
from identification.machines.problem import JointFriction, MachineProblem, Sign, load_of, machine_problem
from identification.machines.regressor import SIGN, SLIP, base_parameters, regressor_of
from identification.machines.rows import PARTS, Rows, check_excited, rows_of

BY_DIRECTION = "Coulomb+viscous by direction"  # no function of slip speed alone
LAWS = ("Coulomb", "Coulomb+viscous", "Stribeck+viscous", BY_DIRECTION)
VISCOUS = "+viscous"  # behind a law with memory: what grows with the speed beside it
LINEAR = ("F_c+", "F_c-", "F_v")  # columns of friction
COEFFICIENT = "mu"  # parameters of a law that begin so are friction coefficients, or proportional to them


def comparable() -> tuple[str, ...]:
    """Names of the laws of friction force that may be compared."""
    return (*slip_laws(), BY_DIRECTION, *(name + suffix for name in memory_laws() for suffix in ("", VISCOUS)))


def check_laws(laws: Sequence[str]) -> None:
    """Refuse laws that cannot be compared. StickslipError: there is no such law."""
    for name in laws:
        if not set(name) & {".", ":"}:  # of a file or a module
            refuse_unknown(name, comparable(), f"There is no friction law '{name}'.")


@dataclass(frozen=True, eq=False, kw_only=True)
class ForceLaw(FittableLaw):
    """A law of friction force. coefficients: the law that it is of; scale: N or N m, force of a coefficient of 1;
    factor: (m,) of its parameters over those of the coefficients."""

    coefficients: FittableLaw
    scale: float
    factor: np.ndarray

    def start(self, v: np.ndarray, mu: np.ndarray) -> np.ndarray:
        """First guess, as in `FittableLaw`; mu: rough forces (n,)."""
        return self.factor * self.coefficients.start(v, mu / self.scale)

    def warnings(self, q: np.ndarray) -> tuple[str, ...]:
        """Warnings of the coefficients, whatever the units of the compared parameters, by the names of this law."""
        warnings = self.coefficients.warnings(q)
        for p in self.coefficients.parameters:
            warnings = tuple(warning.replace(f"{p.name} =", f"{_force_name(p.name)} =") for warning in warnings)
        return warnings


def force_law(law: FittableLaw, scale: float, turning: bool) -> ForceLaw:
    """A law of friction coefficients as one of friction force. scale: N or N m, force of a coefficient of 1; turning:
    whether the body turns: rad and N m in place of m and N."""
    factor = np.array([scale if p.name.startswith(COEFFICIENT) else 1.0 for p in law.parameters])
    shape = (-1, 1)
    parameters = tuple(
        replace(
            p,
            name=_force_name(p.name),
            unit=_force_unit(p.name, p.unit, turning),
            minimum=by * p.minimum,
            maximum=by * p.maximum,
        )
        for p, by in zip(law.parameters, factor, strict=True)
    )
    changes: dict[str, Any] = {
        "parameters": parameters,
        "value": lambda v, q: scale * law.value(v, q / factor),
        "gradient": lambda v, q: scale * law.gradient(v, q / factor) / factor.reshape(shape),
    }
    return ForceLaw(**vars(law) | changes, coefficients=law, scale=scale, factor=factor)


def _force_name(name: str) -> str:
    return "F" + name.removeprefix(COEFFICIENT) if name.startswith(COEFFICIENT) else name


def _force_unit(name: str, unit: str, turning: bool) -> str:
    """Unit of a parameter of a law where friction is an effort and the slip speed that of the coordinate."""
    turned = unit.replace("s/m", "s/rad").replace("m/s", "rad/s") if turning else unit
    if not name.startswith(COEFFICIENT):
        return turned
    effort = "N m" if turning else "N"
    return effort if unit == "1" else f"{effort} {turned}"


def compare_joint_laws(
    mechanism: Mechanism,
    fit: MachineFit,
    logs: Sequence[MachineLog],
    laws: Sequence[str] = LAWS,
    *,
    normal_force: float | None = None,
    sign: Sign = np.sign,
) -> dict[str, LawComparison]:
    """By joint, laws judged by HAC deviations and parts held out. logs: those of the fit; normal_force: N, of which
    coefficients of friction are, else of the root mean square effort; sign: of velocities, that goes with the laws.
    StickslipError: as in `motions`; there is no such law; or a log is too short to compare laws by."""
    check_laws(laws)
    regressor = regressor_of(mechanism, fit.known)
    pieces = motions(fit.conditions.relative(logs), regressor.joints, cutoffs_of(fit))
    stacked = rows_of(regressor, base_parameters(regressor), pieces)
    comparisons = {}
    for number, joint in enumerate(fit.joints):
        turning = joint.unit == "N m"
        rows = _beside_friction(fit, stacked.where(stacked.joint == number), joint.unit, len(fit.joints) == 1)
        remember = [name for name in laws if name.removesuffix(VISCOUS) in memory_laws()]
        aside: dict[str, str] = {}
        sliders, step = None, resolution_of(logs, number)
        if remember:
            try:
                sliders, residual = presliding(rows, pieces, number, step)
                # what they leave is the unit of residuals: what a joint remembers at first is known beside it
                rows = replace(rows, deviation=np.array([residual]))
            except StickslipError as error:
                aside = dict.fromkeys(remember, str(error))
        problems: dict[str, MachineProblem] = {}
        for name in laws:
            if name in aside:
                continue
            candidates, friction = _candidates(name, rows, pieces, number, joint.unit), None
            check_excited(candidates, ", ".join(fit.logs))
            if sliders and name in remember:
                form = name.removesuffix(VISCOUS)
                friction = joint_memory(form, sliders, pieces, number, step, turning=turning)
            elif name != BY_DIRECTION:
                scale = normal_force or float(np.sqrt(np.mean(rows.effort**2)))
                friction = JointFriction(force_law(find_law(name), scale, turning), pieces, number, sign)
            problems[name] = machine_problem(candidates, friction)
        solutions = {
            name: solve(problem, **(SEARCH if isinstance(problem.friction, JointMemory) else {}))
            for name, problem in problems.items()
        }
        # a law whose friction drives the joint is put aside
        warnings = {name: _meaning(problem, solutions[name]) for name, problem in problems.items()}
        if len(problems) == 1:
            ((name, problem),) = problems.items()
            comparison = single_law(name, problem, solutions[name], [joint.joint], f"{name} alone could be fitted.")
        else:
            options = Comparing("hac", PARTS, warnings)
            comparison = compare_problems(problems, [joint.joint], solutions=solutions, options=options)
        scores = tuple(replace(score, rms=score.rms * float(rows.deviation[0])) for score in comparison.scores)
        comparisons[joint.joint] = replace(comparison, scores=scores, aside=aside)
    return comparisons


def with_laws(
    mechanism: Mechanism, fit: MachineFit, logs: Sequence[MachineLog], laws: Sequence[str], **options: Any
) -> MachineFit:
    """The fit with laws compared by joint, where any are asked for. options: as in `compare_joint_laws`.

    Errors as for `compare_joint_laws`.
    """
    assumed = _known_friction(mechanism, fit)
    if not laws:
        return fit
    if assumed:
        notes = [f"Friction laws were not compared, for {', '.join(assumed)} is taken as known: leave it to be found."]
        return replace(fit, verdicts=(*fit.verdicts, *notes))
    comparisons, notes = compare_joint_laws(mechanism, fit, logs, laws, **options), []
    for joint, comparison in comparisons.items():
        aside = [
            f"{score.law} is put aside on '{joint}': {' '.join(score.warnings)}"
            for score in comparison.scores
            if score.warnings
        ]
        aside += [f"{law} is left aside on '{joint}': {why}" for law, why in comparison.aside.items()]
        notes += [f"Friction laws of '{joint}': {comparison.verdict}", *aside]
    return replace(fit, laws=comparisons, verdicts=(*fit.verdicts, *notes))


def _known_friction(mechanism: Mechanism, fit: MachineFit) -> list[str]:
    forces = [friction.law.force(SLIP, SIGN) for friction in mechanism.frictions]
    symbols = {symbol for force in (*forces, mechanism.dissipation) for symbol in sympy.sympify(force).free_symbols}
    return [p.name for p in mechanism.parameters if p in symbols and fit.known.get(p.name, 0.0) != 0]


def _beside_friction(fit: MachineFit, rows: Rows, unit: str, alone: bool) -> Rows:
    """Rows of a joint with columns of what is no friction, or with an offset in place of what is known by the fit: an
    offset of the machine's own is half the difference of friction by direction, and left to the laws."""
    rows = replace(rows, joint=np.zeros_like(rows.joint), deviation=np.ones(1))
    smooth = np.array([not fit[name].frictional for name in rows.names])
    if alone:
        unknowns = tuple(unknown for unknown, keep in zip(rows.unknowns, smooth, strict=True) if keep)
        return replace(rows, unknowns=unknowns, columns=rows.columns[:, smooth])
    values = np.array([fit[name].value for name in rows.names])
    smooth &= ~_steady(rows)
    effort, none = rows.residual(values * smooth), np.zeros_like(rows.effort)
    offset = (Unknown("offset", unit, description="offset of the effort"),)
    return replace(rows, unknowns=offset, columns=np.ones((len(effort), 1)), given=none, effort=effort)


def _steady(rows: Rows) -> np.ndarray:
    """Which columns (b,) are the same throughout."""
    return np.ptp(rows.columns, axis=0) < 1e-6 * np.max(np.abs(rows.columns), axis=0)


def _candidates(name: str, rows: Rows, pieces: Sequence[JointMotion], joint: int, unit: str) -> Rows:
    """Rows with the columns that a law is linear in: friction of each direction in place of an offset, which is half
    the difference of both, or viscous friction beside a law with memory."""
    viscous = "N m s/rad" if unit == "N m" else "N s/m"
    names: tuple[str, ...] = ()
    staying = np.ones(len(rows.unknowns), dtype=bool)
    if name == BY_DIRECTION:
        names, staying = ("F_c+", "F_c-", "F_v+", "F_v-"), ~_steady(rows)
    elif name.endswith(VISCOUS) and name.removesuffix(VISCOUS) in memory_laws():
        names = ("F_v",)

    def of(v: np.ndarray) -> np.ndarray:
        sign = np.sign(v)
        shapes = (np.maximum(sign, 0), np.minimum(sign, 0), np.maximum(v, 0), np.minimum(v, 0))
        return np.stack(shapes if name == BY_DIRECTION else (v,), axis=1)

    if not names:
        return rows
    free = tuple(unknown for unknown, keep in zip(rows.unknowns, staying, strict=True) if keep)
    terms = tuple(Unknown(term, viscous if term.startswith("F_v") else unit) for term in names)
    columns = np.concatenate([piece.thinned(of(piece.velocity[:, joint]) * load_of(piece)) for piece in pieces])
    return replace(rows, unknowns=(*free, *terms), columns=np.concatenate([rows.columns[:, staying], columns], axis=1))


def _meaning(problem: MachineProblem, solution: Solution) -> tuple[str, ...]:
    """The reasons why the values of a law have no meaning."""
    named = list(zip(problem.unknowns, solution.values, solution.at_bound, strict=True))
    wrong = [f"{u.name} = {value:.4g}" for u, value, _ in named if u.name.startswith(LINEAR) and value < 0]
    driving = (f"{', '.join(wrong)} below zero: friction that drives.",) if wrong else ()
    if problem.friction is None:
        return driving
    warned = problem.friction.warnings(problem, solution)
    # a law with memory may lack what can be nil, such as a damping of bristles
    least = 0.0 if isinstance(problem.friction, JointMemory) else None
    ends = [
        f"{u.name} = {value:.3g} at the end of its range"
        for u, value, at in named
        if at and u.prior is None and u.minimum != least
    ]
    return (*driving, *warned, *((f"{', '.join(ends)}.",) if ends else ()))
