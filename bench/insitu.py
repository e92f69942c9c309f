#!/usr/bin/env python3
"""What it costs a simulation to be watched, and how a service that watches takes faults: bench/insitu.py [steps|latency|faults ...]

Ranks are processes that compute a slab of a cube each (heat flow by numpy) and meet after every step. All of them run on the first core, and
the service and who looks on the last one, so that a worker has a core of its own.

  steps    time of a step, by rank count and by what watches: processor time of all ranks with the library's threads; the share of it that
           is not the computation (without an owner: what the bench itself takes); the share of the time that the rank waits in the library
           that waits longest. The ways alternate in one run; a ratio is the median of rounds, each against the same round without an owner.
           `begin`: computed in the library's memory. `publish`: copied there. Two slots or three
  latency  from the moment when the last rank commits a time until a picture of it has arrived, while one looks all the time
  faults   pictures while a rank is killed and comes again, while a worker is killed, and while workers are added

Needs numpy, and programs in build/bin or $SLABSTREAM_PROGRAMS.
"""
from __future__ import annotations

import argparse
import contextlib
import itertools
import multiprocessing
import os
import pathlib
import queue
import signal
import statistics
import subprocess
import sys
import tempfile
import time

import numpy

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "python"), str(ROOT / "bench")]
os.environ.setdefault("SLABSTREAM_PROGRAMS", str(ROOT / "build" / "bin"))

import slabstream as ss  # noqa: E402
from this_machine import checkout, machine  # noqa: E402

FORK = multiprocessing.get_context("fork")
LAST_CORE = os.cpu_count() - 1
GRAY = [(0, (0, 0, 0)), (255, (1, 1, 1))]
PICTURE = dict(size=(512, 512), renderer="raycast", transfer=ss.TransferFunction(GRAY, [(0, 0), (255, 0.3)]))
NUMBER = dict(size=(512, 512), renderer="mip", transfer=ss.TransferFunction(GRAY, [(0, 1), (255, 1)]))  # a picture of show_numbers
PATIENCE = 60  # seconds


class Running:
    """`slabstream up` on the last core."""

    def __init__(self, workers: int):
        self._folder = tempfile.TemporaryDirectory(prefix="slabstream-bench-")
        environment = dict(os.environ, XDG_RUNTIME_DIR=self._folder.name)
        program = pathlib.Path(os.environ["SLABSTREAM_PROGRAMS"]) / "slabstream"
        self._process = subprocess.Popen(["taskset", "-c", str(LAST_CORE), program, "up", "--workers", str(workers), "--listen",
                                          f"ipc://{self._folder.name}/s"], stdout=subprocess.PIPE, text=True, env=environment)
        while "Ctrl-C" not in (line := self._process.stdout.readline()):
            if not line:
                raise SystemExit("insitu: `slabstream up` ended")
        self.endpoint = f"ipc://{self._folder.name}/s"
        self.for_owners = self.endpoint + ".workers"

    def add_worker(self) -> subprocess.Popen:
        return subprocess.Popen(["taskset", "-c", str(LAST_CORE), pathlib.Path(os.environ["SLABSTREAM_PROGRAMS"]) / "slabstream-worker",
                                 "--coordinator", self.for_owners, "--log-level", "error"], stdout=subprocess.DEVNULL)

    def end(self) -> None:
        self._process.terminate()
        self._process.wait()
        self._folder.cleanup()


def slab(rank: int, ranks: int, side: int) -> tuple[int, int]:
    return side * rank // ranks, side * (rank + 1) // ranks


def owner_of(rank: int, ranks: int, side: int, service: str, slots: int = 2) -> ss.Owner:
    begin, end = slab(rank, ranks, side)
    return ss.Owner("heat", (side, side, side), "float32", [((begin, end), (0, side), (0, side))], owner=rank, owners=ranks, slots=slots,
                    service=service)


def advance(now: numpy.ndarray, after: numpy.ndarray) -> float:
    """Heat flows along x and y: 4 sweeps, the last one into `after`. Returns the processor seconds that it took."""
    begin = time.thread_time()
    for sweep in range(4):
        to = after if sweep == 3 else numpy.empty_like(now)
        to[...] = now
        to[:, 1:-1, 1:-1] += 0.1 * (now[:, 1:-1, :-2] + now[:, 1:-1, 2:] + now[:, :-2, 1:-1] + now[:, 2:, 1:-1] - 4 * now[:, 1:-1, 1:-1])
        now = to
    return time.thread_time() - begin


