"""Unpack an FMU from somebody else: nothing leaves its folder, nothing fills the disk.

    list  ->  every name, kind, size and method is judged before a byte is written
    unpack -> no more than the size stated is read of an entry; what turns out shorter is damaged
    look  ->  archives inside stay packed; one that claims to be a bomb is refused all the same

An entry that comes twice with the same contents is one file; with others it is refused.
A name that is harmless here but writes to a device or onto another file elsewhere (``aux.c``, ``A`` beside ``a``) is
refused on every platform. One that ends in a dot is refused on Windows alone, which drops the dot: tools write such.
"""

import re
import stat
import sys
import unicodedata
import zipfile
import zlib
from collections import Counter
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path, PurePosixPath

from fmu_models.base.errors import StickslipError
from fmu_models.base.files import FULL, disk_error

# the largest FMUs (a tool's run-time system inside) hold some thousand files and some hundred MB
MAX_FILES = 10_000
MAX_BYTES = 1 << 30
# XML shrinks to a thirtieth; only what is made to grow exceeds this, and small files may shrink as they like
MAX_RATIO = 200
RATIO_FROM = 16 << 20
# file systems take 255 bytes a name; the whole path has to leave room for the folder
MAX_NAME = 255
MAX_PATH = 1024
# among the sources of an FMU of this suite; its engine, in folders beside it, is most of its files
OWN = "sources/model_sizes.h"
_ENGINE = re.compile(r"sources/[^/]+/.+")

LOCAL_HEADER = 30  # bytes before the name in a zip archive's local header
ENCRYPTED = 0x1 | 0x40  # bits of the general purpose flag: encrypted, strongly encrypted
METHODS = {zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED}
OTHER_METHODS = {9: "deflate64", 12: "bzip2", 14: "lzma", 93: "zstandard", 95: "xz"}
DEVICES = re.compile(r"(con|prn|aux|nul|conin\$|conout\$|com[0-9]|lpt[0-9]) *(\..*)?", re.IGNORECASE)
KINDS = {
    stat.S_IFLNK: "link",
    stat.S_IFIFO: "pipe",
    stat.S_IFSOCK: "socket",
    stat.S_IFCHR: "device",
    stat.S_IFBLK: "device",
}


def unpack(path: Path, folder: Path, *, engine: bool = True) -> None:
    """Unpack ``path`` into the empty ``folder``; after an error it holds a part, for the caller to remove. ``engine``:
    with the sources that all FMUs of this suite share. StickslipError: not a zip archive, damaged, or with something in
    it that an FMU does not have; says what."""
    try:
        with zipfile.ZipFile(path) as archive:
            entries = archive.infolist()
            _check_entries(entries, path)
            whole = engine or not any(entry.filename == OWN for entry in entries)
            for entry in entries:
                if whole or not _ENGINE.fullmatch(entry.filename):
                    _unpack_entry(archive, entry, path, folder)
    except (zipfile.BadZipFile, NotImplementedError, RuntimeError, ValueError, EOFError, zlib.error) as error:
        raise StickslipError(
            f"'{path}' is not an FMU, or damaged: {error}. An FMU is a zip archive; fetch or export it again."
        ) from error
    except OSError as error:
        if error.errno in FULL:
            raise disk_error(error, folder) from error
        raise StickslipError(f"'{path}' cannot be unpacked into '{folder}': {error.strerror or error}.") from error


def repeated(path: Path) -> list[str]:
    """Names that an archive which can be unpacked lists more than once, each with the same contents."""
    with zipfile.ZipFile(path) as archive:
        counts = Counter(PurePosixPath(entry.filename).as_posix() for entry in archive.infolist() if not entry.is_dir())
    return [name for name, count in counts.items() if count > 1]


def _check_entries(entries: Sequence[zipfile.ZipInfo], path: Path) -> None:
    if len(entries) > MAX_FILES:
        raise StickslipError(f"'{path}' holds {len(entries)} files, more than {MAX_FILES}; it is not unpacked.")
    for entry in entries:
        _check_name(entry, path)
        _check_kind(entry, path)
    _check_sizes(entries, f"'{path}'")
    _check_collisions(entries, path)
    _check_overlaps(entries, path)


def _check_name(entry: zipfile.ZipInfo, path: Path) -> None:
    # zipfile cuts a name at its first NUL; the name as it stands is what has to be judged
    name = entry.orig_filename
    inside = PurePosixPath(name)
    printable = ascii(name) if len(name) < 200 else f"{name[:60]!a}..."
    holds = f"'{path}' holds {printable}"
    if any(unicodedata.category(c) == "Cc" for c in name) or not inside.parts:
        raise StickslipError(f"{holds}, a name that is empty or has control characters; no FMU needs one.")
    for text in (name, entry.filename):
        if PurePosixPath(text).is_absolute() or ".." in text.split("/") or "\\" in text or ":" in text:
            raise StickslipError(f"{holds}, which would be written outside its folder.")
    if len(name.encode("utf-8", "replace")) > MAX_PATH or any(
        len(segment.encode("utf-8", "replace")) > MAX_NAME for segment in inside.parts
    ):
        raise StickslipError(f"{holds}, a name of {len(name)} characters, too long for a file system.")
    for segment in inside.parts:
        if DEVICES.fullmatch(segment):
            raise StickslipError(f"{holds}: '{segment}' is the name of a device on Windows, not of a file.")
        if segment != segment.rstrip(" " if sys.platform != "win32" else " ."):
            raise StickslipError(f"{holds}: '{segment}' ends in a blank or dot, which Windows drops.")


