"""What an importer that lists outputs only finds, the motion and what was exposed: fmpy against our own engine."""

from __future__ import annotations

import re
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy.validation import validate_fmu

from fmu_models.base.errors import StickslipError
from fmu_models.codegen.package import export
from fmu_models.fmu.fmu import Fmu
from fmu_models.simulation.run import simulate


def outputs(fmu: Fmu) -> list[str]:
    return [name for name, v in fmu.variables.items() if v.causality == "output"]


@pytest.mark.parametrize("version", ["2.0", "3.0"])
def test_motion_and_what_is_exposed_come_out_in_fmpy(version: str, tmp_path: Path) -> None:
    more = ["der(omega)", "disc1_state", "disc1_indicator", "disc0_force"]
    path = export("disc_rig", tmp_path / "rig.fmu", expose=more, fmi_version=version)
    assert validate_fmu(str(path)) == []
    fmu = Fmu.open(path)
    assert set(outputs(fmu)) >= {"theta", "omega", *more}
    run = fmpy.simulate_fmu(str(path), stop_time=1.0, output_interval=0.1, fmi_type="CoSimulation")
    assert set(run.dtype.names or ()) == {"time", *outputs(fmu)}
    ours = simulate(fmu, 1.0, output_times=run["time"])
    for name in ("theta", "omega", "der(omega)", "disc1_state"):
        # fmpy adds up the steps of its time
        assert run[name] == pytest.approx(ours[name], rel=1e-9, abs=1e-10), name
    assert np.ptp(run["disc1_state"]) > 0
    assert (run["disc1_indicator"] > 0).all()  # positive inside the state it is of


def test_states_of_laws_and_of_systems_without_units_stay_inside() -> None:
    from fmu_models.codegen.package import built

    bristles = Fmu.open(built("disc_rig", laws={"disc0": "lugre"}))
    assert {"theta", "omega"} <= set(bristles.ports)
    inside = set(bristles.states) - {"theta", "omega"}
    assert inside and not inside & set(bristles.ports)


def test_what_cannot_be_exposed_is_named(tmp_path: Path) -> None:
    for name, words in (("der(omga)", "Did you mean 'der(omega)'?"), ("J", "Known are: ")):
        with pytest.raises(
            StickslipError, match=re.escape(f"There is no local '{name}' to expose.") + ".*" + re.escape(words)
        ):
            export("disc_rig", tmp_path / "rig.fmu", expose=[name])
