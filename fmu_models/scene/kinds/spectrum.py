"""The lines in the spectrum of the periodic motion that the run becomes, of its first state.

Results: `line0`, `line1` and so on, of the first state, `mean_square`, `period`.
"""

from __future__ import annotations

from typing import Any

from fmu_models.analyses.attractors import claimed
from fmu_models.analyses.jobs import Jobs
from fmu_models.analyses.spectrum import line_spectrum
from fmu_models.base.errors import StickslipError
from fmu_models.fmu.fmu import Fmu
from fmu_models.scene.kinds.kind import Kind, Row, strobe_of
from fmu_models.scene.scene import Scene

LONGEST = 24  # period of the motion, in those of the strobe


def _spectrum(scene: Scene, fmu: Fmu, run: dict[str, Any]) -> Row:
    system, count = strobe_of(scene, fmu, run)
    start = system.start(run["start"])
    rows = system.make(Jobs(start[None], transient=count, rows=2 * LONGEST, longest=LONGEST), workers=1)
    (motion,) = claimed(system, rows, longest=LONGEST).motions
    if motion is None:
        said = rows.messages.get(0, f"after {count} periods it does not repeat itself within {LONGEST} more")
        raise StickslipError(
            f"The motion has no lines: {said}. Run longer, or ask 'stickslip spectrum' for its density."
        )
    found = line_spectrum(system, motion)
    lines = {f"line{k}": float(amplitude) for k, amplitude in enumerate(found.amplitude)}
    return Row(None, {"period": motion.time, "mean_square": found.mean_square, **lines}, family=found)


KIND = Kind(_spectrum, periodic=True)
