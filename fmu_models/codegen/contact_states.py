"""What the numbers in variables ``<contact>_state`` say, by kind of contact; readers know a kind by its text."""

from __future__ import annotations

STATES = {
    "friction": "-1 slip in negative direction, 0 stick, 1 slip in positive direction, 2 away",
    "stop": "2 away, 3 touching, 4 released while still inside",
    "switch": "-1 negative side, 0 sliding, 1 positive side",
    "impact": "2 open, 3 closed, 5 chattering (closed while infinitely many small bounces die out)",
    "impact_friction": "-1 slip in negative direction, 0 stick, 1 slip in positive direction, 2 away (open)",
}
