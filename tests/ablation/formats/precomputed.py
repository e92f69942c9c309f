"""Neuroglancer's precomputed volumes by CloudVolume and TensorStore, with what Igneous and neuroglancer-scripts put beside them."""
import json
import shutil

import numpy as np
import tensorstore
from cloudvolume import CloudVolume

from ablation import Change, Sample
from array_documents import Metadata, affine, answer, numbers

OFFSET, RESOLUTION = (10, 20, -3), (4.0, 8.0, 40.0)
SHARDING = {"@type": "neuroglancer_uint64_sharded_v1", "preshift_bits": 0, "hash": "murmurhash3_x86_128", "minishard_bits": 1,
            "shard_bits": 1,
            "minishard_index_encoding": "gzip", "data_encoding": "gzip"}
TYPES = ("int16", "float32")
ENCODINGS = ("raw", "jpeg", "compressed_segmentation", "png", "compresso")
PROPERTIES = {"@type": "neuroglancer_segment_properties",
              "inline": {"ids": ["1", "2", "3"],
                         "properties": [{"id": "label", "type": "label", "values": ["axon", "dendrite", "soma"]},
                                        {"id": "description", "type": "description", "values": ["a", "b", "c"]},
                                        {"id": "area", "type": "number", "data_type": "float32", "values": [1.5, 2.5, 3.5]}]}}
TRANSFORM = [[1, 0, 0, -90000], [0, 1, 0, -126000], [0, 0, 1, -72000], [0, 0, 0, 1]]


def write_tensorstore(folder, data, encoding="raw", sharding=None, kind="image", scale=1):
    """A scale. `data`: x, y, z and channel."""
    said = {"size": data.shape[:3], "chunk_size": [4, 4, 4], "resolution": [step * scale for step in RESOLUTION], "encoding": encoding,
            "voxel_offset": [int(np.floor(first / scale)) for first in OFFSET]}
    said |= {"compressed_segmentation_block_size": [4, 4, 2]} if encoding == "compressed_segmentation" else {}
    said |= {"jpeg_quality": 90} if encoding == "jpeg" else {}
    spec = {"driver": "neuroglancer_precomputed", "kvstore": {"driver": "file", "path": str(folder)},
            "multiscale_metadata": {"type": kind, "data_type": str(data.dtype), "num_channels": data.shape[3]},
            "scale_metadata": {**said, **({"sharding": sharding} if sharding else {})}}
    tensorstore.open(spec, create=True).result().write(data).result()


def pyramid(data, **more):
    def write(folder):
        write_tensorstore(folder, data, **more)
        write_tensorstore(folder, data[::2, ::2, ::2], scale=2, **more)
    return write


def hidden(folder):
    """Its second scale is not to be shown (neuroglancer, volume: hidden); and there are texts for people."""
    pyramid(numbers((7, 6, 5, 1), "float32"))(folder)
    path = folder / "info"
    info = json.loads(path.read_text())
    info["scales"][1]["hidden"] = True
    path.write_text(json.dumps({**info, "description": "a stack", "owners": ["somebody"]}))


def write_cloudvolume(folder, data, kind, encoding, **more):
    info = CloudVolume.create_new_info(num_channels=1, layer_type=kind, data_type=str(data.dtype), encoding=encoding,
                                       resolution=list(RESOLUTION),
                                       voxel_offset=list(OFFSET), volume_size=list(data.shape), chunk_size=[4, 4, 4], **more)
    volume = CloudVolume(f"file://{folder}", info=info, compress=True, progress=False)
    volume.commit_info()
    volume.provenance.description, volume.provenance.owners = "a stack", ["somebody"]
    volume.commit_provenance()
    volume[tuple(slice(first, first + side) for first, side in zip(OFFSET, data.shape))] = data


def segments(folder):
    """A segmentation as Igneous leaves it: meshes, skeletons, and properties of segments beside."""
    write_cloudvolume(folder, numbers((7, 6, 5), "uint64", most=4), "segmentation", "compressed_segmentation", mesh="mesh",
                      skeletons="skeletons")
    info = json.loads((folder / "info").read_text())
    info |= {"segment_properties": "properties"}
    (folder / "info").write_text(json.dumps(info))
    for name, said in (("properties", PROPERTIES), ("mesh", {"@type": "neuroglancer_legacy_mesh"}),
                       ("skeletons", {"@type": "neuroglancer_skeletons"})):
        (folder / name).mkdir()
        (folder / name / "info").write_text(json.dumps(said))


def image(folder):
    """An image by CloudVolume, with the matrix that neuroglancer-scripts keeps beside it for viewers."""
    write_cloudvolume(folder, numbers((7, 6, 5), "uint16"), "image", "raw")
    (folder / "transform.json").write_text(json.dumps(TRANSFORM))


