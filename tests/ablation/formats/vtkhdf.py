"""VTKHDF: images, grids of cells and adaptive meshes, by vtkHDFWriter and by h5py as the specification has them; read by vtkHDFReader."""
import h5py
import numpy as np
import vtk
from vtk.util.numpy_support import numpy_to_vtk

from ablation import Answer, Sample
from hdf5_documents import Hdf5Document, Meanings
from vtk_answers import cubes_of_tetrahedra, grid_answer, grid_of, image_answer

FOREIGN_READER_CRASHES = True
MEANINGS = Meanings(
    roles={"Spacing": "spacing", "Origin": "affine", "Direction": "affine"}, names={
        "WholeExtent": ("extent",), "Type": ("VTKHDF",), "Types": ("type", "cells"), "AMRBox": ("box",), "NumberOfPoints": ("Points",
                                                                                                                            "cells"),
        "NumberOfCells": ("cells",), "NumberOfConnectivityIds": ("Offsets", "Connectivity"), "Offsets": ("Offsets", "part"),
        "Connectivity": ("point",), "VTKHDF": ("VTKHDF",), "vtkGhostType": ("cells",), "PointData": ("array",), "CellData": ("array",),
        "Level0": ("level 0", "array"), "NSteps": ("Steps",), "Spacing": ("step along", "cells of level", "beyond level"),
        "rho": ("array",), "velocity": ("array",), "NumberOfParts": ("cells",), "NumberOfAMRBox": ("level 0",)
    }, words={"Type": ("ImageData", "UnstructuredGrid", "OverlappingAMR", "PolyData"), "Attribute": ("Scalars", "Vectors")})
LATTICE = 5


def voxels(shape, dtype="f4", seed=0):
    return (np.random.default_rng(41 + seed).random(shape) * 90 + 1).astype(dtype)


def vtk_image(name, of_cells=False, direction=None):
    made = vtk.vtkImageData()
    made.SetExtent(*((2, 9, 1, 7, -1, 4) if of_cells else (2, 8, 1, 6, -1, 3)))
    made.SetSpacing(0.5, 1.0, 2.0)
    made.SetOrigin(10, -20, 30)
    if direction is not None:
        made.SetDirectionMatrix(*direction)
    array = numpy_to_vtk(voxels(210), deep=True)
    array.SetName(name)
    other = numpy_to_vtk(voxels(210, "f8", 5), deep=True)
    other.SetName("before")
    data = made.GetCellData() if of_cells else made.GetPointData()
    data.AddArray(other)
    data.SetScalars(array)
    field = numpy_to_vtk(np.array([7.5]), deep=True)
    field.SetName("dt")
    made.GetFieldData().AddArray(field)
    return made


def write(path, data, **options):
    writer = vtk.vtkHDFWriter()
    writer.SetFileName(str(path))
    writer.SetInputData(data)
    for name, value in options.items():
        getattr(writer, f"Set{name}")(value)
    writer.Write()


def begin(file, kind, **attributes):
    root = file.create_group("VTKHDF")
    root.attrs["Version"] = np.array([2, 3])
    root.attrs["Type"] = np.bytes_(kind)
    root.attrs.update(attributes)
    return root


def series(path):
    """Steps of an image, with components, as the specification has them."""
    with h5py.File(path, "w") as file:
        root = begin(file, "ImageData", WholeExtent=np.array([0, 6, 0, 5, 0, 4]), Origin=np.array([1.0, 2, 3]),
                     Spacing=np.array([0.5, 1, 2]), Direction=np.array([1.0, 0, 0, 0, 1, 0, 0, 0, 1]))
        root["PointData/velocity"] = voxels((3, 5, 6, 7, 3))
        root["PointData"].attrs["Vectors"] = np.bytes_("velocity")
        steps = root.create_group("Steps")
        steps.attrs["NSteps"] = 3
        steps["Values"] = 0.25 * np.arange(3)
        steps["PointDataOffsets/velocity"] = np.arange(3)


def read_steps(path):
    """Data of each step; vtkHDFReader keeps its output between updates."""
    reader = vtk.vtkHDFReader()
    reader.SetFileName(str(path))
    reader.SetMaximumLevelsToReadByDefaultForAMR(0)
    reader.UpdateInformation()
    for step in range(max(1, reader.GetNumberOfSteps())):
        reader.SetStep(step)
        reader.Modified()
        reader.Update()
        data = reader.GetOutputDataObject(0)
        copy = data.NewInstance()
        copy.DeepCopy(data)
        yield copy


def grid(path):
    points, cells = cubes_of_tetrahedra((3, 2, 4))
    write(
        path,
        grid_of(points, cells, [("T", voxels(len(points), "f8")), ("u", voxels((len(points), 3)))],
                [("material", np.arange(len(cells)) % 5)]))


