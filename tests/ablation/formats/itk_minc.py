"""ITK's HDF5 by SimpleITK; MINC 2 by SimpleITK (libminc) and MINC 1 by VTK, and both as the tools of MINC write them from scanners: scaled
slice by slice. nibabel reads MINC."""
import h5py
import netCDF4
import nibabel
import numpy as np
import SimpleITK
import vtk
from vtk.util.numpy_support import numpy_to_vtk

from ablation import Answer, Sample
from hdf5_documents import Hdf5Document, Meanings, NetcdfDocument
from vtk_answers import image_answer

FOREIGN_READER_CRASHES = True
REMARKS = ("ITKVersion", "HDFVersion", "minc_version", "comments", "version", "full_name", "ITK_FileNotes", "Modality", "RescaleSlope",
           "MetaData", "patient orientation", "info", "patient", "study", "acquisition", "sex", "modality", "repetition_time",
           "echo_time")
MEANINGS = Meanings(
    kinds={"ident": "identifier", "vartype": "identifier", "start_time": "date", **{name: "comment"
                                                                                    for name in REMARKS}}, roles={
               "Spacing": "spacing", "Origin": "affine", "Directions": "affine", "step": "spacing", "start": "affine",
               "direction_cosines": "affine", "image-max": "scale", "units": "unit"
           },
    names={
        "Directions": ("direction",), "Origin": ("origin",), "dimorder": ("dimorder", "axes"),
        "direction_cosines": ("axes", "directions"), "spacing": ("evenly spaced",), **{f"{letter}space": ("axes",)
                                                                                       for letter in "xyz"}
    }, words={
        "units": ("mm", "m", "um"), "signtype": ("signed__", "unsigned"), "spacing": ("regular__", "irregular"),
        "alignment": ("start_", "end___"), "spacetype": ("native____", "talairach_"), "complete": ("true_", "false"),
        "class": ("label__", "real___"), "VoxelType": ("FLOAT", "UCHAR")
    })


def turned():
    matrix, _ = np.linalg.qr(np.array([[0.9, 0.1, 0.0], [-0.1, 0.95, 0.2], [0.0, -0.2, 1.0]]))
    return matrix * np.sign(np.diag(matrix))


def voxels(shape, dtype):
    return np.random.default_rng(31).integers(1, 120, shape).astype(dtype)


def image(data, vector=False):
    made = SimpleITK.GetImageFromArray(data, isVector=vector)
    made.SetSpacing([1.5, 2.0, 2.5] + [0.8] * (made.GetDimension() - 3))
    made.SetOrigin([10.0, -20.0, 30.0] + [0.0] * (made.GetDimension() - 3))
    direction = np.eye(made.GetDimension())
    direction[:3, :3] = turned()
    made.SetDirection(direction.ravel())
    for key, value in (("ITK_FileNotes", "made"), ("Modality", "CT"), ("RescaleSlope", "2"), ("patient orientation", "RAI")):
        made.SetMetaData(key, value)
    return made


def read_itk(path):
    made = SimpleITK.ReadImage(str(path))
    data = SimpleITK.GetArrayFromImage(made).astype(float)
    components, sides = made.GetNumberOfComponentsPerPixel(), made.GetDimension()
    data = data if components > 1 else data[..., None]
    data = data if sides == 4 else data[None]
    with h5py.File(path) as file:
        timed = sides == 4 and file["ITKImage/0/Spacing"][3] > 0
    affine = np.eye(4)
    affine[:3, :3] = np.array(made.GetDirection()).reshape(sides, sides)[:3, :3] @ np.diag(made.GetSpacing()[:3])
    affine[:3, 3] = made.GetOrigin()[:3]
    times = {"times": [len(data), made.GetSpacing()[3], ""]} if timed else {}
    return Answer(fields={(t, c): data[t, ..., c].T for t in range(len(data)) for c in range(components)},
                  affine=np.diag([-1.0, -1, 1, 1]) @ affine, facts=times)


STANDARD = {"varid": "MINC standard variable", "vartype": "dimension____", "version": "MINC Version    1.0"}


def dimension(name, size, start, step, cosines):
    said = dict(STANDARD, comments="X increases from patient left to right", spacing="regular__", alignment="centre", units="mm",
                start=start, step=step, spacetype="native____", length=np.int32(size))
    return said | ({"direction_cosines": np.array(cosines)} if cosines is not None else {})


def dimensions():
    axes = turned()
    return {"zspace": dimension("zspace", 5, 30.0, 2.5, axes[:, 2]), "yspace": dimension("yspace", 6, -20.0, 2.0, axes[:, 1]),
            "xspace": dimension("xspace", 7, 40.0, -1.5, axes[:, 0])}


def scanner(path):
    """As dcm2mnc writes it: whole numbers, scaled slice by slice; times."""
    with h5py.File(path, "w") as file:
        root = file.create_group("minc-2.0")
        root.attrs.update({
            key: np.bytes_(value)
            for key, value in (("ident", "somebody:scanner:1"), ("minc_version", "2.4.03"), ("history", "dcm2mnc"), ("title", "t1"))
        })
        for name, said in (
            {"time": {"units": "s", "start": 0.0, "step": 2.5, "spacing": "regular__", "length": np.int32(3), "comments": "none"}}
                | dimensions()).items():
            made = root.create_dataset(f"dimensions/{name}", data=np.int32(0))
            made.attrs.update({key: np.bytes_(value) if isinstance(value, str) else value for key, value in said.items()})
        made = root.create_dataset("image/0/image", data=voxels((3, 5, 6, 7), "i2"), chunks=(1, 5, 6, 7), compression="gzip")
        made.attrs.update({
            "dimorder": np.bytes_("time,zspace,yspace,xspace"), "valid_range": np.array([2.0, 100.0]), "complete": np.bytes_("true_"),
            "varid": np.bytes_("MINC standard variable"), "vartype": np.bytes_("group________")
        })
        for name, values in (("image-min", -10.0 - np.arange(15)), ("image-max", 500.0 + 3 * np.arange(15))):
            made = root.create_dataset(f"image/0/{name}", data=values.reshape(3, 5))
            made.attrs["dimorder"] = np.bytes_("time,zspace")
        info = root.create_group("info")
        for group, values in {
                "patient": {"full_name": "nobody", "sex": "other_"}, "acquisition": {"repetition_time": 2.5, "echo_time": 0.03},
                "study": {"start_time": "2020", "modality": "MRI__"}
        }.items():
            made = info.create_dataset(group, data=np.int32(0))
            made.attrs.update({key: np.bytes_(value) if isinstance(value, str) else value for key, value in values.items()})


