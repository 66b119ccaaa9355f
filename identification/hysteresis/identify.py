"""Laws of hysteresis from loops: sliders by a convex fit, then laws that start from them, by exact derivatives.

from identification import identify_hysteresis
fit = identify_hysteresis(["damper.csv"])
print(fit.summary())
"""

import os
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from fmu_models.base.errors import StickslipError, refuse_unknown
from fmu_models.base.threads import one_blas_thread
from fmu_models.fmu.load import load as load_fmu
from identification.calibration.calibrate import calibrate
from identification.calibration.log import Reading
from identification.hysteresis.again import LOOP, TIMED_LOOP, loop_log
from identification.hysteresis.laws import CENTER, LAWS, MEDIAN, USUAL, LoopLaw, loop_model, loop_name
from identification.hysteresis.loop import LoopLog
from identification.hysteresis.read import checked, read_loop
from identification.hysteresis.result import FittedLaw, HysteresisFit, cycles_of
from identification.hysteresis.spectrum import SliderSpectrum, fit_lag, fit_sliders
from identification.hysteresis.verdicts import verdicts

ATTEMPTS = 4  # of a law whose first values are guesses
Loop = LoopLog | str | os.PathLike[str]


@one_blas_thread()
def identify_hysteresis(
    logs: Loop | Sequence[Loop],
    *,
    laws: Sequence[str] = USUAL,
    factors: Sequence[str] = (),
    held_out: Sequence[Loop] = (),
    rate: bool | None = None,
    lag: float | None = None,
    columns: Mapping[str, str] | None = None,
    units: Mapping[str, str] | None = None,
    reader: str | None = None,
    progress: Callable[[float], None] = lambda done: None,
) -> HysteresisFit:
    """Sliders and laws of the force of logs over their way.

    Args:
        logs: files, or logs as `read.read_loop` reads them.
        laws: names of `laws.LAWS`; none for the sliders alone.
        factors: what the sliders grow with: conditions, such as a current in A from the names of files, or columns,
            such as a voltage.
        held_out: logs that only score.
        rate: whether the force may depend on the speed too; where None, as all logs have times.
        lag: s, with which sliders follow columns that are factors, as a first-order lag; fitted where None.
        columns, units, reader: as in `read.read_loop`.
        progress: called with the fraction done.

    Raises:
        StickslipError: as in `read.read_loop` and `spectrum.fit_sliders`, or an unknown law.
    """
    for name in laws:
        refuse_unknown(name, LAWS, f"There is no law '{name}' of loops.")
    listed = [logs] if isinstance(logs, LoopLog | str | os.PathLike) else list(logs)
    read, others = (
        [_ready(item, columns=columns, units=units, reader=reader, signals=factors) for item in group]
        for group in (listed, held_out)
    )
    said: list[str] = []
    if any(name in log.signals for log in read for name in factors):
        if lag is None:
            lag, left, without = fit_lag(read, factors=factors, rate=rate)
            said.append(
                f"The sliders follow {', '.join(factors)} with a lag of {lag:.3g} s: {left:.3g} N are left, "
                f"{without:.3g} N without a lag."
            )
        read, others = ([log.lagged(lag) for log in group] for group in (read, others))
    spectrum = fit_sliders(read, factors=factors, rate=rate)
    progress(0.2)
    load = float(np.median(np.abs(read[0].load))) if read[0].load is not None else None
    reading = Reading(columns or {}, roles=TIMED_LOOP if spectrum.rate else LOOP, units=units or {})
    fitted: list[FittedLaw] = []
    varied = bool(factors)
    for number, name in enumerate(() if varied else laws):
        fitted.append(_fitted(LAWS[name], read, others, spectrum, load, reading))
        progress(0.2 + 0.8 * (number + 1) / len(laws))
    notes = [note for log in (*read, *others) for note in log.notes]
    least = {log.name: min((law.left[log.name] for law in fitted if not law.why), default=np.inf) for log in read}
    return HysteresisFit(
        logs=tuple(read),
        held_out=tuple(others),
        spectrum=spectrum,
        left={log.name: spectrum.left(log) for log in read},
        left_out={log.name: spectrum.left(log) for log in others},
        cycles=tuple(cycle for log in read for cycle in cycles_of(log)),
        laws=tuple(sorted(fitted, key=lambda law: law.worst)),
        load=load,
        lag=lag,
        notes=(*notes, *said, *verdicts(read, spectrum, varied, least)),
    )


def _ready(source: Loop, **how: Any) -> LoopLog:
    log = checked(source) if isinstance(source, LoopLog) else read_loop(os.fspath(source), **how)
    return log.smooth().from_largest()


def _fitted(
    law: LoopLaw,
    logs: Sequence[LoopLog],
    others: Sequence[LoopLog],
    spectrum: SliderSpectrum,
    load: float | None,
    reading: Reading,
) -> FittedLaw:
    """A law by least squares from the sliders' first values."""
    if law.timed and not spectrum.rate:
        return FittedLaw(law.name, why="it depends on the speed, and not all logs have times")
    scale, center = load or 1.0, logs[0].center
    per_load = replace(spectrum, stiffness=spectrum.stiffness * scale)
    if per_load.sliding_force() <= 0:
        return FittedLaw(law.name, why="nothing gives way within the loops")
    fmu = load_fmu(loop_model(law, rate=spectrum.rate))
    damping = {"damping": float(spectrum.viscous[0]) * scale} if spectrum.rate else {}
    middle = spectrum.offset + spectrum.spring * center
    first = {**law.first(per_load), "spring": spectrum.spring_beside(), "offset": middle, **damping}
    force, stiffness = per_load.sliding_force(), per_load.stiffness_at_rest()
    either = {"spring": 10 * stiffness, "offset": 10 * force, "damping": 1e3 * abs(damping.get("damping", 0.0)) + force}
    bounds = {name: (-limit, limit) for name, limit in either.items() if name in first} | law.bounds(per_load)
    states = [name for name in fmu.states if not name.startswith("rest")]
    seen, scored = ([loop_log(log, spectrum.rate, states) for log in group] for group in (logs, others))
    start = dict.fromkeys(fmu.states, 0.0)
    # full sliders are known by parameters that are sought themselves: how full they are is sought beside them
    sought = states if any(log.turned or not log.known for log in logs) else []
    if all(log.turned for log in logs):
        side = np.sign(logs[0].way[0] - center)
        start |= {name: side * value for name, value in law.saturated(first, spectrum.reach).items()}
    try:
        with warnings.catch_warnings(
            action="ignore", category=UserWarning
        ):  # of guesses; the law's notes say it of the fit
            calibration = calibrate(
                fmu,
                seen,
                free=list(first),
                parameters={**start, **first, CENTER: center, MEDIAN: scale},
                starts=sought,
                bounds=bounds,
                held_out=scored,
                guesses=law.guesses,
                attempts=min(law.guesses, ATTEMPTS),
                segments=1,
            )
    except StickslipError as error:
        return FittedLaw(law.name, why=str(error))
    # named for who opens the result; built once
    declaration = f"identification.hysteresis.models:{loop_name(law, spectrum.rate)}"
    calibration = replace(calibration, reading=reading, declaration=declaration)
    left: dict[bool, dict[str, float]] = {True: {}, False: {}}
    for line in calibration.residuals:
        left[line.held_out][line.log] = float(line.share or 0.0)
    return FittedLaw(
        law.name,
        tuple(calibration.parameters),
        left[False],
        left[True],
        tuple((*calibration.directions, *calibration.warnings)),
        calibration=calibration,
    )
