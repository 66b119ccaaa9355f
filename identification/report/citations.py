"""What to cite with a result."""

from fmu_models.base.version import version
from identification.fit.result import FrictionFit
from identification.machines.machine_fit import MachineFit

RIG = (
    "P. Casini, O. Giannini, F. Vestroni, Experimental evidence of non-standard bifurcations in non-smooth oscillator "
    "dynamics, Nonlinear Dynamics 46 (2006): the rig, its model and the friction law."
)
BY_ESTIMATOR = {
    "shooting": "H. G. Bock, in Numerical Treatment of Inverse Problems in Differential and Integral Equations (1983), "
    "95: multiple shooting.",
    "weak-form": "D. A. Messenger, D. M. Bortz, Multiscale Modeling & Simulation 19 (2021), 1474, and Bulletin of "
    "Mathematical Biology 85 (2023), 110: weak form and its whitening.",
    "savitzky-golay": "A. Savitzky, M. J. E. Golay, Analytical Chemistry 36 (1964), 1627: derivatives by local "
    "polynomials.",
    "whole-cycle": "L. Ljung, System Identification: Theory for the User (1999): output error.",
    "lugre": "C. Canudas de Wit, H. Olsson, K. J. Astrom, P. Lischinsky, IEEE Transactions on Automatic Control 40 "
    "(1995), 419: the LuGre model.",
}
BY_COVARIANCE = {
    "jackknife": "R. M. Bell, D. F. McCaffrey, Survey Methodology 28 (2002), 169: standard deviations by jackknife "
    "over clusters.",
    "hac": "W. K. Newey, K. D. West, Econometrica 55 (1987), 703; N. M. Kiefer, T. J. Vogelsang, Econometric Theory 21 "
    "(2005), 1130: covariance under autocorrelation, lags of 1/20 of the samples.",
    "bootstrap": "H. R. Kuensch, The Annals of Statistics 17 (1989), 1217: block bootstrap.",
}

BY_METHOD = {
    "instruments": "A. Janot, P.-O. Vandanjon, M. Gautier, IEEE Transactions on Control Systems Technology 22 (2014), "
    "132: instrumental variables from simulated motion.",
    "least squares": "M. Gautier, ICRA (1997), 2278: weighted least squares with parallel decimation.",
}


def machine_citations(fit: MachineFit) -> list[str]:
    """One sentence each: this program, and where the methods are from."""
    base = "M. Gautier, Journal of Robotic Systems 8 (1991), 485: base parameters."
    program = f"stickslip {version()}, identification of machines from logs of efforts."
    return [program, BY_METHOD[fit.method], base, BY_COVARIANCE["hac"]]


def calibration_citations() -> list[str]:
    """One sentence each: this program, and where the methods are from."""
    program = f"stickslip {version()}, calibration of models with events from measured series."
    whitening = "P. J. Brockwell, R. A. Davis, Time Series: Theory and Methods (1991): whitening by autoregressions."
    return [program, BY_ESTIMATOR["shooting"], whitening, BY_COVARIANCE["hac"]]


def citations(fit: FrictionFit) -> list[str]:
    """One sentence each: this program, the rig, and where the methods are from."""
    sources = [f"stickslip {version()}, identification of friction laws from rig logs.", RIG]
    sources += [text for text in (BY_ESTIMATOR.get(fit.estimator), BY_COVARIANCE.get(fit.covariance)) if text]
    return sources
