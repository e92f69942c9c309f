"""bench/cluster and bench/dilated_cluster.py: their arithmetic, and, as root, that hosts come and go."""
from __future__ import annotations

import contextlib
import importlib.machinery
import importlib.util
import io
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest
import unittest.mock

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "bench"))

import dilated_cluster  # noqa: E402


def load_program(name: str):
    loader = importlib.machinery.SourceFileLoader(name, str(ROOT / "bench" / name))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader(name, loader))
    loader.exec_module(module)
    return module


PROGRAMS = ("cluster", "cluster_paper", "cluster_balance", "cluster_trace", "cluster_pieces")
cluster, cluster_paper, cluster_balance, cluster_trace, cluster_pieces = (load_program(name) for name in PROGRAMS)


def options(*arguments: str, program=cluster):
    with unittest.mock.patch.object(sys, "argv", ["cluster", "-o", "out", *arguments]):
        return program.parse_arguments()


class Dilation(unittest.TestCase):
    def test_times_are_multiplied_by_the_share_and_nothing_else_is(self) -> None:
        row = {"metric": "latency", "unit": "s", "value": 10.0, "low": 8.0, "high": 12.0, "each": [8.0, 10.0, 12.0], "workers": 16}
        found = cluster.dilated(row, 0.1, 10)
        self.assertAlmostEqual(found["value"], 1.0)
        self.assertAlmostEqual(found["low"], 0.8)
        self.assertAlmostEqual(found["high"], 1.2)
        for value, repeat in zip([0.8, 1.0, 1.2], found["each"]):
            self.assertAlmostEqual(value, repeat)
        self.assertEqual((found["workers"], found["share"], found["link"]), (16, 0.1, "10gbit:0,10"))
        self.assertEqual(cluster.dilated(row | {"unit": "B"}, 0.1, 10)["value"], 10.0)

    def test_all_workers_together_use_one_and_a_half_cores(self) -> None:
        for workers in (2, 4, 16, 37):
            self.assertAlmostEqual(cluster.share_of(options(), workers)[0] * workers, 1.5)
        self.assertEqual(cluster.share_of(options(), 1), [1.0])
        self.assertEqual(cluster.share_of(options("--crowd", "6"), 1), [0.25])
        self.assertEqual(cluster.share_of(options("--workers", "2", "--share", "0.5,0.25"), 2), [0.5, 0.25])


class Options(unittest.TestCase):
    def test_what_is_named_replaces_what_a_preset_says(self) -> None:
        aims = options("--aims", "--workers", "2")
        self.assertEqual((aims.workers, aims.links, aims.spheres, aims.renderer), ([2], [10.0], ["class2"], ["splat", "raycast"]))
        self.assertEqual(len(options().policy), 6)

    def test_what_is_wrong_is_told_in_a_line(self) -> None:
        cases = {
            ("--workers", "0"): "0 must be above 0",
            ("--renderer", "crayon"): "'crayon' must be one of",
            ("--workers", "8", "--share", "0.5"): "8 hosts would use 4 cores",
            ("--workers", "1", "--crowd", "16", "--share", "0.5"): "16 hosts would use 8 cores",
            ("--crowd", "65"): "must be from 0 to 64",
            ("--spheres", "none"): "needs a --volume",
            ("--volume", "none.nrrd:auto"): "is not FILE:TRANSFER of a file",
        }
        for arguments, says in cases.items():
            told = io.StringIO()
            with contextlib.redirect_stderr(told), self.assertRaises(SystemExit):
                options(*arguments)
            self.assertIn(says, told.getvalue().splitlines()[-1])

    def test_what_is_wrong_for_the_other_programs_is_told_in_a_line(self) -> None:
        cases = {
            (cluster_paper, "--repeats", "0"): "--repeats 0: must be from 1 to 1000",
            (cluster_balance, "--repeats", "101"): "--repeats 101: must be from 1 to 100",
            (cluster_balance, "--workers", "17"): "--workers 17: must be from 1 to 16",
            (cluster_trace, "--frames", "0"): "--frames 0: must be from 1 to 1000",
            (cluster_trace, "--link", "1000"): "--link 1000: must be from 0.01 to 100",
            (cluster_pieces, "--size", "63"): "--size 63: must be from 64 to 2048",
        }
        for (program, *arguments), says in cases.items():
            told = io.StringIO()
            with contextlib.redirect_stderr(told), self.assertRaises(SystemExit):
                options(*arguments, program=program)
            self.assertIn(says, told.getvalue().splitlines()[-1])

    def test_the_same_volumes_are_measured_and_simulated(self) -> None:
        with tempfile.NamedTemporaryFile(suffix=".nrrd") as file:
            matrix = cluster.Matrix(options("--quick", "--volume", f"{file.name}:ct-bone"))
            dataset = pathlib.Path(file.name).stem
            self.assertEqual(matrix.served["volumes"][1], {"dataset": dataset, "transfer": "ct-bone"})
            self.assertEqual(matrix.here["volumes"][1]["transfer"], "ct-bone")
            self.assertEqual(matrix.served["volumes"][0], matrix.here["volumes"][0])
            self.assertEqual(list(matrix.data), ["class2-128", dataset])
            self.assertNotIn("workers", matrix.served)
            self.assertEqual(matrix.here["hosts"], {"cores": 1, "traffic": "encrypted"})


