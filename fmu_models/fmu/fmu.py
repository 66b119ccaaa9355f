"""An FMU file, unpacked and described."""

from __future__ import annotations

import json
import os
import shutil
import weakref
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

from fmu_models.base.errors import StickslipError, nearest
from fmu_models.base.files import existing, sha256
from fmu_models.base.layout import SIGNALS
from fmu_models.base.shown import Shown
from fmu_models.base.temporary import claim_folder, release_folder
from fmu_models.fmu import archive
from fmu_models.fmu import description as descriptions
from fmu_models.language import contact_kinds

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

    from fmpy.model_description import ModelDescription, ScalarVariable

PACKED = "packed"  # beside the folder, the archive of which something stays packed


@dataclass(frozen=True, eq=False)
class Fmu(Shown):
    """An opened FMU. Its files stay unpacked in a temporary folder until the object is collected.

    Attributes:
        path: the file it came from.
        folder: where it is unpacked, without the engine of one of this suite (``sources``).
        description: modelDescription.xml in fmpy's terms, see ``description.read``.
        variables: every variable by name, in order of declaration.
    """

    path: Path
    folder: Path
    description: ModelDescription
    variables: dict[str, ScalarVariable]

    @classmethod
    def open(cls, path: str | os.PathLike[str]) -> Fmu:
        """Unpack and read an FMU 1.0, 2.0 or 3.0.

        Raises:
            StickslipError: no such file, not an FMU, of another FMI version, an archive that is unsafe to unpack, or
                a description that does not say what is meant.
        """
        beside, name = Path(path).absolute().parent, Path(path).name
        advice = " Check its name and folder, or write one: stickslip export MODEL"
        if not os.path.exists(path):
            advice = nearest(name, sorted(f.name for f in beside.glob("*.fmu"))) or advice
        path = existing(path, advice=advice)
        if not path.is_file():
            raise StickslipError(f"'{path}' is a folder. Name an FMU, a file.")
        folder = claim_folder("fmu")
        try:
            archive.unpack(path, folder, engine=False)
            if (folder / archive.OWN).is_file():  # the file itself may change or go
                shutil.copyfile(path, folder.with_name(PACKED))
            fmu = cls.unpacked(path, folder)
        except BaseException:
            release_folder(folder)
            raise
        weakref.finalize(fmu, release_folder, folder)
        return fmu

    @classmethod
    def unpacked(cls, path: Path, folder: Path) -> Fmu:
        """The FMU ``path`` that somebody else has unpacked in ``folder`` and removes there; errors as for ``open``."""
        description = descriptions.read(path, folder)
        return cls(path, folder, description, {v.name: v for v in description.modelVariables})

    def __reduce__(self) -> tuple[object, ...]:
        # another process reads the same folder; it stays with the object that unpacked it
        return Fmu.unpacked, (self.path, self.folder)

    def _heading(self) -> str:
        tool = self.description.generationTool or "an unknown tool"
        return f"FMU '{self.description.modelName}', FMI {self.description.fmiVersion}, by {tool}"

    def _contents(self) -> dict[str, object]:
        kinds = ("states", "inputs", "outputs", "contacts", "parameters")
        return {"file": self.path, **{kind: getattr(self, kind) for kind in kinds}}

    @cached_property
    def sources(self) -> Path:
        """The folder with all of its sources, for those who build something of them; errors as for ``open``."""
        if not self.folder.with_name(PACKED).is_file():
            return self.folder / "sources"
        folder = claim_folder("sources")
        weakref.finalize(self, release_folder, folder)
        archive.unpack(self.folder.with_name(PACKED), folder)
        return folder / "sources"

    @property
    def fmi(self) -> int:
        """Version of the standard by which it is called: 2 or 3. One of FMI 1.0 is called as one of 2 (``adapted``)."""
        return max(2, int(str(self.description.fmiVersion)[0]))

    @property
    def adapted(self) -> bool:
        """Whether it is of FMI 1.0, to be called through an adapter."""
        return str(self.description.fmiVersion).startswith("1")

    def elements(self, path: str) -> list[Element]:
        """The elements of modelDescription.xml at a path below its root, for what fmpy does not read."""
        return ElementTree.parse(self.folder / "modelDescription.xml").findall(path)

    @cached_property
    def interfaces(self) -> dict[str, dict[str, str]]:
        """Attributes of each interface by its tag in FMI 2 and 3, such as "CoSimulation"."""
        if not self.adapted:
            return {tag: dict(e.attrib) for tag in descriptions.INTERFACES for e in self.elements(tag)[:1]}
        stated = self.elements("Implementation/*/Capabilities")
        stepping, exchange = self.description.coSimulation, self.description.modelExchange
        identifier = {"modelIdentifier": str((stepping or exchange).modelIdentifier)}  # pyright: ignore[reportOptionalMemberAccess]
        return {"CoSimulation" if stepping else "ModelExchange": identifier | (stated[0].attrib if stated else {})}

    @cached_property
    def problems(self) -> list[str]:
        """Where its archive or its description departs from the standard without being useless."""
        repeated = archive.repeated(self.path)
        twice = [f"the archive holds '{name}' more than once, with the same contents" for name in repeated]
        return twice + descriptions.problems(self.folder, self.description)

    @cached_property
    def sha256(self) -> str:
        """Hash of the file, by which a result names it.

        Raises:
            StickslipError: it is not there any more.
        """
        return sha256(existing(self.path, "FMU"))

    @property
    def ours(self) -> bool:
        """Whether this suite exported it, as it says, with states that flow; then its own engine can make a run."""
        return self._from_here and bool(self.description.derivatives)

    @property
    def is_map(self) -> bool:
        """Whether this suite made it of a map: what it shows changes at its time events alone."""
        return self._from_here and not self.description.derivatives

    @property
    def _from_here(self) -> bool:
        return str(self.description.generationTool).startswith("stickslip ")

    def start_of(self, name: str) -> float:
        """Start value of a variable; 0 where its description says none."""
        return float(self.variables[name].start or 0.0)

    def size_of(self, name: str) -> float:
        """Nominal value of a variable; 1 where there is no such variable, or its description says none."""
        return float(getattr(self.variables.get(name), "nominal", None) or 1.0)

    def settings(self, values: Mapping[str, float]) -> dict[str, Any]:
        """Values as arguments of ``simulate``: those of "parameters" and those of "inputs"."""
        kinds = {"parameters": self.parameters, "inputs": self.inputs}
        return {kind: {name: v for name, v in values.items() if name in names} for kind, names in kinds.items()}

    def suggested_times(self) -> tuple[float, float]:
        """Start and stop of the run that its author suggests, s; 0 and 20 where the description says nothing.

        Raises:
            StickslipError: what it says are no numbers.
        """
        stated = self.description.defaultExperiment
        texts = (stated.startTime, stated.stopTime) if stated else (None, None)
        try:
            start = float(texts[0] or 0.0)
            return start, float(texts[1]) if texts[1] is not None else start + 20.0
        except ValueError:
            raise StickslipError(
                f"'{self.path}' suggests a run from '{texts[0]}' to '{texts[1]}'. Say its end: --until SECONDS"
            ) from None

    @cached_property
    def parameters(self) -> list[str]:
        """Names of the parameters."""
        return [name for name, v in self.variables.items() if v.causality == "parameter"]

    @cached_property
    def inputs(self) -> list[str]:
        """Names of the inputs, without their rates."""
        names = [name for name, v in self.variables.items() if v.causality == "input" and v.type != "Clock"]
        return [name for name in names if not (name.endswith("_rate") and name.removesuffix("_rate") in names)]

    @cached_property
    def clocks(self) -> list[str]:
        """Names of the clocks (FMI 3)."""
        return [name for name, v in self.variables.items() if v.type == "Clock"]

    @cached_property
    def states(self) -> list[str]:
        """Names of the continuous states."""
        derivatives = (unknown.variable for unknown in self.description.derivatives)
        return [str(v.derivative.name) for v in derivatives if v is not None and v.derivative is not None]

    @cached_property
    def cyclic(self) -> list[str]:
        """Names of the states upon which no rate and no indicator depends, as a height is that only falls; none where
        the description does not tell what indicators depend on (FMI 2)."""
        described = self.description
        unknowns = [*described.derivatives, *described.eventIndicators]
        if described.numberOfEventIndicators and not described.eventIndicators:
            return []
        if any(unknown.dependencies is None for unknown in unknowns):
            return []
        used = {str(dependency.name) for unknown in unknowns for dependency in unknown.dependencies or ()}
        return [name for name in self.states if name not in used]

    @cached_property
    def memories(self) -> list[str]:
        """Names of the speeds at which stops were entered, for the stops that remember them."""
        return [f"{name}_memory" for name in self.contacts if f"{name}_memory" in self.variables]

    @cached_property
    def signals(self) -> dict[str, dict[str, Any]]:
        """The periodic signals that an FMU of this suite drives itself, by name: "period", s, and by parameter "rates",
        d(log period); all formulas of parameters."""
        file = self.folder / SIGNALS
        return json.loads(file.read_text("utf-8")) if self.ours and file.is_file() else {}

    @cached_property
    def outputs(self) -> list[str]:
        """Names of the outputs, without the states of contacts and, of an FMU of this suite, those that flow."""
        return [name for name in self.ports if not (self.ours and name in self.states)]

    @cached_property
    def ports(self) -> list[str]:
        """Names of the outputs that can be connected to others, states among them, but none of contacts."""
        kinds = ("continuous", "discrete") if self.is_map else ("continuous",)
        return [name for name, v in self.variables.items() if v.causality == "output" and v.variability in kinds]

    @cached_property
    def contacts(self) -> list[str]:
        """Names of the contacts."""
        types = contact_kinds.BY_TYPE_NAME
        counted = [name for name, v in self.variables.items() if v.declaredType and v.declaredType.name in types]
        return [name.removesuffix("_state") for name in counted]

    def refuse_cones(self, what: str) -> None:
        """StickslipError: it has friction with two directions, which ``what`` does not know."""
        types = (self.variables[f"{name}_state"].declaredType for name in self.contacts)
        if any(contact_kinds.BY_TYPE_NAME[str(type and type.name)].cone for type in types):
            raise StickslipError(
                f"'{self.description.modelName}' has friction with two directions, which {what} do not know yet. "
                "Simulate it, or give the friction one slip speed."
            )

    @cached_property
    def impacts(self) -> list[str]:
        """Names of the rigid contacts, their friction left out."""
        types = {name: self.variables[f"{name}_state"].declaredType for name in self.contacts}
        return [name for name, type in types.items() if contact_kinds.BY_TYPE_NAME[str(type and type.name)].impulsive]
