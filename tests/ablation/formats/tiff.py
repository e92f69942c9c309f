"""TIFF by tifffile: plain pages, tifffile's own stacks, ImageJ's hyperstacks, OME-TIFF in one and in several files, levels, GeoTIFF."""

import uuid

import lxml.etree
import numpy as np
import tifffile

from ablation import Answer, Sample
from tiff_documents import ImageJBlock, ImageJLines, OmeDocument, ShapedJson, TagsDocument

LENGTHS = {"": 1.0, "µm": 1.0, "um": 1.0, "micron": 1.0, "nm": 1e-3, "mm": 1e3, "cm": 1e4, "m": 1e6, "Å": 1e-4, "inch": 25400.0, "pm": 1e-6}
NAMESPACE = "http://www.openmicroscopy.org/Schemas/OME/2016-06"


def values(shape, dtype=np.uint16, low=1, high=120, seed=5):
    return np.random.default_rng(seed).integers(low, high, shape).astype(dtype)


# Writers.


def plain(folder, dtype=np.uint8, count=5, **options):
    with tifffile.TiffWriter(folder / "a.tif", byteorder=options.pop("byteorder", "<"), bigtiff=options.pop("bigtiff", False)) as writer:
        for k in range(count):
            writer.write(
                values((6, 7), dtype, seed=k),
                photometric=options.get("photometric", "minisblack"),
                metadata=None,
                resolution=(4.0, 2.0),
                resolutionunit="CENTIMETER",
                software="scanner",
                datetime="2024:01:02 10:11:12",
                description="made by a scanner" if k == 0 else None,
                **{key: value for key, value in options.items() if key != "photometric"},
            )


def scanned(folder):
    """A page as scanners and libtiff's users write it, with the tags that they add."""
    extra = [
        (271, 2, 0, "Maker", True),
        (272, 2, 0, "Model", True),
        (315, 2, 0, "Who", True),
        (266, 3, 1, 1, True),
        (274, 3, 1, 1, True),
        (269, 2, 0, "doc", True),
        (285, 2, 0, "page", True),
        (297, 3, 2, (0, 5), True),
        (280, 3, 1, 0, True),
        (281, 3, 1, 255, True),
        (286, 5, 1, (10, 1), True),
        (287, 5, 1, (20, 1), True),
        (316, 2, 0, "host", True),
        (33432, 2, 0, "(c)", True),
    ]
    plain(folder, np.uint8, extratags=extra)


def palette(folder):
    colors = np.random.default_rng(1).integers(0, 65535, (3, 256)).astype(np.uint16)
    plain(folder, np.uint8, photometric="palette", colormap=colors)


def rgb(folder, planar="contig"):
    shape = (6, 7, 3) if planar == "contig" else (3, 6, 7)
    with tifffile.TiffWriter(folder / "a.tif") as writer:
        for k in range(5):
            writer.write(values(shape, np.uint8, seed=k), photometric="rgb", planarconfig=planar, metadata=None, resolution=(4.0, 2.0))


def geo(folder):
    """As GDAL writes it: a page for each band is unusual, a grid of one band is not."""
    extra = [
        (33550, 12, 3, (30.0, 20.0, 0.0), True),
        (33922, 12, 6, (0, 0, 0, 500000.0, 4000000.0, 0), True),
        (34735, 3, 12, (1, 1, 0, 2, 1024, 0, 1, 1, 3076, 0, 1, 9001), True),
        (42113, 2, 0, "-9999", True),
        (
            42112,
            2,
            0,
            '<GDALMetadata><Item name="OFFSET" sample="0" role="offset">3</Item>'
            '<Item name="SCALE" sample="0" role="scale">2</Item></GDALMetadata>',
            True,
        ),
    ]
    stored = values((6, 7), np.float32)
    stored[2, 3] = -9999
    tifffile.imwrite(folder / "a.tif", stored, metadata=None, extratags=extra)


def shaped(folder, shape, axes, dtype=np.float32, **options):
    tifffile.imwrite(
        folder / "a.tif",
        values(shape, dtype),
        photometric="minisblack",
        metadata={"axes": axes, "spacing": 2.5, "unit": "um"},
        resolution=(4.0, 2.0),
        **options,
    )


