"""Meshes, lines and points, by trimesh, nibabel and VTK, and tables as 3D Slicer writes them."""
import nibabel
import nibabel.freesurfer
import nibabel.streamlines
import numpy as np
import trimesh
import vtk
from vtk.util import numpy_support

from ablation import Answer, Change, Document, Node, Sample
from documents import HeaderDocument, XmlDocument
from shape_documents import GlbJson, KeywordLines, PlyHeader, SurfaceEnd, TableDocument, TckLines
from vtk_documents import LegacyLines, VtkXml

FOREIGN_READER_CRASHES = True  # VTK's
POINTS = np.array([[0, 0, 0], [10, 1, 0], [2, 12, 1], [3, 4, 15]], float)
FACES = np.array([[0, 1, 2], [0, 1, 3], [1, 2, 3], [0, 2, 3]])
COLORS = np.array([[255, 0, 0, 255], [0, 200, 0, 200], [0, 0, 100, 150], [50, 60, 70, 100]], np.uint8)
LPS = np.array([-1.0, -1.0, 1.0])


def mesh(colors=False):
    made = trimesh.Trimesh(POINTS, FACES, process=False)
    if colors:
        made.visual.vertex_colors = COLORS
    return made


def read_mesh(path, turned=False):
    """Vertices as trimesh reads them."""
    loaded = trimesh.load(path, process=False, force="mesh")
    if not len(loaded.faces):
        raise ValueError("trimesh leaves out vertices of no face")
    return Answer(vertices=np.asarray(loaded.vertices) * (LPS if turned else 1))


def ply(name, encoding, colors=False, comment=None):
    def write(folder):
        data = mesh(colors).export(file_type="ply", encoding=encoding, vertex_normal=True)
        if comment:
            data = data.replace(b"\nelement vertex", f"\ncomment {comment}\nelement vertex".encode(), 1)
        (folder / "a.ply").write_bytes(data)

    return Sample(name, "a.ply", write, lambda folder: [PlyHeader(folder / "a.ply")],
                  lambda folder: read_mesh(folder / "a.ply", b"comment SPACE=LPS\n" in (folder / "a.ply").read_bytes()))


def stl(name, encoding, text=None):
    def write(folder):
        data = mesh().export(file_type=encoding)
        data = data if isinstance(data, bytes) else data.encode()
        if text:
            data = text.encode().ljust(80, b"\0") + data[80:]
        (folder / "a.stl").write_bytes(data)

    def documents(folder):
        if encoding == "stl_ascii":
            return [
                KeywordLines(folder / "a.stl",
                             "stl-text",
                             leave=("outer", "endloop", "endfacet", "endsolid"),
                             names={"vertex": ("corners", )})
            ]
        facet = np.dtype([("normal", "<f4", 3), ("corners", "<f4", 9), ("attribute", "<u2")])
        return [
            HeaderDocument(folder / "a.stl",
                           "stl",
                           np.dtype([("text", "S80"), ("triangles", "<u4")]),
                           names={
                               "text": ("header", "space"),
                               "triangles": ("triangle", "vertex")
                           }),
            StlFacet(folder / "a.stl", "stl-facet", facet, 84)
        ]

    return Sample(name, "a.stl", write, documents)


class StlFacet(HeaderDocument):
    """The first triangle of a binary file. It is written into the file as it is: the header may have been changed, too."""
    def save(self):
        data = bytearray(self.path.read_bytes())
        data[self.offset:self.offset + self.header.dtype.itemsize] = self.header.tobytes()
        self.path.write_bytes(bytes(data))


OBJ = """# by a modeller
mtllib a.mtl
o thing
v 0 0 0 1 0 0
v 10 1 0 0 1 0
v 2 12 1 0 0 1
v 3 4 15 0.5 0.5 0.5
vt 0 0
vt 1 1
vn 0 0 -1
vn 0 -1 0
g side
usemtl red
s off
f 1/1/1 2/2/1 3/1/1
f 1/1/2 2/2/2 4/1/2
l 1 2
"""
MTL = "newmtl red\nKa 0.2 0 0\nKd 1 0 0\nKs 1 1 1\nd 0.5\nTr 0.5\nNs 10\nillum 2\n"


