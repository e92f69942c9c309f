"""Runs of pictures, as docs/wire.md section 4 has them: read back as they were written, and refused if they are damaged."""
from __future__ import annotations

import random
import unittest

import numpy as np

import client_support  # noqa: F401  it finds the package

import slabstream as ss  # noqa: E402
from slabstream import schema  # noqa: E402
from slabstream.image import PictureFormat, compose  # noqa: E402
from slabstream.runs import read_runs  # noqa: E402


def write_runs(rgba: np.ndarray, depth: np.ndarray | None, x: int, y: int) -> tuple:
    """EncodedRuns and payload of the pixels with alpha, run by run."""
    height, width = rgba.shape[:2]
    table, pixels, depths = [], [], []
    for row in range(height):
        column = 0
        while column < width:
            begin = column
            while column < width and rgba[row, column, 3] > 0:
                column += 1
            if column > begin:
                table.append((row, begin, column - begin))
                pixels.append(rgba[row, begin:column])
                depths += [] if depth is None else [depth[row, begin:column]]
            column += 1
    payload = b"".join([np.array(table, "<u4").tobytes(), *(part.astype("<f4").tobytes() for part in pixels + depths)])
    runs = schema.EncodedRuns(codec=schema.CODEC_RAW, encoded_bytes=len(payload))
    runs.image.format = schema.PIXEL_FORMAT_RGBA if depth is None else schema.PIXEL_FORMAT_RGBA_DEPTH
    runs.image.color = schema.COLOR_CODING_FLOAT32
    runs.image.run_count, runs.image.pixel_count = len(table), sum(map(len, pixels))
    bounds = runs.image.bounds
    bounds.x_begin, bounds.y_begin, bounds.x_end, bounds.y_end = x, y, x + width, y + height
    return runs, payload


class Runs(unittest.TestCase):
    def setUp(self) -> None:
        seed = random.randrange(1 << 32)
        self.random = np.random.default_rng(seed)
        self.shown = f"seed {seed}"

    def picture(self, with_depth: bool) -> tuple:
        height, width = self.random.integers(1, 12, 2)
        rgba = self.random.random((height, width, 4)).astype(np.float32)
        rgba[self.random.random((height, width)) < 0.5] = 0
        depth = self.random.random((height, width)).astype(np.float32) if with_depth else None
        if depth is not None:
            depth[rgba[..., 3] == 0] = np.inf
        return rgba, depth, *self.random.integers(0, 5, 2).tolist()

    def test_pictures_come_back_in_their_place(self) -> None:
        for i in range(60):
            rgba, depth, x, y = self.picture(with_depth=i % 2 == 1)
            runs, payload = write_runs(rgba, depth, x, y)
            runs.digest = digest(payload)
            found, depths = compose(read_runs(runs, payload, 20, 18), 20, 18, PictureFormat())
            there = (slice(y, y + rgba.shape[0]), slice(x, x + rgba.shape[1]))
            np.testing.assert_array_equal(found[there], rgba, self.shown)
            self.assertEqual((found != 0).sum(), (rgba != 0).sum(), self.shown)
            if depth is None:
                self.assertIsNone(depths)
            else:
                np.testing.assert_array_equal(depths[there], depth, self.shown)
                self.assertEqual(np.isfinite(depths).sum(), np.isfinite(depth).sum(), self.shown)

    def test_an_empty_picture_is_empty(self) -> None:
        runs = schema.EncodedRuns(codec=schema.CODEC_RAW, digest=digest(b""))
        runs.image.format, runs.image.color = schema.PIXEL_FORMAT_RGBA, schema.COLOR_CODING_FLOAT32
        rgba, depth = compose(read_runs(runs, b"", 3, 2), 3, 2, PictureFormat(background=(1, 0.5, 0, 0.5)))
        np.testing.assert_array_equal(rgba, np.broadcast_to(np.float32([0.5, 0.25, 0, 0.5]), (2, 3, 4)))
        self.assertIsNone(depth)

    def test_damage_is_refused(self) -> None:
        """Whatever is altered, the picture is refused or has the right size."""
        refused = 0
        for i in range(300):
            rgba, depth, x, y = self.picture(with_depth=i % 2 == 1)
            runs, payload = write_runs(rgba, depth, x, y)
            damaged = bytearray(payload)
            if damaged and self.random.random() < 0.5:
                table = 12 * runs.image.run_count
                damaged[self.random.integers(0, table)] = self.random.integers(0, 256)
            else:
                change = self.random.choice(["run_count", "pixel_count", "format", "color", "x_end", "y_begin", "codec", "cut"])
                value = int(self.random.choice([0, 1, 2, 3, 7, 1 << 20]))
                if change == "cut":
                    damaged = damaged[: len(damaged) // 2]
                else:
                    holder = runs if change == "codec" else runs.image.bounds if "_" in change and change[0] in "xy" else runs.image
                    setattr(holder, change, value)
            runs.digest = digest(bytes(damaged))
            try:
                part = read_runs(runs, bytes(damaged), 20, 18)
            except ss.SlabstreamError as error:
                self.assertNotIn("\n", str(error))
                refused += 1
            else:
                self.assertEqual(compose(part, 20, 18, PictureFormat())[0].shape, (18, 20, 4), self.shown)
        self.assertGreater(refused, 100, self.shown)


def digest(payload: bytes) -> int:
    try:
        import xxhash
    except ImportError:
        return 0
    return xxhash.xxh3_64_intdigest(payload)


if __name__ == "__main__":
    unittest.main()
