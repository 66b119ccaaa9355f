"""Colours of all pictures."""

# Okabe and Ito: told apart by all kinds of eyes
COLOURS = (
    *("#0072B2", "#E69F00", "#009E73", "#CC79A7", "#56B4E9", "#D55E00", "#F0E442", "#999999"),
    *("#003A59", "#7A5500", "#00513B", "#6B3D54", "#B3DDF5", "#F2B48F", "#FAF5B0", "#DDDDDD"),
)
