"""The result of a run."""

from __future__ import annotations

import csv
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, NamedTuple, overload

import numpy as np
from numpy.typing import NDArray

from fmu_models.base.arrays import Vector
from fmu_models.base.errors import StickslipError, nearest
from fmu_models.base.files import write_whole
from fmu_models.base.shown import Shown, Tabular, axes_or_new, span
from fmu_models.language.contact_kinds import (
    AWAY,
    CONTACT_STATES,
    OPEN,
    RIGID_STATES,
    SLIP_MINUS,
    SLIP_PLUS,
    STICK,
    TOUCHING,
)

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes

ROUNDING = 1e-12  # of the largest energy: by so much rounding can make an elastic impact seem to raise it
_BLOCK = 4096  # events that become objects at a time


@dataclass(frozen=True)
class Event:
    """A change of contact state; an impact or a reset, after which the state may be as before.

    Attributes:
        time: s.
        contact: its name.
        before, after: states (keys of CONTACT_STATES); before a reset the side from which its function came to zero.
        work: of the impulses of an impact on the bodies in contact, J; negative where energy is lost.
        rigid: the contact is a rigid one.
        reset: the contact is a switch, whose reset made states jump.
    """

    time: float
    contact: str
    before: int
    after: int
    work: float = 0.0
    rigid: bool = False
    reset: bool = False

    @property
    def is_impact(self) -> bool:
        """Whether an impulse acted."""
        return self.rigid and (self.work != 0.0 or self.before == self.after)

    @property
    def clock(self) -> str:
        """The clock of the contact that ticks there, in an FMU of FMI 3: "stick", "slip", "impact", "reset", or ""."""
        if self.reset:
            return "reset"
        if self.rigid:
            return "impact" if self.is_impact or self.before == OPEN else ""
        if self.after == TOUCHING:
            return "impact" if self.before == AWAY else ""
        return {STICK: "stick", SLIP_MINUS: "slip", SLIP_PLUS: "slip"}.get(self.after, "")

    def __str__(self) -> str:
        names = RIGID_STATES if self.rigid else CONTACT_STATES
        bounces = self.before == self.after and not self.reset
        change = "bounce" if bounces else f"{names[self.before]} -> {names[self.after]}"
        jump = f", {self.work:.6g} J" if self.is_impact else ", reset" if self.reset else ""
        return f"{self.time:.9g} s: {self.contact} {change}{jump}"


class Events(Sequence[Event]):
    """The events of a run, kept as an array; each becomes an ``Event`` when it is asked for.

    Attributes:
        rows: (k,) structured array with the fields time (s), contact (its number), before, after, reset, work (J).
        contacts: names of the contacts by number.
        rigid: the names of those that are rigid.
    """

    def __init__(self, rows: NDArray[Any], contacts: Sequence[str], rigid: Iterable[str]) -> None:
        self.rows, self.contacts, self.rigid = rows, tuple(contacts), frozenset(rigid)

    def __len__(self) -> int:
        return self.rows.size

    @overload
    def __getitem__(self, index: int) -> Event: ...
    @overload
    def __getitem__(self, index: slice) -> Events: ...
    def __getitem__(self, index: int | slice) -> Event | Events:
        if isinstance(index, slice):
            return Events(self.rows[index], self.contacts, self.rigid)
        return self._event(self.rows[index].item())

    def __iter__(self) -> Iterator[Event]:
        for first in range(0, self.rows.size, _BLOCK):
            yield from map(self._event, self.rows[first : first + _BLOCK].tolist())

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Sequence) or len(self) != len(other):
            return NotImplemented if not isinstance(other, Sequence) else False
        return all(first == two for first, two in zip(self, other, strict=True))

    def __repr__(self) -> str:
        return f"<{len(self)} events of {', '.join(self.contacts)}>"

    def _event(self, row: tuple[float, int, int, int, int, float]) -> Event:
        time, contact, before, after, reset, work = row
        name = self.contacts[contact]
        return Event(time, name, before, after, work, name in self.rigid, bool(reset))


