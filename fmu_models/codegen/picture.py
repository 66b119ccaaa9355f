"""The picture of a model: a block with its name, its inputs on the left and its outputs on the right.

It is of two colours, with letters of fixed dots and without compression, so that it is the same to the last byte
wherever it is drawn.
"""

import struct
import zlib
from collections.abc import Sequence

_LINE, _EDGE, _ARROW, _LETTER = 16, 12, 10, 6
_MOST_PORTS = 12
_PART = 0xFFFF


def block(name: str, inputs: Sequence[str], outputs: Sequence[str]) -> bytes:
    """PNG of a model; of more than a dozen inputs or outputs the first are shown."""
    from PIL import Image, ImageDraw, ImageFont

    left, right = _labels(inputs), _labels(outputs)
    rows = max(len(left), len(right), 2)
    sides = max(map(len, (*left, "")), default=0) + max(map(len, (*right, "")), default=0)
    width = 2 * (_EDGE + _ARROW) + _LETTER * (max(sides, len(name)) + 6)
    height = 2 * _EDGE + _LINE * (rows + 2)
    image = Image.new("1", (width, height), 1)
    draw, font = ImageDraw.Draw(image), ImageFont.load_default_imagefont()
    box = (_EDGE + _ARROW, _EDGE, width - _EDGE - _ARROW, height - _EDGE)
    draw.rectangle(box, outline=0, width=2)
    draw.text(((width - _LETTER * len(name)) // 2, _EDGE + 4), name, fill=0, font=font)
    draw.line((box[0], _EDGE + _LINE + 4, box[2], _EDGE + _LINE + 4), fill=0)
    for row, text in enumerate(left):
        y = _EDGE + _LINE * (row + 2)
        _arrow(draw, _EDGE, y)
        draw.text((box[0] + _LETTER, y - 6), text, fill=0, font=font)
    for row, text in enumerate(right):
        y = _EDGE + _LINE * (row + 2)
        _arrow(draw, box[2], y)
        draw.text((box[2] - _LETTER * (len(text) + 1), y - 6), text, fill=0, font=font)
    return _png(width, height, image.tobytes())


def port() -> bytes:
    """PNG of the end of a connection."""
    from PIL import Image, ImageDraw

    image = Image.new("1", (16, 16), 1)
    ImageDraw.Draw(image).polygon(((0, 0), (15, 8), (0, 15)), fill=0)
    return _png(16, 16, image.tobytes())


def _labels(names: Sequence[str]) -> list[str]:
    letters = [name.encode("ascii", "replace").decode() for name in names]
    surplus = len(letters) - _MOST_PORTS
    return letters if surplus <= 0 else [*letters[: _MOST_PORTS - 1], f"and {surplus + 1} more"]


def _arrow(draw: object, x: int, y: int) -> None:
    draw.line((x, y, x + _ARROW, y), fill=0)  # type: ignore[attr-defined]
    draw.polygon(((x + 5, y - 4), (x + _ARROW, y), (x + 5, y + 4)), fill=0)  # type: ignore[attr-defined]


def _png(width: int, height: int, dots: bytes) -> bytes:
    """A picture of one bit per dot, rows filled up to whole bytes; compressors differ, so it is stored as it is."""
    size = (width + 7) // 8
    rows = b"".join(b"\0" + dots[row * size : (row + 1) * size] for row in range(height))
    pieces = [rows[i : i + _PART] for i in range(0, len(rows), _PART)]
    stored = b"".join(
        struct.pack("<BHH", i == len(pieces) - 1, len(part), len(part) ^ 0xFFFF) + part for i, part in enumerate(pieces)
    )
    data = b"\x78\x01" + stored + struct.pack(">I", zlib.adler32(rows))
    head = struct.pack(">IIBBBBB", width, height, 1, 0, 0, 0, 0)
    chunks = ((b"IHDR", head), (b"IDAT", data), (b"IEND", b""))
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))
        for kind, content in chunks
    )
