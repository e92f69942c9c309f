"""The Python that the documents print, run as it stands there: only the endpoint is another."""
from __future__ import annotations

import contextlib
import io
import os
import re
import subprocess
import unittest

import numpy as np

from client_support import PROGRAM, ROOT, InAFolder, RunningService, volume_arrays, working_in

import slabstream as ss  # noqa: E402
from slabstream.volumes import volume_of, write_nrrd  # noqa: E402

KEEP = os.environ.get("SLABSTREAM_KEEP_PICTURES")  # a folder for the tutorial's pictures, to be looked at


def blocks_of(document: str) -> list[str]:
    return re.findall(r"^```python\n(.*?)^```$", (ROOT / "docs" / document).read_text(), re.DOTALL | re.MULTILINE)


class Documents(InAFolder):
    def start(self, data: str, *arguments: str) -> RunningService:
        running = RunningService(self.folder, "--data", data, *arguments)
        self.addCleanup(running.end)
        return running

    def test_the_client_of_the_wire_page_gets_the_picture(self) -> None:
        try:
            import zstandard  # noqa: F401
        except ImportError:
            self.skipTest("install python3-zstandard")
        code = "".join(blocks_of("wire.md"))
        printed = "tcp://127.0.0.1:7420"
        self.assertIn(printed, code)
        running = self.start(f"brain={self.brain()}", "--compress=on")
        names: dict = {}
        exec(compile(code.replace(printed, running.endpoint), "wire.md", "exec"), names)
        names["socket"].close()
        bounds, picture = names["answer"].frame_reply.shares[0].runs.image.bounds, names["picture"]
        whole = np.zeros((512, 512, 4), np.float32)
        whole[bounds.y_begin : bounds.y_end, bounds.x_begin : bounds.x_end] = picture
        with ss.connect(endpoint=running.endpoint) as service:
            np.testing.assert_array_equal(service.render("brain", azimuth=45).rgba, whole)
        self.assertGreater(whole.max(), 0.1)

    def test_the_tutorial_runs(self) -> None:
        running = self.start(f"brain={self.brain()}")
        self.addCleanup(ss.shutdown)
        self.write_scan()
        code = "\n".join(blocks_of("python.md"))
        printed = "tcp://127.0.0.1:7420"
        self.assertEqual(code.count(printed), 5)
        names: dict = {}
        said = io.StringIO()
        with working_in(self.folder), contextlib.redirect_stdout(said):
            exec(compile(code.replace(printed, running.endpoint), "python.md", "exec"), names)
        self.assertIn("zoom 0 is out of range [0.001, 10000]", said.getvalue())
        self.assertEqual(len(list(self.folder.glob("turn_*.png"))), 12)
        self.assertEqual(names["there"].value, volume_arrays()[0][names["there"].index])
        self.assertIsNotNone(names["seen"])
        for name in ("image", "front", "above", "planes", "surface", "preview", "left", "right", "shaped"):
            self.assertGreater(np.asarray(names[name])[..., :3].max(), 50, name)
            if KEEP:
                names[name].save(f"{KEEP}/{name}.png")

    def write_scan(self) -> None:
        """scan.ome.zarr, with two levels."""
        write_nrrd(volume_of(np.kron(volume_arrays()[0], np.ones((4, 4, 4), np.uint8))), self.folder / "scan.nrrd")
        subprocess.run([PROGRAM, "convert", self.folder / "scan.nrrd", self.folder / "scan.ome.zarr"], check=True, stdout=subprocess.DEVNULL)

    def brain(self) -> str:
        write_nrrd(volume_of(volume_arrays()[0], spacing=(2, 1.5, 1.25)), self.folder / "brain.nrrd")
        return f"{self.folder}/brain.nrrd"


if __name__ == "__main__":
    unittest.main()
