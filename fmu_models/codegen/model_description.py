"""The XML files of an FMU, filled from templates: modelDescription.xml (FMI 2.0 and 3.0) and those beside it."""

from typing import Any

from fmu_models.base.printable import printable
from fmu_models.codegen.c_structures import declarations
from fmu_models.codegen.model_structure import ModelStructure
from fmu_models.codegen.rights import Rights

# as in engine/fmi/instance.c
LOG_CATEGORIES = {
    "logStatusError": "why a call was refused",
    "logStatusWarning": "what was asked for and is not done as it was asked",
    "logEvents": "every change of the state of a contact, and every impact",
}


def render(template: str, **values: Any) -> str:
    """Fill one of the templates beside this module; values are escaped for XML, which knows no control characters."""
    import jinja2

    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("fmu_models.codegen"),
        autoescape=True,
        finalize=lambda value: printable(value) if type(value) is str else value,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        undefined=jinja2.StrictUndefined,
    )
    return environment.get_template(template).render(**values)


def model_description(structure: ModelStructure, token: str, fmi_version: str, tool: str, rights: Rights) -> str:
    """Text of modelDescription.xml; token as in the compiled model, tool the program that writes it."""
    values: dict[str, Any] = {"structure": structure, "variables": structure.variables, "system": structure.system}
    values |= {"token": token, "tool": tool, "rights": rights.attributes}
    limits = declarations("engine/fmi/variables.h").constants("Most", "MOST_")
    order = limits.OUTPUT_ORDER if fmi_version == "2.0" else structure.output_order(limits.OUTPUT_ORDER)
    values |= {"log_categories": LOG_CATEGORIES, "output_order": order}
    return render(f"fmi{fmi_version[0]}.xml.j2", **values)
