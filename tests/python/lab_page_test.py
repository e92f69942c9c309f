"""slabstream_lab on synthetic results with known answers."""
from __future__ import annotations

import contextlib
import io
import itertools
import pathlib
import re
import subprocess
import sys
import tempfile
import textwrap
import unittest
import unittest.mock
import xml.etree.ElementTree

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "python"), str(pathlib.Path(__file__).resolve().parent)]

import pandas  # noqa: E402
import synthetic  # noqa: E402
from slabstream_lab import page as pages  # noqa: E402
from slabstream_lab import plots, read  # noqa: E402
from slabstream_lab.experiments import PAGES  # noqa: E402
from slabstream_lab.experiments.scaling import efficiency  # noqa: E402
from slabstream_lab.results import ResultsError  # noqa: E402
from slabstream_lab.value import Value, interval_of, speed_text  # noqa: E402

def value(middle: float, spread: float = 0.01, repeats: int = synthetic.REPEATS) -> Value:
    each = synthetic.repeats_round(middle, spread, repeats, "")
    return Value(middle, *interval_of(each), repeats, "s", "measured", "", tuple(each))


class InAFolder(unittest.TestCase):
    def setUp(self) -> None:
        made = tempfile.TemporaryDirectory()
        self.addCleanup(made.cleanup)
        self.folder = pathlib.Path(made.name)


class Values(unittest.TestCase):
    def test_digits_follow_the_interval(self) -> None:
        self.assertEqual(value(0.0123456, 0.2).text(), "12 ms")
        self.assertEqual(value(0.0123456, 0.002).text(), "12.35 ms")
        self.assertEqual(value(0.0123456, 0, repeats=1).text(), "12 ms")

    def test_speed_is_told_for_every_outcome(self) -> None:
        one, two = value(1.0), value(2.0)
        self.assertEqual(speed_text(two.over(one), "faster", "b"), "2.000 times as fast as b")
        self.assertEqual(speed_text(one.over(two), "slower", "b"), "2.000 times as slow as b")
        self.assertEqual(speed_text(one.over(one), "tie", "b"), "as fast as b (a tie)")
        self.assertEqual(speed_text(two.over(one), "open", "b"), "not ranked against b")

    def test_ratios_are_found_repeat_by_repeat(self) -> None:
        drift = [1.0, 1.5, 2.0]
        a, b = (Value(1.5 * x, *interval_of(drift), 3, "s", "measured", "", tuple(x * y for y in drift)) for x in (3, 2))
        ratio = a.over(b)
        self.assertEqual((ratio.value, ratio.low, ratio.high, ratio.each), (1.5, 1.5, 1.5, (1.5,) * 3))
        unpaired = a.over(Value(1.0, 0.5, 2.0, 2, "s", "measured", "", (0.5, 2.0)))
        self.assertEqual((unpaired.value, unpaired.low, unpaired.high, unpaired.each), (4.5, 0.5, 4.0, ()))

    def test_the_interval_is_that_of_order_statistics(self) -> None:
        self.assertEqual(interval_of([5, 1, 2, 4, 3]), (1, 5), "five cannot reach 95 %")
        self.assertEqual(interval_of(range(6)), (0, 5))
        self.assertEqual(interval_of(range(16)), (3, 12))


class Reading(InAFolder):
    def test_questions_without_an_answer_are_errors(self) -> None:
        run = read(synthetic.streaming(self.folder))
        with self.assertRaisesRegex(ResultsError, "no column 'cake'"):
            run.select(cake=1)
        with self.assertRaisesRegex(ResultsError, "no value of latency"):
            run.value("latency", workers=77)
        with self.assertRaisesRegex(ResultsError, "values of latency .* they differ in .*workers"):
            run.value("latency", origin="simulated")
        with self.assertRaisesRegex(ResultsError, "2 values of 'workers'|values of 'workers'"):
            run.only("workers")
        self.assertIsNone(run.find("latency", workers=77))

    def test_a_folder_without_results_or_of_another_version_is_an_error(self) -> None:
        with self.assertRaises(ResultsError):
            read(self.folder)
        rows = [synthetic.row("latency", 1.0) | {"version": 2}]
        with self.assertRaisesRegex(ResultsError, "version 2"):
            read(synthetic.write(self.folder, rows))


