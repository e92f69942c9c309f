"""XDMF as VTK's writer, meshio and programs with a text of their own write it, over HDF5, binary files and XML; read by VTK."""
import h5py
import lxml.etree
import meshio
import numpy as np
import vtk
from vtk.util.numpy_support import numpy_to_vtk

from ablation import Answer, Sample
from documents import XmlDocument
from vtk_answers import cubes_of_tetrahedra, grid_answer, image_answer

FOREIGN_READER_CRASHES = True
LATTICE = 5
WORDS = {
    "NumberType": ("Float", "Int", "UInt", "Char"), "DataType": ("Float", "Int", "UInt"), "Precision": ("1", "2", "4", "8"),
    "Format": ("HDF", "XML", "Binary"), "Endian": ("Big", "Little", "Native"), "Center": ("Node", "Cell", "Grid", "Face"),
    "AttributeType": ("Scalar", "Vector", "Tensor", "GlobalID"), "TopologyType": ("3DCoRectMesh", "3DRectMesh", "3DSMesh", "Tetrahedron"),
    "GeometryType": ("ORIGIN_DXDYDZ", "VXVYVZ", "XYZ", "X_Y_Z"), "ItemType": ("Uniform", "HyperSlab", "Function"),
    "CollectionType": ("Temporal", "Spatial"), "GridType": ("Uniform", "Collection", "Tree", "Subset"),
    "TimeType": ("Single", "HyperSlab", "List", "Range"), "Version": ("2.0", "3.0"), "Function": ("JOIN($0, $1)",)
}

NAMES = {
    "Domain": ("grids",), "Attribute": ("array",), "Grid": ("array", "references"), "TopologyType": ("axes", "cells", "GeometryType"),
    "Dimensions": ("numbers", "is of", "bytes", "components"), "Center": ("array", "points", "cells"), "Name": ("array",),
    "Precision": ("type", "bytes", "cells with a volume"), "NumberType": ("type",), "DataType": ("type", "cells with a volume"),
    "Seek": ("bytes",), "include": ("Topology",)
}


class Xdmf(XmlDocument):
    """With the words of XDMF's attributes."""

    def nodes(self):
        nodes = super().nodes()
        for node in nodes:
            words = node.path.split("/")
            last = words[-1].lstrip("@")
            node.words = WORDS.get(last, ()) if "Geometry" not in words or last not in ("NumberType", "DataType") else ()
            node.names = (*NAMES.get(last, ()), *((words[-2],) if words[-1].startswith("@") or last == "text" else ()))
            node.kind = "comment" if last == "Version" or "Information" in words or words[-2:] == ["Grid", "@Name"] else ""
            if "Geometry" in words:
                node.role = "affine" if last == "text" else ""
                node.names = (*node.names, "Geometry", "origin", "spacing", "coordinates", "voxels between", "points reach")
            if "Topology" in words:
                node.names = (*node.names, "cell", "items")
        return nodes


def voxels(shape, dtype="f4", seed=0):
    return (np.random.default_rng(61 + seed).random(shape) * 90 + 1).astype(dtype)


def text_of(numbers):
    return " ".join(repr(number) for number in np.asarray(numbers).ravel().tolist())


def item(folder, text, values, **attributes):
    """A DataItem in XML."""
    kind = {"f": "Float", "i": "Int", "u": "UInt"}[values.dtype.kind]
    said = {
        "Dimensions": " ".join(str(side) for side in values.shape), "NumberType": kind, "Precision": values.dtype.itemsize,
        "Format": "XML", **attributes
    }
    listed = " ".join(f'{key}="{value}"' for key, value in said.items())
    return f"<DataItem {listed}>{text or text_of(values)}</DataItem>"


def hdf(folder, name, values):
    with h5py.File(folder / "data.h5", "a") as file:
        file.create_dataset(name, data=values)
    return item(folder, f"data.h5:/{name}", values, Format="HDF")


def binary(folder, name, values, order=">", skipped=16):
    (folder / name).write_bytes(bytes(skipped) + values.astype(values.dtype.newbyteorder(order)).tobytes())
    return item(folder, name, values, Format="Binary", Endian="Big" if order == ">" else "Little", Seek=skipped)


def even(folder, origin=(30.0, -20.0, 10.0), spacing=(2.0, 1.0, 0.5), dimensions="5 6 7"):
    """In the order z, y, x."""
    return (f'<Topology TopologyType="3DCoRectMesh" Dimensions="{dimensions}"/><Geometry GeometryType="ORIGIN_DXDYDZ">'
            f'{item(folder, "", np.array(origin), Name="Origin")}{item(folder, "", np.array(spacing), Name="Spacing")}</Geometry>')


def attribute(name, data, kind="Scalar", center="Node"):
    return f'<Attribute Name="{name}" AttributeType="{kind}" Center="{center}">{data}</Attribute>'


def save(folder, name, inside, version="2.0", grid='Name="mesh" GridType="Uniform"'):
    (folder / name).write_text(
        f'<?xml version="1.0" ?>\n<!DOCTYPE Xdmf SYSTEM "Xdmf.dtd" []>\n<Xdmf Version="{version}">\n<Domain>\n<Grid {grid}>'
        f"{inside}</Grid>\n</Domain>\n</Xdmf>\n")


