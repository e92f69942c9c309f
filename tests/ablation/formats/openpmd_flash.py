"""openPMD by openPMD-api, and as programs in Fortran write it; FLASH files by h5py as yt's and VTK's readers take them."""
import h5py
import numpy as np
import openpmd_api
import vtk

from ablation import Answer, Sample
from hdf5_documents import Hdf5Document, Meanings

FOREIGN_READER_CRASHES = True
REMARKS = ("openPMD", "openPMDextension", "softwareDependencies", "sim info", "fieldSmoothing", "minimum", "maximum", "run_comment",
           "nstep", "usegravity", "xl_boundary_type", "redshift", "corners", "lrefine_max", "splitnumblocks")
MEANINGS = Meanings(
    kinds={"filenames": "identifier", **{name: "comment"
                                         for name in REMARKS}}, roles={
               "gridSpacing": "spacing", "gridGlobalOffset": "affine", "gridUnitSI": "unit", "position": "offset", "unitSI": "scale",
               "bounding box": "affine"
           }, names={
               "meshesPath": ("meshes", "mesh"), "basePath": ("data",), "bounding box": ("block", "bounding box"),
               "refine level": ("level",), "axisLabels": ("axes",), "shape": ("mesh",), "E": ("mesh",), "rho": ("mesh",),
               "meshes": ("mesh", "data"), "openPMD": ("dataset",), "gridSpacing": ("step along",), "gridUnitSI": ("step along",)
           }, words={
               "geometry": ("cartesian", "thetaMode", "cylindrical", "spherical"), "dataOrder": ("C", "F"),
               "axisLabels": (["x", "y", "z"], ["y", "x", "z"]), "iterationEncoding": ("fileBased", "groupBased", "variableBased")
           })


def voxels(shape, dtype="f4", seed=0):
    return (np.random.default_rng(51 + seed).random(shape) * 90 + 1).astype(dtype)


def laser(path):
    """As PIConGPU and WarpX write it: a vector with a constant component, on cells that are staggered, beside a density and particles."""
    series = openpmd_api.Series(str(path), openpmd_api.Access.create)
    series.set_author("somebody")
    series.set_software("PIConGPU", "0.6.0")
    for number in range(3):
        iteration = series.iterations[100 * number]
        iteration.time, iteration.dt, iteration.time_unit_SI = 3 + 2.0 * number, 0.02, 0.5
        field = iteration.meshes["E"]
        grid(field, {openpmd_api.Unit_Dimension.L: 1, openpmd_api.Unit_Dimension.M: 1, openpmd_api.Unit_Dimension.I: -1,
                     openpmd_api.Unit_Dimension.T: -3})
        for name, shift in zip("xyz", ([0.0, 0.5, 0.25], [0.5, 0.0, 0.0], [0.0, 0.0, 0.5])):
            component = field[name]
            component.position, component.unit_SI = np.array(shift), 1e9
            store(component, voxels((5, 6, 7), seed=number + ord(name)) if name != "z" else None)
        density = iteration.meshes["rho"]
        grid(density, {openpmd_api.Unit_Dimension.L: -3})
        store(density[openpmd_api.Mesh_Record_Component.SCALAR], voxels((5, 6, 7), "f8", number))
        position = iteration.particles["electrons"]["position"]["x"]
        position.reset_dataset(openpmd_api.Dataset(np.dtype("f4"), [4]))
        position.store_chunk(np.arange(4, dtype="f4"))
        series.flush()
    series.close()


def grid(mesh, dimension):
    mesh.geometry, mesh.axis_labels = openpmd_api.Geometry.cartesian, ["z", "y", "x"]
    mesh.grid_spacing, mesh.grid_global_offset, mesh.grid_unit_SI, mesh.time_offset = [2.0, 1.0, 0.5], [10.0, 20.0, 30.0], 1e-6, 0.25
    mesh.unit_dimension = dimension


def store(component, values):
    shape, dtype = (values.shape, values.dtype) if values is not None else ((5, 6, 7), np.dtype("f4"))
    component.reset_dataset(openpmd_api.Dataset(dtype, shape))
    component.make_constant(1.5) if values is None else component.store_chunk(values)


