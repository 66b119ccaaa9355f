"""Fitted parameters handed on: into an FMU, a scene, an SSP parameter set or a whole SSP."""
