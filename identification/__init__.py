"""Friction laws from logs of a rig: fitted, compared, judged, handed on.

from identification import compare_families, fit_friction
from rig_io import read_package

logs = read_package("data/rigs/paper_rubber")
fit = fit_friction(logs)
print(fit.summary())
compare_families(fit, logs)[0].plot()
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from fmu_models.base.exports import exports

if TYPE_CHECKING:
    __version__: str

    from identification.calibration.calibrate import calibrate as calibrate
    from identification.calibration.log import model_log as model_log
    from identification.calibration.online import OnlineTrack as OnlineTrack
    from identification.calibration.online import track_online as track_online
    from identification.calibration.pose import Settings as Settings
    from identification.calibration.propagate import Propagated as Propagated
    from identification.calibration.propagate import propagate as propagate
    from identification.calibration.result import Calibration as Calibration
    from identification.calibration.result import read_calibration as read_calibration
    from identification.calibration.segments import Sensor as Sensor
    from identification.calibration.track import Course as Course
    from identification.calibration.track import track as track
    from identification.disturbances.disturbance import Disturbance as Disturbance
    from identification.disturbances.term import DisturbanceTerm as DisturbanceTerm
    from identification.disturbances.term import Effect as Effect
    from identification.estimators.base import Options as Options
    from identification.fit.fit import fit_friction as fit_friction
    from identification.fit.posterior import posterior as posterior
    from identification.fit.result import FrictionFit as FrictionFit
    from identification.fit.result import read_fit as read_fit
    from identification.fitted_model.machine import machine_with as machine_with
    from identification.hysteresis.decay import fit_decays as fit_decays
    from identification.hysteresis.identify import identify_hysteresis as identify_hysteresis
    from identification.hysteresis.loop import LoopLog as LoopLog
    from identification.hysteresis.read import read_loop as read_loop
    from identification.hysteresis.result import HysteresisFit as HysteresisFit
    from identification.inference.choice import Inference as Inference
    from identification.inference.comparison import LawComparison as LawComparison
    from identification.machines.excite import excite as excite
    from identification.machines.inverse import identify_machine as identify_machine
    from identification.machines.joint_laws import compare_joint_laws as compare_joint_laws
    from identification.machines.machine_fit import MachineFit as MachineFit
    from identification.machines.machine_fit import read_machine_fit as read_machine_fit
    from identification.machines.read import machine_at as machine_at
    from identification.machines.read import read_machine_log as read_machine_log
    from identification.measurement.free_decay import FreeDecay as FreeDecay
    from identification.measurement.free_decay import fit_free_decay as fit_free_decay
    from identification.measurement.pooled import Pool as Pool
    from identification.measurement.pooling import pool as pool
    from identification.measurement.recipe import read_recipe as read_recipe
    from identification.model_check.families import FamilyComparison as FamilyComparison
    from identification.model_check.families import compare_families as compare_families
    from identification.model_check.portraits import PortraitComparison as PortraitComparison
    from identification.next_step.design import Design as Design
    from identification.next_step.design import design as design
    from identification.next_step.experiments import rank_experiments as rank_experiments
    from identification.next_step.laws import compare_contacts as compare_contacts
    from identification.next_step.laws import compare_laws as compare_laws
    from identification.next_step.signals import SignalShape as SignalShape
    from identification.next_step.signals import design_experiment as design_experiment
    from identification.report.findings import findings as findings
    from identification.report.live import live_frame as live_frame
    from identification.report.page import write_report as write_report
    from identification.series.analyse import SeriesInvariants as SeriesInvariants
    from identification.series.analyse import series_invariants as series_invariants
    from identification.series.invariants import level_crossings as level_crossings
    from identification.series.read import Series as Series
    from identification.series.read import read_series as read_series
    from identification.slips.statistics import slip_statistics as slip_statistics
else:
    __getattr__, __dir__ = exports(__name__)
