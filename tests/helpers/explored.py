"""The engine of a page outside a page: as WebAssembly under node, and its native twin with the same functions."""

from __future__ import annotations

import ctypes
import json
import shutil
import subprocess
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from checkout import ROOT
from numpy.typing import NDArray

from fmu_models.codegen.c_structures import declarations
from fmu_models.explorer.description import describe
from fmu_models.explorer.module import COMPILED, module_sources, wasm
from fmu_models.explorer.subject import subject_of
from fmu_models.fmu.fmu import Fmu
from fmu_models.simulation.engine import EVENT
from fmu_models.toolchain.compiler import FLAGS, compile_shared
from fmu_models.toolchain.platforms import this_platform

WEB = ROOT / "fmu_models/explorer/web"
NODE = shutil.which("node")
WHAT = declarations("explorer/c/explore.h").constants("Explored", "EXPLORE_")
# what the page leaves out of the engine is referred to from code that nothing calls
_UNUSED_LEFT_OUT = ("-ffunction-sections", "-Wl,--gc-sections", "-rtlib=none")
_SCRIPT = """
import {{ readFileSync, writeFileSync }} from "node:fs";
import {{ Engine }} from "{engine}";
const asked = JSON.parse(readFileSync("{asked}"));
const module = new WebAssembly.Module(readFileSync("{wasm}"));
const engine = new Engine(module);
engine.start(asked.values);
const period = engine.period;
engine.ask(Float64Array.from(asked.times), asked.section);
engine.go();
writeFileSync("{rows}", Buffer.from(engine.rows.buffer));
writeFileSync("{crossings}", Buffer.from(Float64Array.from(engine.crossings.flatMap((row) => [...row])).buffer));
const events = engine.events.map((e) => [e.time, e.contact, e.before, e.after, e.work]);
writeFileSync("{events}", Buffer.from(Float64Array.from(events.flat()).buffer));
let begin = 0;
for (let k = -asked.repeats; k < asked.repeats; k++) {{
  if (k === 0) begin = process.cpuUsage().user;
  engine.start(asked.values);
  engine.ask(Float64Array.from(asked.times), asked.section);
  engine.go();
  engine.rows;
}}
const seconds = asked.repeats ? (process.cpuUsage().user - begin) / 1e6 / asked.repeats : 0;
console.log(JSON.stringify({{
  refused: engine.refused, period, steps: engine.steps, imports: WebAssembly.Module.imports(module).length,
  seconds,
}}));
"""

_ENDS = """
import {{ readFileSync, writeFileSync }} from "node:fs";
import {{ Engine }} from "{engine}";
const {{ base, ends }} = JSON.parse(readFileSync("{asked}"));
const engine = new Engine(new WebAssembly.Module(readFileSync("{wasm}")));
const cpu = () => process.cpuUsage().user / 1000;
const answers = ends.map(([name, place, value]) => {{
  const values = Float64Array.from(base), begin = cpu();
  values[place] = value;
  engine.start(values);
  const until = engine.period > 0 ? 60 * engine.period : 20;
  engine.ask(Float64Array.from({{ length: 1000 }}, (_, i) => (i * until) / 999));
  engine.go(() => cpu() - begin > {budget});
  const work = cpu() - begin;
  const rows = engine.rows;
  return [name, value, engine.refused, engine.steps, rows.length / engine.n.columns, rows.every(Number.isFinite), work];
}});
writeFileSync("{answers}", JSON.stringify(answers));
"""
BUDGET = 14  # ms: FRAME of the page


class Answer(NamedTuple):
    """What the engine says within the budget of a picture with a quantity at an end of its slider; work: CPU time,
    ms."""

    name: str
    value: float
    refused: str | None
    steps: int
    rows: int
    finite: bool
    work: float


class Motion(NamedTuple):
    """Rows and crossings (n, columns); events (k, 5): time, contact, before, after, work; mean CPU time of
    repeats, s."""

    rows: NDArray[np.float64]
    crossings: NDArray[np.float64]
    events: NDArray[np.float64]
    refused: str | None
    period: float
    steps: int
    seconds: float = 0.0


def values_of(fmu: Fmu, **changed: float) -> list[float]:
    """Values in the order in which the engine of a page takes them."""
    rates = [f"{name}_rate" for name in fmu.inputs]
    names = [*fmu.parameters, *fmu.inputs, *rates, *fmu.states, *fmu.memories]
    return [float(changed.get(name, fmu.variables[name].start or 0.0)) for name in names]


