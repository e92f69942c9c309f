"""The Python client at real services: pictures, what ends them, keys, a coordinator that is started anew, and a service of its own."""
from __future__ import annotations

import asyncio
import concurrent.futures
import contextlib
import functools
import http.server
import inspect
import json
import os
import pathlib
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import threading
import time
import unittest
import unittest.mock

import numpy as np

from client_support import HEAVY, PROGRAM, PROGRAMS, START_SECONDS, InAFolder, RunningService, WithAService, volume_arrays, write_cells, write_volumes
from exr_reader import exr_channels

import slabstream as ss  # noqa: E402
from slabstream.programs import find_program  # noqa: E402


class AtAService(WithAService):
    def setUp(self) -> None:
        self.service = ss.connect(endpoint=self.running.endpoint)
        self.addCleanup(self.service.close)

    def test_pictures_know_their_size_place_and_cost(self) -> None:
        image = self.service.render("head", size=(60, 40), azimuth=90)
        self.assertEqual((image.size, image.shape, np.asarray(image).shape), ((60, 40), (40, 60, 4), (40, 60, 4)))
        self.assertEqual(np.asarray(image).dtype, np.uint8)
        self.assertEqual((image.rgba.dtype, image.rgba.shape), (np.float32, (40, 60, 4)))
        self.assertIsNone(image.depth)
        self.assertEqual((image.geometry.world, image.geometry.unit), ("patient", "millimetre"))
        np.testing.assert_allclose(image.geometry.right, (0, 1, 0), atol=1e-12)
        self.assertEqual((image.statistics.workers, image.statistics.attempts, image.statistics.decomposition), (2, 1, "kd-tree"))
        self.assertEqual(image.statistics.renderer, "splat")
        self.assertGreater(image.statistics.worker_seconds["splat"], 0)
        self.assertGreaterEqual(image.statistics.latency_seconds, image.statistics.frame_seconds)

    def test_the_view_is_that_of_the_command_line(self) -> None:
        front = self.service.render("head", size=40)  # of a patient
        np.testing.assert_allclose(front.geometry.forward, (0, -1, 0), atol=1e-12)
        np.testing.assert_array_equal(np.asarray(front), np.asarray(self.service.render("head", size=40, azimuth=180, elevation=0, fit=True)))
        whole, fitted = (self.service.render("head", size=40, clip_box=":30%,:30%,:30%", fit=fit) for fit in (False, True))
        self.assertGreater(whole.geometry.pixel_size, fitted.geometry.pixel_size)

    def test_the_zbuffer_has_depths(self) -> None:
        image = self.service.render("head", renderer="zbuffer", size=50)
        seen = image.rgba[..., 3] > 0
        self.assertTrue(np.isfinite(image.depth[seen]).all())
        self.assertTrue(np.isposinf(image.depth[~seen]).all())
        self.assertTrue(seen.any() and not seen.all())

    def test_what_a_dataset_holds(self) -> None:
        values, labels, overlay = volume_arrays()
        joint = self.service.joint_histogram("head")
        self.assertEqual(joint.counts.sum(), np.prod(np.array(values.shape) - 2), "the outermost voxels have no slope")
        inner = values[1:-1, 1:-1, 1:-1]
        np.testing.assert_array_equal(joint.counts.sum(axis=1), np.histogram(inner, bins=joint.value_edges)[0])
        histogram = self.service.histogram("head")
        low, high = histogram.value_range
        self.assertEqual((low, high), (values.min(), values.max()))
        np.testing.assert_array_equal(histogram.counts, np.histogram(values, bins=256, range=(low, high))[0])
        self.assertEqual(histogram.edges.shape, (257,))
        found = self.service.labels("head")
        self.assertEqual([(label.value, label.name) for label in found], [(1, "left_1"), (2, "left_2"), (3, "right_2")])
        self.assertTrue(all(0 <= share <= 1 for label in found for share in label.color))
        with self.assertRaisesRegex(ss.NotFound, 'no dataset "nothing"'):
            self.service.labels("nothing")
        for percent, value in histogram.percentiles.items():
            below = np.mean(values <= value + (high - low) / 256)
            self.assertGreaterEqual(below, percent / 100)
        # The head is a patient's: origin (-10, 5, 20) and spacing (2, 1.5, 1.25) as z, y, x.
        for index in ((0, 0, 0), (10, 12, 14), (12, 9, 20), (19, 23, 27)):
            z, y, x = (o + s * i for o, s, i in zip((-10, 5, 20), (2, 1.5, 1.25), index))
            there = self.service.value("head", at=(x + 0.3, y - 0.3, z))
            self.assertEqual((there.index, there.value, there.label), (index, values[index], labels[index]))
            expected = None if np.isnan(overlay[index]) else float(overlay[index])
            self.assertEqual(there.fields, (("volume", values[index]), ("overlay", expected)))
            self.assertEqual(self.service.value("head", (x, y, z), field=0).fields, there.fields[:1])
            self.assertEqual(self.service.value("head", (x, y, z), field=(0, "overlay")).fields, there.fields)
        self.assertIsNone(self.service.value("head", at="0,0,1e6"))
        with self.assertRaisesRegex(ss.NotFound, 'no dataset "nothing"'):
            self.service.histogram("nothing")
        with self.assertRaisesRegex(ss.InvalidArgument, "at '1,2' is not X,Y,Z"):
            self.service.value("head", at="1,2")

    def test_labels_are_measured(self) -> None:
        values, labels, _ = volume_arrays()
        found = self.service.label_statistics("head")
        self.assertEqual([(each.label.value, each.label.name) for each in found], [(1, "left_1"), (2, "left_2"), (3, "right_2")])
        for each in found:
            there = values[labels == each.label.value].astype(float)
            self.assertEqual((each.voxels, each.non_finite, each.least, each.largest), (there.size, 0, there.min(), there.max()))
            self.assertEqual((each.mean, each.unit), (there.sum() / there.size, "ml"))
            self.assertAlmostEqual(each.deviation, there.std(), 9)
            self.assertAlmostEqual(each.volume, there.size * 2 * 1.5 * 1.25 / 1000, 12)
        z = -10 + 2 * 4  # of the slice with index 4
        boxed = self.service.label_statistics("head", clip_box=((None, None), (None, None), (z - 0.5, z + 0.5)))
        self.assertEqual([each.voxels for each in boxed], [int((labels[4] == value).sum()) for value in (1, 2, 3)])
        self.assertTrue(all((each.mean is None) == (each.voxels == 0) for each in boxed))
        with self.assertRaisesRegex(ss.NotFound, 'no dataset "nothing"'):
            self.service.label_statistics("nothing")

    def test_colour_maps_of_matplotlib_look_like_presets(self) -> None:
        try:
            import matplotlib
        except ImportError:
            self.skipTest("install python3-matplotlib")
        preset = np.asarray(self.service.render("head", transfer="viridis", size=40, background="black")).astype(int)
        same = np.asarray(self.service.render("head", transfer=matplotlib.colormaps["viridis"], size=40, background="black"))
        self.assertLessEqual(np.abs(preset - same).max(), 3, "our table of it has fewer colours")
        other = np.asarray(self.service.render("head", transfer="RdBu", size=40, background="black"))
        self.assertGreater(np.abs(preset - other).max(), 30)
        np.testing.assert_array_equal(np.asarray(self.service.slice("head", transfer=matplotlib.colormaps["viridis"], plane="z", size=20))[..., 3],
                                      np.asarray(self.service.slice("head", transfer="viridis", plane="z", size=20))[..., 3])
        with self.assertRaisesRegex(ss.SlabstreamError, "nonesuch"):
            self.service.render("head", transfer="nonesuch")

    def test_a_pixel_shows_the_point_that_its_depth_says(self) -> None:
        options = dict(renderer="zbuffer", size=(50, 40), azimuth=40, elevation=25, zoom=1.3)
        image = self.service.render("head", **options)
        place = image.geometry
        for x, y in ((25, 20), (20, 16), (31, 22), (1, 1)):
            seen, depth = self.service.pick("head", x + 0.5, y + 0.5, **options), image.depth[y, x]
            self.assertEqual(seen is None, not np.isfinite(depth))
            if seen is None:
                continue
            self.assertAlmostEqual(seen.depth, float(depth), 3)
            right, up = np.array(place.right) * place.pixel_size, np.array(place.up) * place.pixel_size
            at = np.array(place.target) + (depth - place.target_depth) * np.array(place.forward) + (x - 24.5) * right - (y - 19.5) * up
            np.testing.assert_allclose(seen.at, at, atol=1e-3)
        with self.assertRaisesRegex(ss.InvalidArgument, r"x 51 is out of range \[0, 50\]"):
            self.service.pick("head", 51, 0, **options)

    def test_pictures_are_saved_whole(self) -> None:
        image = self.service.render("head", size=20)
        image.save(self.folder / "a.PNG")
        self.assertEqual((self.folder / "a.PNG").read_bytes(), image.png())
        with self.assertRaisesRegex(ss.InvalidArgument, "must end in .png, .*, .pdf or .svg"):
            image.save("a.gif")
        with self.assertRaisesRegex(ss.Unavailable, "cannot write '.*none/a.png': No such file"):
            image.save(self.folder / "none" / "a.png")

    def test_other_types_are_those_of_the_command_line(self) -> None:
        options = dict(size=(60, 50), dpi=200, font_size=9, title="A head", scale_bar=True, quality=60, background="white", azimuth=30)
        image = self.service.render("head", **options)
        arguments = ["--size=60x50", "--dpi=200", "--font-size=9", "--title=A head", "--scale-bar", "--quality=60", "--background=white", "--azimuth=30"]
        image.save(self.folder / "a.svg")
        self.assertIn(b"<image", (self.folder / "a.svg").read_bytes())
        for ending in ("jpg", "webp", "tif", "pdf"):
            image.save(self.folder / f"a.{ending}")
            self.running.run("render", "head", "-o", f"b.{ending}", "--no-record", "--endpoint", self.running.endpoint, *arguments)
            self.assertEqual((self.folder / f"a.{ending}").read_bytes(), (self.folder / f"b.{ending}").read_bytes(), ending)
        self.assertIn(struct.pack(">II", round(200 / 0.0254), round(200 / 0.0254)), image.png())
        image.save(self.folder / "a.tif", bits=16)
        with self.assertRaisesRegex(ss.InvalidArgument, "bits is 16, but samples of .jpg have 8"):
            image.save("a.jpg", bits=16)

    def test_openexr_has_the_samples_of_the_command_line(self) -> None:
        for renderer, size in (("zbuffer", (37, 21)), ("raycast", (50, 33))):
            image = self.service.render("head", size=size, renderer=renderer, azimuth=30)
            image.save(self.folder / "a.exr")
            self.running.run("render", "head", "-o", "b.exr", "--endpoint", self.running.endpoint, "--size", "x".join(map(str, size)),
                             "--renderer", renderer, "--azimuth", "30")
            ours, theirs = (exr_channels((self.folder / name).read_bytes()) for name in ("a.exr", "b.exr"))
            self.assertEqual(list(ours), ["A", "B", "G", "R"] + (["Z"] if renderer == "zbuffer" else []))
            self.assertEqual(list(ours), list(theirs))
            for name, samples in ours.items():
                np.testing.assert_array_equal(samples, theirs[name], err_msg=name)
        with self.assertRaisesRegex(ss.InvalidArgument, "bits is 16, but samples of .exr are floats"):
            image.save("a.exr", bits=16)

    def test_previews_and_progress_come_before_the_picture(self) -> None:
        told, previews = [], []
        frame = self.service.submit("head", groups=4, size=100, on_progress=told.append, on_preview=previews.append)
        picture = frame.result()
        self.assertFalse(picture.preview)
        self.assertTrue(all(preview.preview and preview.size == (100, 100) for preview in previews))
        self.assertEqual(told[-1].group_count, 4)
        self.assertEqual(told[-1], frame.progress)
        shown = list(self.service.submit("head", groups=4, size=100, previews=True).previews())
        self.assertFalse(shown[-1].preview)
        np.testing.assert_array_equal(np.asarray(shown[-1]), np.asarray(picture))

    def test_a_callback_that_fails_harms_nothing(self) -> None:
        with self.assertLogs("slabstream", "ERROR"):
            self.assertEqual(self.service.submit("head", size=9, on_progress=lambda _: 1 / 0).result().size, (9, 9))

    def test_frames_are_futures(self) -> None:
        frames = [self.service.submit("head", size=30, azimuth=angle) for angle in range(0, 360, 45)]
        done, pending = concurrent.futures.wait([frame.future for frame in frames])
        self.assertEqual((len(done), len(pending)), (8, 0))
        self.assertIsNone(frames[0].exception())
        self.assertFalse(self.service.submit("head", size=30).future.cancel())

        async def get() -> ss.Image:
            return await asyncio.wrap_future(self.service.submit("head", size=30, azimuth=0).future)

        np.testing.assert_array_equal(np.asarray(asyncio.run(get())), np.asarray(frames[0].result()))
        told: list = []
        frames[0].add_done_callback(told.append)
        self.assertEqual(told, [frames[0]])

    def test_threads_share_a_service(self) -> None:
        with concurrent.futures.ThreadPoolExecutor(8) as pool:
            images = list(pool.map(lambda i: self.service.render("head", size=20 + i), range(40)))
        self.assertEqual([image.size[0] for image in images], list(range(20, 60)))

    def test_cancelled_frames_say_so(self) -> None:
        frame = self.service.submit("head", **HEAVY)
        with self.assertRaisesRegex(ss.DeadlineExceeded, "the frame is not finished after 0 s"):
            frame.result(timeout=0)
        frame.cancel()
        self.assertRaises(ss.Cancelled, frame.result)
        frame.cancel()  # again: nothing
        self.assertTrue(frame.done())
        with self.assertRaises(concurrent.futures.CancelledError):
            frame.result()

    def test_a_deadline_ends_a_frame(self) -> None:
        with self.assertRaises(TimeoutError):
            self.service.render("head", deadline=0.001, **HEAVY)

    def test_turntables_come_in_order_and_turn(self) -> None:
        images = list(self.service.turntable("head", 4, size=30, azimuth=10, in_flight=3))
        for image, azimuth in zip(images, (10, 100, 190, 280)):
            np.testing.assert_array_equal(np.asarray(image), np.asarray(self.service.render("head", size=30, azimuth=azimuth)))
        still = list(self.service.turntable("head", 2, turns=0, size=30, eye=(100, 0, 0)))
        np.testing.assert_array_equal(np.asarray(still[0]), np.asarray(still[1]))
        path = [{"azimuth": 10, "elevation": 20}, {"azimuth": 100, "zoom": 2}, {}]
        moved = list(self.service.turntable("head", 5, size=30, path=path))
        for image, camera in zip(moved[::2], path):
            np.testing.assert_array_equal(np.asarray(image), np.asarray(self.service.render("head", size=30, **camera)))
        for given, sentence in (({"frames": 0}, "frames 0 is out of range"),
                                ({"frames": 2, "path": [{}]}, "path must be a list of 2 to 1000 cameras"),
                                ({"frames": 2, "path": [{}, {}], "azimuth": 3}, "path excludes azimuth"),
                                ({"frames": 2, "path": [{}, {"zoom": 0}]}, "camera 2 of the path: zoom 0 is out of range"), ({"frames": 2, "eye": (1, 2, 3)}, "eye fixes the viewpoint"),
                                ({"frames": 2, "in_flight": 65}, "in_flight 65 is out of range"), ({"frames": 2, "zoom": 0}, "zoom 0 is out")):
            with self.subTest(given=given), self.assertRaisesRegex(ss.InvalidArgument, sentence):
                self.service.turntable("head", **given)

    def test_a_turntable_that_is_left_cancels_the_rest(self) -> None:
        turntable = self.service.turntable("head", 1000, in_flight=8, size=10)
        next(turntable)
        turntable.close()
        self.service.render("head", size=10)
        self.assertLess(self.service.status().frames_done, 900)

    def test_the_services_sentence_is_the_exceptions(self) -> None:
        for options, kind, sentence in (
            ({"dataset": "foot"}, ss.NotFound, "foot"),
            ({"dataset": "head", "renderer": "splat", "shading": "depth-gradient"}, ss.InvalidArgument, "renderer is 'splat', but shading 'depth-gradient' needs one of: zbuffer"),
            ({"dataset": "head", "isovalue": 4, "energy": 60}, ss.InvalidArgument, "isovalue needs one of: raycast, zbuffer; energy needs one of: xray"),
            ({"dataset": "head", "fit": True, "renderer": "mip", "sampling_rate": 1, "combine": "knit"}, ss.InvalidArgument, "knit"),
        ):
            with self.subTest(options=options), self.assertRaises(kind) as caught:
                self.service.render(**options)
            self.assertIn(sentence, str(caught.exception))
            self.assertNotIn("\n", str(caught.exception))

    def test_status_tells_of_workers_and_datasets(self) -> None:
        self.service.render("head", size=9)
        status = self.service.status()
        self.assertEqual((status.pid, len(status.workers), status.endpoint), (self.running.coordinator, 2, self.running.endpoint))
        head = {dataset.name: dataset for dataset in self.service.datasets()}["head"]
        self.assertEqual((head.state, head.shape, head.spacing, head.dtype), ("ready", (20, 24, 28), (2, 1.5, 1.25), "uint8"))
        self.assertEqual((head.labels, head.overlay), (True, True))

    def test_channels_and_times_are_told_and_asked_about(self) -> None:
        self.service.add_data(cells=write_cells(self.folder))
        try:
            first = self.service.histogram("cells")
            cells = {dataset.name: dataset for dataset in self.service.datasets()}["cells"]
            self.assertEqual([(field.name, field.channel, field.shown) for field in cells.fields], [("DAPI", True, True), ("Actin", True, True)])
            self.assertEqual((cells.times, cells.field, cells.time), (3, 0, 0))
            self.assertEqual(first.value_range, (0, 200))
            self.assertEqual(self.service.histogram("cells", field="Actin", time=2).value_range, (0, 1000))
            self.assertEqual(self.service.joint_histogram("cells", field=1).value_edges[-1], 1000)
            for field, time, centre, value in ((0, 0, 4, 200), ("DAPI", "last", 6, 200), (1, 1, 10, 1000)):
                self.assertEqual(self.service.value("cells", (centre, 8, 8), field=field, time=time).value, value)
            for given, sentence in (({"field": 2}, "has no field '2': it has 0 (DAPI), 1 (Actin)"), ({"time": 3}, "has times 0 to 2"),
                                    ({"field": 1.5}, "field 1.5 is neither a number nor a text")):
                with self.assertRaises(ss.InvalidArgument) as caught:
                    self.service.histogram("cells", **given)
                self.assertIn(sentence, str(caught.exception))
            self.service.histogram("head")
            head = {dataset.name: dataset for dataset in self.service.datasets()}["head"]
            self.assertEqual((head.fields, head.times), ((ss.Field(), ss.Field(name="overlay", channel=False, shown=False),
                                                             ss.Field(name="labels", channel=False, shown=False, labels=True)), 1))
        finally:
            self.service.remove_data("cells")

    def test_data_comes_and_goes(self) -> None:
        names = {dataset.name for dataset in self.service.add_data(copy=self.folder / "head.nrrd")}
        self.assertEqual(names, {"head", "copy"})
        np.testing.assert_array_equal(np.asarray(self.service.render("copy", size=30)), np.asarray(self.service.render("head", size=30)))
        self.service.reload_data("copy")
        self.assertEqual([dataset.name for dataset in self.service.remove_data("copy")], ["head"])
        with self.assertRaisesRegex(ss.InvalidArgument, "the path must be absolute"):
            self.service.add_data(copy="head.nrrd")
        with self.assertRaisesRegex(ss.NotFound, "none.nrrd"):
            self.service.add_data(copy="/none.nrrd")
        with self.assertRaises(ss.NotFound):
            self.service.remove_data("copy")

    def test_a_closed_service_says_so(self) -> None:
        frame = self.service.submit("head", **HEAVY)
        self.service.close()
        self.assertRaises(ss.Cancelled, frame.result)
        with self.assertRaisesRegex(ss.Unavailable, "is closed"):
            self.service.render("head")
        self.service.close()

    def test_a_service_that_nobody_uses_closes_itself(self) -> None:
        clients = self.service.status().clients
        for _ in range(3):
            ss.connect(endpoint=self.running.endpoint)
        self.assertEqual(self.service.status().clients, clients)

    def test_the_service_that_up_started_is_found(self) -> None:
        with unittest.mock.patch.dict(os.environ, {"XDG_RUNTIME_DIR": str(self.folder)}):
            os.environ.pop("SLABSTREAM_ENDPOINT", None)
            with ss.connect() as service:
                self.assertEqual(service.endpoint, self.running.endpoint)
        with unittest.mock.patch.dict(os.environ, {"SLABSTREAM_ENDPOINT": self.running.endpoint}), ss.connect() as service:
            self.assertEqual(service.endpoint, self.running.endpoint)

    def test_arrays_go_to_a_service_that_is_given(self) -> None:
        values = volume_arrays()[0]
        with ss.load(values, spacing=(2, 1.5, 1.25), service=self.service) as volume:
            self.assertEqual(volume.render(size=20).size, (20, 20))
            self.assertEqual(len(self.service.datasets()), 2)
        self.assertEqual(len(self.service.datasets()), 1)


