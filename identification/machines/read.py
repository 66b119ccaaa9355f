"""A declared machine and its logs: columns named after its coordinates and efforts, or mapped to them."""

import os
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fmu_models.base.errors import StickslipError, nearest
from fmu_models.base.registry import Reference
from fmu_models.base.trust import admit, is_place
from fmu_models.base.unit_names import conversion_factor, scale_of
from fmu_models.language.mechanism import Mechanism
from fmu_models.language.quantities import Quantity
from fmu_models.oscillators import load
from identification.machines.by_recipe import Machine, recipe_machine
from identification.machines.machine_fit import MachineFit
from identification.machines.motion import MachineLog
from identification.machines.regressor import effort_inputs
from identification.machines.urdf import GRAVITY, mechanism_from_urdf
from identification.measurement.recipe import SUFFIX, TIME, read_recipe
from rig_io.logs.table import Table
from rig_io.packages.datapackage import read_columns

URDF = ".urdf"
CONDITIONS = {"normal_force": "N", "temperature": "K"}  # columns beside the motion that friction follows
LEAST = 100  # rows
OTHER = 0.2  # relative: a recorded velocity that differs more is not the derivative of the position


@dataclass(frozen=True, eq=False)
class DeclaredMachine(Machine):
    """A declared machine, with columns of its logs by name of a coordinate, effort or ``time``, where they differ."""

    mechanism: Mechanism
    columns: Mapping[str, str]

    def logs(
        self, paths: Sequence[str | os.PathLike[str]], *, reader: Reference | None = None, repair: Collection[str] = ()
    ) -> list[MachineLog]:
        """As in `Machine`; nothing is repaired."""
        if repair:
            raise StickslipError("--repair is for recipes: mend the logs of a declared machine before.")
        return [read_machine_log(path, self.mechanism, self.columns, reader=reader) for path in paths]


def is_recipe(reference: str) -> bool:
    """Whether a name stands for a recipe rather than for a declaration, in a file or a module, or a URDF."""
    return not reference.endswith(URDF) and (reference.endswith(SUFFIX) or not is_place(reference))


def machine_at(reference: str, gravity: Sequence[float] = (), columns: Mapping[str, str] | None = None) -> Machine:
    """The machine that a declaration, a URDF or a recipe stands for, and how its logs are read. gravity, columns: as in
    `declared_machine` and `read_machine_log`; a recipe has its own. StickslipError: as in `declared_machine` or
    `recipe_machine`, or what a recipe has itself is given."""
    if not is_recipe(reference):
        return DeclaredMachine(declared_machine(reference, gravity), dict(columns or {}))
    if gravity or columns:
        raise StickslipError(
            f"'{reference}' is a recipe, which says its columns, units and gravity itself: --column and --gravity are "
            "for declared machines, my_robot.py."
        )
    return recipe_machine(read_recipe(reference))


def declared_machine(reference: str, gravity: Sequence[float] = ()) -> Mechanism:
    """The machine that a declaration, in a file or a module, or a URDF stands for. gravity: m/s^2 in the frame of the
    base of a URDF; along -z if empty. StickslipError: there is none, it is declared without energies, or gravity is
    given to one that declares it."""
    if reference.endswith(URDF):
        return mechanism_from_urdf(reference, gravity=gravity or GRAVITY)
    if gravity:
        raise StickslipError(
            f"'{reference}' declares its potential energy itself: turn gravity there. Of a URDF it can be given."
        )
    loaded = load(reference)
    if not isinstance(loaded, Mechanism):
        raise StickslipError(
            f"'{reference}' is of class {type(loaded).__name__}: efforts follow from energies. Declare a Mechanism."
        )
    return loaded


def machine_of(fit: MachineFit, declaration: str | None = None, *, trust: bool = False) -> Machine:
    """The machine of a fit, where it was declared, or where it is now; trust: the Python file that the fit names may
    run. StickslipError: it is not there, the fit does not say where, or it names code that is not trusted."""
    source = declaration or fit.declaration
    if not source:
        raise StickslipError(
            f"The fit does not say where {fit.machine} is declared: name its declaration with --machine my_robot.py."
        )
    if not declaration:
        admit(source, Path(), trust=trust)
    return machine_at(source, fit.gravity, fit.columns)


