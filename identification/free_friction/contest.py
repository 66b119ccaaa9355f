"""One contest of all that may explain slips beside their friction: disturbances, and constants that are wrong.

Friction is free of any law (`curve`), so that no disturbance is put on a law's form and no form on a disturbance; what
no candidate explains is a torque of its own. At the solution with those that are chosen, the columns of all candidates
are made at once, and every set of them is one small system of equations. A set is worth

    max over tau of  ln L - PRICE [tau > 0]  -  (count of the set) ln(count of candidates).

The best single one is taken up where it gains more than `GAIN`, the best pair where it gains so much more than the best
single one; then all is solved anew, and what does not cost `GAIN` is taken away. What is taken away is held at zero and
not left out: the equations are those of where it stands.

How large causes are beforehand decides between two that fit as well, and nobody knows it: what is named has beside it
those in its place that are worth as much, or of which new slips would be expected to be as likely (Akaike), within
`GAIN`. Of two right predictions that are apart by D, in squares of the noise, ln L of the wrong one leads by
-D/2 +- sqrt(D): by `GAIN` in 1 of 140 at most.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations

import numpy as np

from identification.disturbances.term import FRICTION, LASER, SENSOR_UNITS, DisturbanceTerm, misread
from identification.disturbances.terms import ranked, terms_of
from identification.estimators.segment_runs import ShootingSegment
from identification.estimators.shooting_segments import SILENT
from identification.free_friction.curve import (
    OFF,
    TAUS,
    Gram,
    Known,
    Least,
    begun,
    curve_of,
    follows,
    settled,
    slips_of,
)
from identification.free_friction.evidence import Evidence
from identification.free_friction.guess import AHEAD, WRONG, YIELDS, Guess
from identification.free_friction.responses import rows_of
from identification.free_friction.result import COEFFICIENTS, FreeFriction
from identification.free_friction.slips import Slips
from identification.inference.uncertainty import autocorrelation
from identification.measurement.pooled import Pool

ASTRAY = 4.0  # times the squares of the noise: slips that even an unexplained torque does not follow
GAIN = 3.0  # of ln L, beyond what a candidate costs
BESIDE = 200.0  # of 2 ln L, that an explanation adds which leaves something unexplained: less is the best of a list
MICRO_SLIP = "micro-slip"  # of a contact that gives way in stick, as the fit says anyway
COLOURED = 4.0  # standard deviations of the correlation of neighbours, by which what is left is no noise
PRICE = 1.5  # of ln L, of a torque that nothing explains
PAIRED = 7  # of single candidates, whose pairs are tried
ROUNDS = 10
NOTHING: Mapping[str, tuple[float, float]] = {}
SURE = 1e4  # times surer that what is taken away is 0


@dataclass(frozen=True)
class Explanation:
    """A disturbance that slips show. size: greatest change that it makes, either way, relative, or greatest error of a
    sensor, in ``unit``; gain: of 2 ln L, the others being there; values: of its terms; alike: candidates in its place
    that the slips do not tell from it."""

    name: str
    size: float
    unit: str
    gain: float
    terms: tuple[DisturbanceTerm, ...]
    values: tuple[float, ...]
    alike: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Verdict:
    """What slips say without a law. curve: friction, with what was found; evidence: what that says of any law;
    explanations: the strongest first; wrong: constants that are off, and others that would be in their place: the
    logarithm of each over what is stated, and standard deviations."""

    curve: FreeFriction
    evidence: Evidence
    explanations: tuple[Explanation, ...]
    wrong: Mapping[str, tuple[float, float]]


def contest(
    ready: Pool, segments: Sequence[ShootingSegment], noise_known: bool, named: Sequence[str] | None = None
) -> Verdict | None:
    """The verdict on slips; None where they do not tell friction without a law: those of two discs, or such as no
    torque follows. ready: logs of one rig; segments: their slips; noise_known: whether the noise of their sensors is
    known; otherwise its size is what no friction follows; named: disturbances that are taken for granted, and no
    others; None: those that the slips show. StickslipError: slips too short for inverse dynamics, or logs that cannot
    show what is named."""
    if len(ready.contacts) != 1:
        return None
    bare, samples = slips_of(ready, segments), sum(len(segment.time) for segment in segments)
    field = _Field.of(ready, named, bare.soft > 0)
    with np.errstate(all="ignore"):  # a search from far off may try what no motion follows
        guess = begun(bare)
        misfit = bare.squares(guess) / samples
        if misfit < ASTRAY:  # only what has a size that is known
            field = replace(field, evident=tuple(name for name in field.evident if not field.count(name)))
        if field.evident:
            bare = field.slips(bare, field.evident)
            guess = begun(bare)
            misfit = bare.squares(guess) / samples
        if not misfit < ASTRAY and (noise_known or not np.isfinite(misfit)):
            return None
        least = 1.0 if any(segment.lines is not None for segment in segments) else 0.0  # edges lie no nearer
        louder = 1.0 if noise_known else max(float(np.sqrt(misfit)), least)
        return _judged(field, bare.with_noise(louder), guess, named)


def _judged(field: _Field, bare: Slips, guess: Guess, named: Sequence[str] | None) -> Verdict:
    chosen = field.evident if named is None else tuple(field.columns)
    every, noise = field.slips(bare, tuple(field.columns)), _neighbours(bare, guess)

    def solved(
        guess: Guess, chosen: tuple[str, ...], near: tuple[float, float] | None = None
    ) -> tuple[Slips, Guess, float, float, _Table]:
        slips = field.slips(bare, chosen)
        guess, tau, followed = settled(slips, guess, near)
        return slips, guess, tau, followed, _Table(field, every, guess, chosen)

    slips, guess, tau, widest, table = solved(guess, chosen)
    first = guess, tau
    if named is not None and not named:
        return _verdict(slips, guess, tau)
    seen = {frozenset(chosen)}
    while named is None and len(seen) <= ROUNDS and frozenset(better := table.better()) not in seen:
        seen.add(frozenset(better))
        try:
            moved, near = table.moved(better)
            ahead = solved(moved, better, (near, widest))
            followed = follows(*ahead[:2], slips.squares(guess))
            # what is taken away may cost up to `GAIN`, what is added must gain where it is solved too
            if not followed or not ahead[-1].worth(better) > table.worth(chosen) - GAIN * (len(better) < len(chosen)):
                break
        except np.linalg.LinAlgError:  # likely to first order only: with it slips are not followed
            break
        (slips, guess, tau, widest, table), chosen = ahead, better
    explanations = [table.explanation(slips, name) for name in chosen if name in field.terms]
    sought = [finding for finding in explanations if finding.name not in field.evident]
    if named is None and sought:
        if tau > TAUS[0]:  # as much is left as was there, or little was added
            listed = tau >= first[1] or any(finding.gain < BESIDE for finding in sought)
        else:
            listed = _neighbours(slips, guess) > noise + COLOURED
        if listed:  # the best of a list, no explanation
            return _verdict(bare, *first, [finding for finding in explanations if finding not in sought])
    wrong = {}
    constants = {name for name in field.columns if name not in field.terms} - {MICRO_SLIP}
    for name in (name for name in chosen if name in constants):
        for one in (name, *(one for one in table.alike(name) if one in constants)):
            off = guess.shared[name + WRONG] if one == name else table.value(one, one + WRONG, without=name)
            wrong[one] = off, float(np.sqrt(2 * max(table.lead(name), 0.0)))
    return _verdict(slips, guess, tau, sorted(explanations, key=lambda finding: -finding.gain), wrong)


def _neighbours(slips: Slips, guess: Guess) -> float:
    """The correlation of neighbouring residuals in slips, over its deviation in white noise; 0 where they are smaller
    than any noise is known to be."""
    residuals = [row.residual for row in rows_of(slips, guess)]
    cluster, every = np.repeat(np.arange(len(residuals)), list(map(len, residuals))), np.concatenate(residuals)
    if float(np.mean(every**2)) < SILENT**2:
        return 0.0
    return autocorrelation(every, cluster) * float(np.sqrt(len(cluster)))


def _verdict(
    slips: Slips,
    guess: Guess,
    tau: float,
    explanations: Sequence[Explanation] = (),
    wrong: Mapping[str, tuple[float, float]] = NOTHING,
) -> Verdict:
    return Verdict(curve_of(slips, guess, tau), Evidence.of(slips, guess, tau), tuple(explanations), wrong)


@dataclass(frozen=True, eq=False)
class _Field:
    """Candidates. columns: names of what is shared, by candidate; terms: of the disturbances among them; rivals: pairs
    of which one is taken; evident: those that logs show without a contest."""

    columns: Mapping[str, tuple[str, ...]]
    terms: Mapping[str, tuple[DisturbanceTerm, ...]]
    rivals: frozenset[frozenset[str]]
    evident: tuple[str, ...] = ()

    @classmethod
    def of(cls, ready: Pool, named: Sequence[str] | None, soft: bool) -> _Field:
        """Of what logs can show, or of what is named. soft: whether the contact gives way in stick."""
        disturbances = {name: one for name, one in ranked(named).items() if named is not None or not one.hidden(ready)}
        terms = {name: tuple(term for term in terms_of(ready, [name]) if term.cause == name) for name in disturbances}
        stated = {"gain", *(prior.name for prior in ready.priors)}
        columns = {
            name: (
                *(term.name for term in mine),
                *(constant + WRONG for constant in disturbances[name].unsettles if constant in stated),
            )
            for name, mine in terms.items()
        }
        if named is None:
            columns |= {prior.name: (prior.name + WRONG,) for prior in ready.priors if prior.name in OFF}
        columns |= {MICRO_SLIP: (YIELDS, AHEAD)} if soft else {}
        pairs = {frozenset((name, one.same_as)) for name, one in disturbances.items() if one.same_as}
        pairs |= {frozenset((name, one.mimics)) for name, one in disturbances.items() if one.mimics}
        return cls(columns, terms, frozenset(pairs), tuple(name for name, one in disturbances.items() if one.evident))

    def count(self, name: str) -> int:
        """Columns of a candidate whose size nothing tells beforehand."""
        return len(self.columns[name]) - sum(term.random for term in self.terms.get(name, ()))

    def slips(self, bare: Slips, chosen: Sequence[str]) -> Slips:
        """Slips with the columns of these candidates, those that they have among them."""
        terms = dict.fromkeys((*bare.terms, *(term for name in chosen for term in self.terms.get(name, ()))))
        names = dict.fromkeys((*bare.names, *(column for name in chosen for column in self.columns[name])))
        return bare.under((*terms,), (*names,))


@dataclass(frozen=True, eq=False)
class _Table:
    """What sets of candidates are worth at one guess. slips: with the columns of all."""

    field: _Field
    slips: Slips
    guess: Guess
    chosen: tuple[str, ...]

    @cached_property
    def _grams(self) -> list[Gram]:
        rows = rows_of(self.slips, self.guess)
        return [Gram.of(rows, self.guess, tau) for tau in TAUS]

    @cached_property
    def _known(self) -> Known:
        return Known.of(self.slips)

    @cached_property
    def _places(self) -> dict[str, np.ndarray]:
        positions = {name: number for number, name in enumerate(self.slips.names, COEFFICIENTS)}
        return {name: np.array([positions[c] for c in columns]) for name, columns in self.field.columns.items()}

    @cached_property
    def _base(self) -> np.ndarray:
        candidates = np.concatenate([*self._places.values()])
        return np.setdiff1d(np.arange(COEFFICIENTS + len(self.slips.names)), candidates)

    @cached_property
    def _likelihoods(self) -> dict[frozenset[str], float]:
        return {}

    def likelihood(self, chosen: Sequence[str]) -> float:
        """ln L of a set, with the tau that it has most likely, less what that costs."""
        key = frozenset(chosen)
        if key not in self._likelihoods:
            self._likelihoods[key] = max(
                least.likelihood - PRICE * (tau > TAUS[0]) for tau, least in zip(TAUS, self._least(key), strict=True)
            )
        return self._likelihoods[key]

    def _least(self, chosen: Iterable[str]) -> Iterator[Least]:
        """The least sum of a set for each tau; what is taken away is held at 0."""
        staying = set(chosen)
        moving, held = self._columns(staying), self._columns(name for name in self.chosen if name not in staying)
        known = self._known.without(np.setdiff1d(held, moving), SURE)
        values, columns = self.guess.values(self.slips.names), np.union1d(moving, held)
        return (gram.least(known, values, columns) for gram in self._grams)

    def moved(self, chosen: Sequence[str]) -> tuple[Guess, float]:
        """The guess with a set, to first order, and its tau; nothing is left of what is taken away."""
        least, tau = max(zip(self._least(chosen), TAUS, strict=True), key=lambda one: one[0].likelihood)
        guess = self.guess.moved(least.step, least.local, self.slips.names)
        kept = {column for name in chosen for column in self.field.columns[name]}
        others = {column for columns in self.field.columns.values() for column in columns} - kept
        return replace(guess, shared={name: value for name, value in guess.shared.items() if name not in others}), tau

    def _columns(self, chosen: Iterable[str]) -> np.ndarray:
        """Of candidates, and of all that is no candidate's."""
        return np.unique(np.concatenate([self._base, *(self._places[name] for name in chosen)]))

    def worth(self, chosen: Sequence[str]) -> float:
        """ln L of a set less the price of its size; a set of as many columns as half of the slips is worth nothing."""
        if 2 * (sum(map(self.field.count, chosen)) + 1) > len(self.slips.segments):
            return -np.inf
        return self.likelihood(chosen) - len(chosen) * float(np.log(len(self.field.columns)))

    def expected(self, chosen: Sequence[str]) -> float:
        """ln L that new slips would have by the values of a set, after Akaike: unlike `worth` it hardly hangs on how
        large disturbances are assumed to be beforehand. NaN where many values are drawn from one width."""
        drawn = any(term.random for name in chosen for term in self.field.terms.get(name, ()))
        if drawn or not np.isfinite(self.worth(chosen)):
            return np.nan
        best = max(least.best - PRICE * (tau > TAUS[0]) for tau, least in zip(TAUS, self._least(chosen), strict=True))
        return best - sum(map(self.field.count, chosen))

    def better(self) -> tuple[str, ...]:
        """The set that is taken in place of the chosen one; itself where none is worth more."""
        present, chosen = self.worth(self.chosen), self.chosen
        if not np.isfinite(present):
            return ()
        rivalled = {name for pair in self.field.rivals if pair & set(chosen) for name in pair}
        open_ = [name for name in self.field.columns if name not in chosen and name not in rivalled]
        singles = sorted(open_, key=lambda name: -self.worth((*chosen, name)))
        best = self.chosen
        if singles and self.worth((*chosen, singles[0])) > present + GAIN:
            best = (*chosen, singles[0])
        pairs = [pair for pair in combinations(singles[:PAIRED], 2) if frozenset(pair) not in self.field.rivals]
        if pairs:
            pair = max(pairs, key=lambda pair: self.worth((*chosen, *pair)))
            above = max(present, self.worth((*chosen, singles[0])))
            if self.worth((*chosen, *pair)) > above + GAIN:
                best = (*chosen, *pair)
        for name in chosen:
            if name in self.field.evident and not self.field.count(name):  # others than slips show it, and how large
                continue
            others = tuple(term for term in best if term != name)
            if self.worth(best) < self.worth(others) + GAIN:
                best = others
        return best

    def lead(self, name: str) -> float:
        """ln L that one of the chosen adds."""
        return float(self.likelihood(self.chosen) - self.likelihood([term for term in self.chosen if term != name]))

    def alike(self, name: str) -> tuple[str, ...]:
        """Candidates in place of one of the chosen that are worth as much, or fit as well, within `GAIN`."""
        others = tuple(term for term in self.chosen if term != name)
        return tuple(
            column
            for column in self.field.columns
            if column not in self.chosen
            and any(worth((*others, column)) > worth(self.chosen) - GAIN for worth in (self.worth, self.expected))
        )

    def value(self, name: str, column: str, without: str) -> float:
        """What a column of a candidate would be in place of one of the chosen, to first order."""
        least = next(self._least([*(term for term in self.chosen if term != without), name]))
        index = COEFFICIENTS + self.slips.names.index(column)
        return float(self.guess.values(self.slips.names)[index] + least.step[index])

    def explanation(self, slips: Slips, name: str) -> Explanation:
        """One of the chosen. slips: with their columns."""
        terms = self.field.terms[name]
        acts = terms[0].effect.acts
        angle, speed = slips.run(self.guess)
        values = np.array([self.guess.shared.get(term.name, 0.0) for term in terms])
        if acts in SENSOR_UNITS:
            where = slips.where.map(lambda part: part[:, ::2])
            misreadings = misread(terms, values, replace(where, angle=angle, speed=speed))[0]
            size = (slips.ready.values.R if acts == LASER else 1.0) * float(np.max(np.abs(misreadings)))
        else:
            factor = slips.under(terms).factor(self.guess, (angle, speed), slice(0, None, 2), acts)[0]
            size = 0.5 * float(np.ptp(factor)) if acts == FRICTION else float(np.max(np.abs(factor - 1)))
        unit, gain = SENSOR_UNITS.get(acts, "1"), 2 * self.lead(name)
        return Explanation(name, size, unit, gain, terms, tuple(values.tolist()), self.alike(name))
