"""VTK: images and rectilinear grids that VTK writes in every mode, byte order and compressor; grids of cells in one piece and in several."""
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


def grids(random, folder):
    """Curvilinear and unstructured grids of cubes, with a linear field. The lattice has a voxel for each cell."""
    cells = random.integers(4, 9, 3)
    source, points, field, unstructured = vtk.vtkRTAnalyticSource(), vtk.vtkImageDataToPointSet(), vtk.vtkElevationFilter(), vtk.vtkAppendFilter()
    source.SetWholeExtent(0, cells[0], 0, cells[1], 0, cells[2])
    points.SetInputConnection(source.GetOutputPort())
    high = random.uniform(1, 2, 3) * cells
    field.SetHighPoint(high)  # from 0 at the origin to 1 there, which lies outside
    field.SetInputConnection(points.GetOutputPort())
    unstructured.SetInputConnection(field.GetOutputPort())
    centres = np.moveaxis(np.indices(cells), 0, -1) + 0.5
    voxels = (centres @ high / (high @ high)).astype(np.float32)
    blocks, block = vtk.vtkMultiBlockDataSet(), vtk.vtkUnstructuredGrid()
    unstructured.Update()
    block.DeepCopy(unstructured.GetOutput())  # which the writers of pieces make anew
    blocks.SetBlock(0, block)
    for mode, (end, writer, port) in itertools.product(MODES + [None], (
            (".vts", vtk.vtkXMLStructuredGridWriter, field), (".pvts", vtk.vtkXMLPStructuredGridWriter, field),
            (".vtu", vtk.vtkXMLUnstructuredGridWriter, unstructured), (".pvtu", vtk.vtkXMLPUnstructuredGridWriter, unstructured),
            (".vtm", vtk.vtkXMLMultiBlockDataWriter, None), (".vtk", vtk.vtkStructuredGridWriter, field),
            (".vtkhdf", vtk.vtkHDFWriter, None), (".vtkhdf", vtk.vtkHDFWriter, unstructured),
            (".vtk", vtk.vtkUnstructuredGridWriter, unstructured))):
        writer, modeless = writer(), end in (".vtk", ".vtkhdf")
        if modeless != (mode is None):
            continue
        path = os.path.join(folder, f"{writer.GetClassName()}{mode or ''}{'' if port else 'Blocks'}{end}")
        writer.SetFileName(path)
        if port:
            writer.SetInputConnection(port.GetOutputPort())
        else:
            writer.SetInputData(blocks)
        if not modeless:
            getattr(writer, mode)()
        if end.startswith(".p"):
            writer.SetNumberOfPieces(4)
            writer.SetStartPiece(0)
            writer.SetEndPiece(3)
            writer.SetGhostLevel(1)
        writer.Write()
        yield Case(os.path.basename(path), path, voxels, scaled((1, 1, 1), (0.5, 0.5, 0.5)), f"lattice={max(cells)},{'dataset' if end == '.vtkhdf' else 'array'}=Elevation", tolerance=2e-5)


def image_blocks(random, folder, number):
    """An image cut in two along each of some axes: blocks of images, or of rectilinear grids, each with extents of its own, as VTK lists them."""
    cells, rectilinear = bool(random.integers(2)), bool(random.integers(2))
    image, voxels, affine = grid_of(random, cells)
    points = np.array(image.dimensions)
    cuts = [sorted({0, int(random.integers(0, side)), int(side) - 1}) for side in points]
    blocks = pyvista.MultiBlock()
    for box in itertools.product(*([*zip(at[:-1], at[1:])] for at in cuts)):
        extract = vtk.vtkExtractVOI()
        extract.SetInputData(image)
        extract.SetVOI([end for ends in box for end in ends])
        extract.Update()
        block = pyvista.wrap(extract.GetOutput())
        blocks.append(block.cast_to_rectilinear_grid() if rectilinear else block)
    path = os.path.join(folder, f"blocks{number}.vtm")
    blocks.save(path)
    return Case(f"blocks {number}", path, voxels, affine, tolerance=1e-5)


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
    for number in range(count):
        yield image_blocks(random, folder, number)
    yield from grids(random, folder)
