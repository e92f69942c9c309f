"""A value with its interval, and how pages write it."""
from __future__ import annotations

import dataclasses
import math

# What a unit of the results is called on a page, from the factor upwards.
_SCALES = {
    "s": [(1, "s"), (1e-3, "ms"), (1e-6, "µs"), (1e-9, "ns")],
    "B": [(2**30, "GiB"), (2**20, "MiB"), (2**10, "KiB"), (1, "B")],
    "1": [(1, "")],
    "%": [(1, "%")],
}


@dataclasses.dataclass(frozen=True)
class Value:
    """The median of some repeats with the interval of the median (results.md). repeats = 0: printed in the paper, or counted."""

    value: float
    low: float
    high: float
    repeats: int = 0
    unit: str = "1"
    origin: str = "measured"
    noise: str = ""

    @staticmethod
    def exact(value: float, unit: str = "1", origin: str = "measured") -> "Value":
        return Value(value, value, value, 0, unit, origin)

    def _with(self, other: "Value", value: float, low: float, high: float, unit: str) -> "Value":
        counted = [v.repeats for v in (self, other) if v.repeats > 0]
        origins = {v.origin for v in (self, other)}
        origin = "simulated" if "simulated" in origins else min(origins)
        return Value(value, low, high, min(counted, default=0), unit, origin, self.noise or other.noise)

    def over(self, other: "Value") -> "Value":
        """This value over another, with the widest interval that both intervals allow."""
        unit = "1" if self.unit == other.unit else f"{self.unit}/{other.unit}"
        return self._with(other, self.value / other.value, self.low / other.high, self.high / other.low, unit)

    def times(self, factor: float, unit: str | None = None) -> "Value":
        return dataclasses.replace(
            self, value=self.value * factor, low=self.low * factor, high=self.high * factor, unit=unit or self.unit
        )

    def percent(self) -> "Value":
        return self.times(100, "%")

    def overlaps(self, other: "Value") -> bool:
        return self.low <= other.high and other.low <= self.high

    @property
    def ranks(self) -> bool:
        """Whether it may be ranked: one repeat has no interval, and two heaps have no middle."""
        return self.repeats != 1 and self.noise != "two modes"

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


def outcome(ratio: Value) -> str:
    """What a speed, time of a reference over time of a case, says of the case: "faster", "slower", "tie", or "open" if it is not ranked."""
    if not ratio.ranks:
        return "open"
    return "tie" if ratio.low <= 1 <= ratio.high else "faster" if ratio.value > 1 else "slower"


def speed_text(ratio: Value, of: str = "") -> str:
    """How a case compares with `of`, from time of `of` over time of the case: "2.1 times as fast", "as fast", or that it is open."""
    than = f" as {of}" if of else ""
    found = outcome(ratio)
    if found == "open":
        return f"not ranked against {of or 'it'}"
    if found == "tie":
        return f"as fast{than} (a tie)"
    if found == "faster":
        return f"{ratio.text()} times as fast{than}"
    inverse = Value(1 / ratio.value, 1 / ratio.high, 1 / ratio.low, ratio.repeats, "1", ratio.origin, ratio.noise)
    return f"{inverse.text()} times as slow{than}"
