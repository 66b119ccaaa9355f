"""The user's cache: where it is, and the names of what is kept in it."""

import hashlib
import os
from pathlib import Path

from fmu_models.base.errors import StickslipError


def cache_folder() -> Path:
    """Folder for compiled libraries and FMUs: ``STICKSLIP_CACHE`` or the user's cache folder. StickslipError: the
    folder cannot be made."""
    if path := os.environ.get("STICKSLIP_CACHE"):
        folder = Path(path)
    else:
        import platformdirs

        folder = Path(platformdirs.user_cache_dir("stickslip", appauthor=False))
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise StickslipError(
            f"The cache folder '{folder}' cannot be made: {error.strerror}. "
            "Set STICKSLIP_CACHE to a folder you may write to."
        ) from error
    return folder


def digest(*texts: bytes | str) -> str:
    """Hash of a sequence of texts; where one ends and the next begins counts."""
    total = hashlib.sha256()
    for text in texts:
        data = text.encode() if isinstance(text, str) else text
        total.update(len(data).to_bytes(8, "little") + data)
    return total.hexdigest()[:32]
