"""Parquet and Feather (Arrow): every column of numbers; stamps become seconds; metadata of a field may state a unit."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from rig_io.logs.guarded import Channel, Channels, fits, need, table_of
from rig_io.logs.stamps import seconds
from rig_io.logs.table import Reader, Table

if TYPE_CHECKING:
    import pyarrow


def read(path: Path) -> Table:
    """Read every column of numbers. StickslipError: the file is missing, damaged or none of its kind; pyarrow is not
    installed."""
    need("pyarrow", "pyarrow", "Parquet and Feather files")
    return table_of(path, channels, "a Parquet or Feather file", (b"PAR1", b"ARROW1", b"FEA1"))


def channels(path: str) -> Channels:
    """The columns of a file; in the child."""
    import pyarrow
    from pyarrow import feather, parquet

    with open(path, "rb") as file:
        is_parquet = file.read(4) == b"PAR1"
    table = parquet.ParquetFile(path).read() if is_parquet else feather.read_table(path)
    collected: list[Channel] = []
    left_out: dict[str, str] = {}
    start, stamps = "", []
    for field, column in zip(table.schema, table.columns, strict=True):
        name = _free(field.name, {channel.name for channel in collected} | set(left_out))
        if pyarrow.types.is_timestamp(field.type):
            at = column.cast(pyarrow.timestamp("ns")).to_numpy().astype("datetime64[ns]").astype(np.int64)
            times, first = seconds(at, "date and time", bool(field.type.tz))
            start = first.isoformat() if first else ""
            collected.append(Channel(name, times, "s"))
            stamps.append(name)
            continue
        if pyarrow.types.is_decimal(field.type):
            column = column.cast(pyarrow.float64())
        values = column.to_numpy()
        numeric = (pyarrow.types.is_integer, pyarrow.types.is_floating, pyarrow.types.is_boolean)
        if values.dtype.kind == "O" and column.null_count and any(is_one(field.type) for is_one in numeric):
            values = column.cast(pyarrow.float64()).to_numpy()
        if fits(name, values, left_out):
            collected.append(Channel(name, values, _unit(field)))
    return Channels(collected, left_out, {}, start, stamps)


def _unit(field: "pyarrow.Field") -> str:
    metadata = field.metadata or {}
    return next((metadata[key].decode("utf-8", "replace") for key in (b"unit", b"units") if key in metadata), "")


def _free(name: str, taken: set[str]) -> str:
    number, candidate = 1, name
    while candidate in taken:
        number += 1
        candidate = f"{name} ({number})"
    return candidate


READER = Reader((".parquet", ".pq", ".feather", ".arrow"), read)
