"""The page of `stickslip explore`: its engine against the same C natively, sliders, diagrams, and how long it takes to
build.

    python tests/benchmarks/bench_explorer.py [models ...]

Per model: WebAssembly under node over the native twin (CPU time of the same runs, in turn); in a headless Chromium the
first run, the work from a move of a slider to its picture (median and 95 %), a diagram of 240 values and 180 steps of
the section in workers; size of the page. Before that the building of a page, cold (nothing compiled before) and warm,
and of every oscillator the slowest answer of the engine under node (CPU time) at the ends of the ranges of all
parameters and inputs, with their number and how many of them were refused.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from playwright.sync_api import sync_playwright

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "tests/helpers"))

from explored import Twin, answers_at_ends, in_node, values_of  # noqa: E402  beside the unit tests

from fmu_models.explorer.page import explore  # noqa: E402
from fmu_models.fmu.load import load  # noqa: E402
from fmu_models.oscillators import MODELS as OSCILLATORS  # noqa: E402  the same

MODELS = ("forced_stick_slip", "block_on_belt", "discontinuous_support", "hinge_clearance", "woodpecker")
UNTIL = {"forced_stick_slip": 236.0, "block_on_belt": 56.0, "discontinuous_support": 377.0, "woodpecker": 8.76}
CHROMIUM = shutil.which("chromium") or shutil.which("google-chrome")
BUILD = (
    "import time; from fmu_models.explorer.page import explore; begin = time.perf_counter(); "
    "explore('forced_stick_slip'); print(time.perf_counter() - begin)"
)
REPEATS = 100

MOVES = """async () => {
  const work = [], row = page.rows[1];
  for (let k = 0; k < 120; k++) {
    await new Promise(requestAnimationFrame);
    row.range.value = 320 + (k % 40);
    const begin = performance.now();
    row.range.oninput();
    work.push(performance.now() - begin);
  }
  document.getElementById("defaults").click();
  work.sort((a, b) => a - b);
  return [work[60], work[113]];
}"""


def build() -> None:
    """Seconds of wall time and of CPU, with an empty cache and then with a full one."""
    with tempfile.TemporaryDirectory() as folder:
        environment = {**os.environ, "STICKSLIP_CACHE": folder, "PYTHONPATH": str(ROOT)}
        for state in ("cold", "warm"):
            before = os.times()
            run = subprocess.run(
                [sys.executable, "-c", BUILD], env=environment, capture_output=True, text=True, check=True
            )
            after = os.times()
            cpu = after.children_user + after.children_system - before.children_user - before.children_system
            print(f"build {state}: {float(run.stdout):.2f} s, with all that is imported {cpu:.1f} s of CPU", flush=True)


def ends() -> None:
    for name in OSCILLATORS.members():
        with tempfile.TemporaryDirectory() as folder:
            answers = answers_at_ends(name, Path(folder))
        slowest = max(answers, key=lambda one: one.work)
        refused = sum(one.refused is not None for one in answers)
        where = f"{slowest.name} = {slowest.value:g}"
        print(f"{name:32} {slowest.work:5.1f} ms at {where:20} of {len(answers)}, {refused} refused", flush=True)


def engines(name: str, folder: Path) -> float:
    """CPU time under node over that of the native twin."""
    fmu, folder = load(name), folder / name
    folder.mkdir()
    times, values = np.linspace(0.0, UNTIL.get(name, 60.0), 1500), values_of(fmu)
    twin = Twin(fmu, folder)
    under_node = in_node(fmu, folder, values, times, None, REPEATS)
    made = twin.run(values, times, None)
    begin = time.process_time()
    for _ in range(REPEATS):
        twin.c.explore_start(1e-14)
        twin.c.explore_ask(times.size, -1, 0.0, 0)
        while twin.c.explore_continue(512) == 1:
            pass
    native = (time.process_time() - begin) / REPEATS
    assert under_node.rows.tobytes() == made.rows.tobytes()
    return under_node.seconds / native


def main(models: tuple[str, ...]) -> None:
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as started:
        browser = started.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        for name in models:
            page = explore(name).write(Path(folder) / f"{name}.html", overwrite=True)
            tab = browser.new_page(viewport={"width": 1400, "height": 900})
            tab.goto(page.as_uri())
            tab.wait_for_selector("#readout dd")
            first = tab.evaluate("page.first")
            tab.wait_for_timeout(500)
            median, late = tab.evaluate(MOVES)
            tab.select_option("#over", index=1)
            tab.click("#sweep")
            tab.wait_for_selector("#progress:has-text('240 of 240 values in')", timeout=120_000)
            sweep = tab.inner_text("#progress").partition(" in ")[2].partition(" s")[0]
            print(
                f"{name:24} wasm/native {engines(name, Path(folder)):.2f}   first {first:.0f} ms   move {median:.1f}, "
                f"95 % {late:.1f} ms   diagram {sweep} s   {page.stat().st_size / 1000:.0f} kB",
                flush=True,
            )
            tab.close()
        browser.close()


if __name__ == "__main__":
    build()
    ends()
    main(tuple(sys.argv[1:]) or MODELS)
