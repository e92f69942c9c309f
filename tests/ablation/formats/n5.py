"""N5 by TensorStore, with the attributes of COSEM, n5-viewer, Fiji, Paintera, tools of funkelab and BigStitcher, as these write them."""
import json
import shutil

import numpy as np
import tensorstore

from ablation import Change, Sample
from array_documents import Metadata, affine, answer, numbers
from documents import XmlDocument

UNITS = ("mm", "pixel")
COMMENT, IDENTIFIER, DATE = {"kind": "comment"}, {"kind": "identifier"}, {"kind": "date"}
ARRAY = ("dataType", "dimensions", "blockSize", "compression")
PACKED = ("block", "damaged", "bytes", "compression")
VOXEL, STEPS = [8.0, 4.0, 2.0], ((1, 1, 1), (2, 2, 2))


def opened(folder, **spec):
    return tensorstore.open({"driver": "n5", "kvstore": {"driver": "file", "path": str(folder)}, **spec}).result()


def write(folder, data, compression=None, block=None, **attributes):
    """`data`: along the axes as N5 names them, x first. More attributes are put beside those of N5, by any program."""
    metadata = {"dataType": str(data.dtype), "dimensions": data.shape, "blockSize": block or [4, 6, 3, 1, 1][:data.ndim],
                "compression": compression or {"type": "gzip", "level": 5, "useZlib": False}}
    opened(folder, metadata=metadata, create=True).write(data).result()
    tell(folder, **attributes)


def tell(folder, **attributes):
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "attributes.json"
    known = json.loads(path.read_text()) if path.is_file() else {}
    path.write_text(json.dumps({**known, **attributes}))


def again(name, dtype=None, compression=None):
    """The same samples of another type, or packed in another way."""
    def made(document):
        def act():
            folder = document.path.parent
            data, attributes = opened(folder).read().result(), json.loads(document.path.read_text())
            shutil.rmtree(folder)
            write(folder, data.astype(dtype or data.dtype), compression or attributes["compression"], attributes["blockSize"],
                  **{key: value for key, value in attributes.items() if key not in ARRAY})
        return Change(name, lambda: setattr(document, "act", act), same=True)
    return made


def changes(*listed):
    return lambda document, _: [change(document) for change in listed]


TRAITS = {"dataType": {"more": changes(again("samples are int32", "int32"), again("samples are float64", "float64")), "names": PACKED},
          "compression": {"more": changes(again("packed by blosc", compression={"type": "blosc", "cname": "lz4", "clevel": 5,
                                                                                "shuffle": 1}),
                                          again("packed by xz", compression={"type": "xz"}),
                                          again("not packed", compression={"type": "raw"}))},
          "compression/type": {"words": ("raw", "zstd", "lz4"), "names": PACKED}, "dimensions": {"names": ("axes", "size", *PACKED)},
          "blockSize": {"names": PACKED}, "compression/useZlib": {"names": PACKED, "default": False},
          "unit": {"role": "unit", "words": UNITS}, "units": {"role": "unit"}, "pixelUnit": {"role": "unit", "words": UNITS},
          "scale": {"role": "spacing"}, "translate": {"role": "offset"}, "resolution": {"role": "spacing"}, "offset": {"role": "offset"},
          "affineTransform": {"role": "affine"}, "name": COMMENT, "pixelWidth": {"role": "spacing"},
          "numChannels": {"names": ("channels",)},
          "numFrames": {"names": ("axes",)}, "numSlices": {"names": ("slices", "channels")}, "n5": {}, "@type": IDENTIFIER,
          "description": COMMENT,
          "path": {"names": ("must be a dataset", "a part of it is empty")}, "axes": {"names": ("scale",), "default": ["x", "y", "z"]},
          "transform/axes": {"names": ("scale",), "default": ["z", "y", "x"]},
          "multiscales/*/datasets/*/transform/axes": {"names": ("scale",), "default": ["z", "y", "x"]},
          "multiscales/*/axes/*": {"names": ("scale",)}}


