"""A time-dilated cluster: hosts as network namespaces of this machine, each with a share of a core and of its network's rate.

Every host has a share s of one core (a cgroup's processor quota) and a link of s times the modelled rate, in and out (tbf). Processes in it
run as on a host with a whole core and the whole rate, but 1/s times slower: multiply elapsed times by s. The coordinator and the client have
hosts of their own, which are dilated like the workers': at full speed they would seem 1/s times as quick as a real host, and hide what they
cost.

Each host also has a process namespace of its own, so that processes of different hosts cannot read each other's memory.

Needs root, iproute2 and util-linux, and the cpu controller of cgroup v1 or v2. Everything that a Cluster makes is named after this process,
and Cluster.close() removes it.
"""
import os
import pathlib
import signal
import subprocess
import time

QUOTA_PERIOD_US = 5000  # of the processor quota; longer if the quota would fall below what the kernel takes
LEAST_QUOTA_US = 1000
BURST_BYTES = 128 << 10  # that a link passes at once: two of the largest segments of TCP
QUEUE_BYTES = 16 << 20  # that wait at a link
END_SECONDS = 5  # for processes to end before they are killed


class ClusterError(Exception):
    """What cannot be done here, in one line."""


def run(*command: str) -> str:
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise ClusterError(f"`{' '.join(command)}` fails: {done.stderr.strip().splitlines()[-1] if done.stderr.strip() else done.returncode}")
    return done.stdout


class Quota:
    """The processor time of a group of processes, by cgroup v1 or v2."""

    def __init__(self, name: str):
        mounts = [line.split()[1:4] for line in pathlib.Path("/proc/mounts").read_text(encoding="utf-8").splitlines()]
        first = [place for place, kind, options in mounts if kind == "cgroup" and "cpu" in options.split(",")]
        second = [place for place, kind, _ in mounts if kind == "cgroup2" and self._has_cpu(place)]
        if not first and not second:
            raise ClusterError("no cpu controller of cgroups is mounted")
        self.version = 1 if first else 2
        self.folder = pathlib.Path((first or second)[0]) / name
        if self.version == 2:
            (self.folder.parent / "cgroup.subtree_control").write_text("+cpu", encoding="utf-8")
        self.folder.mkdir()

    @staticmethod
    def _has_cpu(place: str) -> bool:
        controllers = pathlib.Path(place) / "cgroup.controllers"
        return controllers.exists() and "cpu" in controllers.read_text(encoding="utf-8").split()

    def limit(self, share: float | None) -> None:
        """To a share of one core; None: no limit."""
        quota, period = -1, QUOTA_PERIOD_US
        if share is not None and share < 1:
            period = max(QUOTA_PERIOD_US, round(LEAST_QUOTA_US / share))
            quota = round(period * share)
        elif share is not None:
            quota = period
        if self.version == 2:
            self._write("cpu.max", f"{'max' if quota < 0 else quota} {period}")
            return
        self._write("cpu.cfs_quota_us", "-1")  # a period that does not fit the old quota is refused
        self._write("cpu.cfs_period_us", str(period))
        self._write("cpu.cfs_quota_us", str(quota))

    def _write(self, file: str, text: str) -> None:
        try:
            (self.folder / file).write_text(text, encoding="utf-8")
        except OSError as error:
            raise ClusterError(f"{self.folder / file}: '{text}' is refused: {error.strerror}") from None

    @property
    def members(self) -> pathlib.Path:
        return self.folder / "cgroup.procs"

    def processes(self) -> list[int]:
        return [int(pid) for pid in self.members.read_text(encoding="utf-8").split()]

    def close(self) -> None:
        deadline = time.monotonic() + END_SECONDS
        while self.processes() and time.monotonic() < deadline:
            for pid in self.processes():
                try:
                    os.kill(pid, signal.SIGKILL)
                except ProcessLookupError:
                    pass
            time.sleep(0.02)
        self.folder.rmdir()


