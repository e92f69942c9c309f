"""The server of bench/terabyte_store.py on a host of a time-dilated cluster, for the programs that measure who reads from it."""
import pathlib
import subprocess
import time
from collections.abc import Callable

from dilated_cluster import ClusterError, Host

PORT = 8000
COARSE_SECONDS = 300  # for the server to make its coarse levels, at most


def await_log(says: Callable[[str], bool], process: subprocess.Popen, log: pathlib.Path, seconds: float) -> None:
    """Waits until what `process` has written to its log says that it is ready."""
    deadline = time.monotonic() + seconds
    while not says(log.read_text(encoding="utf-8")):
        if process.poll() is not None or time.monotonic() > deadline:
            raise ClusterError(f"a program did not start; its log is {log}")
        time.sleep(0.02)


def start_store(host: Host, delay: float, log: pathlib.Path, options: tuple[str, ...] = ()) -> str:
    """Its address, once it answers; `delay`: seconds, of each answer; `options`: more of the server's."""
    program = str(pathlib.Path(__file__).with_name("terabyte_store.py"))
    with open(log, "w", encoding="utf-8") as file:
        arguments = ["--address", host.address, "--port", str(PORT), "--delay", str(delay), *options]
        store = host.start(["/usr/bin/python3", program, *arguments], stdout=file, stderr=file)
    await_log(lambda text: "http" in text, store, log, COARSE_SECONDS)
    return f"http://{host.address}:{PORT}"
