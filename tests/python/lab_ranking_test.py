"""Rankings: exact probabilities, ties where nothing differs, differences where there are some."""
from __future__ import annotations

import itertools
import math
import os
import pathlib
import random
import sys
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "python"))

from slabstream_lab.ranking import LEVEL, MODEL_ERROR, decide, least_repeats, probability, ranking, rankings  # noqa: E402
from slabstream_lab.value import Value, interval_of  # noqa: E402

SEED = int(os.environ.get("SLABSTREAM_SEED", "1"))
REPEATS = 16  # kRankingRepeats, laboratory/experiments/experiment.h
PAGES = 1000  # of results without differences


def value(each: list[float], origin: str = "measured") -> Value:
    return Value(sorted(each)[len(each) // 2], *interval_of(each), len(each), "s", origin, "", tuple(each))


def normal(draw: random.Random, round_: float) -> float:
    return draw.gauss(0, 0.03)


def disturbed(draw: random.Random, round_: float) -> float:
    """One repeat in ten takes up to twice as long."""
    return draw.gauss(0, 0.01) + (draw.uniform(0, 0.7) if draw.random() < 0.1 else 0)


def heaps(draw: random.Random, round_: float) -> float:
    """The clock has two speeds."""
    return draw.choice((0, 0.2)) + draw.gauss(0, 0.005)


def drifting(draw: random.Random, round_: float) -> float:
    """What disturbs a round disturbs all of its trials."""
    return round_ + draw.gauss(0, 0.01)


NOISES = (normal, disturbed, heaps, drifting)


def cases(draw: random.Random, noise, count: int, gain: float = 0) -> list[Value]:
    """Cases alike, but that the first takes less time by `gain`."""
    rounds = [draw.gauss(0, 0.1) for _ in range(REPEATS)]
    return [value([math.exp(noise(draw, r) - (gain if i == 0 else 0)) for r in rounds]) for i in range(count)]


class Probabilities(unittest.TestCase):
    def test_are_those_of_all_signs(self) -> None:
        sizes = (0.5, 1.0, 1.0, 2.0, 3.0)  # two are equal
        ranks = (1, 2.5, 2.5, 4, 5)

        def unevenness(signs) -> float:
            return abs(sum(sign * rank for sign, rank in zip(signs, ranks)))

        all_signs = list(itertools.product((-1, 1), repeat=len(sizes)))
        for signs in all_signs:
            expected = sum(unevenness(other) >= unevenness(signs) for other in all_signs) / len(all_signs)
            self.assertAlmostEqual(probability([sign * size for sign, size in zip(signs, sizes)]), expected)

    def test_equal_repeats_tell_nothing(self) -> None:
        self.assertEqual(probability([0.0] * REPEATS), 1)

    def test_the_fewest_repeats_are_just_enough(self) -> None:
        for comparisons in (1, 2, 54, 1638):
            n = least_repeats(comparisons)
            self.assertLessEqual(probability([1.0 + i for i in range(n)]), LEVEL / comparisons)
            self.assertGreater(probability([1.0 + i for i in range(n - 1)]), LEVEL / comparisons)
        self.assertEqual(least_repeats(54), 12)
        self.assertEqual(least_repeats(1638), REPEATS)


class Decisions(unittest.TestCase):
    def test_three_repeats_rank_nothing_however_far_apart(self) -> None:
        far = value([9.0, 9.1, 9.2]).over(value([1.0, 1.1, 1.2]))
        self.assertEqual(decide({"far": far}), {"far": "open"})

    def test_pairs_count_not_intervals(self) -> None:
        """Rounds differ by a factor of 16, cases by 2 %: intervals overlap, pairs do not."""
        slow = [1.02 * 1.2**i for i in range(REPEATS)]
        quick = [1.2**i for i in range(REPEATS)]
        self.assertEqual(decide({0: value(slow).over(value(quick))}), {0: "faster"})
        self.assertEqual(decide({0: value(quick).over(value(slow))}), {0: "slower"})

    def test_repeats_that_are_no_pairs_decide_nothing(self) -> None:
        apart = value([9.0 + i / 100 for i in range(REPEATS)]).over(value([1.0 + i / 100 for i in range(REPEATS - 1)]))
        self.assertEqual(decide({0: apart}), {0: "open"})

    def test_counted_values_need_no_repeats(self) -> None:
        three, two = Value.exact(3.0, "B"), Value.exact(2.0, "B")
        self.assertEqual(decide({0: three.over(two), 1: two.over(three), 2: two.over(two)}), {0: "faster", 1: "slower", 2: "tie"})

    def test_more_comparisons_need_more_repeats(self) -> None:
        clear = value([2 + i / 100 for i in range(8)]).over(value([1.0] * 8))
        self.assertEqual(set(decide({i: clear for i in range(6)}).values()), {"faster"})
        self.assertEqual(set(decide({i: clear for i in range(7)}).values()), {"open"})

    def test_holm_gives_up_at_the_first_that_is_not_clear(self) -> None:
        def signs(against: int) -> Value:
            return value([math.exp(-0.01 * (i + 1) if i < against else 0.01 * (i + 1)) for i in range(REPEATS)])

        speeds = {f"clear {i}": signs(0) for i in range(9)} | {"middling": signs(6), "unclear": signs(11)}
        self.assertGreater(probability([math.log(x) for x in speeds["middling"].each]), LEVEL / 11)
        found = decide(speeds)
        self.assertEqual(found.pop("unclear"), "tie")
        self.assertEqual(set(found.values()), {"faster"}, "the last two are tested at half the level, not at an eleventh")

    def test_simulated_differences_below_the_error_of_the_model_are_ties(self) -> None:
        def outcome(factor: float, origin: str) -> str:
            slow = value([factor * (1 + i / 1000) for i in range(REPEATS)], origin)
            return decide({0: slow.over(value([1 + i / 1000 for i in range(REPEATS)], origin))})[0]

        limit = 1 / (1 - MODEL_ERROR)
        self.assertEqual(outcome(852.8 / 847.2, "measured"), "faster")
        self.assertEqual(outcome(852.8 / 847.2, "simulated"), "tie")
        self.assertEqual([outcome(limit * 0.99, "simulated"), outcome(limit * 1.01, "simulated")], ["tie", "faster"])
        self.assertEqual([outcome(0.99 / limit, "simulated"), outcome(1.01 / limit, "simulated")], ["slower", "tie"])


class Rankings(unittest.TestCase):
    def test_the_quicker_leads_whatever_the_order(self) -> None:
        one, two = (value([size + i / 1000 for i in range(REPEATS)]) for size in (1, 2))
        self.assertEqual(ranking({"a": two, "b": one}).best, ["b"])
        self.assertEqual(ranking({"a": one, "b": two}).best, ["a"])
        found = ranking({"a": one, "b": two})
        self.assertEqual([found.outcome("a", "b"), found.outcome("b", "a")], ["faster", "slower"])

    def test_few_repeats_rank_nothing(self) -> None:
        found = ranking({"a": value([1.0, 1.1, 1.2]), "b": value([2.0, 2.1, 2.2])})
        self.assertFalse(found.decided)
        self.assertTrue(found.sentence().startswith("not ranked"))

    def test_ties_are_named(self) -> None:
        draw = random.Random(SEED)
        found = ranking(dict(zip("ab", cases(draw, normal, 2))) | {"c": value([2 + i / 1000 for i in range(REPEATS)])})
        self.assertEqual(set(found.best), {"a", "b"})
        self.assertTrue(found.sentence().endswith(", a tie"))


class Chance(unittest.TestCase):
    """What pages claim of results that were drawn."""

    def within(self, wrong: int, what: str) -> None:
        margin = 3.5 * math.sqrt(LEVEL * (1 - LEVEL) / PAGES)
        print(f"seed {SEED}: {what}: {wrong} of {PAGES} pages have a false ranking (at most {100 * (LEVEL + margin):.1f} % pass)")
        self.assertLessEqual(wrong / PAGES, LEVEL + margin)

    def test_without_differences_few_pages_find_one(self) -> None:
        for noise in NOISES:
            draw = random.Random(SEED)
            wrong = 0
            for _ in range(PAGES):
                found = decide({i: a.over(b) for i in range(54) for a, b in [cases(draw, noise, 2)]})
                self.assertNotIn("open", found.values())
                wrong += any(outcome != "tie" for outcome in found.values())
            self.within(wrong, f"54 comparisons, {noise.__name__}")

    def test_choosing_the_least_of_several_is_allowed_for(self) -> None:
        draw = random.Random(SEED)
        wrong = 0
        for _ in range(PAGES):
            found = rankings({case: dict(zip("abcdef", cases(draw, normal, 6))) for case in range(3)})
            wrong += any(len(ranked.best) < 6 for ranked in found.values())
        self.within(wrong, "3 rankings of six")

    def test_true_differences_are_found(self) -> None:
        """Of 54 comparisons, half have one: a difference of twice the noise of a pair is nearly always found."""
        draw = random.Random(SEED)
        found = {gain: 0.0 for gain in (0.02, 0.04, 0.08)}
        for gain in found:
            for _ in range(50):
                speeds = {i: b.over(a) for i in range(54) for a, b in [cases(draw, normal, 2, gain if i % 2 else 0)]}
                outcomes = decide(speeds)
                self.assertNotIn("slower", [outcomes[i] for i in range(1, 54, 2)])
                found[gain] += sum(outcomes[i] == "faster" for i in range(1, 54, 2)) / 27 / 50
        texts = ", ".join(f"{100 * gain:.0f} %: {100 * share:.0f} %" for gain, share in found.items())
        print(f"seed {SEED}: true differences that {REPEATS} repeats find, with noise of 3 % a case: {texts}")
        self.assertGreater(found[0.08], 0.95)
        self.assertLess(found[0.02], found[0.04])
        self.assertLess(found[0.04], found[0.08])


if __name__ == "__main__":
    unittest.main()
