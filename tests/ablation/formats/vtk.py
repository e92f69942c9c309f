"""VTK's XML and legacy files of images, rectilinear grids and cells, lists of pieces, blocks and times, by VTK's own writers."""
import itertools
import re

import numpy as np
import vtk
from vtk.util import numpy_support

from ablation import Answer, Document, Node, Sample
from documents import JsonDocument
from vtk_documents import HOW, KINDS, NAMES, ROLES, VOCABULARY, LegacyLines, VtkXml, as_numbers, as_words

FOREIGN_READER_CRASHES = True
ASKED = ("rho", "Points", "connectivity", "offsets", "types")
SIZE = (5, 6, 7)
X = np.array([0.0, 1.0, 2.5, 4.5, 7.0])


def numbers(count, name, dtype=np.float32, components=1):
    values = (np.arange(count * components) % 97 + 3.25).astype(dtype)
    array = numpy_support.numpy_to_vtk(values.reshape(count, components) if components > 1 else values, deep=True)
    array.SetName(name)
    return array


def with_field_data(data, time=1.5):
    for name, value in (("TimeValue", time), ("CYCLE", 3)):
        data.GetFieldData().AddArray(numbers(1, name))
        data.GetFieldData().GetArray(name).SetTuple1(0, value)
    units = vtk.vtkStringArray()
    units.SetName("units")
    units.InsertNextValue("mm")
    data.GetFieldData().AddArray(units)
    return data


def with_ghosts(data, of_cells, bit):
    attributes = data.GetCellData() if of_cells else data.GetPointData()
    count = data.GetNumberOfCells() if of_cells else data.GetNumberOfPoints()
    ghosts = np.zeros(count, np.uint8)
    ghosts[:3] = bit
    array = numpy_support.numpy_to_vtk(ghosts, deep=True)
    array.SetName("vtkGhostType")
    attributes.AddArray(array)
    return data


def image(of_cells=False, turned=False, dtype=np.float32, extent=None, ghost=0):
    data = vtk.vtkImageData()
    low = (extent or (0, SIZE[0] - 1, 0, SIZE[1] - 1, 0, SIZE[2] - 1))
    data.SetExtent(*low)
    data.SetSpacing(1.5, 2.0, 2.5)
    data.SetOrigin(10, -20, 30)
    if turned:
        data.SetDirectionMatrix(0, -1, 0, 1, 0, 0, 0, 0, 1)
    return with_arrays(data, of_cells, dtype, ghost)


def with_arrays(data, of_cells, dtype=np.float32, ghost=0):
    attributes, count = (data.GetCellData(), data.GetNumberOfCells()) if of_cells else (data.GetPointData(), data.GetNumberOfPoints())
    attributes.AddArray(numbers(count, "rho", dtype))
    attributes.AddArray(numbers(count, "velocity", components=3))
    attributes.SetActiveScalars("rho")
    if ghost:
        with_ghosts(data, of_cells, ghost)
    return with_field_data(data)


def rectilinear(of_cells=False):
    data = vtk.vtkRectilinearGrid()
    data.SetDimensions(*SIZE)
    for axis, places in zip("XYZ", (X, np.arange(6) * 2.0 + 1, np.arange(7) * 0.5)):
        array = numpy_support.numpy_to_vtk(places, deep=True)
        array.SetName(axis.lower())
        getattr(data, f"Set{axis}Coordinates")(array)
    return with_arrays(data, of_cells)


def structured():
    data, points = vtk.vtkStructuredGrid(), vtk.vtkPoints()
    data.SetDimensions(4, 4, 4)
    for z, y, x in itertools.product(range(4), range(4), range(4)):
        points.InsertNextPoint(x + 0.1 * y, y, z * 1.5)
    data.SetPoints(points)
    return with_arrays(data, False)


def cells(of_cells=False, ghost=0):
    data, points = vtk.vtkUnstructuredGrid(), vtk.vtkPoints()
    for z, y, x in itertools.product(range(3), range(3), range(3)):
        points.InsertNextPoint(x * 1.0, y * 1.25, z * 1.5)
    data.SetPoints(points)
    for z, y, x in itertools.product(range(2), range(2), range(2)):
        corner = [x + y * 3 + z * 9 + i + 3 * j + 9 * k for k in (0, 1) for j, i in ((0, 0), (0, 1), (1, 1), (1, 0))]
        data.InsertNextCell(vtk.VTK_HEXAHEDRON, 8, corner)
    return with_arrays(data, of_cells, ghost=ghost)


