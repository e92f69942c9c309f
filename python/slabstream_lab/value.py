"""A value with its interval, and how pages write it."""
from __future__ import annotations

import dataclasses
import math
import statistics
from typing import Sequence

# What a unit of the results is called on a page, from the factor upwards.
_SCALES = {
    "s": [(1, "s"), (1e-3, "ms"), (1e-6, "µs"), (1e-9, "ns")],
    "B": [(2**30, "GiB"), (2**20, "MiB"), (2**10, "KiB"), (1, "B")],
    "1": [(1, "")],
    "%": [(1, "%")],
}


@dataclasses.dataclass(frozen=True)
class Value:
    """The median of some repeats with the interval of the median (results.md). repeats = 0: printed in the paper, or counted.

    `each`: the repeats in their order, so that those of two values are pairs; empty if they are not known.
    """

    value: float
    low: float
    high: float
    repeats: int = 0
    unit: str = "1"
    origin: str = "measured"
    noise: str = ""
    each: tuple[float, ...] = ()

    @staticmethod
    def exact(value: float, unit: str = "1", origin: str = "measured") -> "Value":
        return Value(value, value, value, 0, unit, origin)

    def over(self, other: "Value") -> "Value":
        """This value over another: repeat by repeat where both have as many, else with the widest interval that both intervals allow."""
        unit = "1" if self.unit == other.unit else f"{self.unit}/{other.unit}"
        origins = {v.origin for v in (self, other)}
        origin = "simulated" if "simulated" in origins else min(origins)
        noise = self.noise or other.noise
        count = max(len(self.each), len(other.each))
        mine, theirs = ((v.value,) * count if v.repeats == 0 else v.each for v in (self, other))
        if count > 0 and len(mine) == len(theirs):
            each = tuple(a / b for a, b in zip(mine, theirs))
            return Value(statistics.median(each), *interval_of(each), count, unit, origin, noise, each)
        repeats = min((v.repeats for v in (self, other) if v.repeats > 0), default=0)
        return Value(self.value / other.value, self.low / other.high, self.high / other.low, repeats, unit, origin, noise)

    def minus(self, other: "Value") -> "Value":
        """This value less another of the same unit, repeat by repeat where both have as many, else with the widest interval."""
        origin, noise = ("simulated" if "simulated" in (self.origin, other.origin) else self.origin), self.noise or other.noise
        if self.each and len(self.each) == len(other.each):
            each = tuple(a - b for a, b in zip(self.each, other.each))
            return Value(statistics.median(each), *interval_of(each), len(each), self.unit, origin, noise, each)
        repeats = min((v.repeats for v in (self, other) if v.repeats > 0), default=0)
        return Value(self.value - other.value, self.low - other.high, self.high - other.low, repeats, self.unit, origin, noise)

    def times(self, factor: float, unit: str | None = None) -> "Value":
        low, high, each = self.low * factor, self.high * factor, tuple(x * factor for x in self.each)
        return dataclasses.replace(self, value=self.value * factor, low=low, high=high, unit=unit or self.unit, each=each)

    def percent(self) -> "Value":
        return self.times(100, "%")

    @property
    def digits(self) -> int:
        """Significant digits that the interval supports: one digit is uncertain."""
        if self.repeats == 1:
            return 2
        if self.value == 0 or self.high == self.low:
            return 4
        spread = (self.high - self.low) / 2 / abs(self.value)
        return min(max(math.ceil(-math.log10(spread)) + 1, 2), 4) if spread > 0 else 4

    def text(self, scale: tuple[float, str] | None = None, unit: bool = True) -> str:
        """ "12.3 ms". `scale`: factor and name of the unit, else the one that suits the value."""
        factor, name = scale or scale_of(self.unit, abs(self.value))
        number = number_text(self.value / factor, self.digits)
        return f"{number} {name}" if unit and name else number

    def interval_text(self, scale: tuple[float, str] | None = None) -> str:
        """ "[12.1, 12.6]"; empty if there is no interval."""
        if self.repeats < 2 or self.low == self.high:
            return ""
        factor, _ = scale or scale_of(self.unit, abs(self.value))
        digits = max(self.digits, 2)
        return f"[{number_text(self.low / factor, digits)}, {number_text(self.high / factor, digits)}]"


def scale_of(unit: str, size: float) -> tuple[float, str]:
    """Factor and name of the unit that suits numbers of this size."""
    scales = _SCALES.get(unit, [(1, unit)])
    return next((scale for scale in scales if size >= scale[0]), scales[-1] if size > 0 else scales[0])


def number_text(number: float, digits: int) -> str:
    """With that many significant digits, without exponent: "1234", "0.0123"."""
    if number == 0 or not math.isfinite(number):
        return "0" if number == 0 else "–"
    decimals = digits - 1 - math.floor(math.log10(abs(number)))
    return f"{round(number, decimals):.{max(decimals, 0)}f}"


def interval_of(repeats: Sequence[float]) -> tuple[float, float]:
    """Of the median, as results have it (results.md): 95 % confidence from six repeats on, below that the smallest and largest one."""
    ordered, count, k = sorted(repeats), len(repeats), 1
    while k < (count + 1) // 2 and sum(math.comb(count, i) for i in range(k + 1)) <= 0.025 * 2**count:
        k += 1
    return ordered[k - 1], ordered[-k]


def speed_text(ratio: Value, outcome: str, of: str = "") -> str:
    """How a case compares with `of`, from time of `of` over time of the case and what `decide` found of it."""
    than = f" as {of}" if of else ""
    if outcome == "open":
        return f"not ranked against {of or 'it'}"
    if outcome == "tie":
        return f"as fast{than} (a tie)"
    if outcome == "faster":
        return f"{ratio.text()} times as fast{than}"
    return f"{Value.exact(1).over(ratio).text()} times as slow{than}"
