"""A store that makes the chunks of a volume of one terabyte when they are asked for.

    python3 bench/terabyte_store.py --port 8000                    # http://127.0.0.1:8000/volume.ome.zarr
    python3 bench/terabyte_store.py --port 8000 --delay 0.02       # each answer begins 20 ms after its request
    python3 bench/terabyte_store.py --port 8000 --blosc            # for readers that know no other codec and want every chunk

An OME-Zarr 0.4 of 8192 x 8192 x 8192 values of 16 bits: 1.1 TB, in chunks of 64 voxels a side, with levels of half the size down to 64. A
value is a sum of waves, from one along a side to one of eight voxels, and some noise; where the sum is low, it is 0: some 40 % of the volume.
Each level has the waves that it can show. Chunks are packed with zstd, and chunks of zeros alone are not there. A chunk that was made once is
kept; levels 3 and coarser are made before the first request.

The driver of a measurement asks for more: GET /counts tells what was sent since GET /reset, and POST /sizes, with one chunk a line, how many
bytes these chunks have. These answers are neither delayed nor counted.
"""
import argparse
import asyncio
import concurrent.futures
import json

import numpy
from numcodecs import Blosc, Zstd

SIDE, CHUNK, LEVELS = 8192, 64, 8
FIRST_MADE = 3  # this level and coarser ones
EMPTY = 0.4
NAME = "/volume.ome.zarr/"
PAGES = b"Access-Control-Allow-Origin: *\r\n"  # of other servers may show it


class Formula:
    def __init__(self, blosc: bool):
        random = numpy.random.default_rng(1)
        waves = numpy.arange(1, 11)
        self._frequency = 2.0 ** (waves - 1) * (1 + 0.2 * random.random((3, len(waves))))  # along a side, by axis
        self._phase = 2 * numpy.pi * random.random((3, len(waves)))
        self._amplitude = 0.4**waves
        self._noise = random.integers(0, 16, (CHUNK,) * 3, dtype=numpy.uint16)
        self._codec = Blosc(cname="zstd", clevel=1, shuffle=Blosc.NOSHUFFLE) if blosc else Zstd(level=1)
        self._has_every_chunk = blosc
        self._least = -numpy.inf
        coarse = [self._sum(5, at) for at in numpy.ndindex((SIDE >> 5) // CHUNK, (SIDE >> 5) // CHUNK, (SIDE >> 5) // CHUNK)]
        self._least = numpy.quantile(coarse, EMPTY)

    def _sum(self, level: int, chunk: tuple[int, int, int]) -> numpy.ndarray:
        shown = 2.0 ** numpy.arange(len(self._amplitude)) <= (SIDE >> level) / 8  # eight voxels a wave
        z, y, x = (
            numpy.cos(2 * numpy.pi * frequency[shown, None] * ((at * CHUNK + numpy.arange(CHUNK) + 0.5) * 2**level / SIDE) + phase[shown, None])
            for at, frequency, phase in zip(chunk, self._frequency, self._phase)
        )
        z *= self._amplitude[shown, None]
        planes = (z[:, :, None] * y[:, None, :]).reshape(len(z), -1)
        return (planes.T.astype(numpy.float32) @ x.astype(numpy.float32)).reshape((CHUNK,) * 3)

    @property
    def codec(self) -> dict:
        """As .zarray names it."""
        return self._codec.get_config()

    def chunk(self, level: int, chunk: tuple[int, int, int]) -> bytes | None:
        above = self._sum(level, chunk) - self._least
        if not self._has_every_chunk and not (above > 0).any():
            return None
        values = numpy.where(above > 0, 4000 + 30000 * above, 0).astype(numpy.uint16)
        values[above > 0] += self._noise[above > 0]
        return self._codec.encode(values)


def metadata(path: str, codec: dict) -> bytes | None:
    if path == ".zgroup":
        return json.dumps({"zarr_format": 2}).encode()
    if path == ".zattrs":
        levels = [
            {"path": str(level), "coordinateTransformations": [{"type": "scale", "scale": [2.0**level] * 3}]} for level in range(LEVELS)
        ]
        axes = [{"name": name, "type": "space", "unit": "micrometer"} for name in "zyx"]
        return json.dumps({"multiscales": [{"version": "0.4", "name": "terabyte", "axes": axes, "datasets": levels}]}).encode()
    level, _, file = path.partition("/")
    if file == ".zarray" and level.isdigit() and int(level) < LEVELS:
        array = {"zarr_format": 2, "shape": [SIDE >> int(level)] * 3, "chunks": [CHUNK] * 3, "dtype": "<u2", "order": "C", "fill_value": 0}
        array |= {"compressor": codec, "filters": None, "dimension_separator": "/"}
        return json.dumps(array).encode()
    return None


class Store:
    def __init__(self, delay: float, blosc: bool):
        self._delay, self._formula, self._made = delay, Formula(blosc), {}
        self._threads = concurrent.futures.ThreadPoolExecutor(2)
        self.reset()

    def reset(self) -> None:
        self._counts = {"requests": 0, "missing": 0, "unchanged": 0, "bytes": 0}

    def make_coarse(self) -> None:
        for level in range(LEVELS - 1, FIRST_MADE - 1, -1):
            count = (SIDE >> level) // CHUNK
            for at in numpy.ndindex(count, count, count):
                self._make(f"{level}/" + "/".join(map(str, at)))

    def _make(self, key: str) -> bytes | None:
        """Of a chunk that the volume has; its key is LEVEL/Z/Y/X."""
        if key not in self._made:
            level, *at = (int(part) for part in key.split("/"))
            self._made[key] = self._formula.chunk(level, tuple(at))
        return self._made[key]

    @staticmethod
    def _is_chunk(key: str) -> bool:
        parts = key.split("/")
        if len(parts) != 4 or not all(part.isdigit() for part in parts):
            return False
        level, *at = map(int, parts)
        return level < LEVELS and all(place < (SIDE >> level) // CHUNK for place in at)

    async def _object(self, path: str) -> bytes | None:
        if not path.startswith(NAME):
            return None
        key = path.removeprefix(NAME)
        if not self._is_chunk(key):
            return metadata(key, self._formula.codec)
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
        found, _ = await asyncio.gather(self._object(path), asyncio.sleep(self._delay))
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
    p.add_argument("--blosc", action="store_true", help="pack chunks with Blosc, and have chunks of zeros, too")
    options = p.parse_args()
    store = Store(options.delay, options.blosc)
    store.make_coarse()
    server = await asyncio.start_server(store.serve, options.address, options.port, limit=1 << 20)
    print(f"http://{options.address}:{server.sockets[0].getsockname()[1]}{NAME.rstrip('/')}", flush=True)
    await server.serve_forever()


if __name__ == "__main__":
    try:
        asyncio.run(main())
    except KeyboardInterrupt:
        pass