def write_xml(writer, data, path, mode="ascii"):
    writer.SetFileName(str(path))
    writer.SetInputData(data)
    getattr(writer, {"ascii": "SetDataModeToAscii", "binary": "SetDataModeToBinary"}[mode])()
    writer.SetCompressorTypeToNone()
    writer.Write()


def output(reader, path):
    """VTK's readers complain, and go on with samples that nobody has written: such a file is refused."""
    said = vtk.vtkStringOutputWindow()
    vtk.vtkOutputWindow.SetInstance(said)
    reader.SetFileName(str(path))
    reader.Update()
    if reader.GetErrorCode() or said.GetOutput():
        raise ValueError(said.GetOutput())
    return reader.GetOutput()


def array_of(data, name="rho"):
    for attributes, of_cells in ((data.GetPointData(), False), (data.GetCellData(), True)):
        found = attributes.GetArray(name)
        if found is not None:
            return numpy_support.vtk_to_numpy(found).astype(float), of_cells
    raise ValueError(name)


def hidden(data, of_cells, values):
    """Ghosts of bits 1, 8 and 32 of cells, and 2 of points, are not drawn; which value they have is open."""
    ghosts = (data.GetCellData() if of_cells else data.GetPointData()).GetArray("vtkGhostType")
    if ghosts is not None:
        flags = numpy_support.vtk_to_numpy(ghosts).astype(int)
        values = np.where(flags & (0b101000 if of_cells else 2), np.nan, values)
    return values


def check_filled(path):
    """VTK's readers leave voxels of no piece as the memory was: such a file is refused."""
    text = path.read_bytes().split(b"<AppendedData")[0].decode("latin-1")
    extents = [np.array(found[1].split(), int) for found in re.finditer(r'Extent="([^"]*)"', text)]
    counts = [np.prod(extent[1::2] - extent[::2] + 1) for extent in extents]
    if counts and sum(counts[1:]) < counts[0]:
        raise ValueError("pieces do not fill the whole")


def read_image(path, reader, begin=0):
    """`begin`: voxels along x that are left out."""
    check_filled(path)
    data = output(reader, path)
    values, of_cells = array_of(data)
    values = hidden(data, of_cells, values)
    size = [max(n - of_cells, 1) for n in data.GetDimensions()]
    steps = np.array([data.GetDirectionMatrix().GetElement(r, c) for r in range(3)
                      for c in range(3)]).reshape(3, 3) * np.array(data.GetSpacing())
    affine = np.eye(4)
    affine[:3, :3] = steps
    first = np.array(data.GetExtent()[::2]) + (0.5 if of_cells else 0) + [begin, 0, 0]
    affine[:3, 3] = np.array(data.GetOrigin()) + steps @ first
    return Answer(fields={(0, 0): values.reshape(size[::-1]).transpose(2, 1, 0)[begin:]}, affine=affine)


def read_rectilinear(path, reader):
    check_filled(path)
    data = output(reader, path)
    values, of_cells = array_of(data)
    size = [max(n - of_cells, 1) for n in data.GetDimensions()]
    places = [numpy_support.vtk_to_numpy(getattr(data, f"Get{axis}Coordinates")()) for axis in "XYZ"]
    places = [(p[1:] + p[:-1]) / 2 if of_cells else p for p in places]
    return Answer(fields={(0, 0): hidden(data, of_cells, values).reshape(size[::-1]).transpose(2, 1, 0)}, places=places)


def xml_sample(name, file, writer, data, read=None, mode="ascii"):
    return Sample(name, f"{file}?array=rho", lambda folder: write_xml(writer(), data(), folder / file, mode),
                  lambda folder: [VtkXml(folder / file,
                                         file.split(".")[-1], ASKED)], read and (lambda folder: read(folder / file)))


def legacy_sample(name, data, reader=None, read=None):
    def write(folder):
        writer = vtk.vtkDataSetWriter()
        writer.SetFileName(str(folder / "a.vtk"))
        writer.SetInputData(data())
        writer.Write()

    return Sample(name, "a.vtk?array=rho", write, lambda folder: [LegacyLines(folder / "a.vtk", "legacy", ASKED)], read
                  and (lambda folder: read(folder / "a.vtk", reader())))


