"""Meshes, lines and points, by trimesh, nibabel and VTK, and tables as 3D Slicer writes them."""
import nibabel
import nibabel.freesurfer
import nibabel.streamlines
import numpy as np
import trimesh
import vtk
from vtk.util import numpy_support

from ablation import Answer, Node, Sample
from documents import HeaderDocument, LinesDocument, XmlDocument
from shape_documents import GlbJson, KeywordLines, PlyHeader, SurfaceEnd, TableDocument


FOREIGN_READER_CRASHES = True  # VTK's
POINTS = np.array([[0, 0, 0], [10, 1, 0], [2, 12, 1], [3, 4, 15]], float)
FACES = np.array([[0, 1, 2], [0, 1, 3], [1, 2, 3], [0, 2, 3]])
COLORS = np.array([[255, 0, 0, 255], [0, 200, 0, 255], [0, 0, 100, 255], [50, 60, 70, 255]], np.uint8)
LPS = np.array([-1.0, -1.0, 1.0])


def mesh(colors=False):
    made = trimesh.Trimesh(POINTS, FACES, process=False)
    if colors:
        made.visual.vertex_colors = COLORS
    return made


def read_mesh(path, turned=False):
    """Vertices as trimesh reads them."""
    loaded = trimesh.load(path, process=False, force="mesh")
    return Answer(vertices=np.asarray(loaded.vertices) * (LPS if turned else 1))


def ply(name, encoding, colors=False, comment=None):
    def write(folder):
        data = mesh(colors).export(file_type="ply", encoding=encoding, vertex_normal=True)
        if comment:
            data = data.replace(b"\nelement vertex", f"\ncomment {comment}\nelement vertex".encode(), 1)
        (folder / "a.ply").write_bytes(data)
    return Sample(name, "a.ply", write, lambda folder: [PlyHeader(folder / "a.ply")],
                  lambda folder: read_mesh(folder / "a.ply", bool(comment) and b"SPACE=LPS" in (folder / "a.ply").read_bytes()))


def stl(name, encoding, text=None):
    def write(folder):
        data = mesh().export(file_type=encoding)
        data = data if isinstance(data, bytes) else data.encode()
        if text:
            data = text.encode().ljust(80, b"\0") + data[80:]
        (folder / "a.stl").write_bytes(data)

    def documents(folder):
        if encoding == "stl_ascii":
            return [KeywordLines(folder / "a.stl", "stl-text")]
        return [HeaderDocument(folder / "a.stl", "stl", np.dtype([("text", "S80"), ("triangles", "<u4")]), names={"text": ("header", "space")})]
    return Sample(name, "a.stl", write, documents)


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
    return Sample("obj", "a.obj", write, lambda folder: [KeywordLines(folder / "a.obj", "obj"), KeywordLines(folder / "a.mtl", "mtl")],
                  lambda folder: read_mesh(folder / "a.obj"), ("a.mtl",))


def glb(name, colors=False, moved=False):
    def write(folder):
        scene = trimesh.Scene()
        scene.add_geometry(mesh(colors), transform=trimesh.transformations.translation_matrix([1, 2, 3]) if moved else np.eye(4))
        (folder / "a.glb").write_bytes(scene.export(file_type="glb", include_normals=True))
    return Sample(name, "a.glb", write, lambda folder: [GlbJson(folder / "a.glb")],
                  lambda folder: Answer(vertices=np.asarray(trimesh.load(folder / "a.glb", process=False).to_geometry().vertices)))


def gifti(name, space="NIFTI_XFORM_SCANNER_ANAT", values=False, encoding="B64GZ"):
    def write(folder):
        matrix = np.diag([1.0, 1.0, 1.0, 1.0])
        matrix[:3, 3] = [5, 6, 7]
        arrays = [nibabel.gifti.GiftiDataArray(POINTS.astype(np.float32), "NIFTI_INTENT_POINTSET", "NIFTI_TYPE_FLOAT32", encoding=encoding,
                                               coordsys=nibabel.gifti.GiftiCoordSystem("NIFTI_XFORM_UNKNOWN", space, matrix),
                                               meta={"AnatomicalStructurePrimary": "CortexLeft", "GeometricType": "Anatomical"}),
                  nibabel.gifti.GiftiDataArray(FACES.astype(np.int32), "NIFTI_INTENT_TRIANGLE", "NIFTI_TYPE_INT32", encoding=encoding)]
        if values:
            arrays.append(nibabel.gifti.GiftiDataArray(np.arange(4, dtype=np.float32), "NIFTI_INTENT_SHAPE", "NIFTI_TYPE_FLOAT32", encoding=encoding))
        nibabel.save(nibabel.gifti.GiftiImage(darrays=arrays), folder / "a.surf.gii")

    def read(folder):
        image = nibabel.load(folder / "a.surf.gii")
        points = image.agg_data("pointset")
        places = image.get_arrays_from_intent("NIFTI_INTENT_POINTSET")[0].coordsys
        if places.xformspace == 1 or nibabel.nifti1.xform_codes.code[places.xformspace] == 1:
            points = points @ places.xform[:3, :3].T + places.xform[:3, 3]
        return Answer(vertices=points)
    return Sample(name, "a.surf.gii", write, lambda folder: [XmlDocument(folder / "a.surf.gii", "gifti")], read)


