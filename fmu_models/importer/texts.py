"""Texts and bytes of an FMU (String, and Binary of FMI 3): which there are, and what they may be set to."""

from collections.abc import Container, Iterable, Mapping
from typing import Any, TypeVar

from fmu_models.base.errors import StickslipError
from fmu_models.base.files import existing
from fmu_models.fmu.elements import element_names, owner
from fmu_models.fmu.fmu import Fmu
from fmu_models.importer.request import has_start

TYPES = ("String", "Binary")
Value = TypeVar("Value")


def is_text(fmu: Fmu, name: str) -> bool:
    variable = fmu.variables.get(owner(name, fmu.variables))
    return variable is not None and str(variable.type) in TYPES


def outputs(fmu: Fmu) -> list[str]:
    return [name for name, v in fmu.variables.items() if v.causality == "output" and is_text(fmu, name)]


def split(fmu: Fmu, values: Mapping[str, Value]) -> tuple[dict[str, Value], dict[str, Value]]:
    """Values of variables that are texts or bytes, and the rest."""
    chosen = {name: value for name, value in values.items() if is_text(fmu, name)}
    return chosen, {name: value for name, value in values.items() if name not in chosen}


def checked(fmu: Fmu, values: Mapping[str, object], *, kind: str) -> dict[str, str | bytes]:
    """What is set as the FMU takes it: texts, and bytes, also from hex text ``0x00ff`` and from a file ``@path``. kind:
    "parameter", "input" or "start value": what the variables must be. StickslipError: a variable of another kind, no
    text, no bytes, an array of which elements are missing."""
    texts: dict[str, str | bytes] = {}
    for name, value in values.items():
        variable = fmu.variables[owner(name, fmu.variables)]
        settable = has_start(variable) if kind == "start value" else variable.causality == kind
        if not settable or variable.variability == "constant":
            description = f"{variable.variability or ''} {variable.causality}".strip()
            raise StickslipError(
                f"'{name}' of '{fmu.description.modelName}' is no {kind} to be set: it is a {description}."
            )
        elements = element_names(str(variable.name), variable.shape or ())
        if missing := [element for element in elements if element not in values]:
            raise StickslipError(
                f"'{variable.name}' is an array of {variable.type}, which FMI sets as a whole: give '{missing[0]}' too."
            )
        texts[name] = _text(name, value) if variable.type == "String" else _bytes(name, value)
    return texts


def _text(name: str, value: object) -> str:
    if not isinstance(value, str):
        raise StickslipError(f"'{name}' cannot be set to {value!r}: it is of type String. Give it text.")
    if "\0" in value:
        raise StickslipError(
            f"'{name}' cannot be set to {value!r}: a String ends at its first zero byte. Leave it out."
        )
    try:
        value.encode()
    except UnicodeEncodeError:
        raise StickslipError(f"'{name}' cannot be set to {value!r}: a String is UTF-8, and this is not.") from None
    return value


def _bytes(name: str, value: object) -> bytes:
    if isinstance(value, bytes):
        return value
    if isinstance(value, str) and value.startswith("@"):
        file = existing(value[1:])
        try:
            return file.read_bytes()
        except OSError as error:
            raise StickslipError(f"'{name}': '{file}' cannot be read: {error.strerror}.") from error
    try:
        if isinstance(value, str) and value.startswith("0x"):
            return bytes.fromhex(value[2:])
    except ValueError:
        pass
    raise StickslipError(
        f"'{name}' cannot be set to {value!r}: it is of type Binary. Give its bytes as hex text, such as 0x00ff, "
        "or a file as @path."
    )


def settings(
    fmu: Fmu, parameters: Mapping[str, Any], start: Mapping[str, Any], inputs: Mapping[str, Any]
) -> tuple[dict[str, str | bytes], tuple[dict[str, Any], dict[str, Any], dict[str, Any]]]:
    """What is to be set as text or bytes, checked, and the rest of parameters, start values and inputs.

    Errors as for ``checked``.
    """
    kinds = {"parameter": parameters, "start value": start, "input": inputs}
    pairs = {kind: split(fmu, values) for kind, values in kinds.items()}
    words: dict[str, str | bytes] = {}
    for kind, (values, _) in pairs.items():
        words |= checked(fmu, values, kind=kind)
    numeric = [others for _, others in pairs.values()]
    return words, (numeric[0], numeric[1], numeric[2])


def untold(fmu: Fmu, names: Iterable[str], recorded: Container[str]) -> str:
    """A word on those asked for that the FMU did not tell, for the method of a run."""
    missing = [n for n in names if any(e not in recorded for e in element_names(n, fmu.variables[n].shape or ()))]
    listed = ", ".join(f"'{name}' ({fmu.variables[name].type})" for name in missing)
    return f"; not told by the FMU: {listed}" if missing else ""


def shown(value: str | bytes) -> str:
    """Text as it is, bytes as hex text ``0x00ff``."""
    return value if isinstance(value, str) else f"0x{value.hex()}"