def obj(_):
    def write(folder):
        (folder / "a.obj").write_text(OBJ)
        (folder / "a.mtl").write_text(MTL)

    return Sample("obj", "a.obj", write,
                  lambda folder: [KeywordLines(folder / "a.obj", "obj", names={"vn": ("normal", )}),
                                  KeywordLines(folder / "a.mtl", "mtl")], lambda folder: read_mesh(folder / "a.obj"), ("a.mtl", ))


def glb(name, colors=False, moved=False):
    def write(folder):
        scene = trimesh.Scene()
        scene.add_geometry(mesh(colors), transform=trimesh.transformations.translation_matrix([1, 2, 3]) if moved else np.eye(4))
        (folder / "a.glb").write_bytes(scene.export(file_type="glb", include_normals=True))

    return Sample(name, "a.glb", write, lambda folder: [GlbJson(folder / "a.glb")],
                  lambda folder: Answer(vertices=np.asarray(trimesh.load(folder / "a.glb", process=False).to_geometry().vertices)))


class GiftiXml(XmlDocument):
    """What messages say of arrays, and which ones are named by their intent."""

    NAMES = {
        "@Dim0": ("dimensions", ),
        "@Dim1": ("dimensions", ),
        "@Dimensionality": ("dimensions", ),
        "@Encoding": ("numbers", "base64", "gzip"),
        "@Intent": ("NIFTI_INTENT", "vertex"),
        "DataArray": ("array", "vertex"),
        "Data": ("numbers", ),
        "text": ("numbers", )
    }

    def nodes(self):
        nodes = super().nodes()
        for node in nodes:
            last = node.path.split("/")[-1]
            node.names = self.NAMES.get(last, ())
            node.kind = "version" if last == "@Version" else ""
        return nodes


def gifti(name, space="NIFTI_XFORM_SCANNER_ANAT", values=False, encoding="B64GZ"):
    def write(folder):
        matrix = np.diag([1.0, 1.0, 1.0, 1.0])
        matrix[:3, 3] = [5, 6, 7]
        arrays = [
            nibabel.gifti.GiftiDataArray(POINTS.astype(np.float32),
                                         "NIFTI_INTENT_POINTSET",
                                         "NIFTI_TYPE_FLOAT32",
                                         encoding=encoding,
                                         coordsys=nibabel.gifti.GiftiCoordSystem("NIFTI_XFORM_UNKNOWN", space, matrix),
                                         meta={
                                             "AnatomicalStructurePrimary": "CortexLeft",
                                             "GeometricType": "Anatomical"
                                         }),
            nibabel.gifti.GiftiDataArray(FACES.astype(np.int32), "NIFTI_INTENT_TRIANGLE", "NIFTI_TYPE_INT32", encoding=encoding)
        ]
        if values:
            arrays.append(
                nibabel.gifti.GiftiDataArray(np.arange(4, dtype=np.float32), "NIFTI_INTENT_SHAPE", "NIFTI_TYPE_FLOAT32", encoding=encoding))
        nibabel.save(nibabel.gifti.GiftiImage(darrays=arrays), folder / "a.surf.gii")

    def read(folder):
        image = nibabel.load(folder / "a.surf.gii")
        points = image.agg_data("pointset")
        places = image.get_arrays_from_intent("NIFTI_INTENT_POINTSET")[0].coordsys
        if places.xformspace == 1 or nibabel.nifti1.xform_codes.code[places.xformspace] == 1:
            points = points @ places.xform[:3, :3].T + places.xform[:3, 3]
        return Answer(vertices=points)

    return Sample(name, "a.surf.gii", write, lambda folder: [GiftiXml(folder / "a.surf.gii", "gifti")], read)


TKRAS = np.array([[-1.0, 0, 0], [0, 0, 1], [0, -1, 0]])  # columns: axes of voxels in the space of surfaces


def surface(_):
    info = {
        "head": np.array([2, 0, 20], np.int32),
        "valid": "1  # volume info valid",
        "filename": "../mri/orig.mgz",
        "volume": [256, 256, 256],
        "voxelsize": [1, 1, 1],
        "xras": [-1, 0, 0],
        "yras": [0, 0, -1],
        "zras": [0, 1, 0],
        "cras": [1.5, 2.5, 3.5]
    }

    def write(folder):
        nibabel.freesurfer.write_geometry(folder / "lh.pial", POINTS, FACES, "made by a test", info)

    def read(folder):
        points, _, told = nibabel.freesurfer.read_geometry(folder / "lh.pial", read_metadata=True)
        if not told or not told["valid"].startswith("1"):
            return Answer(vertices=points)
        turn = np.stack([told[name] for name in ("xras", "yras", "zras")], axis=1) @ TKRAS.T
        return Answer(vertices=points @ turn.T + told["cras"])

    return Sample("surface", "lh.pial", write, lambda folder: [SurfaceEnd(folder / "lh.pial")], read)


