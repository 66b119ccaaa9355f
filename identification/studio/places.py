"""Places in a picture: what its axes show, the point of the result next to a place, and the form that begins there."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fmu_models.base.figures import read_spanned
from identification.studio.forms import Field

AT = "at "  # before the name of an axis, in the form of a place
OVER_STATES = ("basins",)  # whose grid is of starts; others go over a parameter
FAR = 10.0  # how much farther a point is along a parameter than along a state
POINTS, CELLS = 200, 51  # along an axis of the analysis that comes next


@dataclass(frozen=True)
class Place:
    """picture: name of an SVG; axes: names of what its two axes show; box, limits: see ``read_spanned``; parameters,
    states: names of the model's; table: file of the points that it draws, None: not written."""

    picture: str
    axes: tuple[str, str]
    box: tuple[float, ...]
    limits: tuple[tuple[float, float], ...]
    parameters: tuple[str, ...]
    states: tuple[str, ...]
    table: Path | None

    def values(self, at: Mapping[str, float]) -> dict[str, float]:
        """Parameters as they are at a place in the picture, and the state of the point of the table next to it; where
        there is no table, as far as the place tells it."""
        rows = self._rows()
        known = {name: value for name, value in at.items() if name in (*self.parameters, *self.states)}
        names = [name for name in self.axes if name in at and rows is not None and name in rows]
        if rows is None or not names:
            return known
        spans = dict(zip(self.axes, (high - low for low, high in self.limits), strict=True))
        # a point of another parameter is far
        weights = {name: (FAR if name in self.parameters else 1.0) / spans[name] for name in names}
        apart: Any = sum((weights[name] * (rows[name] - at[name])) ** 2 for name in names)
        row = rows.loc[apart.idxmin()]
        return known | {name: float(row[name]) for name in self.states if name in rows}

    def ranges(self, command: str, field: Field) -> list[str]:
        """What the next analysis goes over: states as far as they are seen, or the parameter."""
        count = field.hint.endswith("COUNT")
        if command in OVER_STATES:
            return [f"{name}={low:.3g}:{high:.3g}:{CELLS}" for name, (low, high) in self._seen().items()]
        over = zip(self.axes, self.limits, strict=True)
        ends = [f"{name}={low:.4g}:{high:.4g}" for name, (low, high) in over if name in self.parameters]
        return [f"{text}:{POINTS}" if count else text for text in ends][:1]

    def _seen(self) -> dict[str, tuple[float, float]]:
        """Least and largest value of the first two states; half as wide again where it is that of the table."""
        limits, rows = dict(zip(self.axes, self.limits, strict=True)), self._rows()
        for name in self.states:
            if rows is not None and name in rows and name not in limits:
                low, high = float(rows[name].min()), float(rows[name].max())
                limits[name] = (low - (high - low) / 4.0, high + (high - low) / 4.0)
        return {name: limits[name] for name in self.states[:2] if name in limits}

    def _rows(self) -> Any:
        if self.table is None:
            return None
        import pandas

        rows = pandas.read_csv(self.table)
        return rows.dropna(subset=[name for name in self.axes if name in rows])


def place_of(folder: Path, files: tuple[str, ...]) -> Place | None:
    """The first picture of a step that says what it spans."""
    for name in (name for name in files if name.endswith(".svg") and (folder / name).is_file()):
        if (spanned := read_spanned(folder / name)) is not None:
            table = next((folder / file for file in files if file.endswith(".csv")), None)
            return Place(
                name,
                (spanned["x"], spanned["y"]),
                tuple(spanned["box"]),
                tuple((low, high) for low, high in spanned["limits"]),
                tuple(spanned["parameters"]),
                tuple(spanned["states"]),
                table if table is not None and table.is_file() else None,
            )
    return None


def begun_at(place: Place, at: Mapping[str, float], command: str, fields: list[Field], values: dict[str, Any]) -> None:
    """Write into the form of a command what a place gives: its parameters, its state as the start, its ranges."""
    place_values = place.values(at)
    fields_by_name = {field.name: field for field in fields}
    for name, of in (("settings", place.parameters), ("start", place.states)):
        if name in fields_by_name:
            new = {key: value for key, value in place_values.items() if key in of}
            lines = [line for text in values.get(name, ()) for line in text.splitlines()]
            kept = [line for line in lines if line.partition("=")[0].strip() not in new]
            values[name] = [*kept, *(f"{key}={value!r}" for key, value in new.items())]
    if "over" in fields_by_name:
        values["over"] = place.ranges(command, fields_by_name["over"])
