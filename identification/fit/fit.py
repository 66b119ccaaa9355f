"""From pooled logs to the fit of a friction law, by an estimator that is chosen by name."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from fmu_models.base.errors import StickslipError, refuse_unknown
from fmu_models.base.threads import one_blas_thread
from identification.disturbances.term import DisturbanceTerm
from identification.disturbances.terms import measured, ranked, terms_of
from identification.estimators import ESTIMATORS
from identification.estimators.base import Estimate, Estimator, Options
from identification.fit.adjust import Adjusted, ContradictedRadii, adjust, as_stated, contradicted
from identification.fit.causes import asked_for, causes_named, causes_of, judged, radii_of, terms_found
from identification.fit.conclude import conclude
from identification.fit.followed import followed
from identification.fit.free import fit_free
from identification.fit.law_spread import MODES, by_curve, with_spread
from identification.fit.parts import Cause
from identification.fit.result import FrictionFit
from identification.fit.stages import Stages, by_evaluations
from identification.free_friction.contest import Verdict
from identification.free_friction.curve import OFF
from identification.inference.choice import Inference
from identification.inference.defaults import DISTURBANCES, ESTIMATOR, LAW, LAW_SPREAD, NONE
from identification.inference.lmfit_exchange import given
from identification.laws import FittableLaw, bristled, find_law
from identification.laws.joint_law import sought_law
from identification.measurement.pooled import Pool
from identification.measurement.pooling import pool
from rig_io.logs.log import RigLog

if TYPE_CHECKING:
    from lmfit import Parameters

SENSORS = ("gain", "delay")  # nuisance parameters that an estimator takes up by itself
DEFAULT_OPTIONS = Options()
DEFAULT_INFERENCE = Inference()
WEAK = "weak-form"  # the estimator that runs no model
WORSE = 1e-3  # relative: residuals larger than those of what is nested, beyond what cutting slips anew changes


@one_blas_thread()
def fit_friction(
    logs: Sequence[RigLog] | Pool,
    *,
    estimator: str = ESTIMATOR,
    law: str = LAW,
    options: Options = DEFAULT_OPTIONS,
    disturbances: str | Sequence[str] = DISTURBANCES,
    law_spread: str = LAW_SPREAD,
    parameters: Parameters | None = None,
    inference: Inference = DEFAULT_INFERENCE,
    progress: Callable[[float], None] | None = None,
) -> FrictionFit:
    """Friction law from stick-slip logs of one rig, all pooled.

    logs: stick-slip logs of one driving disc or two; a free-decay log among them gives k/J and c/J; or a
    `measurement.pooling.pool` of them. law: as `find_law` takes it. parameters: first values, bounds and held
    unknowns, by name (of the law, of the nuisance parameters, ``gain`` and ``delay`` of the laser; k/J is called
    k_per_J). An interrupt (Ctrl-C) once there is a solution ends the work, and the fit says what is missing.
    inference: how its uncertainty is found; ``progress`` is told the fraction of all this done. disturbances: names of
    `identification.disturbances`, or files of your own, estimated beside the law; "auto": those that the logs show,
    sought only where the residuals ask for it (one driving disc); or "none". law_spread: whether the intervals carry
    the spread over laws that the logs cannot tell apart, by the free curve ("auto"), or not ("none").

    Raises:
        StickslipError: unknown estimator or law, or logs that cannot be pooled or fitted.
    """
    if parameters is not None:
        options = replace(options, given=given(parameters))
    refuse_unknown(law_spread, MODES, f"There is no spread over laws '{law_spread}'.")
    chosen = ESTIMATORS.load(estimator)
    form = find_law(law)
    if not form.sticks and estimator != "lugre":
        raise StickslipError(
            f"The law '{form.name}' is fitted by the estimator 'lugre': '{estimator}' sees no micro-slip."
        )
    ready = logs if isinstance(logs, Pool) else pool(logs)
    sought = options.bounded(sought_law(form, ready.contacts, ready.arrangement))
    pair = bristled(form) if estimator == "lugre" else None
    bristles = pair[1].names if pair else ()
    recorded = [term.name for term in measured(ready)]
    options.given.check((*sought.names, *bristles, *SENSORS, *options.nuisance, *recorded))
    stages = Stages.of_fit(progress, inference, disturbances != NONE)
    if form.spans:
        if estimator != ESTIMATOR:
            raise StickslipError(f"The law '{form.name}' is fitted by '{ESTIMATOR}', not by '{estimator}'.")
        named = () if disturbances == NONE else asked_for(disturbances) or None
        fit = fit_free(ready, sought, options, inference, named, stages)
        assumed = (*fit.structure, *followed(ready, find_law(LAW)))
        return replace(fit, structure=assumed, recorded=tuple(motion.log for motion in ready.motions))
    work = _Work(ready, sought, chosen, options, inference, law_spread, stages)
    if disturbances == NONE:
        fit = work.without_causes()
    else:
        named = asked_for(disturbances)
        terms_of(ready, named)  # names are judged before the work
        fit = work.with_causes(named)
    given_logs = [motion.log for motion in logs.motions] if isinstance(logs, Pool) else logs
    assumed = (*fit.structure, *followed(ready, pair[0] if pair else sought, options.given.held))
    return replace(fit, structure=assumed, recorded=tuple(given_logs))


@dataclass(frozen=True)
class _Work:
    """One fit: its pooled logs, law, estimator and options."""

    ready: Pool
    law: FittableLaw
    estimator: Estimator
    options: Options
    inference: Inference
    law_spread: str
    stages: Stages

    def searched(self, stage: str, terms: tuple[DisturbanceTerm, ...], radii_hold: bool) -> Adjusted:
        """The solution with these terms of disturbances, and with constants adjusted to it."""
        estimate, options = self.estimated(stage, terms=terms)
        return adjust(self.ready, estimate, options, radii_hold)

    def without_causes(self) -> FrictionFit:
        """The fit without disturbances; with constants as stated where a disturbance takes them off. ContradictedRadii:
        R or r contradicts the logs, and no disturbance explains that better."""
        first, options = self.estimated("search")
        try:
            solved = adjust(self.ready, first, options)
        except ContradictedRadii as error:
            other = self.judged(first)
            if other is None or radii_of(other, self.ready):
                raise
            if not other.explanations:  # the law's form is wrong, and no radius
                return self.contested(adjust(self.ready, first, options, radii_hold=True), other)
            radii = " or ".join(f"{name} = {value:.4g} m" for name, value in error.radii.items())
            warning = (
                f"The motion asks for {radii}, which is not what was measured. A disturbance of the bench explains the "
                f"logs better ({' and '.join(one.name for one in other.explanations)}): the rig constants are as "
                "stated. Estimate it: --disturbances auto."
            )
            solved = as_stated(replace(first, warnings=(*first.warnings, warning)))
        return self.contested(solved, self.judged(first, ()))

    def judged(self, estimate: Estimate | None, named: Sequence[str] | None = None) -> Verdict | None:
        """What the slips say without a law; nothing where friction hangs on their direction."""
        return None if self.law.directed else judged(self.ready, estimate, named)

    def estimated(
        self, stage: str, *, by: Estimator | None = None, terms: tuple[DisturbanceTerm, ...] = ()
    ) -> tuple[Estimate, Options]:
        """The estimate with constants as they are stated, and the options that it was made with."""
        estimator = by or self.estimator
        report = self.stages.of(stage)
        progress = by_evaluations(estimator.searches, report, self.options.progress)
        options = replace(self.options, disturbances=terms or terms_of(self.ready, ()), progress=progress)
        estimate = estimator.estimate(self.ready, self.law, options)
        report(1.0)
        return estimate, options

    def contested(self, solved: Adjusted, verdict: Verdict | None) -> FrictionFit:
        """What a solution says, with the spread over laws; after an interrupt by the jackknife, which takes no time.
        verdict: on its slips."""
        rule = self.inference
        try:
            fit = conclude(self.ready, solved, rule, progress=self.stages.of("end"))
        except KeyboardInterrupt:
            warning = (
                f"Interrupted: {rule.covariance} and intervals were not finished; the deviations are the jackknife's."
            )
            fit = conclude(self.ready, solved, DEFAULT_INFERENCE, warnings=(warning,))
        if verdict is None:
            return fit
        fit = replace(fit, free=verdict.curve)
        if self.law_spread == NONE or fit.interrupted or solved.estimate.solution.fixed:
            return fit
        result = by_curve(verdict.evidence, solved.estimate.law, fit.law_values)
        return fit if result is None else with_spread(fit, result)

    def with_causes(self, named: tuple[str, ...]) -> FrictionFit:
        """The fit with the disturbances that are named, or that its slips show. ContradictedRadii: R or r contradicts
        the logs, and no disturbance explains that better."""
        failed, first, options = None, None, self.options
        try:
            first, options = self.estimated("search")
        except StickslipError as error:
            # without a strong disturbance the model may not follow the logs at all; the weak form runs none
            if len(self.ready.contacts) > 1 or self.estimator.name == WEAK:
                raise
            failed = error
        if first is None:
            first = self.estimated("search", by=ESTIMATORS.load(WEAK))[0]
        try:
            verdict = self.judged(None if failed else first, named or None)
            self.stages.of("causes")(1.0)
        except KeyboardInterrupt:
            plain = conclude(self.ready, self._bare(first, options, failed), DEFAULT_INFERENCE)
            return _ended(plain, "disturbances were not sought to the end", failed)
        if verdict is not None and (radii := radii_of(verdict, self.ready)):
            deviations = max(verdict.wrong[name][1] for name in radii)
            values = {prior.name: prior.value for prior in self.ready.priors}
            raise contradicted(radii, values, f"{deviations:.3g}", alone=True)
        causes = causes_named(named, self.ready) if verdict is None else causes_of(verdict, self.ready)
        if failed is not None and not causes:
            raise failed
        hold = verdict is not None
        held = tuple(
            cause
            for cause in causes
            if not self.estimator.inverse or all(term.by_inverse_dynamics for term in terms_found(self.ready, [cause]))
        )
        if held:
            fit = self._added(held, first, options, failed, verdict)
        else:
            fit = self.contested(self._bare(first, options, failed, hold), verdict)
        missed = [
            f"Disturbance {one.sentence} The estimator '{self.estimator.name}' cannot hold it, shooting can."
            for one in causes
            if one not in held
        ]
        return replace(fit, warnings=(*missed, *fit.warnings))

    def _bare(self, first: Estimate, options: Options, failed: StickslipError | None, hold: bool = False) -> Adjusted:
        """The solution without disturbances."""
        return as_stated(first) if failed else adjust(self.ready, first, options, hold)

    def _added(
        self,
        causes: tuple[Cause, ...],
        first: Estimate,
        options: Options,
        failed: StickslipError | None,
        verdict: Verdict | None,
    ) -> FrictionFit:
        """The fit with these causes, from the estimate without."""
        words, hold = ", ".join(cause.name for cause in causes), verdict is not None
        unsettled = {name for one in ranked([cause.name for cause in causes]).values() for name in one.unsettles}
        loose = replace(self, ready=self.ready.loosened({name: OFF[name] for name in unsettled}))
        try:
            second = loose.searched("search again", terms_found(self.ready, causes), hold)
        except KeyboardInterrupt:
            plain = conclude(self.ready, self._bare(first, options, failed, hold), DEFAULT_INFERENCE)
            return _ended(plain, f"the disturbances that show ({words}) were not estimated", failed)
        fit = loose.contested(second, verdict)
        plain = conclude(self.ready, as_stated(first), DEFAULT_INFERENCE, sticks=False)
        warnings = (*(stuck(fit, plain) if failed is None else ()), *fit.warnings)
        structure = (*fit.structure, *[f"{cause.words[0].lower()}{cause.words[1:]}: estimated" for cause in causes])
        return replace(fit, causes=causes, plain=plain.parameters, structure=structure, warnings=warnings)


def stuck(rich: FrictionFit, nested: FrictionFit) -> tuple[str, ...]:
    """What to say of a fit that is worse than one that it holds as a part."""
    if rich.rms_residual <= nested.rms_residual * (1 + WORSE):
        return ()
    return (
        "With the disturbances the fit is worse than without, though it holds that as a part: the search stopped in a "
        "local minimum. Take another estimator (--estimator), or name the disturbances one by one.",
    )


def _ended(plain: FrictionFit, missing: str, failed: StickslipError | None) -> FrictionFit:
    """What there is when an interrupt came; failed: why the model did not follow the logs without disturbances."""
    if failed is not None:
        raise KeyboardInterrupt
    return replace(plain, warnings=(f"Interrupted: {missing}; this is the fit without any.", *plain.warnings))
