"""A machine to be identified, with what reads its logs; one that a recipe declares, with the recipe's filters."""

from __future__ import annotations

import os
from abc import ABC, abstractmethod
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from fmu_models.base.digits import value_with_sd
from fmu_models.base.errors import StickslipError
from fmu_models.base.registry import Reference
from fmu_models.language.mechanism import Mechanism
from identification.inference.lmfit_exchange import NOTHING
from identification.inference.problem import identifier
from identification.machines.axis import CARRIED, Model, Term, check_terms, declared_axis, read_model
from identification.machines.identify import solve_machine
from identification.machines.joint_laws import with_laws
from identification.machines.machine_fit import MachineFit
from identification.machines.motion import Cutoffs, JointMotion, MachineLog
from identification.machines.regressor import base_parameters, regressor_of
from identification.machines.verdicts import BIASED
from identification.measurement.recipe import ACCELERATION, EFFORT, POSITION, TIME, VELOCITY, WEIGHT, Recipe
from identification.measurement.signals import Piece, Prepared, decimated, decimating, prepare, turning_of
from rig_io.packages.datapackage import read_columns

CHECKED = 10.0  # Hz


class Machine(ABC):
    """mechanism: as `identify_machine` takes it."""

    mechanism: Mechanism

    @abstractmethod
    def logs(
        self, paths: Sequence[str | os.PathLike[str]], *, reader: Reference | None = None, repair: Collection[str] = ()
    ) -> list[MachineLog]:
        """Logs as `identify_machine` takes them. reader, repair: as in `rig_io.read_log`. StickslipError: a log cannot
        be read or is not one of this machine."""

    def compared(self, fit: MachineFit, logs: Sequence[MachineLog], laws: Sequence[str] = ()) -> MachineFit:
        """The fit with friction laws: these, else those that the machine's recipe asks for.

        Errors as for `with_laws`.
        """
        return with_laws(self.mechanism, fit, logs, laws)

    def known(self, cutoff: float | None) -> dict[str, float]:
        """Parameters that are not to be found, beside those that the user knows. cutoff: as in `identify_machine`."""
        return {}


@dataclass(frozen=True, eq=False)
class RecipeMachine(Machine):
    """A recipe with the machine that its terms declare."""

    recipe: Recipe
    model: Model
    mechanism: Mechanism

    def logs(
        self, paths: Sequence[str | os.PathLike[str]], *, reader: Reference | None = None, repair: Collection[str] = ()
    ) -> list[MachineLog]:
        """As in `Machine`, with the recipe's filters and without."""
        return [self._log(path, reader, repair) for path in paths]

    def _log(self, path: str | os.PathLike[str], reader: Reference | None, repair: Collection[str]) -> MachineLog:
        recipe, table = self.recipe, read_columns(path, reader=reader)
        prepared = prepare(recipe, table, repair)
        # what cutoffs are given for has one low-pass for all signals, and derivatives of its own
        bare = {name: replace(signal, filter=None) for name, signal in recipe.signals.items()}
        plain = prepare(replace(recipe, signals=bare), table, repair)
        ready = motions_of(recipe, prepared)
        time, effort = _joined(plain, TIME), _joined(plain, EFFORT)
        position = _joined(plain, POSITION) if POSITION in recipe.signals else np.full_like(time, np.nan)
        return MachineLog(Path(path).name, time, position[:, None], effort[:, None], prepared.notes, ready)

    def compared(self, fit: MachineFit, logs: Sequence[MachineLog], laws: Sequence[str] = ()) -> MachineFit:
        """As in `Machine`, and with instruments beside the recipe's own filters."""
        names, model = laws or self.model.laws, self.model
        judged = replace(fit, verdicts=(*fit.verdicts, *self._beside_instruments(fit, logs)))
        return with_laws(self.mechanism, judged, logs, names, normal_force=model.normal_force, sign=model.sign)

    def _beside_instruments(self, fit: MachineFit, logs: Sequence[MachineLog]) -> list[str]:
        """Check whether least squares with the recipe's own filters is biased, by noise in accelerations that are
        derivatives."""
        result, acceleration = fit.identified, self.recipe.signals.get(ACCELERATION)
        if fit.cutoff is not None or result is None or result.limits != NOTHING:
            return []
        if acceleration is None or acceleration.column is not None:
            return []
        try:
            check = solve_machine(result.regressor, result.base, logs, Cutoffs(CHECKED, CHECKED)).best
        except StickslipError:
            return []  # no instruments, no second opinion
        biased = np.abs(check.values - result.best.values) > BIASED * np.maximum(check.deviation, result.best.deviation)
        values = zip(fit.parameters, check.values, check.deviation, strict=True)
        estimates = [f"{p.name} = {value_with_sd(value, sd, p.unit)}" for p, value, sd in values]
        named = ", ".join(estimate for estimate, differs in zip(estimates, biased, strict=True) if differs)
        if not named:
            return []
        return [
            f"Instruments at a cutoff of {CHECKED:g} Hz give {named}, more than {BIASED:g} deviations away: noise of "
            "the positions biases least squares, or the model lacks something. See --method instruments."
        ]

    def known(self, cutoff: float | None) -> dict[str, float]:
        """As in `Machine`: with the recipe's own filters what moves has no inertia beside its terms."""
        none = cutoff is None and any(p.name == CARRIED for p in self.mechanism.parameters)
        return {CARRIED: 0.0} if none else {}