def array_document(folder):
    """What N5 itself says of a dataset."""
    every = json.loads((folder / "attributes.json").read_text())
    return Metadata(folder / "attributes.json", "dataset", without=tuple(key for key in every if key not in ARRAY), traits=TRAITS)


def place_document(folder, name):
    """What programs say of it besides."""
    return Metadata(folder / "attributes.json", name, without=ARRAY, traits=TRAITS)


def said(folder):
    path = folder / "attributes.json"
    return json.loads(path.read_text()) if path.is_file() else {}


def along(axes, numbers_of, missing):
    return [float(numbers_of[axes.index(axis)]) if axis in axes else missing for axis in "xyz"]


def cosem(folder, own=True):
    """Levels with `transform`, and what older programs read instead (https://github.com/janelia-cosem/schemas). `own`: in levels, too."""
    data = numbers((8, 6, 4), "uint8")
    listed = []
    for level, factor in enumerate((1, 2)):
        scale = [size * factor for size in VOXEL]
        transform = {"axes": ["z", "y", "x"], "units": ["nm"] * 3, "scale": scale,
                     "translate": [10 + size * (factor - 1) / 2 for size in VOXEL]}
        more = {"transform": transform, "pixelResolution": {"dimensions": scale[::-1], "unit": "nm"}}
        write(folder / "em" / f"s{level}", data[::factor, ::factor, ::factor], **(more if own else {}))
        listed.append({"path": f"s{level}", "transform": transform})
    tell(folder, n5="2.5.1")
    tell(folder / "em", axes=["x", "y", "z"], units=["nm"] * 3, scales=[[1, 1, 1], [2, 2, 2]], name="em",
         multiscales=[{"name": "em", "datasets": listed}], pixelResolution={"dimensions": VOXEL[::-1], "unit": "nm"})


def first_level(folder):
    """What `multiscales` says of its first dataset, and the path of it; s0 without it."""
    listed = said(folder).get("multiscales", [{"datasets": [{"path": "s0"}]}])[0]["datasets"][0]
    return listed, folder / listed["path"]


def read_cosem(folder):
    """By the schema of COSEM and n5-metadata: lists are in the order of the axes that they name; voxels stay where they are."""
    listed, path = first_level(folder / "em")
    transform = said(path).get("transform") or listed["transform"]
    axes = transform.get("axes", ["z", "y", "x"])
    return answer(opened(path).read().result(), list("xyz"),
                  affine=affine(along(axes, transform["scale"], 1.0), along(axes, transform.get("translate", [0] * 3), 0.0)))


def pixels(folder, own=False):
    """A pyramid of n5-spark: the group says how large voxels are and how levels shrink; or, `own`, each level does."""
    data, size = numbers((8, 6, 4), "uint8"), {"dimensions": [4.0, 8.0, 40.0], "unit": "um"}
    for level, factor in enumerate((1, 2)):
        more = {"downsamplingFactors": [factor] * 3, "pixelResolution": size} if own else {}
        write(folder / "em" / f"s{level}", data[::factor, ::factor, ::factor], **more)
    tell(folder, n5="2.5.1")
    tell(folder / "em", name="em")
    if not own:
        tell(folder / "em", axes=["x", "y", "z"], units=["nm"] * 3, scales=[[1, 1, 1], [2, 2, 2]], pixelResolution=size)


def shrunk(size, factors):
    """Spacing and origin of a level whose voxels are the means of blocks (n5-viewer)."""
    factors = np.array(factors, float)
    if len(size) != 3 or len(factors) != 3 or not np.all(factors > 0):
        raise ValueError("not factors of three axes")
    return affine(factors * size, 0.5 * (factors - 1) * size)


