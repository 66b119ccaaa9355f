"""What lists tell of models and maps, without importing them each time."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from fmu_models.base.cache import cache_folder, digest
from fmu_models.base.files import sealed_text
from fmu_models.base.registry import Registry

T = TypeVar("T")


def listed(members: Registry[T], row: Callable[[str, T], dict[str, Any]]) -> list[dict[str, Any]]:
    """A row for each member by name; from the user's cache while no file that members are made of has changed.
    StickslipError: a member cannot be loaded."""
    root = Path(__file__).parents[1]
    files = [file for folder in ("base", "commands", "language") for file in sorted((root / folder).rglob("*.py"))]
    key = digest(members.kind, *(file.read_bytes() for file in files), *members.sources())
    cached = cache_folder() / "lists" / f"{key}.json"
    text = sealed_text(cached, lambda: json.dumps([row(name, members.load(name)) for name in members.names()]))
    return json.loads(text)
