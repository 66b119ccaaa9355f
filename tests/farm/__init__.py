"""The farm: any FMU, run here and by tools that are not ours, with a verdict for each (``python -m tests.farm``)."""