def read_pixels(folder):
    attributes = {**said(folder / "em" / "s0"), **said(folder / "em")}
    axes = attributes.get("axes", ["x", "y", "z"])
    factors = attributes.get("downsamplingFactors") or attributes.get("scales", [[1] * 3])[0]
    size = np.array(along(axes, attributes["pixelResolution"]["dimensions"], 1.0))
    return answer(opened(folder / "em" / "s0").read().result(), axes, affine=shrunk(size, factors))


def ngff(folder):
    """Levels as Fiji's plugin N5 writes them with the metadata type `OME-NGFF`: its names in N5's attributes."""
    data = numbers((8, 6, 4), "float32")
    for level, factor in enumerate((1, 2)):
        write(folder / "em" / f"s{level}", data[::factor, ::factor, ::factor], {"type": "zstd", "level": 3})
    steps = [[{"type": "scale", "scale": [size * factor for size in VOXEL]},
              {"type": "translation", "translation": [size * (factor - 1) / 2 for size in VOXEL]}] for factor in (1, 2)]
    tell(folder, n5="2.5.1")
    tell(folder / "em", multiscales=[{"name": "em", "version": "0.4", "axes": [{"name": a, "type": "space",
                                                                                "unit": "micrometer"} for a in "zyx"],
                                      "datasets": [{"path": f"s{i}", "coordinateTransformations": step} for i, step in enumerate(steps)]}])


def read_ngff(folder):
    listed, path = first_level(folder / "em")
    axes, scale, shift = [axis["name"] for axis in said(folder / "em")["multiscales"][0]["axes"]], [1.0] * 3, [0.0] * 3
    if sorted(axes) != ["x", "y", "z"]:
        raise ValueError("not the axes of a volume")
    for one in listed["coordinateTransformations"]:
        if one["type"] == "scale":
            scale, shift = np.multiply(scale, one["scale"]), np.multiply(shift, one["scale"])
        elif one["type"] == "translation":
            shift = np.add(shift, one["translation"])
    return answer(opened(path).read().result(), list("xyz"), affine=affine(along(axes, list(scale), 1.0), along(axes, list(shift), 0.0)))


def single(folder):
    """As TensorStore and neuroglancer have it: units and resolution of each axis."""
    metadata = {"dataType": "uint16", "dimensions": [7, 6, 5], "blockSize": [4, 6, 3],
                "compression": {"type": "blosc", "cname": "zstd", "clevel": 5, "shuffle": 1},
                "axes": ["x", "y", "z"], "units": ["nm", "nm", "nm"], "resolution": [4.0, 8.0, 40.0], "downsamplingFactors": [1, 1, 1]}
    opened(folder / "raw", metadata=metadata, create=True).write(numbers((7, 6, 5), "uint16")).result()
    tell(folder, n5="2.5.1")


def read_single(folder):
    store = opened(folder / "raw")
    labels = list(store.domain.labels) if any(store.domain.labels) else list("xyz")
    units = store.dimension_units
    if any(unit is None for unit in units):
        return answer(store.read().result(), labels)
    return answer(store.read().result(), labels, affine=affine(along(labels, [unit.multiplier for unit in units], 1.0), [0.0] * 3))


def funkelab(folder):
    """As funlib.persistence, daisy and CREMI have it: lists are in the order of C, z first; here x first, as z5py turns them round."""
    write(folder / "raw", numbers((7, 6, 5), "int16"), {"type": "bzip2", "blockSize": 9}, resolution=[4, 8, 40], offset=[100, 200, 400])
    tell(folder, n5="2.5.1")


def read_funkelab(folder):
    attributes = said(folder / "raw")
    return answer(opened(folder / "raw").read().result(), list("xyz"), affine=affine(attributes["resolution"],
                                                                                     attributes.get("offset", [0] * 3)))


