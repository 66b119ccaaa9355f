"""What logs say of a declared machine: base parameters, how sure, how well they predict, and what to think of them."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from fmu_models.base.digits import value_with_sd
from fmu_models.base.errors import StickslipError, named
from fmu_models.base.files import existing
from fmu_models.base.plain_values import from_plain
from fmu_models.base.record import Recorded
from fmu_models.base.shown import Pictured
from identification.inference.comparison import LawComparison
from identification.machines.identify import Identified
from identification.machines.motion import Conditions
from identification.machines.scores import JointScore

if TYPE_CHECKING:
    from lmfit import Minimizer


@dataclass(frozen=True)
class MachineParameter:
    """A base parameter. combination: what it stands for; standard_deviation: the larger of Newey-West's and the
    jackknife's over logs, 0 of one that was held; white_deviation: as if residuals were white, as publications have it;
    least_squares: value by that, with its own deviation; shift: from there to ``value``, in deviations (0 where least
    squares was asked for)."""

    name: str
    combination: str
    meaning: str
    value: float
    unit: str
    standard_deviation: float
    white_deviation: float
    least_squares: float
    least_squares_deviation: float
    shift: float
    frictional: bool

    @property
    def factor(self) -> float:
        """The factor by which the white standard deviation is too small."""
        return self.standard_deviation / self.white_deviation if self.white_deviation > 0 else 1.0


@dataclass(frozen=True)
class MachineFit(Pictured, Recorded):
    """Base parameters of a machine. known: parameters that were taken as given; silent: monomials that no effort shows;
    cutoff, parallel_cutoff: Hz, None where logs were filtered as their recipe says; condition: of the weighted columns,
    each scaled to one; raw_condition: in the units of the parameters; neighbour_correlation: of the residuals;
    effective_samples: how many independent ones the samples are worth; rounds: of instruments; laws: of friction,
    compared, by joint, empty where that was not asked; verdicts: in words; declaration: where the machine is declared
    (empty: nowhere but in the program), read with ``gravity`` (m/s^2; empty: its own); still: as in
    `identify_machine`; columns: of its logs by name of a coordinate or effort, where they differ; conditions: under
    which friction is that of the parameters.
    identified: what is behind it, None in a fit that was read back."""

    COLUMNS = ("[name]=parameters.*",)

    machine: str
    title: str
    source: str
    method: str
    joints: tuple[JointScore, ...]
    parameters: tuple[MachineParameter, ...]
    known: Mapping[str, float]
    silent: tuple[str, ...]
    cutoff: float | None
    parallel_cutoff: float | None
    logs: tuple[str, ...]
    samples: int
    condition: float
    raw_condition: float
    neighbour_correlation: float
    effective_samples: float
    rounds: int
    verdicts: tuple[str, ...]
    laws: Mapping[str, LawComparison] = field(default_factory=dict)
    declaration: str = ""
    gravity: tuple[float, ...] = ()
    still: float = 0.0
    columns: Mapping[str, str] = field(default_factory=dict)
    conditions: Conditions = field(default_factory=Conditions)
    identified: Identified | None = field(default=None, repr=False, compare=False)

    def __getitem__(self, name: str) -> MachineParameter:
        """A base parameter by the name of its monomial. StickslipError: there is none."""
        return named(self.parameters, name, f"{self.machine} has no base parameter '{name}'.")

    def _heading(self) -> str:
        worst = max(self.joints, key=lambda joint: joint.seen.relative_error)
        error = f"relative error {100 * worst.seen.relative_error:.2f} %"
        return f"MachineFit: {self.title}, {len(self.parameters)} base parameters by {self.method}, {error}"

    def _contents(self) -> Mapping[str, Any]:
        return {
            parameter.name: value_with_sd(parameter.value, parameter.standard_deviation, parameter.unit)
            for parameter in self.parameters
        }

    def to_lmfit(self) -> tuple[Minimizer, Any]:
        """The fit as lmfit has it, to go on with: see `inference.lmfit_exchange`. StickslipError: it was read from a
        file, or is not one of least squares."""
        if self.identified is None:
            raise StickslipError("This fit was read from a file, which holds no logs. Fit the logs again for lmfit.")
        return self.identified.lmfit().to_lmfit()


def read_machine_fit(path: str | os.PathLike[str]) -> MachineFit:
    """A result of 'stickslip inverse MACHINE LOGS -o FILE.json'. StickslipError: there is none, or it is something
    else."""
    file = existing(path, "fit", " Make one: stickslip inverse MACHINE LOGS -o FILE.json")
    try:
        content = json.loads(file.read_text(encoding="utf-8"))
        for laws in content.get("laws", {}).values():
            for score in laws["scores"]:
                # deviations that there are not are no numbers, which JSON does not know
                score["deviations"] = {name: np.nan if sd is None else sd for name, sd in score["deviations"].items()}
        return from_plain(MachineFit, content, "it")
    except (OSError, ValueError, KeyError, TypeError, AttributeError, StickslipError) as error:
        raise StickslipError(
            f"'{path}' is no fit of a machine ({error}). Give a result of 'stickslip inverse MACHINE LOGS -o FILE'."
        ) from error
