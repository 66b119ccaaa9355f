"""How values show themselves: a few lines in a terminal, a table in a notebook, a data frame, a data set, a picture.

A value says what it is in a heading and names what is in it; no array is written out, and no number longer than people
read it.
"""

from __future__ import annotations

import html
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields, is_dataclass
from functools import cached_property, singledispatch
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from fmu_models.base.columns import frame_of
from fmu_models.base.errors import StickslipError
from fmu_models.base.figures import Spanned, save_figure
from fmu_models.base.printable import in_line
from fmu_models.base.record import record

if TYPE_CHECKING:
    from functools import _SingleDispatchCallable

    import pandas
    import xarray
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

LINES = 10  # of a repr
WIDTH = 100  # characters of a line
Rows = Sequence[tuple[str, str]]


class Shown:
    """A value with a short repr.

    A subclass says what it is by ``_heading`` and what is in it by ``_contents``; by default its name and its fields.
    """

    def __init_subclass__(cls) -> None:
        if "__repr__" not in vars(cls):
            cls.__repr__ = cls.__repr__  # its own, or a dataclass would make one

    def _heading(self) -> str:
        return type(self).__name__

    def _contents(self) -> Mapping[str, Any]:
        """The shown values, by name."""
        assert is_dataclass(self)
        return {field.name: getattr(self, field.name) for field in fields(self) if field.init}

    def _rows(self) -> Rows:
        rows = [(name, brief(value)) for name, value in self._contents().items() if value is not None]
        head = rows if len(rows) < LINES else rows[: LINES - 2]
        return head if head == rows else [*head, ("...", f"and {', '.join(name for name, _ in rows[LINES - 2 :])}")]

    def __repr__(self) -> str:
        heading, rows = self._heading(), self._rows()
        line = in_line(f"{heading}({', '.join(f'{name}={text}' for name, text in rows)})")
        if heading == type(self).__name__ and len(line) <= WIDTH:
            return line
        wide = max((len(name) for name, _ in rows), default=0)
        return "\n".join([_cut(heading), *(_cut(f"  {name:{wide}}  {text}") for name, text in rows)])

    def _repr_html_(self) -> str:
        """The value as HTML, for notebooks."""
        rows = "".join(
            f"<tr><td>{html.escape(name)}</td><td>{html.escape(text)}</td></tr>" for name, text in self._rows()
        )
        return f"<table><caption>{html.escape(self._heading())}</caption><tbody>{rows}</tbody></table>"


class Tabular(Shown):
    """A value that is a table too: its class names the columns in ``COLUMNS``, or has a ``frame`` of its own."""

    COLUMNS: ClassVar[tuple[str, ...]] = ()

    @property
    def frame(self) -> pandas.DataFrame:
        """It as a table; units by column in ``frame.attrs["units"]`` where they differ from column to column."""
        return frame_of(self)

    def _repr_html_(self) -> str:
        return f"<p>{html.escape(self._heading())}</p>{self.frame.to_html(max_rows=LINES)}"

    def to_xarray(self) -> xarray.Dataset:
        """The table as a data set, with units as attributes.

        Raises:
            StickslipError: xarray is not installed.
        """
        try:
            import xarray
        except ImportError as error:
            raise StickslipError("xarray is not installed. Install it: pip install 'stickslip[xarray]'") from error
        frame = self.frame
        dataset = xarray.Dataset.from_dataframe(frame)
        for name, unit in frame.attrs.get("units", {}).items():
            dataset[name].attrs["units"] = unit
        return dataset


