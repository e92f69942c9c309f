"""Ranks cases by their repeats, and calls ties ties.

Repeat i of one case is compared with repeat i of the other. Each repeat runs all trials in an order that was drawn: if the cases do not
differ, each difference of logarithms has either sign with equal chances. The exact signed-rank test (Wilcoxon, 1945) assumes no more than
that, and that repeats are independent. Holm's procedure (1979) keeps the chance of any false ranking among all comparisons that are made
together at LEVEL.
"""
from __future__ import annotations

import dataclasses
import functools
import itertools
import math
import statistics
from bisect import bisect_left, bisect_right
from typing import Hashable, Mapping, Sequence, TypeVar

from .value import Value

LEVEL = 0.05

# The largest error of a simulated period against a measured one in docs/time-dilated-cluster.md, "The simulation": 19 of its 24 errors are
# below 20 %, the largest is -38 %. A ratio with a simulated side that lies nearer to 1 than this is a tie, however well repeats agree.
MODEL_ERROR = 0.38

Key = TypeVar("Key", bound=Hashable)


def least_repeats(comparisons: int) -> int:
    """The fewest repeats that can decide any of so many comparisons: all differences have one sign."""
    return math.ceil(1 + math.log2(comparisons / LEVEL))


def probability(differences: Sequence[float]) -> float:
    """Of signed ranks that are at least as uneven, if each difference had either sign with equal chances. Equal sizes share a rank."""
    sizes = sorted(abs(d) for d in differences if d != 0)
    twice = {size: bisect_left(sizes, size) + 1 + bisect_right(sizes, size) for size in sizes}  # the mean rank, doubled, is whole
    ranks = tuple(twice[size] for size in sizes)
    above = sum(twice[d] for d in differences if d > 0)
    return min(1.0, 2 * _shares(ranks)[min(above, sum(ranks) - above)])


@functools.lru_cache(maxsize=256)
def _shares(ranks: tuple[int, ...]) -> list[float]:
    """At i: the share of all choices of signs whose positive ranks sum to at most i."""
    ways = [1] + [0] * sum(ranks)
    for rank in ranks:
        for total in range(len(ways) - 1, rank - 1, -1):
            ways[total] += ways[total - rank]
    return [below / 2 ** len(ranks) for below in itertools.accumulate(ways)]


def decide(speeds: Mapping[Key, Value]) -> dict[Key, str]:
    """Of each speed (time of a reference over time of a case): "faster", "slower", "tie", or "open" if the repeats are too few for so many.

    These are all comparisons that are made together. Counted and printed values have no repeats and need no test.
    """
    found: dict[Key, str] = {}
    probabilities: dict[Key, float] = {}
    tested = sum(speed.repeats > 0 for speed in speeds.values())
    for key, speed in speeds.items():
        if speed.repeats == 0:
            found[key] = _direction(speed.value)
        elif len(speed.each) < least_repeats(tested):
            found[key] = "open"
        else:
            found[key] = "tie"
            probabilities[key] = _probability(speed)
    for i, key in enumerate(sorted(probabilities, key=probabilities.__getitem__)):
        if probabilities[key] > LEVEL / (tested - i):
            break
        found[key] = _direction(speeds[key].value)
    return found


def _direction(speed: float) -> str:
    return "tie" if speed == 1 else "faster" if speed > 1 else "slower"


def _probability(speed: Value) -> float:
    """That a speed no farther from 1 than the model's error gives such repeats."""
    logs = [math.log(ratio) for ratio in speed.each]
    middle = statistics.median(logs)
    margin = -math.log(1 - MODEL_ERROR) if speed.origin == "simulated" else 0
    if abs(middle) <= margin:
        return 1
    return probability([log - math.copysign(margin, middle) for log in logs])


@dataclasses.dataclass(frozen=True)
class Ranking:
    ordered: list[str]  # least value first
    best: list[str]  # the least, and all that tie with it
    values: Mapping[str, Value]
    outcomes: Mapping[tuple[str, str], str]  # of the first of two against the second, which comes later in `ordered`
    decided: bool  # False: the repeats are too few, so nothing is ranked

    def outcome(self, name: str, against: str) -> str:
        if (name, against) in self.outcomes:
            return self.outcomes[name, against]
        return {"faster": "slower", "slower": "faster"}.get(found := self.outcomes[against, name], found)

    def sentence(self) -> str:
        """ "kd-tree (10.0 ms)", "kd-tree (10.0 ms) and octree (10.1 ms), a tie", or why there is no answer."""
        named = [f"{name} ({self.values[name].text()})" for name in self.best]
        if not self.decided:
            return f"not ranked ({named[0]} is lowest, but the repeats do not decide it)"
        if len(named) == 1:
            return named[0]
        if len(named) > 4:
            return f"a tie of {len(named)} from {named[0]} to {named[-1]}"
        return ", ".join(named[:-1]) + f" and {named[-1]}, a tie"


def rankings(cases: Mapping[Key, Mapping[str, Value]]) -> dict[Key, Ranking]:
    """Ranks each case by least value, every two of its values against each other, all cases together."""
    ordered = {case: sorted(values, key=lambda name: values[name].value) for case, values in cases.items()}
    pairs = {
        (case, a, b): values[b].over(values[a]) for case, values in cases.items() for a, b in itertools.combinations(ordered[case], 2)
    }
    outcomes = decide(pairs)
    found = {}
    for case, names in ordered.items():
        own = {(a, b): outcomes[case, a, b] for a, b in itertools.combinations(names, 2)}
        best = [name for name in names if name == names[0] or own[names[0], name] != "faster"]
        found[case] = Ranking(names, best, cases[case], own, "open" not in own.values())
    return found


def ranking(values: Mapping[str, Value]) -> Ranking:
    """Ranks one case. At least one value."""
    return rankings({None: values})[None]


def ties_text(found: Mapping[Key, Ranking]) -> str:
    """ "3 of 18 comparisons of two are ties"; how many are decided, so that a reader sees how much a ranking leaves open."""
    outcomes = [outcome for ranking_ in found.values() for outcome in ranking_.outcomes.values()]
    open_ = outcomes.count("open")
    return f"{outcomes.count('tie')} of {len(outcomes)} comparisons of two are ties" + (f", {open_} are not ranked" if open_ else "")
