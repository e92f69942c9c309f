"""Surfaces and tractograms in files that nibabel writes: what read_shape reads of them is what nibabel has."""
from __future__ import annotations

import itertools
import json
import os
import pathlib
import subprocess
import tempfile
import unittest

import nibabel
import numpy as np
from nibabel import gifti
from nibabel.streamlines import Field, TckFile, Tractogram, TrkFile

READ = pathlib.Path(os.environ["SLABSTREAM_TESTS"], "read_shape")


def read(path):
    with tempfile.TemporaryDirectory() as folder:
        answer = json.loads(subprocess.run([READ, path, f"{folder}/shape"], check=True, stdout=subprocess.PIPE).stdout)
        if "error" in answer:
            raise ValueError(answer["error"])
        load = lambda name, dtype, *shape: np.fromfile(f"{folder}/shape.{name}", dtype).reshape(*shape)
        return load("positions", "f8", -1, 3), load("triangles", "u4", -1, 3), load("values", "f4", -1), load("lines", "u4", -1)


class OfNibabel(unittest.TestCase):
    def setUp(self):
        self.random = np.random.default_rng(9)
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.places = self.random.normal(0, 50, (100, 3)).astype("f4")
        self.triangles = self.random.integers(0, 100, (150, 3)).astype("i4")

    def test_surfaces_of_freesurfer(self):
        path = f"{self.folder.name}/lh.white"
        place = {"head": np.array([2, 0, 20]), "valid": "1  # volume info valid", "filename": "a.mgz", "volume": np.array([256, 256, 256]),
                 "voxelsize": np.array([1.0, 1, 1]), "xras": np.array([-1.0, 0, 0]), "yras": np.array([0.0, 0, -1]),
                 "zras": np.array([0.0, 1, 0]), "cras": np.array([1.5, -2.25, 3])}
        for info, moved in ((None, 0), (place, place["cras"])):
            nibabel.freesurfer.write_geometry(path, self.places, self.triangles, volume_info=info)
            places, triangles, _, _ = read(path)
            np.testing.assert_allclose(places, self.places + moved, atol=1e-4)
            np.testing.assert_array_equal(triangles, self.triangles)

    def test_surfaces_of_gifti(self):
        matrix = np.eye(4)
        matrix[:3] = self.random.normal(0, 2, (3, 4))
        for encoding, order, big_endian, scanner in itertools.product(("ASCII", "B64BIN", "B64GZ"), ("Row", "Column"), (False, True),
                                                                      (False, True)):
            if encoding == "ASCII" and (order == "Column" or big_endian):
                continue  # nibabel writes texts row by row, whatever it says of them
            space = gifti.GiftiCoordSystem("NIFTI_XFORM_UNKNOWN", "NIFTI_XFORM_SCANNER_ANAT" if scanner else "NIFTI_XFORM_TALAIRACH", matrix)
            options = {"encoding": f"GIFTI_ENCODING_{encoding}", "ordering": f"{order}MajorOrder",
                       "endian": f"GIFTI_ENDIAN_{'BIG' if big_endian else 'LITTLE'}"}
            as_stored = lambda numbers: numbers.astype(numbers.dtype.newbyteorder(">" if big_endian else "<"))
            image = gifti.GiftiImage(darrays=[
                gifti.GiftiDataArray(as_stored(self.places), "NIFTI_INTENT_POINTSET", "NIFTI_TYPE_FLOAT32", coordsys=space, **options),
                gifti.GiftiDataArray(as_stored(self.triangles), "NIFTI_INTENT_TRIANGLE", "NIFTI_TYPE_INT32", **options),
                gifti.GiftiDataArray(as_stored(self.places[:, 0]), "NIFTI_INTENT_SHAPE", "NIFTI_TYPE_FLOAT32", **options)])
            nibabel.save(image, f"{self.folder.name}/a.surf.gii")
            places, triangles, values, _ = read(f"{self.folder.name}/a.surf.gii")
            expected = self.places @ matrix[:3, :3].T + matrix[:3, 3] if scanner else self.places
            np.testing.assert_allclose(places, expected, atol=1e-4, err_msg=str(options))
            mirrored = scanner and np.linalg.det(matrix[:3, :3]) < 0
            np.testing.assert_array_equal(triangles, self.triangles[:, [0, 2, 1]] if mirrored else self.triangles)
            np.testing.assert_allclose(values, self.places[:, 0], rtol=1e-5)

    def test_tractograms(self):
        lines = [self.random.normal(0, 50, (int(count), 3)).astype("f4") for count in self.random.integers(2, 20, 7)]
        shares = [self.random.normal(0, 1, (len(line), 1)).astype("f4") for line in lines]
        tractogram = Tractogram(lines, affine_to_rasmm=np.eye(4), data_per_point={"fa": shares})
        begins = np.cumsum([0] + [len(line) for line in lines])
        TckFile(tractogram).save(f"{self.folder.name}/a.tck")
        places, _, _, found = read(f"{self.folder.name}/a.tck")
        np.testing.assert_array_equal(places, np.concatenate(lines))
        np.testing.assert_array_equal(found, begins)
        for axes in itertools.permutations(("LR", "AP", "SI")):
            for order in itertools.product(*axes):
                affine = np.eye(4)
                affine[:3, :3] = self.random.normal(0, 0.2, (3, 3)) + np.diag([2, -1.5, 1.2])[:, self.random.permutation(3)]
                affine[:3, 3] = self.random.normal(0, 30, 3)
                header = {Field.VOXEL_TO_RASMM: affine, Field.VOXEL_SIZES: np.linalg.norm(affine[:3, :3], axis=0),
                          Field.DIMENSIONS: (91, 109, 83), Field.VOXEL_ORDER: "".join(order)}
                TrkFile(tractogram, header).save(f"{self.folder.name}/a.trk")
                places, _, values, found = read(f"{self.folder.name}/a.trk")
                np.testing.assert_allclose(places, np.concatenate(lines), atol=1e-3, err_msg="".join(order))
                np.testing.assert_array_equal(values, np.concatenate(shares)[:, 0])
                np.testing.assert_array_equal(found, begins)


if __name__ == "__main__":
    unittest.main()
