"""Command that shows what a model is made of."""

from fmu_models.base import console
from fmu_models.commands.arguments import Model


def show(model: Model, contacts: console.Contacts = None, json: console.Json = False) -> None:
    """Show a model: equations, parameters with units, contacts, outputs, source.

    Example: stickslip show disc_rig --contacts disc0
    """
    from fmu_models.codegen.package import variant
    from fmu_models.report.model_sheet import print_sheet, sheet

    mechanism = variant(model, console.chosen(contacts))
    content = sheet(mechanism)
    console.say(json, content, lambda out: print_sheet(content, out))
