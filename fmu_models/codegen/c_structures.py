"""The structures and enumerations of our C headers as Python reads them: the header is where they are declared.

Read is the style of these headers and nothing else: ``typedef struct { ... } Name;`` with numbers, pointers, arrays and
structures declared before, ``typedef enum { ... } Name;`` and ``enum { ... };`` whose values are sums of numbers and of
names declared before. A declaration is read when it is asked for: a structure that depends on the size of a model may
stand beside it.
"""

import ctypes
import re
import struct
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from _ctypes import _SimpleCData

_ROOT = Path(__file__).parents[1]
_COMMENT = re.compile(r"/\*.*?\*/", re.DOTALL)
_DECLARATION = re.compile(r"\b(typedef\s+struct|typedef\s+enum|enum)\s*\{([^{}]*)\}\s*(\w*)\s*;")
_FIELD = re.compile(r"(?:const\s+)?(signed char|\w+)\s+(\**.+)", re.DOTALL)
_DECLARATOR = re.compile(r"\s*(\**)\s*(\w+)\s*(?:\[([^\]]*)\])?\s*")
_NUMBERS: dict[str, Any] = {
    **{"double": ctypes.c_double, "int": ctypes.c_int, "long": ctypes.c_long, "size_t": ctypes.c_size_t},
    **{"char": ctypes.c_char, "signed char": ctypes.c_byte, "int32_t": ctypes.c_int32, "int64_t": ctypes.c_int64},
    **{"uint32_t": ctypes.c_uint32, "uint64_t": ctypes.c_uint64},
}


class Declarations:
    """What headers declare; names of headers are paths below ``fmu_models``, those that others need first."""

    def __init__(self, *headers: str) -> None:
        self.headers = headers
        self._bodies: dict[str, str] = {}
        self._enumerations: dict[str, dict[str, int]] = {}
        self._structures: dict[str, type[ctypes.Structure]] = {}
        self._constants: dict[str, int] = {}
        for header in headers:
            text = _COMMENT.sub(" ", (_ROOT / header).read_text("utf-8"))
            for kind, body, name in _DECLARATION.findall(text):
                if kind.endswith("struct"):
                    self._bodies[name] = body
                else:
                    self._enumerations[name] = self._enumerate(body)

    def constants(self, enumeration: str = "", prefix: str = "") -> SimpleNamespace:
        """The constants of an enumeration, or of all together; the part of their names in front is cut off.

        Raises:
            ValueError: no such enumeration, or a constant without that prefix in one that is named.
        """
        if enumeration and enumeration not in self._enumerations:
            raise ValueError(f"{self._where()} declare no enumeration '{enumeration}'")
        constants = self._enumerations[enumeration] if enumeration else self._constants
        if enumeration and (odd := [name for name in constants if not name.startswith(prefix)]):
            raise ValueError(f"'{odd[0]}' of {enumeration} does not begin with {prefix}")
        return SimpleNamespace(**{n.removeprefix(prefix): v for n, v in constants.items() if n.startswith(prefix)})

    def structure(self, name: str) -> type[ctypes.Structure]:
        """The ctypes.Structure of a name; its pointers are void pointers.

        Raises:
            ValueError: not declared, or declared in a way that is not read here.
        """
        if name not in self._structures:
            if name not in self._bodies:
                raise ValueError(f"{self._where()} declare no structure '{name}'")
            fields = [f for field in self._bodies[name].split(";") if field.strip() for f in self._fields(field, name)]
            self._structures[name] = type(name, (ctypes.Structure,), {"_fields_": fields})
        return self._structures[name]

    def packing(self, name: str, first: str, last: str) -> struct.Struct:
        """How consecutive fields of a structure are packed, numbers and pointers."""
        names, types = zip(*self.structure(name)._fields_, strict=True)
        return struct.Struct("".join(t._type_ for t in types[names.index(first) : names.index(last) + 1]))

    def _fields(self, declaration: str, structure: str) -> list[tuple[str, Any]]:
        """The fields of one declaration, such as ``const double *a, *b[N]``."""
        match = _FIELD.fullmatch(declaration.strip())
        fields = []
        for declarator in match[2].split(",") if match else [declaration]:
            declared = _DECLARATOR.fullmatch(declarator) if match else None
            if match is None or declared is None:
                line = " ".join(declaration.split())
                raise ValueError(f"'{line}' in {structure} is no field as our headers write them")
            kind = ctypes.c_void_p if declared[1] else self._kind(match[1], structure)
            try:
                fields.append((declared[2], kind * self._value(declared[3]) if declared[3] else kind))
            except ValueError:
                raise ValueError(f"'{declared[3]}' in {structure} is no number that these headers tell") from None
        return fields

    def _kind(self, name: str, structure: str) -> "type[_SimpleCData[Any] | ctypes.Structure]":
        if name in self._enumerations:
            return ctypes.c_int
        if name in self._bodies and name != structure:
            return self.structure(name)
        if name not in _NUMBERS:
            raise ValueError(f"the type '{name}' in {structure} is none that is known; give its header too")
        return _NUMBERS[name]

    def _enumerate(self, body: str) -> dict[str, int]:
        constants: dict[str, int] = {}
        value = -1
        for entry in filter(None, (entry.strip() for entry in body.split(","))):
            name, _, expression = (half.strip() for half in entry.partition("="))
            try:
                value = self._value(expression) if expression else value + 1
            except ValueError:
                continue  # depends on a model
            constants[name] = self._constants[name] = value
        return constants

    def _value(self, expression: str) -> int:
        """A sum of numbers and of constants declared before."""
        total = 0
        for sign, term in re.findall(r"([+-]?)\s*([^+-]+)", expression):
            constant = self._constants.get(term.strip())
            total += (-1 if sign == "-" else 1) * (int(term, 0) if constant is None else constant)
        return total

    def _where(self) -> str:
        return " and ".join(self.headers)


@cache
def declarations(*headers: str) -> Declarations:
    """What these headers declare, read once."""
    return Declarations(*headers)
