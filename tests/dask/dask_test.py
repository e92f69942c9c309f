#!/usr/bin/env python3
"""Pictures of Dask's arrays are those of the same arrays in numpy, wherever chunks lie, and while workers come and go (deploy/check dask)."""
from __future__ import annotations

import base64
import contextlib
import gc
import ipaddress
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import time
import unittest

import dask.array as da
import distributed
import nbclient
import nbformat
import numpy as np
import xarray

ROOT = pathlib.Path(__file__).resolve().parents[2]
for name, value in (("PYTHONPATH", ROOT / "python"), ("SLABSTREAM_PROGRAMS", ROOT / "build" / "bin")):
    os.environ.setdefault(name, str(value))  # for Dask's workers, too
sys.path[:0] = [str(ROOT / "python"), str(ROOT / "tests" / "python")]

import slabstream as ss  # noqa: E402
import slabstream.dask as sd  # noqa: E402
from client_support import read_png  # noqa: E402

PATIENCE = 60
VIEW = {"azimuth": 25, "elevation": 15, "size": 160, "transfer": "viridis"}


def blobs(shape=(60, 50, 70), dtype=np.float32):
    """No symmetry; z, y, x."""
    z, y, x = (np.linspace(-1, 1, side, dtype=np.float32) for side in shape)
    z, y, x = z[:, None, None], y[None, :, None], x[None, None, :]
    values = np.exp(-4 * (x**2 + (1.3 * y) ** 2 + z**2)) + 0.8 * np.exp(-20 * ((x - 0.5) ** 2 + (y + 0.3) ** 2 + (z - 0.4) ** 2))
    return (values * 100).astype(dtype)


def wait_until(holds, what):
    end = time.monotonic() + PATIENCE
    while not holds():
        assert time.monotonic() < end, what
        time.sleep(0.02)


def owners(dask_worker):
    return {dataset for plugin in dask_worker.plugins.values() for dataset in getattr(plugin, "owners", {})}


def all_owners(dask_worker):
    return [owner for plugin in dask_worker.plugins.values() for owners in getattr(plugin, "owners", {}).values() for owner in owners]


def in_place(dask_worker):
    """Whether owners show the very memory of Dask's chunks."""
    chunks = [chunk for chunk in dask_worker.data.values() if isinstance(chunk, np.ndarray)]
    shown = [array for owner in all_owners(dask_worker) for arrays in owner._kept.values() for array in arrays]
    return all(any(np.shares_memory(array, chunk) for chunk in chunks) for array in shown)


def lazy_chunks(dask_worker):
    return [owner.chunks for owner in all_owners(dask_worker) if hasattr(owner, "chunks")]


def computed(dask_worker):
    return {key: count for chunks in lazy_chunks(dask_worker) for key, count in chunks.computed.items()}


def forget_computed(dask_worker):
    for chunks in lazy_chunks(dask_worker):
        chunks.computed.clear()


def kept_bytes(dask_worker):
    return max((sum(array.nbytes for array in owner._made.values()) for owner in all_owners(dask_worker)), default=0)


def set_kept_part(part):
    before, sd._KEPT_PART = sd._KEPT_PART, part
    return before


class DaskTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.cluster = distributed.LocalCluster(n_workers=3, threads_per_worker=1, dashboard_address=None, memory_limit="2GiB")
        cls.client = distributed.Client(cls.cluster)
        cls.service = sd.start(cls.client)

    @classmethod
    def tearDownClass(cls):
        cls.service.close()
        cls.client.close()
        cls.cluster.close()
        ss.shutdown()

    def assert_like(self, image, array, places=1, **options):
        expected = np.asarray(ss.render(array, **VIEW | options)).astype(int)
        self.assertGreater(expected[..., 3].max(), 50)
        self.assertLessEqual(np.abs(np.asarray(image).astype(int) - expected).max(), places)

    def test_chunks_of_any_sizes(self):
        array = blobs()
        for chunks in (60, (17, 25, 30), ((20, 3, 37), (50,), (1, 30, 22, 17))):
            persisted = da.from_array(array, chunks).persist()
            self.assert_like(sd.render(persisted, **VIEW), array)
            self.assertTrue(all(self.client.run(in_place).values()), "chunks were copied")

    def test_types_and_strides(self):
        for dtype in ("uint8", "int16", "uint32", "float64", ">f4", "float16"):
            array = blobs(dtype=dtype)
            with self.subTest(dtype):
                drawn = np.float32 if dtype == "uint32" else array.dtype.newbyteorder("=")  # what wide whole numbers are drawn as
                self.assert_like(sd.render(da.from_array(array, 30).persist(), **VIEW), array.astype(drawn))
        array = blobs()
        mask = da.from_array(array > 40, 30)
        self.assert_like(sd.render(mask.persist(), **VIEW), array > 40)
        chunks = da.from_array(array, 30)
        for what, turned in (("transposed", chunks.T), ("every second", chunks[::2, :, 1::2]), ("backwards", chunks[::-1, :, ::-1])):
            with self.subTest(what):
                self.assert_like(sd.render(turned, **VIEW), np.ascontiguousarray(turned.compute()))

    def test_channels_are_fields_of_one_picture(self):
        first, second = blobs(), blobs()[::-1, ::-1].copy()
        look = {"0": {"color": "red"}, "1": {"color": "lime"}}
        swapped = {"0": look["1"], "1": look["0"]}
        view = {name: VIEW[name] for name in ("azimuth", "elevation", "size")}
        for persist in (True, False):
            for chunks in ((1, 30, 30, 30), (2, 60, 20, 70)):  # channels at several Dask workers, and in one chunk
                with self.subTest(persist=persist, chunks=chunks):
                    both = da.from_array(np.stack([first, second]), chunks)
                    both = both.persist() if persist else both * 1
                    image = np.asarray(sd.render(both, channel_axis=0, channels=look, **view)).astype(int)
                    self.assertGreater(image[..., 0].max(), 50)
                    self.assertGreater(image[..., 1].max(), 50)
                    other = sd.render(both[::-1], channel_axis=0, channels=swapped, **view)
                    self.assertLessEqual(np.abs(np.asarray(other).astype(int) - image).max(), 1)
                    if persist:
                        self.assertTrue(all(self.client.run(in_place).values()), "chunks were copied")
        cells = xarray.DataArray(da.from_array(np.stack([first, second], axis=-1), 30).persist(), dims=("z", "y", "x", "channel"),
                                 coords={"channel": ["actin", "nuclei, late"]})
        named = sd.render(cells, channels={"actin": look["0"], "nuclei  late": look["1"]}, **view)
        self.assertLessEqual(np.abs(np.asarray(named).astype(int) - image).max(), 1)
        with self.assertRaisesRegex(ss.InvalidArgument, "no field .red.: it has 0 .actin"):
            sd.render(cells, channels={"red": {}}, **view)
        with self.assertRaisesRegex(ss.InvalidArgument, "channel_axis is 4, but the array has 4 axes"):
            sd.render(both, channel_axis=4, **view)

    def test_a_lazy_array_is_given_up_with_its_chunks(self):
        lazy = da.from_array(blobs(), 30).map_blocks(lambda block: block * 2)
        held = len(self.client.who_has())
        for azimuth in (25, 60):
            self.assert_like(sd.render(lazy, **VIEW | {"azimuth": azimuth}), 2 * blobs(), azimuth=azimuth)
        self.assertGreater(sum(count for counts in self.client.run(computed).values() for count in counts.values()), 0)
        del lazy
        gc.collect()
        wait_until(lambda: len(self.client.who_has()) <= held, "chunks of a lazy array are given up with it")

    def test_a_lazy_array_larger_than_what_is_kept(self):
        array = blobs((64, 64, 64))
        lazy = da.from_array(array, 16).map_blocks(lambda block: block + 1) - 1  # 64 chunks of 16 KiB, of which each worker keeps two
        with self.keeping(2 * 16**3 * 4):
            for azimuth in (25, 200):
                self.assert_like(sd.render(lazy, **VIEW | {"azimuth": azimuth}), array, azimuth=azimuth)
            counts = self.computed()
            self.assertEqual(len(counts), 64)
            self.assertGreater(max(counts.values()), 1, "dropped chunks come again")
            self.assertLessEqual(max(self.client.run(kept_bytes).values()), 3 * 16**3 * 4)

            # Where it is clipped, no chunk behind the cut is needed.
            layer = {(1, y, x) for y in range(4) for x in range(4)}
            for clip_box, expected in (("0:64,0:64,20:28v", layer), ("20:28,36:44,4:12v", {(0, 2, 1)})):
                self.client.run(forget_computed)
                self.assert_like(sd.render(lazy, clip_box=clip_box, **VIEW), array, clip_box=clip_box)
                self.assertLessEqual({key[1:] for key in self.computed()}, expected)

    def test_a_chunk_that_raises_fails_in_one_line(self):
        def fail(block):
            raise ValueError("the sea is rough")

        lazy = da.from_array(blobs(), 30).map_blocks(fail, dtype=np.float32)
        with self.assertRaisesRegex(ss.InvalidArgument, "owner [0-2] of 3: chunk .*: ValueError: the sea is rough") as raised:
            sd.render(lazy, **VIEW)
        self.assertNotIn("\n", str(raised.exception))

    def test_persisted_parts_of_a_lazy_array_stay(self):
        array = blobs()
        persisted = da.from_array(array, 30).persist()
        self.assert_like(sd.render(persisted * 2, **VIEW), 2 * array)
        self.assert_like(sd.render(persisted[::2], spacing=(2, 1, 1), **VIEW), array[::2], spacing=(2, 1, 1))

    def test_a_killed_worker_costs_no_picture_of_a_lazy_array(self):
        array = blobs()
        lazy = da.from_array(array, 20) * 1
        self.assert_like(sd.render(lazy, **VIEW), array)
        os.kill(next(iter(self.client.run(os.getpid).values())), signal.SIGKILL)
        self.assert_like(sd.render(lazy, **VIEW | {"azimuth": 10}), array, azimuth=10)
        self.client.wait_for_workers(3)

    def computed(self):
        return {key: count for counts in self.client.run(computed).values() for key, count in counts.items()}

    @contextlib.contextmanager
    def keeping(self, kept):
        """Each Dask worker keeps so many bytes of chunks of lazy arrays that are shown meanwhile."""
        before = set(self.client.run(set_kept_part, (2 << 30) // kept).values())
        try:
            yield
        finally:
            self.client.run(set_kept_part, *before)

    def test_an_array_that_nobody_has_is_given_up(self):
        array = da.from_array(blobs(), 30).persist()
        sd.render(array, **VIEW)
        name = self.service._held[array.name][0]
        self.assertIn(name, {dataset.name for dataset in self.service.service.datasets()})
        del array
        gc.collect()
        wait_until(lambda: all(name not in each for each in self.client.run(owners).values()), "owners leave")
        wait_until(lambda: all(dataset.name != name for dataset in self.service.service.datasets()), "the dataset goes")

    def test_coordinates_of_xarray(self):
        shape = (30, 40, 50)
        where = {"z": np.arange(30) * 2.0 + 5, "y": np.arange(40)[::-1] * 1.0, "x": np.arange(50) * 0.5}
        array = xarray.DataArray(blobs(shape), dims=["z", "y", "x"], coords=where)
        self.assert_like(sd.render(array.chunk(16).persist(), **VIEW), array)
        turned = array.transpose("x", "z", "y")
        self.assert_like(sd.render(turned.chunk(16), **VIEW), array)
        times = xarray.concat([array, 1 - array, array**2], "time")
        self.assert_like(sd.render(times.chunk(time=1, z=16), time=2, **VIEW), array**2)
        where["z"] = np.arange(30) ** 2.0
        with self.assertRaisesRegex(ss.InvalidArgument, "the coordinates of 'z' do not lie evenly"):
            sd.render(array.assign_coords(where).chunk(16), **VIEW)

    def test_what_cannot_be_shown_is_refused_in_one_line(self):
        array = da.from_array(blobs(), 30)
        for wrong, why in ((blobs(), "is not an array of Dask"), (array[array > 5][:, None, None], "nan"),
                           (array.astype(complex), "complex128"), (da.ones((9000, 2, 2), chunks=1), "and 4096 at one"),
                           (da.stack([array, array]), r"shape \(2, 60, 50, 70\), .*; array\[0\] has its first time or channel")):
            with self.assertRaisesRegex(ss.InvalidArgument, why) as raised:
                sd.render(wrong, **VIEW)
            self.assertNotIn("\n", str(raised.exception))
        with self.assertRaisesRegex(ss.InvalidArgument, "time is 1, but the array has 3 axes"):
            sd.render(array, time=1, **VIEW)

    def test_workers_come_and_go(self):
        array = blobs()
        chunks = da.from_array(array, 20).persist()
        before = len(self.service.service.status().workers)
        self.cluster.scale(before + 1)
        wait_until(lambda: len(self.service.service.status().workers) == before + 1, "a worker comes with one of Dask's")
        self.assert_like(sd.render(chunks, **VIEW), array)
        self.cluster.scale(before)
        wait_until(lambda: len(self.service.service.status().workers) == before, "a worker goes with one of Dask's")
        self.assert_like(sd.render(chunks, **VIEW), array)

    def test_a_killed_worker_costs_no_picture(self):
        array = blobs()
        chunks = da.from_array(array, 20).persist(workers=next(iter(self.client.nthreads())), allow_other_workers=True)
        for azimuth in range(0, 60, 20):
            self.assert_like(sd.render(chunks, **VIEW | {"azimuth": azimuth}), array, azimuth=azimuth)
            workers = len(self.client.nthreads())
            holder = next(iter(self.client.who_has(chunks).values()))[0]
            os.kill(self.client.run(os.getpid, workers=[holder])[holder], signal.SIGKILL)
            self.assert_like(sd.render(chunks, **VIEW | {"azimuth": azimuth + 10}), array, azimuth=azimuth + 10)
            self.client.wait_for_workers(workers, timeout=PATIENCE)


class ServiceTest(unittest.TestCase):
    def test_a_cluster_beyond_this_host_has_keys(self):
        address = distributed.utils.get_ip()
        if ipaddress.ip_address(address).is_loopback:
            self.skipTest("this host has no address but loopback")
        with distributed.LocalCluster(n_workers=2, host=address, dashboard_address=None) as cluster, distributed.Client(cluster) as client:
            with sd.start(client) as service:
                self.assertTrue(service.service.address.keys)
                self.assertGreater(np.asarray(service.render(da.from_array(blobs(), 30), **VIEW)).max(), 50)

    def test_programs_end_with_the_client(self):
        with distributed.LocalCluster(n_workers=2, dashboard_address=None) as cluster:
            client = distributed.Client(cluster)
            service = sd.start(client)
            self.assertIs(sd.start(client), service)
            pids = {worker.pid for worker in service.service.status().workers}
            client.close()
            with self.assertRaises(ss.SlabstreamError):
                service.service.status(timeout=PATIENCE)
            wait_until(lambda: not any(pathlib.Path(f"/proc/{pid}").exists() for pid in pids), "workers end")

    def test_the_example(self):
        example = ROOT / "examples" / "python" / "dask_array.py"
        with tempfile.TemporaryDirectory() as folder:
            done = subprocess.run([sys.executable, "-B", example, f"{folder}/a.png"], capture_output=True, text=True)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertTrue(pathlib.Path(folder, "a.png").exists())

    def test_the_notebook(self):
        def pictures(notebook):
            outputs = [output for cell in notebook.cells for output in cell.get("outputs", [])]
            return [read_png(base64.b64decode(output.data["image/png"])).astype(int) for output in outputs if "image/png" in output.get("data", {})]

        notebook = nbformat.read(ROOT / "docs" / "dask.ipynb", nbformat.NO_CONVERT)
        kept = pictures(notebook)
        with tempfile.TemporaryDirectory() as folder:
            private = {name: folder for name in ("HOME", "IPYTHONDIR")}
            nbclient.NotebookClient(notebook, timeout=600, kernel_name="python3").execute(env=os.environ | private)
        shown = pictures(notebook)
        self.assertEqual([picture.shape[0] for picture in shown], [320, 320, 200, 200, 200, 320, 320])
        for one, other in zip(shown, kept, strict=True):
            self.assertGreater((one[..., 3] > 50).mean(), 0.01)  # of the pixels
            self.assertLessEqual(np.abs(one - other).max(), 1, "it is the picture that is kept")
        array, lazy, first, second, third, channel, later = shown
        self.assertLessEqual(np.abs(later - array).max(), 1)
        for one, other in ((array, lazy), (array, channel), (first, second), (second, third)):
            self.assertGreater(np.abs(one - other).max(), 50)


if __name__ == "__main__":
    unittest.main(verbosity=2)
