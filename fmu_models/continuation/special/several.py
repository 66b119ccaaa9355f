"""Where a motion comes to several events at once, and the motions beyond that have some of them.

A motion with a symmetry touches in both its halves at one value of the parameter; every motion taken n times touches n
times. Each of these touches may become an event or not: of m touches in n periods there are 2^(mn) words. Of those that
differ by more than where they begin, and are not of a shorter period, each is tried:

    displacement of the start by which the chosen misses become events, and the others more of a miss: what the events
    then do to the end, b, period by period, gives the motion with these events to first order

        total = sum over the periods c of M^(n - 1 - c) b_c        [J; grad h] dz = -(total, h)

    and Newton's method with the speed of the first of them as border the motion itself (discontinuous.py).
"""

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from functools import cache, partial
from itertools import product

import numpy as np

from fmu_models.continuation.problem.node import Lost, Node, look
from fmu_models.continuation.problem.problem import TIE, Passing, Vector
from fmu_models.continuation.special.discontinuous import (
    DEPTHS,
    Touch,
    begun_after,
    from_miss,
    new_event,
    relative,
    stepped,
    with_speed,
)
from fmu_models.continuation.step.same_motion import images

TOGETHER = 1e-6  # misses are at once that are all so small, in their change by a unit of u
SPEEDS = (1e-3, 3e-3, 1e-2)  # speeds of the impacts that a motion with all of them begins with
Letters = tuple[tuple[int, ...], ...]  # letters of a word: which of the misses of a period become events


def at_once(touch: Touch) -> list[Passing]:
    """All near misses that become events at the point, that of the touch first."""
    node = touch.node
    n = node.problem.width

    def comes(passing: Passing) -> bool:
        """Whether it becomes an event at the point, and would not at once beside it, wherever that is."""
        value = passing.value + float(passing.gradient @ (touch.z - node.z))
        plain = passing.slot != TIE and not passing.turned and not passing.begins and passing.gradient[:n].any()
        return bool(plain and abs(value) <= TOGETHER * passing.size(node.scales))

    others = [miss for miss in node.seen.misses if miss is not touch.miss and comes(miss)]
    return [touch.miss, *others] if comes(touch.miss) else [touch.miss]


def other_words(touch: Touch, times: int = 1) -> Iterator[Node]:
    """Motions beside the point, so many periods long, that have some of the events; those with most of them first.

    Each has a small speed of its first event, and a tangent that leads away.
    """
    misses = at_once(touch)
    jumps = _jumps(touch, misses)
    for letters in _words(len(misses), times):
        if times == 1 and len(misses) > len(letters[0]) == 1:
            placed = _placed(touch, misses[letters[0][0]])
            solution = None if placed is None else _alone(placed)
        else:
            solution = _with_events(touch, misses, letters, jumps)
        if solution is not None:
            yield solution


def _placed(touch: Touch, miss: Passing) -> Touch | None:
    """The touch of one of the misses, begun after it: then none of the others comes after it."""
    try:
        node = begun_after(touch.node, miss.time)
        same = node.seen.match(miss, (miss.time - touch.node.seen.length) % node.seen.length)
        matches = (candidate for candidate in node.seen.misses if candidate.key == miss.key)
        latest = max(matches, key=lambda candidate: candidate.time, default=same)
        return None if latest is None else from_miss(node, latest)
    except Lost:
        return None


def _alone(touch: Touch) -> Node | None:
    misses = at_once(touch)
    return _with_events(touch, misses, ((0,),), _jumps(touch, misses))


def _words(misses: int, times: int) -> list[Letters]:
    """Letters of all words, one each of those that differ in their begin alone, none that repeats a shorter one."""
    subsets = [tuple(i for i in range(misses) if mask >> i & 1) for mask in range(2**misses)]
    words = []
    for word in product(subsets, repeat=times):
        turns = [word[i:] + word[:i] for i in range(times)]
        if word == max(turns) and word not in turns[1:] and any(word):
            words.append(word)
    return sorted(words, key=lambda word: -sum(map(len, word)))