def paintera(folder):
    """A source of labels of Paintera (https://github.com/saalfeldlab/paintera)."""
    write(folder / "labels" / "s0", numbers((8, 6, 4), "uint64", most=5), {"type": "raw"}, maxId=4, isLabelMultiset=False)
    write(folder / "labels" / "s1", numbers((4, 3, 2), "uint64", most=5), {"type": "raw"}, maxId=4, downsamplingFactors=[2.0, 2.0, 2.0])
    tell(folder / "labels", multiScale=True, resolution=[4.0, 8.0, 40.0], offset=[100.0, 200.0, 400.0], maxId=4, isLabel=True,
         painteraData={"type": "label"})
    tell(folder, n5="2.5.1")


def read_paintera(folder):
    attributes = said(folder / "labels")
    return answer(opened(folder / "labels" / "s0").read().result(), list("xyz"),
                  affine=affine(attributes["resolution"], attributes.get("offset", [0] * 3)))


def viewer(folder, in_root=False):
    """Channels as n5-viewer reads them (its page, Usage): each says how large its voxels are, or all in the attributes of the root."""
    size = {"pixelResolution": {"unit": "um", "dimensions": [0.25, 0.5, 2.0]}}
    tell(folder, n5="2.5.1", name="some data", scales=[[1, 1, 1], [2, 2, 2]], affineTransform=[[1, 0, 0, 8], [0, 1.25, 0, 4],
                                                                                               [0, 0, 0.85, 2]],
         **(size if in_root else {}))
    for channel in range(2):
        data = numbers((8, 6, 4), "uint16", channel)
        for level, factor in enumerate((1, 2)):
            write(folder / f"c{channel}" / f"s{level}", data[::factor, ::factor, ::factor])
        tell(folder / f"c{channel}", **({} if in_root else size))


def read_viewer(folder):
    """Attributes of the root are used for channels that lack them. `affineTransform` is compared nowhere: it stays red, as ignored."""
    both = [opened(folder / f"c{channel}" / "s0").read().result() for channel in range(2)]
    attributes = {**said(folder), **said(folder / "c0")}
    factors = attributes.get("scales", [[1] * 3])[0]
    return answer(np.stack(both, axis=3), list("xyzc"), affine=shrunk(np.array(attributes["pixelResolution"]["dimensions"]), factors))


def fiji(folder):
    """A hyperstack with ImageJ's own attributes, as Fiji's plugin N5 writes it with the metadata type `ImageJ`."""
    write(folder / "stack", numbers((7, 6, 2, 5, 3), "uint16"), {"type": "xz", "preset": 6}, [4, 6, 1, 3, 1], name="stack", fps=0.4,
          frameInterval=2.5,
          pixelWidth=0.25, pixelHeight=0.5, pixelDepth=2.0, pixelUnit="um", xOrigin=4.0, yOrigin=2.0, zOrigin=1.0, numChannels=2,
          numSlices=5,
          numFrames=3, type=1, imageProperties={"Info": "a microscope"})
    tell(folder, n5="2.5.1")


def read_fiji(folder):
    attributes = said(folder / "stack")
    sizes = [attributes[f"pixel{side}"] for side in ("Width", "Height", "Depth")]
    counts = [attributes.get(f"num{what}", 1) for what in ("Channels", "Slices", "Frames")]
    data = opened(folder / "stack").read().result()
    if list(data.shape[2:]) != counts:
        raise ValueError("not a stack of so many planes")
    return answer(data, list("xyczt"), affine=affine(sizes, [-attributes.get(f"{axis}Origin", 0) * size for axis,
                                                             size in zip("xyz", sizes)]))


SETUP = ("<ViewSetup><id>{0}</id><name>view {0}</name><size>8 6 4</size><voxelSize><unit>um</unit><size>0.25 0.5 2.0</size></voxelSize>"
         "<attributes><illumination>0</illumination><channel>{0}</channel><tile>0</tile><angle>0</angle></attributes></ViewSetup>")
