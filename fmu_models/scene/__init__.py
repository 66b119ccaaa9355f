"""Scenes: what an experiment is made of, in one TOML file, and the smallest FMU that can do it."""
