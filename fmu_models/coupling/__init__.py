"""Several FMUs as one system: what it is made of, its files, its runs."""