WAYS = {  # whether a service is there, slots, how, what somebody looks at
    "no owner": (False, 0, "", ""),
    "no owner, other data looked at": (True, 0, "", "other"),
    "no service, begin": (False, 2, "begin", ""),
    "nobody looks, begin": (True, 2, "begin", ""),
    "nobody looks, publish": (True, 2, "publish", ""),
    "looked at, begin, 2 slots": (True, 2, "begin", "heat"),
    "looked at, publish, 2 slots": (True, 2, "publish", "heat"),
    "looked at, begin, 3 slots": (True, 3, "begin", "heat"),
    "looked at, publish, 3 slots": (True, 3, "publish", "heat"),
}


def run_rank(rank: int, ranks: int, side: int, service: str, slots: int, how: str, together, stop, last, steps, told) -> None:
    """Steps until `stop`. Tells (rank, seconds that each step waited, when each began, processor time until then, that of its computation)."""
    os.sched_setaffinity(0, {0})
    begin, end = slab(rank, ranks, side)
    now = numpy.random.default_rng(rank).uniform(0, 255, (end - begin, side, side)).astype(numpy.float32)
    own = [numpy.empty_like(now), numpy.empty_like(now)]
    owner = owner_of(rank, ranks, side, service, slots) if how else None
    begins, used, computed, waited, step = [], [], [], [], 0
    while not last.value:
        step += 1
        begins.append(time.monotonic())
        used.append(time.process_time())
        if how == "begin":
            with owner.begin(step, timeout=PATIENCE) as (after,):
                computed.append(advance(now, after))
        else:
            after = own[step % 2]
            computed.append(advance(now, after))
            if how == "publish":
                owner.publish(step, after, timeout=PATIENCE)
        waited.append(owner.waited if owner else 0)
        now = after
        together.wait()
        if rank == 0:
            last.value = stop.is_set()
            steps.value = step
        together.wait()
    if owner:
        owner.close()
    told.put((rank, waited, begins, used, computed))


def look(endpoint: str, dataset: str, side: int, stop, arrivals) -> None:
    """Asks for one picture after the other, and tells when each came, or why not."""
    os.sched_setaffinity(0, {LAST_CORE})
    with ss.connect(endpoint=endpoint) as service:
        if dataset == "other":  # what a busy worker alone costs a simulation beside it
            service.add(dataset, numpy.random.default_rng(0).uniform(0, 255, (side, side, side)).astype(numpy.float32))
        azimuth = 0.0
        while not stop.is_set():
            azimuth += 7
            try:
                service.render(dataset, azimuth=azimuth % 360, **PICTURE)
                arrivals.put((time.monotonic(), ""))
            except ss.SlabstreamError as error:
                arrivals.put((time.monotonic(), str(error)))
                time.sleep(0.02)


def next_picture(arrivals) -> float:
    """When the next picture comes."""
    while (arrived := arrivals.get(timeout=PATIENCE))[1]:
        pass
    return arrived[0]


