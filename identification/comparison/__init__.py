"""The fitted model held against measurements: portraits, families of drive speeds, bifurcations."""