def imagej(folder, shape, dtype=np.uint16, extra=None, **metadata):
    """As Fiji saves it, in big endian. Fiji writes 1 / width of a pixel with six digits behind the point."""
    tifffile.imwrite(
        folder / "a.tif", values(shape, dtype), imagej=True, byteorder=">", resolution=(4.0, 2.0), metadata=metadata, **(extra or {})
    )


def luts(count):
    ramp = np.arange(256, dtype=np.uint8)
    return [np.stack([ramp * (c % 3 == k) for k in range(3)]).astype(np.uint8) for c in range(count)]


def hyperstack(folder):
    imagej(
        folder,
        (3, 5, 2, 6, 7),
        axes="TZCYX",
        spacing=2.5,
        unit="micron",
        finterval=0.5,
        fps=2.0,
        tunit="sec",
        loop=False,
        mode="composite",
        min=10.0,
        max=90.0,
        xorigin=3.0,
        yorigin=2.0,
        zorigin=1.0,
        hyperstack=True,
        Ranges=(1.0, 100.0, 5.0, 60.0),
        LUTs=luts(2),
        Labels=[f"c:{i}" for i in range(30)],
        Info="Scaling: 1\n",
    )


def calibrated(folder):
    """Signed integers as ImageJ stores them: with 32768 added, and a straight calibration that takes it away."""
    imagej(folder, (5, 6, 7), axes="ZYX", spacing=2.5, unit="um", cf=0, c0=-32768, c1=1, vunit="Gray Value", min=5.0, max=100.0)


def imagej_floats(folder):
    imagej(folder, (4, 6, 7), np.float32, axes="TYX", unit="mm", finterval=2.0, min=1.0, max=50.0)


def ome(folder, shape, axes, dtype=np.uint16, subifds=0, name="a.ome.tif", **metadata):
    stored = values(shape, dtype)
    given = {
        "axes": axes,
        "PhysicalSizeX": 250,
        "PhysicalSizeXUnit": "nm",
        "PhysicalSizeY": 0.0005,
        "PhysicalSizeYUnit": "mm",
        "PhysicalSizeZ": 1500,
        "PhysicalSizeZUnit": "nm",
        "UUID": "urn:uuid:11111111-2222-3333-4444-555555555555",
        **metadata,
    }
    with tifffile.TiffWriter(folder / name, ome=True, bigtiff=subifds > 0) as writer:
        options = dict(photometric="minisblack", resolution=(40000, 20000), resolutionunit="CENTIMETER")
        writer.write(stored, subifds=subifds, metadata=given, **options)
        for level in range(1, subifds + 1):
            writer.write(stored[..., :: 2**level, :: 2**level], subfiletype=1, **options)


def ome_hyperstack(folder):
    ome(
        folder,
        (3, 2, 5, 6, 7),
        "TCZYX",
        Channel={"Name": ["DAPI", "GFP"], "Color": [-16776961, 16711935]},
        TimeIncrement=500,
        TimeIncrementUnit="ms",
        SignificantBits=12,
        Name="embryo",
        Description="an embryo",
        AcquisitionDate="2024-01-02T10:11:12",
        Plane={
            "DeltaT": [0.1 * i for i in range(30)],
            "DeltaTUnit": ["s"] * 30,
            "ExposureTime": [0.05] * 30,
            "PositionX": [10.0] * 30,
            "PositionXUnit": ["µm"] * 30,
            "PositionY": [20.0] * 30,
            "PositionYUnit": ["µm"] * 30,
            "PositionZ": [1.5 * (i % 5) for i in range(30)],
            "PositionZUnit": ["µm"] * 30,
        },
    )


