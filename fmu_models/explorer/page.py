"""The page of a model: its description, its engine and a still picture, in one file."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fmu_models.base.errors import StickslipError
from fmu_models.base.files import checked_page, write_whole
from fmu_models.explorer.bundle import WEB, framed, single_file
from fmu_models.explorer.description import describe
from fmu_models.explorer.module import wasm
from fmu_models.explorer.subject import ExplorerSubject, subject_of
from fmu_models.simulation.run import simulate

if TYPE_CHECKING:
    from fmu_models.codegen.package import Model

SCRIPTS = ("engine", "reading", "sweep", "plot", "elements", "pictures", "diagram", "page")
_SAMPLES = 400  # of the picture that stands where nothing can be computed
_STILL = 20.0  # s
_WIDTH, _HEIGHT, _EDGE = 480, 360, 44


@dataclass(frozen=True, eq=False)
class Explorer:
    """A page about a model, as text; in a notebook it is shown in a frame.

    Attributes:
        name: of the model.
        version: of this suite, which the page tells.
        planes: pairs of states that it draws, the second over the first.
        notes: what it leaves out of what was asked for.
        html: the page.
    """

    name: str
    version: str
    planes: tuple[tuple[str, str], ...]
    notes: tuple[str, ...]
    html: str

    def __repr__(self) -> str:
        return f"Explorer('{self.name}', {len(self.html.encode()) / 1000:.0f} kB; write(PATH) makes a page of it)"

    def _repr_html_(self) -> str:
        """In a frame of its own, which reaches neither the notebook nor the network."""
        return framed(self.html, self.name)

    def write(self, path: str | os.PathLike[str], *, overwrite: bool = False) -> Path:
        """Write the page to a file that ends in .html. StickslipError: another suffix; the file exists and
        ``overwrite`` is false, or cannot be written."""
        target = checked_page(path, overwrite=overwrite)
        with write_whole(target, overwrite=overwrite) as temporary:
            temporary.write_text(self.html, "utf-8")
        return target


def explore(
    model: Model, *, contacts: Sequence[str] | None = None, plot: Sequence[str] | None = None, trust: bool = False
) -> Explorer:
    """A page in which a model moves: its engine as WebAssembly, with sliders, portraits and diagrams.

    Args:
        model: a declaration, the name, file or module of a model, a scene, or an FMU of this suite.
        contacts: names of those to keep; all if None.
        plot: names of the coordinates to draw; needed where there are more than six.
        trust: Python files that a scene names may run.

    Raises:
        StickslipError: there is no such model, contact or coordinate, more than six coordinates without a choice, an
            FMU of somebody else, or the compiler fails.
    """
    return explored(subject_of(model, contacts, trust=trust), plot)


def explored(subject: ExplorerSubject, plot: Sequence[str] | None = None) -> Explorer:
    """The page of what is to be explored, an FMU that passes ``check``; other errors as in `explore`."""
    described = describe(subject, plot)
    states = subject.fmu.states
    planes = tuple((states[i], states[j]) for i, j in described["planes"])
    data = json.dumps(described, ensure_ascii=False, allow_nan=False).replace("<", "\\u003c")
    values = {"model": described, "data": data, "still": _still(subject, planes[0])}
    style, scripts = (WEB / "page.css").read_text("utf-8"), [WEB / f"{name}.mjs" for name in SCRIPTS]
    page = single_file(WEB / "page.html.j2", scripts, style, {"engine": wasm(subject.fmu)}, **values)
    return Explorer(str(described["name"]), str(described["version"]), planes, subject.notes, page)


def _still(subject: ExplorerSubject, plane: tuple[str, str]) -> str:
    """The portrait of the motion from the default start, as SVG without styles, which the policy would refuse."""
    fmu = subject.fmu
    until = subject.until or _STILL
    x, y = plane
    start = {name: subject.values[name] for name in (*fmu.states, *fmu.memories) if name in subject.values}
    times = np.linspace(0.0, until, _SAMPLES)
    try:
        run = simulate(fmu, until, output_times=times, start=start, **fmu.settings(subject.values))
    except StickslipError as error:
        return f"<p>The motion from this start is refused: {escape(str(error))}</p>"
    return _portrait((x, run[x]), (y, run[y]))


def _portrait(x: tuple[str, Any], y: tuple[str, Any]) -> str:
    places, texts = [], []
    for (name, values), size, sign in ((x, _WIDTH, 1), (y, _HEIGHT, -1)):
        low, high = float(values.min()), float(values.max())
        fraction = (values - low) / ((high - low) or 1.0)
        places.append(np.round(_EDGE + (fraction if sign > 0 else 1.0 - fraction) * (size - 2 * _EDGE), 1))
        texts.append((escape(name), f"{low:.4g}", f"{high:.4g}"))
    path = "M" + "L".join(f"{u:g} {v:g}" for u, v in zip(*places, strict=True))
    right, bottom, base = _WIDTH - _EDGE, _HEIGHT - _EDGE, _HEIGHT - _EDGE // 2
    (name, low, high), (ordinate, lowest, highest) = texts
    title = f"Phase portrait of {ordinate} over {name}"
    return (
        f'<svg viewBox="0 0 {_WIDTH} {_HEIGHT}" width="{_WIDTH}" height="{_HEIGHT}" role="img" aria-label="{title}" '
        f'fill="currentColor" font-size="12"><path d="M{_EDGE} {_EDGE}V{bottom}H{right}" fill="none" '
        f'stroke="currentColor"/><path d="{path}" fill="none" stroke="#1f5f99"/>'
        f'<text x="{_EDGE}" y="{base}">{low}</text><text x="{right}" y="{base}" text-anchor="end">{high}</text>'
        f'<text x="{_WIDTH // 2}" y="{base}" text-anchor="middle">{name}</text><text x="2" y="{bottom}">{lowest}</text>'
        f'<text x="2" y="{_EDGE}">{highest}</text><text x="2" y="{_HEIGHT // 2}">{ordinate}</text></svg>'
    )
