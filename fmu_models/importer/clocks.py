"""The clocks of an FMU (FMI 3): when they tick, and the variables that have them.

constant, fixed, tunable    in equal intervals, from a shift on
changing, countdown         when the FMU says
triggered input             where a signal that the user gives jumps up
triggered output or local   when the FMU does
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fmu_models.base.errors import StickslipError
from fmu_models.codegen.c_structures import declarations
from fmu_models.fmu.elements import owner
from fmu_models.fmu.fmu import Fmu
from fmu_models.importer import request
from fmu_models.simulation.signal import Signal
from fmu_models.simulation.trajectory import ForeignEvent

if TYPE_CHECKING:
    from fmpy.model_description import ScalarVariable

_C = declarations("importer/c/master.h")
_KIND = _C.constants("ClockKind", "CLOCK_")
_MOST = _C.constants("MostClocks", "MOST_").CLOCKS
_MASTER_CLOCK, _KEPT = _C.structure("MasterClock"), _C.structure("Kept")
TICK = np.dtype(_C.structure("MasterTick"))
_PERIODIC = ("constant", "fixed", "calculated", "tunable")


@dataclass(frozen=True)
class FmuClock:
    """A clock as its description has it; interval and shift in s, ``None`` where the FMU tells them."""

    name: str
    reference: int
    kind: int
    priority: int
    interval: float | None
    shift: float

    @property
    def is_periodic(self) -> bool:
        return self.kind == _KIND.PERIODIC

    @property
    def ticked_by_importer(self) -> bool:
        return self.kind != _KIND.OUTPUT


def clocks_of(fmu: Fmu) -> list[FmuClock]:
    """The clocks in the order of the description. StickslipError: more of them than the master keeps apart, or one
    whose attributes are no clock's."""
    if fmu.fmi == 2 or not any(v.type == "Clock" for v in fmu.variables.values()):
        return []
    elements = fmu.elements("ModelVariables/Clock")
    if len(elements) > _MOST:
        raise StickslipError(f"'{fmu.path}' has {len(elements)} clocks; up to {_MOST} are run.")
    try:
        return [_clock(element.attrib) for element in elements]
    except (ValueError, ZeroDivisionError, KeyError) as error:
        raise StickslipError(f"'{fmu.path}': a clock in modelDescription.xml makes no sense: {error!r}.") from error


def _clock(attributes: Mapping[str, str]) -> FmuClock:
    variability, causality = attributes["intervalVariability"], attributes.get("causality", "local")
    kind = {"changing": _KIND.CHANGING, "countdown": _KIND.COUNTDOWN}.get(variability)
    if variability in _PERIODIC:
        kind = _KIND.PERIODIC
    elif variability == "triggered":
        kind = _KIND.ASKED if causality == "input" else _KIND.OUTPUT
    if kind is None:
        raise ValueError(f"'{attributes['name']}' has the intervalVariability '{variability}'")
    resolution = attributes.get("resolution")

    def seconds(name: str) -> float | None:
        if f"{name}Counter" in attributes and resolution is not None:
            return int(attributes[f"{name}Counter"]) / int(resolution)
        return float(attributes[f"{name}Decimal"]) if f"{name}Decimal" in attributes else None

    return FmuClock(
        attributes["name"],
        int(attributes["valueReference"]),
        kind,
        int(attributes.get("priority", 0)),
        seconds("interval"),
        seconds("shift") or 0.0,
    )


def _own(variable: "ScalarVariable") -> list[Any]:
    """The variables that are its clocks, which fmpy declares as numbers."""
    return list(variable.clocks)