def pieces(of_cells=False, ghost=0):
    """Two files of pieces along x, which overlap by a layer of points, and their list. The second piece is changed."""
    def write(folder):
        for number, extent in enumerate(((0, 2, 0, 5, 0, 6), (2, 4, 0, 5, 0, 6))):
            whole = image(of_cells)
            cut = vtk.vtkExtractVOI()
            cut.SetInputData(whole)
            cut.SetVOI(*extent)
            cut.Update()
            piece = cut.GetOutput()
            if ghost:
                piece = with_ghosts(piece, of_cells, ghost)
            write_xml(vtk.vtkXMLImageDataWriter(), piece, folder / f"a_{number}.vti")
        arrays = '<PDataArray type="Float32" Name="rho"/><PDataArray type="Float32" Name="velocity" NumberOfComponents="3"/>'
        at = "PCellData" if of_cells else "PPointData"
        (folder / "a.pvti").write_text(
            '<?xml version="1.0"?>\n<VTKFile type="PImageData" version="0.1" byte_order="LittleEndian" header_type="UInt32">'
            '<PImageData WholeExtent="0 4 0 5 0 6" GhostLevel="0" Origin="10 -20 30" Spacing="1.5 2 2.5">'
            f'<{at} Scalars="rho">{arrays}</{at}><Piece Extent="0 2 0 5 0 6" Source="a_0.vti"/><Piece Extent="2 4 0 5 0 6" Source="a_1.vti"/>'
            "</PImageData></VTKFile>")

    return Sample(f"pvti{'-ghosts' if ghost else ''}", "a.pvti?array=rho", write,
                  lambda folder: [VtkXml(folder / "a.pvti", "pvti", ASKED),
                                  VtkXml(folder / "a_1.vti", "piece", ASKED)],
                  lambda folder: read_image(folder / "a.pvti", vtk.vtkXMLPImageDataReader(), 3), ("a_1.vti", ))  # 2 is in both


def blocks(_):
    def write(folder):
        made = vtk.vtkMultiBlockDataSet()
        made.SetBlock(0, cells())
        moved = cells()
        for i in range(moved.GetNumberOfPoints()):
            x, y, z = moved.GetPoint(i)
            moved.GetPoints().SetPoint(i, x + 2, y, z)
        made.SetBlock(1, moved)
        made.GetMetaData(0).Set(vtk.vtkCompositeDataSet.NAME(), "left")
        made.GetMetaData(1).Set(vtk.vtkCompositeDataSet.NAME(), "right")
        write_xml(vtk.vtkXMLMultiBlockDataWriter(), made, folder / "a.vtm")

    return Sample("vtm", "a.vtm?array=rho", write, lambda folder: [VtkXml(folder / "a.vtm", "vtm")], None, ("a/a_1.vtu", ))


def collection(_):
    def write(folder):
        for number in range(2):
            write_xml(vtk.vtkXMLImageDataWriter(), image(dtype=(np.float32, np.int16)[number]), folder / f"a_{number}.vti")
        (folder / "a.pvd").write_text(
            '<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1" byte_order="LittleEndian"><Collection>'
            '<DataSet timestep="1" group="" part="0" file="a_0.vti"/><DataSet timestep="2.5" group="" part="0" file="a_1.vti"/>'
            "</Collection></VTKFile>")

    return Sample("pvd", "a.pvd?array=rho", write, lambda folder: [VtkXml(folder / "a.pvd", "pvd")], None, ("a_1.vti", ))


def series(_):
    def write(folder):
        for number in range(2):
            write_xml(vtk.vtkXMLImageDataWriter(), image(dtype=(np.float32, np.int16)[number]), folder / f"a_{number}.vti")
        (folder / "a.vti.series"
         ).write_text('{"file-series-version": "1.0", "files": [{"name": "a_0.vti", "time": 1}, {"name": "a_1.vti", "time": 2.5}]}')

    return Sample("series", "a.vti.series?array=rho", write, lambda folder: [JsonDocument(folder / "a.vti.series", "series")], None,
                  ("a_1.vti", ))


