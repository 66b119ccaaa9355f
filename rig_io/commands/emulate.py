"""Command that emulates the rig: logs as a bench would write them."""

from __future__ import annotations

from dataclasses import replace
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fmu_models.base import console
from fmu_models.base.errors import StickslipError

if TYPE_CHECKING:
    from rig_io.bench.emulation import Emulation

OTHERS = ("loop", "decay")  # of other rigs
MOTOR_TURNS = 3.0  # in one of the disc, where a belt is between and the encoder sits on the motor
SPEED_DEVIATION = 0.005  # relative, of a drive that is set by hand


@console.trusting
def emulate(
    place: Annotated[
        Path,
        typer.Argument(
            metavar="FOLDER|SCENE|loop|decay",
            help="Folder to write: CSV logs and datapackage.json; or a scene (.toml); or what other rigs record, a "
            "loop of force over way or a decay of an angle; then:",
        ),
    ],
    target: Annotated[
        Path | None, typer.Argument(metavar="[FOLDER]", help="Folder for these logs. [default: the name of the scene]")
    ] = None,
    material: Annotated[str, typer.Option(help="Friction pair: paper/paper, liner/rubber, paper/rubber.")] = (
        "paper/rubber"
    ),
    speeds: Annotated[
        str | None, typer.Option(metavar="W,W,...", help="Drive speeds of disc 0, rad/s (default: fit for the pair).")
    ] = None,
    second: Annotated[
        str | None,
        typer.Option("--second-disc", metavar="W,W,...", help="Its speeds, rad/s: one, or one for each of --speeds."),
    ] = None,
    second_material: Annotated[
        str | None, typer.Option("--second-material", help="Friction pair of the second disc (default: --material).")
    ] = None,
    arrangement: Annotated[
        str, typer.Option(help="Of two discs: together, sequential (by the angle), overlapping.")
    ] = "together",
    changeover: Annotated[
        float, typer.Option(help="Angle from which on disc 1 is touched, or up to which both are, rad.")
    ] = 0.0,
    duration: Annotated[float, typer.Option(help="Length of each log, s.")] = 20.0,
    seed: Annotated[int, typer.Option(help="Of the bench: the same seed gives the same bytes.", min=0)] = 0,
    micro_slip: Annotated[
        float | None, typer.Option(metavar="STIFFNESS", help="Elastic contact below gross slip, N/m (default: rigid).")
    ] = None,
    disturbance: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=SIZE",
            help="Of a bench as it is: once=5%, twice=1% (normal force per turn of the drive), angle=5% (friction over "
            "the body's angle), per_log=4%, within=4% (wear), offset=0.1mm, drift=0.3mm (laser), zero=2mrad, belt=1% "
            "(the drive's encoder is on the motor) and many others, which a wrong name lists; repeat.",
        ),
    ] = None,
    start: Annotated[
        float | None,
        typer.Option(
            metavar="ANGLE", help="Let the disc go at this angle, rad, as a log begins (default: 5 s before)."
        ),
    ] = None,
    ripple: Annotated[bool, typer.Option(help="Speed ripple of the drives.")] = True,
    laser: Annotated[bool, typer.Option(help="Fit the laser.")] = True,
    beam: Annotated[
        str | None, typer.Option(metavar="BEAM", help="What the laser sees: sine, arc, tangent; 'sine 3 deg': tilted.")
    ] = None,
    encoder: Annotated[bool, typer.Option(help="Fit the encoder of the body.")] = True,
    drive_encoder: Annotated[
        bool, typer.Option(help="Fit the drives' encoders; without, they turn at their nominal speeds within 0.5 %.")
    ] = True,
    load_cell: Annotated[
        bool, typer.Option("--load-cell", help="Fit load cells of the normal forces, whose gain is known to 0.5 %.")
    ] = False,
    velocity: Annotated[
        str | None, typer.Option(metavar="SENSOR", help="Fit a velocity sensor of the body: tachometer or vibrometer.")
    ] = None,
    settings_of_loop: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="NAME=VALUE,...",
            help="Of a loop or decay, law, way, instruments and faults of the bench: --set amplitude=1mm,5mm makes two "
            "logs; a wrong name lists all; repeat.",
        ),
    ] = None,
    overwrite: console.Overwrite = False,
    json: console.Json = False,
) -> None:
    """Emulate a set of rig logs: one per drive speed, and a free decay; or loops and decays of other rigs.

    Example: stickslip emulate my_rig --material liner/rubber --speeds 0.41,0.83,1.2 --seed 7

    Example: stickslip emulate loop my_loops --set "law=Dahl(sigma=2e5, F_c=80)" --set amplitude=1mm,5mm
    """
    from rig_io.bench.disturbances import Disturbances
    from rig_io.bench.emulation import MicroSlip
    from rig_io.bench.emulator import standard_set
    from rig_io.description import quantities
    from rig_io.sensors.encoder import Encoder
    from rig_io.sensors.laser import Laser
    from rig_io.sensors.load_cell import LoadCell
    from rig_io.sensors.speed_sensor import speed_sensor

    if place.suffix == ".toml" or str(place) in OTHERS:
        default = (material, arrangement, changeover, duration) == ("paper/rubber", "together", 0.0, 20.0)
        default &= all(one is None for one in (speeds, second, second_material, micro_slip, disturbance, start))
        if not (default and ripple and laser and encoder and drive_encoder) or load_cell or velocity or beam:
            raise StickslipError(
                "A scene says itself what is emulated: change it there, sensors in [sensors]. Loops and decays take "
                "--set."
            )
        if str(place) in OTHERS:
            _emulate_others(str(place), target, settings_of_loop or [], seed, overwrite, json)
        else:
            _emulate_scene(place, target, seed, overwrite, json)
        return
    if settings_of_loop:
        raise StickslipError("--set is of loops and decays: stickslip emulate loop FOLDER --set amplitude=5mm.")
    if target is not None:
        raise StickslipError(
            f"Two folders are given, '{place}' and '{target}'. Give one, or a scene (.toml) before it."
        )
    folder = place
    fitted: dict[str, Any] = {"laser": Laser(**quantities.beam(beam, "--beam"))} if beam is not None else {}
    fitted |= {name: None for name, used in {"laser": laser, "encoder": encoder, "ripple": ripple}.items() if not used}
    fitted |= {"drive_encoder": None, "speed_deviation": SPEED_DEVIATION} if not drive_encoder else {}
    fitted |= {"load_cell": LoadCell()} if load_cell else {}
    fitted |= {"speed_sensor": speed_sensor(velocity)} if velocity is not None else {}
    fitted |= {"micro_slip": MicroSlip(stiffness=micro_slip)} if micro_slip is not None else {}
    disturbing = Disturbances.said(disturbance or [])
    fitted |= {"disturbances": disturbing} if disturbance else {}
    fitted |= {"drive_encoder": Encoder(ratio=MOTOR_TURNS)} if disturbing.size("belt") and drive_encoder else {}
    settings = standard_set(
        material, console.numbers(speeds, "--speeds") if speeds else None, duration=duration, **fitted
    )
    if second is not None:
        settings = _with_second(settings, console.numbers(second, "--second-disc"), second_material or material)
        material = " and ".join(disc.material.name for disc in settings[0].discs)
    elif second_material is not None:
        raise StickslipError("--second-material is that of a second disc: say its speeds, --second-disc W,W,...")
    begun = {} if start is None else {"transient": 0.0, "start_angle": start, "at_rest": True}
    placed = begun | {"arrangement": arrangement, "changeover": changeover}
    settings = [replace(emulation, **placed) if emulation.discs else emulation for emulation in settings]
    _emulate(folder, settings, material, seed, overwrite, json)


