"""VTK: images and rectilinear grids that VTK writes in every mode, byte order and compressor."""
import itertools
import os

import numpy as np
import pyvista
import vtk

from case import Case, samples, scaled

MODES = ["SetDataModeToAscii", "SetDataModeToBinary", "SetDataModeToAppended"]
COMPRESSORS = [None, vtk.vtkZLibDataCompressor, vtk.vtkLZ4DataCompressor, vtk.vtkLZMADataCompressor]
ORDERS = ["SetByteOrderToLittleEndian", "SetByteOrderToBigEndian"]


def grid_of(random, cells):
    sides = [int(side) for side in random.integers(2, 7, 3)]
    spacing, origin = random.uniform(0.3, 3, 3), random.normal(scale=10, size=3)
    image = pyvista.ImageData(dimensions=[side + cells for side in sides], spacing=spacing, origin=origin)
    voxels = samples(random, sides, random.choice([np.uint8, np.int16, np.float32, np.float64, np.int32]))
    (image.cell_data if cells else image.point_data)["f"] = voxels.ravel("F")
    return image, voxels, scaled(spacing, origin + (spacing / 2 if cells else 0))


def cases(random, folder, count, skipped):
    for number, (mode, compressor, order) in enumerate(itertools.product(MODES, COMPRESSORS, ORDERS)):
        image, voxels, affine = grid_of(random, bool(random.integers(2)))
        for end, grid, writer in ((".vti", image, vtk.vtkXMLImageDataWriter()),
                                  (".vtr", image.cast_to_rectilinear_grid(), vtk.vtkXMLRectilinearGridWriter())):
            path = os.path.join(folder, f"{number}{end}")
            writer.SetFileName(path)
            writer.SetInputData(grid)
            getattr(writer, mode)()
            getattr(writer, order)()
            writer.SetCompressor(compressor() if compressor else None)
            writer.Write()
            yield Case(f"{number}{end} {mode} {compressor and compressor.__name__} {order}", path, voxels, affine)
    for number in range(count):
        image, voxels, affine = grid_of(random, bool(random.integers(2)))
        path = os.path.join(folder, f"legacy{number}.vtk")
        image.save(path, binary=bool(random.integers(2)))
        yield Case(f"legacy {number}", path, voxels, affine, tolerance=1e-5)  # six digits, where it is text