def recipe_machine(recipe: Recipe) -> RecipeMachine:
    """The machine of a recipe's terms. StickslipError: the recipe names no terms, or such as no log tells apart."""
    model = read_model(recipe)
    turning = turning_of(recipe)
    check_terms(recipe, turning, model.terms)
    mechanism = declared_axis(model.terms, turning, title=recipe.title, source=recipe.source)
    _check_apart(recipe, model.terms, mechanism)
    return RecipeMachine(recipe, model, mechanism)


def _check_apart(recipe: Recipe, terms: Sequence[Term], mechanism: Mechanism) -> None:
    regressor = regressor_of(mechanism)
    base = base_parameters(regressor)
    for column in set(range(len(regressor.names))) - set(base.places):
        dependent = {column, *(base.places[row] for row in np.flatnonzero(base.combine[:, column]))}
        names = ", ".join(term.name for term in terms if regressor.names.index(identifier(term.name)) in dependent)
        raise StickslipError(
            f"{recipe.name} cannot tell the terms {names} apart, whatever the log: each is a sum of the others. Leave "
            "one out."
        )


def motions_of(recipe: Recipe, prepared: Prepared) -> tuple[JointMotion, ...]:
    """The pieces of a log with the recipe's filters. StickslipError: none of its samples is fast enough."""
    motions = tuple(piece for raw in prepared.pieces if len((piece := _motion(recipe, prepared, raw)).indices))
    if not motions:
        raise StickslipError(f"{prepared.source}: no sample is as fast as 'least_speed' of {recipe.name}. Lower it.")
    return motions


def _motion(recipe: Recipe, prepared: Prepared, piece: Piece) -> JointMotion:
    """A piece with the recipe's filters; a signal that it does not have counts as zero."""
    values, every = piece.values, recipe.sampling.decimate
    none = np.zeros_like(values[TIME])
    position, velocity, acceleration, effort = (
        values.get(name, none)[:, None] for name in (POSITION, VELOCITY, ACCELERATION, EFFORT)
    )
    rows = decimated(len(none), every)
    if recipe.sampling.least_speed.value > 0:
        rows = rows[np.abs(decimating(velocity[:, 0], every)[rows]) >= recipe.sampling.least_speed.value]
    weight = values.get(WEIGHT, none + 1.0)[:, None]
    smooth = partial(decimating, every=every)
    return JointMotion(0, prepared.step, values[TIME], position, velocity, acceleration, effort, weight, smooth, rows)


def _joined(prepared: Prepared, name: str) -> np.ndarray:
    return np.concatenate([piece.values[name] for piece in prepared.pieces])