class Doubts(InAFolder):
    def test_what_speaks_against_a_run_is_told(self) -> None:
        drift = synthetic.row("drift", 1.2, part="conduct") | {"low": 1.14, "high": 1.26}
        conduct = [synthetic.row("other_load", 0.4, part="conduct"), drift]
        wide = [synthetic.row("latency", 1.0, noise="wide", workers=p) for p in range(5)]
        found = " ".join(pages.doubts(read(synthetic.write(self.folder, conduct + wide, repeats=5, commit="abc-dirty"))))
        ranked, changed = "Nothing is ranked by fewer than 6", "changed after their commit"
        for told in ("40 % of the machine", "1.14 to 1.26", "5 of 7 values are noisy", ranked, changed):
            self.assertIn(told, found)

    def test_a_calm_run_has_none(self) -> None:
        rows = [synthetic.row("other_load", 0.01, part="conduct"), synthetic.row("drift", 1.0, part="conduct")]
        self.assertEqual(pages.doubts(read(synthetic.write(self.folder, rows))), [])


def undrawn(name: str, caption: str, figure) -> pages.Figure:
    plots.matplotlib.pyplot.close(figure)
    return pages.Figure(name, "", caption)


@unittest.mock.patch.object(plots, "figure_of", undrawn)
class Answers(InAFolder):
    def answers(self, experiment: str, **planted) -> list[str]:
        run = read(synthetic.MAKERS[experiment](self.folder, **planted))
        return [section.answer for section in PAGES[experiment](run).sections]

    def test_efficiency(self) -> None:
        self.assertEqual(efficiency(value(3.0), value(3.0), 1, 1).text(), "100.0 %")
        self.assertAlmostEqual(efficiency(value(1.0), value(0.25), 4, 1).value, 100)  # strong, ideal
        self.assertAlmostEqual(efficiency(value(1.0), value(1.0), 4, 1).value, 25)  # strong, no gain
        self.assertAlmostEqual(efficiency(value(1.0), value(1.0), 8, 8).value, 100)  # weak, ideal

    def test_scaling_is_told_for_both_outcomes(self) -> None:
        *series, many = self.answers("scaling", ideal=True)
        for answer in series:
            self.assertIn("at least 50 % up to p = 8: every series", answer)
            self.assertIn("a tie", answer)
        self.assertEqual(many, "At p = 64 the coordinator's time is 50 % with fan-in and 50 % with radix-k of the latency of a frame.")
        for answer in self.answers("scaling", ideal=False)[:-1]:
            self.assertIn("below 50 % from p = 8 on: every series", answer)

    def test_combining_leaders_ties_and_reversals(self) -> None:
        workers = self.answers("combining")[1]
        self.assertIn("p = 8, 100 % active: radix-k (1.000 ms)", workers)
        workers = self.answers("combining", times={"fan-in": 1e-3, "radix-k": 2e-3})[1]
        self.assertIn("p = 8, 100 % active: fan-in (1.000 ms)", workers)
        workers = self.answers("combining", times={"fan-in": 1e-3, "radix-k": 1.005e-3})[1]
        self.assertIn("p = 8, 100 % active: fan-in (1.000 ms) and radix-k (1.005 ms), a tie", workers)

    def test_combining_tells_page_faults_and_equal_links(self) -> None:
        operators, *_, links = self.answers("combining")
        self.assertRegex(operators, r"Fan-in with 20 % active is (4\.99|5\.00). times as fast as fan-in with 100 %\.")
        self.assertIn("No page fault was timed.", operators)
        self.assertIn("Equal times: 10gbit and fat-tree for every scheme", links)
        self.assertIn("Page faults fell into timed runs of 12 of 12 cases.", self.answers("combining", faults=3)[0])

    def test_sweep_ranks_a_users_policies_at_the_greatest_p(self) -> None:
        self.assertIn("Least times at p = 4, 10gbit: latency, a & b (250.0 ms)", self.answers("sweep")[0])
        self.assertIn("10gbit: latency, c (250.0 ms)", self.answers("sweep", times={"a & b": 2.0, "c": 1.0})[0])
        self.assertIn("a tie", self.answers("sweep", times={"a & b": 1.0, "c": 1.0})[0])

    def test_cluster_tells_aims_dilation_and_the_errors_of_the_simulation(self) -> None:
        aims, dilation, simulation, scaling = self.answers("cluster")
        self.assertEqual(aims, "2 of 2 aims are reached.")
        self.assertEqual(dilation, "Times differ by at most 0 %.")
        self.assertEqual(simulation, "4 of 4 simulated times are within 15 % of the measured ones.")
        self.assertEqual(scaling, "Efficiency: kd-tree: 100.0 % at p = 16.")
        aims, dilation, simulation, scaling = self.answers("cluster", ideal=False, error=0.3, drift=0.2)
        self.assertEqual(aims, "0 of 2 aims are reached.")
        self.assertEqual(dilation, "Times differ by at most 20 %.")
        self.assertEqual(simulation, "0 of 4 simulated times are within 15 % of the measured ones.")
        self.assertRegex(scaling, r"^Efficiency: kd-tree: 6\.25. % at p = 16\.$")

    def test_one_repeat_ranks_nothing(self) -> None:
        for experiment in ("combining", "scaling", "sweep"):
            answers = self.answers(experiment, repeats=1)
            for answer in answers[:-1] if experiment == "scaling" else answers:
                self.assertIn("not ranked", answer)


