"""The C structures of engine/ensemble, and the call that makes many runs."""

import ctypes
import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fmu_models.base.arrays import Flags, Integers, Vector
from fmu_models.base.errors import StickslipError
from fmu_models.lanes.library import Stepper
from fmu_models.simulation.engine import C, Engine
from fmu_models.simulation.rows import RunRows

_Ensemble = C.structure("Ensemble")
_MESSAGE: int = C.constants(prefix="ENSEMBLE_").MESSAGE
KINDS = C.constants("SectionKind", "SECTION_")
OUTCOMES = C.constants("Outcome", "OUTCOME_")


@dataclass(frozen=True, eq=False)
class Where:
    """The section, as engine/ensemble/ensemble.h has it; ``state`` is a value reference, ``contact`` an index."""

    kind: int
    state: int = 0
    level: float = 0.0
    direction: int = 0
    contact: int = -1


@dataclass(frozen=True, eq=False)
class Targets:
    """Orbits at which a run may end.

    Attributes:
        points: (k, n) of all orbits, as a system has them.
        forms: (k, n, n) quadratic forms, below 1 near a point.
        after: (k,) the point that follows each.
        orbits: (k,) which orbit it belongs to.
        passes: (k,) how many points in a row a motion must come near to.
    """

    points: Vector
    forms: Vector
    after: Integers
    orbits: Integers
    passes: Integers


@dataclass(frozen=True, eq=False)
class EnsembleRuns:
    """Many runs. values: (m, k) of the variables with these references; see engine/ensemble/ensemble.h for the rest."""

    references: list[int]
    values: Vector
    starts: Vector
    periods: Vector
    patience: Vector
    transient: int
    rows: int
    weights: Vector
    batch: int = 1
    follow: int = 0
    resumed: Sequence[bool] | Flags = ()
    longest: int = 0
    settled: float = 0.0
    turns: Vector | None = None
    bound: float = 1e9
    known: Targets | None = None
    along: Sequence[int] = ()
    flow: bool = False
    jacobians: bool = False
    tolerance: float = 1e-14
    stepper: Stepper | None = None


def make_runs(
    engine: Engine, sizes: tuple[int, int], where: Where, runs: EnsembleRuns, stop: NDArray[np.int32]
) -> RunRows:
    """Make the runs, in one call; sizes: numbers of states and contacts; a ``stop`` (1,) that is set ends them.

    Returns:
        Their rows: points are states, memories of all contacts and time, n_states + n_contacts + 1 numbers; derivatives
        are of these by the directions.

    Raises:
        StickslipError: a strobe of a forcing that does not repeat itself with its period.
    """
    n, contacts = sizes
    m, k = len(runs.values), len(runs.along)
    extended = n + contacts + 1
    kinds = {"derivatives": (extended, k)} if runs.jacobians else {"growth": k}
    # the engine writes the time since the last row behind each point
    rows = RunRows.empty(m, runs.rows, extended + 1, contacts, **kinds)  # type: ignore[arg-type]
    messages = np.zeros((m, _MESSAGE), np.uint8)
    targets = runs.known or Targets(np.empty((0, n)), np.empty((0, n, n)), *(np.empty(0, np.int64) for _ in range(3)))
    numbers = {
        **{name: getattr(runs, name) for name in ("values", "starts", "periods", "patience", "weights")},
        **{"turns": np.full(n, np.inf) if runs.turns is None else runs.turns},
        **{"known": targets.points, "metric": targets.forms},
    }
    counts = {"along": runs.along, "next": targets.after, "orbit": targets.orbits, "passes": targets.passes}
    counts["resumed"] = runs.resumed if len(runs.resumed) else [0] * (runs.follow + 1)
    lanes = runs.stepper.at if runs.stepper else 0
    # named as in the engine's struct; they live until the call is over
    arrays: dict[str, NDArray[Any]] = {
        **{name: np.ascontiguousarray(array, dtype=float) for name, array in numbers.items()},
        **{name: np.ascontiguousarray(array, np.int64) for name, array in counts.items()},
        **{"set": np.array(runs.references, np.uint32), "stop": stop},
        **{"room": np.empty(engine.ensemble_room(k) // 8 + 2) if k else np.empty(0)},
        **{"memory": np.empty(max(1, engine.ensemble_memory(runs.longest)))},
        **{
            name: getattr(rows, name) for name in ("points", "held", "began", "steps", "outcomes", "orbits", "in_lanes")
        },
        **{"rows": rows.filled, "recurs": rows.periods},
        **({"growth": rows.growth} if rows.growth.size else {}),
        **({"jacobians": rows.derivatives} if rows.derivatives.size else {}),
    }
    of_runs = ("follow", "tolerance", "bound", "transient", "batch", "longest", "settled", "flow")
    c = _Ensemble(
        **{"n_runs": m, "n_rows": runs.rows, "n_known": len(targets.points), "n_directions": k},
        n_set=len(runs.references),
        messages=messages.ctypes.data,
        lanes=lanes,
        **{name: getattr(where, name) for name in ("kind", "direction", "contact", "state", "level")},
        **{name: getattr(runs, name) for name in of_runs},
        **{name: array.ctypes.data for name, array in arrays.items()},
    )
    instance = engine.take()
    try:
        c.lane_room = instance.lines(engine.lane_room(lanes, runs.longest) // 8)
        if engine.ensemble(instance.handle, ctypes.byref(c)) != 0:
            raise instance.failure()
    finally:
        engine.give(instance)
    for i in np.flatnonzero((rows.outcomes == OUTCOMES.BROKEN) | (rows.outcomes == OUTCOMES.UNFIT)):
        text = messages[i].tobytes().split(b"\0", 1)[0].decode("utf-8", "replace")
        if rows.outcomes[i] == OUTCOMES.UNFIT:
            raise StickslipError(text)
        rows.messages[int(i)] = text
    return dataclasses.replace(rows, points=rows.points[..., :-1], times=rows.points[..., -1])
