"""Work shared by threads of this process: libraries that compute outside Python's lock run on several cores.

Each item is one call, whoever makes it, and BLAS stays with one thread, so that a result does not depend on how many
share the work.
"""

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from typing import TypeVar

Item = TypeVar("Item")
Value = TypeVar("Value")


def in_threads(function: Callable[[Item], Value], items: Sequence[Item], workers: int | None = None) -> list[Value]:
    """``function`` of each item, in their order. workers: threads, at most; None for as many as there are cores.

    What the first failing item raises is raised here; an interrupt leaves out what has not begun.
    """
    count = min(workers or os.cpu_count() or 1, len(items))
    if count < 2:
        return [function(item) for item in items]
    with ThreadPoolExecutor(count, "work") as pool:
        return list(pool.map(function, items))


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """BLAS and OpenMP compute in the thread that calls them: small matrices are slower in several."""
    import scipy.linalg  # noqa: F401  # has a BLAS of its own, and only one that is loaded can be told
    from threadpoolctl import threadpool_limits

    with threadpool_limits(1):
        yield