class Timelines(unittest.TestCase):
    def test_the_parts_of_a_frame_are_what_was_planted_and_add_up_to_its_latency(self) -> None:
        def event(worker: int, name: str, begin: float, end: float) -> dict:
            return {"ph": "X", "pid": worker, "name": name, "ts": 1e6 * begin, "dur": 1e6 * (end - begin)}

        earlier = [event(0, "frame 0", 0, 100), event(1, "render", 0, 90)]
        frame = [event(0, "frame 1", 100, 200)]
        renders = [event(1, "render", 110, 130), event(2, "render", 120, 140), event(2, "render", 140, 150)]  # two boxes of worker 2
        combines = [event(2, "encode", 150, 151), event(1, "combine", 135, 136), event(1, "combine", 160, 165)]
        picture = [event(1, "resolve", 165, 175), event(1, "encode", 175, 180)]
        with tempfile.TemporaryDirectory() as name:
            file = pathlib.Path(name) / "timeline.json"
            meta = [{"ph": "M", "pid": 1, "name": "process_name"}]
            file.write_text(json.dumps({"traceEvents": meta + earlier + frame + renders + combines + picture}), encoding="utf-8")
            (parts,) = cluster_trace.parts_of_frames(file, 1)
        expected = {"begins": 15, "renders": 25, "waits": 10, "combines": 15, "picture": 10, "encodes": 5, "travels": 20}
        self.assertEqual(parts.keys(), expected.keys())
        for part, seconds in expected.items():
            self.assertAlmostEqual(parts[part], seconds, msg=part)
        self.assertAlmostEqual(sum(parts.values()), 100)


class Pieces(unittest.TestCase):
    def test_a_seam_shows_beside_the_border_of_pieces_alone(self) -> None:
        size, span = 96, 2 * cluster_pieces.MEANS
        a, b, c = cluster_pieces.waves(size)
        values = (b.T * c.mean(axis=1)) @ a  # by another way than the program's
        picture = (255 * (values[::-1, :, None] / span + 0.5)).clip(0, 255).round().astype(int)
        step = span / 255 / cluster_pieces.RANGE
        beside, elsewhere = cluster_pieces.differences(picture, size)
        self.assertLess(max(beside, elsewhere), 0.51 * step)
        (border,) = {extent[2] for extent in cluster_pieces.extents(size)} & {24}
        picture[size - 1 - border, 40:44] += 3
        beside, elsewhere = cluster_pieces.differences(picture, size)
        self.assertGreater(beside, 2.4 * step)
        self.assertLess(elsewhere, 0.51 * step)

    def test_pieces_share_their_borders_and_leave_nothing_out(self) -> None:
        for size in (64, 97, 1500):
            taken = [(y, z) for _, _, y0, y1, z0, z1 in cluster_pieces.extents(size) for y in (y0, y1) for z in (z0, z1)]
            cuts = sorted({y for y, _ in taken})
            self.assertEqual((cuts[0], cuts[-1], len(cuts)), (0, size - 1, 5))
            self.assertEqual({taken.count(corner) for corner in taken}, {1, 2, 4})


