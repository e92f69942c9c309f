"""BigDataViewer HDF5 with its XML files as npy2bdv writes them, and Imaris files as ImarisWriter lays them out, read by
imaris_ims_file_reader. Registrations of views are those of BigStitcher; docs/formats.md says that the voxel size places a view."""
import h5py
import lxml.etree
import npy2bdv
import numpy as np
from imaris_ims_file_reader.ims import ims

from ablation import Answer, Sample
from documents import XmlDocument
from hdf5_documents import Hdf5Document, Meanings

FOREIGN_READER_CRASHES = True
REMARKS = ("Version", "ImarisVersion", "OriginalFormat", "Filename", "OriginalFormatFileIOVersion", "ThumbnailMode", "ThumbnailSize",
           "Imaris", "Log", "Entries", "LensPower", "NumericalAperture", "ResampleDimensionX", "LSMEmissionWavelength",
           "LSMExcitationWavelength")
MEANINGS = Meanings(
    kinds={"RecordingDate": "date", **{name: "comment" for name in REMARKS}}, roles={"resolutions": "spacing"},
    words={"ColorMode": ("BaseColor", "TableColor"), "Unit": ("um", "nm", "mm", "m"), "dataType": ("uint16", "int16", "uint8")},
    names={"Data": ("dataset",), "cells": ("level", "setup"), "TimePoint *": ("channel",)})
TEXTS = {"size": ("0.5 0.5 2.0",), "unit": ("nm", "um", "mm", "px"), "color": ("-65536",), "active": ("false",)}


class Xml(XmlDocument):
    """With the words and roles of BigDataViewer's elements."""

    def nodes(self):
        nodes = super().nodes()
        for node in nodes:
            words = node.path.split("/")
            element = words[-2] if words[-1] == "text" else words[-1]
            node.words, node.names = TEXTS.get(element, ()), (element, "XML")
            node.role = {"size": "spacing", "affine": "affine"}.get(element, "") if words[-1] == "text" else ""
            remark = element in ("Name", "info") or "generatedBy" in words or "camera" in words or words[1] == "@version"
            node.kind = "comment" if remark else ""
        return nodes


def voxels(shape, dtype, seed=0):
    return np.random.default_rng(21 + seed).integers(1, 250, shape).astype(dtype)


def write_bdv(folder, name, *, times=1, channels=1, subsampling=((1, 1, 1),), **view):
    writer = npy2bdv.BdvWriter(str(folder / f"{name}.h5"), nchannels=channels, subsamp=subsampling,
                               blockdim=((4, 4, 4),) * len(subsampling), overwrite=True)
    writer.set_attribute_labels("channel", tuple(str(488 + 73 * c) for c in range(channels)))
    for time in range(times):
        for channel in range(channels):
            writer.append_view(voxels((5, 6, 7), "u2", 10 * time + channel), time=time, channel=channel, **view)
    writer.write_xml(camera_name="Orca", microscope_name="diSPIM", user_name="somebody")
    writer.close()


def bdv(folder):
    write_bdv(folder, "bdv", times=2, channels=2, voxel_size_xyz=(0.4, 0.5, 2.0), voxel_units="um", exposure_time=10, exposure_units="ms")


def stitched(folder):
    """Registered by BigStitcher, with levels, names, settings of brightness, and a view that is missing in the XML."""
    write_bdv(folder, "stitched", channels=2, subsampling=((1, 1, 1), (1, 2, 2)), voxel_size_xyz=(0.4, 0.4, 1.6), voxel_units="um",
              calibration=(1, 1, 4), m_affine=np.array([[1.0, 0, 0, 20], [0, 1, 0, -30], [0, 0, 1, 5]]), name_affine="Stitching Transform")
    tree = lxml.etree.parse(str(folder / "stitched.xml"))
    for number, setup in enumerate(tree.iter("ViewSetup")):
        if setup.find("name") is None:
            lxml.etree.SubElement(setup, "name").text = f"channel {number}"
    box = lxml.etree.SubElement(tree.getroot(), "BoundingBoxes")
    made = lxml.etree.SubElement(box, "BoundingBoxDefinition", name="My Bounding Box")
    lxml.etree.SubElement(made, "min").text, lxml.etree.SubElement(made, "max").text = "0 0 0", "7 6 20"
    lxml.etree.SubElement(tree.getroot(), "ViewInterestPoints")
    tree.write(str(folder / "stitched.xml"))
    settings(folder / "stitched.settings.xml")


