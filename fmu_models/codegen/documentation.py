"""What an FMU holds for people: a page with its equations, pictures, and terminals that editors draw it with."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache
from typing import TYPE_CHECKING, Any

import sympy

from fmu_models.codegen import picture
from fmu_models.codegen.model_description import render
from fmu_models.codegen.rights import FOLDER, Rights
from fmu_models.language.contact_kinds import INDICATORS
from fmu_models.lowering.equations import Line, of_contact, outputs, rates, states_of
from fmu_models.toolchain.compiler import compiler_for

if TYPE_CHECKING:
    from xml.dom.minidom import Element

    from markupsafe import Markup
    from sympy.printing.mathml import MathMLPresentationPrinter

    from fmu_models.codegen.model_structure import ModelStructure
    from fmu_models.lowering.hybrid_system import HybridSystem

# operations up to which an expression is printed
_LARGEST_EXPRESSION = 400
# equations, contacts and outputs of which the page shows the first; nobody reads more
_MOST = 100
PICTURES = "terminalsAndIcons"


def documents(
    structure: ModelStructure, fmi_version: str, token: str, tool: str, rights: Rights
) -> dict[str, bytes | str]:
    """The files for people by their names in the archive."""
    system, variables = structure.system, structure.variables
    names = {kind: [v.name for v in variables.listed if v.causality == kind] for kind in ("input", "output")}
    # FMI 3.0 has the icon alone
    image = picture.block(system.name, [u.name for u in system.inputs], names["output"])
    facts = [
        ("Written by", tool),
        ("FMI", f"{fmi_version}, Model Exchange and Co-Simulation"),
        ("Token", token),
        ("Derived and compiled with", f"SymPy {sympy.__version__}, {compiler_for().name}"),
        *((key.capitalize(), value) for key, value in rights.attributes.items() if value is not None),
    ]
    icon = "model.png" if fmi_version == "2.0" else f"{PICTURES}/icon.png"
    page = {
        "picture": f"../{icon}",
        "equations": [(_printed([left]), _printed([right])) for left, right in rates(system)[:_MOST]],
        "contacts": [_contact(system, i) for i in range(min(len(system.contacts), _MOST))],
        "outputs": [(o, _printed([e])) for o, e in zip(system.outputs[:_MOST], outputs(system), strict=False)],
        "cut": max(len(system.states), len(system.contacts), len(system.outputs)) > _MOST,
        "requirements": [requirement.sentence for requirement in system.all_requirements],
        "licenses": f"{FOLDER.rpartition('/')[2]}/license.txt",
        "said": facts,
    }
    files = {"documentation/index.html": render("index.html.j2", **page, v=variables, system=system), icon: image}
    if fmi_version == "2.0":
        return files  # terminals came with 3.0; readers of 2.0 call them a fault
    terminals = render("terminalsAndIcons.xml.j2", inputs=system.inputs, contacts=_terminals(structure))
    return {**files, f"{PICTURES}/port.png": picture.port(), f"{PICTURES}/terminalsAndIcons.xml": terminals}


def _contact(system: HybridSystem, i: int) -> dict[str, Any]:
    contact = system.contacts[i]
    return {
        "name": contact.name,
        "kind": contact.kind.words,
        "description": contact.description,
        "equations": {name: _printed(line) for name, line in of_contact(contact).items()},
        "states": ", ".join(states_of(contact)),
        "indicators": [INDICATORS[indicator][1] for indicator in contact.indicators],
    }


def _terminals(structure: ModelStructure) -> list[tuple[Any, list[tuple[str, str]]]]:
    """Per contact its variables: name in the terminal, and in the FMU."""
    variables = structure.variables
    listed = {v.name for v in variables.listed}
    terminals = []
    for contact in structure.system.contacts:
        names = [(kind, f"{contact.name}_{kind}") for kind in ("state", "force") if f"{contact.name}_{kind}" in listed]
        terminals.append((contact, names))
    return terminals


def _printed(line: Line | Iterable[Any]) -> Markup:
    """MathML of expressions, with the words between them."""
    from markupsafe import Markup, escape

    return Markup("").join(escape(item) if isinstance(item, str) else Markup(_math(item)) for item in line)


def _math(expression: sympy.Basic) -> str:
    expression = sympy.sympify(expression)
    operations = expression.count_ops()
    if operations > _LARGEST_EXPRESSION:
        return f"<i>{operations} operations: see sources/model.c</i>"
    return f"<math>{_printer().doprint(expression)}</math>".replace("&InvisibleTimes;", "&#8290;")


@cache
def _printer() -> MathMLPresentationPrinter:
    from sympy.printing.mathml import MathMLPresentationPrinter

    class Printer(MathMLPresentationPrinter):
        def _print_Symbol(self, sym: sympy.Symbol, style: str = "plain") -> Element:
            """A name; a rate has a dot above."""
            plain: Any = super()._print_Symbol(sympy.Symbol(sym.name.removesuffix("'")), style)
            if not sym.name.endswith("'"):
                return plain
            dotted = self.dom.createElement("mover")
            dot = self.dom.createElement("mo")
            dot.appendChild(self.dom.createTextNode("\u02d9"))
            dotted.appendChild(plain)
            dotted.appendChild(dot)
            return dotted

        _print_Dummy = _print_Symbol
        _print_MatrixSymbol = _print_Symbol

    return Printer()
