"""A store that makes the chunks of a volume of one terabyte when they are asked for.

    python3 bench/terabyte_store.py --port 8000                    # http://127.0.0.1:8000/volume.ome.zarr
    python3 bench/terabyte_store.py --port 8000 --delay 0.02       # each answer begins 20 ms after its request
    python3 bench/terabyte_store.py --port 8000 --blosc            # for readers that know no other codec and want every chunk
    python3 bench/terabyte_store.py --side 5120 --channels 4       # one terabyte in four channels
    python3 bench/terabyte_store.py --side 5120 --labels           # one terabyte of labels of 64 bits, 1.2 million of them
    python3 bench/terabyte_store.py --side 512 --channels 2 --times 50 --bits 8
    python3 bench/terabyte_store.py --side 512 --channels 2 --times 50 --bits 8 --write cells.ome.zarr    # the same as a folder, then ends

An OME-Zarr 0.4 of 8192 x 8192 x 8192 values of 16 bits: 1.1 TB, in chunks of 64 voxels a side, with levels of half the size down to 64. A
value is a sum of waves, from one along a side to one of eight voxels, and some noise; where the sum is low, it is 0: some 40 % of the volume.
Each level has the waves that it can show. Chunks are packed with zstd, and chunks of zeros alone are not there. A chunk that was made once is
kept; levels of at most 1024 voxels a side are made before the first request.

With --labels there is a label of 64 bits where a value would be above 0: bent cells of some 48 voxels a side, each with a label of its own.

With --channels or --times, channels have waves of their own, which move along x from time to time.

The driver of a measurement asks for more: GET /counts tells what was sent since GET /reset, and POST /sizes, with one chunk a line, how many
bytes these chunks have. These answers are neither delayed nor counted.
"""
import argparse
import asyncio
import concurrent.futures
import json
import pathlib

import numpy
from numcodecs import Blosc, Zstd

SIDE, CHUNK = 8192, 64
MADE_BEFORE = 1024  # voxels of a side, at most: levels that are made before the first request
EMPTY = 0.4
CELL = 48  # voxels of a side
TIME_STEP = 0.01  # of the side, that waves move
NAME = "/volume.ome.zarr/"
PAGES = b"Access-Control-Allow-Origin: *\r\n"  # of other servers may show it