class Pictured(Tabular):
    """A value whose pictures and words are made on a higher floor: in a module that its package offers as an entry
    point of ``stickslip.views``, named like the package. It registers them with ``draw``, ``tell`` and ``move`` and is
    imported when the first is asked for."""

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw it, in axes of a new figure where none are given."""
        axes = axes_or_new(ax)
        _view(draw, self)(self, axes)
        return axes

    def figure(self, path: str | os.PathLike[str], *, overwrite: bool = False) -> Path:
        """Write its picture as a file; the format follows the suffix (.svg, .png, .pdf).

        Raises:
            StickslipError: unknown suffix, the file exists and ``overwrite`` is false, or cannot be written.
        """
        from matplotlib.figure import Figure

        figure = Figure(figsize=(6.3, 4.2), layout="constrained")
        _view(draw, self)(self, figure.subplots())
        return save_figure(figure, path, overwrite=overwrite, spanned=self.spanned)

    @property
    def spanned(self) -> Spanned | None:
        """What the axes of its picture show, where a place in it says where another analysis may begin."""
        return None

    def summary(self) -> str:
        """The whole value as text, as in a terminal."""
        return _view(tell, self)(self)

    def record(self) -> dict[str, Any]:
        """The whole value as plain data for JSON; see ``record``."""
        return record(self)


class Moving(Pictured):
    """A value that a notebook shows with a frame in which it moves, where it has one (``move``)."""

    def _repr_html_(self) -> str:
        return super()._repr_html_() + self._moving

    @cached_property
    def _moving(self) -> str:
        return _view(move, self)(self)


@singledispatch
def draw(value: object, axes: Axes) -> None:
    """Draw a value in axes.

    Raises:
        StickslipError: nobody has registered a picture of its kind.
    """
    raise StickslipError(
        f"There is no picture of a {type(value).__name__}. Register one with fmu_models.base.shown.draw, in a module "
        "that its package offers as an entry point of stickslip.views."
    )


@singledispatch
def tell(value: object) -> str:
    """Everything a value says, as in a terminal; by default what it shows."""
    return repr(value)


@singledispatch
def move(value: object) -> str:
    """A frame in which a value moves, as HTML, or why there is none; by default nothing."""
    return ""


def _view(function: _SingleDispatchCallable[Any], value: Pictured) -> Callable[..., Any]:
    from importlib import metadata  # takes a tenth of the start of a command that shows nothing

    for point in metadata.entry_points(group="stickslip.views", name=type(value).__module__.partition(".")[0]):
        point.load()
    return function.dispatch(type(value))


def brief(value: object) -> str:
    """A value in few words."""
    import numpy as np

    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, np.ndarray):
        return _array(value)
    if isinstance(value, Shown):
        text = repr(value)
        return str(vars(value).get("name", type(value).__name__)) if "\n" in text else text
    if isinstance(value, bool | int | None):
        return str(value)
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, complex):
        return f"{value.real:.6g}{value.imag:+.6g}j"
    if isinstance(value, str):
        return _cut(value)
    if isinstance(value, Mapping):
        return _list([f"{key} {brief(entry)}" for key, entry in value.items()])
    if isinstance(value, list | tuple | set | frozenset):
        return _list([brief(entry) for entry in value])
    return _cut(str(value).partition("\n")[0])


def _array(value: NDArray[Any]) -> str:
    if value.size and value.size <= 4 and value.ndim == 1:
        return _list([brief(number) for number in value])
    return f"{' x '.join(str(size) for size in value.shape)} values {span(value)}".rstrip()


def span(value: NDArray[Any], unit: str = "1") -> str:
    """The range of the numbers in an array, such as "from 0 to 1 rad"; empty where they have none."""
    if not value.size or value.dtype.kind not in "iuf":
        return ""
    return f"from {brief(value.min())} to {brief(value.max())}" + ("" if unit == "1" else f" {unit}")


def _list(items: Sequence[str]) -> str:
    """Parts between commas, as many as a line takes."""
    texts: list[str] = []
    for item in items:
        if sum(len(text) + 2 for text in texts) + len(item) > WIDTH - 25:
            return f"{', '.join(texts)} ... ({len(items)})" if texts else _cut(item)
        texts.append(item)
    return ", ".join(texts) or "none"


def _cut(text: str) -> str:
    text = in_line(text)
    return text if len(text) <= WIDTH else f"{text[: WIDTH - 4]} ..."


def axes_or_new(ax: Axes | None) -> Axes:
    """The axes to draw in; those of a new figure where none are given."""
    if ax is not None:
        return ax
    from matplotlib import pyplot

    return pyplot.subplots(layout="constrained")[1]
