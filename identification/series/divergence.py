"""The largest exponent from how neighbours part: after Rosenstein, Kantz and Wolf, each with what it rests on.

Rosenstein: mean of ln |y_i(t) - y_j(t)| over points and their nearest neighbour. Kantz: mean over points of the ln of
the mean distance of all neighbours in a ball. The slope of these curves where they are straight, the plateau, is the
exponent. Wolf: one neighbour is followed until it is far; then another takes its place that is near and lies the same
way; the exponent is the mean growth. Neighbours nearer than noise are passed over: their distance is noise. All three
still come out low in noise (a tenth to a third at 1 %), for some of what is followed has not yet turned into the
fastest direction and some is as far apart as it can be; `tangent.tangent_exponent` allows for both.

Errors: from a bootstrap of blocks of points along the series, and of curves also from the choice of the plateau.

Sources: Rosenstein, Collins, De Luca, Physica D 65 (1993); Kantz, Phys. Lett. A 185 (1994); Wolf, Swift, Swinney,
Vastano, Physica D 16 (1985).
"""

from dataclasses import dataclass

import numpy as np

REFERENCES = 1500
BEYOND = 3.0  # times the noise of a distance, where neighbours begin
NEIGHBOURS = 20  # in a ball
HORIZON = 12  # cycles
PLATEAUS = ((0.1, 0.5), (0.2, 0.6), (0.3, 0.7))  # of the rise of a curve, by height
CYCLE_STEPS = 10  # values of a curve a cycle
RESAMPLES = 200
BLOCKS = 40  # of points along the series, which the bootstrap draws
NARROW = 0.5  # rad, the most by which Wolf's replacement may turn, if there is a choice
LONG = 0.05  # of the size of the motion, beyond which another neighbour takes its place
CANDIDATES = 40


@dataclass(frozen=True)
class Divergence:
    """How neighbours part. method; value, error: exponent per sample and its standard deviation; lags: (m,) samples
    and curve: (m,) mean logarithms of distance, empty of Wolf; plateau: first and last lag of the straight part."""

    method: str
    value: float
    error: float
    lags: np.ndarray
    curve: np.ndarray
    plateau: tuple[float, float] = (0.0, 0.0)


