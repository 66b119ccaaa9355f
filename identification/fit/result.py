"""What an estimator returns: one type for all of them, which says what it assumed.

Three kinds of uncertainty are kept apart: ``standard_deviation`` is what noise and instruments leave open in the logs;
``scale_deviation`` is what the constants of the rig (J, k, c, N, R, r), known only so well, pass on to the parameters;
``law_deviation`` is their spread over laws that the logs cannot tell apart, where these were asked. An interval holds
them all. Where nobody says how well a constant is known that moves a parameter, the interval is "at
least" so wide.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fmu_models.base.errors import StickslipError, named
from fmu_models.base.files import existing
from fmu_models.base.plain_values import from_plain
from fmu_models.base.shown import Moving
from fmu_models.base.trust import admit
from identification.estimators.releases import Breakaway
from identification.fit.parts import (
    AT_LEAST,
    Cause,
    Constant,
    FittedParameter,
    LogSummary,
    RivalLaw,
    SpeedBin,
    StatedConstant,
)
from identification.free_friction.result import FreeFriction
from identification.inference.defaults import COVARIANCE
from identification.inference.identifiability import Collinearity
from identification.inference.lmfit_exchange import Given, Solved
from identification.inference.posterior import Posterior
from identification.inference.problem import identifier
from identification.inference.profile import Interval
from identification.inference.uncertainty import Joint, student
from identification.inference.whiteness import Whiteness
from identification.measurement.presliding import PreSliding
from rig_io.logs.log import RigLog

if TYPE_CHECKING:
    import pandas
    from lmfit import Minimizer

VERSION = 5  # of the format of a fit
LEVEL = 0.95  # of intervals
MOVED = 1e-3  # d ln(parameter) / d ln(constant) below which a constant does not move a parameter
NAMES = {  # in JSON, as the tables have them
    "standard_deviation": "sd_noise",
    "plain_deviation": "sd_white",
    "scale_deviation": "sd_rig_constants",
    "law_deviation": "sd_law",
    "bound": "sd_bound",
    "description": "meaning",
    "standard_uncertainty": "sd",
    "source": "from",
}
LISTED = ("parameters", "nuisance", "plain", "constants")  # whose members have these
WRITTEN = ("low", "high", "at_least")  # of each parameter in JSON, for people: they follow from the rest


@dataclass(frozen=True)
class FrictionFit(Moving):
    """Fitted friction law of one driving disc, or of two: then parameters are named after their disc (mu_s0, mu_s1),
    and the angle at which contact changes, if there is one, is the last of them (theta_s, alpha).

    contacts: the driving discs, in the order of materials; structure: what was assumed; correlation: of the parameters,
    in their order, from noise; rms_residual: in ``residual_unit``, of the friction coefficient (1) or of the measured
    motion; autocorrelation: of successive residuals (0: white); sensors: corrections of the laser by the encoder, and
    ``temperature``, K, the mean of the logs, where they record it; nuisance: what else was estimated, with what was
    known of it; covariance: how the standard deviations were found;
    intervals: by profile likelihood or bootstrap, where asked for; collinearity: whether the parameters can be told
    apart; whiteness: tests of the residuals; presliding: stiffness of the contact in stick, where the logs show one;
    breakaway: where the sticks of one driving disc let go, and whether that ages;
    constants_correlation: of the constants, in their order; contradictions: stated constants that contradict others;
    declaration: file or module of a law that is none of ours; causes: disturbances of friction that were estimated
    beside the law; plain: the parameters without them, with constants as stated, empty where there are none; rivals:
    laws that were asked beside that of the fit, itself among them, empty where none were; posterior: where it was
    sampled; free: friction over slip speed without any law, where the slips of one disc tell it.
    solved: the problem behind it, None in a fit that was read back; recorded: its logs, beside which a notebook shows
    the model live; no file keeps them.
    """

    estimator: str
    law: str
    structure: tuple[str, ...]
    contacts: tuple[str, ...]
    materials: tuple[str, ...]
    parameters: tuple[FittedParameter, ...]
    correlation: tuple[tuple[float, ...], ...]
    constants: tuple[Constant, ...]
    logs: tuple[LogSummary, ...]
    bins: tuple[SpeedBin, ...]
    sensors: Mapping[str, float]
    segments: int
    values: int
    rms_residual: float
    autocorrelation: float
    converged: bool
    message: str
    warnings: tuple[str, ...]
    residual_unit: str = "1"
    nuisance: tuple[FittedParameter, ...] = ()
    covariance: str = COVARIANCE
    intervals: tuple[Interval, ...] = ()
    collinearity: Collinearity | None = None
    whiteness: Whiteness | None = None
    presliding: PreSliding | None = None
    breakaway: Breakaway | None = None
    declaration: str = ""
    causes: tuple[Cause, ...] = ()
    plain: tuple[FittedParameter, ...] = ()
    constants_correlation: tuple[tuple[float, ...], ...] = ()
    contradictions: tuple[StatedConstant, ...] = ()
    rivals: tuple[RivalLaw, ...] = ()
    posterior: Posterior | None = None
    free: FreeFriction | None = None
    solved: Solved | None = field(default=None, repr=False, compare=False)
    recorded: tuple[RigLog, ...] = field(default=(), repr=False, compare=False)

    @property
    def frame(self) -> pandas.DataFrame:
        """A row for each parameter: value, 95 % interval, standard deviations, bound of Cramer and Rao."""
        import pandas

        rows = [
            {
                "value": parameter.value,
                "unit": parameter.unit,
                **dict(zip(WRITTEN, (*self.interval(parameter.name), self.at_least(parameter.name)), strict=True)),
                "sd_noise": parameter.standard_deviation,
                "sd_rig_constants": parameter.scale_deviation,
                "sd_law": parameter.law_deviation,
                "sd_bound": parameter.bound,
                "efficiency": parameter.efficiency,
                "at_bound": parameter.at_bound,
            }
            for parameter in self.parameters
        ]
        return pandas.DataFrame(
            rows, index=pandas.Index([parameter.name for parameter in self.parameters], name="parameter")
        )

    def _heading(self) -> str:
        where = " and ".join(self.contacts) + (f", {' and '.join(self.materials)}" if self.materials else "")
        return (
            f"FrictionFit: {self.law} law of {where} ({self.estimator}, {self.segments} slips of {len(self.logs)} logs)"
        )

    def _contents(self) -> Mapping[str, Any]:
        contents = {
            parameter.name: f"{parameter.value:.6g} +- "
            f"{self.words_at_least(parameter.name)}{parameter.total_deviation:.2g}"
            + ("" if parameter.unit == "1" else f" {parameter.unit}")
            for parameter in self.parameters
        }
        return contents | ({"warnings": f"{len(self.warnings)}, see summary()"} if self.warnings else {})

    def __getitem__(self, name: str) -> FittedParameter:
        """A parameter by name. StickslipError: the law has no such parameter."""
        return named(self.parameters, name, f"The law '{self.law}' has no parameter '{name}'.")

    def constant(self, name: str) -> Constant:
        """A constant by name; errors as in `__getitem__`."""
        return named(self.constants, name, f"The fit took no constant '{name}'.")

    @property
    def correlation_of_constants(self) -> np.ndarray:
        """Correlation (n, n) of the constants, in their order; they are independent where nothing is stated."""
        return np.array(self.constants_correlation) if self.constants_correlation else np.eye(len(self.constants))

    @property
    def joint(self) -> Joint:
        """Parameters, then constants of the rig that are not 0, with their covariance: from noise, from the constants,
        and, each by itself, from the choice of the law."""
        kept = [i for i, constant in enumerate(self.constants) if constant.value]
        constants = [self.constants[i] for i in kept]
        noise, law, sd = (
            np.array([float(getattr(one, name) or 0.0) for one in of])
            for of, name in (
                (self.parameters, "standard_deviation"),
                (self.parameters, "law_deviation"),
                (constants, "standard_uncertainty"),
            )
        )
        of_constants = self.correlation_of_constants[np.ix_(kept, kept)] * np.outer(sd, sd)
        slopes = [[q.value * (c.sensitivity.get(q.name) or 0.0) / c.value for c in constants] for q in self.parameters]
        moves = np.vstack([np.reshape(slopes, (len(self.parameters), len(constants))), np.eye(len(constants))])
        covariance = moves @ of_constants @ moves.T
        own = slice(len(self.parameters))
        covariance[own, own] += np.array(self.correlation) * np.outer(noise, noise) + np.diag(law**2)
        return Joint.of([*self.parameters, *constants], covariance)

    @property
    def interrupted(self) -> bool:
        """Whether an interrupt (Ctrl-C) ended the work on it early; the warnings say what is missing."""
        return any(warning.startswith(("Interrupted", "The bootstrap was stopped")) for warning in self.warnings)

    @property
    def law_reference(self) -> str:
        """The name or file by which `identification.laws.find_law` finds the law."""
        return self.declaration or self.law

    @property
    def law_values(self) -> np.ndarray:
        """Values (m,) of the parameters, in order."""
        return np.array([parameter.value for parameter in self.parameters])

    @property
    def given(self) -> Given:
        """Bounds of the search and values held, as they were given to the fit."""
        bounds = {identifier(q.name): _ends(q.minimum, q.maximum) for q in self.parameters if not q.held}
        return Given(bounds=bounds, held={identifier(q.name): q.value for q in self.parameters if q.held})

    def to_lmfit(self) -> tuple[Minimizer, Any]:
        """The fit as lmfit has it, to go on with: see `inference.lmfit_exchange`.

        Raises:
            StickslipError: it was read from a file, which holds no logs.
        """
        if self.solved is None:
            raise StickslipError("This fit was read from a file, which holds no logs. Fit the logs again for lmfit.")
        return self.solved.to_lmfit()

    def interval(self, name: str, level: float = LEVEL) -> tuple[float, float]:
        """Confidence interval of a parameter, from noise, from the constants of the rig and, where other laws were
        asked, from the choice of the law; infinite where a profile finds an end open."""
        value, reach = self[name].value, self._reach(level) * self[name].given_deviation
        low, high = self.noise_interval(name, level)
        return value - float(np.hypot(value - low, reach)), value + float(np.hypot(high - value, reach))

    def noise_interval(self, name: str, level: float = LEVEL) -> tuple[float, float]:
        """Interval from noise alone: by profile or bootstrap where there is one of this level, else Student's t, one
        degree of freedom for each slip segment to spare."""
        for interval in self.intervals:
            if interval.name == name and interval.level == level:
                return interval.ends
        reach = self._reach(level) * self[name].standard_deviation
        return self[name].value - reach, self[name].value + reach

    def _reach(self, level: float) -> float:
        return student(self.segments - len(self.parameters), level)

    def unstated(self, name: str) -> tuple[str, ...]:
        """Constants that move a parameter and of which nobody says how well they are known."""
        return tuple(
            constant.name
            for constant in self.constants
            if not constant.stated and abs(constant.sensitivity.get(name) or 0) > MOVED
        )

    def at_least(self, name: str) -> bool:
        """Whether the interval of a parameter lacks a part of unknown size."""
        return bool(self.unstated(name))

    def words_at_least(self, name: str) -> str:
        """What is said before the interval of a parameter."""
        return AT_LEAST if self.at_least(name) else ""

    @property
    def words_of_law(self) -> str:
        """What is said of the choice of the law."""
        if not self.rivals:
            return "What another law would make of these logs was not asked: `stickslip laws` does."
        others = [f"{rival.law} (weight {rival.weight:.2f})" for rival in self.rivals if rival.law != self.law]
        if not others:
            return "No other law is within reach of these logs."
        return f"The intervals hold the spread over laws: {self.law} and {', '.join(others)}."

    def to_dict(self) -> dict[str, Any]:
        """Plain values only; the inverse of `from_dict`. An open end of an interval is null."""
        sampled = None if self.posterior is None else replace(self.posterior, samples=None)
        plain = asdict(replace(self, solved=None, recorded=(), posterior=sampled))
        del plain["solved"], plain["recorded"]
        if sampled is not None:
            del plain["posterior"]["samples"]
        for entry in plain["parameters"]:
            ends = (end if np.isfinite(end) else None for end in self.interval(entry["name"]))
            first = {key: entry.pop(key) for key in ("name", "value", "unit")}
            first |= dict(zip(WRITTEN, (*ends, self.at_least(first["name"])), strict=True))
            entry |= {**first, **{key: entry.pop(key) for key in tuple(entry)}}
        plain |= {key: [_renamed(entry, NAMES) for entry in plain[key]] for key in LISTED}
        return {"type": "stickslip friction fit", "version": VERSION, **plain}

    def to_json(self) -> str:
        """The result as JSON text; the inverse of `from_json`."""
        return json.dumps(self.to_dict(), indent=2)

    @staticmethod
    def from_json(text: str, *, trust: bool = False) -> FrictionFit:
        """A result read back; trust: Python files that it names, of a law or an estimator, may run.

        Raises:
            StickslipError: the text is not a fit written by `to_json`, or names code that is not trusted.
        """
        try:
            return FrictionFit.from_dict(json.loads(text), trust=trust)
        except (json.JSONDecodeError, RecursionError) as error:
            raise StickslipError(f"This is not JSON ({error}). Give a result written by `stickslip fit`.") from error

    @staticmethod
    def from_dict(plain: object, *, trust: bool = False) -> FrictionFit:
        """As `from_json`, from plain values."""
        if not isinstance(plain, dict) or plain.get("type") != "stickslip friction fit":
            raise StickslipError('This is not a fitted law: it lacks "type": "stickslip friction fit".')
        if plain.get("version") != VERSION:
            raise StickslipError(
                f"The fit has format version {plain.get('version')}; this program reads version {VERSION}. Fit again."
            )
        values = {key: value for key, value in plain.items() if key not in ("type", "version", "solved", "recorded")}
        if isinstance(values.get("parameters"), list):
            values["parameters"] = [_without_written(entry) for entry in values["parameters"]]
        originals = {written: name for name, written in NAMES.items()}
        for key in LISTED:
            if isinstance(values.get(key), list):
                values[key] = [_renamed(entry, originals) for entry in values[key]]
        fit = from_plain(FrictionFit, values, "The fitted law")
        for reference in (fit.law_reference, fit.estimator, *(cause.name for cause in fit.causes)):
            admit(reference, Path(), trust=trust)
        n = len(fit.parameters)
        if [len(row) for row in fit.correlation] != [n] * n:
            raise StickslipError(f"The fitted law has {n} parameters, but no correlation of {n} by {n}. Fit again.")
        if len(fit.materials) not in (0, len(fit.contacts)):
            raise StickslipError("The fitted law names contacts and materials of different number. Fit again.")
        return fit


def _ends(low: float | None, high: float | None) -> tuple[float, float]:
    """Ends of a range, infinite where it is open."""
    return -np.inf if low is None else low, np.inf if high is None else high


def _renamed(entry: object, names: Mapping[str, str]) -> object:
    """A member of a list with other names of its fields."""
    return {names.get(key, key): value for key, value in entry.items()} if isinstance(entry, dict) else entry


def _without_written(parameter: object) -> object:
    """A parameter as it is kept: what is written beside it follows from the rest."""
    if not isinstance(parameter, dict):
        return parameter
    return {key: value for key, value in parameter.items() if key not in WRITTEN}


def read_fit(path: str | os.PathLike[str], *, trust: bool = False) -> FrictionFit:
    """A result of 'stickslip fit --result', or of `FrictionFit.to_json` in a file; trust: as in `from_json`.

    Raises:
        StickslipError: there is none, it cannot be read, or it names code that is not trusted.
    """
    file = existing(path, "fit", " Make one: stickslip fit LOGS --result FILE.json")
    try:
        return FrictionFit.from_json(file.read_text(encoding="utf-8"), trust=trust)
    except (OSError, UnicodeDecodeError) as error:
        raise StickslipError(
            f"'{path}' cannot be read ({error}). Give a result of 'stickslip fit --result'."
        ) from error
    except StickslipError as error:
        raise StickslipError(f"'{path}': {error}") from error
