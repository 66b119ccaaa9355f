"""Colours of all pictures."""

# after Okabe and Ito, told apart by all kinds of eyes; the first six by their greys too, in print without colour
COLOURS = (
    *("#0072B2", "#E69F00", "#00513B", "#9CCFF2", "#CC79A7", "#D55E00", "#003A59", "#F0E442"),
    *("#009E73", "#56B4E9", "#999999", "#7A5500", "#6B3D54", "#F2B48F", "#FAF5B0", "#DDDDDD"),
)
