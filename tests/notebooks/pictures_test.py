"""The notebooks of docs/ that are kept with pictures run from top to bottom, and give these pictures. Argument PROGRAMS, then those of unittest;
or PROGRAMS --write: the pictures that they give are kept."""
from __future__ import annotations

import base64
import io
import os
import pathlib
import sys
import tempfile
import unittest

import nbclient
import nbformat
import numpy as np
import PIL.Image

PROGRAMS, ROOT = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(__file__).resolve().parents[2]
NOTEBOOKS = [ROOT / "docs" / name for name in ("ct.ipynb", "channels.ipynb")]


def execute(path: pathlib.Path) -> nbformat.NotebookNode:
    notebook = nbformat.read(path, nbformat.NO_CONVERT)
    with tempfile.TemporaryDirectory() as folder:
        private = {name: folder for name in ("HOME", "IPYTHONDIR", "MPLCONFIGDIR")}
        ours = {"PYTHONPATH": str(ROOT / "python"), "PYTHONDONTWRITEBYTECODE": "1", "SLABSTREAM_PROGRAMS": str(PROGRAMS)}
        client = nbclient.NotebookClient(notebook, timeout=600, kernel_name="python3", store_widget_state=False, record_timing=False)
        client.execute(env=os.environ | private | ours)
    return notebook


def pictures(notebook: nbformat.NotebookNode) -> list[np.ndarray]:
    """The first frame of each, in red, green and blue."""
    shown = [(kind, data) for cell in notebook.cells for output in cell.get("outputs", []) for kind, data in output.get("data", {}).items()]
    return [np.asarray(PIL.Image.open(io.BytesIO(base64.b64decode(data))).convert("RGB")).astype(int) for kind, data in shown if kind.startswith("image/")]


class Pictures(unittest.TestCase):
    def test_notebooks_give_the_pictures_that_they_are_kept_with(self) -> None:
        for path in NOTEBOOKS:
            with self.subTest(path.name):
                kept, given = pictures(nbformat.read(path, nbformat.NO_CONVERT)), pictures(execute(path))
                self.assertEqual([picture.shape for picture in given], [picture.shape for picture in kept])
                self.assertGreaterEqual(len(kept), 8)
                for number, (one, other) in enumerate(zip(given, kept)):
                    self.assertGreater(one.std(), 10, f"picture {number} is not blank")
                    self.assertLess(np.abs(one - other).mean(), 1, f"picture {number} is the one that is kept")


if __name__ == "__main__":
    if sys.argv[2:] == ["--write"]:
        for path in NOTEBOOKS:
            nbformat.write(execute(path), path)
    else:
        unittest.main(argv=[sys.argv[0], *sys.argv[2:]])
