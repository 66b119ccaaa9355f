"""Inverse dynamics: a declared machine and logs of its efforts and motion give its parameters, and what to think of
them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from fmu_models.base.errors import StickslipError, refuse_unknown
from fmu_models.language.mechanism import Mechanism
from identification.inference.lmfit_exchange import given
from identification.inference.uncertainty import autocorrelation, inflation
from identification.machines.doubts import effort_delay, moving, on_logs, pulled
from identification.machines.identify import METHODS, Identified, least_squares, solve_machine
from identification.machines.machine_fit import MachineFit, MachineParameter
from identification.machines.motion import Conditions, Cutoffs, MachineLog, motions
from identification.machines.problem import WARMED
from identification.machines.regressor import Base, Regressor, base_parameters, regressor_of
from identification.machines.rows import Rows, rows_of, together
from identification.machines.scores import joint_scores
from identification.machines.verdicts import Quality, verdicts

if TYPE_CHECKING:
    from lmfit import Parameters


def identify_machine(
    mechanism: Mechanism,
    logs: Sequence[MachineLog],
    *,
    known: Mapping[str, float] | None = None,
    cutoff: float | None = 10.0,
    parallel_cutoff: float | None = None,
    still: float = 0.0,
    method: str = METHODS[0],
    parameters: Parameters | None = None,
    held_out: Sequence[MachineLog] = (),
    progress: Callable[[float], None] | None = None,
) -> MachineFit:
    """Base parameters of a declared machine from logs of efforts and positions.

    known: values of parameters that are not to be found, by name; cutoff: Hz, of the low-pass of positions, None to
    filter logs as their recipe says; parallel_cutoff: of that over efforts and columns, the same if None; still: share
    of its usual speed below which samples of a joint are left out, for it may stick there; method: "instruments" or
    "least squares"; parameters: for least squares, bounds of base parameters and which are held, by name as lmfit takes
    it (m2_r2 for "m2 r2"); held_out: logs that only score. StickslipError: as in `regressor_of`, `motions` and
    `solve_machine`.
    """
    refuse_unknown(method, METHODS, f"There is no method '{method}'.")
    if not logs:
        raise StickslipError("There is no log. Give one, better several.")
    regressor = regressor_of(mechanism, known)
    base = base_parameters(regressor)
    cutoffs = _cutoffs(cutoff, parallel_cutoff, still)
    conditions = Conditions.of(logs)
    logs, held_out = conditions.relative(logs), conditions.relative(held_out)
    result = solve_machine(regressor, base, logs, cutoffs, method=method, limits=given(parameters), progress=progress)
    units = {input_.name: input_.unit for input_ in mechanism.inputs}
    others = _others(regressor, base, held_out, cutoffs)
    joints = joint_scores(result, others, [units[name] for name in regressor.efforts])
    listed = _parameters(mechanism, base, result)
    quality = _quality(result, oversampled=cutoffs is not None)
    at_rest, late = {}, None
    rows = None if cutoffs is None or parameters is not None else moving(result, cutoffs)
    if rows is not None:
        without = least_squares(rows)
        at_rest = {} if still else pulled(result, without)
        late = effort_delay(result, rows, without)
    names = tuple(log.name for log in logs)
    remarks = [
        *_on_conditions(result, conditions),
        *on_logs(result, names),
        *verdicts(mechanism, result, listed, joints, quality, at_rest, late),
    ]
    return MachineFit(
        machine=mechanism.name,
        title=mechanism.title,
        source=mechanism.source,
        method=method,
        joints=joints,
        parameters=listed,
        known=dict(known or {}),
        silent=base.silent,
        cutoff=cutoffs and cutoffs.kinematic,
        parallel_cutoff=cutoffs and cutoffs.parallel,
        logs=names,
        samples=int(np.count_nonzero(result.rows.used)),
        condition=quality.condition,
        raw_condition=float(np.linalg.cond(result.rows.weighted[0])),
        neighbour_correlation=quality.neighbour_correlation,
        effective_samples=quality.effective_samples,
        rounds=result.best.rounds,
        still=still,
        conditions=conditions,
        verdicts=(*remarks, *dict.fromkeys(note for log in (*logs, *held_out) for note in log.notes)),
        identified=result,
    )


def _on_conditions(result: Identified, conditions: Conditions) -> list[str]:
    """What is assumed of the normal force, and how much worse efforts are told without; what is open of temperature."""
    notes, pieces = [], result.pieces
    loads = [piece.load for piece in pieces if piece.load is not None]
    if conditions.load is not None and loads and result.rows.names:
        ignored = rows_of(result.regressor, result.base, [replace(piece, load=None) for piece in pieces])
        ignored = replace(ignored, deviation=result.rows.deviation)
        left = [
            float(np.linalg.norm(rows.residual(values) * rows.weight) / np.linalg.norm(rows.effort * rows.weight))
            for rows, values in (
                (result.rows, result.best.values),
                (ignored, least_squares(ignored, result.limits).values),
            )
        ]
        low, high = (conditions.load * float(end(np.concatenate(loads))) for end in (np.min, np.max))
        notes.append(
            f"Friction is taken in proportion to the normal force, {low:.3g} to {high:.3g} N, and its parameters are "
            f"those at {conditions.load:.3g} N: {100 * left[0]:.2g} % are left of the efforts, {100 * left[1]:.2g} % "
            "where the force is ignored. A free run takes it as constant."
        )
    warmer = [piece.warmer for piece in pieces if piece.warmer is not None]
    if conditions.temperature is not None and warmer:
        change = float(np.ptp(np.concatenate(warmer)))
        notes.append(
            f"The temperature changes by {change:.3g} K: "
            + ("too little to show." if change < WARMED else "laws compared by --laws follow it, by a_T.")
        )
    return notes


def _cutoffs(cutoff: float | None, parallel: float | None, still: float) -> Cutoffs | None:
    if not 0 <= still < 1:
        raise StickslipError(
            f"still = {still:g} is no share of the usual speed: give 0.1, say, or 0 to leave nothing out."
        )
    if cutoff is None:
        if still:
            raise StickslipError("still needs a cutoff: a recipe with its own filters says 'least_speed'.")
        return None
    return Cutoffs(cutoff, parallel or cutoff, still)


def _quality(result: Identified, *, oversampled: bool) -> Quality:
    columns, effort = result.rows.weighted
    best = result.best
    neighbours = autocorrelation(effort - columns @ best.values, result.rows.series)
    return Quality(
        *together(result.rows),
        neighbours,
        np.count_nonzero(result.rows.used) / inflation(best.white, best.covariance),
        oversampled,
    )


def _others(
    regressor: Regressor, base: Base, held_out: Sequence[MachineLog], cutoffs: Cutoffs | None
) -> dict[str, Rows]:
    """Rows of each held-out log by its name, which several may have."""
    rows: dict[str, Rows] = {}
    for log in held_out:
        count = sum(name.partition(" (")[0] == log.name for name in rows)
        name = f"{log.name} ({count + 1})" if count else log.name
        rows[name] = rows_of(regressor, base, motions([log], regressor.joints, cutoffs))
    return rows


def _parameters(mechanism: Mechanism, base: Base, result: Identified) -> tuple[MachineParameter, ...]:
    best, squares = result.best, result.least_squares
    meanings = {p.name: p.description for p in mechanism.parameters}
    white = np.sqrt(np.diag(best.white))
    shift = np.divide(
        best.values - squares.values, best.deviation, out=np.zeros_like(best.values), where=best.deviation > 0
    )
    return tuple(
        MachineParameter(
            parameter.name,
            parameter.combination,
            meanings.get(parameter.combination, ""),
            float(best.values[index]),
            parameter.unit,
            float(best.deviation[index]),
            float(white[index]),
            float(squares.values[index]),
            float(squares.deviation[index]),
            float(shift[index]),
            parameter.frictional,
        )
        for index, parameter in enumerate(base.parameters)
    )
