"""Pictures by Pillow, one for each slice, arrays by NumPy, raw samples, and bricks of values (BOV) as simulations write them for VisIt."""

import gzip
import struct

import imagecodecs
import numpy as np
from PIL import Image, PngImagePlugin

from ablation import Answer, Sample
from documents import LinesDocument
from picture_documents import JpegDocument, Jp2Document, NpyDocument, PngDocument, Together, bmp_document

SLICES, ROWS, COLUMNS = 5, 6, 7
BOV_NAMES = {
    "DATA_SIZE": ("size", "bytes", "truncated"),
    "DATA_FORMAT": ("format", "bytes", "truncated"),
    "DATA_FILE": ("file",),
    "BYTE_OFFSET": ("offset", "truncated", "bytes"),
    "DATA_COMPONENTS": ("components", "bytes", "truncated"),
}
BOV_WORDS = {
    "DATA_FORMAT": ("BYTE", "SHORT", "INT", "DOUBLE"),
    "DATA_ENDIAN": ("LITTLE", "BIG"),
    "CENTERING": ("nodal", "zonal"),
    "DIVIDE_BRICK": ("true", "false"),
}


def values(shape, dtype=np.uint8, seed=5, high=120):
    return np.random.default_rng(seed).integers(1, high, shape).astype(dtype)


def pages(shape=(ROWS, COLUMNS), dtype=np.uint8, high=120):
    return [values(shape, dtype, k, high) for k in range(SLICES)]


def png(folder, images, **options):
    for k, image in enumerate(images):
        said = PngImagePlugin.PngInfo()
        said.add_text("Software", "scanner"), said.add_text("Creation Time", "2024"), said.add(b"gAMA", struct.pack(">I", 45455))
        said.add(b"cHRM", struct.pack(">8I", 31270, 32900, 64000, 33000, 30000, 60000, 15000, 6000)), said.add(b"sRGB", b"\0")
        said.add(b"tIME", struct.pack(">HBBBBB", 2024, 1, 2, 3, 4, 5)), said.add(b"oFFs", struct.pack(">iiB", 3, 4, 1))
        image.save(folder / f"s{k + 8:02d}.png", pnginfo=said, dpi=(254.0, 127.0), **options)


def grey(folder):
    png(folder, [Image.fromarray(page) for page in pages()])


def grey16(folder):
    png(folder, [Image.fromarray(page) for page in pages(dtype=np.uint16, high=60000)])


def bilevel(folder):
    png(folder, [Image.fromarray(page > 60) for page in pages()])


def palette(folder):
    def colored(page):
        image = Image.fromarray(page, mode=None).convert("L").convert("P")
        image.putdata(page.reshape(-1).tolist())
        image.putpalette(values((256 * 3,), high=255).tolist())
        return image

    png(folder, [colored(page) for page in pages(high=250)], transparency=3)


def rgb(folder, channels=3):
    png(folder, [Image.fromarray(page) for page in pages((ROWS, COLUMNS, channels))])


def jpeg(folder, channels=0):
    for k, page in enumerate(pages((ROWS, COLUMNS) + ((channels,) if channels else ()))):
        image = Image.fromarray(page)
        exif = Image.Exif()
        exif[0x0112], exif[0x011A], exif[0x011B], exif[0x0128], exif[0x010F], exif[0x0132] = (
            1,
            100.0,
            50.0,
            3,
            "Maker",
            "2024:01:02 03:04:05",
        )
        image.save(folder / f"s{k + 8:02d}.jpg", quality=95, dpi=(254, 127), exif=exif, comment=b"made")


def bmp(folder, mode="L"):
    for k, page in enumerate(pages((ROWS, COLUMNS, 3) if mode == "RGB" else (ROWS, COLUMNS))):
        Image.fromarray(page).save(folder / f"s{k + 8:02d}.bmp", dpi=(254, 127))


def jp2(folder, dtype=np.uint8, channels=0):
    for k, page in enumerate(pages((ROWS * 3, COLUMNS * 3) + ((channels,) if channels else ()), dtype)):
        (folder / f"s{k + 8:02d}.jp2").write_bytes(
            with_resolution(imagecodecs.jpeg2k_encode(page, level=0, codecformat="jp2", reversible=True))
        )


def with_resolution(data):
    """A box of the resolution at capture, behind the others of the image header: 100 and 50 pixels a metre."""
    at = data.find(b"jp2h") - 4
    (size,) = struct.unpack_from(">I", data, at)
    box = struct.pack(">I4sI4sHHHHbb", 26, b"res ", 18, b"resc", 50, 1, 100, 1, 0, 0)
    return data[:at] + struct.pack(">I", size + len(box)) + data[at + 4 : at + size] + box + data[at + size :]