REGISTRATION = ('<ViewRegistration timepoint="{0}" setup="{1}"><ViewTransform type="affine"><Name>Translation</Name>'
                '<affine>1.0 0.0 0.0 40.0 0.0 1.0 0.0 20.0 0.0 0.0 1.0 10.0</affine></ViewTransform>'
                '<ViewTransform type="affine"><Name>calibration</Name><affine>1.0 0.0 0.0 0.0 0.0 2.0 0.0 0.0 0.0 0.0 8.0 0.0</affine>'
                "</ViewTransform></ViewRegistration>")
DATASET = ('<SpimData version="0.2"><BasePath type="relative">.</BasePath><SequenceDescription><ImageLoader format="bdv.n5" version="1.0">'
           '<n5 type="relative">views.n5</n5></ImageLoader><ViewSetups>{}<Attributes name="channel"><Channel><id>0</id><name>488</name>'
           '</Channel><Channel><id>1</id><name>561</name></Channel></Attributes><Attributes name="tile"><Tile><id>0</id><name>first</name>'
           '<location>0.0 0.0 0.0</location></Tile></Attributes></ViewSetups><Timepoints type="range"><first>0</first><last>1</last>'
           "</Timepoints><MissingViews/></SequenceDescription><ViewRegistrations>{}</ViewRegistrations>"
           "<ViewInterestPoints/><BoundingBoxes/></SpimData>")
SETTINGS = ("<Settings><ViewerState><Sources>{}</Sources><SourceGroups><SourceGroup><active>true</active><name>group 1</name><id>0</id>"
            "</SourceGroup></SourceGroups><DisplayMode>ss</DisplayMode><Interpolation>nearestneighbor</Interpolation>"
            "<CurrentSource>0</CurrentSource>"
            "<CurrentGroup>0</CurrentGroup><CurrentTimePoint>1</CurrentTimePoint></ViewerState><SetupAssignments><ConverterSetups>{}"
            "</ConverterSetups><MinMaxGroups><MinMaxGroup><id>0</id><fullRangeMin>-2.147483648E9</fullRangeMin>"
            "<fullRangeMax>2.147483647E9</fullRangeMax>"
            "<rangeMin>0.0</rangeMin><rangeMax>65535.0</rangeMax><currentMin>10.0</currentMin><currentMax>110.0</currentMax></MinMaxGroup>"
            "</MinMaxGroups></SetupAssignments><ManualSourceTransforms><SourceTransform type=\"affine\">"
            "<affine>1.0 0.0 0.0 0.0 0.0 1.0 0.0 0.0 0.0 0.0 1.0 0.0</affine></SourceTransform></ManualSourceTransforms></Settings>")
CONVERTER = "<ConverterSetup><id>{0}</id><min>10.0</min><max>11{0}.0</max><color>-16711936</color><groupId>0</groupId></ConverterSetup>"


def views(folder):
    """A dataset of BigStitcher or BigDataViewer: two setups, two times, the XML file beside it, and the settings of the viewer."""
    for setup in range(2):
        tell(folder / f"setup{setup}", downsamplingFactors=[[1, 1, 1], [2, 2, 2]], dataType="uint16")
        for time in range(2):
            group, data = folder / f"setup{setup}" / f"timepoint{time}", numbers((8, 6, 4), "uint16", 2 * setup + time)
            for level, factor in enumerate((1, 2)):
                write(group / f"s{level}", data[::factor, ::factor, ::factor])
            tell(group, multiScale=True, resolution=[1.0, 1.0, 1.0])
    tell(folder, n5="2.5.1")
    setups = "".join(SETUP.format(i) for i in range(2))
    registrations = "".join(REGISTRATION.format(t, s) for t in range(2) for s in range(2))
    folder.with_suffix(".xml").write_text(DATASET.format(setups, registrations))
    sources = "".join(f"<Source><active>{shown}</active></Source>" for shown in ("true", "false"))
    folder.with_suffix(".settings.xml").write_text(SETTINGS.format(sources, "".join(CONVERTER.format(i) for i in range(2))))


