#!/usr/bin/env python3
"""Channels and times: every way in shows the same picture, and frames over time are whole although a worker is killed."""
from __future__ import annotations

import json
import os
import shlex
import signal
import subprocess
import sys
import unittest
import urllib.parse

import numpy as np

from client_support import ROOT, PROGRAMS, InAFolder, RunningService, read_png, write_cells

sys.path.insert(0, str(ROOT / "tests" / "gateway"))
from page import Gateway  # noqa: E402

import slabstream as ss  # noqa: E402

# What a picture shows, as options of the command line and over HTTP, and in Python.
ASKED: list[tuple[str, dict, dict]] = [
    ("render", {}, {}),
    ("render", {"channel": "0,Actin", "channel-color": "0=green,Actin=#f0f", "channel-range": "0=10:150,Actin=2%:99%",
                "channel-gamma": "Actin=0.7", "channel-opacity": "0=0.5", "time": "last", "renderer": "raycast"},
     {"channels": {0: {"color": "green", "range": (10, 150), "opacity": 0.5}, "Actin": {"color": "#f0f", "range": "2%:99%", "gamma": 0.7}},
      "time": "last", "renderer": "raycast"}),
    ("render", {"channel": "Actin", "channel-transfer": "Actin=viridis", "time": "2.5s"},
     {"channels": {"Actin": {"transfer": "viridis"}}, "time": "2.5s"}),
    ("render", {"channel": "1,0", "blend": "over", "time": "2"}, {"channels": [1, 0], "blend": "over", "time": 2}),
    ("render", {"renderer": "mip", "time": "1"}, {"renderer": "mip", "time": 1}),
    ("slice", {"plane": "z", "channel": "DAPI", "channel-color": "DAPI=white", "time": "1"},
     {"plane": "z", "channels": {"DAPI": {"color": "white"}}, "time": 1}),
    ("render", {"overlay-transfer": "hot", "overlay-range": "20:150", "overlay-weight": "0.5"},
     {"overlay_transfer": "hot", "overlay_range": (20, 150), "overlay_weight": 0.5}),
    ("render", {"channel": "0,overlay"}, {"channels": [0, "overlay"]}),
    ("render", {"channel-opacity": "overlay=1", "renderer": "raycast"}, {"overlay": True, "renderer": "raycast"}),
    ("slice", {"plane": "z", "overlay-transfer": "hot"}, {"plane": "z", "overlay_transfer": "hot"}),
]
FRAMES, TIMES = 48, 3