def npy(folder, array, version=None):
    with open(folder / "a.npy", "wb") as file:
        np.lib.format.write_array(file, array, version)


def bov(folder, dtype=np.float32, components=1, extra=(), file="a.values", zonal=True):
    stored = values((7, 6, 5) + ((components,) if components > 1 else ()), dtype)
    data = b"\0" * 12 + stored.tobytes()
    (folder / file).write_bytes(gzip.compress(data) if file.endswith(".gz") else data)
    words = {np.float32: "FLOAT", np.uint8: "BYTE", np.float64: "DOUBLE", np.dtype(">i4"): "INT"}
    lines = [
        "TIME: 1.5",
        f"DATA_FILE: {file}",
        "DATA_SIZE: 5 6 7",
        f"DATA_FORMAT: {words[dtype]}",
        "VARIABLE: density",
        f"DATA_ENDIAN: {'BIG' if dtype == np.dtype('>i4') else 'LITTLE'}",
        f"CENTERING: {'zonal' if zonal else 'nodal'}",
        "BRICK_ORIGIN: 1. 2. 3.",
        "BRICK_SIZE: 5. 12. 21.",
        "BYTE_OFFSET: 12",
        "DIVIDE_BRICK: false",
        "DATA_BRICKLETS: 5 6 7",
        f"DATA_COMPONENTS: {components}",
        *extra,
    ]
    (folder / "a.bov").write_text("\n".join(lines) + "\n")


class Bov(LinesDocument):
    def nodes(self):
        nodes = super().nodes()
        for node in nodes:
            key = node.path.split("/")[-1]
            node.names, node.words = BOV_NAMES.get(key, ()), BOV_WORDS.get(key, ())
            node.role = "spacing" if key == "BRICK_SIZE" else "affine" if key == "BRICK_ORIGIN" else ""
            node.kind = "comment" if key == "VARIABLE" else ""
        return nodes


# Foreign readers.


def read_pictures(folder, ending):
    """A slice for each picture; components of colours are channels. Palettes of colours count as RGB, those of greys as greys."""
    loaded = []
    for path in sorted(folder.glob(f"*.{ending}")):
        image = Image.open(path)
        if ending == "bmp" and image.tile[0][2] != struct.unpack_from("<I", path.read_bytes(), 10)[0]:
            raise ValueError("Pillow finds the samples elsewhere than the header says")
        if image.mode in ("P", "PA"):
            image = image.convert("RGBA" if "transparency" in image.info else "RGB")
            array = np.asarray(image)
            if np.array_equal(array[..., 0], array[..., 1]) and np.array_equal(array[..., 0], array[..., 2]):
                raise ValueError("greys")
        elif image.mode == "1":
            array = np.asarray(image).astype(np.uint8)
        else:
            array = np.asarray(image)
        loaded.append(array.astype(float))
    if len({page.shape for page in loaded}) != 1 or len(loaded) < 2:
        raise ValueError("sizes")
    stack = np.stack(loaded)
    stack = stack[..., np.newaxis] if stack.ndim == 3 else stack
    return Answer(fields={(0, c): stack[..., c].transpose(2, 1, 0) for c in range(min(3, stack.shape[3]))}, tolerance=1e-6)


def read_jp2(folder, ending):
    stack = np.stack([imagecodecs.jpeg2k_decode(path.read_bytes()) for path in sorted(folder.glob(f"*.{ending}"))]).astype(float)
    stack = stack[..., np.newaxis] if stack.ndim == 3 else stack
    return Answer(fields={(0, c): stack[..., c].transpose(2, 1, 0) for c in range(stack.shape[3])})


def read_npy(path):
    array = np.load(path)
    if array.dtype.kind not in "biuf" or array.ndim not in (2, 3, 4):
        raise ValueError(array.dtype)
    array = array[np.newaxis] if array.ndim == 2 else array
    array = array[np.newaxis] if array.ndim == 3 else array
    return Answer(fields={(t, 0): volume.transpose(2, 1, 0).astype(float) for t, volume in enumerate(array)})


