"""Non-smooth oscillators: declared in Python, run by a compiled engine, exported as FMUs; and the FMUs of anybody.

from fmu_models import load, simulate

rig = load("disc_rig", contacts=["disc0"])
run = simulate(rig, 25.0, inputs={"w0": 0.41}, start={"theta": 0.1})
run.plot("theta")
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from fmu_models.base.exports import exports

if TYPE_CHECKING:
    __version__: str

    from fmu_models.analyses.basins import basins as basins
    from fmu_models.analyses.chart import chart as chart
    from fmu_models.analyses.crossings import crossing_diagram as crossing_diagram
    from fmu_models.analyses.diagram import orbit_diagram as orbit_diagram
    from fmu_models.analyses.edge import edge_state as edge_state
    from fmu_models.analyses.homoclinic import homoclinic as homoclinic
    from fmu_models.analyses.lyapunov import lyapunov as lyapunov
    from fmu_models.analyses.manifolds import manifolds as manifolds
    from fmu_models.analyses.plane import phase_plane as phase_plane
    from fmu_models.analyses.reduced_map import reduced_map as reduced_map
    from fmu_models.analyses.rotation import rotation_number as rotation_number
    from fmu_models.analyses.section import poincare_section as poincare_section
    from fmu_models.analyses.shares import basin_shares as basin_shares
    from fmu_models.analyses.shock import least_shock as least_shock
    from fmu_models.analyses.spectrum import spectrum as spectrum
    from fmu_models.analyses.tipping import tipping_rates as tipping_rates
    from fmu_models.base.errors import StickslipError as StickslipError
    from fmu_models.base.errors import StickslipWarning as StickslipWarning
    from fmu_models.codegen.package import export as export
    from fmu_models.codegen.package import variant as variant
    from fmu_models.continuation.branches import branch as branch
    from fmu_models.continuation.branches import branches as branches
    from fmu_models.continuation.equilibria import equilibria as equilibria
    from fmu_models.coupling.run import couple as couple
    from fmu_models.coupling.system import CoupledSystem as CoupledSystem
    from fmu_models.coupling.toml_system import read_system as read_system
    from fmu_models.explorer.page import explore as explore
    from fmu_models.families.execution import Execution as Execution
    from fmu_models.families.store import stored_runs as stored_runs
    from fmu_models.fmu.fmu import Fmu as Fmu
    from fmu_models.fmu.load import load as load
    from fmu_models.importer.driver import Driver as Driver
    from fmu_models.importer.simulate import simulate as simulate
    from fmu_models.importer.simulate import simulate_any as simulate_any
    from fmu_models.language.automaton import Automaton as Automaton
    from fmu_models.language.automaton import Reset as Reset
    from fmu_models.language.automaton import Switch as Switch
    from fmu_models.language.contacts import Requirement as Requirement
    from fmu_models.language.declaration import Output as Output
    from fmu_models.language.dry_friction import DryFriction as DryFriction
    from fmu_models.language.dry_friction import falling as falling
    from fmu_models.language.friction import Friction as Friction
    from fmu_models.language.hysteresis.bouc_wen import BoucWen as BoucWen
    from fmu_models.language.hysteresis.bouc_wen_baber_noori import BoucWenBaberNoori as BoucWenBaberNoori
    from fmu_models.language.hysteresis.contact import Hysteresis as Hysteresis
    from fmu_models.language.hysteresis.dahl import Dahl as Dahl
    from fmu_models.language.hysteresis.iwan4 import Iwan4 as Iwan4
    from fmu_models.language.hysteresis.play import Play as Play
    from fmu_models.language.hysteresis.sliders import MaxwellSlip as MaxwellSlip
    from fmu_models.language.impacts import Impact as Impact
    from fmu_models.language.impacts import Newton as Newton
    from fmu_models.language.impacts import Poisson as Poisson
    from fmu_models.language.law_parameter import coefficient as coefficient
    from fmu_models.language.law_parameter import declared as declared
    from fmu_models.language.laws.arctan import Arctan as Arctan
    from fmu_models.language.laws.conti import Conti as Conti
    from fmu_models.language.laws.conti_viscous import ContiViscous as ContiViscous
    from fmu_models.language.laws.coulomb import Coulomb as Coulomb
    from fmu_models.language.laws.dieterich import Dieterich as Dieterich
    from fmu_models.language.laws.kelvin_voigt import KelvinVoigt as KelvinVoigt
    from fmu_models.language.laws.lankarani_nikravesh import LankaraniNikravesh as LankaraniNikravesh
    from fmu_models.language.laws.lugre import LuGre as LuGre
    from fmu_models.language.laws.ruina import Ruina as Ruina
    from fmu_models.language.laws.stribeck import Stribeck as Stribeck
    from fmu_models.language.laws.stribeck_cubic import StribeckCubic as StribeckCubic
    from fmu_models.language.laws.tanh import Tanh as Tanh
    from fmu_models.language.laws.tustin import Tustin as Tustin
    from fmu_models.language.laws.warmed import Warmed as Warmed
    from fmu_models.language.maps import Map as Map
    from fmu_models.language.matrices import reduced as reduced
    from fmu_models.language.mechanism import Mechanism as Mechanism
    from fmu_models.language.quantities import TIME as TIME
    from fmu_models.language.quantities import Coordinate as Coordinate
    from fmu_models.language.quantities import Input as Input
    from fmu_models.language.quantities import Parameter as Parameter
    from fmu_models.language.quantities import State as State
    from fmu_models.language.signals import PeriodicSignal as PeriodicSignal
    from fmu_models.language.smoothing import Smoothed as Smoothed
    from fmu_models.language.stops import Stop as Stop
    from fmu_models.maps import MAPS as MAPS
    from fmu_models.scene.read import read_scene as read_scene
    from fmu_models.scene.scene import Scene as Scene
    from fmu_models.sections.crossing import Crossing as Crossing
    from fmu_models.sections.crossing import Impacts as Impacts
    from fmu_models.sections.cycles import last_cycle as last_cycle
    from fmu_models.sections.diagonal import find_crossings as find_crossings
    from fmu_models.sections.iteration import Iteration as Iteration
    from fmu_models.sections.iteration import find_iterate_crossings as find_iterate_crossings
    from fmu_models.sections.orbits import Orbit as Orbit
    from fmu_models.sections.orbits import find_orbit as find_orbit
    from fmu_models.sections.periodic import find_periodic as find_periodic
    from fmu_models.sections.return_map import ReturnMap as ReturnMap
    from fmu_models.sections.strobe import Strobe as Strobe
    from fmu_models.sections.system import SectionSystem as SectionSystem
    from fmu_models.simulation.accuracy import simulate_with_error as simulate_with_error
    from fmu_models.simulation.results import read_trajectory as read_trajectory
    from fmu_models.simulation.results import write_trajectory as write_trajectory
    from fmu_models.simulation.run import KeptRun as KeptRun
    from fmu_models.simulation.sections import Section as Section
    from fmu_models.simulation.sensitivity import SensitiveRun as SensitiveRun
    from fmu_models.simulation.sensitivity import Sensitivity as Sensitivity
    from fmu_models.simulation.signal import Signal as Signal
    from fmu_models.simulation.trajectory import Event as Event
    from fmu_models.simulation.trajectory import Trajectory as Trajectory
else:
    __getattr__, __dir__ = exports(__name__)