class Columns(Mapping[str, NDArray]):
    """The variables of a run by name, kept as rows; each becomes an array (n,) when it is asked for.

    Args:
        rows: (n, m) values over time.
        columns: number of the column by name.
        n_real: the columns from there on are states of contacts, integers.
    """

    def __init__(self, rows: Vector, columns: Mapping[str, int], n_real: int) -> None:
        self._rows, self._columns, self._n_real = rows, columns, n_real
        self._made: dict[str, NDArray] = {}

    def __getitem__(self, name: str) -> NDArray:
        values = self._made.get(name)
        if values is None:
            i = self._columns[name]
            column = self._rows[:, i]
            values = self._made[name] = column if i < self._n_real else column.astype(np.int8)
        return values

    def __contains__(self, name: object) -> bool:
        return name in self._columns

    def __iter__(self) -> Iterator[str]:
        return iter(self._columns)

    def __len__(self) -> int:
        return len(self._columns)

    def __repr__(self) -> str:
        return f"<{len(self)} variables: {', '.join(self)}>"


@dataclass(frozen=True)
class ForeignEvent(Shown):
    """An event of any FMU as the master sees it.

    Attributes:
        time: s.
        kind: "state" (an indicator changed its sign), "time", "step" (asked for after a step), "input" (an input
            jumped), "slide" and "leave" (a motion along the surface of an indicator begins and ends), "clock" (a clock
            ticks, and nothing else happens), "end".
        indicator: its index from 0, -1 where the event is not of an indicator.
        name: of the indicator where the FMU gives it one (FMI 3), otherwise "".
        before, after: value of the indicator at the begin of the step that found the event, and after the event.
        states_before, states_after: (n_states,) in the order of ``Trajectory.values``; empty in a co-simulation.
        clocks: names of the clocks that tick there, by commas.
    """

    time: float
    kind: str
    indicator: int
    name: str
    before: float
    after: float
    states_before: tuple[float, ...]
    states_after: tuple[float, ...]
    clocks: str = ""

    def __str__(self) -> str:
        indicator = (
            f" of indicator {self.indicator}" + (f" ({self.name})" if self.name else "") if self.indicator >= 0 else ""
        )
        return f"{self.time:.9g} s: {self.kind}{indicator}{f', {self.clocks} ticks' if self.clocks else ''}"


class Sides(NamedTuple):
    """What is right before and right after events: (2 k,) times in s, each twice, and per variable as many values."""

    time: Vector
    values: Mapping[str, NDArray]


