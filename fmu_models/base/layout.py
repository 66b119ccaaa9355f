"""Files in an FMU of this suite beside those of the standard."""

SIGNALS = "extra/stickslip/signals.json"  # how often the signals repeat that a model drives itself
