"""MAT-files of version 5 (MATLAB's -v6, -v7): the arrays of numbers in them.

    file    = header (128 bytes), element*
    element = type and length (4 + 4 bytes; 2 + 2 where the data are 4 bytes or fewer), data, padding to 8 bytes
    array   = element of elements: flags, dimensions, name, then real part [imaginary part], or a struct's fields

Written anew because the parser of SciPy takes the whole process down (bus error) on some damaged files. Nothing here
is believed before it fits: lengths, dimensions, types. Source: MathWorks, MAT-File Format, version 5.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

HEADER = 128  # bytes before the first element; the last four are version and byte order
VERSIONS = {b"\x00\x01IM": "<", b"\x01\x00MI": ">"}
LARGEST = 1 << 31  # bytes of one variable, the most that the format holds

_MATRIX, _COMPRESSED, _INT8, _INT32, _UINT32 = 14, 15, 1, 5, 6
_STORED = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
_STRUCT, _NUMBERS, _OPAQUE = 2, range(6, 16), 17
_CLASSES = {1: "cell", _STRUCT: "struct", 3: "object", 4: "char", 5: "sparse", 16: "function", _OPAQUE: "object"}
_COMPLEX = 0x08


class Damaged(ValueError):
    """The bytes are not what the format says."""


@dataclass(frozen=True)
class Array:
    """One variable. kind: "numeric", "complex", "cell", "struct", "object", "char", "sparse" or "function".

    shape: empty for objects; values: (n,) as stored, column after column, None where it is not numeric; fields: of a
    struct with one element that is no field itself.
    """

    name: str
    kind: str
    shape: tuple[int, ...]
    values: np.ndarray | None = None
    fields: tuple[Array, ...] = ()


def arrays(data: bytes) -> Iterator[Array]:
    """The variables of a file in its order.

    Raises:
        Damaged: no header of version 5, or anything that does not fit.
    """
    order = VERSIONS.get(data[HEADER - 4 : HEADER])
    if order is None:
        raise Damaged("the header is not of version 5")
    for kind, content in _elements(memoryview(data)[HEADER:], order):
        if kind == _COMPRESSED:
            (kind, content), *more = _elements(_inflated(content), order)
            if more:
                raise Damaged("a compressed variable is followed by something")
        if kind != _MATRIX:
            raise Damaged(f"a variable is of type {kind}")
        yield _array(content, order)


def _inflated(content: memoryview) -> memoryview:
    inflate = zlib.decompressobj()
    try:
        found = inflate.decompress(content, LARGEST)
    except zlib.error as error:
        raise Damaged("a compressed variable cannot be unpacked") from error
    if not inflate.eof or not found:
        raise Damaged("a compressed variable is cut off")
    return memoryview(found)


def _elements(data: memoryview, order: str) -> Iterator[tuple[int, memoryview]]:
    """Type and data of the elements that lie one after the other."""
    place = 0
    while place < len(data):
        if place + 8 > len(data):
            raise Damaged("it ends within an element")
        kind, length = struct.unpack_from(order + "II", data, place)
        start, step = place + 8, 8 + length
        if kind >> 16:  # short form: the length in the upper half of the first word, the data in the second
            kind, length = kind & 0xFFFF, kind >> 16
            start, step = place + 4, 8
            if length > 4:
                raise Damaged("a short element is longer than four bytes")
        if start + length > len(data):
            raise Damaged("it ends within an element")
        yield kind, data[start : start + length]
        place += step if kind == _COMPRESSED else -(-step // 8) * 8


def _array(data: memoryview, order: str, field: str | None = None) -> Array:
    """An array from its elements; one of no bytes is empty (a field never set). field: name, if it is a struct's."""
    name = field or ""
    if not len(data):
        return Array(name, "numeric", (0, 0), np.zeros(0))
    parts = _elements(data, order)
    flags = _integers(_next(parts), _UINT32, order)
    if len(flags) != 2:
        raise Damaged("an array's flags are missing")
    number, is_complex = int(flags[0]) & 0xFF, int(flags[0]) >> 8 & _COMPLEX
    if number not in _CLASSES and number not in _NUMBERS:
        raise Damaged(f"an array is of class {number}")
    shape: tuple[int, ...] = ()
    if number != _OPAQUE:
        shape = tuple(int(n) for n in _integers(_next(parts), _INT32, order))
        if len(shape) < 2 or min(shape) < 0:
            raise Damaged("an array has no dimensions")
    name = _text(_next(parts)) or name
    if number == _STRUCT and shape == (1, 1) and field is None:
        return Array(name, "struct", shape, fields=_fields(parts, order))
    if number not in _NUMBERS:
        return Array(name, _CLASSES[number], shape)
    if is_complex:
        return Array(name, "complex", shape)
    kind, content = _next(parts)
    values = _numbers(kind, content, order)
    count = 1
    for extent in shape:  # Python's own numbers, which cannot overflow
        count *= extent
    if len(values) != count:
        raise Damaged(f"'{name}' holds {len(values)} numbers where its dimensions say {count}")
    return Array(name, "numeric", shape, values)


def _fields(parts: Iterator[tuple[int, memoryview]], order: str) -> tuple[Array, ...]:
    lengths = _integers(_next(parts), _INT32, order)
    kind, names = _next(parts)
    if len(lengths) != 1 or lengths[0] < 1 or kind != _INT8 or len(names) % lengths[0]:
        raise Damaged("a struct's field names do not fit")
    each = int(lengths[0])
    found = []
    for i in range(0, len(names), each):
        kind, content = _next(parts)
        if kind != _MATRIX:
            raise Damaged(f"a struct's field is of type {kind}")
        found.append(_array(content, order, _text((_INT8, names[i : i + each]))))
    return tuple(found)


def _next(parts: Iterator[tuple[int, memoryview]]) -> tuple[int, memoryview]:
    found = next(parts, None)
    if found is None:
        raise Damaged("an array is incomplete")
    return found


def _integers(element: tuple[int, memoryview], expected: int, order: str) -> np.ndarray:
    if element[0] != expected:
        raise Damaged(f"an element is of type {element[0]}, expected {expected}")
    return _numbers(*element, order)


def _numbers(kind: int, content: memoryview, order: str) -> np.ndarray:
    if kind not in _STORED:
        raise Damaged(f"numbers are stored as type {kind}")
    dtype = np.dtype(order + _STORED[kind])
    if len(content) % dtype.itemsize:
        raise Damaged("a number is cut off")
    return np.frombuffer(content, dtype)


def _text(element: tuple[int, memoryview]) -> str:
    if element[0] != _INT8:
        raise Damaged(f"a name is of type {element[0]}")
    return bytes(element[1]).split(b"\0", 1)[0].decode("utf-8", "replace")