class Plots(unittest.TestCase):
    def test_one_disturbed_repeat_does_not_squash_the_values(self) -> None:
        disturbed = Value(1.0, 0.9, 40.0, 3, "s", "measured", "")
        figure = plots.lines("a", "A", {"one": [(1, value(1.0)), (2, disturbed)]}, "p", "time", "Of boxes.")
        self.assertEqual(figure.caption, "Of boxes. Whiskers end at the edge; the longest reaches 40 s.")
        self.assertEqual(plots.lines("a", "A", {"one": [(1, value(1.0))]}, "p", "time", "Of boxes.").caption, "Of boxes.")


    def test_a_timeline_says_whom_it_leaves_out(self) -> None:
        spans = [{"worker": p, "lane": "renders", "frame": 1, "group": 1, "stage": "render", "begin": 0.0, "end": 0.5} for p in range(1, 11)]
        self.assertIn("Frames, p = 10: workers 1 to 8 of 10", plots.timeline("a", "Frames, p = 10", pandas.DataFrame(spans)).svg)
        self.assertNotIn("workers 1 to", plots.timeline("a", "Frames, p = 8", pandas.DataFrame(spans[:8])).svg)


class Pages(InAFolder):
    def test_every_page_is_well_formed(self) -> None:
        for experiment, make in synthetic.MAKERS.items():
            with self.subTest(experiment):
                run = read(make(self.folder / experiment))
                text = pages.write(PAGES[experiment](run), run, self.folder / experiment).read_text(encoding="utf-8")
                xml.etree.ElementTree.fromstring(text)
                self.assertNotRegex(text, r"\bnan\b")
                self.assertIn("none, Linux, GCC · seed 1", text)
                plots = list((self.folder / experiment / "plots").glob("*.svg"))
                self.assertTrue(plots)
                for plot in plots:
                    xml.etree.ElementTree.parse(plot)


class Program(unittest.TestCase):
    def test_an_output_that_cannot_be_written_is_told(self) -> None:
        with open("/dev/full", "w", encoding="utf-8") as full:
            run = subprocess.run([sys.executable, str(ROOT / "python" / "slabstream-lab"), "--help"], stdout=full, stderr=subprocess.PIPE,
                                 text=True, check=False)
        self.assertEqual(run.returncode, 1)
        self.assertEqual(run.stderr, "slabstream-lab: standard output cannot be written: No space left on device\n")


class Documents(InAFolder):
    def test_the_examples_of_results_md_run(self) -> None:
        """In one folder, one after the other, on a run that has the cases that they name."""
        document = (ROOT / "docs/reference/results.md").read_text(encoding="utf-8")
        section = document[document.index("## Reading them") :]
        blocks = re.findall(r"(?:^    .*\n|^\n)+", section, re.MULTILINE)
        examples = [textwrap.dedent(block).strip() for block in blocks if "import" in block]
        self.assertEqual(len(examples), 2)
        rows = []
        for p, g in itertools.product((2, 4, 16), (1, 2, 4)):
            rows += synthetic.figures(g / p, volume="class1-300", workers=p, groups=g, link="10gbit")
        synthetic.write(self.folder / "streaming", rows)
        printed, names = io.StringIO(), {}
        with contextlib.chdir(self.folder), contextlib.redirect_stdout(printed):
            for example in examples:
                exec(compile(example, "results.md", "exec"), names)
        self.assertIn("1 groups", printed.getvalue())
        xml.etree.ElementTree.parse(self.folder / "mine.svg")


if __name__ == "__main__":
    unittest.main()
