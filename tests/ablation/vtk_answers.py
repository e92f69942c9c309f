"""What VTK makes of images and grids of cells, as answers: grids at the voxels of the lattice that docs/grids.md describes."""
import numpy as np
import vtk
from vtk.util.numpy_support import numpy_to_vtk, vtk_to_numpy

from ablation import Answer

NOT_DRAWN = {"cells": 1 | 8 | 32, "points": 2}  # bits of vtkGhostType


def image_answer(times, name, components=1):
    """Of vtkImageData for each time: values of points, or of cells in their centres."""
    fields, affine = {}, None
    for number, image in enumerate(times):
        size = np.array(image.GetDimensions())
        array = image.GetPointData().GetArray(name)
        matrix = image.GetIndexToPhysicalMatrix()
        affine = np.array([[matrix.GetElement(i, j) for j in range(4)] for i in range(4)])
        low = np.array(image.GetExtent()[::2], float)
        if array is None:
            array = image.GetCellData().GetArray(name)
            low, size = low + np.where(size > 1, 0.5, 0), np.maximum(size - 1, 1)
        affine[:, 3] = affine @ [*low, 1]
        values = vtk_to_numpy(array).astype(float).reshape(*size[::-1], -1)
        for component in range(components):
            fields[number, component] = values[..., component].T
    return Answer(fields=fields, affine=affine)


def drawn(grid):
    """Without cells that are copies, or hidden, or have a hidden point."""
    keep = np.ones(grid.GetNumberOfCells(), bool)
    marks = grid.GetCellData().GetArray("vtkGhostType")
    if marks is not None:
        keep &= (vtk_to_numpy(marks) & NOT_DRAWN["cells"]) == 0
    marks = grid.GetPointData().GetArray("vtkGhostType")
    if marks is not None:
        hidden = (vtk_to_numpy(marks) & NOT_DRAWN["points"]) != 0
        ids = vtk.vtkIdList()
        for cell in range(grid.GetNumberOfCells()):
            grid.GetCellPoints(cell, ids)
            keep[cell] &= not any(hidden[ids.GetId(i)] for i in range(ids.GetNumberOfIds()))
    made = vtk.vtkUnstructuredGrid()
    made.DeepCopy(grid)
    for data in (made.GetCellData(), made.GetPointData()):
        data.RemoveArray("vtkGhostType")
    extract = vtk.vtkExtractCells()
    extract.SetInputData(made)
    extract.SetCellIds(np.flatnonzero(keep).astype(np.int64), int(keep.sum()))
    extract.Update()
    return extract.GetOutput()


def pieces_of(data):
    """The grids in a composite."""
    if not data.IsA("vtkCompositeDataSet"):
        return [data]
    iterator, found = data.NewIterator(), []
    iterator.InitTraversal()
    while not iterator.IsDoneWithTraversal():
        found.append(iterator.GetCurrentDataObject())
        iterator.GoToNextItem()
    return [grid for grid in found if grid.IsA("vtkUnstructuredGrid")]


def grid_answer(times, name, lattice, components=1, time=None):
    """Of grids of cells for each time, or for one: the values at the centres of the lattice's voxels. Times whose bounds are others than
    those of the first one are left out: they have another lattice."""
    fields, first = {}, None
    for number, data in enumerate(times):
        if time not in (None, number):
            continue
        grids = [drawn(grid) for grid in pieces_of(data)]
        bounds = np.array([grid.GetBounds() for grid in grids if grid.GetNumberOfCells()])
        low, high = bounds[:, ::2].min(0), bounds[:, 1::2].max(0)
        size = np.maximum(np.rint(lattice * (high - low) / (high - low).max()).astype(int), 1)
        places = [low[axis] + (np.arange(size[axis]) + 0.5) * (high - low)[axis] / size[axis] for axis in range(3)]
        first = first or places
        if not all(np.array_equal(one, other) for one, other in zip(first, places)):
            continue
        values = sum_of_probes(grids, name, np.stack(np.meshgrid(*places, indexing="ij"), -1).reshape(-1, 3), components)
        for component in range(components):
            fields[number, component] = values[:, component].reshape(size)
    return Answer(fields=fields, places=first, tolerance=5e-3)  # near a face VTK takes the cell beside it


def sum_of_probes(grids, name, at, components):
    """NaN where there is no cell."""
    values = np.full((len(at), components), np.nan)
    for grid in grids:
        points = vtk.vtkPoints()
        points.SetData(numpy_to_vtk(np.ascontiguousarray(at), deep=True))
        asked = vtk.vtkPolyData()
        asked.SetPoints(points)
        probe = vtk.vtkProbeFilter()
        probe.SetInputData(asked)
        probe.SetSourceData(grid)
        probe.SetPassFieldArrays(False)
        probe.Update()
        found = vtk_to_numpy(probe.GetOutput().GetPointData().GetArray("vtkValidPointMask")).astype(bool)
        values[found] = vtk_to_numpy(probe.GetOutput().GetPointData().GetArray(name)).astype(float).reshape(len(at), -1)[found, :components]
    return values


def cubes_of_tetrahedra(sides):
    """Points of a lattice that is not even, and the tetrahedra that fill it."""
    axes = [np.cumsum(1 + 0.25 * np.cos(np.arange(side + 1) + axis)) for axis, side in enumerate(sides)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)
    numbers = np.arange(len(points)).reshape([side + 1 for side in sides])
    corners = [numbers[x:sides[0] + x, y:sides[1] + y, z:sides[2] + z].ravel() for x in (0, 1) for y in (0, 1) for z in (0, 1)]
    ways = ((0, 1, 3, 7), (0, 1, 5, 7), (0, 2, 3, 7), (0, 2, 6, 7), (0, 4, 5, 7), (0, 4, 6, 7))
    cells = np.stack([np.stack([corners[i] for i in way], -1) for way in ways], 1).reshape(-1, 4)
    edges = points[cells[:, 1:]] - points[cells[:, :1]]
    turned = np.linalg.det(edges) < 0
    cells[turned] = cells[turned][:, [0, 2, 1, 3]]
    return points, cells


def grid_of(points, cells, point_data=(), cell_data=()):
    """vtkUnstructuredGrid of tetrahedra."""
    grid = vtk.vtkUnstructuredGrid()
    made = vtk.vtkPoints()
    made.SetDataTypeToDouble()
    made.SetData(numpy_to_vtk(np.ascontiguousarray(points, float), deep=True))
    grid.SetPoints(made)
    listed = vtk.vtkCellArray()
    for cell in cells:
        listed.InsertNextCell(len(cell), [int(i) for i in cell])
    grid.SetCells(vtk.VTK_TETRA, listed)
    for data, arrays in ((grid.GetPointData(), point_data), (grid.GetCellData(), cell_data)):
        for name, values in arrays:
            array = numpy_to_vtk(np.ascontiguousarray(values), deep=True)
            array.SetName(name)
            data.AddArray(array)
    return grid
