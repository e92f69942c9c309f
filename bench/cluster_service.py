"""A service of real processes on a time-dilated cluster (dilated_cluster.py), and the results that are measured there."""
from __future__ import annotations

import json
import pathlib
import statistics
import subprocess
import sys
import time
from typing import NoReturn

from dilated_cluster import ClusterError, Host

START_SECONDS = 60
CORES_USED = 1.5  # by all workers together
GIGABIT = 1e9 / 8  # bytes


def link_text(rate: float) -> str:
    """As experiments call it: no latency but the kernel's."""
    return f"10gbit:0,{rate:g}"


def core_share(workers: int) -> float:
    """Of a core, for each of so many hosts that work."""
    return min(1.0, CORES_USED / workers)


def make_sphere(path: pathlib.Path, programs: pathlib.Path, sphere_class: int, size: int, occupancy: float) -> None:
    """The file is there whole or not at all."""
    if path.exists():
        return
    made = path.with_name("new-" + path.name)
    sphere = ["--class", str(sphere_class), "--size", str(size), "--occupancy", str(occupancy)]
    subprocess.run([programs / "slabstream", "sphere", *sphere, "-o", made], check=True, stdout=subprocess.DEVNULL)
    made.rename(path)


def run_program(name: str, main, interrupted: str = "interrupted; the same command continues") -> NoReturn:
    """Ends the process with main's status. What goes wrong is one line."""
    try:
        sys.exit(main())
    except ClusterError as error:
        print(f"{name}: {error}", file=sys.stderr)
        sys.exit(1)
    except subprocess.CalledProcessError as error:
        print(f"{name}: `{error.cmd[0]}` ended with status {error.returncode}", file=sys.stderr)
        sys.exit(1)
    except KeyboardInterrupt:
        print(f"{name}: {interrupted}", file=sys.stderr)
        sys.exit(130)


class Service:
    """A coordinator on the first host, a client on the second, a worker on each of the others."""

    def __init__(self, hosts: list[Host], data: dict[str, pathlib.Path], programs: pathlib.Path, folder: pathlib.Path,
                 memory: str = ""):
        """`memory`: of the coordinator and of each worker, as --memory takes it; "": no limit."""
        limit = ["--memory", memory] if memory else []
        self._programs, self._folder = programs, folder
        self._coordinator, self._client, *self._workers = hosts
        self._keys = folder / "keys"
        self._processes: dict[str, subprocess.Popen] = {}
        data = [text for name, path in data.items() for text in ("--data", f"{name}={path}")]
        listen = ["--listen", f"tcp://{self._coordinator.address}:7420", "--keys", str(self._keys)]
        self._start(self._coordinator, "coordinator", ["slabstream-coordinator", *listen, *limit, *data])
        self._wait("the coordinator listens", lambda: "ready" in (folder / "coordinator.log").read_text(encoding="utf-8"))
        for host in self._workers:
            # Images are not packed: `auto` would compare a dilated link with the speed of a codec that is not dilated.
            options = ["--service", str(self._keys / "worker.json"), "--threads", "1", "--compress=off", *limit]
            self._start(host, host.hostname, ["slabstream-worker", *options])
        self._wait("all workers are registered", lambda: self._registered() == len(self._workers))

    def _start(self, host, name: str, command: list[str]) -> None:
        with open(self._folder / f"{name}.log", "w", encoding="utf-8") as log:
            self._processes[name] = host.start([str(self._programs / command[0]), *command[1:]], stdout=log, stderr=log)

    def _registered(self) -> int:
        done = self.ask(["status", "--json"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        text = done.communicate()[0]
        return len(json.loads(text)["workers"]) if done.returncode == 0 else 0

    def _wait(self, what: str, is_so) -> None:
        deadline = time.monotonic() + START_SECONDS
        while not is_so():
            for name, process in self._processes.items():
                if process.poll() is not None:
                    told = (self._folder / f"{name}.log").read_text(encoding="utf-8").strip().splitlines()
                    raise ClusterError(f"{name} ended with status {process.returncode}{': ' + told[-1] if told else ''}")
            if time.monotonic() > deadline:
                raise ClusterError(f"after {START_SECONDS} s it is not so that {what}; logs are in {self._folder}")
            time.sleep(0.1)

    def memory_mib(self) -> list[float]:
        """The most memory that each worker has had, as the kernel counts it."""
        peaks = []
        for host in self._workers:
            texts = [pathlib.Path(f"/proc/{pid}/status").read_text(encoding="utf-8") for pid in host.quota.processes()]
            peaks.append(max(int(text.partition("VmHWM:")[2].split()[0]) / 1024 for text in texts))
        return peaks

    def ask(self, command: list[str], **popen) -> subprocess.Popen:
        """A command of the client."""
        return self._client.start([str(self._programs / "slabstream"), *command, "--service", str(self._keys / "client.json")], **popen)

    def experiment(self, *command: str) -> None:
        """`slabstream experiment ...`, measured from the client's host."""
        done = self.ask(["experiment", *command], stdout=subprocess.DEVNULL)
        if done.wait() != 0:
            raise ClusterError(f"`experiment {' '.join(command)}` ended with status {done.returncode}; logs are in {self._folder}")


class Progress:
    """How long runs took, and how long the others may take: runs of the dilated cluster keep the same number of cores busy."""

    def __init__(self):
        self.left, self._took = 0, []

    def done(self, what: str, seconds: float) -> None:
        self._took.append(seconds)
        self.left -= 1
        minutes = self.left * sum(self._took) / len(self._took) / 60
        print(f"{what}: {seconds:.0f} s; {self.left} runs left, about {minutes:.0f} min", file=sys.stderr)


def rows_of(folder: pathlib.Path) -> list[dict]:
    lines = (folder / "results.jsonl").read_text(encoding="utf-8").splitlines()
    return [row for row in map(json.loads, lines) if row.get("part") != "conduct"]


def dilated(row: dict, share: float, rate: float) -> dict:
    """A measured value in the time of the cluster that is modelled."""
    factor = share if row["unit"] == "s" else 1
    times = {name: row[name] * factor for name in ("value", "low", "high")}
    if "each" in row:
        times["each"] = [value * factor for value in row["each"]]
    return {**row, **times, "link": link_text(rate), "share": share}


def conduct(row: dict, loads: list[float]) -> dict:
    """The load of other programs as experiments record it: the median of the runs, the least and the most. `row`: any other one."""
    by = {name: row[name] for name in ("version", "commit", "machine")}
    value = {"value": statistics.median(loads), "low": min(loads), "high": max(loads), "repeats": len(loads), "noise": "", "unit": "1"}
    return {"part": "conduct", "metric": "other_load", "origin": "measured", **value, **by}


def write_results(output: pathlib.Path, rows: list[dict], info: dict) -> None:
    """`info`: of run.json. The page of its experiment draws them."""
    rows = [{**row, "experiment": info["experiment"]} for row in rows]
    (output / "results.jsonl").write_text("".join(json.dumps(row) + "\n" for row in rows), encoding="utf-8")
    names = list(dict.fromkeys(name for row in rows for name in row))

    def cell(value) -> str:
        text = "" if value is None else " ".join(map(str, value)) if isinstance(value, list) else str(value)
        return '"' + text.replace('"', '""') + '"' if any(c in text for c in ',"\n') else text

    lines = [",".join(names), *(",".join(cell(row.get(name)) for name in names) for row in rows)]
    (output / "results.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    (output / "run.json").write_text(json.dumps(info, indent=1) + "\n", encoding="utf-8")
    print(f"wrote {len(rows)} values to {output}/results.csv and results.jsonl\nslabstream-lab {output} draws them")
