"""Command that computes the spectrum of what a motion becomes."""

from __future__ import annotations

from typing import Annotated

import typer

from fmu_models.base import console
from fmu_models.commands import families as f
from fmu_models.commands.bundles import Without, bundled

LONGEST = 24  # period that is looked for
SAMPLES = 64  # of a period of the forcing, of a motion without one


@console.trusting
@bundled
def spectrum(
    section: Annotated[f.Section, Without("every", "autonomous", "level", "down", "impacts", "stepper")],
    *,
    variable: Annotated[str | None, typer.Option("--of", help="State or output. [default: the first state]")] = None,
    transient: Annotated[int, typer.Option(help="Periods before that.", min=0)] = 1000,
    lines: Annotated[int, typer.Option(help="Harmonics of the forcing, of a periodic motion.", min=1)] = 8,
    periods: Annotated[int, typer.Option(help="Periods of the forcing, of another motion.", min=32)] = 1024,
    files: f.StillFiles,
) -> None:
    """Compute the lines of a periodic motion, or the density of one that is not.

    Example: stickslip spectrum hinge_clearance --forcing f --set f=0.408 --figure lines.png
    """
    import numpy as np

    from fmu_models.analyses.attractors import claimed
    from fmu_models.analyses.fmu_sections import Strobe
    from fmu_models.analyses.jobs import Jobs
    from fmu_models.analyses.spectrum import density_spectrum, line_spectrum
    from fmu_models.base.errors import StickslipError

    files.check()
    system = section.system()
    if not isinstance(system, Strobe):
        raise StickslipError(f"'{section.model}' is a map, whose steps have no spectrum in Hz. Name an oscillator.")
    begin = system.start(section.starts())
    with console.progress("settling") as advance:
        rows = system.make(Jobs(begin[None], transient=transient, rows=2 * LONGEST, longest=LONGEST), progress=advance)
    motion = claimed(system, rows, longest=LONGEST).motions[0]
    if motion is not None:
        found = line_spectrum(system, motion, variable, lines=lines)
    else:
        if not rows.filled[0]:
            raise StickslipError(f"The motion ends before it is settled: {next(iter(rows.messages.values()), 'lost')}.")
        length = float(system.periods({}, 1)[0])
        times = np.arange(periods * SAMPLES, dtype=float) * (length / SAMPLES)
        found = density_spectrum(system.trajectory(rows.ends[0], times), variable)
    content = {
        "model": system.name,
        "of": found.of,
        "lines": found.lines,
        "period": found.period,
        "mean_square": found.mean_square,
        "frequency": found.frequency.tolist(),
        "amplitude": found.amplitude.tolist(),
        "low": found.low.tolist(),
        "high": found.high.tolist(),
    }
    files.tell(found, content)
