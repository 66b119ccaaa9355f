"""MATLAB files of version 5 on (``save`` with -v6, -v7 or -v7.3): vectors of one length, variables or struct fields, or
one matrix whose longer side is that of the samples.

Single numbers (gains, rates) are kept apart from the columns. A struct stands for its fields, one level deep. MATLAB
has no units: they come from ``datapackage.json``.
"""

import tempfile
from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np

from fmu_models.base.errors import StickslipError
from rig_io.logs.guarded import parsed_apart
from rig_io.logs.mat_file import Array, stored_arrays, taken
from rig_io.logs.table import Reader, Table, check_file

HEADER = 128  # bytes of version 5 before the first variable; the last four are version and byte order
VERSIONS = (b"\x00\x01IM", b"\x01\x00MI")

_HDF5 = b"\x89HDF\r\n\x1a\n"
_SAVE = "save('log.mat', 'time', 'laser', '-v7')"


def read(path: Path) -> Table:
    """Read every vector of numbers as a column, every single number as a scalar; the rest is left out, with a reason.
    Where there is no vector and one matrix, its columns have no names.

    Raises:
        StickslipError: the file is missing, empty, damaged, no MATLAB file or one of another version; it holds no
            vector of numbers, vectors of different lengths, or two of one name.
    """
    return table_of(path, _variables(path))


def table_of(path: Path, variables: Iterable[Array]) -> Table:
    """The table of the variables in a file. StickslipError: no vector of numbers, vectors of different lengths, or two
    of one name."""
    columns: dict[str, np.ndarray] = {}
    scalars: dict[str, float] = {}
    left_out: dict[str, str] = {}
    matrices: list[Array] = []
    for array in (field for variable in variables for field in variable.fields or [variable]):
        if array.name in columns or array.name in scalars or array.name in left_out:
            raise StickslipError(f"'{path}' has two columns named '{array.name}'. Save them under different names.")
        reason = _unfit(array)
        if reason or array.values is None:
            left_out[array.name] = reason
            matrices += [array] if array.values is not None and len(array.shape) == 2 and len(array.values) else []
        elif len(array.values) == 1:
            scalars[array.name] = float(array.values[0])
        else:
            with np.errstate(invalid="ignore"):  # of a NaN that signals; it stays NaN
                columns[array.name] = np.asarray(array.values, dtype=np.float64)
    if not columns and len(matrices) == 1:
        (matrix,) = matrices
        assert matrix.values is not None
        sides = np.reshape(matrix.values, matrix.shape, order="F").astype(np.float64)
        rows = sides if len(sides) < len(sides.T) else sides.T
        named = {f"column {number + 1}": values for number, values in enumerate(rows)}
        del left_out[matrix.name]
        return Table(f"'{path}'", named, {}, None, scalars, left_out, nameless=True)
    _check_columns(path, columns, left_out)
    return Table(f"'{path}'", columns, {}, None, scalars, left_out)


def _variables(path: Path) -> list[Array]:
    check_file(path, "a MATLAB file with vectors of numbers")
    with open(path, "rb") as file:
        data = file.read(1024)
    hdf5 = _HDF5 in (data[: len(_HDF5)], data[512 : 512 + len(_HDF5)])
    if not hdf5 and data[HEADER - 4 : HEADER] not in VERSIONS:
        raise StickslipError(
            f"'{path}' is no MATLAB file of version 5 or later (its header is not one). In MATLAB or Octave save it "
            f"with -v7: {_SAVE}."
        )
    advice = {"again": f": {_SAVE}", "less": f", or save fewer variables: {_SAVE}"}
    with tempfile.TemporaryDirectory(prefix="stickslip-") as room:
        return [taken(array) for array in parsed_apart(path, stored_arrays, str(path), hdf5, room, **advice)]


_REASONS = {
    "complex": "of complex numbers; save real(...) and imag(...) apart",
    "cell": "a cell array; save its contents as a vector, cell2mat(...)",
    "struct": "a struct inside a struct, or an array of them; save the fields as vectors",
    "object": "a MATLAB object (table, timeseries ...); save its columns as vectors",
    "char": "text; save numbers, str2double(...)",
    "sparse": "a sparse matrix; save it as full(...)",
    "function": "a function; save the vector it gives",
}


def _unfit(array: Array) -> str:
    """Why a variable is neither a vector nor a single number; empty if it is one."""
    if array.values is None:
        return _REASONS[array.kind]
    if not len(array.values):
        return "empty"
    if len(array.values) != max(array.shape):
        return f"a matrix of {' x '.join(map(str, array.shape))}; save each of its columns as a vector"
    return ""


def _check_columns(path: Path, columns: Mapping[str, np.ndarray], left_out: Mapping[str, str]) -> None:
    if not columns:
        listing = "; ".join(f"'{name}' is {reason}" for name, reason in left_out.items())
        raise StickslipError(
            f"'{path}' holds no vector of numbers{f' ({listing})' if listing else ''}. Save each column as a vector: "
            f"{_SAVE}."
        )
    lengths = {len(values) for values in columns.values()}
    if len(lengths) > 1:
        listing = ", ".join(f"'{name}' {len(values)}" for name, values in columns.items())
        raise StickslipError(
            f"'{path}' holds vectors of different lengths: {listing}. Save only vectors of one recording, with one "
            "value per sample."
        )


READER = Reader((".mat",), read)
