"""modelDescription.xml of an FMU from somebody else: looked over, read by fmpy, checked, before a library is loaded;
kept in the user's cache as it was read, since fmpy and its parser take a seventh of a short command.

What leaves it open which variable or file is meant refuses the FMU; everything else in which it departs from the
standard is told (``problems``), since FMUs in use depart from it often.
"""

from __future__ import annotations

import gc
import io
import math
import pickle
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.parsers import expat

from fmu_models.base.cache import cache_folder, digest
from fmu_models.base.errors import StickslipError
from fmu_models.base.files import sealed_bytes, sha256
from fmu_models.base.version import version_of
from fmu_models.fmu import fmi1

if TYPE_CHECKING:
    from fmpy.model_description import ModelDescription

# a model of a hundred thousand variables takes some 50 MB; the parsed tree takes ten times the file
MAX_XML = 128 << 20
MAX_TAGS = 2_000_000  # of which each may become a variable of some kB
MAX_DEPTH = 100
MAX_INDICATORS = 1_000_000
MAX_ELEMENTS = 10_000_000  # of one array variable
MAX_IDENTIFIER = 200
# what fmpy converts start values by, those of binary variables aside
CONVERSIONS = {kind.__name__: kind for kind in (float, int, bool, str)}
INTERFACES = ("ModelExchange", "CoSimulation", "ScheduledExecution")


def read(path: Path, folder: Path) -> ModelDescription:
    """The description of the FMU ``path`` that is unpacked in ``folder``: objects with the fields of fmpy's.

    Raises:
        StickslipError: missing, unsafe or ill-formed XML, another version of FMI than 1.0, 2.0 and 3.0, or a
            description that does not say which variables and files are meant.
    """
    xml, build = folder / "modelDescription.xml", folder / "sources" / "buildDescription.xml"
    if not xml.is_file():
        deeper = next(folder.glob("*/modelDescription.xml"), None)
        hint = f" It lies in '{deeper.parent.name}': pack the folder's contents, not the folder." if deeper else ""
        raise StickslipError(f"'{path}' is not an FMU: it holds no modelDescription.xml.{hint}")
    readers = (Path(__file__), Path(fmi1.__file__))
    hashes = [sha256(file) for file in (*readers, xml, build) if file.is_file()]
    kept = cache_folder() / "descriptions" / digest(version_of("fmpy"), *hashes)
    with _no_collection():
        description = _Reader(io.BytesIO(sealed_bytes(kept, lambda: _pickled(path, xml, build)))).load()
    for variable in description.modelVariables:
        if variable.type == "Binary":
            variable._python_type = bytes.fromhex
    return description


class _Kept:
    """An object of a description: fmpy's, by its fields alone."""

    instantiationToken: Any

    @property
    def guid(self) -> Any:
        """What a description of fmpy has beside its fields."""
        return self.instantiationToken


class _Reader(pickle.Unpickler):
    """Makes objects of a description, and nothing else that a file could name."""

    def find_class(self, module: str, name: str) -> Any:
        """The class that stands for one of fmpy's."""
        if module == "fmpy.model_description":
            return type(name, (_Kept,), {})
        if module == "builtins" and name in CONVERSIONS:
            return CONVERSIONS[name]
        raise pickle.UnpicklingError(f"a description holds no {module}.{name}")


