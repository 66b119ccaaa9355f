"""How well a solution is known, from its `Problem` and `Solution` alone."""
