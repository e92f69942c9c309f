"""Every sentence of every page follows from its results: other results, other sentences.

The results are those of quick runs, with other values.
"""
from __future__ import annotations

import collections
import json
import math
import os
import pathlib
import random
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
import unittest.mock
from typing import Callable

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "python"), str(pathlib.Path(__file__).resolve().parent)]

import synthetic  # noqa: E402
from slabstream_lab import page as pages  # noqa: E402
from slabstream_lab import plots, read  # noqa: E402
from slabstream_lab.experiments import PAGES  # noqa: E402
from slabstream_lab.ranking import LEVEL  # noqa: E402
from slabstream_lab.value import interval_of  # noqa: E402

PROGRAM = pathlib.Path(os.environ.get("SLABSTREAM_PROGRAMS", ROOT / "build" / "bin")) / "slabstream"
SEED = int(os.environ.get("SLABSTREAM_SEED", "1"))
EXPERIMENTS = ("paper", "partitions", "balance", "combining", "streaming", "scaling")
PLANTED = "latency preview period imbalance render_time longest_render_time stage_time combine_time frame_time run_time box_time settling_frames picture_time".split()
NEAR = ("box_time", "settling_frames")
# Their answers are about the paper's numbers and about pictures.
FIXED = ("The paper's machine", "Pictures: figures 12 and 13")

Rows = list[dict]
Answers = dict[tuple[str, str], str]  # by experiment and title of a section


def planted(row: dict) -> bool:
    return row["metric"] in PLANTED and row["origin"] != "paper" and row["repeats"] > 0


def plant(row: dict, value: float, draw: random.Random, repeats: int = synthetic.REPEATS) -> None:
    each = [value * math.exp(draw.gauss(0, 0.01)) for _ in range(repeats)]
    put(row, each)


