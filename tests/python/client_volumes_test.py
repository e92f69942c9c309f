"""Volumes of Python programs arrive as they are: values, spacing and orientation."""
from __future__ import annotations

import json
import subprocess
import types
import unittest
import warnings

import numpy as np

from client_support import PROGRAM, InAFolder

import slabstream as ss  # noqa: E402
from slabstream import loading  # noqa: E402
from slabstream.volumes import Grid, grid_of, labels_of, volume_of, write_nrrd  # noqa: E402


def need(name: str):
    """The package, or a skip."""
    try:
        return __import__(name)
    except ImportError:
        raise unittest.SkipTest(f"install python3-{name.partition('.')[0]}") from None


class Chunks:
    """What dask, zarr and h5py have, and how much of it is asked for."""

    def __init__(self, array: np.ndarray, chunks):
        self.array, self.chunks = array, chunks
        self.shape, self.dtype, self.ndim = array.shape, array.dtype, array.ndim
        self.asked: list[tuple[int, int]] = []

    def __getitem__(self, at: slice) -> np.ndarray:
        self.asked.append((at.start, at.stop))
        return self.array[at]

    def __array__(self, *_):
        raise AssertionError("the whole array was asked for")


class Files(InAFolder):
    def written(self, volume, **geometry) -> tuple[np.ndarray, dict]:
        """What slabstream reads: the values of z, y, x, and what it says of them."""
        path = self.folder / "volume.nrrd"
        write_nrrd(volume_of(volume, **geometry), path)
        out = self.folder / "out.npy"
        for command in (["convert", path, out, "--type", "float32"], ["info", "--json", path]):
            done = subprocess.run([PROGRAM, *map(str, command)], capture_output=True, text=True)
            self.assertEqual(done.returncode, 0, done.stderr)
        return np.load(out), json.loads(done.stdout)

    def samples_in_file(self, array, file_type: str) -> np.ndarray:
        write_nrrd(volume_of(array), self.folder / "a.nrrd")
        content = (self.folder / "a.nrrd").read_bytes()
        return np.frombuffer(content[content.index(b"\n\n") + 2 :], file_type).reshape(array.shape)

    def test_types_are_kept_or_converted_exactly(self) -> None:
        values = np.arange(2 * 3 * 4).reshape(2, 3, 4)
        for dtype, file_type in (("bool", "u1"), ("uint8", "u1"), ("int8", "i1"), ("uint16", "<u2"), (">i2", "<i2"), ("int32", "<i4"),
                                 (">u4", "<u4"), ("int64", "<i8"), ("uint64", "<u8"), ("float16", "<f4"), (">f4", "<f4"), ("float64", "<f4")):
            array = values.astype(dtype)
            np.testing.assert_array_equal(self.samples_in_file(array, file_type), array, dtype)
        for array in (np.asfortranarray(values.astype(np.uint8)), values.astype(np.uint8)[::-1, :, ::2]):
            np.testing.assert_array_equal(self.samples_in_file(array, "u1"), array)
        np.testing.assert_array_equal(self.written((values - 12).astype(">i2"))[0], values - 12)
        np.testing.assert_array_equal(self.written(values * 1000.5)[0], values * 1000.5)

    def test_other_arrays_are_refused_by_name(self) -> None:
        for array, sentence in (
            (np.zeros((2, 2, 2), complex), "the array has samples of type complex128"),
            (np.zeros((2, 2, 2), "M8[s]"), "the array has samples of type datetime64"),
            (np.zeros(2), "the array has the shape (2,), must have 3 axes: z, y, x, or 2 of a slice: y, x"),
            (np.zeros((2, 0, 2)), "the array has the shape (2, 0, 2), each side must be in [1, 65535]"),
            ([1, 2, 3], "a list is no volume"),
            (3, "a int is no volume"),
        ):
            with self.subTest(sentence), self.assertRaises(ss.InvalidArgument) as caught:
                write_nrrd(volume_of(array), self.folder / "a.nrrd")
            self.assertTrue(str(caught.exception).startswith(sentence), str(caught.exception))

    def test_values_are_rounded_as_those_of_files_are_with_a_warning(self) -> None:
        for array, sentence in (
            (np.full((2, 2, 2), 0.1), "pictures show the array's values of type float64 rounded to float32; array.astype"),
            (np.array([[[0, 2**24 + 1]]]), "pictures show the array's values of type int64 rounded to float32; values at points and labels are exact"),
            (np.full((2, 2, 2), 2**60 + 1), "pictures show the array's values of type int64 rounded"),
            (np.array([[[0, 1e40, -1e300, np.inf, np.nan]]]), "2 values of the array are beyond those of float32 (3.4e38)"),
        ):
            with self.subTest(sentence), self.assertWarns(ss.SlabstreamWarning) as caught:
                write_nrrd(volume_of(array), self.folder / "a.nrrd")
            self.assertTrue(str(caught.warning).startswith(sentence), str(caught.warning))
            self.assertEqual(caught.filename, __file__)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            for array in (np.full((2, 2, 2), 0.5), np.array([[[0, 2**40]]]), np.array([[[2**30, 2**30 + 1]]]), np.full((2, 2, 2), 0.1, np.float32)):
                write_nrrd(volume_of(array), self.folder / "a.nrrd")

    def test_whole_numbers_are_exact_where_values_are_told(self) -> None:
        write_nrrd(volume_of(np.array([[[2**53 + 1, 0]]])), self.folder / "a.nrrd")
        told = subprocess.run([PROGRAM, "value", self.folder / "a.nrrd", "--local", "--at", "0,0,0"], capture_output=True, text=True).stdout
        self.assertTrue(told.strip().endswith("value 9007199254740993"), told)

    def test_what_is_masked_is_not_shown(self) -> None:
        whole = np.ma.masked_equal(np.arange(8, dtype=np.int16).reshape(2, 2, 2), 3)
        found = self.samples_in_file(whole, "<f4").ravel()
        np.testing.assert_array_equal(found, [0, 1, 2, np.nan, 4, 5, 6, 7])
        np.testing.assert_array_equal(self.samples_in_file(np.ma.array(whole.data), "<i2"), whole.data)  # nothing is masked
        np.testing.assert_array_equal(labels_of(whole).samples.ravel(), [0, 1, 2, 0, 4, 5, 6, 7])
        dask = need("dask.array")
        np.testing.assert_array_equal(self.samples_in_file(dask.array.from_array(whole, chunks=1), "<f4").ravel(), found)

    def test_labels_are_whole_numbers(self) -> None:
        with self.assertRaisesRegex(ss.InvalidArgument, "labels hold 1.5, must be whole numbers"):
            labels_of(np.array([[[1, 1.5]]]))
        self.assertEqual(labels_of(np.array([[[1.0, 2**24 + 1.0]]])).samples.ravel().tolist(), [1, 2**24 + 1])

    def test_tensors_are_taken_if_numpy_can_view_them(self) -> None:
        class Tensor:
            """As torch has it: of a type that numpy does not know."""

            def __init__(self, array: np.ndarray):
                self.array, self.shape = array, array.shape
                self.dtype = types.SimpleNamespace(name="torch.float32")

            def __getitem__(self, at: slice) -> Tensor:
                return Tensor(self.array[at])

        class WithArray(Tensor):
            def __array__(self, dtype=None) -> np.ndarray:
                return self.array

        class WithDlpack(Tensor):
            def __dlpack__(self, **options) -> object:
                return self.array.__dlpack__(**options)

            def __dlpack_device__(self) -> tuple[int, int]:
                return self.array.__dlpack_device__()

        class Elsewhere(Tensor):
            def __array__(self, dtype=None) -> np.ndarray:
                raise TypeError("can't convert cuda:0 device type tensor to numpy.\nUse Tensor.cpu()")

        values = np.arange(8, dtype=np.float32).reshape(2, 2, 2)
        for kind in (WithArray, WithDlpack):
            np.testing.assert_array_equal(self.samples_in_file(kind(values), "<f4"), values)
        with self.assertRaisesRegex(ss.InvalidArgument, "^the array has samples of type .*torch.float32.*, which numpy does not know"):
            volume_of(Tensor(values))
        with self.assertRaisesRegex(ss.InvalidArgument, "^numpy cannot view a client_volumes_test.Elsewhere: can't convert cuda:0|^numpy cannot view a __main__"):
            volume_of(Elsewhere(values))

    def test_torch_arrives(self) -> None:
        torch = need("torch")
        values = np.arange(8, dtype=np.float32).reshape(2, 2, 2)
        np.testing.assert_array_equal(self.samples_in_file(torch.from_numpy(values), "<f4"), values)

    def test_jax_arrives(self) -> None:
        jax = need("jax.numpy")
        values = np.arange(8, dtype=np.float32).reshape(2, 2, 2)
        np.testing.assert_array_equal(self.samples_in_file(jax.numpy.asarray(values), "<f4"), values)

    def test_geometry_is_refused_by_name(self) -> None:
        for given, sentence in (
            ({"spacing": (1, 0, 1)}, "spacing (1, 0, 1) must be above 0 along each axis"),
            ({"spacing": (1, 2)}, "spacing (1, 2) is not three numbers, for z, y and x"),
            ({"spacing": 0}, "spacing 0 must be above 0"),
            ({"origin": (1, 2)}, "origin (1, 2) is not three numbers"),
            ({"origin": (1, 2, float("inf"))}, "origin (1, 2, inf) must be finite"),
            ({"direction": ((1, 0, 0), (0, 0, 0), (0, 0, 1))}, "direction ((1, 0, 0), (0, 0, 0), (0, 0, 1)) has a vector without direction"),
            ({"world": "moon"}, "world 'moon' is not one of voxels, scene, patient"),
        ):
            with self.subTest(given=given), self.assertRaises(ss.InvalidArgument) as caught:
                grid_of(**given)
            self.assertTrue(str(caught.exception).startswith(sentence), str(caught.exception))

    def test_nan_and_infinity_are_float32(self) -> None:
        array = np.ones((2, 2, 2))
        array[0, 0, 0], array[1, 1, 1] = np.nan, np.inf
        write_nrrd(volume_of(array), self.folder / "a.nrrd")

    def test_spacing_is_z_y_x(self) -> None:
        array = np.zeros((2, 3, 4), np.uint8)
        about = self.written(array, spacing=(3, 2, 1.5))[1]
        self.assertEqual((about["size"], about["spacing"]), ([4, 3, 2], [1.5, 2, 3]))

    def test_orientation_is_z_y_x(self) -> None:
        """Axis z of the array runs along x of the world, y along y, x along z."""
        array = np.arange(24, dtype=np.uint8).reshape(2, 3, 4)
        found, about = self.written(array, spacing=(3, 2, 1.5), origin=(30, 20, 10), direction=((0, 0, 1), (0, 1, 0), (1, 0, 0)), world="patient")
        self.assertEqual(about["orientation"]["world"], "patient")
        # slabstream turns volumes so that x, y, z of the voxels run along the world's, or close to it: the centre stays.
        world = self.world_of(about)
        np.testing.assert_allclose(world, [[10, 20, 30], [10 + 3, 20 + 2 * 2, 30 + 3 * 1.5]], atol=1e-9)

    def world_of(self, about: dict) -> np.ndarray:
        """Least and greatest corner, of voxels' centres."""
        orientation = about["orientation"]
        size, spacing = np.array(about["size"]), np.array(about["spacing"])
        axes = np.array(orientation["axes"])
        corners = [np.array(orientation["origin"]) + (np.array(c) * (size - 1) * spacing) @ axes for c in np.ndindex(2, 2, 2)]
        return np.array([np.min(corners, 0), np.max(corners, 0)])

    def test_arrays_are_written_by_chunks(self) -> None:
        array = np.arange(7 * 1200 * 1000, dtype=np.uint32).reshape(7, 1200, 1000) % 251
        for chunks, asked in (((2, 600, 1000), [(0, 2), (2, 4), (4, 6), (6, 7)]), (((1, 3, 3), (1200,), (1000,)), [(0, 4), (4, 7)]),
                              (None, [(0, 3), (3, 6), (6, 7)])):
            with self.subTest(chunks=chunks):
                lazy = Chunks(array, chunks)
                np.testing.assert_array_equal(self.samples_in_file(lazy, "<u4"), array)
                self.assertEqual(lazy.asked, asked)

    def test_xarray_coordinates_give_spacing_and_place(self) -> None:
        xarray = need("xarray")
        values = np.arange(24, dtype=np.uint8).reshape(2, 3, 4)
        array = xarray.DataArray(values, dims=("z", "y", "x"), coords={"z": [5, 8], "y": [3, 1, -1], "x": [0, 0.5, 1, 1.5]})
        found, about = self.written(array)
        self.assertEqual(about["spacing"], [0.5, 2, 3])
        np.testing.assert_allclose(self.world_of(about), [[0, -1, 5], [1.5, 3, 8]])
        np.testing.assert_array_equal(self.written(array.transpose("x", "z", "y"))[0], found)
        np.testing.assert_array_equal(self.written(xarray.DataArray(values))[0], values)
        np.testing.assert_array_equal(self.written(array, spacing=(1, 1, 1))[0], values)  # whatever is given says more
        with self.assertRaisesRegex(ss.InvalidArgument, "the coordinates of 'x' do not lie evenly"):
            volume_of(xarray.DataArray(values, dims=("z", "y", "x"), coords={"x": [0, 1, 2, 4]}))
        volume_of(xarray.DataArray(values, dims=("z", "y", "x"), coords={"x": [0, 1, 2, 4]}), spacing=1)

    def test_an_xarray_gives_its_dataset_its_name(self) -> None:
        array = need("xarray").DataArray(np.zeros((2, 3, 4), np.uint8), name="sea ice")
        self.assertRegex(loading._name_of(array, None), r"^sea-ice(-\d+)?$")

    def test_axes_of_xarray_are_known_by_name(self) -> None:
        xarray = need("xarray")
        values = np.arange(24, dtype=np.uint8).reshape(2, 3, 4)  # z, y, x
        places = {"z": [5, 8], "y": [3, 1, -1], "x": [0, 0.5, 1, 1.5]}
        for z, y, x in (("Z", "Y", "X"), ("height", "latitude", "longitude"), ("level", "lat", "lon")):
            with self.subTest(z):
                array = xarray.DataArray(values, dims=(z, y, x), coords=dict(zip((z, y, x), places.values()))).transpose(x, y, z)
                volume = volume_of(array)
                np.testing.assert_array_equal(volume.samples, values)
                self.assertEqual(volume.grid, Grid(((0.5, 0, 0), (0, -2, 0), (0, 0, 3)), (0, 3, 5), "scene"))
        named = xarray.DataArray(values, dims=("a", "b", "c"), coords={"c": ("c", [0, 1, 2, 3], {"axis": "X"}), "b": ("b", [0, 1, 2], {"axis": "Y"}),
                                                                      "a": ("a", [0, 1], {"axis": "Z"})})
        np.testing.assert_array_equal(volume_of(named.transpose("c", "b", "a")).samples, values)

    def test_depth_is_downwards(self) -> None:
        xarray = need("xarray")
        ocean = xarray.DataArray(np.zeros((4, 3, 2), np.uint8), dims=("lon", "lat", "depth"), coords={"depth": [10, 15]})
        self.assertEqual(volume_of(ocean).grid, Grid(((1, 0, 0), (0, 1, 0), (0, 0, -5)), (0, 0, -10), "scene"))

    def test_the_first_time_is_taken_with_a_warning(self) -> None:
        xarray = need("xarray")
        values = np.arange(48, dtype=np.uint8).reshape(2, 2, 3, 4)
        with self.assertWarnsRegex(ss.SlabstreamWarning, r"^the DataArray has 2 of 'time': the first is taken; array.isel\(time=...\) chooses another one$"):
            volume = volume_of(xarray.DataArray(values, dims=("time", "z", "y", "x")))
        np.testing.assert_array_equal(volume.samples, values[0])
        maps = xarray.DataArray(values[0], dims=("time", "lat", "lon"), coords={"time": np.array(["2026-01-01", "2026-02-01"], "M8[ns]"), "lon": [0, 2, 4, 6]})
        self.assertEqual(volume_of(maps).grid.steps, ((2, 0, 0), (0, 1, 0), (0, 0, 1)))
        with self.assertRaisesRegex(ss.InvalidArgument, "the DataArray has the axes dim_0, dim_1, dim_2, dim_3, must have 3"):
            volume_of(xarray.DataArray(values))

    def test_dask_arrives(self) -> None:
        dask, values = need("dask.array"), np.arange(6 * 5 * 4, dtype=np.uint16).reshape(6, 5, 4)
        np.testing.assert_array_equal(self.written(dask.array.from_array(values, chunks=(4, 2, 4)))[0], values)

    def test_zarr_arrives(self) -> None:
        zarr, values = need("zarr"), np.arange(6 * 5 * 4, dtype=np.uint16).reshape(6, 5, 4)
        np.testing.assert_array_equal(self.written(zarr.array(values, chunks=(4, 2, 4)))[0], values)

    def test_nibabel_images_keep_their_orientation(self) -> None:
        nibabel = need("nibabel")
        values = np.arange(24, dtype=np.int16).reshape(4, 3, 2)  # x, y, z
        affine = np.array([[0, 2, 0, -5], [1.5, 0, 0, 7], [0, 0, -3, 9], [0, 0, 0, 1]], float)
        image = nibabel.Nifti1Image(values, affine)
        found, about = self.written(image)
        nibabel.save(image, self.folder / "same.nii")
        done = subprocess.run([PROGRAM, "info", "--json", self.folder / "same.nii"], capture_output=True, text=True)
        expected = json.loads(done.stdout)
        self.assertEqual({key: about[key] for key in ("size", "spacing", "orientation")},
                         {key: expected[key] for key in ("size", "spacing", "orientation")})
        subprocess.run([PROGRAM, "convert", self.folder / "same.nii", self.folder / "same.npy", "--type", "float32"], check=True,
                       capture_output=True)
        np.testing.assert_array_equal(found, np.load(self.folder / "same.npy"))

    def dicom_slice(self, pixels: np.ndarray, **fields):
        try:
            from pydicom.dataset import Dataset, FileMetaDataset
            from pydicom.uid import ExplicitVRLittleEndian
        except ImportError:
            return types.SimpleNamespace(Rows=2, PixelData=b"", pixel_array=pixels, **fields)
        one = Dataset()
        one.file_meta = FileMetaDataset()
        one.file_meta.TransferSyntaxUID = ExplicitVRLittleEndian
        one.Rows, one.Columns = pixels.shape
        one.BitsAllocated, one.BitsStored, one.HighBit, one.PixelRepresentation, one.SamplesPerPixel = 16, 16, 15, 1, 1
        one.PhotometricInterpretation, one.PixelData = "MONOCHROME2", pixels.tobytes()
        for name, value in fields.items():
            setattr(one, name, value)
        return one

    def test_dicom_slices_keep_their_orientation(self) -> None:
        """Sagittal slices, in disorder; z of the array is from the patient's right to the left."""
        pixels = np.arange(3 * 2 * 4, dtype=np.int16).reshape(3, 2, 4)
        slices = [
            self.dicom_slice(pixels[i], ImageOrientationPatient=[0, 1, 0, 0, 0, -1], ImagePositionPatient=[10 - 2 * i, 20, 30],
                             PixelSpacing=["1.5", "0.5"], RescaleSlope="1", RescaleIntercept="-1000")
            for i in (2, 0, 1)
        ]
        found, about = self.written(slices)
        self.assertEqual(about["orientation"]["world"], "patient")
        self.assertEqual((found.min(), found.max()), (-1000, -1000 + 23))
        # To the left is +10 - 2 i of DICOM, whose x is to the left: to the right -10 ... -6. Columns go to posterior, rows down.
        np.testing.assert_allclose(self.world_of(about), [[-10, -20 - 3 * 0.5, 30 - 1.5], [-6, -20, 30]], atol=1e-9)
        with self.assertRaisesRegex(ss.InvalidArgument, "a DICOM dataset lacks PixelSpacing"):
            volume_of([types.SimpleNamespace(Rows=1, PixelData=b"", pixel_array=pixels[0], ImageOrientationPatient=[], ImagePositionPatient=[])])
        slices[0].ImagePositionPatient = [3, 20, 30]
        with self.assertRaisesRegex(ss.InvalidArgument, "the positions of the slices do not lie evenly"):
            volume_of(slices)


if __name__ == "__main__":
    unittest.main()
