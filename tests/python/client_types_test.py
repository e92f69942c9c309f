"""The Python client's types, by mypy --strict. Exit status 77: skipped, since mypy is not installed."""
from __future__ import annotations

import pathlib
import shutil
import subprocess
import sys
import tempfile

PYTHON = pathlib.Path(__file__).resolve().parents[2] / "python"

mypy = shutil.which("mypy")
if mypy is None:
    print("skipped: install mypy")
    sys.exit(77)
with tempfile.TemporaryDirectory() as cache:
    sys.exit(subprocess.run([mypy, "--config-file", "pyproject.toml", "--cache-dir", cache], cwd=PYTHON).returncode)
