"""``python -m ziglang cc ...`` by a compiler of the system that has sanitizers: SANITIZING_CC names it."""

from __future__ import annotations

import os
import subprocess
import sys

SANITIZERS = "address,undefined,float-cast-overflow"
ADDED = (
    *("-O1", "-g1", "-w", "-fno-omit-frame-pointer", f"-fsanitize={SANITIZERS}", "-fno-sanitize-recover=all"),
    # one address in a generated table may serve several names
    "-fno-sanitize=alignment",
)
# they undo the above, forbid what the sanitizers bring along, or are known to zig alone
DROPPED = ("-O2", "-s", "-Werror", "-fno-sanitize=undefined", "-Wl,-z,defs", "-rtlib=none")


def main(arguments: list[str]) -> int:
    """Compile; returns the exit code of the compiler."""
    language, *given = arguments
    kept = [option for option in given if option not in DROPPED]
    while "-target" in kept:
        at = kept.index("-target")
        del kept[at : at + 2]
    compiler = os.environ["SANITIZING_CC"]
    command = [compiler, *(("-x", "c++") if language == "c++" else ()), *kept, *ADDED]
    # the compiler itself is not what is examined
    environment = {name: value for name, value in os.environ.items() if name != "LD_PRELOAD"}
    return subprocess.run(command, env=environment, check=False).returncode


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