def surface(_):
    info = {"head": np.array([2, 0, 20], np.int32), "valid": "1  # volume info valid", "filename": "../mri/orig.mgz", "volume": [256, 256, 256],
            "voxelsize": [1, 1, 1], "xras": [-1, 0, 0], "yras": [0, 0, -1], "zras": [0, 1, 0], "cras": [1.5, 2.5, 3.5]}

    def write(folder):
        nibabel.freesurfer.write_geometry(folder / "lh.pial", POINTS, FACES, "made by a test", info)

    def read(folder):
        points, _, told = nibabel.freesurfer.read_geometry(folder / "lh.pial", read_metadata=True)
        return Answer(vertices=points + (told["cras"] if told else 0))
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
    return Sample(name, "a.trk", write, lambda folder: [HeaderDocument(folder / "a.trk", "trk", nibabel.streamlines.trk.header_2_dtype,
                                                                       names={"magic_number": ("TRACK",), "hdr_size": ("header",)})], read)


def tck(_):
    def write(folder):
        tracts = nibabel.streamlines.Tractogram(LINES, affine_to_rasmm=np.eye(4))
        nibabel.streamlines.save(nibabel.streamlines.TckFile(tracts, {"step_size": "1", "timestamp": "1.5"}), str(folder / "a.tck"))

    def read(folder):
        return Answer(vertices=np.concatenate(list(nibabel.streamlines.load(str(folder / "a.tck")).streamlines)))
    return Sample("tck", "a.tck", write, lambda folder: [LinesDocument(folder / "a.tck", "tck", ":", rb"\nEND")], read)


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


def polydata():
    made, points, cells = vtk.vtkPolyData(), vtk.vtkPoints(), vtk.vtkCellArray()
    for point in POINTS:
        points.InsertNextPoint(point)
    for face in FACES:
        cells.InsertNextCell(3, face)
    made.SetPoints(points)
    made.SetPolys(cells)
    for name, values, of_points in (("pressure", np.arange(4.0), True), ("Normals", np.tile([0, 0, 1.0], (4, 1)), True),
                                    ("rgb", COLORS[:, :3].copy(), True), ("cell number", np.arange(4), False),
                                    ("vtkGhostType", np.zeros(4, np.uint8), True)):
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
    values = read.GetPointData().GetArray("pressure")
    return Answer(vertices=numpy_support.vtk_to_numpy(read.GetPoints().GetData()),
                  values=None if values is None else numpy_support.vtk_to_numpy(values))


def vtp(_):
    def write(folder):
        writer = vtk.vtkXMLPolyDataWriter()
        writer.SetFileName(str(folder / "a.vtp"))
        writer.SetInputData(polydata())
        writer.SetDataModeToAscii()
        writer.Write()
    return Sample("vtp", "a.vtp", write, lambda folder: [XmlDocument(folder / "a.vtp", "vtp")],
                  lambda folder: read_polydata(vtk.vtkXMLPolyDataReader(), folder / "a.vtp"))


def legacy(_):
    def write(folder):
        writer = vtk.vtkPolyDataWriter()
        writer.SetFileName(str(folder / "a.vtk"))
        writer.SetHeader("SPACE=LPS")
        writer.SetInputData(polydata())
        writer.Write()
    return Sample("legacy", "a.vtk", write, lambda folder: [KeywordLines(folder / "a.vtk", "polydata")])


def npy(name, columns):
    def write(folder):
        np.save(folder / "a.npy", np.c_[POINTS, np.arange(1.0, 5.0)][:, :columns])
    return Sample(name, "a.npy", write, lambda folder: [NpyHeader(folder / "a.npy")], lambda folder: Answer(vertices=np.load(folder / "a.npy")[:, :3]))


class NpyHeader:
    """The three members of a NumPy header."""

    def __init__(self, path):
        self.path, self.array = path, np.load(path)
        self.order = "C"

    def nodes(self):
        return [Node("npy/descr", self.array.dtype.str, self._cast, words=("<f4", ">f8", "<i4"), names=("type",)),
                Node("npy/fortran_order", False, lambda new: setattr(self, "order", "F"), names=("order",))]

    def _cast(self, dtype):
        self.array = self.array.astype(dtype)

    def add(self, path, value):
        raise ValueError(path)

    def save(self):
        np.save(self.path, np.asarray(self.array, order=self.order))


def samples(folder):
    return [
        ply("ply-text", "ascii"), ply("ply-binary", "binary", colors=True), ply("ply-slicer", "ascii", comment="SPACE=LPS"),
        stl("stl-text", "stl_ascii"), stl("stl-binary", "stl"), stl("stl-slicer", "stl", "3D Slicer output. SPACE=LPS"),
        obj(folder), glb("glb"), glb("glb-colors", colors=True, moved=True),
        gifti("gifti"), gifti("gifti-values", values=True, encoding="ASCII"), gifti("gifti-talairach", space="NIFTI_XFORM_TALAIRACH"),
        surface(folder), trk("trk"), trk("trk-scalars", order="LPS", scalars=True), tck(folder),
        table("fcsv", "a.fcsv", FCSV, header="# columns = "), table("tsv", "a.tsv", TSV, "\t"), table("csv-napari", "a.csv", CSV),
        table("csv-cells", "b.csv", CELLS), vtp(folder), legacy(folder), npy("npy-3", 3), npy("npy-4", 4),
    ]