class Host:
    """A host of the cluster. `number` counts from 0."""

    def __init__(self, cluster_name: str, bridge: str, number: int):
        self.name = f"{cluster_name}n{number}"
        self.address = f"10.78.0.{number + 1}"
        self.hostname = f"node{number}"
        self._bridge, self._port = bridge, f"p{number}"
        self.quota = Quota(self.name)
        try:
            run("ip", "netns", "add", self.name)
            run("ip", "-n", self.name, "link", "set", "lo", "up")
            run("ip", "-n", self.name, "link", "add", "eth0", "type", "veth", "peer", "name", self._port, "netns", bridge)
            run("ip", "-n", self.name, "addr", "add", f"{self.address}/24", "dev", "eth0")
            run("ip", "-n", self.name, "link", "set", "eth0", "up")
            run("ip", "-n", bridge, "link", "set", self._port, "master", "bridge0", "up")
        except ClusterError:
            self.close()
            raise

    def limit(self, share: float | None, bytes_per_second: float | None) -> None:
        """The processor to a share of one core, and the link in both directions. None: no limit."""
        self.quota.limit(share)
        for space, device in ((self.name, "eth0"), (self._bridge, self._port)):
            subprocess.run(["tc", "-n", space, "qdisc", "del", "dev", device, "root"], capture_output=True, check=False)
            if bytes_per_second is not None:
                rate = ["rate", f"{round(bytes_per_second * 8)}bit", "burst", str(BURST_BYTES), "limit", str(QUEUE_BYTES)]
                run("tc", "-n", space, "qdisc", "add", "dev", device, "root", "tbf", *rate)

    def start(self, command: list[str], **popen) -> subprocess.Popen:
        """Starts a command on the host. A Ctrl-C at the terminal does not reach it."""
        enter = f'echo $$ > "{self.quota.members}"; exec "$@"'
        spaces = ["nsenter", f"--net=/run/netns/{self.name}", "unshare", "--uts", "--pid", "--fork", "--kill-child"]
        named = ["sh", "-c", f'hostname {self.hostname}; exec "$@"', "sh"]
        return subprocess.Popen(["sh", "-c", enter, "sh", *spaces, *named, *command], start_new_session=True, **popen)

    def busy_seconds(self) -> float:
        """Processor time of the processes that run on the host, since they began."""
        ticks = 0
        for pid in self.quota.processes():
            try:
                fields = pathlib.Path(f"/proc/{pid}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()
            except OSError:  # it has ended
                continue
            ticks += int(fields[11]) + int(fields[12])  # in user mode, in the kernel
        return ticks / os.sysconf("SC_CLK_TCK")

    def close(self) -> None:
        self.quota.close()
        subprocess.run(["ip", "netns", "del", self.name], capture_output=True, check=False)


class Cluster:
    """`count` hosts, joined by a bridge in a namespace of its own. What they send never leaves them."""

    def __init__(self, count: int):
        if os.geteuid() != 0:
            raise ClusterError("namespaces and quotas need root")
        self._name = f"dilated{os.getpid()}"
        self._bridge = f"{self._name}b"
        self.hosts: list[Host] = []
        run("ip", "netns", "add", self._bridge)
        try:
            run("ip", "-n", self._bridge, "link", "add", "bridge0", "type", "bridge")
            run("ip", "-n", self._bridge, "link", "set", "bridge0", "up")
            for number in range(count):
                self.hosts.append(Host(self._name, self._bridge, number))
        except BaseException:
            self.close()
            raise

    def limit(self, share: float | None, bytes_per_second: float | None) -> None:
        for host in self.hosts:
            host.limit(share, bytes_per_second)

    def busy_seconds(self) -> float:
        return sum(host.busy_seconds() for host in self.hosts)

    def close(self) -> None:
        """Ends all processes of the hosts and removes the hosts."""
        for host in self.hosts:
            host.close()
        self.hosts = []
        subprocess.run(["ip", "netns", "del", self._bridge], capture_output=True, check=False)

    def __enter__(self) -> "Cluster":
        return self

    def __exit__(self, *_) -> None:
        self.close()


class OtherLoad:
    """The share of this machine that others than the cluster take, from now on: the hosts then do not get theirs."""

    def __init__(self, cluster: Cluster):
        self._cluster = cluster
        self._began = self._now()

    def share(self) -> float:
        total, busy, own = (now - began for now, began in zip(self._now(), self._began))
        return max(0.0, busy - own) / total if total > 0 else 0.0

    def _now(self) -> tuple[float, float, float]:
        ticks = [int(text) for text in pathlib.Path("/proc/stat").read_text(encoding="utf-8").split("\n", 1)[0].split()[1:9]]
        idle = ticks[3] + ticks[4]  # and waiting for a disk
        second = os.sysconf("SC_CLK_TCK")
        return sum(ticks) / second, (sum(ticks) - idle) / second, self._cluster.busy_seconds()