def divergences(points: np.ndarray, cycle: int, noise: float, seed: int = 0) -> tuple[Divergence, ...]:
    """After Rosenstein, Kantz and Wolf. points: (n, d) along the series; cycle: samples; noise: standard deviation in
    each coordinate of the points."""
    from scipy.spatial import KDTree

    random = np.random.default_rng(seed)
    horizon = min(HORIZON * cycle, len(points) // 4)
    count = len(points) - horizon
    references = np.unique(np.linspace(0, count - 1, min(REFERENCES, count)).astype(int))
    tree = KDTree(points[:count])
    least = BEYOND * noise * np.sqrt(2 * points.shape[1])
    queried = min(NEIGHBOURS + 2 * cycle + 2, count)
    distance, others = tree.query(points[references], k=queried)
    # where the nearest are nearer than noise, those that follow are taken
    if least > np.median(distance[:, -1]):
        distance, others = tree.query(points[references], k=min(4 * queried, count))
    good = (np.abs(others - references[:, None]) > cycle) & (distance > np.minimum(least, distance[:, -5:-4]))
    order = np.argsort(~good, axis=1, kind="stable")[:, :NEIGHBOURS]
    others, good = (np.take_along_axis(table, order, 1) for table in (others, good))
    lags = np.unique(np.linspace(0, horizon, HORIZON * min(CYCLE_STEPS, cycle) + 1).astype(int))
    separations = np.empty((len(lags), *others.shape))
    for index, lag in enumerate(lags):
        separations[index] = np.linalg.norm(points[others + lag] - points[references + lag][:, None], axis=2)
    separations = np.maximum(separations, 1e-300)
    alone = np.log(separations[:, :, 0])
    ball = np.log((separations * good).sum(2) / np.maximum(good.sum(1), 1))
    has = good.any(1)
    curves = (("Rosenstein", alone[:, has]), ("Kantz", ball[:, has]))
    exponents = [_of_curve(name, lags, logs, cycle, random) for name, logs in curves]
    return (*exponents, _wolf(points[: count + cycle], cycle, least, tree, random))


def resampled(values: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """Means (`RESAMPLES`, ...) of values (n, ...) along a series, blocks of which are drawn again and again."""
    blocks = np.array([block.mean(0) for block in np.array_split(values, min(BLOCKS, len(values)))])
    return blocks[random.integers(0, len(blocks), (RESAMPLES, len(blocks)))].mean(1)


def _of_curve(method: str, lags: np.ndarray, logs: np.ndarray, cycle: int, random: np.random.Generator) -> Divergence:
    """The slope of the mean of logarithms (m, n) over its plateau."""
    curve = logs.mean(1)
    window = min(CYCLE_STEPS, cycle)
    smooth = np.convolve(
        np.pad(curve, (window // 2, window - 1 - window // 2), mode="edge"), np.ones(window) / window, "valid"
    )
    start = min(window, len(lags) - 3)  # in the first cycle differences turn into the fastest direction
    floor, top = smooth[start], float(np.mean(smooth[-2 * window :]))
    spans = []
    for low, high in PLATEAUS:
        first = start + int(np.argmax(smooth[start:] >= floor + low * (top - floor)))
        last = start + int(np.argmax(smooth[start:] >= floor + high * (top - floor)))
        last = max(last, first + max(window // 2, 3)) if top - floor > 0.2 else len(lags) - 1
        spans.append((min(first, len(lags) - 4), min(last, len(lags) - 1)))
    slopes = [np.polyfit(lags[a : b + 1], smooth[a : b + 1], 1)[0] for a, b in spans]
    first, last = spans[1]
    drawn = resampled(logs[first : last + 1].T, random)
    scatter = np.polyfit(lags[first : last + 1], drawn.T, 1)[0].std(ddof=1)
    error = float(np.hypot(scatter, np.std(slopes, ddof=1)))
    return Divergence(method, float(slopes[1]), error, lags, curve, (float(lags[first]), float(lags[last])))


def _wolf(points, cycle: int, least: float, tree, random: np.random.Generator) -> Divergence:
    """After Wolf, along the whole series; a map is followed step by step."""
    step = max(cycle // 2, 1)
    size = float(np.sqrt(points.var(0).sum()))
    farthest = max(2 * least, LONG * size)
    neighbour, direction, grown = -1, None, []
    for at in range(0, tree.n - step, step):
        offset = points[neighbour] - points[at] if 0 <= neighbour < tree.n - step else np.zeros(0)
        if not (len(offset) and least / 2 < np.linalg.norm(offset) < farthest):
            distance, others = tree.query(points[at], k=min(CANDIDATES + 2 * cycle, tree.n))
            allowed = (np.abs(others - at) > cycle) & (distance > max(least, 1e-9 * size)) & (others < tree.n - step)
            if not allowed.any():
                continue
            places = np.flatnonzero(allowed)[:CANDIDATES]
            if direction is not None:
                offsets = points[others[places]] - points[at]
                turned = np.arccos(np.clip(np.abs(offsets @ direction) / distance[places], 0, 1))
                narrow = np.flatnonzero(turned < NARROW)
                places = places[narrow[:1]] if len(narrow) else places[[int(np.argmin(turned))]]
            neighbour = int(others[places[0]])
            offset = points[neighbour] - points[at]
        neighbour += step
        difference = points[neighbour] - points[at + step]
        length = float(np.linalg.norm(difference))
        if length > 0:
            grown.append(np.log(length / np.linalg.norm(offset)) / step)
            direction = difference / length
    rates = np.array(grown) if grown else np.zeros(2)
    return Divergence(
        "Wolf", float(rates.mean()), float(resampled(rates, random).std(ddof=1)), np.zeros(0), np.zeros(0)
    )