def settings(path):
    """As BigDataViewer saves them."""
    root = lxml.etree.Element("Settings")
    state = lxml.etree.SubElement(root, "ViewerState")
    for active in ("true", "false"):
        lxml.etree.SubElement(
            lxml.etree.SubElement(
                lxml.etree.SubElement(state, "Sources") if state.find("Sources") is None else state.find("Sources"), "Source"),
            "active").text = active
    for name, text in (("Interpolation", "nearestneighbor"), ("DisplayMode", "fs"), ("CurrentSource", "0"), ("CurrentTimePoint", "0")):
        lxml.etree.SubElement(state, name).text = text
    setups = lxml.etree.SubElement(lxml.etree.SubElement(root, "SetupAssignments"), "ConverterSetups")
    for number, color in enumerate((-65536, -16711936)):
        setup = lxml.etree.SubElement(setups, "ConverterSetup")
        for name, text in (("id", number), ("min", 10.0 + number), ("max", 200.0), ("color", color), ("groupId", number)):
            lxml.etree.SubElement(setup, name).text = str(text)
    lxml.etree.ElementTree(root).write(str(path))


def typed(folder):
    """As versions since 2023 write it: with the type of the samples."""
    with h5py.File(folder / "typed.h5", "w") as file:
        file["__DATA_TYPES__"] = h5py.enum_dtype({"INT8": 0, "UINT8": 1}, "u1")
        file["s00/resolutions"], file["s00/subdivisions"] = np.array([[1.0, 1, 1], [2, 2, 1]]), np.array([[4, 4, 4], [4, 4, 4]], "i4")
        file["s00"].attrs["dataType"] = "uint8"
        for time in (0, 5):
            for level, shape in enumerate(((5, 6, 7), (5, 3, 4))):
                file.create_dataset(f"t{time:05}/s00/{level}/cells", data=voxels(shape, "u1", time), chunks=(3, 3, 4), compression="gzip")


def check_setups(path):
    """npy2bdv takes setups by their order in the XML file, not by their numbers."""
    setups = list(lxml.etree.parse(str(path.with_suffix(".xml"))).iter("ViewSetup"))
    with h5py.File(path) as file:
        count = sum(name.startswith("s") for name in file)
    if [setup.findtext("id") for setup in setups] != [str(i) for i in range(count)] or any(not setup.findtext("voxelSize/size")
                                                                                           for setup in setups):
        raise ValueError("setups are not in order")


def read_bdv(path):
    """By npy2bdv, where the XML says the voxel size."""
    check_setups(path)
    editor = npy2bdv.BdvEditor(str(path))
    times, channels = editor.get_attribute_count()[0], editor.get_attribute_count()[2]
    fields = {(t, c): editor.read_view(time=t, channel=c).astype("u2").T.astype(float) for t in range(times) for c in range(channels)}
    size = editor.get_view_property("voxel_size")
    editor.finalize()
    with h5py.File(path) as file:
        return placed(fields, file["s00/resolutions"][0], size)


def placed(fields, factor, size):
    """A voxel of a level lies in the middle of those of the view that it takes together."""
    if len({field.shape for field in fields.values()}) > 1:
        raise ValueError("times or channels differ in size")
    affine = np.diag([*(factor * size), 1.0])
    affine[:3, 3] = 0.5 * (factor - 1) * size
    return Answer(fields=fields, affine=affine)


def read_cells(path):
    with h5py.File(path) as file:
        times = sorted(name for name in file if name.startswith("t"))
        fields = {(t, 0): file[f"{name}/s00/0/cells"][()].T.astype(float) for t, name in enumerate(times)}
        return placed(fields, file["s00/resolutions"][0], np.ones(3))


def letters(target, **attributes):
    for name, value in attributes.items():
        target.attrs[name] = np.frombuffer(str(value).encode(), "S1")