def with_all(touch: Touch) -> Node | None:
    """The motion of the same period that has all of the events; None if none is found."""
    misses = at_once(touch)
    node = _with_events(touch, misses, (tuple(range(len(misses))),), _jumps(touch, misses))
    return node or _superposed(touch, misses)


def _superposed(touch: Touch, misses: Sequence[Passing]) -> Node | None:
    """The motion with all of several impacts, from those with one each; None if none is found.

    An impact of speed v moves what comes after by v, and a miss that comes after becomes an impact of a speed like the
    root of v, unless the start makes up for it. To first order in the speeds v the motions add up, and along the branch
    by t:

        u = u0 + sum_i a_i v_i + t tangent        h_j = sum over i other than j of c_ji v_i + t dh_j = 0

    with a_i and c_ji, what the miss j becomes, of the motion that has the impact i alone.
    """
    node, problem, scales = touch.node, touch.node.problem, touch.node.scales
    many = len(misses)
    directions, rates = np.empty((many, len(touch.u))), np.zeros((many, many + 1))
    for i, miss in enumerate(misses):
        placed = _placed(touch, miss)
        alone = None if placed is None else _alone(placed)
        if alone is None:
            return None
        z = min(images(alone, node), key=lambda image: float(np.abs(image / scales - touch.u).max()))
        seen = look(problem, z)
        event = None if seen is None else new_event(seen, node.seen, miss)
        if seen is None or event is None:
            return None
        directions[i] = (z / scales - touch.u) / event.value
        rates[i, many] = node.along(miss.gradient)
        for j in set(range(many)) - {i}:
            remaining = seen.match(misses[j])
            if remaining is None:
                return None
            rates[j, i] = remaining.value / event.value
    shares = np.linalg.svd(rates)[2][-1]
    shares *= np.sign(shares[0]) / np.abs(shares[:many]).max()
    if shares[:many].min() <= 0.0:
        return None
    begun = Counter((miss.contact, miss.before) for miss in misses)
    for speed in SPEEDS:
        v = shares * speed
        prediction = _of_speeds(touch, misses, touch.u + v[:many] @ directions + v[many] * node.tangent, v[:many])
        solution = None if prediction is None else with_speed(problem, scales, *prediction, touch)
        if solution is not None and _begun(solution, misses) - _begun(node, misses) == begun:
            return solution
    return None


def _of_speeds(touch: Touch, misses: Sequence[Passing], u: Vector, speeds: Vector) -> tuple[Vector, Passing] | None:
    """A start near u whose run has all events at their speeds, and the first of them; by Newton's method for the
    squares of the speeds, which are smooth where an event begins."""
    problem, scales, n = touch.node.problem, touch.node.scales, touch.node.problem.width
    rows = np.array([miss.gradient[:n] * scales[:n] for miss in misses])

    def of(u: Vector) -> list[Passing] | None:
        seen = look(problem, u * scales)
        events = [new_event(seen, touch.node.seen, miss) for miss in misses] if seen is not None else [None]
        return None if None in events else [event for event in events if event is not None]

    down = np.zeros_like(u)
    down[:n] = np.linalg.lstsq(rows, speeds**2, rcond=None)[0]
    begins = ((u - depth * down, of(u - depth * down)) for depth in (0.5, 1.0, 2.0, 4.0))
    u, events = next(((guess, seen) for guess, seen in begins if seen is not None), (u, None))
    for _ in range(20):
        if events is None:
            return None
        off = np.array([event.value for event in events]) ** 2 - speeds**2
        if np.abs(off).max() <= 1e-6 * speeds.min() ** 2:
            return u, events[0]
        slopes = np.array([2.0 * event.value * event.gradient[:n] * scales[:n] for event in events])
        step = np.zeros_like(u)
        step[:n] = np.linalg.lstsq(slopes, off, rcond=None)[0]
        trials = ((u - step / 2**k, of(u - step / 2**k)) for k in range(12))
        u, events = next(((guess, seen) for guess, seen in trials if seen is not None), (u, None))
    return None