class Repeats(unittest.TestCase):
    def test_runs_of_a_case_are_its_repeats(self) -> None:
        runs = [[{"metric": "latency", "value": float(value), "low": 0, "high": 0, "repeats": 1}] for value in (3, 1, 2)]
        (row,) = cluster_balance.joined(runs)
        self.assertEqual((row["value"], row["low"], row["high"], row["repeats"], row["each"]), (2, 1, 3, 3, [3, 1, 2]))

    def test_steps_are_medians_over_the_runs(self) -> None:
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            for run, value in enumerate((5, 1, 2)):
                (folder / str(run)).mkdir()
                head = "step,decomposition,balance_by,balance,assignment,groups,longest_render_time,imbalance,voxel_bytes"
                (folder / str(run) / "path-a.csv").write_text(f"{head}\n0,kd-tree,occupied,dynamic,cyclic,1,{value},1.5,0\n")
            cluster_balance.join_steps([folder / str(run) for run in range(3)], folder)
            self.assertEqual((folder / "path-a.csv").read_text().splitlines()[1], "0,kd-tree,occupied,dynamic,cyclic,1,2.0,1.5,0.0")


class Quotas(unittest.TestCase):
    def limits(self, version: int, share: float | None) -> dict[str, str]:
        with tempfile.TemporaryDirectory() as folder:
            quota = dilated_cluster.Quota.__new__(dilated_cluster.Quota)
            quota.version, quota.folder = version, pathlib.Path(folder)
            quota.limit(share)
            return {path.name: path.read_text() for path in quota.folder.iterdir()}

    def test_a_share_is_a_quota_of_five_milliseconds_or_more(self) -> None:
        self.assertEqual(self.limits(2, 0.4), {"cpu.max": "2000 5000"})
        self.assertEqual(self.limits(2, 0.1), {"cpu.max": "1000 10000"})
        self.assertEqual(self.limits(2, 1), {"cpu.max": "5000 5000"})
        self.assertEqual(self.limits(2, None), {"cpu.max": "max 5000"})
        self.assertEqual(self.limits(1, 0.1), {"cpu.cfs_period_us": "10000", "cpu.cfs_quota_us": "1000"})
        self.assertEqual(self.limits(1, None)["cpu.cfs_quota_us"], "-1")


class Hosts(unittest.TestCase):
    def test_hosts_are_apart_and_leave_nothing_behind(self) -> None:
        try:
            made = dilated_cluster.Cluster(2)
        except dilated_cluster.ClusterError as error:
            self.skipTest(str(error))
        with made:
            made.limit(0.5, 1e8)
            first = made.hosts[0]
            folder, name = first.quota.folder, first.name

            def told(host, command: str) -> str:
                return host.start(["sh", "-c", command], stdout=subprocess.PIPE, text=True).communicate()[0].strip()

            self.assertEqual([told(host, "hostname") for host in made.hosts], ["node0", "node1"])
            sleepers = [
                host.start(["sh", "-c", "readlink /proc/self/ns/pid; exec sleep 1000"], stdout=subprocess.PIPE, text=True)
                for host in made.hosts
            ]
            scopes = [sleeper.stdout.readline().strip() for sleeper in sleepers]
            self.assertEqual(len({*scopes, os.readlink("/proc/self/ns/pid")}), 3)
            self.assertIn(first.address, told(first, "ip -o -4 addr show eth0"))
            rate = subprocess.run(["tc", "-n", name, "qdisc", "show", "dev", "eth0"], capture_output=True, text=True, check=True).stdout
            self.assertIn("tbf", rate)
            self.assertIn("rate 800Mbit", rate)
        for sleeper in sleepers:
            self.assertIsNotNone(sleeper.wait(timeout=60))
            sleeper.stdout.close()
        self.assertFalse(folder.exists())
        self.assertNotIn(name, subprocess.run(["ip", "netns"], capture_output=True, text=True, check=True).stdout)


if __name__ == "__main__":
    unittest.main()
