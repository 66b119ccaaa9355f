"""Every parser on documents that are right but for a few places deep inside."""

from __future__ import annotations

import contextlib
import json
import random
import zipfile
from functools import cache
from io import StringIO
from pathlib import Path

import h5py
import numpy as np
from coupled import exported
from fuzzing import Target
from made_fit import made_fit
from mutations import mutated
from rich.console import Console
from structures import VALUES, structure

from fmu_models.base import shipped
from fmu_models.base.errors import StickslipError
from fmu_models.base.temporary import temporary_folder
from fmu_models.base.toml_document import read_document
from fmu_models.base.unit_names import parse_unit
from fmu_models.codegen.package import FMI_VERSIONS, built
from fmu_models.coupling.toml_system import read_system
from fmu_models.fmu.fmu import Fmu
from fmu_models.importer.driver import Driver
from fmu_models.importer.experiment import FmuExperiment, perform
from fmu_models.report.fmu_sheet import print_sheet, sheet
from fmu_models.scene.check import checked_scene
from fmu_models.scene.left_out import left_out
from fmu_models.scene.scene import Scene
from fmu_models.simulation.results import read_trajectory
from identification.fit.result import read_fit
from identification.machines.axis import read_model
from identification.measurement.recipe import read_recipe, recipes
from identification.slips.statistics import read_slips
from rig_io.packages.datapackage import read_package
from rig_io.readers import read_table

ROWS = 60  # of a log
WIDE = 120


def _units(generator: random.Random) -> None:
    """Units of any signs: a quantity, or words."""
    parts = ("kg", "m", "s", "N", "rad", "mm", "%", "°", "degC", "1", "9", "0", "-3", "12", "**", "^", "/", "*", " ")
    parts += (
        "(",
        ")",
        ".",
        "·",
        "1/2",
        "µm",
        "kN",
        "__class__",
        "inf",
        "nan",
        "e",
        "\x00",
        "'",
        "^(1/0)",
        "min",
        "ohm",
    )
    text = "".join(generator.choices(parts, k=generator.randrange(1, 9)))
    if generator.random() < 0.3:
        text = mutated("kg m^2/s**2", generator)
    try:
        size = float(parse_unit(text).to_base_units().magnitude)
    except ValueError as error:
        if not str(error):
            raise StickslipError("") from error
        return
    assert np.isfinite(size), text


def _scene(generator: random.Random) -> None:
    scene = checked_scene(read_document(_document(_texts("scenes", ".toml"), generator, ".toml")))
    left_out(scene)
    assert Scene.from_json(scene.to_json()) == scene


def _system(generator: random.Random) -> None:
    read_system(_document(_texts("systems", ".toml"), generator, ".toml"))


def _recipe(generator: random.Random) -> None:
    recipe = read_recipe(_document(tuple(path.read_text("utf-8") for path in recipes()), generator, ".toml"))
    if "terms" in recipe.document.data:
        read_model(recipe)
    if "slips" in recipe.document.data:
        read_slips(recipe)


@cache
def _package() -> tuple[str, dict[str, str]]:
    """A description, and the first rows of the logs."""
    folder = shipped.folder("rigs") / "paper_rubber"
    content = json.loads((folder / "datapackage.json").read_text("utf-8"))
    logs = {}
    for resource in content["resources"]:
        # a log that is cut has another hash, and a wrong hash ends the reading
        del resource["hash"], resource["bytes"]
        logs[resource["path"]] = "".join((folder / resource["path"]).read_text("utf-8").splitlines(True)[: ROWS + 1])
    return json.dumps(content, indent=1), logs


def _datapackage(generator: random.Random) -> None:
    description, logs = _package()
    inside = generator.random() < 0.3
    Path("datapackage.json").write_text(description if inside else mutated(description, generator), "utf-8", "replace")
    chosen = generator.choice(sorted(logs))
    for name, text in logs.items():
        Path(name).write_text(mutated(text, generator) if inside and name == chosen else text, "utf-8", "replace")
    read_package(".")


def _table(generator: random.Random) -> None:
    _, logs = _package()
    text = mutated(generator.choice(sorted(logs.values())), generator)
    Path("log.csv").write_bytes(text.encode(generator.choice(("utf-8", "utf-8", "utf-16", "utf-8-sig")), "replace"))
    read_table("log.csv")


def _fit(generator: random.Random) -> None:
    """What is read as a fit can be shown."""
    fit = read_fit(_document((made_fit().to_json(), made_fit(discs=2).to_json()), generator, ".json"))
    fit.summary()


@cache
def _run() -> bytes:
    """A trajectory with events and its origin, as HDF5."""
    path = Path("seed.h5").resolve()
    perform(Fmu.open(built("block_on_belt")), FmuExperiment(5.0, output_times=np.linspace(0, 5, 9))).write(path)
    data = path.read_bytes()
    path.unlink()
    return data


