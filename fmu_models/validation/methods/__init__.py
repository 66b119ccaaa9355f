"""Methods of integration on the same declarations, side by side; one file each."""
