"""Estimators: of friction laws one file each, with the estimator as ``ESTIMATOR``, on what `shooting_segments` and
`regression` share (a new one is a file here and a line in `identification.fit.fit`); of machines `inverse_dynamics`."""