def by_vtk(folder):
    made = vtk.vtkImageData()
    made.SetDimensions(7, 6, 5)
    made.SetSpacing(0.5, 1.0, 2.0)
    made.SetOrigin(10, -20, 30)
    array = numpy_to_vtk(voxels(210), deep=True)
    array.SetName("rho")
    made.GetPointData().SetScalars(array)
    writer = vtk.vtkXdmfWriter()
    writer.SetFileName(str(folder / "vtk.xmf"))
    writer.SetInputData(made)
    writer.Write()


def cells_of_image(folder):
    """Values of cells; a vector; information that other programs leave; big endian in a binary file."""
    inside = (even(folder, dimensions="6 7 8") + '<Time Value="1.5"/><Information Name="author" Value="somebody"/>' +
              attribute("u", hdf(folder, "u", voxels(
                  (5, 6, 7, 3))), "Vector", "Cell") + attribute("p", binary(folder, "p.raw", voxels((5, 6, 7))), center="Cell"))
    save(folder, "cells.xmf", inside)


def straight(folder):
    """Coordinates along each axis, even; a slab of a larger array."""
    larger = voxels((9, 6, 7), "i4")
    with h5py.File(folder / "data.h5", "w") as file:
        file["all"] = larger
    slab = ('<DataItem ItemType="HyperSlab" Dimensions="5 6 7" Type="HyperSlab">' +
            item(folder, "3 0 0 1 1 1 5 6 7", np.zeros(
                (3, 3), "i4")) + item(folder, "data.h5:/all", larger, Format="HDF") + "</DataItem>")
    axes = "".join(
        item(folder, "", first + step * np.arange(count)) for first, step, count in ((1.0, 0.5, 7), (2.0, 1.0, 6), (3.0, 2.0, 5)))
    save(
        folder, "straight.xmf", '<Topology TopologyType="3DRectMesh" Dimensions="5 6 7"/>'
        f'<Geometry GeometryType="VXVYVZ">{axes}</Geometry>' + attribute("n", slab))


def times(folder):
    """A grid for each time, which refers to the first one's topology and geometry; whole numbers, little endian."""
    grids = []
    for number in range(3):
        shape = even(folder) if number == 0 else ('<Topology Reference="XML">/Xdmf/Domain/Grid/Grid[1]/Topology</Topology>'
                                                  '<Geometry Reference="XML">/Xdmf/Domain/Grid/Grid[1]/Geometry</Geometry>')
        data = binary(folder, f"rho{number}.raw", voxels((5, 6, 7), "i4", number), "<", 0)
        grids.append(f'<Grid Name="step{number}" GridType="Uniform"><Time Value="{1 + 0.25 * number}"/>{shape}{attribute("rho", data)}</Grid>')
    save(folder, "times.xmf", "".join(grids), grid='Name="series" GridType="Collection" CollectionType="Temporal"')


def pieces(folder):
    """Two pieces, side by side along x; numbers in XML."""
    grids = [f'<Grid Name="piece{number}" GridType="Uniform">{even(folder, origin=(30.0, -20.0, 10.0 + 3 * number))}'
             f'{attribute("rho", item(folder, "", voxels((5, 6, 7), "f8", 7)))}</Grid>' for number in range(2)]
    grids[1] = grids[1].replace(text_of(voxels((5, 6, 7), "f8", 7)),
                                text_of(np.concatenate([voxels(
                                    (5, 6, 7), "f8", 7)[..., -1:], voxels((5, 6, 6), "f8", 8)], -1)))
    save(folder, "pieces.xmf", "".join(grids), version="3.0", grid='Name="all" GridType="Collection" CollectionType="Spatial"')


def tetrahedra(folder, form="HDF"):
    points, cells = cubes_of_tetrahedra((2, 3, 2))
    mesh = meshio.Mesh(points, [("tetra", cells)], point_data={"T": voxels(len(points), "f8"), "u": voxels((len(points), 3), "f8")},
                       cell_data={"k": [np.arange(len(cells)) % 5]})
    meshio.write(folder / f"meshio{form}.xdmf", mesh, data_format=form)


def steps(folder):
    """As FEniCS and meshio write times of one mesh."""
    points, cells = cubes_of_tetrahedra((2, 3, 2))
    with meshio.xdmf.TimeSeriesWriter(folder / "steps.xdmf", data_format="XML") as writer:
        writer.write_points_cells(points, [("tetra", cells)])
        for number in range(3):
            writer.write_data(1 + 0.5 * number, point_data={"T": voxels(len(points), "f8", number)})


def check_known(text):
    """VTK knows no whole numbers of one or two bytes by Precision, none of eight without a sign, and no other precision than 4 if it is
    left out; it takes every Time for one of a series."""
    for item in lxml.etree.fromstring(text).iter("DataItem"):
        kind, precision = item.get("NumberType") or item.get("DataType") or "", item.get("Precision")
        if (kind in ("Int", "UInt") and precision in ("1", "2")) or (kind == "UInt" and precision == "8"):
            raise ValueError("VTK has no such type")
        if precision is None and item.get("Format") == "Binary":
            raise ValueError("has no precision")
    if b"<Time " in text and text.count(b"<Time ") > 1 and (b'"Temporal"' not in text or b'"Collection"' not in text):
        raise ValueError("is no series")