def _emulate_others(kind: str, folder: Path | None, texts: list[str], seed: int, overwrite: bool, json: bool) -> None:
    """Loops or decays, one log for each combination of settings."""
    from rig_io.bench.joint import JointBench, record_loop
    from rig_io.bench.settings import benches, log_names, write_recorded
    from rig_io.bench.swing import SwingBench, record_decay

    if folder is None:
        raise StickslipError(f"Say where the logs go: stickslip emulate {kind} FOLDER.")
    asked: list[tuple[Any, tuple[str, ...]]] = [*benches(JointBench if kind == "loop" else SwingBench, texts)]
    names = log_names(kind, asked)
    record: Any = record_loop if kind == "loop" else record_decay
    with console.progress("emulating") as advance:
        made = []
        for number, ((bench, _), name) in enumerate(zip(asked, names, strict=True)):
            made.append(record(bench, name, seed, number))
            advance((number + 1) / len(asked))
    write_recorded(folder, made, title=f"Emulated: {kind}, seed {seed}", overwrite=overwrite)
    content = {"folder": str(folder), "seed": seed, "logs": [f"{name}.csv" for name in names]}
    command = "hysteresis" if kind == "loop" else "decay"

    def say(out: console.Console) -> None:
        out.print(f"[bold]{folder}[/bold]: {len(made)} emulated log{'s' * (len(made) > 1)}, seed {seed}")
        rows = [[f"{log.name}.csv", f"{len(next(iter(log.columns.values())))}", ", ".join(log.columns)] for log in made]
        out.print(console.table("", ("log", ">samples", "columns"), rows))
        out.print(f"Fit them:  stickslip {command} {folder}/*.csv")

    console.say(json, content, say)


