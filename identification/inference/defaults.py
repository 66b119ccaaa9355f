"""What a fit does where nothing else is asked for: of the commands as of Python, and typed nowhere else."""

AUTO, NONE = "auto", "none"
ESTIMATOR, LAW = "shooting", "Conti"
DISTURBANCES = AUTO  # those that the logs show
LAW_SPREAD = AUTO  # over laws within reach
COVARIANCE, DRAWS, SEED = "jackknife", 200, 0
