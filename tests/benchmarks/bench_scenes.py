"""What scenes save: the FMU of each against that of its whole model, by size, by time per run, in pairs, and by
time to a first result, with the FMU built before and with nothing built.

    python tests/benchmarks/bench_scenes.py [pairs]

Scenes that leave contacts out are compared where these can be switched off in the whole model by a parameter (a normal
force of zero), so that both make the same motion; the others differ in constants and outputs alone.
"""

from __future__ import annotations

import sys
from pathlib import Path

from fmu_models.fmu.fmu import Fmu
from fmu_models.scene.left_out import size, whole_model
from fmu_models.scene.read import files, read_scene
from fmu_models.scene.reduce import built_scene

sys.path.insert(0, str(Path(__file__).parents[1] / "helpers"))

from timed_scene import time_build, time_runs, time_start


def main(pairs: int = 51) -> None:
    print(f"{'scene':40s} {'indicators':>11s} {'states':>7s} {'parameters':>11s} {'outputs':>8s} {'kB':>9s}", end="")
    print(f" {'ms per run':>17s} {'s, built':>13s} {'s, not built':>13s} {'faster':>7s} {'difference':>11s}")
    for path in files():
        scene = read_scene(path)
        a, b = size(Fmu.open(built_scene(scene))), size(whole_model(scene))
        runs = time_runs(scene, pairs)
        parts = [
            f"{getattr(a, what)}/{getattr(b, what)}".rjust(width)
            for what, width in (("indicators", 11), ("states", 7), ("parameters", 11), ("outputs", 8))
        ]
        parts.append(f"{a.bytes / 1000:.0f}/{b.bytes / 1000:.0f}".rjust(9))
        parts.append(f"{runs.scene * 1e3:.3f}/{runs.model * 1e3:.3f}".rjust(17))
        for first in (time_start, time_build):
            parts.append(f"{first(scene, False):.2f}/{first(scene, True):.2f}".rjust(13))
        gap = "other motion" if runs.difference is None else f"{runs.difference:.1e}"
        print(f"{scene.name:40s} {' '.join(parts)} {runs.faster:7.2f} {gap:>11s}", flush=True)


if __name__ == "__main__":
    main(*(int(argument) for argument in sys.argv[1:]))
