"""What `stickslip inverse RECIPE LOG` does, for tests: least squares with the recipe's own filters."""

import os
from collections.abc import Sequence
from typing import Any

from identification.machines.by_recipe import recipe_machine
from identification.machines.identify import METHODS
from identification.machines.inverse import identify_machine
from identification.machines.machine_fit import MachineFit
from identification.measurement.recipe import Recipe

Log = str | os.PathLike[str]


def inverse_dynamics(recipe: Recipe, logs: Log | Sequence[Log], held_out: Sequence[Log] = (), **how: Any) -> MachineFit:
    """A recipe's terms in a log or several, judged, with the friction laws that it names; how: ``parameters``."""
    machine = recipe_machine(recipe)
    paths = [logs] if isinstance(logs, str | os.PathLike) else list(logs)
    seen, others = machine.logs(paths), machine.logs(held_out)
    known = machine.known(None)
    fit = identify_machine(machine.mechanism, seen, known=known, cutoff=None, method=METHODS[1], held_out=others, **how)
    return machine.compared(fit, seen)
