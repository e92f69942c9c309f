#!/usr/bin/env python3
"""Images of VTK, PyVista, ITK and SimpleITK are the volumes that they say, where they say (deploy/check napari)."""
from __future__ import annotations

import os
import pathlib
import sys
import unittest

import itk
import numpy as np
import pyvista
import SimpleITK as sitk
import vtkmodules.all as vtk
from vtkmodules.util.numpy_support import numpy_to_vtk

ROOT = pathlib.Path(__file__).resolve().parents[2]
os.environ.setdefault("SLABSTREAM_PROGRAMS", str(ROOT / "build" / "bin"))
sys.path.insert(0, str(ROOT / "python"))

import slabstream as ss  # noqa: E402
from slabstream.volumes import volume_of  # noqa: E402

# Axes of a slanted right-handed frame, as columns, and samples without symmetry: z, y, x.
TURN = np.array([[0.8, -0.6, 0.0], [0.6, 0.8, 0.0], [0.0, 0.0, 1.0]])
SPACING, ORIGIN = (0.5, 1.5, 2.0), (10.0, -20.0, 30.0)
SAMPLES = np.arange(3 * 4 * 5, dtype=np.int16).reshape(3, 4, 5)


def at(volume, index):
    """The point, x, y, z, of the voxel with this index, x, y, z."""
    return np.array(volume.grid.origin) + np.array(volume.grid.steps).T @ index


class Volumes(unittest.TestCase):
    def test_points_of_vtk(self):
        image = vtk.vtkImageData()
        image.SetExtent(2, 6, 0, 3, 0, 2)  # the origin is that of number 0, which is not in it
        image.SetSpacing(SPACING)
        image.SetOrigin(ORIGIN)
        image.SetDirectionMatrix(*TURN.ravel())
        image.GetPointData().SetScalars(numpy_to_vtk(SAMPLES.ravel()))
        volume = volume_of(image)
        np.testing.assert_array_equal(volume.samples, SAMPLES)
        self.assertEqual((volume.samples.dtype, volume.grid.world), (np.int16, "scene"))
        for index in ((0, 0, 0), (4, 0, 0), (1, 3, 2)):
            number = image.FindPoint(at(volume, index))
            self.assertEqual(image.GetPointData().GetScalars().GetValue(number), SAMPLES[index[::-1]])
            np.testing.assert_allclose(image.GetPoint(number), at(volume, index))

    def test_cells_of_pyvista(self):
        image = pyvista.ImageData(dimensions=(6, 5, 4), spacing=SPACING, origin=ORIGIN)
        image.cell_data["density"] = SAMPLES.ravel()
        volume = volume_of(image)
        np.testing.assert_array_equal(volume.samples, SAMPLES)
        np.testing.assert_allclose(at(volume, (1, 2, 1)), image.extract_cells(1 + 2 * 5 + 20).center)

    def test_what_has_no_values_is_refused(self):
        image = pyvista.ImageData(dimensions=(6, 5, 4))
        with self.assertRaisesRegex(ss.InvalidArgument, "no active scalars"):
            volume_of(image)
        image.point_data["flow"] = np.zeros((120, 3), np.float32)
        image.set_active_scalars("flow")
        with self.assertRaisesRegex(ss.InvalidArgument, "3 components, must have 1"):
            volume_of(image)

    def test_itk_and_simple_itk(self):
        simple = sitk.GetImageFromArray(SAMPLES)
        of_itk = itk.image_from_array(SAMPLES)
        simple.SetDirection(TURN.ravel().tolist())
        of_itk.SetDirection(TURN)
        for image in (simple, of_itk):
            image.SetSpacing(SPACING)
            image.SetOrigin(ORIGIN)
            volume = volume_of(image)
            np.testing.assert_array_equal(volume.samples, SAMPLES)
            self.assertEqual(volume.grid.world, "patient")
            for index in ((0, 0, 0), (4, 0, 0), (1, 3, 2)):
                left, posterior, superior = simple.TransformIndexToPhysicalPoint(index)
                np.testing.assert_allclose(at(volume, index), (-left, -posterior, superior))
        with self.assertRaisesRegex(ss.InvalidArgument, "has 2 dimensions, must have 3"):
            volume_of(simple[:, :, 0])

    def test_a_service_finds_the_voxels_there(self):
        image = sitk.GetImageFromArray(SAMPLES)
        image.SetSpacing(SPACING)
        image.SetOrigin(ORIGIN)
        with ss.load(image) as loaded:
            left, posterior, superior = image.TransformIndexToPhysicalPoint((1, 3, 2))
            self.assertEqual(loaded.service.value(loaded.name, (-left, -posterior, superior)).value, SAMPLES[2, 3, 1])


if __name__ == "__main__":
    unittest.main()
