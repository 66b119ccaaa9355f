"""Command that shows the whole road once."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fmu_models.base import console
from fmu_models.base.files import refuse_existing
from identification.commands.fits import decay_of, draw_families, draw_friction, fit_logs, print_fit, write_text


def demo(
    folder: Annotated[Path, typer.Argument(metavar="FOLDER", help="New folder for everything made.")],
    seed: Annotated[int, typer.Option(help="Of the emulated bench.", min=0)] = 1,
    overwrite: console.Overwrite = False,
    json: console.Json = False,
) -> None:
    """The whole road once: emulate a rig, fit its friction, compare with it, report, export the fitted model.

    Example: stickslip demo first_look
    """
    from fmu_models.codegen.package import export
    from identification.fit.samples import samples_by_disc
    from identification.fitted_model.model import fmu_parameters
    from identification.model_check.families import compare_families
    from identification.model_check.table import comparison_report
    from identification.report.page import write_report
    from identification.report.rig_page import RigFindings
    from rig_io.bench.emulator import emulate_set, standard_set
    from rig_io.packages.datapackage import read_package

    refuse_existing(folder, overwrite=overwrite)
    targets = {
        "logs": folder / "logs",
        "fit": folder / "fit.json",
        "friction": folder / "friction.png",
        "family": folder / "family.png",
        "report": folder / "report.html",
        "fmu": folder / "disc_rig_fitted.fmu",
    }
    with console.progress("demo") as advance:
        emulate_set(targets["logs"], standard_set(), seed, overwrite=overwrite)
        advance(0.3)
        logs = read_package(targets["logs"])
        decay = decay_of(logs)
        ready, found = fit_logs(logs, decay)
        write_text(targets["fit"], found.to_json(), overwrite)
        if found.interrupted:
            raise KeyboardInterrupt
        advance(0.5)
        draw_friction(found, ready, targets["friction"], overwrite)
        families = compare_families(found, logs)
        draw_families(families, targets["family"], overwrite)
        advance(0.7)
        findings = RigFindings(found, logs, families, decay, samples_by_disc(found, ready))
        write_report(findings, targets["report"], overwrite=overwrite)
        advance(0.9)
        values = fmu_parameters(found)
        export("disc_rig", targets["fmu"], contacts=found.contacts, values=values, overwrite=overwrite)
    truth = next(log for log in logs if log.kind != "free-decay").experiment.emulation
    content = {
        "files": {name: str(path) for name, path in targets.items()},
        "fit": found.to_dict(),
        "truth": dict(truth),
        "families": [family.to_dict() for family in families],
    }

    def show(out: console.Console) -> None:
        print_fit(decay, found, [], out)
        out.print(comparison_report(families))
        out.print("\nLook at")
        out.print(f"  {targets['friction']}   friction against slip speed, with the fitted law")
        out.print(f"  {targets['family']}     measured and modelled phase portraits, stick, and where it ends")
        out.print(f"  {targets['report']}    all of it on one page, for a browser")
        out.print(f"  {targets['fmu']}  the fitted rig for other tools")
        out.print(f"  {targets['logs']}/datapackage.json  what the logs hold, and the truth behind them")

    console.say(json, content, show)
