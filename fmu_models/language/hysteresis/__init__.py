"""Forces with memory: a contact along a way, and its laws, one file each."""
