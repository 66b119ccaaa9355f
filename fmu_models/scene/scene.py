"""What a scene says, checked and in SI units: plain values that need neither the model nor SymPy."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from fmu_models.base.plain_values import from_plain
from fmu_models.base.shown import Shown


@dataclass(frozen=True, kw_only=True)
class Drive(Shown):
    """An input over time: straight lines between knots. times: (n,) s; values: (n,) in the unit of the input; column:
    of the log that it is from, LOG:COLUMN."""

    times: tuple[float, ...]
    values: tuple[float, ...]
    column: str = ""

    @property
    def constant(self) -> float | None:
        """The value, if there is only one."""
        return self.values[0] if len(set(self.values)) == 1 else None


@dataclass(frozen=True, kw_only=True)
class Compute(Shown):
    """A computation of a scene.

    Attributes:
        kind: "trajectory": the run; "cycle": period, extremes and shares of stick of the motion it ends in; "strobe":
            the states once per period, and how many different ones are left at the end; "orbit": the periodic motion
            near the start, stable or not, and its multipliers; "lyapunov": the exponents of the motion that the run
            becomes; "spectrum": the lines of the periodic motion that it becomes; a family of motions: "diagram",
            "basins", "chart", "section", "branch"; or a kind of the user's own, see ``kinds``.
        samples: number of output times of a trajectory.
        over, values: a drive or free parameter, and the values it takes, one run for each.
        follow: each of these runs starts where the one before it ended.
        panels: another drive or free parameter and its values: all of it is computed at each, a panel of the picture.
        period: s, of a strobe or an orbit; None if ``forcing`` says it.
        forcing: the parameter that is the frequency of the forcing, in rad/s if ``angular``, else in cycles.
        periods: of the forcing in one period of the motion.
        autonomous: nothing forces the orbit, ``period`` is a guess.
        level: the section of a family is where this state crosses this value, upward unless ``down``.
        impacts: it is where this contact begins.
        returns: at the level, the state whose value alone is mapped to its next one.
        accept: contact states of a crossing that counts, by name.
        cap: s, after which a motion does not return.
        axes: of a family: states or parameters, and the values of each.
        settings: what the kind alone reads, and does not take at its default.
    """

    kind: str = "trajectory"
    samples: int = 2001
    over: str | None = None
    values: tuple[float, ...] = ()
    follow: bool = False
    panels: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    period: float | None = None
    forcing: str | None = None
    angular: bool = False
    periods: int = 1
    autonomous: bool = False
    level: Mapping[str, float] = field(default_factory=dict)
    down: bool = False
    impacts: str | None = None
    returns: str | None = None
    accept: Mapping[str, float] = field(default_factory=dict)
    cap: float = 1.0
    axes: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    settings: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class Reference(Shown):
    """Known values of what is computed, by name.

    Attributes:
        values: by the name of the result.
        tolerance: by which a result may differ, relative to the value, absolute where it is zero.
        at: value of the swept quantity, None if nothing is swept.
        panel: value of the quantity of the panels, None if there are none.
        source: who says so.
    """

    values: Mapping[str, float]
    tolerance: float = 1e-9
    at: float | None = None
    panel: float | None = None
    source: str = ""


@dataclass(frozen=True, kw_only=True)
class Scene(Shown):
    """A checked scene. All values are in the units of the model.

    Attributes:
        name: identifier, also of its FMU; that of the file.
        title, source: for people.
        model: name of the oscillator, or the user's own: a file or module, relative to the ``folder`` of the scene.
        contacts: those in use, in the order of the model; None for all.
        laws: per contact another law: a name, or the user's own as for ``model``.
        fixed: parameters, and inputs held at one value, that become constants of the code; those that the scene does
            not name have their defaults here.
        free: parameters that stay parameters, with their start values.
        drives: inputs that stay inputs.
        start: states, and speeds at which stops were entered, at time zero.
        outputs: names of the outputs to show.
        stop_time: s, end of the run; of a map its steps.
        of_map: The model is a map.
        units: of parameters and inputs.
        departs: constants that are others than the file says, and what it says.
        compute: what to compute.
        references: known values of it.
        sensors: for an emulator of a bench, which checks it; ``lines`` says in which line of ``path`` each key stands.
    """

    name: str
    title: str
    source: str
    model: str
    contacts: tuple[str, ...] | None
    laws: Mapping[str, str]
    fixed: Mapping[str, float]
    free: Mapping[str, float]
    drives: Mapping[str, Drive]
    start: Mapping[str, float]
    outputs: tuple[str, ...]
    stop_time: float
    compute: Compute = Compute()
    references: tuple[Reference, ...] = ()
    sensors: Mapping[str, Any] = field(default_factory=dict)
    lines: Mapping[str, int] = field(default_factory=dict)
    path: str = ""
    of_map: bool = False
    units: Mapping[str, str] = field(default_factory=dict)
    departs: Mapping[str, float] = field(default_factory=dict)

    @property
    def parameters(self) -> dict[str, float]:
        """Every value that the scene gives to a parameter or to an input it holds, fixed or free."""
        return {**self.fixed, **self.free}

    @property
    def varied(self) -> tuple[str, ...]:
        """Names of what the computation gives values of its own."""
        return tuple(name for name in (self.compute.over, *self.compute.axes, *self.compute.panels) if name)

    @property
    def constants(self) -> dict[str, float]:
        """Every value that stays throughout, of parameters and of inputs."""
        held = {name: drive.values[0] for name, drive in self.drives.items() if drive.constant is not None}
        values = {**self.parameters, **held}
        return {name: value for name, value in values.items() if name not in self.varied}

    @property
    def folder(self) -> Path:
        """Where the scene stands, which its relative paths start from."""
        return Path(self.path).parent

    def to_json(self) -> str:
        """The scene as text, from which ``from_json`` makes it again."""
        return json.dumps(dataclasses.asdict(self), indent=1)

    @classmethod
    def from_json(cls, text: str) -> Scene:
        """The scene that ``to_json`` wrote."""
        return from_plain(cls, json.loads(text), "The scene")
