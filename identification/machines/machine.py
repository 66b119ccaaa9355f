"""A machine to be identified, with what reads its logs."""

import os
from abc import ABC, abstractmethod
from collections.abc import Collection, Sequence

from fmu_models.base.registry import Reference
from fmu_models.language.mechanism import Mechanism
from identification.machines.joint_laws import with_laws
from identification.machines.machine_fit import MachineFit
from identification.machines.motion import MachineLog


class Machine(ABC):
    """mechanism: as `identify_machine` takes it."""

    mechanism: Mechanism

    @abstractmethod
    def logs(
        self, paths: Sequence[str | os.PathLike[str]], *, reader: Reference | None = None, repair: Collection[str] = ()
    ) -> list[MachineLog]:
        """Logs as `identify_machine` takes them. reader, repair: as in `rig_io.read_log`.

        Raises:
            StickslipError: a log cannot be read or is not one of this machine.
        """

    def compared(self, fit: MachineFit, logs: Sequence[MachineLog], laws: Sequence[str] = ()) -> MachineFit:
        """The fit with friction laws: those that the machine's recipe asks for, else these.

        Raises:
            StickslipError: as in `with_laws`.
        """
        return with_laws(self.mechanism, fit, logs, laws)

    def known(self, cutoff: float | None) -> dict[str, float]:
        """Parameters that are not to be found, beside those that the user knows. cutoff: as in `identify_machine`."""
        return {}