class Appended(Document):
    """The XML before appended raw bytes: attributes by a regular expression, since it is no XML as a whole."""
    def __init__(self, path):
        self.path = path
        data = path.read_bytes()
        at = data.index(b"<AppendedData")
        self.text, self.tail = data[:at].decode(), data[at:]

    def nodes(self):
        nodes = []
        for match in re.finditer(r"<(\w+)((?:\s+\w+=\"[^\"]*\")+)", self.text):
            array = re.search(r"Name=\"([^\"]*)\"", match[2])
            if match[1] in ("InformationKey", "Value"):
                continue
            tag = match[1] + (f"({array[1]})" if array else "")
            for attribute in re.finditer(r"(\w+)=\"([^\"]*)\"", match[2]):
                name = f"@{attribute[1]}"
                begin, names = match.start(2) + attribute.start(2), (*NAMES.get(name, ()), *((array[1], "array") if array else ()))
                kind = KINDS.get(name, "") or ("unread" if array and (array[1] == "velocity" or array[1] != "rho" and name in HOW) else "")
                nodes.append(
                    Node(f"appended/{tag}/{name}",
                         as_numbers(attribute[2]),
                         lambda new, b=begin, e=begin + len(attribute[2]): self._set(b, e, as_words(new)),
                         names=names,
                         role=ROLES.get(name, ""),
                         words=VOCABULARY.get(name, ()),
                         kind=kind))
        return nodes

    def _set(self, begin, end, value):
        self.text = self.text[:begin] + str(value) + self.text[end:]

    def save(self):
        self.path.write_bytes(self.text.encode() + self.tail)


def appended(big):
    def write(folder):
        writer = vtk.vtkXMLImageDataWriter()
        writer.SetFileName(str(folder / "a.vti"))
        writer.SetInputData(image(dtype=np.int16))
        writer.SetDataModeToAppended()
        writer.EncodeAppendedDataOff()
        (writer.SetByteOrderToBigEndian if big else writer.SetByteOrderToLittleEndian)()
        writer.Write()

    return Sample(f"appended{'-big' if big else ''}", "a.vti?array=rho", write, lambda folder: [Appended(folder / "a.vti")],
                  lambda folder: read_image(folder / "a.vti", vtk.vtkXMLImageDataReader()))


def samples(folder):
    xml_image, xml_grid = vtk.vtkXMLImageDataWriter, vtk.vtkXMLRectilinearGridWriter
    image_reader = lambda path: read_image(path, vtk.vtkXMLImageDataReader())
    grid_reader = lambda path: read_rectilinear(path, vtk.vtkXMLRectilinearGridReader())
    return [
        xml_sample("vti", "a.vti", xml_image, image, image_reader),
        xml_sample("vti-cells", "a.vti", xml_image, lambda: image(True), image_reader),
        xml_sample("vti-turned", "a.vti", xml_image, lambda: image(turned=True), image_reader),
        xml_sample("vti-binary", "a.vti", xml_image, lambda: image(dtype=np.int16), image_reader, "binary"),
        xml_sample("vti-hidden-cells", "a.vti", xml_image, lambda: image(True, ghost=32), image_reader),
        xml_sample("vti-hidden-points", "a.vti", xml_image, lambda: image(ghost=2), image_reader),
        xml_sample("vtr", "a.vtr", xml_grid, rectilinear, grid_reader),
        xml_sample("vtr-cells", "a.vtr", xml_grid, lambda: rectilinear(True), grid_reader),
        xml_sample("vts", "a.vts", vtk.vtkXMLStructuredGridWriter, structured),
        xml_sample("vtu", "a.vtu", vtk.vtkXMLUnstructuredGridWriter, cells),
        xml_sample("vtu-cells", "a.vtu", vtk.vtkXMLUnstructuredGridWriter, lambda: cells(True, ghost=1)),
        legacy_sample("legacy image", image, vtk.vtkStructuredPointsReader, read_image),
        legacy_sample("legacy cells", lambda: image(True), vtk.vtkStructuredPointsReader, read_image),
        legacy_sample("legacy rectilinear", rectilinear, vtk.vtkRectilinearGridReader, read_rectilinear),
        legacy_sample("legacy unstructured", cells),
        legacy_sample("legacy structured", structured),
        appended(False),
        appended(True),
        pieces(),
        pieces(True, ghost=1),
        blocks(folder),
        collection(folder),
        series(folder),
    ]