def put(row: dict, each: list[float]) -> None:
    low, high = interval_of(each)
    row |= {"value": sorted(each)[len(each) // 2], "low": low, "high": high, "repeats": len(each), "each": each, "noise": ""}


def anything(rows: Rows, seed: int = SEED) -> None:
    """Each case takes its own time: over a factor of 20, so that many differ by more than the error of the simulation.

    What is NEAR stays near its own value, since nobody expects it to be what was drawn.
    """
    draw = random.Random(seed)
    for row in filter(planted, rows):
        plant(row, ((row["value"] or 1) if row["metric"] in NEAR else 1e-3) * math.exp(draw.uniform(0, 3)), draw)


def claims(answer: str) -> list[str]:
    """What an answer ranks, without the numbers of it. What it says of the paper is no claim."""
    own = re.sub(r"\(the paper[^)]*\)|The paper's[^.]*\.[^.]*\.[^.]*\.", "", answer)
    found = re.findall(r"times as (?:fast|slow) as [^.,;()]*", own)
    found += re.findall(r"(?:shorter than with boxes that stay|longer) in [1-9]\d*", own)
    found += re.findall(r"alone has the shortest longest render time in [1-9]\d*", own)
    found += re.findall(r"Speed-ups at p = \d+ (?:grow|do not grow)", own)
    return found + re.findall(r"measured by the service here: (?:below|above) 1", own)


def turned(claim: str) -> str:
    swapped = {"fast": "slow", "slow": "fast", "below": "above", "above": "below"}
    swapped |= {"shorter than with boxes that stay": "longer", "longer": "shorter than with boxes that stay"}
    return re.sub("|".join(sorted(swapped, key=len, reverse=True)), lambda found: swapped[found.group()], claim)


def undrawn(name: str, *_, **__) -> pages.Figure:
    return pages.Figure(name, "", "")


@unittest.mock.patch.multiple(plots, lines=undrawn, bars=undrawn, stacked=undrawn, timeline=undrawn, cuts=undrawn)
class Sentences(unittest.TestCase):
    @classmethod
    def setUpClass(cls) -> None:
        made = tempfile.TemporaryDirectory()
        cls.addClassCleanup(made.cleanup)
        cls.folder = pathlib.Path(made.name)
        for experiment in EXPERIMENTS:
            run = [PROGRAM, "experiment", experiment, "-o", cls.folder / experiment, "--quick", "--repeats", "1", "--scale", "0.1"]
            subprocess.run(run, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
        synthetic.sweep(cls.folder / "sweep")
        with open(cls.folder / "paper" / "results.jsonl", "a", encoding="utf-8") as results:
            results.write("".join(json.dumps(row) + "\n" for row in synthetic.service_frames()))
        print(f"seed {SEED}")

    def pages(self, change: Callable[[Rows], Rows | None], experiments=(*EXPERIMENTS, "sweep")) -> dict[str, pages.Page]:
        """The pages of results that `change` has changed, or replaced."""
        drawn = {}
        for experiment in experiments:
            lines = (self.folder / experiment / "results.jsonl").read_text(encoding="utf-8").splitlines()
            rows = [json.loads(line) for line in lines]
            rows = change(rows) or rows
            changed = self.folder / "changed" / experiment
            shutil.copytree(self.folder / experiment, changed, dirs_exist_ok=True)
            (changed / "results.jsonl").write_text("".join(json.dumps(row) + "\n" for row in rows), encoding="utf-8")
            drawn[experiment] = PAGES[experiment](read(changed))
        return drawn

    def answers(self, change: Callable[[Rows], Rows | None], *experiments: str) -> Answers:
        drawn = self.pages(change, experiments or (*EXPERIMENTS, "sweep"))
        return {(name, section.title): section.answer for name, page in drawn.items() for section in page.sections}

    def test_one_repeat_ranks_nothing(self) -> None:
        def once(rows: Rows) -> None:
            anything(rows)
            for row in filter(planted, rows):
                put(row, row["each"][:1])

        for section, answer in self.answers(once).items():
            with self.subTest(section):
                self.assertEqual(claims(answer), [])
                if claims(self.anything[section]):
                    self.assertRegex(answer, "not ranked|do not decide")

    @property
    def anything(self) -> Answers:
        if not hasattr(type(self), "_anything"):
            type(self)._anything = self.answers(anything)
        return type(self)._anything

    def test_results_without_differences_are_ties(self) -> None:
        def alike(rows: Rows) -> None:
            draw = random.Random(SEED)
            for row in filter(planted, rows):
                plant(row, 1e-3, draw)

        found = {section: claimed for section, answer in self.answers(alike).items() if (claimed := claims(answer))}
        ranked = sum(bool(claims(answer)) for answer in self.anything.values())
        self.assertGreaterEqual(ranked, 12, "otherwise there is little to be wrong")
        print(f"seed {SEED}: {len(found)} of {ranked} sections rank what does not differ")
        self.assertLessEqual(len(found), LEVEL * ranked + 3.5 * math.sqrt(LEVEL * (1 - LEVEL) * ranked), found)

    def test_swapped_results_swap_winners(self) -> None:
        def mirrored(rows: Rows) -> None:
            anything(rows)
            for row in filter(planted, rows):
                put(row, [1e-3 / x for x in row["each"]])

        mirrored_answers = self.answers(mirrored)
        for section, answer in self.anything.items():
            with self.subTest(section):
                before, after = (
                    collections.Counter(claim for claim in claims(text) if not claim.startswith(("alone", "Speed-ups")))
                    for text in (answer, mirrored_answers[section])
                )
                self.assertEqual(collections.Counter(map(turned, before.elements())), after)

    def test_other_results_make_other_sentences(self) -> None:
        others = self.answers(lambda rows: anything(rows, SEED + 1))
        for section, answer in self.anything.items():
            with self.subTest(section):
                if section[1] not in FIXED and answer:
                    self.assertNotEqual(answer, others[section])

    def test_half_of_all_times_changes_no_comparison(self) -> None:
        def halved(rows: Rows) -> None:
            anything(rows)
            for row in filter(planted, rows):
                put(row, [x / 2 for x in row["each"]])

        halves = self.answers(halved)
        for section, answer in self.anything.items():
            with self.subTest(section):
                self.assertEqual(claims(answer), claims(halves[section]))

    def test_whoever_takes_a_thousandth_wins(self) -> None:
        names = {
            "combining": ("combine", ("fan-in", "chain", "radix-k")),
            "scaling": ("variant", ("slab by voxels", "kd-tree by occupied")),
            "sweep": ("variant", ("a & b", "c")),
        }
        for experiment, (column, winners) in names.items():
            for winner in winners:

                def quickened(rows: Rows) -> None:
                    anything(rows)
                    for row in filter(planted, rows):
                        if row.get(column) == winner:
                            put(row, [x / 1e3 for x in row["each"]])

                for (_, title), answer in self.answers(quickened, experiment).items():
                    if experiment == "scaling" and not title.startswith("Weak"):
                        continue  # its series have other names, or it ranks none
                    with self.subTest(experiment, title=title, winner=winner):
                        ranked = re.findall(r"\w[^:;.]*: ([^:;]*? \([\d.]+ [µnm]?s\)(?: and|,)?)", answer)
                        self.assertTrue(ranked, answer)
                        for first in ranked:
                            self.assertIn(winner, first)
                            self.assertFalse(first.endswith(("and", ",")), first)

    def test_counts_are_those_of_the_table(self) -> None:
        drawn = self.pages(anything, ("balance",))["balance"]
        sections = [section for section in drawn.sections if section.title.startswith("Paths: ")]
        self.assertTrue(sections)
        for section in sections:
            table = next(block for block in section.blocks if isinstance(block, pages.Table))
            told = re.findall(
                r"With balance (\w+) the longest render time is shorter than with boxes that stay in (\d+) of (\d+) cases, longer in (\d+), "
                r"as long \(ties\) in (\d+)\.",
                section.answer,
            )
            self.assertGreaterEqual(len(told), 2)
            for balance, *counts in told:
                shorter, all_, longer, ties = map(int, counts)
                cells = [row[-1] for row in table.rows if row[2].endswith(f", {balance}") and row[-1]]
                self.assertEqual(len(cells), all_)
                for word, count in (("times as fast", shorter), ("times as slow", longer), ("(a tie)", ties)):
                    self.assertEqual(sum(word in cell for cell in cells), count, section.title)

    def test_what_was_not_measured_is_not_told(self) -> None:
        def without(rows: Rows) -> Rows:
            return [row for row in rows if row.get("part") != "validation"]

        answers = self.answers(without, "paper")
        self.assertIn("no frames of the service", answers["paper", "How far to trust the simulation"])
        self.assertIn("the speed-up is below 1”: not tested", answers["paper", "Claims of the text"])

    def test_rounds_that_are_assumed_prove_nothing(self) -> None:
        told = self.anything["paper", "Claims of the text"]
        for claim in ("Hierarchical combining beats", "Combining dominates the Z-buffer"):
            self.assertRegex(told, f"“{claim}[^”]*”: assumed, not found")
        self.assertIn("Given the rounds that we assume", self.anything["paper", "Combining: table 2 and figure 9"])
        for title in ("Splatting: table 5 and figure 10", "Z-buffer: table 6 and figure 11"):
            self.assertIn("whose rounds are assumed", self.anything["paper", title])

    def test_errors_elsewhere_are_those_of_other_sizes(self) -> None:
        answer = self.anything["paper", "Frames from the constants: equations 20, 21 and 25"]
        here, elsewhere = re.findall(r"errors up to \d+ % \(N = (\d+), p = \d+\), and with other N up to \d+ % \(N = (\d+)", answer)[0]
        self.assertNotEqual(here, elsewhere)


if __name__ == "__main__":
    unittest.main()
