"""Owner: a field that Python processes hold and a service draws: the picture is that of the same array given to the service."""
from __future__ import annotations

import os
import pathlib
import subprocess
import sys
import tempfile
import time
import unittest

import numpy as np

from client_support import ROOT, RunningService

import slabstream as ss  # noqa: E402

SHAPE = (20, 24, 28)
PATIENCE = 60

OTHER_PROCESS = """
import sys
import numpy as np
import slabstream as ss
part = np.load(sys.argv[1])
owner = ss.Owner("field", (20, 24, 28), part.dtype, [[(0, 10), (0, 24), (0, 28)]], held=[[(0, 11), (0, 24), (0, 28)]], owner=1, owners=2,
                 service=sys.argv[2])
owner.publish(7, part)
print("published", flush=True)
sys.stdin.read()
"""


def field(step: int) -> np.ndarray:
    """No symmetry, no even number of voxels to a brick."""
    z, y, x = np.meshgrid(*(np.linspace(-1, 1, side) for side in SHAPE), indexing="ij")
    return (200 * np.exp(-4 * (x**2 + (y - 0.1 * step) ** 2 + z**2)) + 20 * x).astype(np.float32)


class Pictures:
    """Mixed into a TestCase. `keys`: the service has some."""

    keys = False

    def setUp(self) -> None:
        made = tempfile.TemporaryDirectory(prefix="slabstream-test-")
        self.addCleanup(made.cleanup)
        self.folder = pathlib.Path(made.name)
        if self.keys:
            self.running = RunningService(self.folder, "--keys", f"{self.folder}/keys", listen="tcp://127.0.0.1:*")
            self.owner_service = f"{self.folder}/keys/owner.json"
            self.service = ss.connect(service=f"{self.folder}/keys/admin.json")
        else:
            self.running = RunningService(self.folder)
            self.owner_service = f"{self.running.endpoint}.workers"
            self.service = ss.connect(endpoint=self.running.endpoint)
        self.addCleanup(self.running.end)
        self.addCleanup(self.service.close)

    def picture(self, dataset: str) -> np.ndarray:
        return self.service.render(dataset, azimuth=30, size=(96, 80), termination=0).rgba

    def check_picture(self, array: np.ndarray) -> None:
        """The service hears of the last time when it does; before, it has no dataset, or draws an older time."""
        self.service.add("same", array)
        expected, difference, why = self.picture("same"), 1.0, ""
        self.service.remove_data("same")
        deadline = time.monotonic() + PATIENCE
        while difference > 1e-6 and time.monotonic() < deadline:
            try:
                difference = float(np.abs(self.picture("field") - expected).max())
            except (ss.NotFound, ss.Unavailable) as error:
                why = str(error)
        self.assertLess(difference, 1e-6, why)
        self.assertGreater(expected.max(), 0.1)

    def test_memory_of_the_library_is_drawn_in_place(self) -> None:
        boxes = [[(0, 20), (0, 24), (0, 9)], [(0, 20), (0, 24), (9, 28)]]
        with ss.Owner("field", SHAPE, "float32", boxes, service=self.owner_service) as owner:
            for step in (1, 2):
                with owner.begin(step) as arrays:
                    self.assertEqual([array.shape for array in arrays], [(20, 24, 9), (20, 24, 19)])
                    for array, box in zip(arrays, boxes):
                        array[...] = field(step)[tuple(slice(*ends) for ends in box)]
                self.assertFalse(arrays[0].flags.writeable)
            self.check_picture(field(2))
            self.assertTrue(owner.looked_at)
        deadline = time.monotonic() + PATIENCE
        while "field" in [dataset.name for dataset in self.service.datasets()]:
            self.assertLess(time.monotonic(), deadline)

    def test_arrays_are_drawn_where_they_lie(self) -> None:
        wide = np.zeros((20, 24, 40), np.float32)
        boxes = [[(0, 20), (0, 24), (0, 9)], [(0, 20), (0, 24), (9, 28)]]
        arrays = [wide[..., :9], wide[..., 12:31]]
        with ss.Owner("field", SHAPE, "float32", boxes, strides=[array.strides for array in arrays], service=self.owner_service) as owner:
            for array, box in zip(arrays, boxes):
                array[...] = field(2)[tuple(slice(*ends) for ends in box)]
            owner.publish(2, arrays, copy=False)
            self.check_picture(field(2))
            for step in (3, 4):
                owner.publish(step, [np.array(array) for array in arrays])  # other memory
            with self.assertRaisesRegex(ss.InvalidArgument, "publish: an array of float32 with strides"):
                owner.publish(5, [np.array(array) for array in arrays], copy=False)

    def test_two_processes_hold_a_field_with_ghosts(self) -> None:
        array = field(3)
        np.save(self.folder / "part.npy", array[:11].astype(">f4"))
        other = subprocess.Popen([sys.executable, "-B", "-c", OTHER_PROCESS, str(self.folder / "part.npy"), self.owner_service],
                                 env=dict(os.environ, PYTHONPATH=str(ROOT / "python")), stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        try:
            self.assertEqual(other.stdout.readline(), b"published\n")
            with ss.Owner("field", SHAPE, "float32", [[(10, 20), (0, 24), (0, 28)]], held=[[(9, 20), (0, 24), (0, 28)]], owners=2,
                          service=self.owner_service) as owner:
                owner.publish(7, array[9:])
                self.check_picture(array)
        finally:
            other.communicate()


class Insitu(Pictures, unittest.TestCase):
    def test_parameters_have_their_declared_values_first(self) -> None:
        with ss.Owner("field", SHAPE, "uint8", parameters={"feed": (0, 0.1, 0.05), "kill": (0, 1, 0.5)}, service=self.owner_service) as owner:
            self.assertEqual(owner.parameters, {"feed": 0.05, "kill": 0.5})
            self.assertFalse(owner.looked_at)

    def test_an_exception_leaves_the_time_out(self) -> None:
        with ss.Owner("field", SHAPE, "float32", service=self.owner_service) as owner:
            with self.assertRaises(RuntimeError), owner.begin(1):
                raise RuntimeError
            owner.publish(1, field(1))
            self.check_picture(field(1))

    def test_wrong_arguments_are_refused_in_one_line(self) -> None:
        def error(kind: type[Exception], *arguments: object, **more: object) -> str:
            with self.assertRaises(kind) as caught:
                ss.Owner(*arguments, **{"service": self.owner_service, **more}).publish(1, np.zeros(SHAPE, "uint8"))
            self.assertNotIn("\n", str(caught.exception))
            return str(caught.exception)

        self.assertIn("samples is 'complex128', must be one of: int8", error(ss.InvalidArgument, "field", SHAPE, complex))
        self.assertIn("box 0: it is empty, or not inside", error(ss.InvalidArgument, "field", SHAPE, "uint8", [[(0, 21), (0, 24), (0, 28)]]))
        self.assertIn("owner 2 of 2", error(ss.InvalidArgument, "field", SHAPE, "uint8", owner=2, owners=2))
        self.assertIn("9 slots", error(ss.InvalidArgument, "field", SHAPE, "uint8", slots=9))
        self.assertIn("spacing", error(ss.InvalidArgument, "field", SHAPE, "uint8", spacing=(1, -1, 1)))
        self.assertIn("nothing.json", error(ss.NotFound, "field", SHAPE, "uint8", service="nothing.json"))
        self.assertIn("must be [(2, 24, 28)]", error(ss.InvalidArgument, "field", SHAPE, "uint8", [[(0, 2), (0, 24), (0, 28)]]))
        with ss.Owner("field", SHAPE, "uint8", service=self.owner_service) as owner:
            owner.publish(4, np.zeros(SHAPE, "uint8"))
            with self.assertRaisesRegex(ss.InvalidArgument, "time 4 is not above 4, the last one"):
                owner.publish(4, np.zeros(SHAPE, "uint8"))


class InsituWithKeys(Pictures, unittest.TestCase):
    keys = True


if __name__ == "__main__":
    unittest.main()