def bytes_of_minc1(path):
    """As rawtomnc writes bytes; scaled slice by slice."""
    with netCDF4.Dataset(path, "w", format="NETCDF3_CLASSIC") as file:
        file.setncatts({"ident": "somebody:host:1", "history": "rawtomnc"})
        for name, size in (("zspace", 5), ("yspace", 6), ("xspace", 7)):
            file.createDimension(name, size)
        for name, said in dimensions().items():
            file.createVariable(name, "i4", ()).setncatts({key: value for key, value in said.items() if key != "length"})
        made = file.createVariable("image", "i1", ("zspace", "yspace", "xspace"))
        made.set_auto_maskandscale(False)
        made.setncatts({
            "parent": "rootvariable", "varid": "MINC standard variable", "vartype": "group________", "version": "MINC Version    1.0",
            "complete": "true_", "signtype": "unsigned", "valid_range": np.array([0.0, 250.0]), "image-min": "--->image-min",
            "image-max": "--->image-max"
        })
        made[...] = (voxels((5, 6, 7), "u1") * 2).view("i1")
        for name, low in (("image-min", -5.0), ("image-max", 100.0)):
            limits = file.createVariable(name, "f8", ("zspace",))
            limits.setncatts(dict(STANDARD, vartype="var_attribute"))
            limits[...] = low + np.arange(5)
        file.createVariable("rootvariable", "i4", ()).setncatts({"varid": "MINC standard variable", "children": "image"})
        file.createVariable("patient", "i4", ()).setncatts({"full_name": "nobody", "varid": "MINC standard variable"})


def by_vtk(path):
    made = vtk.vtkImageData()
    made.SetDimensions(7, 6, 5)
    made.SetSpacing(1.5, 2.0, 2.5)
    made.SetOrigin(10, -20, 30)
    made.GetPointData().SetScalars(numpy_to_vtk(voxels(210, "i2"), deep=True))
    writer = vtk.vtkMINCImageWriter()
    writer.SetFileName(str(path))
    writer.SetInputData(made)
    writer.Write()


def read_by_vtk(path):
    reader = vtk.vtkMINCImageReader()
    reader.SetFileName(str(path))
    reader.Update()
    answer = image_answer([reader.GetOutput()], reader.GetOutput().GetPointData().GetScalars().GetName())
    matrix = reader.GetDirectionCosines()
    answer.affine = np.array([[matrix.GetElement(i, j) for j in range(4)] for i in range(4)]) @ answer.affine
    return answer


def read_minc(path):
    """Voxels in the order of the file; nibabel's affine is for that order. libminc takes the smaller number of valid_range first, nibabel
    does not."""
    made = nibabel.load(path)
    if nibabel_turns(path):
        raise ValueError("valid_range falls")
    data = made.get_fdata()
    data = data if data.ndim == 4 else data[None]
    return Answer(fields={(t, 0): volume for t, volume in enumerate(data)}, affine=made.affine)


def nibabel_turns(path):
    if not h5py.is_hdf5(path):
        with netCDF4.Dataset(path) as file:
            limits = getattr(file["image"], "valid_range", [0, 1])
    else:
        with h5py.File(path) as file:
            limits = file["minc-2.0/image/0/image"].attrs.get("valid_range", [0, 1])
    return limits[0] > limits[1]


def hdf5(path, name, types=()):
    return Hdf5Document(path, name, MEANINGS, r"^\d+$", types)


def netcdf(path, name, types=()):
    return NetcdfDocument(path, name, MEANINGS, types)


def sample(name, file, write, read, document, types=()):
    """Types of samples are changed in ITK's files only: in MINC, floats are values and whole numbers are scaled. None for a document: the
    sample alone is compared."""
    kind = name.split("-")[0]
    return Sample(name, file, lambda folder: write(folder / file), lambda folder: [document(folder / file, kind, types)]
                  if document else [], lambda folder: read(folder / file))


def samples(_):
    written = lambda data, **options: lambda path: SimpleITK.WriteImage(image(data, **options), str(path))
    return [
        sample("itk", "a.h5", written(voxels((5, 6, 7), "i2")), read_itk, hdf5, ("<f8", "<i4")),
        sample("itk-vectors", "a.h5", written(voxels((5, 6, 7, 3), "f4"), vector=True), read_itk, hdf5, ("<f8", "<i4")),
        sample("itk-times", "a.hdf5", written(voxels((3, 5, 6, 7), "u1")), read_itk, hdf5, ("<f8", "<i4")),
        sample("minc2", "a.mnc", written(voxels((5, 6, 7), "u1")), read_minc, hdf5),
        sample("minc2-scanner", "a.mnc", scanner, read_minc, hdf5),
        sample("minc1", "a.mnc", bytes_of_minc1, read_minc, netcdf),
        sample("minc1-vtk", "a.mnc", by_vtk, read_by_vtk, None),
    ]