def fortran(path):
    """Of one iteration, with attributes in the order of Fortran."""
    with h5py.File(path, "w") as file:
        file.attrs.update({
            key: np.bytes_(value)
            for key, value in (("openPMD", "1.1.0"), ("basePath", "/data/%T/"), ("meshesPath", "fields/"),
                               ("iterationEncoding", "fileBased"), ("iterationFormat", "data%T.h5"))
        })
        file.attrs["openPMDextension"] = np.uint32(1)
        iteration = file.create_group("data/42")
        iteration.attrs.update({"time": 1.0, "dt": 0.5, "timeUnitSI": 1e-15})
        made = iteration.create_dataset("fields/rho", data=voxels((5, 6, 7), "f8"))
        made.attrs.update({"geometry": np.bytes_("cartesian"), "dataOrder": np.bytes_("F"), "axisLabels": np.array([b"x", b"y", b"z"]),
                           "gridSpacing": np.array([0.5, 1.0, 2.0]), "gridGlobalOffset": np.array([-1.0, 0.0, 4.0]), "gridUnitSI": 1e-3,
                           "position": np.array([0.5, 0.0, 0.5]), "unitSI": 1.0, "unitDimension": np.zeros(7), "timeOffset": 0.0,
                           "fieldSmoothing": np.bytes_("none")})


def stored(path, name):
    """Iterations, and components with samples, of the first of them: openPMD-api leaves out what lacks an attribute."""
    with h5py.File(path) as file:
        iterations = [key for key in file["data"] if key.isdigit()]
        mesh = next(file[f"data/{iterations[0]}/{group}/{name}"] for group in ("meshes", "fields")
                    if group in file[f"data/{iterations[0]}"])
        return len(iterations), 1 if isinstance(mesh, h5py.Dataset) else sum(isinstance(each, h5py.Dataset) for each in mesh.values())


def place_of(mesh, component):
    """The order of the axes x, y, z in the file, and the affine, in metres."""
    labels, spacing, start = list(mesh.axis_labels), np.array(mesh.grid_spacing), np.array(mesh.grid_global_offset)
    if mesh.geometry != openpmd_api.Geometry.cartesian or sorted(labels) != ["x", "y", "z"]:
        raise ValueError("has no axes x, y and z")
    shift = np.array(component.position) if len(component.position) == 3 else np.zeros(3)
    order = [labels.index(letter) for letter in "xyz"]
    affine = np.diag([*(mesh.grid_unit_SI * spacing[order]), 1.0])
    affine[:3, 3] = mesh.grid_unit_SI * (start + shift * spacing)[order]
    return [2 - i for i in order] if str(mesh.data_order).endswith("F") else order, affine


def read_openpmd(path, name, channel=0):
    """One component with samples; only times that lie where the first one lies."""
    series = openpmd_api.Series(str(path), openpmd_api.Access.read_only)
    fields, seconds, first = {}, [], None
    for number, index in enumerate(series.iterations):
        iteration = series.iterations[index]
        seconds.append(iteration.time * iteration.time_unit_SI)
        mesh = iteration.meshes[name]
        components = [mesh[key] for key in sorted(mesh) if not mesh[key].constant]
        if number == 0 and (len(series.iterations), len(components)) != stored(path, name):
            raise ValueError("openPMD-api leaves something out")
        axes, affine = place_of(mesh, components[channel])
        first = affine if first is None else first
        values = components[channel].load_chunk()
        series.flush()
        if np.array_equal(first, affine) and (number == 0 or values.transpose(axes).shape == fields[0, channel].shape):
            fields[number, channel] = values.transpose(axes).astype(float)
    steps = np.diff(seconds)
    even = len(steps) and steps[0] > 0 and np.allclose(steps, steps[0])
    return Answer(fields=fields, affine=first, facts={"times": [len(seconds), float(seconds[-1] - seconds[0]) / len(steps), "s"] if even
                                                      else [len(seconds), None, ""]})


