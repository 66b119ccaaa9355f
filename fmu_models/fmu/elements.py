"""Names of the elements of an array variable, as columns of a table need them: ``A[2,1]``, counted from 1."""

from collections.abc import Container, Sequence

import numpy as np


def element_names(name: str, shape: Sequence[int]) -> list[str]:
    """The elements in the order in which FMI passes them, the last index fastest; a scalar is its own element."""
    if not shape:
        return [name]
    return [f"{name}[{','.join(str(i + 1) for i in index)}]" for index in np.ndindex(*shape)]


def owner(name: str, variables: Container[str]) -> str:
    """The variable of which ``name`` is an element, or ``name`` itself."""
    array = name.rpartition("[")[0]
    return array if name not in variables and array in variables and name.endswith("]") else name