def _with_second(settings: list[Emulation], speeds: list[float], material: str) -> list[Emulation]:
    """The settings with a second disc; one speed (rad/s) for all logs, or one for each."""
    from rig_io.bench.emulation import Disc
    from rig_io.bench.materials import material as named

    *runs, decay = settings
    if len(speeds) not in (1, len(runs)):
        raise StickslipError(
            f"There are {len(runs)} speeds of disc 0 and {len(speeds)} of the second disc. Give one, or {len(runs)}."
        )
    pair = named(material)
    joined = zip(runs, speeds if len(speeds) == len(runs) else speeds * len(runs), strict=True)
    return [
        *(
            replace(emulation, name=f"{emulation.name}-{w:g}", discs=(*emulation.discs, Disc(pair, w)))
            for emulation, w in joined
        ),
        decay,
    ]


def _emulate_scene(path: Path, folder: Path | None, seed: int, overwrite: bool, json: bool) -> None:
    """One log per value of what the scene varies."""
    from fmu_models.scene.read import read_scene
    from rig_io.bench.scenes import emulations

    scene = read_scene(path)
    settings = emulations(scene)
    material = " and ".join(dict.fromkeys(disc.material.name for disc in settings[0].discs)) or "no disc in contact"
    _emulate(folder or Path(scene.name), settings, material, seed, overwrite, json)


def _emulate(folder: Path, settings: list[Emulation], material: str, seed: int, overwrite: bool, json: bool) -> None:
    """Emulate the logs, write them, and say so."""
    from rig_io.bench.emulator import emulate_set

    done = count()
    with console.progress("emulating") as advance:
        emulate_set(folder, settings, seed, overwrite=overwrite, progress=lambda _: advance(next(done) / len(settings)))
    content = {
        "folder": str(folder),
        "seed": seed,
        "material": material,
        "logs": [
            {
                "file": f"{emulation.name}.csv",
                "duration": emulation.duration,
                "drive_speeds": [disc.drive_speed for disc in emulation.discs],
            }
            for emulation in settings
        ],
    }
    console.say(json, content, lambda out: _print_set(folder, settings, material, seed, out))


def _print_set(folder: Path, settings: list[Emulation], material: str, seed: int, out: console.Console) -> None:
    out.print(
        f"[bold]{folder}[/bold]: {len(settings)} emulated log{'s' * (len(settings) > 1)}, {material}, seed {seed}"
    )
    rows = [
        [
            *(f"{emulation.name}.csv", f"{emulation.duration:g}"),
            ", ".join(f"{disc.drive_speed:g}" for disc in emulation.discs) or "free decay",
        ]
        for emulation in settings
    ]
    out.print(console.table("", ("log", ">duration, s", ">drive speeds, rad/s"), rows))
    out.print(f"Fit them:  stickslip fit {folder}")