def flash(path):
    """A block of level 1 and its eight children, as FLASH 4 writes plot files."""
    with h5py.File(path, "w") as file:
        low, high = np.array([-1.0, 0.0, 2.0]), np.array([3.0, 2.0, 5.0])
        boxes, levels = [np.stack([low, high], -1)], [1]
        for child in range(8):
            half = (high - low) / 2
            corner = low + half * [child & 1, child >> 1 & 1, child >> 2 & 1]
            boxes.append(np.stack([corner, corner + half], -1))
            levels.append(2)
        boxes, count = np.array(boxes), len(levels)
        file["bounding box"], file["refine level"], file["node type"] = boxes, np.array(levels, "i4"), np.array([2] + [1] * 8, "i4")
        file["coordinates"], file["block size"] = boxes.mean(2), boxes[:, :, 1] - boxes[:, :, 0]
        file["gid"], file["processor number"], file["which child"] = -np.ones(
            (count, 15), "i4"), np.zeros(count, "i4"), np.arange(count, dtype="i4") % 9
        file["unknown names"] = np.array([[b"dens"], [b"temp"]])
        for number, name in enumerate(("dens", "temp")):
            made = file.create_dataset(name, data=voxels((count, 2, 4, 6), "f4" if number else "f8", number))
            made.attrs.update({"minimum": np.float64(1), "maximum": np.float64(91)})
        table(file, "integer scalars",
              {"nxb": 6, "nyb": 4, "nzb": 2, "dimensionality": 3, "globalnumblocks": count, "nstep": 7, "splitnumblocks": count}, "<i4")
        table(file, "real scalars", {"time": 0.5, "dt": 0.01, "redshift": 0.0}, "<f8")
        table(file, "string scalars", {"xl_boundary_type": b"periodic"}, "S80")
        table(file, "logical scalars", {"corners": 0}, "<i4")
        table(file, "integer runtime parameters", {"lrefine_max": 2, "nblockx": 1, "nblocky": 1, "nblockz": 1}, "<i4")
        table(file, "real runtime parameters", {"xmin": -1.0, "xmax": 3.0, "ymin": 0.0, "ymax": 2.0, "zmin": 2.0, "zmax": 5.0}, "<f8")
        table(file, "string runtime parameters", {"geometry": b"cartesian", "pc_unitsbase": b"CGS", "run_comment": b"none"}, "S80")
        table(file, "logical runtime parameters", {"usegravity": 0}, "<i4")
        info = np.zeros(
            1, np.dtype([("file format version", "<i4"), ("setup call", "S400"), ("file creation time", "S80"),
                         ("flash version", "S80")]))
        info["file format version"], info["flash version"] = 9, b"FLASH 4.6"
        file["sim info"] = info


def table(file, name, rows, kind):
    file[name] = np.array([(key.ljust(80).encode(), value) for key, value in rows.items()], np.dtype([("name", "S80"), ("value", kind)]))


def read_flash(path, name):
    """The leaves of the finest level, by VTK; the file's own blocks if VTK fills the box with them."""
    reader = vtk.vtkAMRFlashReader()
    reader.SetFileName(str(path))
    reader.UpdateInformation()
    reader.SetMaxLevel(1)
    reader.SetCellArrayStatus(name, 1)
    reader.Update()
    mesh = reader.GetOutput()
    level = mesh.GetNumberOfLevels() - 1
    images = [mesh.GetDataSet(level, i) for i in range(mesh.GetNumberOfBlocks(level))]
    spacing = np.array(images[0].GetSpacing())
    low = np.min([image.GetBounds()[::2] for image in images], axis=0)
    high = np.max([image.GetBounds()[1::2] for image in images], axis=0)
    values = np.full(np.rint((high - low) / spacing).astype(int), np.nan)
    for image in images:
        first = np.rint((np.array(image.GetBounds()[::2]) - low) / spacing).astype(int)
        cells = np.array(image.GetDimensions()) - 1
        values[tuple(slice(a, a + n) for a, n in zip(first, cells))] = np.array(image.GetCellData().GetArray(name)).reshape(cells[::-1]).T
    affine = np.diag([*spacing, 1.0])
    affine[:3, 3] = low + spacing / 2
    if np.isnan(values).any():
        raise ValueError("the finest level does not fill its box")
    return Answer(fields={(0, 0): values}, affine=affine)


def sample(name, write, read, options="", numbered=r"^\d+$", file=None, document=None):
    file = file or f"{name}.h5"
    return Sample(name, file + options, lambda folder: write(folder / file),
                  lambda folder: [Hdf5Document(folder / file, document or name, MEANINGS, numbered=numbered, types=("<f8", ">f4"))],
                  lambda folder: read(folder / file))


def samples(_):
    return [
        sample("laser", laser, lambda path: read_openpmd(path, "E"), "?dataset=E", document="openpmd"),
        sample("laser-y", laser, lambda path: read_openpmd(path, "E", 1), "?dataset=E,channel=1", document="openpmd"),
        sample("density", laser, lambda path: read_openpmd(path, "rho"), "?dataset=rho", document="openpmd"),
        sample("fortran", fortran, lambda path: read_openpmd(path, "rho"), file="data42.h5"),
        sample("flash", flash, lambda path: read_flash(path, "dens"), "?dataset=dens", file="run_hdf5_plt_cnt_0042"),
    ]