def parts(path, constant=False):
    """As a parallel program writes it: two parts, ghost cells, three times of which two share the mesh. `constant`: two times, whose parts
    are as many as NumberOfParts, which is left out then, would say."""
    points, cells = cubes_of_tetrahedra((2, 2, 3))
    other = points + [points[:, 0].max() - points[:, 0].min(), 0, 0]
    count, corners = len(points), np.r_[cells.ravel(), cells.ravel()]
    with h5py.File(path, "w") as file:
        root = begin(file, "UnstructuredGrid")
        root["NumberOfPoints"], root["NumberOfCells"] = np.full(4, count), np.full(4, len(cells))
        root["NumberOfConnectivityIds"] = np.full(4, cells.size)
        root["Points"] = np.r_[points, other, 2 * points, 2 * other]
        root["Connectivity"], root["Types"] = np.r_[corners, corners[::-1]], np.full(4 * len(cells), 10, "u1")
        root["Offsets"] = np.tile(4 * np.arange(len(cells) + 1), 4)
        marks = np.zeros(4 * len(cells), "u1")
        marks[:6] = 1
        root["CellData/vtkGhostType"] = marks
        root["PointData/p"], root["CellData/rho"] = voxels(6 * count, "f8"), voxels(4 * len(cells), "f8")
        root["FieldData/run"] = np.array([42])
        steps = root.create_group("Steps")
        times = [0, 2] if constant else [0, 1, 2]
        steps.attrs["NSteps"] = len(times)
        steps["Values"] = np.array([0.0, 0.5, 1.0])[times]
        offsets = {"PartOffsets": [0, 0, 2], "NumberOfParts": [2, 2, 2], "PointOffsets": [0, 0, 2 * count],
                   "PointDataOffsets/p": [0, 2 * count, 4 * count], "CellDataOffsets/rho": [0, 0, 2 * len(cells)],
                   "CellDataOffsets/vtkGhostType": [0, 0, 2 * len(cells)], "FieldDataOffsets/run": [0, 0, 0],
                   "CellOffsets": [[0], [0], [2 * len(cells)]], "ConnectivityIdOffsets": [[0], [0], [2 * cells.size]]}
        for name, values in offsets.items():
            if not constant or name != "NumberOfParts":
                steps[name] = np.array(values)[times]


def collection(path):
    """Blocks with an assembly, of which one is a surface."""
    points, cells = cubes_of_tetrahedra((2, 2, 2))
    made = vtk.vtkPartitionedDataSetCollection()
    made.SetNumberOfPartitionedDataSets(2)
    for number in range(2):
        made.SetPartition(number, 0, grid_of(points + [9 * number, 0, 0], cells, [("T", voxels(len(points), "f8", number))]))
        made.GetMetaData(number).Set(vtk.vtkCompositeDataSet.NAME(), ("solid", "fluid")[number])
    assembly = vtk.vtkDataAssembly()
    assembly.SetRootNodeName("Assembly")
    for number, name in enumerate(("solid", "fluid")):
        assembly.AddDataSetIndex(assembly.AddNode(name), number)
    made.SetDataAssembly(assembly)
    write(path, made)


def mesh(path, steps=False, version=(2, 3)):
    """Two levels: the finer one covers part of the coarse one. Names of what Steps has lack an s before version 2.3."""
    boxes_name, box_offset, data_offset = (("NumberOfAMRBoxes", "AMRBoxOffsets", "CellDataOffsets") if version >= (2, 3) else
                                           ("NumberOfAMRBox", "AMRBoxOffset", "CellDataOffset"))
    with h5py.File(path, "w") as file:
        root = begin(file, "OverlappingAMR", Origin=np.array([1.0, 2, 3]))
        root.attrs["Version"] = np.array(version)
        root.attrs["GridDescription"] = np.bytes_("XYZ")
        coarse, fine = np.array([[0, 6, 0, 5, 0, 4]]), np.array([[2, 7, 2, 5, 2, 5], [2, 7, 6, 9, 2, 5]])
        for level, (boxes, step) in enumerate(((coarse, 1.0), (fine, 0.5))):
            made = root.create_group(f"Level{level}")
            made.attrs["Spacing"] = np.array([step, 2 * step, 3 * step])
            made["AMRBox"] = np.r_[boxes, boxes + (2 * level if level else 0) * np.array([1, 1, 0, 0, 0, 0])] if steps else boxes
            cells = int(sum(np.prod(box[1::2] - box[::2] + 1) for box in boxes))
            made["CellData/rho"] = voxels(cells * (2 if steps else 1), "f8", level)
            made["CellData/vtkGhostType"] = np.zeros(cells * (2 if steps else 1), "u1")
            if steps:
                times = root.require_group("Steps")
                times.attrs["NSteps"], values = 2, np.array([0.0, 0.5])
                if "Values" not in times:
                    times["Values"] = values
                for name, numbers in {box_offset: [0, len(boxes)], boxes_name: [len(boxes)] * 2, f"{data_offset}/rho": [0, cells],
                                      f"{data_offset}/vtkGhostType": [0, cells]}.items():
                    times[f"Level{level}/{name}"] = np.array(numbers)


