"""JupyterLab, Notebook and marimo, each in a folder of its own, and notebooks for them."""
from __future__ import annotations

import contextlib
import json
import os
import pathlib
import secrets
import signal
import socket
import subprocess
import sys
import time
import urllib.error
import urllib.request

SECONDS = 60


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def notebook(path: pathlib.Path, *cells: str) -> None:
    """A notebook of these cells of code."""
    found = [{"cell_type": "code", "id": f"cell-{i}", "metadata": {}, "execution_count": None, "outputs": [], "source": cell} for i, cell in enumerate(cells)]
    about = {"kernelspec": {"name": "python3", "display_name": "Python 3", "language": "python"}}
    path.write_text(json.dumps({"cells": found, "metadata": about, "nbformat": 4, "nbformat_minor": 5}))


class Server:
    """`arguments`: of the venv's Python, with {port} and {token} in them."""

    def __init__(self, folder: pathlib.Path, path: str, *arguments: str, **environment: str):
        self.port, self.token = free_port(), secrets.token_hex(16)
        self.log = folder / f"{arguments[1]}.log"
        kept = {name: value for name, value in os.environ.items() if not name.startswith(("JUPYTER", "JPY", "SLABSTREAM_ENDPOINT", "SLABSTREAM_SERVICE"))}
        places = {name: str(folder / name.lower()) for name in ("HOME", "IPYTHONDIR", "JUPYTER_CONFIG_DIR", "JUPYTER_DATA_DIR", "JUPYTER_RUNTIME_DIR", "XDG_CONFIG_HOME")}
        for place in places.values():
            pathlib.Path(place).mkdir(exist_ok=True)
        pages = folder / "jupyter_config_dir" / "labconfig"
        pages.mkdir(exist_ok=True)
        (pages / "page_config.json").write_text(json.dumps({"disabledExtensions": {"@jupyterlab/apputils-extension:announcements": True}}))
        command = [sys.executable, *(argument.format(port=self.port, token=self.token) for argument in arguments)]
        with self.log.open("ab") as log:
            self.process = subprocess.Popen(command, cwd=folder, env={**kept, **places, **environment}, stdin=subprocess.DEVNULL, stdout=log, stderr=log,
                                            start_new_session=True)
        self.url = f"http://localhost:{self.port}"
        limit = time.monotonic() + SECONDS
        while True:
            with contextlib.suppress(urllib.error.URLError, ConnectionError):
                with urllib.request.urlopen(f"{self.url}{path}"):
                    return
            if self.process.poll() is not None or time.monotonic() > limit:
                raise RuntimeError(f"{arguments[1]} does not answer: {self.log.read_text()[-2000:]}")
            time.sleep(0.1)

    def end(self) -> None:
        if self.process.poll() is None:
            os.killpg(self.process.pid, signal.SIGTERM)
            try:
                self.process.wait(20)
            except subprocess.TimeoutExpired:
                os.killpg(self.process.pid, signal.SIGKILL)
                self.process.wait()


_JUPYTER = ("--no-browser", "--ip=127.0.0.1", "--port={port}", "--ServerApp.port_retries=0", "--IdentityProvider.token={token}", "--allow-root")


def lab(folder: pathlib.Path, **environment: str) -> Server:
    return Server(folder, "/api", "-m", "jupyterlab", "--LabApp.expose_app_in_browser=True", *_JUPYTER, **environment)


def notebook7(folder: pathlib.Path, **environment: str) -> Server:
    return Server(folder, "/api", "-m", "notebook", "--JupyterNotebookApp.expose_app_in_browser=True", *_JUPYTER, **environment)


def marimo(folder: pathlib.Path, file: str, **environment: str) -> Server:
    return Server(folder, "/health", "-m", "marimo", "edit", file, "--headless", "--host", "localhost", "--port", "{port}", "--token-password", "{token}", **environment)
