"""Which law fits, whether the contact gives way, and what to measure next."""
