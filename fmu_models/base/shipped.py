"""What comes along with the program: scenes, recipes, systems, example logs, and the sources of the manual.

In a checkout it is the folder ``data`` beside the packages, the manual ``docs``; an installed suite has them as
``stickslip_data`` and ``stickslip_docs`` there.
"""

from pathlib import Path

ROOM = Path(__file__).parents[2]
NAME = "data"  # how commands and messages call the folder, wherever it is
SITE = "site"  # folder of the built manual among its sources, where a wheel was made with one
LOGS = "rigs"  # a folder for each set of logs; the other parts hold single files
SCENES, LITERATURE = "scenes", "systems_of_the_literature"  # the latter with the models of its scenes


def folder(subfolder: str = "") -> Path:
    """The folder, or a subfolder such as "scenes"."""
    installed = ROOM / "stickslip_data"
    return (installed if installed.is_dir() else ROOM / NAME) / subfolder


def manual() -> Path:
    """The folder of the manual's sources."""
    installed = ROOM / "stickslip_docs"
    return installed if installed.is_dir() else ROOM / "docs"


def site() -> Path:
    """The built manual that a wheel brings; that of a checkout is of another day, and waits for a wheel to be made."""
    return ROOM / "stickslip_docs" / SITE


def files(subfolder: str, suffix: str = ".toml") -> list[Path]:
    """The files of a subfolder, by name."""
    return sorted(folder(subfolder).glob(f"*{suffix}"))


def is_scene(model: str) -> bool:
    """Whether what stands for a model is the path of a scene, or the name of one that comes along."""
    return model.endswith(".toml") or model in {path.stem for path in scenes()}


def scenes() -> list[Path]:
    """All scenes."""
    return [*files(SCENES), *files(LITERATURE)]


def items() -> dict[str, Path]:
    """All that can be copied, by a name such as "rigs/paper_rubber", "scenes/disc_rig_class_a", "machines/axis.csv"."""
    paths = {f"{LOGS}/{path.name}": path for path in sorted(folder(LOGS).iterdir()) if path.is_dir()}
    for subfolder in ("recipes", "scenes", "systems"):
        paths |= {f"{subfolder}/{path.stem}": path for path in files(subfolder)}
    for subfolder, suffixes in (("machines", (".csv", ".py")), (LITERATURE, (".py", ".toml"))):
        paths |= {f"{subfolder}/{path.name}": path for suffix in suffixes for path in files(subfolder, suffix)}
    return paths | {"README.md": folder() / "README.md"}


def hint(path: Path) -> str:
    """How to get a file or folder that is missing here and comes along; empty if it does not."""
    inside = Path(*path.parts[1:])
    if path.parts[:1] != (NAME,) or not inside.parts or not (folder() / inside).exists():
        return ""
    named = (name for name, item in items().items() if (folder() / inside).is_relative_to(item))
    return next((f" It comes along; copy it here: stickslip data copy {name}" for name in named), "")
