"""tests/simulator/worlds: no piece is run twice, and a world that fails ends nothing."""
import json
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import unittest

WORLDS = pathlib.Path(__file__).resolve().parent / "worlds"

# Like simulator_test: counts its worlds, ends at a failed one, and tells which it was. It notes what it is asked for, and waits where told.
STAND_IN = """#!/usr/bin/python3
import os, pathlib, sys, time
first, worlds = int(os.environ["SLABSTREAM_FIRST_SEED"]), int(os.environ["SLABSTREAM_SEEDS"])
with open("@asked@", "a") as asked:
    asked.write(f"{first} {worlds}\\n")
while pathlib.Path("@wait@").exists() and first > 20:
    time.sleep(0.01)
for seed in range(first, first + worlds):
    if seed in (@failing@):
        print(f"This world again: SLABSTREAM_SEED={seed} simulator_test")
        sys.exit(1)
print(f"  {worlds} worlds\\n  {sum(range(first, first + worlds))} pictures\\n{worlds} worlds, 1 virtual hours")
"""


class Worlds(unittest.TestCase):
    def setUp(self) -> None:
        made = tempfile.TemporaryDirectory()
        self.addCleanup(made.cleanup)
        self.folder = pathlib.Path(made.name)

    def stand_in(self, failing: str = "") -> pathlib.Path:
        path = self.folder / "stand-in"
        text = STAND_IN.replace("@asked@", str(self.folder / "asked")).replace("@wait@", str(self.folder / "wait"))
        path.write_text(text.replace("@failing@", failing))
        path.chmod(0o755)
        return path

    def start(self, program: pathlib.Path, *options: str, out: str = "out") -> subprocess.Popen:
        command = [sys.executable, WORLDS, program, self.folder / out, "--piece", "10", "--at-once", *options]
        return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

    def run_worlds(self, program: pathlib.Path, *options: str, out: str = "out") -> tuple[int, str]:
        process = self.start(program, *options, out=out)
        output, _ = process.communicate()
        return process.returncode, output

    def asked(self) -> list[tuple[int, int]]:
        return [tuple(map(int, line.split())) for line in (self.folder / "asked").read_text().splitlines()]

    def test_sums_are_those_of_all_worlds(self) -> None:
        status, output = self.run_worlds(self.stand_in(), "--worlds", "95", "--first", "3")
        self.assertEqual(status, 0, output)
        self.assertIn("  95 worlds\n", output)
        self.assertIn(f"  {sum(range(3, 98))} pictures\n", output)
        self.assertIn("95 worlds from 3 on: 0 failed", output)

    def test_an_interrupted_run_goes_on_where_it_was(self) -> None:
        program, wait = self.stand_in(), self.folder / "wait"
        wait.touch()
        process = self.start(program, "--worlds", "60", "--jobs", "1")
        for line in process.stderr:
            if line.startswith("20 of 60"):
                break
        process.send_signal(signal.SIGINT)
        process.communicate()
        self.assertEqual(process.returncode, 130)
        wait.unlink()
        before = len(self.asked())
        status, output = self.run_worlds(program, "--worlds", "60", "--jobs", "1")
        self.assertEqual(status, 0)
        self.assertIn(f"  {sum(range(1, 61))} pictures\n", output)
        self.assertEqual(self.asked()[before:], [(21, 10), (31, 10), (41, 10), (51, 10)])
        again, whole = self.run_worlds(program, "--worlds", "60")
        self.assertEqual((again, whole), (0, output))
        self.assertEqual(len(self.asked()), before + 4, "all is done")

    def test_more_worlds_run_what_is_new(self) -> None:
        program = self.stand_in()
        self.run_worlds(program, "--worlds", "20", "--first", "11")
        self.run_worlds(program, "--worlds", "40", "--jobs", "1")
        self.assertEqual(self.asked()[2:], [(1, 10), (31, 10)])

    def test_a_failed_world_is_told_and_the_others_run(self) -> None:
        status, output = self.run_worlds(self.stand_in(failing="4, 7, 33"), "--worlds", "40")
        self.assertEqual(status, 1)
        self.assertIn("40 worlds from 1 on: 3 failed", output)
        for seed in (4, 7, 33):
            self.assertIn(f"SLABSTREAM_SEED={seed} ", output)
        self.assertIn((8, 3), self.asked())

    def test_a_piece_that_fails_without_a_world_is_told(self) -> None:
        program = self.stand_in()
        program.write_text(program.read_text().replace('print(f"  {worlds}', 'sys.exit("too few pictures"); print(f"  {worlds}'))
        status, output = self.run_worlds(program, "--worlds", "10")
        self.assertEqual(status, 1)
        self.assertIn("worlds 1 to 10 together:", output)
        self.assertIn("too few pictures", output)

    def test_another_program_begins_anew(self) -> None:
        self.run_worlds(self.stand_in(), "--worlds", "10")
        self.run_worlds(self.stand_in(failing="99"), "--worlds", "10")
        self.assertEqual(self.asked(), [(1, 10), (1, 10)])
        lines = (self.folder / "out" / "worlds.jsonl").read_text().splitlines()
        self.assertEqual(len({json.loads(line)["program"] for line in lines}), 2)

    def test_worlds_of_owners_are_others(self) -> None:
        program = self.stand_in(failing="4, 99")
        status, output = self.run_worlds(program, "--worlds", "10", "--owners")
        self.assertEqual(status, 1)
        self.assertIn(f"SLABSTREAM_SEED=4 {program} '--gtest_filter=*ProcessesOwn'", output)
        status, output = self.run_worlds(program, "--worlds", "10")
        self.assertIn(f"SLABSTREAM_SEED=4 {program} '--gtest_filter=-*ProcessesOwn'", output)

    def test_wrong_words_end_in_one_line(self) -> None:
        for words, why in (
            (["none", "out"], "PROGRAM none is not a program"),
            ([sys.executable, "out", "--worlds", "0"], "0 must be a whole number above 0"),
        ):
            done = subprocess.run([sys.executable, WORLDS, *words], capture_output=True, text=True, cwd=self.folder, env=os.environ)
            self.assertEqual(done.returncode, 2)
            self.assertIn(why, done.stderr.splitlines()[-1])


if __name__ == "__main__":
    unittest.main()