class Formula:
    """`shape`: as the options have it."""

    def __init__(self, shape: argparse.Namespace):
        random = numpy.random.default_rng(1)
        waves = numpy.arange(1, 11)
        self._shape = shape
        self._frequency = 2.0 ** (waves - 1) * (1 + 0.2 * random.random((3, len(waves))))  # along a side, by axis
        self._phase = 2 * numpy.pi * random.random((3, len(waves)))
        self._amplitude = 0.4**waves
        self._noise = random.integers(0, 16, (CHUNK,) * 3, dtype=numpy.uint16)
        self._codec = Blosc(cname="zstd", clevel=1, shuffle=Blosc.NOSHUFFLE) if shape.blosc else Zstd(level=1)
        side = min(shape.side, 256)  # of a coarse level, whose values tell what is low
        level = next(level for level in range(99) if shape.side >> level <= side)
        coarse = [self._sum(level, 0, 0, at) for at in numpy.ndindex((chunks_of(shape.side, level),) * 3)]
        self._least = numpy.quantile(coarse, EMPTY)

    def _labels(self, level: int, chunk: tuple[int, int, int]) -> numpy.ndarray:
        """Of the cell that holds the middle of each voxel."""
        at = [(place * CHUNK + numpy.arange(CHUNK) + 0.5) * 2**level for place in chunk]
        z, y, x = numpy.meshgrid(*at, indexing="ij", sparse=True)
        bent = [a + CELL / 2 * numpy.sin(b / CELL) * numpy.sin(c / CELL) for a, b, c in ((z, y, x), (y, x, z), (x, z, y))]
        count = numpy.uint64(self._shape.side // CELL + 3)
        number = numpy.zeros((CHUNK,) * 3, numpy.uint64)
        for along in bent:
            number = number * count + numpy.floor(along / CELL + 1).astype(numpy.uint64)
        # Bijective, so different cells have different labels; of 64 bits (a step of SplitMix64, Steele 2014).
        number += numpy.uint64(1)
        number = (number ^ (number >> numpy.uint64(30))) * numpy.uint64(0xBF58476D1CE4E5B9)
        return number ^ (number >> numpy.uint64(27))

    def _sum(self, level: int, time: int, channel: int, chunk: tuple[int, int, int]) -> numpy.ndarray:
        side = self._shape.side
        shown = 2.0 ** numpy.arange(len(self._amplitude)) <= (side >> level) / 8  # eight voxels a wave
        moved = channel / self._shape.channels, channel / self._shape.channels, channel / self._shape.channels + time * TIME_STEP
        z, y, x = (
            numpy.cos(2 * numpy.pi * frequency[shown, None] * ((at * CHUNK + numpy.arange(CHUNK) + 0.5) * 2**level / side + by) + phase[shown, None])
            for at, by, frequency, phase in zip(chunk, moved, self._frequency, self._phase)
        )
        z *= self._amplitude[shown, None]
        planes = (z[:, :, None] * y[:, None, :]).reshape(len(z), -1)
        return (planes.T.astype(numpy.float32) @ x.astype(numpy.float32)).reshape((CHUNK,) * 3)

    @property
    def codec(self) -> dict:
        """As .zarray names it."""
        return self._codec.get_config()

    def chunk(self, level: int, time: int, channel: int, chunk: tuple[int, int, int]) -> bytes | None:
        above = self._sum(level, time, channel, chunk) - self._least
        if not self._shape.blosc and not (above > 0).any():
            return None
        if self._shape.labels:
            return self._codec.encode(numpy.where(above > 0, self._labels(level, chunk), 0).astype("<u8"))
        values = numpy.where(above > 0, 4000 + 30000 * above, 0).astype(numpy.uint16)
        values[above > 0] += self._noise[above > 0]
        return self._codec.encode(values if self._shape.bits == 16 else (values >> 8).astype(numpy.uint8))


def chunks_of(side: int, level: int) -> int:
    """Along an axis."""
    return -(-(side >> level) // CHUNK)


def levels_of(side: int) -> int:
    return 1 + next(level for level in range(99) if side >> level <= CHUNK)


def axes_before(shape: argparse.Namespace) -> dict[str, int]:
    """Those before z, y and x, with their lengths: t and c, or none."""
    times, channels = getattr(shape, "times", 1), shape.channels
    return {"t": times, "c": channels} if times * channels > 1 else {}


def keys_of(shape: argparse.Namespace, level: int) -> list[str]:
    """Of all chunks of a level."""
    count = chunks_of(shape.side, level)
    return ["/".join(map(str, (level, *at))) for at in numpy.ndindex(*axes_before(shape).values(), count, count, count)]


def metadata(path: str, codec: dict, shape: argparse.Namespace) -> bytes | None:
    before = axes_before(shape)
    if path == ".zgroup":
        return json.dumps({"zarr_format": 2}).encode()
    if path == ".zattrs":
        levels = [
            {"path": str(level), "coordinateTransformations": [{"type": "scale", "scale": [1.0] * len(before) + [2.0**level] * 3}]}
            for level in range(levels_of(shape.side))
        ]
        axes = [{"name": name, "type": {"t": "time", "c": "channel"}[name]} for name in before]
        axes += [{"name": name, "type": "space", "unit": "micrometer"} for name in "zyx"]
        labels = {"image-label": {"version": "0.4"}} if shape.labels else {}
        return json.dumps({"multiscales": [{"version": "0.4", "name": "terabyte", "axes": axes, "datasets": levels}], **labels}).encode()
    level, _, file = path.partition("/")
    if file == ".zarray" and level.isdigit() and int(level) < levels_of(shape.side):
        sides = [*before.values()] + [shape.side >> int(level)] * 3
        array = {"zarr_format": 2, "shape": sides, "chunks": [1] * len(before) + [CHUNK] * 3, "order": "C", "fill_value": 0}
        array |= {"dtype": "<u8" if shape.labels else "<u2" if shape.bits == 16 else "|u1", "compressor": codec, "filters": None, "dimension_separator": "/"}
        return json.dumps(array).encode()
    return None


class Store:
    def __init__(self, shape: argparse.Namespace):
        self._shape, self._formula, self._made = shape, Formula(shape), {}
        self._threads = concurrent.futures.ThreadPoolExecutor(2)
        self.reset()

    def reset(self) -> None:
        self._counts = {"requests": 0, "missing": 0, "unchanged": 0, "bytes": 0}

    def make_coarse(self) -> None:
        for level in range(levels_of(self._shape.side)):
            if self._shape.side >> level <= MADE_BEFORE:
                for key in keys_of(self._shape, level):
                    self._make(key)

    def write(self, folder: pathlib.Path) -> None:
        """The whole volume, as files."""
        levels = range(levels_of(self._shape.side))
        for path in [".zgroup", ".zattrs", *(f"{level}/.zarray" for level in levels)]:
            (folder / path).parent.mkdir(parents=True, exist_ok=True)
            (folder / path).write_bytes(metadata(path, self._formula.codec, self._shape))

        def write(key: str) -> None:
            if (chunk := self._chunk(key)) is not None:
                (folder / key).parent.mkdir(parents=True, exist_ok=True)
                (folder / key).write_bytes(chunk)

        for level in levels:
            list(self._threads.map(write, keys_of(self._shape, level)))

    def _chunk(self, key: str) -> bytes | None:
        """Its key is LEVEL/Z/Y/X or LEVEL/TIME/CHANNEL/Z/Y/X."""
        level, *before, z, y, x = map(int, key.split("/"))
        return self._formula.chunk(level, *(before or (0, 0)), (z, y, x))

    def _make(self, key: str) -> bytes | None:
        """Of a chunk that the volume has."""
        if key not in self._made:
            self._made[key] = self._chunk(key)
        return self._made[key]

    def _is_chunk(self, key: str) -> bool:
        level, *at = parts = key.split("/")
        before = axes_before(self._shape).values()
        if len(parts) != 4 + len(before) or not all(part.isdigit() for part in parts) or int(level) >= levels_of(self._shape.side):
            return False
        return all(int(place) < count for place, count in zip(at, [*before] + [chunks_of(self._shape.side, int(level))] * 3))

    async def _object(self, path: str) -> bytes | None:
        if not path.startswith(NAME):
            return None
        key = path.removeprefix(NAME)
        if not self._is_chunk(key):
            return metadata(key, self._formula.codec, self._shape)
        if key in self._made:
            return self._made[key]
        return await asyncio.get_running_loop().run_in_executor(self._threads, self._make, key)

    async def _sizes(self, keys: list[str]) -> int:
        made = await asyncio.gather(*(self._object(NAME + key) for key in keys))
        return sum(len(chunk) for chunk in made if chunk is not None)

    async def serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        try:
            while head := await reader.readuntil(b"\r\n\r\n"):
                method, path, *_ = head.split(b"\r\n", 1)[0].decode().split(" ")
                fields = dict(line.lower().split(": ", 1) for line in head.decode().split("\r\n")[1:] if ": " in line)
                body = await reader.readexactly(int(fields.get("content-length", 0)))
                writer.write(await self._answer(method, path, body, fields.get("if-none-match", "")))
                await writer.drain()
        except (asyncio.IncompleteReadError, ConnectionError):
            pass
        finally:
            writer.close()

    async def _answer(self, method: str, path: str, body: bytes, known: str) -> bytes:
        if path == "/counts":
            return self._message(json.dumps(self._counts).encode())
        if path == "/reset":
            self.reset()
            return self._message(b"")
        if path == "/sizes" and method == "POST":
            return self._message(str(await self._sizes(body.decode().split())).encode())
        found, _ = await asyncio.gather(self._object(path), asyncio.sleep(self._shape.delay))
        self._counts["requests"] += 1
        if found is None:
            self._counts["missing"] += 1
            return b"HTTP/1.1 404 Not Found\r\nContent-Length: 0\r\n" + PAGES + b"\r\n"
        if known == self._tag(path):
            self._counts["unchanged"] += 1
            return f"HTTP/1.1 304 Not Modified\r\nETag: {known}\r\n\r\n".encode()
        self._counts["bytes"] += len(found)
        return self._message(found, path)

    @staticmethod
    def _tag(path: str) -> str:
        """Objects never change."""
        return f'"{path.lower()}"'

    @classmethod
    def _message(cls, body: bytes, path: str = "") -> bytes:
        named = f"ETag: {cls._tag(path)}\r\n" if path else ""
        return f"HTTP/1.1 200 OK\r\nContent-Length: {len(body)}\r\n{named}".encode() + PAGES + b"\r\n" + body


async def main() -> None:
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("--address", default="127.0.0.1", help="where it listens (default: 127.0.0.1)")
    p.add_argument("--port", type=int, default=0, help="of TCP; 0: a free one (default)")
    p.add_argument("--delay", type=float, default=0, metavar="SECONDS", help="between a request and its answer (default: 0)")
    p.add_argument("--side", type=int, default=SIDE, metavar="VOXELS", help=f"of the volume, in its finest level (default: {SIDE})")
    p.add_argument("--bits", type=int, default=16, choices=[8, 16], help="of a value (default: 16)")
    p.add_argument("--labels", action="store_true", help="labels of 64 bits and no values")
    p.add_argument("--channels", type=int, default=1, help="(default: 1)")
    p.add_argument("--times", type=int, default=1, help="(default: 1)")
    p.add_argument("--write", metavar="FOLDER", type=pathlib.Path, help="write the volume there, whole, and serve nothing")
    p.add_argument("--blosc", action="store_true", help="pack chunks with Blosc, and have chunks of zeros, too")
    options = p.parse_args()
    store = Store(options)
    if options.write is not None:
        store.write(options.write)
        return
    store.make_coarse()
    server = await asyncio.start_server(store.serve, options.address, options.port, limit=1 << 20)
    print(f"http://{options.address}:{server.sockets[0].getsockname()[1]}{NAME.rstrip('/')}", flush=True)
    await server.serve_forever()


if __name__ == "__main__":
    try:
        asyncio.run(main())
    except KeyboardInterrupt:
        pass
