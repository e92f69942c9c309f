"""Shapes in files that VTK writes: what read_shape reads of them is what VTK has."""
from __future__ import annotations

import itertools
import json
import os
import pathlib
import subprocess
import tempfile
import unittest

import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkPoints, vtkStringArray
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData
from vtkmodules.vtkIOGeometry import vtkOBJWriter, vtkSTLWriter
from vtkmodules.vtkIOLegacy import vtkPolyDataWriter
from vtkmodules.vtkIOPLY import vtkPLYWriter
from vtkmodules.vtkIOXML import vtkXMLPolyDataWriter

READ = pathlib.Path(os.environ["SLABSTREAM_TESTS"], "read_shape")
LPS = np.array([-1, -1, 1])


class Shape:
    def __init__(self, path):
        with tempfile.TemporaryDirectory() as folder:
            answer = json.loads(subprocess.run([READ, path, f"{folder}/shape"], check=True, stdout=subprocess.PIPE).stdout)
            if "error" in answer:
                raise ValueError(answer["error"])
            self.kind = answer["kind"]
            for name, dtype, columns in (("positions", "f8", 3), ("normals", "f4", 3), ("colors", "u1", 4), ("values", "f4", 1),
                                         ("radii", "f4", 1), ("triangles", "u4", 3), ("lines", "u4", 1)):
                numbers = np.fromfile(f"{folder}/shape.{name}", dtype)
                setattr(self, name, numbers.reshape(-1, columns) if columns > 1 else numbers)


def cells(lists):
    array = vtkCellArray()
    array.SetCells(len(lists), numpy_to_vtkIdTypeArray(np.concatenate([[len(each), *each] for each in lists]).astype(np.int64), deep=True))
    return array


def polydata(random, kind, dtype):
    """And its places, colours and scalars by vertex, and what its cells are."""
    count = int(random.integers(5, 400))
    places = (random.normal(0, 50, (count, 3)) + (1e6 if dtype == np.float64 else 0)).astype(dtype)
    normals = random.normal(0, 1, (count, 3))
    normals = (normals / np.linalg.norm(normals, axis=1)[:, np.newaxis]).astype(np.float32)
    colors = random.integers(0, 256, (count, 3), dtype=np.uint8)
    scalars = random.normal(0, 1, count).astype(random.choice([np.float32, np.float64]))
    data = vtkPolyData()
    points = vtkPoints()
    points.SetData(numpy_to_vtk(places, deep=True))
    data.SetPoints(points)
    lists = [random.integers(0, count, int(random.integers(3, 7) if kind != "vertices" else 1)) for _ in range(int(random.integers(1, 200)))]
    {"polygons": data.SetPolys, "strips": data.SetStrips, "lines": data.SetLines, "vertices": data.SetVerts}[kind](cells(lists))
    arrays = data.GetPointData()
    for name, numbers in (("first", scalars + 1), ("chosen", scalars), ("tint", colors), ("Normals", normals)):
        array = numpy_to_vtk(numbers, deep=True)
        array.SetName(name)
        arrays.AddArray(array)
    arrays.SetActiveScalars("chosen")
    arrays.SetActiveNormals("Normals")
    return data, places, normals, colors, scalars, lists


def triangles_of(kind, lists):
    if kind == "strips":
        return [(c[i - 2], c[i - 1 + i % 2], c[i - i % 2]) for c in lists for i in range(2, len(c))]
    return [(c[0], c[i - 1], c[i]) for c in lists for i in range(2, len(c))]


