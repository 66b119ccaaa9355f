"""Command that shows what a model or a system of FMUs is made of."""

import json as texts
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from fmu_models.base import console
from fmu_models.base.errors import StickslipError
from fmu_models.base.files import sealed_text
from fmu_models.commands.arguments import Model


def show(model: Model, contacts: console.Contacts = None, json: console.Json = False) -> None:
    """Show a model: equations, parameters with units, contacts, outputs, source. Draw a system of FMUs (.ssp, .ssd):
    boxes, connectors, units.

    Example: stickslip show disc_rig --contacts disc0
    """
    if model.lower().endswith((".ssp", ".ssd")):
        from fmu_models.coupling.toml_system import read_system
        from fmu_models.report import system_sheet

        if contacts is not None:
            raise StickslipError(f"'{model}' is a system: its FMUs are as they are. Leave --contacts out.")
        with console.warnings_said():
            drawing = system_sheet.sheet(read_system(model))
        console.say(json, drawing, lambda out: system_sheet.print_drawing(drawing, out))
        return
    from fmu_models.codegen.package import kept_by_name, kept_folder
    from fmu_models.report.printed_sheet import print_sheet

    chosen = console.chosen(contacts)
    if kept_by_name(model):
        source = Path(__file__).parents[1] / "report" / "model_sheet.py"
        folder = kept_folder("sheet", model, repr(chosen), source.read_bytes())
        content = texts.loads(sealed_text(folder / "sheet.json", lambda: texts.dumps(_sheet(model, chosen))))
    else:
        content = _sheet(model, chosen)
    console.say(json, content, lambda out: print_sheet(content, out))


def _sheet(model: str, contacts: Sequence[str] | None) -> dict[str, Any]:
    from fmu_models.codegen.package import variant
    from fmu_models.report.model_sheet import sheet  # brings SymPy, which what is kept does not need

    return sheet(variant(model, contacts))
