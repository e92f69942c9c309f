"""Surfaces beside those of VTK's flying edges: the same vertices, as many triangles, the same area but for how faces are cut into triangles."""
from __future__ import annotations

import os
import pathlib
import subprocess
import tempfile
import unittest

import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonDataModel import vtkImageData
from vtkmodules.vtkFiltersCore import vtkFlyingEdges3D, vtkMassProperties

PROGRAM = pathlib.Path(os.environ["SLABSTREAM_PROGRAMS"], "slabstream")


def flying_edges(values, spacing, isovalue):
    image = vtkImageData()
    image.SetDimensions(*values.shape[::-1])
    image.SetSpacing(*spacing)
    image.GetPointData().SetScalars(numpy_to_vtk(values.ravel(), deep=True))
    surface = vtkFlyingEdges3D()
    surface.SetInputData(image)
    surface.SetValue(0, isovalue)
    surface.Update()
    mass = vtkMassProperties()
    mass.SetInputConnection(surface.GetOutputPort())
    mesh = surface.GetOutput()
    return vtk_to_numpy(mesh.GetPoints().GetData()), vtk_to_numpy(mesh.GetPointData().GetNormals()), mesh.GetNumberOfPolys(), mass.GetSurfaceArea()


def isosurface(values, spacing, isovalue):
    with tempfile.TemporaryDirectory() as folder:
        np.save(f"{folder}/v.npy", values)
        subprocess.run([PROGRAM, "isosurface", f"{folder}/v.npy", "--spacing", ",".join(map(str, spacing)), "--isovalue", str(isovalue), "-o",
                        f"{folder}/v.ply"], check=True, stdout=subprocess.DEVNULL)
        data = pathlib.Path(folder, "v.ply").read_bytes()
    end = data.index(b"end_header\n") + 11
    vertices, triangles = (int(data.split(b"element %s " % name)[1].split(b"\n")[0]) for name in (b"vertex", b"face"))
    points = np.frombuffer(data, "<f4", 6 * vertices, end).reshape(-1, 6)
    corners = points[np.frombuffer(data, np.dtype([("count", "u1"), ("of", "<i4", 3)]), triangles, end + 24 * vertices)["of"], :3].astype(float)
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum() / 2
    return points[:, :3], points[:, 3:], triangles, area


class FlyingEdges(unittest.TestCase):
    def test_surfaces_agree(self):
        random = np.random.default_rng(4)
        z, y, x = np.meshgrid(*(np.arange(n) for n in (30, 41, 52)), indexing="ij")
        smooth = (np.sin(x / 5) + np.sin(y / 4 + 1) + np.cos(z / 6) + 0.01 * random.random(x.shape)).astype(np.float32)
        for values, isovalue in ((smooth, 0.3), ((smooth * 40 + 128).astype(np.uint8), 140.5), ((smooth * 4000 + 20000).astype(np.int16), 19000.5)):
            spacing = (0.7, 1.0, 2.5)
            points, normals, triangles, area = isosurface(values, spacing, isovalue)
            theirs, their_normals, their_triangles, their_area = flying_edges(values, spacing, isovalue)
            self.assertEqual(len(points), len(theirs))
            self.assertEqual(triangles, their_triangles)
            self.assertLess(abs(area / their_area - 1), 1e-3)
            for place, normal in list(zip(theirs, their_normals))[:: len(theirs) // 300]:
                nearest = np.argmin(((points - place) ** 2).sum(1))
                self.assertLess(np.abs(points[nearest] - place).max(), 2.5 / 1024 + 1e-4)  # vertices keep their distance from voxels
                self.assertGreater(normals[nearest] @ normal, 0.99)


if __name__ == "__main__":
    unittest.main()
