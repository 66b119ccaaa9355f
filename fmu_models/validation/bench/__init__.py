"""Error against run time, method by method, on scenes and models."""
