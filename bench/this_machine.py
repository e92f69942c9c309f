"""This machine, and what processes take of it, for programs that measure."""
import contextlib
import os
import platform
import subprocess
import threading

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))


def checkout():
    done = subprocess.run(["git", "-C", ROOT, "describe", "--always", "--dirty"], capture_output=True, text=True, check=False)
    return done.stdout.strip() or "unknown"


def machine():
    with open("/proc/cpuinfo", encoding="utf-8") as file:
        model = next((line.split(":", 1)[1].strip() for line in file if line.startswith("model name")), platform.machine())
    memory = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    return f"{os.cpu_count()} x {model}, {memory / (1 << 30):.0f} GiB, load {os.getloadavg()[0]:.1f}"


def children_of(pid):
    found = [pid]
    with contextlib.suppress(OSError):
        for task in os.listdir(f"/proc/{pid}/task"):
            with open(f"/proc/{pid}/task/{task}/children", encoding="ascii") as file:
                for child in file.read().split():
                    found += children_of(int(child))
    return found


def cpu_of(pid):
    """Processor seconds so far of a process and of those that it started and that run."""
    ticks = 0
    for each in children_of(pid):
        with contextlib.suppress(OSError):
            with open(f"/proc/{each}/stat", encoding="ascii") as file:
                ticks += sum(int(number) for number in file.read().rpartition(")")[2].split()[11:13])
    return ticks / os.sysconf("SC_CLK_TCK")


class Watched:
    """The memory of a process and of those that it starts, while it runs."""

    def __init__(self, process):
        self.process, self.most, self.most_together = process, {}, 0
        self.ended = threading.Event()
        self.thread = threading.Thread(target=self._watch, daemon=True)
        self.thread.start()

    def _watch(self):
        while not self.ended.wait(0.05):
            together = 0
            for pid in children_of(self.process.pid):
                with contextlib.suppress(OSError, KeyError):
                    with open(f"/proc/{pid}/status", encoding="ascii") as file:
                        fields = dict(line.split(":", 1) for line in file)
                    held = sum(int(fields[name].split()[0]) << 10 for name in ("RssAnon", "RssShmem"))
                    name = f"{fields['Name'].strip()} {pid}"
                    self.most[name] = max(self.most.get(name, 0), held)
                    together += held
            self.most_together = max(self.most_together, together)

    def stop(self):
        self.ended.set()
        self.thread.join()