class Steering(WithAService):
    def test_parameters_of_a_simulation_are_told_and_changed(self) -> None:
        simulation = subprocess.Popen([PROGRAMS.parent / "tests" / "steered_simulation", self.running.endpoint, "rho"])
        self.addCleanup(simulation.wait)
        self.addCleanup(simulation.kill)
        with ss.connect(endpoint=self.running.endpoint) as service:
            until = time.monotonic() + START_SECONDS
            while all(dataset.name != "rho" for dataset in service.status().datasets) and time.monotonic() < until:
                time.sleep(0.02)
            self.assertEqual(service.parameters("rho"), {"level": ss.Parameter("level", 100, 0, 250), "unused": ss.Parameter("unused", 0, -1, 1)})
            steered = service.steer("rho", level=200, unused=-0.5)
            self.assertEqual([parameter.value for parameter in steered.parameters], [200, -0.5])
            self.assertAlmostEqual(steered.simulated, steered.time / 100)
            told = next(dataset.simulation for dataset in service.datasets() if dataset.name == "rho")
            self.assertEqual(told.parameters, steered.parameters)
            self.assertGreaterEqual(told.time, steered.time)
            while np.asarray(service.render("rho", size=16, renderer="mip", transfer="gray-ramp", scalar_range=(0, 250))).max() < 150 and time.monotonic() < until:
                pass  # of times before that
            for changes, why in (({"level": 251}, r'"rho": level is 251, must be in \[0, 250\]'), ({"unused": 1, "lever": 1}, "no parameter 'lever', must be one of: level, unused"),
                                 ({"level": "high"}, "level 'high' is not a number")):
                with self.assertRaisesRegex(ss.InvalidArgument, why):
                    service.steer("rho", **changes)
            self.assertEqual(service.parameters("rho")["level"].value, 200)
            with self.assertRaisesRegex(ss.InvalidArgument, '"head": no simulation holds it'):
                service.parameters("head")
            with self.assertRaisesRegex(ss.NotFound, 'no dataset "none"'):
                service.parameters("none")