def time_steps(way: str, ranks: int, side: int, seconds: float, running: Running) -> tuple[float, float, float, float, float]:
    """Mean processor seconds of a step, the share of it beside the computation, its median seconds, the greatest share of the time that a
    rank waited, pictures a second."""
    there, slots, how, looked = WAYS[way]
    together, stop, told, arrivals = FORK.Barrier(ranks), FORK.Event(), FORK.Queue(), FORK.Queue()
    last, steps = FORK.Value("b", 0), FORK.Value("i", 0)
    service = running.for_owners if there else "ipc:///nowhere/s"
    simulation = [FORK.Process(target=run_rank, args=(rank, ranks, side, service, slots, how, together, stop, last, steps, told))
                  for rank in range(ranks)]
    viewer = FORK.Process(target=look, args=(running.endpoint, looked, side, stop, arrivals))
    for process in simulation + [viewer] * bool(looked):
        process.start()
    since = next_picture(arrivals) if looked else time.monotonic() + 0.5
    time.sleep(max(since - time.monotonic(), 0))
    least_steps = steps.value + 10
    time.sleep(seconds)
    while steps.value < least_steps and time.monotonic() < since + PATIENCE:
        time.sleep(0.1)
    stop.set()
    of_ranks = [told.get(timeout=PATIENCE) for _ in simulation]
    pictures = 0
    while looked and (viewer.is_alive() or not arrivals.empty()):
        with contextlib.suppress(queue.Empty):
            pictures += not arrivals.get(timeout=0.1)[1]
    for process in simulation:
        process.join()
    begins = of_ranks[0][2]
    first = next(i for i, begin in enumerate(begins) if begin >= since)
    spans = [after - before for before, after in zip(begins[first:], begins[first + 1 :])]
    cpu = sum(used[-1] - used[first] for _, _, _, used, _ in of_ranks)
    beside = 1 - sum(sum(computed[first:-1]) for *_, computed in of_ranks) / cpu
    waits = max(sum(waited[first:-1]) for _, waited, *_ in of_ranks) / sum(spans)
    return cpu / len(spans), beside, statistics.median(spans), waits, pictures / sum(spans)


def measure_steps(side: int, seconds: float, rounds: int, rank_counts: list[int]) -> None:
    print("ranks | way | processor time of a step, ms | ratio to no owner | beside the computation | median step, ms | waits | pictures a second")
    print("---|---|---|---|---|---|---|---")
    for ranks in rank_counts:
        found: dict[str, list[tuple[float, ...]]] = {way: [] for way in WAYS}
        for _ in range(rounds):
            for way in WAYS:
                with running_service(1) as running:
                    found[way].append(time_steps(way, ranks, side, seconds, running))
        for way, rows in found.items():
            ratio = statistics.median(row[0] / alone[0] for row, alone in zip(rows, found["no owner"]))
            cpu, beside, step, waited, pictures = (statistics.median(row[i] for row in rows) for i in range(5))
            print(f"{ranks} | {way} | {1e3 * cpu:.2f} | {ratio:.3f} | {100 * beside:.2f} % | {1e3 * step:.1f} | "
                  f"{100 * waited:.1f} % | {pictures:.1f}", flush=True)


def show_numbers(rank: int, ranks: int, side: int, service: str, commits, stop) -> None:
    """Every voxel has the number of the time, in [1, 250]; a time comes every 0.3 s."""
    os.sched_setaffinity(0, {0})
    owner = owner_of(rank, ranks, side, service, slots=3)
    for step in range(1, 251):
        if stop.is_set():
            break
        with owner.begin(step, timeout=PATIENCE) as (array,):
            array[...] = step
        commits[rank * 251 + step] = time.monotonic()
        time.sleep(0.3)
    owner.close()


def measure_latency(side: int, seconds: float) -> None:
    print("ranks | workers | pictures of a new time | commit to picture, median, ms | greatest, ms\n---|---|---|---|---")
    for ranks, workers in ((1, 1), (8, 1), (8, 2)):
        with running_service(workers) as running:
            commits, stop = FORK.Array("d", 251 * ranks, lock=False), FORK.Event()
            simulation = [FORK.Process(target=show_numbers, args=(rank, ranks, side, running.for_owners, commits, stop)) for rank in range(ranks)]
            for process in simulation:
                process.start()
            reader = FORK.Process(target=read_numbers, args=(running.endpoint, seconds, arrivals := FORK.Queue()))
            reader.start()
            seen = arrivals.get(timeout=PATIENCE + seconds)
            stop.set()
            for process in [reader, *simulation]:
                process.join()
            waits = [at - max(commits[rank * 251 + step] for rank in range(ranks)) for step, at in list(seen.items())[1:]]
            print(f"{ranks} | {workers} | {len(waits)} | {1e3 * statistics.median(waits):.0f} | {1e3 * max(waits):.0f}", flush=True)