def _pickled(path: Path, xml: Path, build: Path) -> bytes:
    from fmpy import read_model_description

    outline = _Outline(f"'{path}': modelDescription.xml")
    outline.check(xml)
    if build.is_file():
        _look_over(build, f"'{path}': buildDescription.xml", lambda *_: None)
    try:
        description = read_model_description(str(xml.parent), validate=False)
        if outline.fmi == 1:
            fmi1.complete(description, xml)
        for interface, attributes in (
            (description.modelExchange, outline.interfaces.get("ModelExchange")),
            (description.coSimulation, outline.interfaces.get("CoSimulation")),
        ):
            # fmpy knows the attribute by its name in FMI 2 only
            if interface is not None and attributes and "providesDirectionalDerivatives" in attributes:
                interface.providesDirectionalDerivative = attributes["providesDirectionalDerivatives"] in ("true", "1")
        _check(path, description)
        for variable in description.modelVariables:
            if variable.type == "Binary":
                variable._python_type = None  # a function, which is not kept
        return pickle.dumps(description)
    except StickslipError:
        raise
    except Exception as error:  # fmpy raises whatever its parser raised
        reason = error if str(error) and not isinstance(error, KeyError) else f"{type(error).__name__} {error}".strip()
        raise StickslipError(f"'{path}': modelDescription.xml cannot be read: {reason}") from error


@contextmanager
def _no_collection() -> Iterator[None]:
    """No search for garbage while many objects are made that all stay, nor among them afterwards: it takes two fifths
    of the time."""
    collects = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if gc.get_freeze_count() == 0:
            # they go where those are that have long stayed
            gc.freeze()
            gc.unfreeze()
        if collects:
            gc.enable()


def problems(folder: Path, description: ModelDescription) -> list[str]:
    """Where a description that can be used departs from the standard, as fmpy's validation finds it."""
    from fmpy import read_model_description
    from fmpy.model_description import ValidationError
    from fmpy.validation import validate_model_description

    departures: list[str] = []
    try:
        read_model_description(str(folder), validate=True)
    except ValidationError as error:
        departures += [str(problem) for problem in error.problems]
    except Exception as error:  # fmpy stumbles over some of what it should report
        departures.append(str(error) or type(error).__name__)
    try:
        departures += validate_model_description(description, validate_model_structure=True)
    except Exception as error:
        departures.append(f"its structure cannot be checked: {type(error).__name__} {error}")
    return list(dict.fromkeys(departures))


class _Outline:
    """What must be right in the XML before a parser is let loose on it that resolves more than elements."""

    def __init__(self, where: str) -> None:
        self.where = where
        self.interfaces: dict[str, dict[str, str]] = {}
        self.root: tuple[str, dict[str, str]] | None = None
        self.fmi = 0

    def check(self, xml: Path) -> None:
        _look_over(xml, self.where, self._element)
        if not self.interfaces:
            raise StickslipError(f"{self.where} declares neither Model Exchange nor Co-Simulation.")

    def _element(self, depth: int, name: str, attributes: dict[str, str]) -> None:
        if depth == 1:
            self._check_root(name, attributes)
        elif depth == 2 and self.fmi == 1 and name == "Implementation":
            self.interfaces = {"CoSimulation": {}}
        elif depth == 2 and name in INTERFACES:
            self._check_identifier(attributes.get("modelIdentifier", ""))
            self.interfaces[name] = attributes
        elif name == "Unknown" and self.fmi == 2:
            # fmpy would take 0 and less for a variable counted from the end
            numbers = [attributes.get("index", ""), *attributes.get("dependencies", "").split()]
            for number in numbers:
                if not number.isascii() or not number.strip().isdigit() or int(number) < 1:
                    raise StickslipError(
                        f"{self.where}: ModelStructure refers to the variable '{number}'; it counts from 1."
                    )

    def _check_root(self, name: str, attributes: dict[str, str]) -> None:
        if name != "fmiModelDescription":
            raise StickslipError(f"{self.where} describes '{name}', not an fmiModelDescription.")
        version = attributes.get("fmiVersion")
        if version is None:
            raise StickslipError(f"{self.where} has no fmiVersion. FMI 1.0, 2.0 and 3.0 are read.")
        if not version.startswith(("1.", "2.", "3.")):
            raise StickslipError(
                f"{self.where} is of FMI {version}. FMI 1.0, 2.0 and 3.0 are read: export it as one of these."
            )
        self.fmi = int(version[0])
        token = "guid" if self.fmi < 3 else "instantiationToken"
        if not attributes.get(token):
            raise StickslipError(f"{self.where} has no {token}, without which its library cannot be instantiated.")
        if self.fmi == 1:
            self._check_identifier(attributes.get("modelIdentifier", ""))
            self.interfaces["ModelExchange"] = {}
            states = attributes.get("numberOfContinuousStates", "no")
            if not (states.isascii() and states.isdigit() and len(states) < 7):
                raise StickslipError(f"{self.where} declares {states[:60]!a} continuous states; expected 0 to 999999.")

    def _check_identifier(self, identifier: str) -> None:
        unsafe = any(c in '/\\:*?"<>|' or not c.isprintable() for c in identifier) or identifier.startswith(".")
        if not identifier or unsafe or len(identifier) > MAX_IDENTIFIER:
            raise StickslipError(
                f"{self.where} has the modelIdentifier {identifier[:60]!a}, which is not the name of a library."
            )


