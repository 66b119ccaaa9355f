"""Estimators of friction laws: one file each, with the estimator as ``ESTIMATOR``; `arcs` and `regression` are what
they share. A new one is a file here and a line in `identification.fit.fit`."""