def is_part(touch: Touch, node: Node) -> bool:
    """Whether a motion beside the point has some of the events that come there, and not all."""
    misses = at_once(touch)
    new = _begun(node, misses) - _begun(touch.node, misses)
    return len(misses) > 1 and new.total() < len(misses)


Jumps = Callable[[tuple[int, ...], float], tuple[list[Passing], Vector] | None]


def _jumps(touch: Touch, misses: Sequence[Passing]) -> Jumps:
    """What events do to the end of a period, by which of the misses become events and how deep; computed once each."""
    return cache(partial(_jump, touch, misses))


def _jump(
    touch: Touch, misses: Sequence[Passing], chosen: tuple[int, ...], depth: float
) -> tuple[list[Passing], Vector] | None:
    """The events, and the jump in the rows of the scaled residual."""
    node, scales = touch.node, touch.node.scales
    if not chosen:
        return [], np.zeros(len(node.seen.residual))
    n = node.problem.width
    rows = np.array([miss.gradient[:n] * scales[:n] for miss in misses])
    rows /= np.linalg.norm(rows, axis=1)[:, None]
    depths = np.array([-depth if i in chosen else depth for i in range(len(misses))])
    moved = touch.u.copy()
    moved[:n] += np.linalg.lstsq(rows, depths, rcond=1e-6)[0]
    seen = look(node.problem, moved * scales)
    if seen is None:
        return None
    events = [new_event(seen, node.seen, misses[i]) for i in chosen]
    if any(event is None or not np.isfinite(event.gradient).all() for event in events):
        return None
    return [event for event in events if event is not None], relative(node, seen, moved - touch.u)


def _with_events(touch: Touch, misses: Sequence[Passing], letters: Letters, jumps: Jumps) -> Node | None:
    """The motion whose periods have these of the events; None if none is found."""
    times, node = len(letters), touch.node
    long = _long(touch, times)
    if long is None:
        return None
    n, width = node.problem.width, long.node.problem.width
    monodromy = (
        node.seen.monodromy / node.scales[: len(node.problem.states), None] * node.scales[: len(node.problem.states)]
    )
    counts = Counter((misses[i].contact, misses[i].before) for letter in letters for i in letter)
    for depth in DEPTHS:
        effects = [jumps(letter, depth) for letter in letters]
        total, events = np.zeros(len(long.node.seen.residual)), []
        for c, jump in enumerate(effects):
            if jump is None:
                break
            events += [(c, event) for event in jump[0]]
            if c and width == n:
                total[:n] = monodromy @ total[:n]
            begin = c * n if width > n else 0
            total[begin : begin + n] += jump[1][:n]
            total[width:] += jump[1][n:]
        else:
            c, first = events[0]
            later = c * node.seen.length
            try:
                step = stepped(long.node, _copy(misses[letters[c][0]], long, later), total, depth)
            except Lost:
                return None
            guess = long.u + step
            seen = look(long.node.problem, guess * long.node.scales)
            # its speed is that of the guess, where it has terms of second order
            event = None if seen is None else seen.match(first, first.time + later)
            if event is None:
                continue
            solution = with_speed(long.node.problem, long.node.scales, guess, event, long)
            if solution is None or (times % 2 == 0 and solution.repeats()):
                continue
            if _begun(solution, misses) - _begun(long.node, misses) == counts:
                return solution
    return None


def _long(touch: Touch, times: int) -> Touch | None:
    """The touch of the motion taken so many times."""
    if times == 1:
        return touch
    long = touch.node.folded(times)
    miss = None if long is None else long.seen.match(touch.miss)
    return None if long is None or miss is None else Touch(long, long.problem.unfolded(touch.z, times), miss)


def _copy(miss: Passing, long: Touch, later: float) -> Passing:
    """A miss as one of the longer motion, so much later."""
    passing = long.node.seen.match(miss, miss.time + later)
    if passing is None:
        raise Lost("the motion cannot be followed for so long")
    return passing


def _begun(node: Node, like: Sequence[Passing]) -> Counter[tuple[str, int]]:
    """How often each of some events begins."""
    kinds = {(event.contact, event.before) for event in like}
    return Counter((contact, before) for contact, before, _ in node.word if (contact, before) in kinds)