class Addresses(InAFolder):
    def test_nobody_answers(self) -> None:
        with self.assertRaisesRegex(ss.Unavailable, "no service answers at ipc:///.*/none within 200 ms"):
            ss.connect(endpoint=f"ipc://{self.folder}/none", timeout=0.2)

    def test_only_a_service_of_this_user_is_meant_if_none_is_named(self) -> None:
        """Whoever listens at the usual port is not asked."""
        alone = {name: value for name, value in os.environ.items() if not name.startswith("SLABSTREAM_")} | {"XDG_RUNTIME_DIR": str(self.folder)}
        for connect in (ss.connect, ss.connect_async):
            with unittest.mock.patch.dict(os.environ, alone, clear=True), \
                    self.assertRaisesRegex(ss.Unavailable, "no service is named, and `slabstream up` of this user has started none here that runs"):
                connect()

    def test_endpoints_that_are_wrong(self) -> None:
        for endpoint, sentence in (
            ("http://localhost", "expected tcp://HOST:PORT or ipc:///PATH"),
            ("tcp://localhost", "expected tcp://HOST:PORT"),
            ("tcp://127.0.0.1:0", 'port "0" is not a number of [1, 65535]'),
            ("tcp://10.1.2.3:7420", 'host "10.1.2.3" is not loopback'),
            ("ipc://relative", "expected tcp://HOST:PORT or ipc:///PATH"),
            ("ipc:///" + "a" * 120, "at most 107 fit a socket address"),
            ("tcp://local host:3", "expected tcp://HOST:PORT or ipc:///PATH"),
        ):
            with self.subTest(endpoint=endpoint), self.assertRaises(ss.InvalidArgument) as caught:
                ss.connect(endpoint=endpoint)
            self.assertIn(sentence, str(caught.exception))


