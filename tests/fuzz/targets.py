"""All there is to hunt in, by name."""

from __future__ import annotations

from declarations import DECLARATIONS
from documents import DOCUMENTS
from fmi_calls import CALLS_OF_FMI
from lies import LIES

TARGETS = {target.name: target for target in (CALLS_OF_FMI, LIES, DECLARATIONS, *DOCUMENTS)}
