"""Chunks made by the workers of a Dask cluster.

A system travels as a pickle in which every FMU is its hash; the bytes of an FMU travel once to each worker, as a value
of their own that the cluster makes again where a worker is lost. A worker checks them against the hash, unpacks them in
a temporary folder, and builds the library where the FMU has none for its machine.
"""

import hashlib
import io
import pickle
from concurrent.futures import Future
from functools import lru_cache
from typing import Any

import numpy as np

from fmu_models.base.errors import StickslipError
from fmu_models.base.temporary import temporary_folder
from fmu_models.base.version import version
from fmu_models.families.jobs import Jobs, System
from fmu_models.fmu.fmu import Fmu
from fmu_models.simulation.rows import RunRows

WAIT = 30.0  # s for the scheduler to answer, and for a first worker


class Cluster:
    """The workers behind the scheduler at an address, and one system whose chunks they make."""

    def __init__(self, address: str, system: System) -> None:
        """Connect. StickslipError: no scheduler answers, or it has no workers."""
        try:
            from distributed import Client
        except ImportError as error:
            raise StickslipError("A cluster needs dask and distributed: pip install 'stickslip[cluster]'") from error
        try:
            self._client = Client(address, timeout=WAIT, set_as_default=False)
        except (OSError, ValueError, TypeError) as error:
            raise StickslipError(f"No scheduler answers at '{address}' ({error}). Start one: dask scheduler") from error
        try:
            self._client.wait_for_workers(1, timeout=WAIT)
        except TimeoutError as error:
            self._client.close()
            raise StickslipError(f"The scheduler has no workers. Start some: dask worker {address}") from error
        self._parcel, fmus = packed(system)
        # tasks of their own, not scattered data: those are gone with the workers that hold them
        self._fmus = [self._client.submit(bytes, fmu.path.read_bytes(), key=f"fmu-{fmu.sha256}") for fmu in fmus]

    def threads(self) -> int:
        """Threads of all workers together, at present."""
        workers: Any = self._client.nthreads()
        return max(1, sum(workers.values()))

    def submit(self, jobs: Jobs) -> Future[RunRows]:
        """Have a chunk made."""
        return _Far(self._client.submit(run_part, version(), self._parcel, jobs, *self._fmus, pure=False))

    def close(self) -> None:
        """Disconnect."""
        self._client.close()


class _Far(Future[RunRows]):
    """A chunk that a worker makes, anew if that worker is lost. Dask's own executor takes the rows of a worker that was
    lost just then for an error."""

    def __init__(self, there: Any) -> None:
        super().__init__()
        self._there = there
        there.add_done_callback(self._arrived)

    def _arrived(self, there: Any) -> None:
        if not self.set_running_or_notify_cancel():
            return
        try:
            self.set_result(there.result())
        except BaseException as error:
            self.set_exception(error)

    def cancel(self) -> bool:
        """Here and there."""
        self._there.cancel()
        return super().cancel()


def run_part(made_by: str, parcel: bytes, jobs: Jobs, *fmus: bytes) -> RunRows:
    """Run a part of the jobs in a worker."""
    if made_by != version():
        raise StickslipError(f"A worker has stickslip {version()}, not {made_by}. Install the same version everywhere.")
    return _unpacked(parcel, fmus).run(jobs, np.zeros(1, np.int32))


@lru_cache(maxsize=8)
def _unpacked(parcel: bytes, fmus: tuple[bytes, ...]) -> System:
    return _Unpickler(parcel, {hashlib.sha256(data).hexdigest(): _opened(data) for data in fmus}).load()


@lru_cache(maxsize=8)
def _opened(data: bytes) -> Fmu:
    with temporary_folder("carried") as folder:
        path = folder / "carried.fmu"
        path.write_bytes(data)
        return Fmu.open(path)


def packed(system: System) -> tuple[bytes, list[Fmu]]:
    """A system without its FMUs, and these."""
    import cloudpickle  # comes with distributed; takes functions that stand in no file

    fmus: list[Fmu] = []

    class Pickler(cloudpickle.Pickler):
        def persistent_id(self, obj: object) -> str | None:
            if not isinstance(obj, Fmu):
                return None
            fmus.append(obj)
            return obj.sha256

    out = io.BytesIO()
    Pickler(out).dump(system)
    return out.getvalue(), list({fmu.sha256: fmu for fmu in fmus}.values())


class _Unpickler(pickle.Unpickler):
    def __init__(self, parcel: bytes, fmus: dict[str, Fmu]) -> None:
        super().__init__(io.BytesIO(parcel))
        self._fmus = fmus

    def persistent_load(self, pid: str) -> Fmu:
        try:
            return self._fmus[pid]
        except KeyError:
            raise StickslipError(f"The FMU with the hash {pid} did not arrive whole.") from None