def read_times(path):
    """What VTK makes of each time."""
    check_known(path.read_bytes())
    reader = vtk.vtkXdmfReader()
    reader.SetFileName(str(path))
    reader.UpdateInformation()
    information = reader.GetOutputInformation(0)
    key = vtk.vtkStreamingDemandDrivenPipeline.TIME_STEPS()
    for time in information.Get(key) if information.Has(key) else [None]:
        reader.UpdateTimeStep(time) if time is not None else reader.Update()
        data = reader.GetOutputDataObject(0)
        copy = data.NewInstance()
        copy.DeepCopy(data)
        yield time, copy


def read_images(path, name, components=1):
    read = list(read_times(path))
    if len(read) not in (1, 3):
        raise ValueError("a time is missing, or there twice")
    images = [image for _, image in read]
    if any(not image.IsA("vtkImageData") for image in images):
        images = [image_of(image) for image in images]
    answer = image_answer(images, name, components)
    if len(read) > 1:
        answer.facts["times"] = [len(read), read[1][0] - read[0][0], ""] if read[1][0] - read[0][0] != 1 else [len(read), None, ""]
    return answer


def image_of(grid):
    """Of a rectilinear grid whose coordinates are even, as an image."""
    made = vtk.vtkImageData()
    axes = [np.array(getattr(grid, f"Get{letter}Coordinates")()) for letter in "XYZ"]
    if any(not np.allclose(np.diff(axis), axis[1] - axis[0]) for axis in axes):
        raise ValueError("is not even")
    made.SetDimensions(grid.GetDimensions())
    made.SetOrigin(*(axis[0] for axis in axes))
    made.SetSpacing(*(abs(axis[1] - axis[0]) for axis in axes))
    if any(axis[1] < axis[0] for axis in axes):
        raise ValueError("runs down")
    made.GetPointData().ShallowCopy(grid.GetPointData())
    made.GetCellData().ShallowCopy(grid.GetCellData())
    return made


def read_pieces(path):
    """Those of a collection, in the box that they span."""
    (_, data), = read_times(path)
    iterator, images = data.NewIterator(), []
    iterator.InitTraversal()
    while not iterator.IsDoneWithTraversal():
        images.append(image_answer([iterator.GetCurrentDataObject()], "rho"))
        iterator.GoToNextItem()
    spacing = np.diag(images[0].affine)[:3]
    lows = [image.affine[:3, 3] for image in images]
    low = np.min(lows, axis=0)
    begins = [np.rint((each - low) / spacing).astype(int) for each in lows]
    size = np.max([begin + image.fields[0, 0].shape for begin, image in zip(begins, images)], axis=0)
    values = np.full(size, np.nan)
    for begin, image in zip(begins, images):
        place = tuple(slice(a, a + n) for a, n in zip(begin, image.fields[0, 0].shape))
        values[place] = np.where(np.isnan(values[place]), image.fields[0, 0], values[place])  # what they share is the first one's
    affine = np.diag([*spacing, 1.0])
    affine[:3, 3] = low
    return Answer(fields={(0, 0): values}, affine=affine)


def read_steps(path):
    """The first of two grids: VTK gives the other one, which has nothing but the mesh, values of the first time."""
    found = [data.GetBlock(0) for _, data in read_times(path)]
    if len(found) != 3:
        raise ValueError("a time is missing, or there twice")
    return grid_answer(found, "T", LATTICE)


def sample(name, write, read, file, options="", document="xdmf"):
    return Sample(name, file + options, write, lambda folder: [Xdmf(folder / file, document)], lambda folder: read(folder / file))


def samples(_):
    image = lambda name, components=1: lambda path: read_images(path, name, components)
    cells = lambda name: lambda path: grid_answer([data for _, data in read_times(path)], name, LATTICE)
    return [
        sample("vtk", by_vtk, image("rho"), "vtk.xmf", "?array=rho"),
        sample("cells", cells_of_image, image("p"), "cells.xmf", "?array=p"),
        sample("vector", cells_of_image, image("u", 3), "cells.xmf", "?array=u"),
        sample("straight", straight, image("n"), "straight.xmf"),
        sample("times", times, image("rho"), "times.xmf", document="times"),
        sample("pieces", pieces, read_pieces, "pieces.xmf", document="pieces"),
        sample("meshio", tetrahedra, cells("T"), "meshioHDF.xdmf", f"?array=T,lattice={LATTICE}", document="meshio"),
        sample("meshio-binary", lambda folder: tetrahedra(folder, "Binary"), cells("k"), "meshioBinary.xdmf",
               f"?array=k,lattice={LATTICE}", document="meshio"),
        sample("steps", steps, read_steps, "steps.xdmf", f"?lattice={LATTICE}", document="steps"),
    ]
