"""Tables of results, derived from what a class names in ``COLUMNS``.

    "stable"                    the attribute, as a column of its name
    "period=periods"            the attribute ``periods``, as a column "period"
    "{over}=values"             the name of the column is what the attribute ``over`` says
    "{states}=points"           of an array (rows, k) one column for each of the k names in ``states``
    "{states}_from=ends.0"      the same of an array (rows, 2, k), at 0 along its second axis
    "multiplier{}=multipliers"  one column for each of k numbers, counted from 1
    "{axes}=axes"               the values along the axes of a grid by name: one column each, one row per node
    "[time]=times"              the index
    "[name]=rows.*"             all fields of the dataclasses in ``rows``, indexed by that field
    "limit=rows.limit"          of each of them one attribute

Complex numbers become two columns, "_real" and "_imag". What is None makes no column.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import asdict
from typing import TYPE_CHECKING, Any, ClassVar, Protocol

from fmu_models.base.errors import StickslipError

if TYPE_CHECKING:
    import pandas

    from fmu_models.base.arrays import Complex, Integers, Vector


class Tabled(Protocol):
    """A value whose class names the columns of its table."""

    COLUMNS: ClassVar[tuple[str, ...]]


def frame_of(value: Tabled) -> pandas.DataFrame:
    """The table of a value, one row per entry of its columns. StickslipError: its class names no columns."""
    import pandas

    if not type(value).COLUMNS:
        kind = type(value).__name__
        raise StickslipError(f"A {kind} has no table. Name its columns in {kind}.COLUMNS, or write its frame.")
    index, columns = None, {}
    for entry in type(value).COLUMNS:
        name, _, attribute = entry.partition("=")
        if attribute.endswith(".*"):
            rows = [asdict(row) for row in getattr(value, attribute.removesuffix(".*"))]
            return pandas.DataFrame(rows).set_index(name.strip("[]"))
        if name.startswith("["):
            index = pandas.Index(_entries(value, attribute), name=name.strip("[]"))
        else:
            columns |= dict(_columns(value, name, attribute or name))
    return pandas.DataFrame(columns, index=index)


def _columns(value: Tabled, name: str, attribute: str) -> Iterator[tuple[str, Any]]:
    """Names and entries of the columns that one attribute makes."""
    numbers = _entries(value, attribute)
    if numbers is None:
        return
    field = re.search(r"\{(\w*)\}", name)
    names = getattr(value, field[1]) if field and field[1] else None
    if isinstance(numbers, Mapping):
        yield from _nodes(numbers)
    elif field is None or isinstance(names, str):
        column = name if field is None else name.replace(field[0], str(names))
        yield column, numbers.ravel() if hasattr(numbers, "ravel") else numbers
    else:
        for i, label in enumerate(range(1, numbers.shape[1] + 1) if names is None else names):
            yield from _parts(name.replace(field[0], str(label)), numbers[:, i])


def _entries(value: Tabled, attribute: str) -> Any:
    """What an attribute holds, at a place along its second axis, or an attribute of each of its rows."""
    attribute, _, part = attribute.partition(".")
    entries = getattr(value, attribute)
    if not part or entries is None:
        return entries
    return entries[:, int(part)] if part.isdigit() else [getattr(entry, part) for entry in entries]


def _parts(name: str, numbers: Vector | Complex | Integers) -> Iterator[tuple[str, Any]]:
    if numbers.dtype.kind == "c":
        yield f"{name}_real", numbers.real
        yield f"{name}_imag", numbers.imag
    else:
        yield name, numbers


def _nodes(axes: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """The values along each axis at the nodes of their grid."""
    import numpy

    grid = numpy.meshgrid(*axes.values(), indexing="ij")
    for name, coordinates in zip(axes, grid, strict=True):
        yield name, coordinates.ravel()
