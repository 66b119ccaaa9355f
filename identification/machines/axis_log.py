"""Logs of the machine that a recipe declares: its columns, units and gains, without its filters."""

from __future__ import annotations

import os
from collections.abc import Collection, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from fmu_models.base.errors import StickslipError
from fmu_models.base.registry import Reference
from fmu_models.language.mechanism import Mechanism
from identification.machines.axis import declared_axis
from identification.machines.axis_terms import check_terms, read_model
from identification.machines.motion import MachineLog
from identification.measurement.recipe import EFFORT, POSITION, TIME, Recipe
from identification.measurement.signals import prepare
from rig_io.packages.datapackage import read_columns


def axis_with_logs(
    recipe: Recipe,
    paths: Sequence[str | os.PathLike[str]],
    *,
    reader: Reference | None = None,
    repair: Collection[str] = (),
) -> tuple[Mechanism, list[MachineLog]]:
    """The machine of a recipe's terms and its logs, as `identify_machine` takes them. reader, repair: as in
    `rig_io.read_log`.

    Raises:
        StickslipError: the recipe names no terms or no position, or a log does not fit it.
    """
    terms = read_model(recipe).terms
    if POSITION not in recipe.signals:
        raise StickslipError(f"{recipe.name} has no signal '{POSITION}'. Add [signals.{POSITION}].")
    # what is found by instruments has one low-pass for all signals, and derivatives of its own
    plain = replace(recipe, signals={name: replace(one, filter=None) for name, one in recipe.signals.items()})
    turning, logs = False, []
    for path in paths:
        prepared = prepare(plain, read_columns(path, reader=reader), repair)
        check_terms(recipe, prepared, terms)
        time, position, effort = (
            np.concatenate([piece.values[name] for piece in prepared.pieces]) for name in (TIME, POSITION, EFFORT)
        )
        logs.append(MachineLog(Path(path).name, time, position[:, None], effort[:, None], prepared.notes))
        turning = prepared.turning
    return declared_axis(terms, turning), logs