def read_machine_log(
    path: str | os.PathLike[str],
    mechanism: Mechanism,
    columns: Mapping[str, str] | None = None,
    *,
    reader: Reference | None = None,
) -> MachineLog:
    """A log of a machine's positions and efforts, in the units of the declaration.

    columns: column by name of a coordinate, effort or ``time``, ``normal_force`` or ``temperature``, where they differ;
    reader: as in `rig_io.read_log`. Rows with an empty cell are left out. A recorded velocity is compared with the
    position's. StickslipError: a column is not there, of another unit, or hardly filled.
    """
    table = read_columns(path, reader=reader)
    named = dict(columns or {})
    coordinates, efforts = mechanism.coordinates, effort_inputs(mechanism)
    velocities = [q.v for q in coordinates]
    names = {TIME, *CONDITIONS, *(coordinate.name for coordinate in (*coordinates, *velocities, *efforts))}
    for name in named:
        if name not in names:
            raise StickslipError(
                f"{mechanism.name} has no coordinate or effort '{name}'.{nearest(name, names)} Name columns as "
                f"--column {efforts[0].name}=COLUMN."
            )
    used = [named.get(name, name) for name in (TIME, *(coordinate.name for coordinate in (*coordinates, *efforts)))]
    time = _column(table, used[0], None)
    position = np.stack([_column(table, named.get(q.name, q.name), q) for q in coordinates], axis=1)
    effort = np.stack([_column(table, named.get(drive.name, drive.name), drive) for drive in efforts], axis=1)
    beside = {key: _condition(table, named.get(key, key), unit, key in named) for key, unit in CONDITIONS.items()}
    filled = np.isfinite(time) & np.isfinite(position).all(axis=1) & np.isfinite(effort).all(axis=1)
    if np.count_nonzero(filled) < LEAST:
        raise StickslipError(
            f"{table.source} holds {np.count_nonzero(filled)} whole rows of {len(filled)}; {LEAST} are needed, with a "
            f"time, a position and an effort of every joint.{_emptiest(table, used)}"
        )
    notes = [] if filled.all() else [f"{np.count_nonzero(~filled)} rows of {table.source} with empty cells left out."]
    for joint, v in enumerate(velocities):
        column = named.get(v.name, v.name)
        if column in table.columns:
            velocity = _column(table, column, v)[filled]
            notes += _not_derivative(table.source, column, time[filled], position[filled, joint], velocity)
    load, temperature = (
        None if column is None else np.interp(time[filled], time[np.isfinite(column)], column[np.isfinite(column)])
        for column in beside.values()
    )
    about = {"name": Path(path).name, "notes": tuple(notes), "load": load, "temperature": temperature}
    return MachineLog(time=time[filled], position=position[filled], effort=effort[filled], **about)


def _condition(table: Table, name: str, unit: str, asked: bool) -> np.ndarray | None:
    """A column that friction follows, filled where it is; None where there is none. StickslipError: it is asked for and
    not there, or nowhere filled."""
    if name not in table.columns and not asked:
        return None
    if name not in table.columns:
        raise StickslipError(f"{table.source} has no column '{name}'.{nearest(name, table.columns)}")
    factor, zero = scale_of(table.units.get(name) or unit, unit, f"{table.source}: column '{name}'")
    values = np.asarray(table.columns[name], dtype=float) * factor + zero
    if not np.isfinite(values).any():
        raise StickslipError(f"Column '{name}' of {table.source} holds no number. Leave it out.")
    return values


def _emptiest(table: Table, names: Sequence[str]) -> str:
    """What to say of the emptiest column, where it is to blame."""
    filled = [np.count_nonzero(np.isfinite(np.asarray(table.columns[name], dtype=float))) for name in names]
    least = int(np.argmin(filled))
    return f" Column '{names[least]}' has {filled[least]} numbers." if filled[least] < LEAST else ""


def _column(table: Table, name: str, quantity: Quantity | None) -> np.ndarray:
    if name not in table.columns:
        key = TIME if quantity is None else quantity.name
        raise StickslipError(
            f"{table.source} has no column '{name}'; it has {', '.join(list(table.columns)[:20])}."
            f"{nearest(name, table.columns)} Say which one it is: --column {key}=COLUMN."
        )
    values, target = np.asarray(table.columns[name], dtype=float), "s" if quantity is None else quantity.unit
    unit = table.units.get(name)
    if unit is None or unit == target:
        return values
    try:
        return values * conversion_factor(unit, target)
    except ValueError as error:
        raise StickslipError(
            f"Column '{name}' of {table.source} is in '{unit}', and '{target}' is declared ({error}). Mend the unit "
            "or the declaration."
        ) from error


def _not_derivative(source: str, name: str, time: np.ndarray, position: np.ndarray, velocity: np.ndarray) -> list[str]:
    """What to say of a recorded velocity that is none of this position: their changes over a tenth of the log's usual
    swing are compared."""
    filled = np.isfinite(velocity)
    velocity = np.interp(time, time[filled], velocity[filled]) if filled.any() else np.zeros_like(position)
    travelled = np.concatenate([[0.0], np.cumsum(np.diff(time) * (velocity[1:] + velocity[:-1]) / 2)])
    slope = float(np.polyfit(travelled, position, 1)[0]) if np.ptp(travelled) > 0 else 0.0
    off = position - position.mean() - slope * (travelled - travelled.mean())
    if abs(slope - 1) <= OTHER and np.std(off) <= OTHER * np.std(position):
        return []
    return [
        f"Column '{name}' of {source} is not the derivative of the position (the position changes by {slope:.3g} "
        "times its integral): it was not used. Check its unit and sign."
    ]