def read_views(folder):
    """Voxels alone: no library in Python reads the XML file."""
    data = [[opened(folder / f"setup{setup}" / f"timepoint{time}" / "s0").read().result() for setup in range(2)] for time in range(2)]
    return answer(np.moveaxis(np.array(data), [0, 1], [4, 3]), list("xyzct"))


class Views(XmlDocument):
    """The XML file or the settings of BigDataViewer. Elements of `WHOLE` have no nodes in them, and an element of one text is that text."""

    KINDS = {"Name/text": "comment", "BasePath/text": "comment"}
    ROLES = {"voxelSize/size/text": "spacing", "voxelSize/unit/text": "unit", "affine/text": "affine"}
    WHOLE = ("Attributes", "MinMaxGroups", "SourceGroups", "Timepoints", "BasePath", "ImageLoader", "attributes")

    def nodes(self):
        nodes = super().nodes()
        texts = {node.path[:-len("/text")] for node in nodes if node.path.endswith("/text")}
        kept = []
        for node in nodes:
            words = node.path.split("/")
            if node.path in texts and words[-1] not in self.WHOLE or any(word in self.WHOLE for word in words[:-1]):
                continue
            node.kind = next((kind for end, kind in self.KINDS.items() if node.path.endswith(end)), "")
            node.role = next((role for end, role in self.ROLES.items() if node.path.endswith(end)), "")
            kept.append(node)
        return kept


def view_documents(folder):
    return [place_document(folder / "setup0", "setup"), place_document(folder / "setup0" / "timepoint0", "timepoint"),
            Views(folder.with_suffix(".xml"), "xml"), Views(folder.with_suffix(".settings.xml"), "settings")]


def sample(name, make, read, documents, array="", sidecars=()):
    folder = f"{name}.n5"
    return Sample(name, folder + (f"?array={array}" if array else ""), lambda made: make(made / folder),
                  lambda made: documents(made / folder),
                  lambda made: read(made / folder), sidecars)


def level_documents(group="em"):
    """Of the group of levels and of two of its levels."""
    return lambda folder: [array_document(folder / group / "s0"), place_document(folder / group, "group"),
                           place_document(folder / group / "s0", "level"), place_document(folder / group / "s1", "lower")]


def single_documents(name, path):
    return lambda folder: [array_document(folder / path), place_document(folder / path, name),
                           Metadata(folder / "attributes.json", "root", traits=TRAITS)]


def viewer_documents(folder):
    return [Metadata(folder / "attributes.json", "viewer", traits=TRAITS), place_document(folder / "c0", "viewer-channel")]


def size_in_root(folder):
    """Alone: this sample is read wrongly as it is."""
    return [Metadata(folder / "attributes.json", "viewer", only=("pixelResolution", "dimensions"), traits=TRAITS)]


def samples(_):
    return [
        sample("single", single, read_single, single_documents("single", "raw"), "raw"),
        sample("pixels", pixels, read_pixels, level_documents(), "em"),
        sample("spark", lambda folder: pixels(folder, True), read_pixels, level_documents(), "em"),
        sample("cosem", cosem, read_cosem, level_documents(), "em"),
        sample("listed", lambda folder: cosem(folder, False), read_cosem, level_documents(), "em"),
        sample("ngff", ngff, read_ngff, level_documents(), "em"),
        sample("funkelab", funkelab, read_funkelab, single_documents("funkelab", "raw"), "raw"),
        sample("paintera", paintera, read_paintera, level_documents("labels"), "labels"),
        sample("fiji", fiji, read_fiji, single_documents("fiji", "stack"), "stack"),
        sample("viewer", viewer, read_viewer, viewer_documents),
        sample("views", views, read_views, view_documents, sidecars=("views.xml", "views.settings.xml")),
        sample("root-viewer", lambda folder: viewer(folder, True), read_viewer, size_in_root),
    ]