def imaris(path, *, channels=2, times=3, dtype="u2", levels=2, unit="um", table=False):
    with h5py.File(path, "w") as file:
        letters(file, DataSetDirectoryName="DataSet", DataSetInfoDirectoryName="DataSetInfo", ImarisDataSet="ImarisDataSet",
                ImarisVersion="5.5.0", ThumbnailDirectoryName="Thumbnail")
        file.attrs["NumberOfDataSets"] = np.array([1], "u4")
        for level in range(levels):
            size = [5, 6, 7] if level == 0 else [5, 3, 4]
            for time in range(times):
                for channel in range(channels):
                    imaris_level(file.create_group(f"DataSet/ResolutionLevel {level}/TimePoint {time}/Channel {channel}"), size,
                                 voxels((6, 8, 8), dtype, 10 * time + channel))
        info = file.create_group("DataSetInfo")
        letters(info.create_group("Image"), Description="(description not specified)", Name="a scan", Noc=channels,
                RecordingDate="2018-05-24 20:36:07.000", Unit=unit, X=7, Y=6, Z=5, ExtMin0="-3.5", ExtMin1="10", ExtMin2="2",
                ExtMax0="3.5", ExtMax1="22", ExtMax2="17", LensPower="63x", NumericalAperture="1.4",
                OriginalFormat="Bitplane: Imaris 5.5", ResampleDimensionX="true")
        letters(info.create_group("Imaris"), Version="7.0", ThumbnailMode="thumbnailMIP", ThumbnailSize="256")
        letters(info.create_group("Log"), Entries=0)
        stamps = {f"TimePoint{t + 1}": f"2018-05-24 20:36:{7 + 2 * t:02}.500" for t in range(times)}
        letters(info.create_group("TimeInfo"), DatasetTimePoints=times, FileTimePoints=times, **stamps)
        for channel in range(channels):
            letters(info.create_group(f"Channel {channel}"), Name=f"dye {channel}", Description="(description not specified)",
                    Color=f"1.000 {0.25 * channel:.3f} 0.000", ColorMode="TableColor" if table else "BaseColor", ColorOpacity="1.000",
                    ColorRange=f"{5 + channel}.000 250.000", GammaCorrection="1.000", LSMEmissionWavelength="520",
                    LSMExcitationWavelength="488")
            if table:
                info[f"Channel {channel}"].create_dataset("ColorTable", data=np.linspace(0, 1, 768))
                letters(info[f"Channel {channel}"], ColorTableLength=256)
        file.create_dataset("Thumbnail/Data", data=np.zeros((8, 32), "u1"))


def imaris_level(group, size, data):
    data[size[0]:], data[:, size[1]:], data[:, :, size[2]:] = 0, 0, 0  # blocks are whole
    group.create_dataset("Data", data=data, chunks=(3, 4, 4), compression="gzip", compression_opts=2)
    letters(group, ImageSizeX=size[2], ImageSizeY=size[1], ImageSizeZ=size[0], ImageBlockSizeX=4, ImageBlockSizeY=4, ImageBlockSizeZ=3,
            HistogramMin="0.000", HistogramMax="250.000")
    group.create_dataset("Histogram", data=np.bincount(data.ravel().astype(int), minlength=256).astype("u8"))


def read_imaris(path):
    reader = ims(str(path), resolution_decimal_places=None, squeeze_output=False)
    times, channels = reader.shape[:2]
    fields = {(t, c): np.asarray(reader[0, t:t + 1, c:c + 1, :, :, :])[0, 0].T.astype(float) for t in range(times) for c in range(channels)}
    low = [reader.read_numerical_dataset_attr(f"ExtMin{axis}") for axis in range(3)]
    affine = np.diag([*reader.resolution[::-1], 1.0])
    affine[:3, 3] = np.array(low) + 0.5 * np.diag(affine)[:3]
    return Answer(fields=fields, affine=affine)


def bdv_sample(name, write, read, documents, sidecars=()):
    return Sample(name, f"{name}.h5", write,
                  lambda folder: [Hdf5Document(folder / f"{name}.h5", "bdv", MEANINGS, types=()), *documents(folder)],
                  lambda folder: read(folder / f"{name}.h5"), sidecars)


def imaris_sample(name, types=("<f4",), **options):
    file = f"{name}.ims"
    return Sample(name, file, lambda folder: imaris(folder / file, **options),
                  lambda folder: [Hdf5Document(folder / file, "imaris", MEANINGS, numbered=r"(?<=[a-zA-Z] )\d+$", types=types)],
                  lambda folder: read_imaris(folder / file))


def samples(_):
    return [
        bdv_sample("bdv", bdv, read_bdv, lambda folder: [Xml(folder / "bdv.xml", "bdv-xml")], ("bdv.xml",)),
        bdv_sample("stitched", stitched, read_bdv, lambda folder: [Xml(folder / "stitched.xml", "bdv-xml"),
                                                                  Xml(folder / "stitched.settings.xml", "settings-xml")],
                   ("stitched.xml", "stitched.settings.xml")),
        bdv_sample("typed", typed, read_cells, lambda folder: []),
        imaris_sample("imaris"),
        imaris_sample("imaris-table", channels=1, times=1, dtype="u1", levels=1, unit="nm", table=True),
    ]