def opened(folder):
    spec = {"driver": "neuroglancer_precomputed", "kvstore": {"driver": "file", "path": str(folder)}, "scale_index": 0}
    return tensorstore.open(spec).result()


def read(folder):
    """As TensorStore has it; a voxel fills the space from its number to the next."""
    store = opened(folder)
    step, first = np.array([unit.multiplier for unit in store.dimension_units[:3]]), np.array(store.domain.origin[:3], float)
    return answer(store.read().result(), list("xyzc"), affine=affine(step, (first + 0.5) * step))


def read_cloudvolume(folder):
    """As CloudVolume has it, whose files end in `.gz`. What TensorStore refuses and blocks of other sizes end its process."""
    opened(folder)
    if json.loads((folder / "info").read_text())["scales"][0].get("compressed_segmentation_block_size", [8] * 3) != [8] * 3:
        raise ValueError("blocks of other sizes than those that were written")
    volume = CloudVolume(f"file://{folder}", progress=False, fill_missing=True, bounded=True)
    step, first = np.array(volume.resolution, float), np.array(volume.voxel_offset, float)
    return answer(np.asarray(volume[:]), list("xyzc"), affine=affine(step, (first + 0.5) * step))


def again(name, dtype=None, **options):
    """The samples of all scales of another type, or in other files."""
    def made(document, _):
        def act():
            folder = document.path.parent
            info = json.loads(document.path.read_text())
            scales = [tensorstore.open({"driver": "neuroglancer_precomputed", "kvstore": {"driver": "file", "path": str(folder)},
                                        "scale_index": i}).result().read().result() for i in range(len(info["scales"]))]
            shutil.rmtree(folder)
            for number, data in enumerate(scales):
                write_tensorstore(folder, data.astype(dtype or data.dtype), kind=info["type"], scale=number + 1, **options)
        return Change(name, lambda: setattr(document, "act", act), same=True)
    return made


def changes(*listed):
    return lambda document, node: [change(document, node) for change in listed if getattr(document, "again", False)]


# Messages about a chunk that does not fit name its size, or how it is packed.
CHUNK = ("bytes", "chunk", "damaged", "shard", "packed")
INFO = {"data_type": {"words": TYPES, "names": CHUNK, "more": changes(again("samples are float32", "float32"),
                                                                      again("in shards", sharding=SHARDING))},
        "num_channels": {"names": ("channel", *CHUNK)}, "encoding": {"words": ENCODINGS, "names": CHUNK}, "size": {"names": CHUNK},
        "chunk_sizes/*": {"names": ("chunk_sizes", *CHUNK)}, "scales/*/chunk_sizes/*": {"names": ("chunk_sizes", *CHUNK)},
        "resolution": {"role": "spacing"}, "voxel_offset": {"role": "offset", "names": CHUNK},
        "compressed_segmentation_block_size": {"names": CHUNK}, "type": {"words": ("image", "segmentation")},
        "@type": {"words": ("neuroglancer_skeletons",), "names": ("type",)}, "hash": {"words": ("identity",), "names": CHUNK},
        "preshift_bits": {"names": CHUNK},
        "minishard_bits": {"names": CHUNK}, "shard_bits": {"names": CHUNK}, "minishard_index_encoding": {"words": ("raw",), "names": CHUNK},
        "data_encoding": {"words": ("raw",), "names": CHUNK}, "scales": {"names": ("scales",)}, "scales/*": {"names": ("scales",)},
        "description": {"kind": "comment"}, "owners": {"kind": "comment"}}


class Info(Metadata):
    """`again`: whether its samples may be written again, as TensorStore wrote them."""

    def __init__(self, path, name, again=False):
        self.again = again
        super().__init__(path, name, traits=INFO)


def sample(name, write, documents=None, rewritten=False, sidecars=(), reader=read):
    return Sample(name, name, lambda made: write(made / name),
                  lambda made: [Info(made / name / "info", "info", rewritten), *(documents(made / name) if documents else [])],
                  lambda made: reader(made / name), tuple(f"{name}/{sidecar}" for sidecar in sidecars))


def samples(_):
    two = numbers((7, 6, 5, 2), "uint16")
    return [
        sample("raw", pyramid(two), rewritten=True),
        sample("shards", pyramid(numbers((7, 6, 5, 1), "uint32"), sharding=SHARDING)),
        sample("labels", pyramid(numbers((7, 6, 5, 1), "uint32", most=9), encoding="compressed_segmentation", kind="segmentation")),
        sample("jpeg", pyramid(numbers((7, 6, 5, 1), "uint8"), encoding="jpeg")),
        sample("floats", hidden),
        sample("segments", segments, lambda folder: [Metadata(folder / "properties" / "info", "properties", traits=INFO)],
               sidecars=("properties", "mesh", "skeletons", "provenance"), reader=read_cloudvolume),
        sample("image", image, sidecars=("transform.json",), reader=read_cloudvolume),
    ]