class Keys(unittest.TestCase):
    @classmethod
    def setUpClass(cls) -> None:
        made = tempfile.TemporaryDirectory(prefix="slabstream-test-")
        cls.addClassCleanup(made.cleanup)
        cls.folder = pathlib.Path(made.name)
        cls.keys = cls.folder / "keys"
        cls.running = RunningService(cls.folder, "--data", write_volumes(cls.folder), "--keys", str(cls.keys), listen="tcp://127.0.0.1:*")
        cls.addClassCleanup(cls.running.end)

    def copy(self, name: str = "client.json", **fields: str) -> pathlib.Path:
        """A service file with other fields."""
        import json

        path = self.folder / "copy.json"
        path.write_text(json.dumps(json.loads((self.keys / name).read_text()) | fields))
        path.chmod(0o600)
        return path

    def test_clients_render_and_admins_order(self) -> None:
        with ss.connect(self.keys / "client.json") as client, ss.connect(service=str(self.keys / "admin.json")) as admin:
            self.assertEqual(client.render("head", size=20).size, (20, 20))
            self.assertEqual([dataset.name for dataset in client.datasets()], ["head"])
            with self.assertRaisesRegex(ss.InvalidArgument, "admin"):
                client.add_data(more=self.folder / "head.nrrd")
            with self.assertRaisesRegex(ss.InvalidArgument, "adding a volume needs the service file of role admin, not client"):
                client.add("sent", volume_arrays()[0])
            admin.add("sent", volume_arrays()[0])
            self.assertEqual(client.render("sent", size=20).size, (20, 20))
            admin.remove_data("sent")
            self.assertEqual(len(admin.add_data(more=self.folder / "head.nrrd")), 2)
            admin.remove_data("more")

    def test_a_key_that_is_not_admitted_is_refused_within_the_time(self) -> None:
        import zmq

        public, secret = (key.decode() for key in zmq.curve_keypair())
        with self.assertRaisesRegex(ss.Unavailable, "refuses the key: it was revoked or is another's"):
            ss.connect(self.copy(public_key=public, secret_key=secret))

    def test_a_service_without_the_secret_is_not_believed(self) -> None:
        import zmq

        with self.assertRaisesRegex(ss.Unavailable, "no service answers at tcp://127.0.0.1:.* within 500 ms"):
            ss.connect(self.copy(server_key=zmq.curve_keypair()[0].decode()), timeout=0.5)

    def test_without_keys_nobody_answers(self) -> None:
        with self.assertRaisesRegex(ss.Unavailable, "no service answers"), \
                unittest.mock.patch.dict(os.environ, {"XDG_RUNTIME_DIR": "/nowhere"}):
            ss.connect(endpoint=self.running.endpoint, timeout=0.5)

    def test_files_that_are_wrong(self) -> None:
        for path, kind, sentence in (
            (self.keys / "worker.json", ss.InvalidArgument, "is of role worker, but client or admin is needed here"),
            (self.keys / "none.json", ss.NotFound, "does not exist"),
            (self.copy(server_key="short"), ss.InvalidArgument, "server_key is no key"),
        ):
            with self.subTest(path=path), self.assertRaises(kind) as caught:
                ss.connect(path)
            self.assertIn(sentence, str(caught.exception))
        path = self.copy()
        path.chmod(0o644)
        with self.assertRaisesRegex(ss.InvalidArgument, "others can use '.*copy.json', which holds a secret"):
            ss.connect(path)

    def test_a_revoked_key_ends_the_connection(self) -> None:
        rotated = self.running.run("keys", "rotate", "client", "--service", str(self.keys / "admin.json"))
        self.assertEqual(rotated.returncode, 0, rotated.stderr)
        import json

        key = json.loads((self.keys / "client.json").read_text())["public_key"]
        with ss.connect(self.keys / "client.json") as client:
            client.render("head", size=9)
            revoked = self.running.run("keys", "revoke", key, "--service", str(self.keys / "admin.json"))
            self.assertEqual(revoked.returncode, 0, revoked.stderr)
            with self.assertRaises(ss.Unavailable):
                client.render("head", size=9)
        self.running.run("keys", "rotate", "client", "--service", str(self.keys / "admin.json"))