def bio_formats_xml(names):
    """As Bio-Formats writes it: two channels, each in a file of its own, planes of a channel named one by one."""
    channels = "".join(
        f'<Channel ID="Channel:0:{c}" Name="{n}" Color="{color}" SamplesPerPixel="1" EmissionWavelength="{e}" '
        f'EmissionWavelengthUnit="nm" ExcitationWavelength="{e - 30}" ExcitationWavelengthUnit="nm" Fluor="{n}" '
        f'AcquisitionMode="LaserScanningConfocalMicroscopy"><LightPath/></Channel>'
        for c, (n, color, e) in enumerate([("DAPI", 65535, 461), ("GFP", 16711935, 509)])
    )
    planes = "".join(
        f'<TiffData FirstC="{c}" FirstT="0" FirstZ="{z}" IFD="{z}" PlaneCount="1"><UUID FileName="{names[c]}">{IDS[c]}</UUID></TiffData>'
        for c in range(2)
        for z in range(5)
    )
    places = "".join(
        f'<Plane TheC="{c}" TheT="0" TheZ="{z}" DeltaT="{z / 10}" DeltaTUnit="s" ExposureTime="0.05" ExposureTimeUnit="s" '
        f'PositionX="100.0" PositionXUnit="µm" PositionY="200.0" PositionYUnit="µm" PositionZ="{z * 1.5}" PositionZUnit="µm"/>'
        for c in range(2)
        for z in range(5)
    )
    return (
        f'<?xml version="1.0" encoding="UTF-8" standalone="no"?><OME xmlns="{NAMESPACE}" Creator="OME Bio-Formats 7.3.0" UUID="%s">'
        '<Instrument ID="Instrument:0"><Objective ID="Objective:0" LensNA="1.2" NominalMagnification="40.0" Immersion="Water"/></Instrument>'
        '<Image ID="Image:0" Name="embryo"><AcquisitionDate>2024-01-02T10:11:12</AcquisitionDate><Description>an embryo</Description>'
        '<InstrumentRef ID="Instrument:0"/><ObjectiveSettings ID="Objective:0" RefractiveIndex="1.33"/>'
        '<StageLabel Name="stage" X="10.0" XUnit="µm" Y="20.0" YUnit="µm" Z="3.0" ZUnit="µm"/>'
        '<Pixels ID="Pixels:0" BigEndian="true" DimensionOrder="XYZCT" Interleaved="false" PhysicalSizeX="0.25" PhysicalSizeXUnit="µm" '
        'PhysicalSizeY="0.5" PhysicalSizeYUnit="µm" PhysicalSizeZ="1.5" PhysicalSizeZUnit="µm" SignificantBits="16" SizeC="2" SizeT="1" '
        f'SizeX="7" SizeY="6" SizeZ="5" TimeIncrement="2.0" TimeIncrementUnit="s" Type="uint16">{channels}{planes}{places}</Pixels></Image>'
        '<StructuredAnnotations><XMLAnnotation ID="Annotation:0" Namespace="openmicroscopy.org/OriginalMetadata"><Value><OriginalMetadata>'
        "<Key>Gain</Key><Value>3</Value></OriginalMetadata></Value></XMLAnnotation></StructuredAnnotations></OME>"
    )


IDS = [uuid.uuid5(uuid.NAMESPACE_URL, str(c)).urn for c in range(2)]


def bio_formats(folder):
    names = ["a_c0.ome.tif", "a_c1.ome.tif"]
    for c, name in enumerate(names):
        write_pages(folder / name, (bio_formats_xml(names) % IDS[c]).encode(), 2 + c)


def companion(folder):
    """The XML in a file of its own; the pages name it alone."""
    names = ["a_c0.tif", "a_c1.tif"]
    (folder / "a.companion.ome").write_bytes((bio_formats_xml(names) % uuid.uuid5(uuid.NAMESPACE_URL, "xml").urn).encode())
    for c, name in enumerate(names):
        write_pages(
            folder / name,
            f'<OME xmlns="{NAMESPACE}" UUID="{IDS[c]}"><BinaryOnly MetadataFile="a.companion.ome" '
            f'UUID="{uuid.uuid5(uuid.NAMESPACE_URL, "xml").urn}"/></OME>'.encode(),
            2 + c,
        )


def write_pages(path, description, seed):
    with tifffile.TiffWriter(path, byteorder=">") as writer:
        for k, page in enumerate(values((5, 6, 7), np.uint16, seed=seed)):
            writer.write(page, photometric="minisblack", metadata=None, description=description if k == 0 else None)


def reduced_pages(folder):
    """Levels as pages of reduced resolution behind those of full resolution."""
    stored = values((6, 7), np.uint16)
    with tifffile.TiffWriter(folder / "a.tif") as writer:
        writer.write(stored, metadata=None, resolution=(4.0, 2.0))
        writer.write(stored[::2, ::2], metadata=None, subfiletype=1)


# The foreign reader.