LINES = [POINTS[:3].astype(np.float32), POINTS[1:].astype(np.float32) + 1]


def trk(name, order="RAS", scalars=False):
    def write(folder):
        affine = np.diag([2.0, 2.0, 2.0, 1.0])
        affine[:3, 3] = [-10, -20, -30]
        data = {"fa": [np.arange(3, dtype=np.float32)[:, None], np.arange(3, dtype=np.float32)[:, None]]} if scalars else None
        tracts = nibabel.streamlines.Tractogram(LINES, data_per_point=data, affine_to_rasmm=np.eye(4))
        header = {"voxel_sizes": (2, 2, 2), "dimensions": (30, 30, 30), "voxel_to_rasmm": affine, "voxel_order": order}
        nibabel.streamlines.save(nibabel.streamlines.TrkFile(tracts, header), str(folder / "a.trk"))

    def read(folder):
        return Answer(vertices=np.concatenate(list(nibabel.streamlines.load(str(folder / "a.trk")).streamlines)))

    return Sample(
        name, "a.trk", write, lambda folder: [
            HeaderDocument(folder / "a.trk",
                           "trk",
                           nibabel.streamlines.trk.header_2_dtype,
                           names={
                               "magic_number": ("TRACK", ),
                               "hdr_size": ("header", ),
                               "voxel_sizes": ("voxel_size", ),
                               "nb_streamlines": ("line", ),
                               "nb_scalars_per_point": ("line", "scalars"),
                               "nb_properties_per_streamline": ("line", "properties")
                           })
        ], read)


def tck(_):
    def write(folder):
        tracts = nibabel.streamlines.Tractogram(LINES, affine_to_rasmm=np.eye(4))
        nibabel.streamlines.save(nibabel.streamlines.TckFile(tracts, {"step_size": "1", "timestamp": "1.5"}), str(folder / "a.tck"))

    def read(folder):
        return Answer(vertices=np.concatenate(list(nibabel.streamlines.load(str(folder / "a.tck")).streamlines)))

    return Sample("tck", "a.tck", write, lambda folder: [TckLines(folder / "a.tck", "tck", ":", rb"\nEND")], read)


FCSV = """# Markups fiducial file version = 5.6
# CoordinateSystem = LPS
# columns = id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID
1,1.5,2.5,3.5,0,0,0,1,1,1,0,tip,,
2,4.5,5.5,6.5,0,0,0,1,0,1,0,base,,
"""
TSV = "x\ty\tz\tr\tvalue\tlabel\n1\t2\t3\t0.5\t7\ta\n4\t5\t6\t1.5\t8\tb\n"
CSV = "index,axis-0,axis-1,axis-2,intensity\n0,1,2,3,10\n1,4,5,6,20\n"
CELLS = "X (µm),Y (µm),Z (µm),radius,red,green,blue,alpha\n1,2,3,0.5,255,0,0,255\n4,5,6,0.75,0,255,0,100\n"


def table(name, file, text, separator=",", header=None):
    return Sample(name, file, lambda folder: (folder / file).write_text(text),
                  lambda folder: [TableDocument(folder / file, name, separator, header)])


READ = ("pressure", "Normals", "rgb", "cell number", "cell%20number", "LengthUnits", "Points", "connectivity", "offsets"
        )  # not the temperature
CELLS_OF = {"Polys": FACES, "Strips": [[0, 1, 2, 3]], "Lines": [[0, 1, 2], [2, 3]], "Verts": [[0], [1], [3]]}