class Endings(InAFolder):
    def start(self, program: str, *arguments: str) -> subprocess.Popen:
        with (self.folder / f"{program}.log").open("ab") as log:
            process = subprocess.Popen([str(PROGRAMS / program), *arguments], stdout=subprocess.PIPE, stderr=log)
        self.addCleanup(process.stdout.close)
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)
        return process

    def coordinator(self) -> subprocess.Popen:
        process = self.start("slabstream-coordinator", "--listen", f"ipc://{self.folder}/s", "--data", self.data)
        process.stdout.readline()  # it listens
        return process

    def test_a_request_outlives_its_coordinator(self) -> None:
        """Nobody renders at first, so the frame waits. Then the coordinator is killed, and the next one knows nothing of the frame."""
        self.data = write_volumes(self.folder)
        first = self.coordinator()
        with ss.connect(endpoint=f"ipc://{self.folder}/s") as service:
            frame = service.submit("head", size=25)
            service.status()  # the frame has arrived before
            first.kill()
            first.wait()
            self.coordinator()
            self.start("slabstream-worker", "--coordinator", f"ipc://{self.folder}/s.workers", "--threads", "1")
            self.assertEqual(frame.result(timeout=60).size, (25, 25))

    def test_a_question_outlives_its_coordinator(self) -> None:
        """The dataset is behind a web server that keeps the coordinator waiting, so the question is under way when the coordinator is killed."""
        asked, may_answer = threading.Event(), threading.Event()
        may_answer.set()

        class Store(http.server.SimpleHTTPRequestHandler):
            def do_GET(self) -> None:
                if not may_answer.is_set():
                    asked.set()
                    may_answer.wait(60)
                with contextlib.suppress(OSError):  # whoever asked was killed
                    super().do_GET()

            def log_message(self, *_) -> None:
                pass

        write_cells(self.folder)
        server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Store, directory=self.folder))
        self.addCleanup(server.server_close)
        self.addCleanup(server.shutdown)
        self.addCleanup(may_answer.set)
        threading.Thread(target=server.serve_forever, daemon=True).start()
        self.data = f"cells=http://127.0.0.1:{server.server_port}/cells.ome.zarr"

        def by_command() -> float:
            done = subprocess.run([PROGRAM, "value", "cells", "--at", "4,8,8", "--json", "--endpoint", f"ipc://{self.folder}/s"],
                                  capture_output=True, text=True, timeout=100)
            self.assertEqual((done.returncode, done.stderr), (0, ""))
            return json.loads(done.stdout)[0]["value"]

        for ask in (by_command, lambda: service.value("cells", (4, 8, 8), timeout=100).value):
            first = self.coordinator()
            with ss.connect(endpoint=f"ipc://{self.folder}/s") as service, concurrent.futures.ThreadPoolExecutor() as pool:
                asked.clear()
                may_answer.clear()
                value = pool.submit(ask)
                self.assertTrue(asked.wait(60))
                first.kill()
                first.wait()
                may_answer.set()
                second = self.coordinator()
                self.assertAlmostEqual(value.result(60), 200, delta=1)
            second.kill()
            second.wait()

    def test_a_question_about_what_the_next_coordinator_does_not_have_fails(self) -> None:
        self.data = write_volumes(self.folder)
        first = self.coordinator()
        with ss.connect(endpoint=f"ipc://{self.folder}/s") as service, concurrent.futures.ThreadPoolExecutor() as pool:
            service.status()
            first.send_signal(signal.SIGSTOP)
            value = pool.submit(service.value, "head", (0, 10, 30), timeout=100)
            first.kill()
            first.wait()
            self.data = f"other={self.folder}/head.nrrd"
            self.coordinator()
            with self.assertRaisesRegex(ss.NotFound, 'no dataset "head": the catalogue has other'):
                value.result(60)

    def test_a_service_that_has_gone_is_noticed(self) -> None:
        self.data = write_volumes(self.folder)
        coordinator = self.coordinator()
        with ss.connect(endpoint=f"ipc://{self.folder}/s") as service:
            frame = service.submit("head")
            service.status()
            coordinator.kill()
            with self.assertRaisesRegex(ss.Unavailable, "has not answered for 5... ms"):
                frame.result(timeout=60)
            with self.assertRaisesRegex(ss.Unavailable, "no service answers at .* within 100 ms"):
                service.status(timeout=0.1)

    def test_a_service_that_ends_says_so(self) -> None:
        self.data = write_volumes(self.folder)
        coordinator = self.coordinator()
        with ss.connect(endpoint=f"ipc://{self.folder}/s") as service:
            frame = service.submit("head")
            service.status()
            coordinator.send_signal(signal.SIGTERM)
            self.assertRaises(ss.Unavailable, frame.result, timeout=60)