def by_time_and_channel(stored, axes, names):
    """Voxels [x, y, z] by (time, channel). `names`: axes that are times, channels and slices."""
    for axis, name in zip("tcz", names):
        found = [a for a in axes if a in name]
        if len(found) > 1:
            raise ValueError(axes)
        if not found:
            stored, axes = stored[np.newaxis], axis + axes
        else:
            axes = axes.replace(found[0], axis)
    order = [axes.index(a) for a in "tczYX"]
    stored = np.transpose(stored, order)
    return {(t, c): stored[t, c].transpose(2, 1, 0).astype(float) for t in range(stored.shape[0]) for c in range(stored.shape[1])}


def resolution_of(page, axis):
    tag = page.tags.get({"x": 282, "y": 283}[axis])
    if tag is None:
        return None
    above, below = tag.value
    return above / below if above and below else None


def affine_of(spacing):
    return np.diag([*spacing, 1.0]) if all(s and np.isfinite(s) and s > 0 for s in spacing) else None


def ratio_spacing(page):
    """1, and along y the ratio of the resolutions."""
    x, y = resolution_of(page, "x"), resolution_of(page, "y")
    return (1.0, x / y if x and y else 1.0, 1.0)


def read_pages(path):
    """Pages in their order. Of one page spacing alone is told."""
    with tifffile.TiffFile(path) as file:
        pages = [page for page in file.pages if not page.is_reduced]
        if len({(page.shape, page.dtype) for page in pages}) > 1:
            raise ValueError("pages differ")
        stored = np.stack([page.asarray() for page in pages])
        page = pages[0]
        if page.photometric in (5, 6, 8) or page.sampleformat in (5, 6):
            raise ValueError("colour")
        if page.samplesperpixel > 1:
            axis = 3 if page.planarconfig == 1 else 1
            fields = {(0, c): np.take(stored, c, axis).transpose(2, 1, 0).astype(float) for c in range(page.samplesperpixel)}
        else:
            fields = {(0, 0): stored.transpose(2, 1, 0).astype(float)}
        return Answer(fields=fields, affine=affine_of(ratio_spacing(page)))


def read_shaped(path):
    with tifffile.TiffFile(path) as file:
        series = file.shaped_metadata and file.series[0]
        if not series:
            raise ValueError("not shaped")
        return Answer(
            fields=by_time_and_channel(series.asarray(), series.axes, ("T", "C", "ZQI")), affine=affine_of(ratio_spacing(file.pages[0]))
        )


def read_imagej(path):
    with tifffile.TiffFile(path) as file:
        said = file.imagej_metadata
        stored = file.series[0].asarray().astype(float)
        if said.get("cf") == 0 and "c0" in said and "c1" in said:
            stored = said["c0"] + said["c1"] * stored
        times = "T" if "Z" in file.series[0].axes or int(said.get("slices", 1)) > 1 else "_"
        fields = by_time_and_channel(stored, file.series[0].axes, (times, "CS", "Z" if times == "T" else "ZT"))
        x, y = resolution_of(file.pages[0], "x"), resolution_of(file.pages[0], "y")
        spacing = (1 / x if x else 1.0, 1 / y if y else 1.0, abs(float(said.get("spacing", 1.0))))
        known = {"micron": 1, "um": 1, "µm": 1, "\\u00B5m": 1, "mm": 1, "cm": 1, "nm": 1, "sec": 0}
        return Answer(fields=fields, affine=affine_of(spacing) if known.get(said.get("unit")) else None)


def read_ome(path, xml=None):
    """Voxels by tifffile; lengths from the XML, in µm."""
    with tifffile.TiffFile(path) as file:
        text = xml or file.ome_metadata
        series = file.series[0]
        if series.kind != "ome" and xml is None:
            raise ValueError("no OME-TIFF")
        fields = by_time_and_channel(series.asarray(), series.axes, ("T", "CS", "Z"))
    pixels = lxml.etree.fromstring(text.encode()).find(".//{*}Pixels")
    spacing = []
    for axis in "XYZ":
        size, unit = pixels.get(f"PhysicalSize{axis}"), pixels.get(f"PhysicalSize{axis}Unit", "µm")
        spacing.append(None if size is None or unit not in LENGTHS else float(size) * LENGTHS[unit])
    return Answer(fields=fields, affine=affine_of(spacing))


