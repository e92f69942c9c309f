"""The Python client in processes that are interrupted, forked and spawned."""
from __future__ import annotations

import inspect
import os
import signal
import subprocess
import sys
import time
import unittest
import unittest.mock

from client_support import HEAVY, START_SECONDS, InAFolder, WithAService

import slabstream as ss  # noqa: E402
from slabstream import waiting  # noqa: E402

ENVIRONMENT = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path), "PYTHONWARNINGS": "ignore::DeprecationWarning"}  # of fork() with threads


class Processes(WithAService):
    def setUp(self) -> None:
        self.service = ss.connect(endpoint=self.running.endpoint)
        self.addCleanup(self.service.close)

    def until(self, busy: bool) -> ss.Status:
        """The status once the service renders, or no more."""
        limit = time.monotonic() + START_SECONDS
        while True:
            status = self.service.status()
            if bool(status.running + status.queued) == busy:
                return status
            self.assertLess(time.monotonic(), limit)

    def test_a_keyboard_interrupt_ends_what_is_waited_for(self) -> None:
        script = """
            import asyncio, sys, slabstream as ss
            heavy = {heavy}
            service = ss.connect(endpoint=sys.argv[1])
            async def with_asyncio():
                async with ss.connect_async(endpoint=sys.argv[1]) as service:
                    await service.render("head", **heavy)
            try:
                {wait}
            except KeyboardInterrupt:
                print("interrupted", flush=True)
            sys.stdin.readline()
            print(service.render("head", size=9).size, flush=True)
            sys.stdin.readline()
        """
        for wait in ("service.render('head', **heavy)", "list(service.turntable('head', 3, **heavy))", "asyncio.run(with_asyncio())"):
            with self.subTest(wait=wait):
                done = self.until(busy=False).frames_done
                code = inspect.cleandoc(script.format(heavy=HEAVY, wait=wait))
                child = subprocess.Popen([sys.executable, "-c", code, self.running.endpoint], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                         text=True, env=ENVIRONMENT)
                with child:
                    self.until(busy=True)
                    child.send_signal(signal.SIGINT)
                    self.assertEqual(child.stdout.readline(), "interrupted\n")
                    self.assertEqual(self.until(busy=False).frames_done, done, "given up, not finished, while the connection stays")
                    child.stdin.write("\n")
                    child.stdin.flush()
                    self.assertEqual(child.stdout.readline(), "(9, 9)\n")

    def test_an_interrupt_cancels_a_frame_that_was_submitted_before(self) -> None:
        for wait in (ss.Frame.result, ss.Frame.exception, lambda frame: next(frame.previews())):
            frame = self.service.submit("head", **HEAVY)
            interrupted = unittest.mock.patch.object(type(waiting.BLOCKING), "wait", side_effect=KeyboardInterrupt)
            with interrupted, self.assertRaises(KeyboardInterrupt):
                wait(frame)
            self.assertIsInstance(frame.exception(), ss.Cancelled)

    def test_a_forked_process_is_refused(self) -> None:
        script = """
            import asyncio, os, sys, slabstream as ss
            service = ss.connect(endpoint=sys.argv[1])
            frame = service.submit("head", **{heavy})
            asking = ss.connect_async(endpoint=sys.argv[1])
            def refused(call):
                try:
                    print(call())
                except ss.Unavailable as error:
                    print(error)
            with service._asking._connection._loop.lock:  # as another thread may hold it
                child = os.fork()
            if child == 0:
                refused(lambda: service.render("head", size=9))
                refused(service.status)
                refused(frame.result)
                refused(lambda: next(frame.previews()))
                refused(lambda: asyncio.run(asking.status()))
                service.close()
                with ss.connect(endpoint=sys.argv[1]) as own:
                    print(own.render("head", size=9).size)
                sys.exit(0)
            print(os.waitpid(child, 0)[1], child, os.getpid())
            frame.cancel()
            print(service.render("head", size=8).size)
        """
        code = inspect.cleandoc(script.format(heavy=HEAVY))
        run = subprocess.run([sys.executable, "-c", code, self.running.endpoint], capture_output=True, text=True, env=ENVIRONMENT,
                             timeout=2 * START_SECONDS)
        self.assertEqual(run.stderr, "")
        *refusals, own, ended, theirs = run.stdout.splitlines()
        status, child, parent = ended.split()
        sentence = f"process {child} was forked, and the connection to the service at {self.running.endpoint} is that of process {parent}"
        self.assertEqual(refusals, [f"{sentence}: connect in each process"] * 5)
        self.assertEqual((own, status, theirs), ("(9, 9)", "0", "(8, 8)"))


class Spawned(InAFolder):
    def test_spawned_processes_have_services_of_their_own(self) -> None:
        program = self.folder / "program.py"
        program.write_text(inspect.cleandoc("""
            import multiprocessing, sys, numpy as np, slabstream as ss

            ball = np.full((9, 9, 9), 200, np.uint8)

            def shown(size):
                return ss.render(ball, size=size).size, ss.local.running().service.status().pid

            if __name__ == "__main__":
                own = shown(5)
                with multiprocessing.get_context(sys.argv[1]).Pool(2) as pool:
                    sizes, services = zip(own, *pool.map(shown, range(6, 10), chunksize=2))
                print(sizes, services.count(own[1]))
        """))
        for method in ("spawn", "forkserver"):
            run = subprocess.run([sys.executable, str(program), method], capture_output=True, text=True, env=ENVIRONMENT,
                                 timeout=3 * START_SECONDS)
            self.assertEqual((run.stderr, run.stdout), ("", f"{tuple((size, size) for size in range(5, 10))} 1\n"), method)


if __name__ == "__main__":
    unittest.main()