class OwnService(InAFolder):
    """ss.render and ss.load: the service that they start."""

    @classmethod
    def tearDownClass(cls) -> None:
        ss.shutdown()

    def test_an_array_in_a_picture_out(self) -> None:
        values, labels, overlay = volume_arrays()
        spacing = (2, 1.5, 1.25)
        plain = ss.render(values, spacing=spacing, size=40)
        self.assertEqual(plain.geometry.world, "voxels")
        with ss.load(values, spacing=spacing, labels=labels, overlay=overlay) as volume:
            folder = pathlib.Path(volume.service.endpoint[6:]).parent
            self.assertEqual(folder.stat().st_mode & 0o777, 0o700)
            np.testing.assert_array_equal(np.asarray(volume.render(size=40, labels=False, overlay=False)), np.asarray(plain))
            shown = volume.render(size=40, renderer="raycast")
            hidden = volume.render(size=40, renderer="raycast", labels=False, overlay=False)
            self.assertGreater(np.abs(shown.rgba - hidden.rgba).max(), 0.1)
            self.assertEqual([image.size for image in volume.turntable(2, size=12, labels=None, overlay=None)], [(12, 12)] * 2)
            self.assertEqual(volume.slice(plane="zyx", size=10).size, (30, 10))
            self.assertEqual(volume.submit(size=8, labels=False, overlay=False).result().size, (8, 8))
            service = volume.service
        self.assertEqual((service.datasets(), list(folder.glob("*.nrrd")) + list(folder.glob(".*.nrrd"))), ([], []))
        with ss.load(values, spacing=spacing, origin=(5, 6, 7), world="patient", labels=labels) as volume:
            self.assertEqual(volume.render(size=9, view="left", renderer="raycast").geometry.world, "patient")
        ss.render(values, size=9)
        self.assertEqual(service.status().pid, ss.load(values).service.status().pid)  # it is kept

    def test_files_stay_loaded_and_are_read_again_when_they_change(self) -> None:
        from slabstream.volumes import volume_of, write_nrrd

        values, path = volume_arrays()[0], self.folder / "head.nrrd"
        write_nrrd(volume_of(values), path)
        before = np.asarray(ss.render(path, size=30))
        with ss.load(path) as volume:
            known = len(volume.service.datasets())
        ss.render(str(path), size=30)
        write_nrrd(volume_of(values[::-1]), self.folder / "new.nrrd")
        os.replace(self.folder / "new.nrrd", path)
        self.assertGreater(np.abs(np.asarray(ss.render(path, size=30)).astype(int) - before).max(), 10)
        with ss.load(path) as volume:
            self.assertLessEqual(len(volume.service.datasets()), known + 1)

    def test_names_of_volumes_say_what_they_are(self) -> None:
        values, path = volume_arrays()[0], self.folder / "a scan.raw"
        path.write_bytes(values.tobytes())
        with ss.load(values) as one, ss.load(values) as other, ss.load(f"{path}?dims=28,24,20,type=uint8") as file:
            names = [volume.name for volume in (one, other, file)]
            for name, pattern in zip(names, (r"array(-\d+)?", r"array-\d+", "a-scan.raw")):
                self.assertRegex(name, f"^{pattern}$")
            self.assertEqual(len({*names} & {dataset.name for dataset in one.service.datasets()}), 3)

    def test_options_for_reading_stand_behind_a_path(self) -> None:
        values = volume_arrays()[0]
        (self.folder / "a.raw").write_bytes(values.tobytes())
        found = ss.render(f"{self.folder}/a.raw?dims=28,24,20,type=uint8", spacing=(2, 1.5, 1.25), size=30)
        np.testing.assert_array_equal(np.asarray(found), np.asarray(ss.render(values, spacing=(2, 1.5, 1.25), size=30)))

    def test_the_service_reads_addresses(self) -> None:
        values = volume_arrays()[0]
        store = self.folder / "far.zarr"
        store.mkdir()
        (store / ".zarray").write_text(json.dumps({
            "zarr_format": 2, "shape": values.shape, "chunks": values.shape, "dtype": "|u1", "compressor": None, "fill_value": 0,
            "order": "C", "filters": None}))
        (store / "0.0.0").write_bytes(values.tobytes())
        handler = functools.partial(http.server.SimpleHTTPRequestHandler, directory=str(self.folder))
        with unittest.mock.patch.object(http.server.SimpleHTTPRequestHandler, "log_message"), \
                http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
            threading.Thread(target=server.serve_forever, daemon=True).start()
            try:
                found = ss.render(f"http://127.0.0.1:{server.server_port}/far.zarr", size=30)
            finally:
                server.shutdown()
        np.testing.assert_array_equal(np.asarray(found), np.asarray(ss.render(values, size=30)))

    def test_a_wrong_option_is_told_before_anything_is_started(self) -> None:
        ss.shutdown()
        with unittest.mock.patch("slabstream.loading.running", side_effect=AssertionError("it is started")):
            for call in (ss.render, ss.view):
                with self.assertRaisesRegex(ss.UnknownOption, "there is no option 'azimut'; did you mean 'azimuth'"):
                    call(volume_arrays()[0], azimut=3)
                with self.assertRaisesRegex(ss.InvalidArgument, "zoom 0 is out of range"):
                    call("none.nrrd", zoom=0)

    def test_what_is_wrong_is_told(self) -> None:
        with self.assertRaisesRegex(ss.NotFound, "volume '.*none.nrrd' does not exist"):
            ss.render(self.folder / "none.nrrd")
        with self.assertRaisesRegex(ss.InvalidArgument, "zoom 0 is out of range"):
            ss.render(volume_arrays()[0], zoom=0)
        with self.assertRaisesRegex(ss.InvalidArgument, "origin is for arrays"):
            (self.folder / "a.nrrd").write_bytes(b"")
            ss.render(self.folder / "a.nrrd", origin=(0, 0, 0))

    def test_a_service_that_was_killed_is_started_again(self) -> None:
        values = volume_arrays()[0]
        with ss.load(values) as volume:
            pid = volume.service.status().pid
        os.kill(pid, signal.SIGKILL)
        self.assertEqual(ss.render(values, size=10).size, (10, 10))

    def test_it_needs_the_programs(self) -> None:
        ss.shutdown()
        with unittest.mock.patch.dict(os.environ, {"SLABSTREAM_PROGRAMS": str(self.folder)}):
            with self.assertRaisesRegex(ss.NotFound, r"\$SLABSTREAM_PROGRAMS is '.*', which has no program slabstream"):
                ss.render(volume_arrays()[0])
        shutil.copy(PROGRAM, self.folder / "slabstream")  # without the other two
        with unittest.mock.patch.dict(os.environ, {"SLABSTREAM_PROGRAMS": str(self.folder)}):
            with self.assertRaisesRegex(ss.Unavailable, "slabstream-coordinator' is missing"):
                ss.render(volume_arrays()[0])

    def test_programs_of_its_own_wheel_come_before_the_path(self) -> None:
        own, other = self.folder / "slabstream_programs", self.folder / "other"
        for place in (own, other):
            place.mkdir()
            (place / "slabstream").touch(0o755)
        package = unittest.mock.patch("slabstream.programs.__file__", str(self.folder / "slabstream" / "programs.py"))
        with package, unittest.mock.patch.dict(os.environ, {"PATH": str(other), "SLABSTREAM_PROGRAMS": ""}):
            self.assertEqual(find_program(), str(own / "slabstream"))
            (own / "slabstream").unlink()
            self.assertEqual(find_program(), str(other / "slabstream"))

    def test_it_ends_with_the_interpreter_however_that_ends(self) -> None:
        script = """
            import os, sys, slabstream, numpy
            volume = slabstream.load(numpy.eye(9, dtype="u1")[:, :, None].repeat(5, 2))
            print(slabstream.local._local.program._shell.pid, volume.service.status().pid, volume.service.endpoint[6:], flush=True)
            {end}
        """
        for end in ("pass", "os._exit(3)", "os.kill(os.getpid(), 9)"):
            with self.subTest(end=end):
                run = subprocess.run([sys.executable, "-c", inspect.cleandoc(script.format(end=end))], capture_output=True, text=True,
                                     env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)})
                self.assertEqual(run.stderr, "")
                *processes, socket = run.stdout.split()
                for process in processes:
                    gone = subprocess.run(["tail", f"--pid={process}", "-f", "/dev/null"], timeout=60)  # until it has ended
                    self.assertEqual(gone.returncode, 0)
                self.assertFalse(pathlib.Path(socket).parent.exists())


if __name__ == "__main__":
    unittest.main()