class Clocks:
    """The clocks of an FMU as the master takes them. names: of recorded variables, of which ``recorded`` keeps those
    that have clocks."""

    def __init__(self, fmu: Fmu, names: Sequence[str]) -> None:
        self.fmu = fmu
        self.all = clocks_of(fmu)
        bits = {clock.reference: 1 << i for i, clock in enumerate(self.all)}
        clocked = [name for name in names if fmu.variables[name].clocks] if self.all else []
        self.recorded = request.Selection.of(fmu, clocked)
        initial = {u.variable.name for u in fmu.description.initialUnknowns if u.variable} if clocked else set()
        self._kept: list[tuple[int, float]] = []
        for name in self.recorded.names:
            variable = fmu.variables[owner(name, fmu.variables)]
            clocks = sum(bits.get(int(clock.valueReference), 0) for clock in _own(variable))
            integral = not str(variable.type).startswith("Float")
            sources = clocks | (1 << _MOST if variable.name in initial else 0)
            self._kept.append((sources, 0.0 if integral else float("nan")))

    @property
    def names(self) -> list[str]:
        return [clock.name for clock in self.all]

    def split(
        self, inputs: Mapping[str, float | Signal], start: float
    ) -> tuple[dict[str, NDArray[np.float64]], dict[str, float | Signal]]:
        """Times (n,), s, at which triggered input clocks tick, and the other inputs. StickslipError: a clock that
        nobody but the FMU ticks, one that would never tick, or an input that has a clock."""
        kinds = {clock.name: clock.kind for clock in self.all}
        times: dict[str, NDArray[np.float64]] = {}
        for name, value in inputs.items():
            if name not in kinds:
                variable = self.fmu.variables.get(owner(name, self.fmu.variables))
                if variable is not None and variable.clocks:
                    ticking = ", ".join(str(clock.name) for clock in _own(variable))
                    raise StickslipError(
                        f"'{name}' is an input at the ticks of {ticking}; inputs that have a clock keep their start "
                        "value."
                    )
                continue
            if kinds[name] != _KIND.ASKED:
                raise StickslipError(f"The clock '{name}' ticks by its interval or by the FMU, and takes no signal.")
            times[name] = ticks_of(value, start)
            if not times[name].size:
                raise StickslipError(
                    f"The clock '{name}' would never tick: it ticks where its signal jumps up, and this one does not."
                )
        return times, {name: value for name, value in inputs.items() if name not in kinds}

    def c(self, times: Mapping[str, NDArray[np.float64]]) -> tuple[Any, Any, NDArray[Any]]:
        """Arrays of a run: clocks, variables that have some, and room for ticks."""
        clocks = (_MASTER_CLOCK * max(1, len(self.all)))()
        for structure, clock in zip(clocks, self.all, strict=False):
            structure.reference, structure.kind, structure.priority = clock.reference, clock.kind, clock.priority
            structure.asks, structure.interval, structure.shift = (
                clock.interval is None,
                clock.interval or 0.0,
                clock.shift,
            )
            if clock.name in times:
                structure.n_times, structure.times = times[clock.name].size, request.address(times[clock.name])
        kept_values = (_KEPT * max(1, len(self._kept)))(*self._kept)
        return clocks, kept_values, np.zeros(4096 + 200 * len(self.all) if self.all else 0, dtype=TICK)

    def silent(self, clocks: Iterable[Any]) -> str:
        """A word on the clocks that never ticked and were to be ticked by the importer."""
        why = {
            _KIND.PERIODIC: "its first tick lies after the end",
            _KIND.CHANGING: "its first tick lies after the end",
            _KIND.COUNTDOWN: "the FMU never told when, or only for after the end",
            _KIND.ASKED: "it ticks where a signal given for it jumps up",
        }
        never = [
            f"the clock '{clock.name}' never ticked: {why[clock.kind]}"
            for clock, structure in zip(self.all, clocks, strict=False)
            if clock.ticked_by_importer and not structure.ticks
        ]
        return "; ".join(never)


def ticks_of(value: float | Signal, start: float) -> NDArray[np.float64]:
    """Times at which a signal jumps up from ``start`` on, s; one that begins above zero jumps at the start."""
    if not isinstance(value, Signal):
        return np.array([start] if value > 0 else [], dtype=float)
    up = np.flatnonzero((np.diff(value.time) == 0) & (np.diff(value.value) > 0))
    jumps = value.time[up + 1]
    first = [start] if np.interp(start, value.time, value.value) > 0 and not (jumps == start).any() else []
    return np.unique(np.concatenate([first, jumps[jumps >= start]]))


def check_event_mode(fmu: Fmu, *, offered: bool) -> None:
    """Refuse an FMU whose clocks cannot tick in its Co-Simulation. StickslipError: it has clocks that the importer
    ticks, and no event mode."""
    names = [clock.name for clock in clocks_of(fmu) if clock.ticked_by_importer]
    if names and not offered:
        raise StickslipError(
            f"'{fmu.path}' has the clocks {', '.join(names)}, which tick in event mode, and its Co-Simulation has none "
            "(hasEventMode). Ask its author for that, or for Model Exchange."
        )


def refuse_clocks(fmu: Fmu, doing: str) -> None:
    """Refuse an FMU with clocks that somebody must tick, where nobody does. StickslipError: it has some."""
    names = [clock.name for clock in clocks_of(fmu) if clock.ticked_by_importer]
    if names:
        raise StickslipError(f"'{fmu.path}' has the clocks {', '.join(names)}, which {doing} does not tick.")


def merged(events: Iterable[ForeignEvent], ticks: Mapping[float, Sequence[str]]) -> list[ForeignEvent]:
    """The events with the names of the clocks that tick at their time; those that tick at no other event are one."""
    merged_events = list(events)
    first = {event.time: index for index, event in reversed(list(enumerate(merged_events)))}
    for time, names in ticks.items():
        if time in first:
            merged_events[first[time]] = replace(merged_events[first[time]], clocks=", ".join(names))
        else:
            merged_events.append(ForeignEvent(time, "clock", -1, "", 0.0, 0.0, (), (), ", ".join(names)))
    return sorted(merged_events, key=lambda event: event.time)