def in_node(
    fmu: Fmu,
    folder: Path,
    values: list[float],
    times: NDArray[np.float64],
    section: dict[str, Any] | None,
    repeats: int = 0,
) -> Motion:
    """The motion under node, by the module and the script of the page; repeated to be timed."""
    names = ("asked", "wasm", "rows", "crossings", "events")
    files = {name: folder / name for name in names}
    files["wasm"].write_bytes(wasm(fmu))
    files["asked"].write_text(
        json.dumps({"values": values, "times": list(times), "section": section, "repeats": repeats})
    )
    script = folder / "run.mjs"
    script.write_text(_SCRIPT.format(engine=WEB / "engine.mjs", **files))
    done = subprocess.run([str(NODE), str(script)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    said = json.loads(done.stdout)
    assert said.pop("imports") == 0
    columns = 1 + len(fmu.states) + len(fmu.memories) + len(fmu.outputs) + len(fmu.contacts)
    rows, crossings = (np.fromfile(files[name]).reshape(-1, columns) for name in ("rows", "crossings"))
    return Motion(rows, crossings, np.fromfile(files["events"]).reshape(-1, 5), **said)


def answers_at_ends(model: str, folder: Path) -> list[Answer]:
    """Of the engine under node, for every parameter and input at both ends of both its scales."""
    subject = subject_of(model)
    described = describe(subject)
    ends = [
        [q["name"], place, value]
        for place, q in enumerate([*described["parameters"], *described["inputs"]])
        for value in sorted({q["low"], q["high"], *(q["log"] or ())})
    ]
    files = {name: folder / name for name in ("asked", "wasm", "answers")}
    files["wasm"].write_bytes(wasm(subject.fmu))
    files["asked"].write_text(json.dumps({"base": values_of(subject.fmu), "ends": ends}))
    script = folder / "ends.mjs"
    script.write_text(_ENDS.format(engine=WEB / "engine.mjs", budget=BUDGET, **files))
    subprocess.run([str(NODE), str(script)], check=True)
    return [Answer(*one) for one in json.loads(files["answers"].read_text())]


class Twin:
    """The same C as a library of this machine."""

    def __init__(self, fmu: Fmu, folder: Path) -> None:
        library = folder / f"twin{this_platform().suffix}"
        compile_shared(module_sources(fmu), library, files=COMPILED, options=(*FLAGS, *_UNUSED_LEFT_OUT))
        self.c = ctypes.CDLL(str(library))
        self.c.explore_buffer.restype = ctypes.c_void_p
        self.c.explore_period.restype = ctypes.c_double
        self.c.explore_start.argtypes = (ctypes.c_double,)
        self.c.explore_ask.argtypes = (ctypes.c_int, ctypes.c_int, ctypes.c_double, ctypes.c_int)
        self.columns = self.c.explore_size(WHAT.COLUMNS)

    def buffer(self, what: int, shape: tuple[int, ...]) -> NDArray[np.float64]:
        size = int(np.prod(shape))
        return np.ctypeslib.as_array((ctypes.c_double * size).from_address(self.c.explore_buffer(what))).reshape(shape)

    def run(self, values: list[float], times: NDArray[np.float64], section: dict[str, Any] | None) -> Motion:
        c = self.c
        self.buffer(WHAT.VALUES, (len(values),))[:] = values
        refused = c.explore_start(1e-14) != 0
        self.buffer(WHAT.TIMES, times.shape)[:] = times
        section = section or {"state": -1, "level": 0.0, "direction": 0}
        c.explore_ask(times.size, section["state"], section["level"], section["direction"])
        period, status = c.explore_period(), 1
        events, crossings = [], []
        while status == 1 and not refused:
            status = c.explore_continue(512)
            n, bytes_each = c.explore_count(WHAT.EVENTS), c.explore_size(WHAT.EVENT_BYTES)
            room = (ctypes.c_char * (n * bytes_each)).from_address(c.explore_buffer(WHAT.EVENTS))
            part = np.frombuffer(bytes(room), EVENT)
            events += [[float(one[name]) for name in ("time", "contact", "before", "after", "work")] for one in part]
            n = c.explore_count(WHAT.CROSSINGS)
            crossings.append(self.buffer(WHAT.CROSSINGS, (n, self.columns)).copy())
        rows = self.buffer(WHAT.ROWS, (c.explore_count(WHAT.ROWS), self.columns)).copy()
        text = ctypes.string_at(c.explore_buffer(WHAT.MESSAGE)).decode() if refused or status == 2 else None
        made = np.array(events).reshape(-1, 5)
        found = np.concatenate(crossings) if crossings else np.empty((0, self.columns))
        return Motion(rows, found, made, text, period, c.explore_count(WHAT.STEPS))
