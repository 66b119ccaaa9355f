"""The arrays in a MAT-file: of version 5 to 7.2 (MATLAB's -v6, -v7) by SciPy, of version 7.3 (HDF5) by h5py.

To be called in a process of its own: some damaged files take SciPy's parser down, and a small file may unpack to more
than the memory holds. In 7.3 the attributes MATLAB_class, MATLAB_empty and MATLAB_sparse say what an array is, as h5py
shows them in files that MATLAB has saved, and arrays are transposed.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from rig_io.logs.guarded import DamagedTable

LONG = 1000  # values


@dataclass(frozen=True)
class Array:
    """One variable. kind: "numeric", "complex", "cell", "struct", "object", "char", "sparse" or "function".

    values: (n,) column after column, None where it is not numeric, or ``stored`` in a file; fields: of a struct
    with one element that is no field itself.
    """

    name: str
    kind: str
    shape: tuple[int, ...] = ()
    values: np.ndarray | None = None
    fields: tuple[Array, ...] = ()
    stored: str = ""


def stored_arrays(path: str, hdf5: bool, room: str) -> list[Array]:
    """As `arrays`, with the values of long ones in files of a folder, named ``stored``: a pipe between processes would
    hold them several times."""
    return [_stored(array, room, str(index)) for index, array in enumerate(arrays(path, hdf5))]


def _stored(array: Array, room: str, name: str) -> Array:
    if array.values is not None and len(array.values) > LONG:
        np.save(f"{room}/{name}.npy", array.values)
        return replace(array, values=None, stored=f"{room}/{name}.npy")
    inner = (_stored(field, room, f"{name}-{index}") for index, field in enumerate(array.fields))
    return replace(array, fields=tuple(inner))


def taken(array: Array) -> Array:
    """An array with its values, wherever they are."""
    if array.stored:
        return replace(array, values=np.load(array.stored), stored="")
    return replace(array, fields=tuple(map(taken, array.fields)))


def arrays(path: str, hdf5: bool) -> list[Array]:
    """The variables of a file in its order. DamagedTable: anything that does not fit."""
    try:
        return list(_of_hdf5(path) if hdf5 else _of_version_5(path))
    except MemoryError:
        raise
    except Exception as error:  # the parsers raise errors of many kinds on damaged files
        raise DamagedTable(str(error).strip().rstrip(".") or type(error).__name__) from error


def _of_version_5(path: str) -> Iterator[Array]:
    from scipy.io import loadmat
    from scipy.io.matlab import MatlabFunction, MatlabObject, MatlabOpaque, varmats_from_mat
    from scipy.sparse import issparse

    def array(name: str, value: Any, field: bool = False) -> Array:
        if isinstance(value, MatlabOpaque):
            return Array(value["s0"][0].decode("latin1"), "object")
        if isinstance(value, MatlabFunction):
            return Array(name, "function")
        if isinstance(value, MatlabObject):
            return Array(name, "object")
        if issparse(value):
            return Array(name, "sparse")
        if value.dtype.names is not None and value.size == 1 and not field:
            fields = (array(key, value.flat[0][key], field=True) for key in value.dtype.names)
            return Array(name, "struct", value.shape, fields=tuple(fields))
        # a struct without fields comes as an array of nothing
        if value.dtype.names is not None or (value.size and value.flat[0] is None):
            return Array(name, "struct")
        return _plain(name, value)

    # loadmat of the whole would keep one of the variables that share a name, or have none
    with open(path, "rb") as file:
        for header, variable in varmats_from_mat(file):
            try:
                values = loadmat(variable)
            except Exception as error:
                raise DamagedTable(f"variable '{header}': {error}") from error
            for name, value in values.items():
                if not name.startswith("__"):  # of the header, or the workspace of functions
                    yield array(name, value)


def _plain(name: str, value: np.ndarray) -> Array:
    """An array whose type says what it is."""
    kind = {"O": "cell", "U": "char", "S": "char", "c": "complex"}.get(value.dtype.kind, "numeric")
    return Array(name, kind, value.shape, value.ravel(order="F") if kind == "numeric" else None)


def _of_hdf5(path: str) -> Iterator[Array]:
    import h5py

    def array(name: str, item: Any, field: bool = False) -> Array:
        class_name = item.attrs.get("MATLAB_class", b"")
        kind = {"function_handle": "function"}.get(
            class_name := class_name.decode() if isinstance(class_name, bytes) else class_name, class_name
        )
        if "MATLAB_sparse" in item.attrs:
            return Array(name, "sparse")
        if kind in ("cell", "char", "function"):
            return Array(name, kind)
        if isinstance(item, h5py.Group):
            if kind not in ("struct", ""):
                return Array(name, "object")
            fields = () if field else tuple(array(str(key), item[key], field=True) for key in item)
            return Array(name, "struct", (1, 1), fields=fields)
        if "MATLAB_empty" in item.attrs:
            return Array(name, "numeric", (0, 0), np.zeros(0))
        if item.dtype.names == ("real", "imag"):
            return Array(name, "complex")
        if item.dtype.kind not in "biuf":
            return Array(name, "struct" if item.dtype.kind == "O" else "object")
        return _plain(name, np.asarray(item[()]).T)

    with h5py.File(path, "r") as file:
        # names that begin with # are MATLAB's own, for what cells and objects refer to
        for name in map(str, file):
            if not name.startswith("#"):
                yield array(name, file[name])
