"""The Python client under asyncio: what the blocking one does, without blocking the event loop; what is cancelled ends at the service."""
from __future__ import annotations

import asyncio
import concurrent.futures
import inspect
import threading
import unittest

import numpy as np

from client_support import HEAVY, START_SECONDS, WithAService, volume_arrays, write_cells

import slabstream as ss  # noqa: E402


class Slow:
    """An array whose voxels can be read only while the event loop runs."""

    def __init__(self, array: np.ndarray):
        self.array, self.shape, self.dtype = array, array.shape, array.dtype
        self.wanted, self.allowed = threading.Event(), threading.Event()

    def __getitem__(self, index):
        self.wanted.set()
        if not self.allowed.wait(START_SECONDS):
            raise RuntimeError("the event loop was blocked")
        return self.array[index]


async def until(condition) -> None:
    """Polls a coroutine's value, for as long as a service may take to start."""
    async def poll() -> None:
        while not await condition():
            await asyncio.sleep(0.01)

    await asyncio.wait_for(poll(), START_SECONDS)


class Async(WithAService, unittest.IsolatedAsyncioTestCase):
    async def asyncSetUp(self) -> None:
        self.service = await ss.connect_async(endpoint=self.running.endpoint)
        self.addAsyncCleanup(self.service.close)

    def test_both_services_have_the_same_methods(self) -> None:
        blocking, ours = ({name: value for name, value in vars(kind).items() if name[0] != "_" and callable(value)}
                          for kind in (ss.Service, ss.AsyncService))
        self.assertEqual(blocking.keys() - {"view"}, ours.keys(), "view() asks nothing of the service itself")
        self.assertGreater(len(ours), 15)
        for name, method in ours.items():
            self.assertEqual(inspect.iscoroutinefunction(method), name != "turntable", name)
            self.assertEqual(inspect.signature(method), inspect.signature(blocking[name]))

    async def test_answers_are_those_of_the_blocking_client(self) -> None:
        service = self.service
        with ss.connect(endpoint=self.running.endpoint) as blocking:  # beside a loop that runs, as in a notebook
            np.testing.assert_array_equal((await service.render("head", size=40)).rgba, blocking.render("head", size=40).rgba)
            np.testing.assert_array_equal(np.asarray(await service.slice("head", plane="zyx", size=20)),
                                          np.asarray(blocking.slice("head", plane="zyx", size=20)))
            turned = [image async for image in service.turntable("head", 3, size=20)]
            for ours, theirs in zip(turned, blocking.turntable("head", 3, size=20)):
                np.testing.assert_array_equal(ours.rgba, theirs.rgba)
            self.assertEqual((await service.histogram("head")).percentiles, blocking.histogram("head").percentiles)
            self.assertEqual((await service.joint_histogram("head")).counts.sum(), blocking.joint_histogram("head").counts.sum())
            self.assertEqual(await service.labels("head"), blocking.labels("head"))
            self.assertEqual(await service.label_statistics("head"), blocking.label_statistics("head"))
            self.assertEqual(await service.value("head", at=(30, 20, 10)), blocking.value("head", at=(30, 20, 10)))
            self.assertEqual(await service.pick("head", 20, 20, size=40), blocking.pick("head", 20, 20, size=40))
            self.assertEqual((await service.status()).pid, blocking.status().pid)
            self.assertEqual(await service.datasets(), blocking.datasets())
            self.assertEqual((await (blocking.submit("head", size=11))).size, (11, 11))
        await service.add_data(cells=write_cells(self.folder))
        await service.reload_data("cells")
        self.assertEqual([each.name for each in await service.remove_data("cells")], ["head"])
        with self.assertRaisesRegex(ss.InvalidArgument, '"head": no simulation holds it'):
            await service.parameters("head")

    async def test_many_are_in_flight_on_one_connection(self) -> None:
        threads = set(threading.enumerate())
        renders = [asyncio.create_task(self.service.render("head", size=20 + i)) for i in range(100)]
        await asyncio.wait(renders, return_when=asyncio.FIRST_COMPLETED)
        self.assertLessEqual(set(threading.enumerate()), threads, "no connection of its own for each")
        self.assertEqual([image.size[0] for image in await asyncio.gather(*renders)], list(range(20, 120)))

    async def test_the_loop_goes_on_while_a_frame_is_waited_for(self) -> None:
        heavy = asyncio.create_task(self.service.render("head", **HEAVY))
        self.assertEqual((await self.service.render("head", size=9)).size, (9, 9))
        self.assertFalse(heavy.done())
        heavy.cancel()
        await asyncio.wait([heavy])

    async def test_the_loop_goes_on_while_an_array_is_read_and_sent(self) -> None:
        slow = Slow(volume_arrays()[0])
        sent = asyncio.create_task(self.service.add("sent", slow))
        await asyncio.to_thread(slow.wanted.wait, START_SECONDS)
        slow.allowed.set()
        self.assertEqual((await sent).name, "sent")
        await self.service.remove_data("sent")
        slow.allowed.clear()
        slow.wanted.clear()
        dropped = asyncio.create_task(self.service.add("dropped", slow))
        await asyncio.to_thread(slow.wanted.wait, START_SECONDS)
        dropped.cancel()
        await asyncio.wait([dropped])
        slow.allowed.set()
        self.assertEqual([each.name for each in await self.service.datasets()], ["head"])
        self.assertEqual(self.service._connection._loop.requests._questions, {}, "nobody waits for the answer")

    async def idle(self) -> bool:
        status = await self.service.status()
        return status.running + status.queued == 0

    async def test_what_a_cancelled_task_waits_for_is_cancelled_at_the_service(self) -> None:
        async def previews() -> None:
            async for _ in await self.service.submit("head", previews=True, **HEAVY):
                pass

        async def result() -> None:
            await (await self.service.submit("head", **HEAVY))

        async def turntable() -> None:
            async for _ in self.service.turntable("head", 3, **HEAVY):
                pass

        for wait in (lambda: self.service.render("head", **HEAVY), result, previews, turntable):
            done = (await self.service.status()).frames_done
            task = asyncio.create_task(wait())
            await until(lambda: self.busy())
            task.cancel()
            with self.assertRaises(asyncio.CancelledError):
                await task
            await until(self.idle)
            self.assertEqual((await self.service.status()).frames_done, done, "given up, not finished")

    async def busy(self) -> bool:
        return not await self.idle()

    async def test_a_timeout_cancels_the_frame(self) -> None:
        done = (await self.service.status()).frames_done
        with self.assertRaises(asyncio.TimeoutError):
            await asyncio.wait_for(self.service.render("head", **HEAVY), 0.1)
        if hasattr(asyncio, "timeout"):  # Python 3.11
            with self.assertRaises(TimeoutError):
                async with asyncio.timeout(0.1):
                    await self.service.render("head", **HEAVY)
        await until(self.idle)
        self.assertEqual((await self.service.status()).frames_done, done)

    async def test_previews_come_before_the_picture(self) -> None:
        shown = [image async for image in await self.service.submit("head", groups=4, size=100, previews=True)]
        self.assertEqual([image.preview for image in shown], [True] * (len(shown) - 1) + [False])
        np.testing.assert_array_equal(shown[-1].rgba, (await self.service.render("head", groups=4, size=100)).rgba)

    async def test_a_turntable_that_is_left_cancels_the_rest(self) -> None:
        done = (await self.service.status()).frames_done
        turntable = self.service.turntable("head", 1000, in_flight=8, size=10)
        async for _ in turntable:
            break
        await turntable.aclose()
        await until(self.idle)
        self.assertLess((await self.service.status()).frames_done, done + 900)

    async def test_errors_are_those_of_the_blocking_client(self) -> None:
        with self.assertRaisesRegex(ss.NotFound, "foot"):
            await self.service.render("foot")
        with self.assertRaisesRegex(ss.InvalidArgument, "zoom 0 is out of range"):
            self.service.turntable("head", 2, zoom=0)
        with self.assertRaisesRegex(ss.NotFound, "foot"):
            await self.service.turntable("foot", 2).__anext__()
        with self.assertRaisesRegex(ss.DeadlineExceeded, "."):
            await self.service.render("head", deadline=0.001, **HEAVY)
        with self.assertRaisesRegex(ss.Unavailable, "no service answers at ipc:///.*/none within 100 ms"):
            async with ss.connect_async(endpoint=f"ipc://{self.folder}/none", timeout=0.1):
                pass
        async with ss.connect_async(endpoint=self.running.endpoint) as other:
            frame = await other.submit("head", **HEAVY)
        with self.assertRaisesRegex(ss.Cancelled, "the connection to the service was closed"):
            await frame
        with self.assertRaisesRegex(ss.Unavailable, "is closed"):
            await other.status()

    async def test_a_cancelled_connect_leaves_nothing(self) -> None:
        async def connect() -> None:
            await ss.connect_async(endpoint=f"ipc://{self.folder}/none", timeout=600)

        threads = threading.active_count()
        task = asyncio.create_task(connect())
        await asyncio.sleep(0)
        self.assertEqual(threading.active_count(), threads + 1, "of the connection")
        task.cancel()
        await asyncio.wait([task])
        self.assertTrue(task.cancelled())
        self.assertNotIn("slabstream", [thread.name for thread in threading.enumerate()][threads:])

    async def test_loops_of_other_threads_share_a_service(self) -> None:
        async def sizes(first: int) -> list[int]:
            return [image.size[0] for image in await asyncio.gather(*(self.service.render("head", size=first + i) for i in range(5)))]

        with concurrent.futures.ThreadPoolExecutor(4) as pool:
            loops = [pool.submit(lambda first: asyncio.run(sizes(first)), 10 * i) for i in range(1, 5)]
            found = [await asyncio.wrap_future(loop) for loop in loops]
        self.assertEqual(found, [list(range(10 * i, 10 * i + 5)) for i in range(1, 5)])


if __name__ == "__main__":
    unittest.main()