def read_bov(path):
    """By VisIt's manual: a brick from its origin, of its size; values in its cells (zonal) or at its points (nodal)."""
    said = dict(line.split(":", 1) for line in path.read_text().splitlines() if ":" in line)
    said = {key.strip(): value.strip() for key, value in said.items()}
    size = [int(v) for v in said["DATA_SIZE"].split()]
    components = int(said.get("DATA_COMPONENTS", 1))
    kind = np.dtype({"FLOAT": "f4", "BYTE": "u1", "DOUBLE": "f8", "INT": "i4", "SHORT": "i2"}[said["DATA_FORMAT"]])
    kind = kind.newbyteorder(">" if said.get("DATA_ENDIAN") == "BIG" else "<")
    data = (path.parent / said["DATA_FILE"]).read_bytes()
    data = gzip.decompress(data) if said["DATA_FILE"].endswith(".gz") else data
    stored = np.frombuffer(data, kind, int(np.prod(size)) * components, int(said.get("BYTE_OFFSET", 0)))
    stored = stored.reshape(size[::-1] + [components]).astype(float)
    length = np.array([float(v) for v in said.get("BRICK_SIZE", "1 1 1").split()])
    origin = np.array([float(v) for v in said.get("BRICK_ORIGIN", "0 0 0").split()])
    zonal = said.get("CENTERING", "nodal").lower() == "zonal"
    step = length / (np.array(size) if zonal else np.array(size) - 1)
    if np.any(step <= 0):
        raise ValueError("BRICK_SIZE")
    affine = np.eye(4)
    affine[:3, :3], affine[:3, 3] = np.diag(step), origin + (step / 2 if zonal else 0)
    return Answer(fields={(0, c): stored[..., c].transpose(2, 1, 0) for c in range(components)}, affine=affine)


# Samples.


def stack(name, document, ending, write, read=read_pictures):
    """What all pictures say, and what one of them says otherwise."""

    def documents(folder):
        paths = sorted(folder.glob(f"*.{ending}"))
        return [Together([document(path, ending) for path in paths]), document(paths[2], f"{ending}-slice")]

    return Sample(name, "", write, documents, read and (lambda folder: read(folder, ending)))


def array(name, make, version=None):
    return Sample(
        name,
        "a.npy",
        lambda folder: npy(folder, make(), version),
        lambda folder: [NpyDocument(folder / "a.npy")],
        lambda folder: read_npy(folder / "a.npy"),
    )


def brick(name, **options):
    return Sample(
        name,
        "a.bov",
        lambda folder: bov(folder, **options),
        lambda folder: [Bov(folder / "a.bov", "bov", ":", comment="#")],
        lambda folder: read_bov(folder / "a.bov"),
        (options.get("file", "a.values"),),
    )


def raw(name, dtype, front=b""):
    words = {"<": "little", ">": "big"}
    kind = np.dtype(dtype)
    options = f"?dims=5,6,7,type={kind.name},endian={words.get(kind.byteorder, 'little')},offset={len(front)},spacing=0.5,1,2"
    return Sample(
        name,
        "a.raw" + options,
        lambda folder: (folder / "a.raw").write_bytes(front + values((7, 6, 5), kind).tobytes()),
        lambda folder: [],
        lambda folder: Answer(
            fields={
                (0, 0): np.frombuffer((folder / "a.raw").read_bytes()[len(front) :], kind).reshape(7, 6, 5).transpose(2, 1, 0).astype(float)
            },
            affine=np.diag([0.5, 1.0, 2.0, 1.0]),
        ),
    )


def samples(_):
    return [
        stack("png", PngDocument, "png", grey),
        stack("png-16", PngDocument, "png", grey16),
        stack("png-1", PngDocument, "png", bilevel),
        stack("png-palette", PngDocument, "png", palette),
        stack("png-rgb", PngDocument, "png", rgb),
        stack("png-alpha", PngDocument, "png", lambda folder: rgb(folder, 4)),
        stack("jpeg", JpegDocument, "jpg", jpeg, None),
        stack("jpeg-rgb", JpegDocument, "jpg", lambda folder: jpeg(folder, 3), None),
        stack("bmp", bmp_document, "bmp", bmp),
        stack("bmp-rgb", bmp_document, "bmp", lambda folder: bmp(folder, "RGB")),
        stack("jp2", Jp2Document, "jp2", jp2, read_jp2),
        stack("jp2-16", Jp2Document, "jp2", lambda folder: jp2(folder, np.uint16), read_jp2),
        stack("jp2-rgb", Jp2Document, "jp2", lambda folder: jp2(folder, np.uint8, 3), read_jp2),
        array("npy", lambda: values((7, 6, 5), np.float32)),
        array("npy-fortran", lambda: np.asfortranarray(values((7, 6, 5), ">i2"))),
        array("npy-times", lambda: values((3, 7, 6, 5), np.uint8), (2, 0)),
        array("npy-halves", lambda: values((7, 6, 5), np.float16), (3, 0)),
        array("npy-flags", lambda: values((7, 6, 5)) > 60),
        brick("bov"),
        brick("bov-nodal", dtype=np.uint8, zonal=False, file="a.values.gz"),
        brick("bov-vectors", dtype=np.float64, components=3),
        brick("bov-big", dtype=np.dtype(">i4")),
        raw("raw", "<i2"),
        raw("raw-big", ">f4", b"\1" * 16),
        raw("raw-bytes", "u1"),
    ]
