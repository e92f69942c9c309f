"""Arrays that are sent to a service: the pictures are those of files, and whoever fails half way leaves nothing behind."""
from __future__ import annotations

import itertools
import os
import signal
import threading
import unittest

import numpy as np
import zmq

from client_support import InAFolder, RunningService, WithAService, volume_arrays

import slabstream as ss  # noqa: E402
from slabstream import schema, volumes  # noqa: E402

VIEW = dict(size=40, azimuth=30, elevation=20, renderer="raycast")


class Slabs:
    """An array that is computed slab by slab, and says how much of it was asked for at a time."""

    def __init__(self, array: np.ndarray, chunk: int = 1, fail_at: int | None = None):
        self.array, self.shape, self.dtype = array, array.shape, array.dtype
        self.chunks = (chunk, *array.shape[1:])
        self.fail_at, self.asked = fail_at, []

    def __getitem__(self, index: slice) -> np.ndarray:
        if self.fail_at is not None and index.start >= self.fail_at:
            raise RuntimeError("the array cannot be computed")
        self.asked.append((index.start, index.stop))
        return self.array[index]

    def __array__(self, *_: object, **__: object) -> np.ndarray:
        raise AssertionError("it was asked for as a whole")


class Uploads(WithAService):
    def setUp(self) -> None:
        self.service = ss.connect(endpoint=self.running.endpoint)
        self.addCleanup(self.service.close)
        self.number = itertools.count()

    def names(self) -> list[str]:
        return [dataset.name for dataset in self.service.datasets()]

    def expect_same(self, array: np.ndarray, layers: dict | None = None, **grid: object) -> None:
        """As from a file, in pictures and in what is known of them."""
        layers, options = layers or {}, VIEW | {what: True for what in layers or {}}
        text = ""
        for what, one in {"": array, **layers}.items():
            path = self.folder / f"file{what}.nrrd"
            volumes.write_nrrd(volumes.volume_of(one, **grid), path)
            text += f",{what}={path}" if what else str(path)
        self.service.add_data(f"file={text}")
        try:
            added = self.service.add("sent", array, **grid, **layers)
            self.assertEqual(added.name, "sent")
            np.testing.assert_array_equal(self.service.render("sent", **options).rgba, self.service.render("file", **options).rgba)
            known = {dataset.name: dataset for dataset in self.service.datasets()}
            for field in ("shape", "spacing", "dtype", "value_range", "labels", "overlay"):
                a, b = getattr(known["sent"], field), getattr(known["file"], field)
                np.testing.assert_allclose(a, b, rtol=1e-12) if field == "spacing" else self.assertEqual(a, b, field)
            for point in ((0, 0, 0), (3, 4, 5), (-10, 20, 30)):
                self.assertEqual(self.service.value("sent", at=point), self.service.value("file", at=point))
        finally:
            self.service.remove_data(*[name for name in ("sent", "file") if name in self.names()])

    def test_all_types_arrive_as_they_are_in_files(self) -> None:
        values = volume_arrays()[0]
        for dtype in ("bool", "uint8", "int8", "uint16", "int16", "float32", "float64", "int32", ">u2", ">f4"):
            with self.subTest(dtype=dtype):
                array = (values.astype(np.int32) - (128 if dtype == "int8" else 0)).astype(dtype)
                self.expect_same(array, spacing=(2, 1.5, 1.25))

    def test_any_orientation_arrives(self) -> None:
        values = volume_arrays()[0]
        for order in itertools.permutations(range(3)):
            signs = [(-1) ** ((sum(order[:2]) + i) % 2) for i in range(3)]
            direction = np.eye(3)[list(order)] * np.array(signs)[:, None]
            with self.subTest(order=order):
                self.expect_same(values, spacing=(2, 1.5, 1.25), origin=(5, -3, 2), direction=direction, world="patient")
        turned = np.array(((0.96, 0.28, 0), (-0.28, 0.96, 0), (0, 0, -1)))
        self.expect_same(values, spacing=(1, 1, 2), direction=turned, world="scene")

    def test_layers_arrive(self) -> None:
        values, labels, overlay = volume_arrays()
        self.expect_same(values, layers={"labels": labels, "overlay": overlay}, spacing=(2, 1.5, 1.25))
        self.expect_same(values, layers={"labels": labels.astype(np.uint16) * 1000}, direction=((-1, 0, 0), (0, -1, 0), (0, 0, 1)))
        with self.assertRaisesRegex(ss.InvalidArgument, "labels are not on the volume's grid"):
            self.service.add("sent", values, labels=labels[1:])
        self.assertEqual(self.names(), ["head"])

    def test_chunks_are_sent_one_by_one(self) -> None:
        array = np.arange(24 * 512 * 512, dtype=np.float32).reshape(24, 512, 512)  # 24 MiB, more than the window
        lazy = Slabs(array, chunk=4)
        with ss.load(lazy, service=self.service) as volume:
            self.assertEqual(lazy.asked, [(0, 16), (16, 24)])
            self.assertEqual(self.service.value(volume.name, at=(7, 8, 20)).value, array[20, 8, 7])
            self.assertEqual(self.service.histogram(volume.name).value_range, (0, array.max()))
        self.assertEqual(self.names(), ["head"])

    def test_what_fails_half_way_leaves_nothing(self) -> None:
        array = np.zeros((64, 512, 512), np.uint8)
        lazy = Slabs(np.broadcast_to(array[:1], (200, 512, 512)), fail_at=64)
        with self.assertRaisesRegex(RuntimeError, "cannot be computed"):
            self.service.add("broken", lazy)
        self.assertEqual(self.names(), ["head"])
        self.service.add("broken", array)
        with self.assertRaisesRegex(ss.InvalidArgument, 'already a dataset named "broken"'):
            self.service.add("broken", array)
        self.service.remove_data("broken")
        with self.assertRaisesRegex(ss.InvalidArgument, "letters, digits"):
            self.service.add("a/b", array)

    def test_two_clients_and_one_name(self) -> None:
        begun, go_on = threading.Event(), threading.Event()
        self.addCleanup(go_on.set)

        class Slow(Slabs):
            def __getitem__(self, index: slice) -> np.ndarray:
                if self.asked:  # The service has asked for what was read before, so it knows the name.
                    begun.set()
                    go_on.wait(60)
                return super().__getitem__(index)

        slabs = Slow(np.full((20, 512, 512), 7, np.float32))  # 20 MiB, more than is read at a time
        first = threading.Thread(target=self.service.add, args=("both", slabs))
        first.start()
        self.assertTrue(begun.wait(60))
        with ss.connect(endpoint=self.running.endpoint) as other:
            with self.assertRaisesRegex(ss.InvalidArgument, "on its way from another client"):
                other.add("both", np.zeros((8, 8, 8), np.uint8))
            worker = self.service.status().workers[0]
            os.kill(worker.pid, signal.SIGKILL)  # meanwhile
            go_on.set()
            first.join(60)
            self.assertEqual(other.value("both", at=(1, 2, 3)).value, 7)
            self.assertEqual(other.render("both", size=20, transfer="opaque").size, (20, 20))
            other.remove_data("both")

    def test_hostile_parts_are_refused(self) -> None:
        socket = zmq.Context.instance().socket(zmq.DEALER)
        socket.linger = 0
        self.addCleanup(socket.close)
        socket.connect(self.running.endpoint)

        def send(payload: bytes | None = None, **message: object) -> None:
            socket.send_multipart([schema.Envelope(version=schema.WIRE_VERSION, **message).SerializeToString(), *([] if payload is None else [payload])])

        def receive(kind: str) -> object:
            while True:
                self.assertTrue(socket.poll(60000), kind)
                envelope = schema.Envelope.FromString(socket.recv_multipart()[0])
                if envelope.WhichOneof("message") == kind:
                    return getattr(envelope, kind)

        def order(nonce: int, side: int = 16) -> None:
            about = schema.VolumeDescription(size=schema.Index3(x=side, y=16, z=16), spacing=schema.Vec3(x=1, y=1, z=1), type=1, scale=1)
            about.orientation.CopyFrom(schema.Orientation(world=1, origin=schema.Vec3(), x_axis=schema.Vec3(x=1), y_axis=schema.Vec3(y=1),
                                                          z_axis=schema.Vec3(z=1)))
            send(add_volume=schema.AddVolume(nonce=nonce, name="bad", description=about))

        for nonce, (begin, said, sent) in enumerate([(0, 4097, 4097), (4096, 1, 1), (2**64 - 1, 1, 1), (0, 100, 99), (0, 0, 0), (0, 1 << 20, 7)], 1):
            order(nonce)
            self.assertEqual(receive("volume_credit").allowed, 4096)
            send(bytes(sent), volume_part=schema.VolumePart(nonce=nonce, begin=begin, bytes=said))
            refused = receive("order_refused")
            self.assertEqual(refused.nonce, nonce)
            self.assertEqual(len(refused.status.message.splitlines()), 1)
        order(50, side=65536)
        self.assertRegex(receive("order_refused").status.message, "AddVolume.description.size")
        # More than any machine has: refused before a byte is taken.
        huge = schema.AddVolume(nonce=53, name="huge")
        huge.description.CopyFrom(schema.VolumeDescription(size=schema.Index3(x=30000, y=30000, z=30000), spacing=schema.Vec3(x=1, y=1, z=1), type=1, scale=1))
        huge.description.orientation.CopyFrom(schema.Orientation(world=1, origin=schema.Vec3(), x_axis=schema.Vec3(x=1),
                                                                 y_axis=schema.Vec3(y=1), z_axis=schema.Vec3(z=1)))
        send(add_volume=huge)
        self.assertRegex(receive("order_refused").status.message, r'dataset "huge" needs \d+ MiB, limit \d+ MiB')
        # Voxels before there is a credit, or of a volume that nobody has announced: nothing is taken.
        send(bytes(16), volume_part=schema.VolumePart(nonce=54, begin=0, bytes=16))
        order(51)
        receive("volume_credit")
        labels = schema.AddVolume(nonce=52, name="bad")
        labels.description.CopyFrom(schema.VolumeDescription(size=schema.Index3(x=1, y=1, z=1), spacing=schema.Vec3(x=1, y=1, z=1), type=1, scale=1))
        labels.description.orientation.CopyFrom(schema.Orientation(world=1, origin=schema.Vec3(), x_axis=schema.Vec3(x=1),
                                                                   y_axis=schema.Vec3(y=1), z_axis=schema.Vec3(z=1)))
        labels.label_bytes = 1
        labels.labels.add(value=3)
        send(add_volume=labels)
        receive("order_refused")  # of the one before
        receive("volume_credit")
        send(b"\x09\x02", volume_part=schema.VolumePart(nonce=52, begin=0, bytes=2))
        self.assertRegex(receive("order_refused").status.message, "has label number 2, but only 1 labels")
        self.assertEqual(self.names(), ["head"])


class Restarts(InAFolder):
    def test_a_service_that_goes_ends_it(self) -> None:
        running = RunningService(self.folder, "--data", str(self.folder))
        self.addCleanup(running.end)
        service = ss.connect(endpoint=running.endpoint)
        self.addCleanup(service.close)
        told = threading.Event()

        class Killer(Slabs):
            def __getitem__(self, index: slice) -> np.ndarray:
                if index.start > 0 and not told.is_set():
                    told.set()
                    os.kill(running.coordinator, signal.SIGKILL)
                return super().__getitem__(index)

        with self.assertRaises(ss.Unavailable):
            service.add("lost", Killer(np.zeros((200, 512, 512), np.uint8)))


if __name__ == "__main__":
    unittest.main()