def _look_over(xml: Path, where: str, element: Callable[[int, str, dict[str, str]], None]) -> None:
    """Parse without building anything: ``element(depth, name, attributes)`` sees the start tags of the root, of its
    children and of unknowns."""
    size = xml.stat().st_size
    if size > MAX_XML:
        raise StickslipError(f"{where} has {size >> 20} MB, more than the {MAX_XML >> 20} MB that are read.")
    parser = expat.ParserCreate()
    depth = count = 0

    def doctype(*_: object) -> None:
        # with it come entities: files of this machine read in, and a few bytes that grow to gigabytes
        raise StickslipError(f"{where} has a document type (DOCTYPE), which no FMU needs; it is not read.")

    def start(name: str, attributes: dict[str, str]) -> None:
        nonlocal depth, count
        depth += 1
        count += 1
        if depth > MAX_DEPTH:
            raise StickslipError(f"{where} is nested more than {MAX_DEPTH} deep, which no FMU needs; it is not read.")
        if count > MAX_TAGS:
            raise StickslipError(f"{where} has more than the {MAX_TAGS} elements that are read.")
        if depth <= 2 or name == "Unknown":  # not the hundreds of thousands of variables
            element(depth, name, attributes)

    def end(_: str) -> None:
        nonlocal depth
        depth -= 1

    parser.StartDoctypeDeclHandler = doctype
    parser.StartElementHandler = start
    parser.EndElementHandler = end
    try:
        with xml.open("rb") as file:
            parser.ParseFile(file)
    except (expat.ExpatError, LookupError, ValueError) as error:
        raise StickslipError(f"{where} cannot be read: {error}.") from error


def _check(path: Path, description: ModelDescription) -> None:
    """What reads well and yet leaves it open what is meant."""
    where = f"'{path}': modelDescription.xml"
    names: set[str] = set()
    for variable in description.modelVariables:
        name, reference = variable.name, variable.valueReference
        if name in names:
            raise StickslipError(f"{where} has two variables '{name}'; which one is meant cannot be told.")
        names.add(name)
        if not 0 <= reference < 1 << 32:
            raise StickslipError(f"{where}: '{name}' has the value reference {reference}; it is a number of 32 bits.")
        shape = variable.shape or ()
        if min(shape, default=0) < 0 or math.prod(shape) > MAX_ELEMENTS:
            raise StickslipError(f"{where}: '{name}' is an array of shape {shape}, more than {MAX_ELEMENTS} elements.")
    for unknown in description.derivatives:
        variable = unknown.variable
        if variable is None or variable.derivative is None:
            named = f"'{variable.name}'" if variable is not None else "a variable"
            raise StickslipError(
                f"{where}: ModelStructure lists {named} as the derivative of a state, but its attribute 'derivative' "
                "does not say of which."
            )
    if not 0 <= description.numberOfEventIndicators <= MAX_INDICATORS:
        raise StickslipError(
            f"{where} declares {description.numberOfEventIndicators} event indicators; expected 0 to {MAX_INDICATORS}."
        )