def _check_kind(entry: zipfile.ZipInfo, path: Path) -> None:
    kind = KINDS.get(stat.S_IFMT(entry.external_attr >> 16))
    if kind:
        raise StickslipError(f"'{path}' holds the {kind} '{entry.filename}'; an FMU has plain files only.")
    if entry.flag_bits & ENCRYPTED:
        raise StickslipError(f"'{path}': '{entry.filename}' is encrypted. Ask its author for an open archive.")
    if entry.compress_type not in METHODS:
        method = OTHER_METHODS.get(entry.compress_type, f"method {entry.compress_type}")
        raise StickslipError(
            f"'{path}': '{entry.filename}' is packed by {method}; an FMU stores or deflates its files. Pack it again."
        )


def _check_sizes(entries: Sequence[zipfile.ZipInfo], where: str) -> None:
    total = sum(entry.file_size for entry in entries)
    if total > MAX_BYTES:
        raise StickslipError(
            f"{where} unpacks to {total >> 20} MB, more than {MAX_BYTES >> 20} MB; it is not unpacked."
        )
    for entry in entries:
        if entry.file_size > RATIO_FROM and entry.file_size > MAX_RATIO * entry.compress_size:
            ratio = entry.file_size / max(entry.compress_size, 1)
            raise StickslipError(
                f"{where}: '{entry.filename}' grows {ratio:.0f}-fold to {entry.file_size >> 20} MB when unpacked, "
                "which files of an FMU do not; it is not unpacked."
            )


def _check_collisions(entries: Sequence[zipfile.ZipInfo], path: Path) -> None:
    """No two entries fall on one file, on a file system that ignores case or not."""
    files: dict[tuple[str, ...], str] = {}
    folders: dict[tuple[str, ...], str] = {}
    for entry in entries:
        segments = PurePosixPath(entry.filename).parts
        keys = tuple(unicodedata.normalize("NFC", segment).casefold() for segment in segments)
        depth = len(segments) if entry.is_dir() else len(segments) - 1
        for n in range(1, depth + 1):
            folder = "/".join(segments[:n])
            if folders.setdefault(keys[:n], folder) != folder:
                raise StickslipError(
                    f"'{path}' holds the folders '{folders[keys[:n]]}' and '{folder}', one on Windows."
                )
        if not entry.is_dir():
            name = "/".join(segments)
            if files.setdefault(keys, name) != name:
                raise StickslipError(
                    f"'{path}' holds '{files[keys]}' and '{name}', one file where case does not count."
                )
    for keys, name in files.items():
        if keys in folders:
            raise StickslipError(f"'{path}' holds '{name}' both as a file and as a folder.")


def _check_overlaps(entries: Sequence[zipfile.ZipInfo], path: Path) -> None:
    """No two entries share packed bytes, as in bombs that unpack one kernel many times."""
    ordered = sorted(entries, key=lambda entry: entry.header_offset)
    if ordered and ordered[0].header_offset < 0:
        raise zipfile.BadZipFile("its beginning is missing")
    for earlier, two in pairwise(ordered):
        if earlier.header_offset + LOCAL_HEADER + earlier.compress_size > two.header_offset:
            raise StickslipError(
                f"'{path}': '{earlier.filename}' and '{two.filename}' share their packed bytes; it is not unpacked."
            )


def _unpack_entry(archive: zipfile.ZipFile, entry: zipfile.ZipInfo, path: Path, folder: Path) -> None:
    target = folder / PurePosixPath(entry.filename)
    if entry.is_dir():
        target.mkdir(parents=True, exist_ok=True)
        return
    if target.exists():
        _check_same(archive, entry, path, target)
        return
    target.parent.mkdir(parents=True, exist_ok=True)
    written = 0
    nested = False
    with archive.open(entry) as source, target.open("xb") as file:
        while block := source.read(1 << 20):
            nested = nested or (written == 0 and block.startswith(b"PK\x03\x04"))
            written += len(block)
            file.write(block)
    if written != entry.file_size:
        raise zipfile.BadZipFile(f"'{entry.filename}' ends after {written} of {entry.file_size} bytes")
    if nested:
        _check_nested(target, f"'{path}': the archive '{entry.filename}' in it")


def _check_same(archive: zipfile.ZipFile, entry: zipfile.ZipInfo, path: Path, unpacked: Path) -> None:
    """An entry that comes again has the contents of the one before."""
    with archive.open(entry) as source, unpacked.open("rb") as file:
        block = True
        while block:
            block = source.read(1 << 20)
            if file.read(len(block) or 1) != block:
                raise StickslipError(
                    f"'{path}' holds '{entry.filename}' twice, with different contents; which one is meant cannot be "
                    "told."
                )


def _check_nested(archive: Path, where: str) -> None:
    """An archive inside stays packed here, but the FMU's own code may unpack it."""
    try:
        with zipfile.ZipFile(archive) as inner:
            _check_sizes(inner.infolist(), where)
    except (zipfile.BadZipFile, ValueError):
        return  # begins like an archive and is none: data of the FMU
