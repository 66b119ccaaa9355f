"""A host that dies of INVALID, DIVBYZERO and OVERFLOW: all that FMUs and importer offer, one model after the other.

    python trapped_host.py 3.0

Prints each model when it is through; traps are on in all of this process, in Python's own arithmetic too.
"""

import ctypes
import sys

import numpy as np
from careless_importer import Habits, Importer
from faces import face

from fmu_models import SensitiveRun, Strobe, oscillators, simulate, simulate_any
from fmu_models.codegen.package import built
from fmu_models.families.jobs import Jobs
from fmu_models.fmu.fmu import Fmu

INVALID, DIVBYZERO, OVERFLOW = 1, 4, 8  # of x86's <fenv.h>
END = 3.0


def whole_runs(fmu: Fmu) -> None:
    simulate(fmu, END)
    with SensitiveRun(fmu, by=fmu.parameters[:2]) as run:
        run.run(END)
    simulate_any(fmu, END)


def model_exchange(fmu: Fmu) -> None:
    Importer(fmu, Habits(rolls_back=True, probes=True)).run(1.0)
    with face(fmu, co_simulation=False) as instance:
        instance.initialize()
        instance.directional([f"der({name})" for name in fmu.states], fmu.states[0], 1.0)


def co_simulation(fmu: Fmu) -> None:
    with face(fmu) as instance:
        instance.initialize()
        state = instance.get_state()
        for i in range(100):
            instance.step(i * END / 100, END / 100)
            instance.get([*fmu.states, *fmu.outputs])
        instance.set_state(instance.deserialize(instance.serialize(state)))
        instance.step(0.0, END)


def lanes(fmu: Fmu) -> None:
    """Strobes of piecewise linear models, many motions at once."""
    forced = {"forcing": "omega"} if "omega" in fmu.parameters else {"period": 0.146, "autonomous": True}
    system = Strobe(fmu, **forced)  # type: ignore[arg-type]
    values = {fmu.parameters[0]: float(fmu.variables[fmu.parameters[0]].start) * np.linspace(1.0, 1.1, 16)}  # type: ignore[arg-type]
    system.run(Jobs(np.tile(system.start({}), (16, 1)), values, rows=3), np.zeros(1, np.int32))


def main(version: str) -> None:
    library = ctypes.CDLL("libm.so.6")
    opened = {name: Fmu.open(built(name, fmi_version=version)) for name in oscillators.names()}
    for fmu in opened.values():  # libraries and compiled masters are loaded without traps
        simulate_any(fmu, 1e-3)
    library.feclearexcept(INVALID | DIVBYZERO | OVERFLOW)
    library.feenableexcept(INVALID | DIVBYZERO | OVERFLOW)
    for name, fmu in opened.items():
        whole_runs(fmu)
        model_exchange(fmu)
        co_simulation(fmu)
        if name in ("discontinuous_support", "woodpecker"):
            lanes(fmu)
        assert library.fegetexcept() == INVALID | DIVBYZERO | OVERFLOW, name
        print(name, flush=True)


if __name__ == "__main__":
    main(sys.argv[1])