@dataclass(frozen=True, eq=False)
class Trajectory(Tabular):
    """Recorded variables over time; ``trajectory["theta"]`` is one of them.

    Attributes:
        time: (n,) s.
        values: per variable (n,) in its unit: inputs, states, ``der(<state>)``, outputs, speeds of entry
            ``<stop>_memory`` that stops remember, contact states (integers).
            At the time of an event they are those after it.
        units: unit per variable, "1" for a pure number.
        events: every change of contact state and every impact (Event), or every event of an FMU driven by the master
            (ForeignEvent), in order of time, whatever the output times.
        steps, evaluations: what the engine did (Taylor steps; orders of series computed).
        method: what made it, in words; empty for the FMU's own engine.
        seconds: wall time that it took, s.
        arrays: shape per array variable, whose elements ``A[2,1]`` are in ``values``, the last index fastest.
        texts: per String or Binary of an FMU, by element, its value after initialization and at the end of the run.
        sides: of events between the output times, if the run was asked for them.
    """

    time: Vector
    values: Mapping[str, NDArray]
    units: Mapping[str, str]
    events: Sequence[Any]
    steps: int
    evaluations: int
    method: str = ""
    seconds: float = 0.0
    arrays: Mapping[str, Sequence[int]] = field(default_factory=dict)
    texts: Mapping[str, tuple[str | bytes, str | bytes]] = field(default_factory=dict)
    sides: Sides | None = None

    if not TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any:
            """What a run of the engine has left to be made when it is asked for: its parts are beside the fields."""
            if name not in ("values", "events") or "_parts" not in vars(self):
                raise AttributeError(f"'{type(self).__name__}' object has no attribute '{name}'")
            rows, columns, n_real, events, contacts, rigid = vars(self)["_parts"]
            vars(self).update(values=Columns(rows, columns, n_real), events=Events(events, contacts, rigid))
            return vars(self)[name]

    def __contains__(self, name: object) -> bool:
        return name == "time" or name in self.values

    def __getitem__(self, name: str) -> NDArray:
        if name == "time":
            return self.time
        try:
            return self.values[name]
        except KeyError:
            raise StickslipError(f"The trajectory has no variable '{name}'.{nearest(name, self.values)}") from None

    @property
    def impacts(self) -> tuple[Event, ...]:
        """The events in which an impulse acted."""
        return tuple(event for event in self.events if event.is_impact)

    @property
    def gains(self) -> tuple[Event, ...]:
        """The impacts that raised the energy of the bodies in contact, as friction with Newton's restitution can."""
        works = [abs(event.work) for event in self.impacts]
        # a scene may leave out the energy; an elastic impact is then judged by the largest work of all
        largest = np.abs(self.values["energy"]).max() if "energy" in self.values else max(works, default=0.0)
        return tuple(event for event in self.impacts if event.work > ROUNDING * largest)

    @property
    def drawn(self) -> Trajectory:
        """With both sides of events among its times, so that lines have their corners and jumps."""
        if self.sides is None:
            return self
        time, sides = np.concatenate([self.sides.time, self.time]), self.sides.values
        order = np.argsort(time, kind="stable")
        values = {name: np.concatenate([sides[name], data])[order] for name, data in self.values.items()}
        return replace(self, time=time[order], values=values, sides=None)

    @property
    def frame(self) -> pandas.DataFrame:
        """The variables as columns of a table indexed by time (s)."""
        import pandas

        table = pandas.DataFrame(dict(self.values), index=pandas.Index(self.time, name="time"))
        table.attrs["units"] = {"time": "s", **self.units}
        return table

    def plot(self, *what: str, ax: Axes | None = None) -> Axes:
        """Draw variables over time, or against each other.

        what: names such as "x", or "x:v" for v over x; by default the states.

        Raises:
            StickslipError: the trajectory has no such variable.
        """
        axes, drawn = axes_or_new(ax), self.drawn
        variables = what or [name for name in self.values if f"der({name})" in self.values] or list(self.values)
        labels: dict[str, list[str]] = {"x": [], "y": []}
        for text in variables:
            across, colon, up = text.rpartition(":")
            across = across if colon else "time"
            axes.plot(drawn[across], drawn[up], linewidth=0.9, label=up)
            labels["x"].append(self._label(across))
            labels["y"].append(self._label(up))
        axes.set(xlabel=", ".join(dict.fromkeys(labels["x"])), ylabel=", ".join(dict.fromkeys(labels["y"])))
        if len(variables) > 1:
            axes.legend(frameon=False)
        return axes

    def _label(self, name: str) -> str:
        return f"{name} ({'s' if name == 'time' else self.units[name]})"

    def _heading(self) -> str:
        span = f" from {self.time[0]:g} to {self.time[-1]:g} s" if len(self.time) else ""
        method = f", {self.method}" if self.method else ""
        return (
            f"Trajectory: {len(self.time)} times{span}, {len(self.values)} variables, {len(self.events)} events{method}"
        )

    def _contents(self) -> Mapping[str, Any]:
        return {name: span(data, self.units[name]) for name, data in self.values.items()}

    def write_csv(self, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
        """Write one row per time under a header ``name [unit]``, 17 significant digits.

        Raises:
            StickslipError: ``path`` exists and ``overwrite`` is false, or cannot be written.
        """
        columns = [self.time, *self.values.values()]
        with (
            write_whole(path, overwrite=overwrite) as temporary,
            temporary.open("w", encoding="utf-8", newline="") as file,
        ):
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(["time [s]", *(f"{name} [{self.units[name]}]" for name in self.values)])
            writer.writerows(zip(*(column.tolist() for column in columns), strict=True))
