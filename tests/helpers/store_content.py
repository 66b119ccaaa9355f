"""What a store holds, to be compared to the last byte."""

from __future__ import annotations

import hashlib
from pathlib import Path


def content(store: Path) -> dict[str, str]:
    """The hash of each file of a store."""
    files = (file for file in store.rglob("*") if file.is_file())
    return {str(file.relative_to(store)): hashlib.sha256(file.read_bytes()).hexdigest() for file in files}
