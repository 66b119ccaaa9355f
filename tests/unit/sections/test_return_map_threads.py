"""A return map that several threads share gives each what it gives one alone."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np

from fmu_models import ReturnMap, Section, load


def test_threads_share_a_return_map():
    toy = ReturnMap(load("woodpecker"), "phi_S", section=Section("w_S"), cap=4.0, accept={"lower_friction": 0})
    starts = np.linspace(-0.75, -0.48, 400)
    e = np.array([0.4, 0.5])
    alone = [
        toy.at(eN1=float(e[k % 2])).step(starts[k : k + 1, None], derivative=False).points[0, 0] for k in range(400)
    ]

    def shared(k: int) -> float:
        varied = {} if k % 2 else {"eN1": e[:1]}  # 0.5 is the default
        return float(toy.step(starts[k : k + 1, None], varied, derivative=False).points[0, 0])

    with ThreadPoolExecutor(4) as threads:
        assert list(threads.map(shared, range(400))) == alone
