"""A service of which every process serves metrics, and the text of Prometheus read strictly, with the standard library alone."""
import collections
import http.client
import os
import re
import shutil
import signal
import subprocess
import tempfile
import time
from pathlib import Path

TIMEOUT = 120  # far above what anything needs
TOKEN = "metrics-token-0123456789"


def wait_until(condition, what):
    limit = time.monotonic() + TIMEOUT
    while not (result := condition()):
        if time.monotonic() > limit:
            raise AssertionError(what)
        time.sleep(0.05)
    return result


class Metrics:
    """The text of one process: `values` by name and labels; raises AssertionError where the text breaks a rule of the format."""

    def __init__(self, text):
        self.text, self.types, self.values = text, {}, {}
        helped, family, ended = None, None, set()
        assert text.endswith("\n"), text[-80:]
        for line in text.splitlines():
            if match := re.fullmatch(r"# HELP (slabstream_[a-z_]+) (\S.*)", line):
                helped = match[1]
                continue
            if match := re.fullmatch(r"# TYPE (slabstream_[a-z_]+) (counter|gauge|histogram)", line):
                family = match[1]
                assert family == helped and family not in ended, line
                assert (match[2] == "counter") == family.endswith("_total"), line
                ended.add(family)
                self.types[family] = match[2]
                continue
            match = re.fullmatch(r'(slabstream_[a-z_]+)(?:\{((?:[a-z_]+="(?:[^"\\]|\\.)*",?)*)\})? (\S+)', line)
            assert match, line
            name, labels = match[1], dict(re.findall(r'([a-z_]+)="((?:[^"\\]|\\.)*)"', match[2] or ""))
            suffixes = ("_bucket", "_sum", "_count") if self.types[family] == "histogram" else ("",)
            assert any(name == family + suffix for suffix in suffixes), line
            key = (name, frozenset(labels.items()))
            assert key not in self.values, line
            self.values[key] = float(match[3])
        self.check_histograms()

    def check_histograms(self):
        buckets = collections.defaultdict(list)
        for (name, labels), value in self.values.items():
            if name.endswith("_bucket"):
                rest = {label for label in labels if label[0] != "le"}
                buckets[name[: -len("_bucket")], frozenset(rest)].append((float(dict(labels)["le"]), value))
        for (name, labels), found in buckets.items():
            counts = [count for _, count in sorted(found)]
            assert counts == sorted(counts), (name, counts)
            assert sorted(found)[-1][0] == float("inf") and counts[-1] == self.values[f"{name}_count", labels], name

    def __call__(self, name, **labels):
        return self.values["slabstream_" + name, frozenset(labels.items())]

    def names(self):
        return {name for name, _ in self.values}


def fetch(address, target="/metrics", method="GET", headers=None, body=None):
    """Status, headers and body. `address`: host:port."""
    connection = http.client.HTTPConnection(address, timeout=TIMEOUT)
    connection.request(method, target, body=body, headers=headers or {})
    response = connection.getresponse()
    data = response.read()
    connection.close()
    return response.status, response.headers, data


class MeasuredService:
    """A coordinator, two workers, of which the second one wants a token, and a gateway, on free ports."""

    def __init__(self, programs):
        self.programs = Path(programs).resolve()
        self.folder = Path(tempfile.mkdtemp(prefix="slabstream-metrics-", dir="/tmp"))
        self.environment = {**os.environ, "XDG_RUNTIME_DIR": str(self.folder)}
        for name in ("SLABSTREAM_ENDPOINT", "SLABSTREAM_SERVICE"):
            self.environment.pop(name, None)
        self.children = []
        self.token_file = self.folder / "token"
        self.token_file.write_text(TOKEN + "\n")
        self.token_file.chmod(0o600)

    def run(self, program, *arguments):
        return subprocess.run([str(self.programs / program), *map(str, arguments)], cwd=self.folder, env=self.environment,
                              capture_output=True, text=True, timeout=TIMEOUT)

    def start(self, program, *arguments):
        """The child, and the file that it logs to."""
        log = self.folder / f"{program}-{len(self.children)}.log"
        with log.open("w") as errors:
            child = subprocess.Popen([str(self.programs / program), *map(str, arguments)], cwd=self.folder, env=self.environment,
                                     stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=errors, text=True)
        self.children.append(child)
        return child, log

    def start_coordinator(self, *arguments):
        child, log = self.start("slabstream-coordinator", "--listen", "tcp://127.0.0.1:*", "--metrics", "0", "--memory", "1GiB", *arguments)
        line = child.stdout.readline()
        assert " ready " in line, log.read_text()
        fields = dict(field.split("=", 1) for field in line.split() if "=" in field)
        self.endpoint, self.worker_endpoint = fields["client"], fields["workers"]
        self.coordinator = self.address_in(fields["metrics"])
        return child

    def start_worker(self, *arguments):
        """The child, and where its metrics are."""
        child, log = self.start("slabstream-worker", "--coordinator", self.worker_endpoint, "--threads", "1", "--memory", "1GiB",
                                "--metrics", "0", "--log-level", "info", *arguments)
        found = wait_until(lambda: child.poll() is not None or re.search(r"serves metrics at (\S+)", log.read_text()), "the worker's address")
        assert found is not True, log.read_text()
        return child, self.address_in(found[1])

    def start_gateway(self, *arguments):
        child, log = self.start("slabstream-gateway", "--endpoint", self.endpoint, "--token-file", self.token_file, *arguments)
        line = child.stdout.readline().split()
        assert line and line[0] == "ready", log.read_text()
        self.gateway = line[1].split("//")[1].rstrip("/")
        return child

    def start_all(self):
        made = self.run("slabstream", "sphere", "--class", 2, "--size", 32, "-o", "ball.nrrd")
        assert made.returncode == 0, made.stderr
        self.start_coordinator("--data", "ball=ball.nrrd")
        started = [self.start_worker(), self.start_worker("--metrics-token-file", self.token_file)]
        self.worker_processes, self.workers = map(list, zip(*started))
        self.start_gateway()
        wait_until(lambda: self.measure(self.coordinator)("coordinator_workers", state="ready") == 2, "two workers")
        wait_until(lambda: fetch(self.gateway, "/readyz")[0] == 200, "the gateway")

    @staticmethod
    def address_in(url):
        return re.fullmatch(r"http://([^/]+)/metrics", url)[1]

    def measure(self, address):
        status, headers, body = fetch(address, headers={"Authorization": f"Bearer {TOKEN}"})
        assert status == 200 and headers["Content-Type"].startswith("text/plain; version=0.0.4"), (status, body)
        return Metrics(body.decode())

    def close(self):
        for child in reversed(self.children):
            if child.poll() is None:
                child.send_signal(signal.SIGTERM)
                try:
                    child.wait(timeout=20)
                except subprocess.TimeoutExpired:
                    child.kill()
            child.stdout.close()
            child.wait()
        shutil.rmtree(self.folder)
