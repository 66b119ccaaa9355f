"""Stands in for the compiler's package where everything that is compiled is to have sanitizers in it."""