class Cells(InAFolder):
    """A service of two workers with write_cells' volume."""

    def setUp(self) -> None:
        super().setUp()
        cells = write_cells(self.folder)
        self.running = RunningService(self.folder, "--data", f"cells={cells},overlay={cells}?channel=1,time=1")
        self.addCleanup(self.running.end)
        self.service = ss.connect(endpoint=self.running.endpoint)
        self.addCleanup(self.service.close)

    def gateway(self) -> Gateway:
        process = subprocess.Popen([PROGRAMS / "slabstream-gateway", "--endpoint", self.running.endpoint], stdout=subprocess.PIPE, text=True)
        self.addCleanup(process.stdout.close)
        self.addCleanup(process.wait)
        self.addCleanup(process.terminate)
        return Gateway(next(word for word in process.stdout.readline().split() if "#token=" in word))

    def written(self, words: list[str], name: str) -> bytes:
        """The file of a command line."""
        done = self.running.run(*words, "-o", name, "--endpoint", self.running.endpoint)
        self.assertEqual(done.returncode, 0, done.stderr)
        return (self.folder / name).read_bytes()

    def test_every_way_in_shows_the_same_picture(self) -> None:
        gateway = self.gateway()

        def answer(path: str, options: dict) -> bytes:
            while True:  # the gateway may not have found its service yet
                status, _, body = gateway.request(f"/api/v1/{path}?{urllib.parse.urlencode(options)}")
                if status != 503:
                    self.assertEqual(status, 200, body)
                    return body

        seen = []
        for command, options, in_python in ASKED:
            with self.subTest(command=command, options=options):
                options = {"size": "64", **options}
                by_shell = self.written([command, "cells", *(f"--{name}={value}" for name, value in options.items())], "shell.png")
                codes = read_png(by_shell)
                self.assertEqual(answer(f"{command}.png", {"dataset": "cells", **options}), by_shell)
                np.testing.assert_array_equal(np.asarray(getattr(self.service, command)("cells", size=64, **in_python)), codes)
                seen.append(codes)
                if command == "slice":
                    continue  # which has neither a record nor a command
                said = self.running.run("info", "shell.png").stdout.splitlines()
                again = shlex.split(said[said.index("command") + 1])
                told = json.loads(answer("command", {"dataset": "cells", **options}))
                for name, text in told["files"].items():
                    (self.folder / name).write_text(text)
                for line in (again, shlex.split(told["command"])):
                    self.assertEqual(line[0], "slabstream")
                    at = line.index("-o")
                    np.testing.assert_array_equal(read_png(self.written(line[1:at] + line[at + 2 :], "again.png")), codes, str(line))
        for i, one in enumerate(seen):
            self.assertFalse(any(np.array_equal(one, other) for other in seen[:i]), "two requests look alike")

    def test_a_turntable_shows_several_times_as_that_of_the_command_line(self) -> None:
        for frames, shown in ((None, "0:2:2"), (4, "0:2"), (2, "1:1")):
            with self.subTest(frames=frames, time=shown):
                images = list(self.service.turntable("cells", frames, time=shown, size=48, turns=2))
                words = [] if frames is None else ["--frames", str(frames)]
                done = self.running.run("turntable", "cells", "--time", shown, "--turns", "2", "--size", "48", "-o", "t%d.png", *words,
                                        "--endpoint", self.running.endpoint)
                self.assertEqual(done.returncode, 0, done.stderr)
                self.assertEqual(len(images), frames or 2)
                for i, image in enumerate(images):
                    np.testing.assert_array_equal(np.asarray(image), read_png((self.folder / f"t{i}.png").read_bytes()))
        for wrong in ("2:1", "0:2:0", "0:x", ":", "0:1:2:3", "0:9999999", "1:"):
            with self.assertRaisesRegex(ss.InvalidArgument, f"time (is )?'{wrong}'"):
                list(self.service.turntable("cells", 2, time=wrong))
        with self.assertRaisesRegex(ss.InvalidArgument, "frames"):
            self.service.turntable("cells")

    def test_functions_of_several_channels_have_a_file_each(self) -> None:
        maps = [{"RGBPoints": [0, 0, 0, 0, 200, *color]} for color in ((1, 0.5, 0), (0, 0.5, 1))]
        asked = {"dataset": "cells", "size": 64, "channel": "0,1", "channel-transfer": f"0={json.dumps(maps[0])},1={json.dumps(maps[1])}"}
        gateway = self.gateway()
        status, _, body = gateway.request("/api/v1/command", "POST", body=json.dumps(asked))
        self.assertEqual(status, 200, body)
        told = json.loads(body)
        self.assertEqual(sorted(told["files"]), ["channel-map-1.json", "channel-map-2.json"])
        for name, text in told["files"].items():
            (self.folder / name).write_text(text)
        line = shlex.split(told["command"])
        at = line.index("-o")
        by_shell = self.written(line[1:at] + line[at + 2 :], "shell.png")
        status, _, picture = gateway.request("/api/v1/render.png", "POST", body=json.dumps(asked))
        self.assertEqual((status, picture), (200, by_shell))
        of_record = json.loads(self.running.run("info", "shell.png", "--json").stdout)["files"]
        self.assertEqual(of_record, {name: json.loads(text) for name, text in told["files"].items()})

    def whole_frames(self, renderer: str, tolerance: int) -> None:
        options = {"renderer": renderer, "size": 160}
        expected = [np.asarray(self.service.render("cells", time=time, **options)).astype(int) for time in range(TIMES)]
        self.assertFalse(np.array_equal(expected[0], expected[1]))
        worker = self.service.status().workers[0].pid
        frames = [self.service.submit("cells", time=i % TIMES, **options) for i in range(FRAMES // 2)]
        frames[0].result()
        os.kill(worker, signal.SIGKILL)
        frames += [self.service.submit("cells", time=i % TIMES, **options) for i in range(FRAMES // 2, FRAMES)]
        for i, frame in enumerate(frames):
            image = frame.result()
            self.assertFalse(image.preview)
            self.assertLessEqual(np.abs(np.asarray(image) - expected[i % TIMES]).max(), tolerance, f"frame {i}")
        self.assertEqual(self.service.status().workers_lost, 1)

    def test_largest_values_over_time_are_the_same_although_a_worker_is_killed(self) -> None:
        self.whole_frames("mip", 0)

    def test_frames_over_time_are_whole_although_a_worker_is_killed(self) -> None:
        self.whole_frames("raycast", 1)  # a sum of samples may round otherwise if another worker makes it


if __name__ == "__main__":
    unittest.main()