def _trajectory(generator: random.Random) -> None:
    """Bytes that are others, or a part that is gone or of another kind."""
    data = bytearray(_run())
    if generator.random() < 0.4:
        for _ in range(generator.choice((1, 4, 20))):
            data[generator.randrange(len(data))] = generator.randrange(256)
    Path("run.h5").write_bytes(data)
    if len(data) == len(_run()) and bytes(data) == _run():
        _damage(Path("run.h5"), generator)
    recording = read_trajectory("run.h5")
    str(recording.trajectory)


def _damage(path: Path, generator: random.Random) -> None:
    with h5py.File(path, "r+") as file:
        places: list[str] = []
        file.visit(places.append)
        at = file[generator.choice(["/", *places])]
        if at.attrs and generator.random() < 0.6:
            name = generator.choice(sorted(at.attrs))
            del at.attrs[name]
            if generator.random() < 0.7:
                at.attrs[name] = generator.choice((0, -1, 1.5, "", "x", "nan", [1, 2], [[1.0]], "\u00e9" * 300))
            return
        name = at.name
        if name != "/":
            del file[name]
            if generator.random() < 0.7:
                file[name] = generator.choice((0, "x", [1.0, np.nan], np.zeros((2, 2)), ["a", "b"], np.zeros(0)))


def _structure(generator: random.Random) -> None:
    """A system beside its FMU, or packed with it, and the parameters that one of its units has in a file."""
    texts = {"SystemStructure.ssd": structure(), "b.ssv": VALUES}
    name = generator.choice(("SystemStructure.ssd", "SystemStructure.ssd", "b.ssv"))
    texts[name] = mutated(texts[name], generator)
    if generator.random() < 0.3:
        with zipfile.ZipFile("masses.ssp", "w", zipfile.ZIP_STORED) as archive:
            archive.writestr("resources/mass.fmu", _mass())
            for file, text in texts.items():
                archive.writestr(file, text.encode("utf-8", "replace"))
        read_system("masses.ssp")
        return
    Path("resources").mkdir()
    Path("resources/mass.fmu").write_bytes(_mass())
    for file, text in texts.items():
        Path(file).write_text(text, "utf-8", "replace")
    read_system("SystemStructure.ssd")


@cache
def _mass() -> bytes:
    """The FMU that the structure names."""
    with temporary_folder("mass") as folder:
        return exported("mass", folder).path.read_bytes()


def _description(generator: random.Random) -> None:
    """An FMU of ours with a description that lies about its library: looked at, simulated, integrated."""
    version, model = generator.choice(("2.0", "3.0")), generator.choice(MODELS)
    files = _files(model, version)
    text = mutated(files["modelDescription.xml"].decode(), generator)
    with zipfile.ZipFile("lying.fmu", "w", zipfile.ZIP_STORED) as archive:
        for name, data in (files | {"modelDescription.xml": text.encode("utf-8", "replace")}).items():
            archive.writestr(name, data)
    fmu = Fmu.open("lying.fmu")
    print_sheet(sheet(fmu), Console(file=StringIO(), width=WIDE))
    with contextlib.suppress(StickslipError):
        perform(fmu, FmuExperiment(0.3, output_times=[0.1, 0.3]))
    with Driver(fmu) as driver:
        driver.run(0.3, output_times=[0.1, 0.3])


MODELS = ("block_on_belt", "impact_pair")


def _prepared_files() -> None:
    for model in MODELS:
        for version in FMI_VERSIONS:
            built(model, fmi_version=version)


@cache
def _files(model: str, version: str) -> dict[str, bytes]:
    """Of its FMU, without what a run does not need."""
    with zipfile.ZipFile(built(model, fmi_version=version)) as archive:
        kept = [name for name in archive.namelist() if name.startswith("binaries/") or name == "modelDescription.xml"]
        return {name: archive.read(name) for name in kept}


@cache
def _texts(folder: str, suffix: str) -> tuple[str, ...]:
    return tuple(path.read_text("utf-8") for path in shipped.files(folder, suffix))


def _document(texts: tuple[str, ...], generator: random.Random, suffix: str) -> Path:
    path = Path(f"document{suffix}")
    path.write_text(mutated(generator.choice(texts), generator), "utf-8", "replace")
    return path.resolve()


DOCUMENTS = (
    Target("description", _description, _prepared_files, native=True, weight=1),
    Target("structure", _structure, _mass, weight=2),
    Target("units", _units, weight=20),
    Target("scene", _scene, weight=3),
    Target("system", _system),
    Target("recipe", _recipe, weight=10),
    Target("package", _datapackage),
    Target("table", _table, weight=10),
    Target("fit", _fit, weight=10),
    Target("trajectory", _trajectory, weight=5),
)