def read_numbers(endpoint: str, seconds: float, arrivals) -> None:
    """Tells when the first picture of each time came, by its number."""
    os.sched_setaffinity(0, {LAST_CORE})
    seen: dict[int, float] = {}
    with ss.connect(endpoint=endpoint) as service:
        deadline = time.monotonic() + PATIENCE
        while time.monotonic() < deadline:
            try:
                image = service.render("heat", **NUMBER)
            except ss.SlabstreamError:
                continue
            if not seen:
                deadline = time.monotonic() + seconds
            seen.setdefault(int(numpy.asarray(image)[256, 256, 0]), time.monotonic())
    arrivals.put(seen)


def keep_showing(rank: int, ranks: int, side: int, service: str) -> None:
    """The same field at all times, until it is killed."""
    owner = owner_of(rank, ranks, side, service, slots=3)
    for step in itertools.count(1):
        with owner.begin(step, timeout=1e6) as (array,):
            array[...] = 100
        time.sleep(0.05)


def measure_faults(side: int) -> None:
    ranks = 3
    with running_service(2) as running:
        simulation = [FORK.Process(target=keep_showing, args=(rank, ranks, side, running.for_owners)) for rank in range(ranks)]
        stop, arrivals = FORK.Event(), FORK.Queue()
        viewer = FORK.Process(target=look, args=(running.endpoint, "heat", side, stop, arrivals))
        for process in [*simulation, viewer]:
            process.start()
        next_picture(arrivals)

        def during(what: str, seconds: float) -> None:
            end, times, errors = time.monotonic() + seconds, [], []
            while time.monotonic() < end:
                at, error = arrivals.get(timeout=PATIENCE)
                errors.append(error) if error else times.append(at)
            longest = max((after - before for before, after in zip(times, times[1:])), default=seconds)
            said = f"; {len(errors)} failed: {max(set(errors), key=errors.count)}" if errors else "; none failed"
            print(f"{what}: {len(times)} pictures in {seconds:.0f} s, at most {longest:.2f} s apart{said}", flush=True)

        during("undisturbed", 3)
        with ss.connect(endpoint=running.endpoint) as service:
            workers = [worker.pid for worker in service.status().workers]
        os.kill(workers[0], signal.SIGKILL)
        during("a worker is killed", 5)
        added = [running.add_worker() for _ in range(2)]
        during("two workers are added", 5)
        for worker in added:
            worker.terminate()
            worker.wait()
        during("two workers leave", 5)
        os.kill(simulation[1].pid, signal.SIGKILL)
        killed = time.monotonic()
        while not (arrived := arrivals.get(timeout=PATIENCE))[1]:
            pass
        print(f"rank 1 is killed: after {arrived[0] - killed:.2f} s a picture fails: {arrived[1]}")
        for process in simulation:  # as MPI does
            process.kill()
        simulation = [FORK.Process(target=keep_showing, args=(rank, ranks, side, running.for_owners)) for rank in range(ranks)]
        for process in simulation:
            process.start()
        began = time.monotonic()
        print(f"the simulation starts again: after {next_picture(arrivals) - began:.2f} s there is a picture")
        stop.set()
        for process in simulation:
            process.kill()
        while viewer.is_alive():
            with contextlib.suppress(queue.Empty):
                arrivals.get(timeout=0.1)


@contextlib.contextmanager
def running_service(workers: int):
    running = Running(workers)
    try:
        yield running
    finally:
        running.end()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", nargs="*", default=["steps", "latency", "faults"])
    parser.add_argument("--side", type=int, default=128, help="voxels a side (default 128)")
    parser.add_argument("--seconds", type=float, default=3, help="of each measurement (default 3)")
    parser.add_argument("--rounds", type=int, default=3, help="of `steps` (default 3)")
    parser.add_argument("--ranks", type=int, nargs="+", default=[1, 3, 7, 8], help="of `steps` (default 1 3 7 8)")
    options = parser.parse_args()
    print(f"bench/insitu.py {' '.join(sys.argv[1:])}: {checkout()}, {machine()}")
    measures = {"steps": lambda: measure_steps(options.side, options.seconds, options.rounds, options.ranks),
                "latency": lambda: measure_latency(options.side, 4 * options.seconds), "faults": lambda: measure_faults(options.side)}
    for what in options.what:
        if what not in measures:
            parser.error(f"'{what}' is not one of {', '.join(measures)}")
        print(f"\n{what}:")
        measures[what]()


if __name__ == "__main__":
    main()