def polydata(kind="Polys"):
    made, points, cells = vtk.vtkPolyData(), vtk.vtkPoints(), vtk.vtkCellArray()
    for point in POINTS:
        points.InsertNextPoint(point)
    for cell in CELLS_OF[kind]:
        cells.InsertNextCell(len(cell), cell)
    made.SetPoints(points)
    getattr(made, f"Set{kind}")(cells)
    for name, values, of_points in (("temperature", np.arange(7.0, 11.0), True), ("pressure", np.arange(4.0), True),
                                    ("Normals", np.tile([0, 0, 1.0], (4, 1)), True), ("rgb", COLORS[:, :3].copy(), True),
                                    ("cell number", np.arange(len(CELLS_OF[kind])), False), ("vtkGhostType", np.array([0, 0, 0, 2],
                                                                                                                      np.uint8), True)):
        array = numpy_support.numpy_to_vtk(values, deep=True)
        array.SetName(name)
        (made.GetPointData() if of_points else made.GetCellData()).AddArray(array)
    made.GetPointData().SetActiveScalars("pressure")
    units = vtk.vtkStringArray()
    units.SetName("LengthUnits")
    units.InsertNextValue("mm")
    made.GetFieldData().AddArray(units)
    return made


def read_polydata(reader, path):
    reader.SetFileName(str(path))
    reader.Update()
    read = reader.GetOutput()
    values = read.GetPointData().GetScalars()
    return Answer(vertices=numpy_support.vtk_to_numpy(read.GetPoints().GetData()),
                  values=None if values is None else numpy_support.vtk_to_numpy(values))


def vtp(kind):
    def write(folder):
        writer = vtk.vtkXMLPolyDataWriter()
        writer.SetFileName(str(folder / "a.vtp"))
        writer.SetInputData(polydata(kind))
        writer.SetDataModeToAscii()
        writer.Write()

    read = None if kind in (
        "Lines", "Verts") else lambda folder: read_polydata(vtk.vtkXMLPolyDataReader(), folder / "a.vtp")  # vertices of each line
    return Sample(f"vtp-{kind.lower()}", "a.vtp", write, lambda folder: [VtkXml(folder / "a.vtp", "vtp", READ)], read)


def legacy(_):
    def write(folder):
        writer = vtk.vtkPolyDataWriter()
        writer.SetFileName(str(folder / "a.vtk"))
        writer.SetHeader("SPACE=LPS")
        writer.SetInputData(polydata())
        writer.Write()

    return Sample("legacy", "a.vtk", write, lambda folder: [LegacyLines(folder / "a.vtk", "polydata", READ)])


def npy(name, columns):
    def write(folder):
        np.save(folder / "a.npy", np.c_[POINTS, np.arange(1.0, 5.0)][:, :columns])

    return Sample(name, "a.npy", write, lambda folder: [NpyHeader(folder / "a.npy")],
                  lambda folder: Answer(vertices=np.load(folder / "a.npy")[:, :3]))


class NpyHeader(Document):
    """The members of a NumPy header, with the numbers encoded again."""
    def __init__(self, path):
        self.path, self.array = path, np.load(path)
        self.order = "C"

    def nodes(self):
        types = [Change(f"as {dtype}", lambda dtype=dtype: self._cast(dtype), same=True) for dtype in ("<f4", ">f8", "<i4", ">i2")]
        return [
            Node("npy/descr", None, names=("type", ), more=types),
            Node("npy/fortran_order", None, names=("order", ), more=[Change("columns", lambda: setattr(self, "order", "F"), same=True)])
        ]

    def _cast(self, dtype):
        self.array = self.array.astype(dtype)

    def save(self):
        np.save(self.path, np.asarray(self.array, order=self.order))


def samples(folder):
    return [
        ply("ply-text", "ascii"),
        ply("ply-binary", "binary", colors=True),
        ply("ply-slicer", "ascii", comment="SPACE=LPS"),
        stl("stl-text", "stl_ascii"),
        stl("stl-binary", "stl"),
        stl("stl-slicer", "stl", "3D Slicer output. SPACE=LPS"),
        obj(folder),
        glb("glb"),
        glb("glb-colors", colors=True, moved=True),
        gifti("gifti"),
        gifti("gifti-values", values=True, encoding="ASCII"),
        gifti("gifti-talairach", space="NIFTI_XFORM_TALAIRACH"),
        surface(folder),
        trk("trk"),
        trk("trk-scalars", order="LPS", scalars=True),
        tck(folder),
        table("fcsv", "a.fcsv", FCSV, header="# columns = "),
        table("tsv", "a.tsv", TSV, "\t"),
        table("csv-napari", "a.csv", CSV),
        table("csv-cells", "b.csv", CELLS),
        *[vtp(kind) for kind in CELLS_OF],
        legacy(folder),
        npy("npy-3", 3),
        npy("npy-4", 4),
    ]
