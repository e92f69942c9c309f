"""Ranks cases, and calls ties ties.

Two cases tie if the intervals of their medians overlap. That is strict: of two equal cases with 95 % intervals fewer than one in a hundred
pairs are apart (Schenker and Gentleman, 2001), which leaves room for the comparison of several cases at a time.
"""
from __future__ import annotations

import dataclasses
from typing import Mapping

from .value import Value


@dataclasses.dataclass(frozen=True)
class Ranking:
    ordered: list[str]  # least value first
    best: list[str]  # the least, and all that tie with it
    values: Mapping[str, Value]
    decided: bool  # False: some values have one repeat or two modes, so nothing is ranked

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


def ranking(values: Mapping[str, Value]) -> Ranking:
    """Ranks by least value. At least one case."""
    ordered = sorted(values, key=lambda name: values[name].value)
    least = values[ordered[0]]
    best = [name for name in ordered if values[name].overlaps(least)]
    return Ranking(ordered, best, values, all(value.ranks for value in values.values()))
