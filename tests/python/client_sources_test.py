"""Volumes in files with levels: what open() tells, what is read of them, and pictures of their levels."""
from __future__ import annotations

import subprocess
import unittest

import numpy as np

from client_support import PROGRAM, InAFolder

import slabstream as ss  # noqa: E402


class Sources(InAFolder):
    def setUp(self) -> None:
        super().setUp()
        self.array = np.random.default_rng(7).integers(0, 4000, (40, 70, 90), np.int16)
        volume, self.path = self.folder / "a.npy", self.folder / "a.ome.zarr"
        np.save(volume, self.array)
        done = subprocess.run([PROGRAM, "convert", f"{volume}?spacing=1,1,2", self.path], capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)

    def test_open_tells_levels_channels_and_times(self) -> None:
        source = ss.open(self.path)
        self.assertEqual([level.shape for level in source.levels][0], (40, 70, 90))
        self.assertGreater(len(source.levels), 1)
        self.assertEqual(source.levels[0].spacing, (2, 1, 1))
        self.assertEqual(source.levels[0].dtype, np.int16)
        for finer, coarser in zip(source.levels, source.levels[1:]):
            self.assertLess(coarser.size, finer.size)
            for axis in range(3):  # it covers the same part of the world
                self.assertAlmostEqual(coarser.spacing[axis] * coarser.shape[axis], finer.spacing[axis] * finer.shape[axis], delta=coarser.spacing[axis])
        self.assertEqual((source.channels, source.times), ((), 1))
        self.assertIn("OME-Zarr", source.format)
        self.assertIn("levels", repr(source))

    def test_boxes_are_read_as_arrays(self) -> None:
        source = ss.open(self.path)
        np.testing.assert_array_equal(source.read(0, ((3, 9), (None, 8), (80, None))), self.array[3:9, :8, 80:])
        level = source.levels[0]
        np.testing.assert_array_equal(level[5], self.array[5])
        np.testing.assert_array_equal(level[-3:, ::2, 10], self.array[-3:, ::2, 10])
        np.testing.assert_array_equal(level[..., 4:7], self.array[..., 4:7])
        np.testing.assert_array_equal(level[9:3:-2, 1:2, ::-1], self.array[9:3:-2, 1:2, ::-1])
        self.assertEqual(level[4:4].shape, (0, 70, 90))
        np.testing.assert_array_equal(level, self.array)
        coarse = source.levels[1]
        self.assertEqual(np.asarray(coarse).shape, coarse.shape)
        self.assertAlmostEqual(float(np.mean(coarse)), float(self.array.mean()), delta=20)  # means of voxels
        with self.assertRaises(IndexError):
            level[40]

    def test_files_of_one_level_are_sources_too(self) -> None:
        source = ss.open(f"{self.folder}/a.npy?spacing=1,1,2")
        self.assertEqual([level.shape for level in source.levels], [(40, 70, 90)])
        np.testing.assert_array_equal(source.levels[0][7:9, 3], self.array[7:9, 3])

    def test_what_is_wrong_is_said_in_one_line(self) -> None:
        source = ss.open(self.path)
        for level, box, said in ((9, None, "has levels 0 to"), (0, ((0, 41), (0, 1), (0, 1)), "z from 0 to 41"), (0, ((0, 1),), "along z, y and x")):
            with self.assertRaises(ss.InvalidArgument) as refused:
                source.read(level, box)
            self.assertIn(said, str(refused.exception))
            self.assertNotIn("\n", str(refused.exception))
        with self.assertRaises(ss.NotFound):
            ss.open(self.folder / "none.ome.zarr")

    def test_pictures_of_levels(self) -> None:
        look = {"size": 48, "renderer": "raycast"}
        coarse, fine = ss.render(self.path, **look), ss.render(self.path, level=0, **look)
        self.assertEqual(fine.statistics.levels, (0,))
        self.assertGreater(coarse.statistics.levels[0], 0)
        self.assertEqual(ss.render(self.path, detail=0.1, **look).statistics.levels, (0,))
        self.assertGreater(fine.statistics.voxel_bytes, 0)
        self.assertGreater(fine.statistics.stored_bytes, 0)
        self.assertTrue((np.asarray(coarse) != np.asarray(fine)).any())
        level = ss.open(self.path).levels[0]
        same = ss.render(level, spacing=level.spacing, **look)
        np.testing.assert_allclose(same.rgba, fine.rgba, atol=2e-3)

    def test_datasets_tell_their_levels(self) -> None:
        with ss.load(self.path) as volume:
            volume.render(size=16)
            entry = next(each for each in volume.service.datasets() if each.name == volume.name)
        self.assertEqual([level.shape for level in entry.levels], [level.shape for level in ss.open(self.path).levels])


if __name__ == "__main__":
    unittest.main()