def read_mesh(path):
    """The cells of the finest level, which are voxels of its box."""
    fields, affine = {}, None
    for number, data in enumerate(read_steps(path)):
        level = data.GetNumberOfLevels() - 1
        images = [data.GetDataSetAsImageData(level, i) for i in range(data.GetNumberOfBlocks(level))]
        extents = [np.array(image.GetOrigin()) for image in images]
        low = np.min(extents, axis=0)
        spacing = np.array(images[0].GetSpacing())
        ends = np.max([np.array(image.GetOrigin()) + spacing * (np.array(image.GetDimensions()) - 1) for image in images], axis=0)
        size = np.rint((ends - low) / spacing).astype(int)
        values = np.full(size, np.nan)
        for image in images:
            first = np.rint((np.array(image.GetOrigin()) - low) / spacing).astype(int)
            cells = np.array(image.GetDimensions()) - 1
            array = np.array(image.GetCellData().GetArray("rho")).reshape(cells[::-1]).T
            place = tuple(slice(a, a + n) for a, n in zip(first, cells))
            if not np.isnan(values[place]).all():
                raise ValueError("boxes overlap")
            values[place] = array
        if np.isnan(values).any():
            raise ValueError("the boxes do not fill their bounding box")
        here = np.diag([*spacing, 1.0])
        here[:3, 3] = low + spacing / 2
        affine = here if affine is None else affine
        if np.array_equal(affine, here):
            fields[number, 0] = values
    return Answer(fields=fields, affine=affine)


def blocks(path):
    """vtkHDFReader leaves out a block whose Index is another's, or of none."""
    with h5py.File(path) as file:
        numbers = sorted(int(file[f"VTKHDF/{name}"].attrs.get("Index", -1)) for name in file["VTKHDF"] if name != "Assembly")
    if numbers != list(range(len(numbers))):
        raise ValueError("blocks are not numbered")
    return grid_answer(list(read_steps(path)), "T", LATTICE)


def sample(name, make, read, options="", document=None):
    file = f"{name}.vtkhdf"
    return Sample(name, file + options, lambda folder: make(folder / file),
                  lambda folder: [Hdf5Document(folder / file, document or name, MEANINGS, numbered=r"^\d+$", types=("<f8", ">f4"))],
                  lambda folder: read(folder / file))


def samples(_):
    image = lambda name, components=1: lambda path: image_answer(list(read_steps(path)), name, components)
    cells = lambda name, time=None: lambda path: grid_answer(list(read_steps(path)), name, LATTICE, time=time)
    turned = (0, -1, 0, 1, 0, 0, 0, 0, 1)
    return [
        sample("image", lambda path: write(path, vtk_image("rho")), image("rho"), "?dataset=VTKHDF/PointData/rho", "image"),
        sample("image-active", lambda path: write(path, vtk_image("rho")), image("rho"), document="image"),
        sample("image-cells", lambda path: write(path, vtk_image("rho", of_cells=True, direction=turned), CompressionLevel=4, ChunkSize=3),
               image("rho"), "?dataset=VTKHDF/CellData/rho", "image"),
        sample("image-series", series, image("velocity", 3), document="image"),
        sample("grid", grid, cells("T"), f"?dataset=T,lattice={LATTICE}"),
        sample("grid-cells", grid, cells("material"), f"?dataset=material,lattice={LATTICE}", "grid"),
        sample("parts", parts, cells("p"), f"?dataset=p,lattice={LATTICE}"),
        sample("parts-constant", lambda path: parts(path, constant=True), cells("rho"), f"?dataset=rho,lattice={LATTICE}", "parts"),
        sample("parts-moved", parts, cells("rho", 2), f"?dataset=rho,time=2,lattice={LATTICE}", "parts"),
        sample("collection", collection, blocks, f"?lattice={LATTICE}"),
        sample("amr", mesh, read_mesh, "?dataset=rho"),
        sample("amr-series", lambda path: mesh(path, steps=True), read_mesh, "?dataset=rho"),
        sample("amr-series-2.2", lambda path: mesh(path, steps=True, version=(2, 2)), read_mesh, "?dataset=rho"),
    ]