def sample(name, write, documents, read=None, source="a.tif", sidecars=()):
    return Sample(name, source, write, documents, read and (lambda folder: read(folder / source)), sidecars)


def pages_of(folder):
    """What all pages say, and what one says otherwise."""
    path = folder / "a.tif"
    return [TagsDocument(path, "tags"), TagsDocument(path, "page-tags", 1)]


def samples(_):
    def tags(name):
        return lambda folder: [TagsDocument(folder / "a.tif", name)]

    def jpeg(folder):
        return [ImageJLines(folder / "a.tif"), TagsDocument(folder / "a.tif", "tags", hidden=(270, 50838, 50839))] + (
            [ImageJBlock(folder / "a.tif")] if 50839 in tifffile.TiffFile(folder / "a.tif").pages[0].tags else []
        )

    def ome_documents(folder):
        return [OmeDocument(folder / "a.ome.tif"), TagsDocument(folder / "a.ome.tif", "tags")]

    def several(folder):
        return [OmeDocument(folder / "a_c0.ome.tif"), TagsDocument(folder / "a_c1.ome.tif", "page-tags")]

    return [
        sample("plain", scanned, pages_of, read_pages),
        sample("rgb", rgb, pages_of, read_pages),
        sample("tiles", lambda folder: plain(folder, np.float32, tile=(16, 16), compression="zlib", predictor=True), pages_of, read_pages),
        sample("hyperstack", hyperstack, jpeg, read_imagej),
        sample("ome", ome_hyperstack, ome_documents, read_ome, "a.ome.tif"),
        sample("ome-rgb", lambda folder: ome_rgb(folder), ome_documents, read_ome, "a.ome.tif"),
        sample("geo", geo, tags("tags"), read_pages),
        sample(
            "shaped", lambda folder: shaped(folder, (5, 6, 7), "ZYX"), lambda f: [ShapedJson(f / "a.tif"), *tags("tags")(f)], read_shaped
        ),
        sample("calibrated", calibrated, jpeg, read_imagej),
        sample("bio-formats", bio_formats, several, read_ome, "a_c0.ome.tif", ("a_c1.ome.tif",)),
        sample("white", lambda folder: plain(folder, photometric="miniswhite"), pages_of, read_pages),
        sample("palette", palette, pages_of, read_pages),
        sample("strips", lambda folder: plain(folder, np.int16, byteorder=">", rowsperstrip=2), pages_of, read_pages),
        sample("lzw", lambda folder: plain(folder, np.uint16, compression="lzw", bigtiff=True), pages_of, read_pages),
        sample("rgb-planes", lambda folder: rgb(folder, "separate"), pages_of, read_pages),
        sample("halves", lambda folder: plain(folder, np.float16), pages_of, read_pages),
        sample("reduced", reduced_pages, lambda folder: [TagsDocument(folder / "a.tif", "reduced-tags", 1)], read_pages),
        sample(
            "shaped-times",
            lambda folder: shaped(folder, (3, 2, 5, 6, 7), "TCZYX", np.uint16),
            lambda f: [ShapedJson(f / "a.tif")],
            read_shaped,
        ),
        sample("imagej-times", imagej_floats, jpeg, read_imagej),
        sample("imagej-rgb", lambda folder: imagej(folder, (5, 6, 7, 3), np.uint8, axes="ZYXS", spacing=3.0, unit="nm"), jpeg, read_imagej),
        sample("ome-levels", lambda folder: ome(folder, (5, 64, 48), "ZYX", subifds=2), ome_documents, read_ome, "a.ome.tif"),
        Sample(
            "companion",
            "a.companion.ome",
            companion,
            lambda folder: [OmeDocument(folder / "a.companion.ome", xml=True), OmeDocument(folder / "a_c0.tif", "binary-only")],
            None,
            ("a_c1.tif",),
        ),
    ]


def ome_rgb(folder):
    with tifffile.TiffWriter(folder / "a.ome.tif", ome=True) as writer:
        writer.write(
            values((5, 6, 7, 3), np.uint8),
            photometric="rgb",
            metadata={
                "axes": "ZYXS",
                "PhysicalSizeX": 0.25,
                "PhysicalSizeY": 0.5,
                "PhysicalSizeZ": 1.5,
                "UUID": "urn:uuid:11111111-2222-3333-4444-555555555556",
            },
        )
