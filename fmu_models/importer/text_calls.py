"""Texts and bytes of an FMU are set before initialization and read at both ends of a run. Between these they are not
looked at: the master steps over numbers alone."""

import ctypes
from collections.abc import Iterable, Mapping
from ctypes import byref, c_char_p, c_int, c_size_t, c_uint32, c_void_p

from fmu_models.base.errors import StickslipError
from fmu_models.fmu.elements import element_names, owner
from fmu_models.importer.instance import STATUS, F, Instance, master_library


def write(instance: Instance, texts: Mapping[str, str | bytes]) -> None:
    """Set texts and bytes of an instance that the next run takes as it then is. StickslipError: the FMU refuses a
    value, or lacks the function."""
    calls, variables = instance.calls, instance.fmu.variables
    instance.log.count, instance.log.message = 0, b""
    if calls.resets:
        instance.renew()
        library = master_library()
        if (
            library.fmi_plain(byref(calls), F.RESET) >= STATUS.DISCARD
            or library.fmi_configure(byref(calls)) >= STATUS.DISCARD
        ):
            raise StickslipError(f"'{instance.fmu.path}' cannot be reset: {instance.message() or 'it says nothing'}")
    calls.resets = 1
    for name in dict.fromkeys(owner(name, variables) for name in texts):
        variable = variables[name]
        values = [texts[element] for element in element_names(name, variable.shape or ())]
        coded = [value.encode() if isinstance(value, str) else value for value in values]
        if _set(instance, str(variable.type), int(variable.valueReference), coded) >= STATUS.DISCARD:
            message = instance.message() or "it says nothing"
            raise StickslipError(f"'{instance.fmu.path}' refuses the value of '{name}': {message}")
    calls.resets = 0


def _set(instance: Instance, kind: str, reference: int, values: list[bytes]) -> int:
    n = len(values)
    function = instance.function(f"Set{kind}")
    function.restype = c_int
    first = (c_void_p(instance.calls.instance), byref(c_uint32(reference)), c_size_t(1))
    if kind == "String":
        last = () if instance.fmu.fmi == 2 else (c_size_t(n),)
        return function(*first, (c_char_p * n)(*values), *last)
    buffers = [ctypes.create_string_buffer(value, max(1, len(value))) for value in values]
    sizes = (c_size_t * n)(*map(len, values))
    return function(*first, sizes, (c_void_p * n)(*map(ctypes.addressof, buffers)), c_size_t(n))


def read(instance: Instance, names: Iterable[str]) -> dict[str, str | bytes]:
    """Texts and bytes by name, an array by element; without those that the FMU does not tell."""
    texts: dict[str, str | bytes] = {}
    for name in names:
        variable = instance.fmu.variables[name]
        elements = element_names(name, variable.shape or ())
        values = _get(instance, str(variable.type), int(variable.valueReference), len(elements))
        if values is not None:
            texts |= zip(elements, values, strict=True)
    return texts


def _get(instance: Instance, kind: str, reference: int, n: int) -> list[str] | list[bytes] | None:
    try:
        function = instance.function(f"Get{kind}")
    except StickslipError:
        return None
    function.restype = c_int
    values, sizes = (c_void_p * n)(), (c_size_t * n)()
    first = (c_void_p(instance.calls.instance), byref(c_uint32(reference)), c_size_t(1))
    if kind == "String":
        last = () if instance.fmu.fmi == 2 else (c_size_t(n),)
        status = function(*first, values, *last)
    else:
        status = function(*first, sizes, values, c_size_t(n))
    if status >= STATUS.DISCARD:
        return None
    if kind == "Binary":
        return [ctypes.string_at(at, size) if at else b"" for at, size in zip(values, sizes, strict=True)]
    # what is no UTF-8 is shown by its bytes
    return [ctypes.string_at(at).decode("utf-8", "backslashreplace") if at else "" for at in values]