class OfVtk(unittest.TestCase):
    def compare(self, path, kind, places, normals, colors, scalars, lists, tolerance=0.0):
        shape = Shape(path)
        close = lambda a, b, limit: self.assertTrue(a.shape == b.shape and np.abs(a - b).max(initial=0) <= limit, path)
        at = np.arange(len(places)) if kind in ("polygons", "strips") else np.concatenate(lists)
        self.assertEqual(shape.kind, {"polygons": "mesh", "strips": "mesh", "lines": "lines", "vertices": "points"}[kind])
        # A place has its digits from the first one on.
        extent = np.abs(places - places[at[0]]).max()
        close(shape.positions, places[at].astype(float), tolerance + extent * 2**-23 * (places.dtype == np.float64))
        close(shape.colors[:, :3], colors[at], 0)
        close(shape.values, scalars[at].astype(np.float32), tolerance)
        if kind in ("polygons", "strips"):
            close(shape.normals, normals, 1e-6 + tolerance)
            self.assertTrue(np.array_equal(shape.triangles, triangles_of(kind, lists)), path)
        if kind == "lines":
            self.assertTrue(np.array_equal(shape.lines, np.cumsum([0] + [len(each) for each in lists])), path)

    def test_polydata(self):
        random = np.random.default_rng(7)
        with tempfile.TemporaryDirectory() as folder:
            for kind, dtype, lps in itertools.product(("polygons", "strips", "lines", "vertices"), (np.float32, np.float64), (False, True)):
                data, places, normals, *rest = polydata(random, kind, dtype)
                sign = LPS if lps else 1
                world = ((places * sign).astype(dtype), normals * sign, *rest)
                for version, binary in itertools.product((42, 51), (False, True)):
                    writer = vtkPolyDataWriter()
                    writer.SetInputData(data)
                    writer.SetFileVersion(version)
                    writer.SetFileType(1 + binary)
                    writer.SetHeader(f"SPACE={'LPS' if lps else 'RAS'}")
                    writer.SetFileName(f"{folder}/{kind}_{version}_{binary}.vtk")
                    writer.Write()
                    # A text has about six digits, also of doubles.
                    self.compare(writer.GetFileName(), kind, *world, tolerance=0 if binary else 2e-5 * np.abs(places).max())
                space = vtkStringArray()
                space.SetName("SPACE")
                space.InsertNextValue("LPS" if lps else "RAS")
                data.GetFieldData().AddArray(space)
                modes = ("Ascii", "Binary", "Appended")
                for mode, packed, big_endian, wide, raw in itertools.product(modes, ("None", "ZLib", "LZ4", "LZMA"), (0, 1), (0, 1), (0, 1)):
                    if random.random() < 0.8:
                        continue
                    writer = vtkXMLPolyDataWriter()
                    writer.SetInputData(data)
                    getattr(writer, f"SetDataModeTo{mode}")()
                    getattr(writer, f"SetCompressorTypeTo{packed}")()
                    writer.SetByteOrder(0 if big_endian else 1)
                    writer.SetHeaderType(64 if wide else 32)
                    writer.SetEncodeAppendedData(1 - raw)
                    writer.SetFileName(f"{folder}/{kind}_{mode}_{packed}_{big_endian}_{wide}_{raw}.vtp")
                    writer.Write()
                    self.compare(writer.GetFileName(), kind, *world)

    def test_meshes_of_triangles(self):
        random = np.random.default_rng(8)
        with tempfile.TemporaryDirectory() as folder:
            for number in range(6):
                data, places, normals, colors, scalars, _ = polydata(random, "polygons", np.float32)
                lists = [random.permutation(len(places))[:3] for _ in range(300)]
                data.SetPolys(cells(lists))
                data.GetPointData().RemoveArray("first")
                for binary in (False, True):
                    writer = vtkPLYWriter()
                    writer.SetFileType(2 if binary else 1)
                    writer.SetDataByteOrder(number % 2)
                    writer.SetArrayName("tint")
                    writer.SetInputData(data)
                    writer.SetFileName(f"{folder}/{number}_{binary}.ply")
                    writer.Write()
                    shape = Shape(writer.GetFileName())
                    np.testing.assert_allclose(shape.positions, places, rtol=0 if binary else 1e-5)
                    written = normals if b" nx\n" in pathlib.Path(writer.GetFileName()).read_bytes() else np.empty((0, 3))  # not by VTK 9.1
                    np.testing.assert_allclose(shape.normals, written, atol=1e-6 if binary else 1e-4)
                    np.testing.assert_array_equal(shape.colors[:, :3], colors)
                    np.testing.assert_array_equal(shape.triangles, lists)
                    writer = vtkSTLWriter()
                    writer.SetFileType(2 if binary else 1)
                    writer.SetHeader("3D Slicer output. SPACE=LPS" if number % 2 else "3D Slicer output")
                    writer.SetInputData(data)
                    writer.SetFileName(f"{folder}/{number}_{binary}.stl")
                    writer.Write()
                    shape = Shape(writer.GetFileName())
                    self.assertLessEqual(len(shape.positions), len(places))  # corners are merged
                    expected = places[lists] * (LPS if number % 2 else 1)
                    np.testing.assert_allclose(shape.positions[shape.triangles], expected, rtol=0 if binary else 1e-5)
                writer = vtkOBJWriter()
                writer.SetInputData(data)
                writer.SetFileName(f"{folder}/{number}.obj")
                writer.Write()
                shape = Shape(writer.GetFileName())
                np.testing.assert_allclose(shape.positions[shape.triangles], places[lists], atol=2e-5 * np.abs(places).max())
                np.testing.assert_allclose(shape.normals[shape.triangles], normals[lists], atol=1e-4)


if __name__ == "__main__":
    unittest.main()
