"""Makes an embryo that divides three times, by formulas: embryo.py OUT.ome.zarr. Needs numpy.

Two channels, membranes and chromatin, at 30 times. A cell is a ball; while it divides, its two daughters move apart, and the wall between
them is where they are equally near. Chromatin becomes a plate across the line of division; its halves move to the daughters."""
import sys

import numpy
from ome_zarr import noise, write

SIDE, TIMES, RADIUS = 104, 30, 34.0  # voxels
random = numpy.random.default_rng(2)
z, y, x = numpy.meshgrid(*[numpy.arange(SIDE) - SIDE / 2 + 0.5] * 3, indexing="ij")
points = numpy.stack([z, y, x], -1).astype(numpy.float32)
grain, ripple = noise(random, (SIDE,) * 3, 1.5), noise(random, (SIDE,) * 3, 9)


def unit(vector):
    return vector / numpy.linalg.norm(vector)


def smooth(t, begin, end):
    s = numpy.clip((t - begin) / (end - begin), 0, 1)
    return s * s * (3 - 2 * s)


# Ways of division of the three rounds: across each other, a little turned from cell to cell.
WAYS = [unit(numpy.array(way)) for way in ((0.1, 0.1, 1.0), (0.2, 1.0, -0.1), (1.0, -0.15, 0.1))]
TURNS = random.standard_normal((3, 4, 3)) * 0.14


def cells_at(time):
    """Of each cell: its place, its radius, how far it is in the division that is nearest in time (0 to 1.4; else it rests), and its way."""
    cells = [(numpy.zeros(3), RADIUS, -9.0, WAYS[0])]
    for number in range(3):
        after = []
        for index, (place, radius, last, last_way) in enumerate(cells):
            phase = (time - 0.06 - 0.3 * number - 0.02 * (index % 3)) / 0.2
            way = unit(WAYS[number] + TURNS[number][index % 4])
            if phase <= 0:
                after.append((place, radius, phase, way) if phase > -0.4 else (place, radius, last, last_way))
                continue
            apart, child = smooth(phase, 0.35, 1.3), radius * 2 ** (-1 / 3)
            size = radius + (child - radius) * smooth(phase, 0.2, 1.1)
            after += [(place + side * way * apart * child * 0.86, size, phase, side * way) for side in (-1, 1)]
        cells = after
    return cells


def picture(time):
    cells = cells_at(time)
    depth = numpy.stack([radius - numpy.linalg.norm(points - place, axis=-1) for place, radius, _, _ in cells]) + 1.2 * ripple
    k = 4.0  # neighbours merge where they touch
    outside = k * numpy.log(numpy.exp(numpy.clip(depth / k, -20, 20)).sum(0))
    skin = numpy.exp(-((outside / 1.5) ** 2))
    walls = numpy.zeros_like(skin)
    if len(cells) > 1:
        second, first = numpy.partition(depth, len(cells) - 2, axis=0)[-2:]
        apart = numpy.ones_like(skin)
        for number, (place, radius, phase, way) in enumerate(cells):
            if 0 < phase < 1.3:  # the wall of sisters comes late
                apart[depth.argmax(0) == number] = smooth(phase, 0.5, 1.0)
        walls = numpy.exp(-(((first - second) / 1.7) ** 2)) * apart / (1 + numpy.exp(-outside / 0.8))
    chromatin = numpy.zeros_like(skin)
    for place, radius, phase, way in cells:
        split = smooth(phase, 0.35, 0.85)
        flat = smooth(phase, -0.35, 0.1) * (1 - smooth(phase, 0.9, 1.35))  # 1: a plate, 0: a round nucleus
        size = radius * (0.42 - 0.06 * flat)
        centre = place + way * (0 if phase <= 0 else split * radius * 0.16 * (1 - smooth(phase, 0.9, 1.4)))
        along = (points - centre) @ way
        across = numpy.sqrt(numpy.maximum(((points - centre) ** 2).sum(-1) - along**2, 0))
        r = numpy.hypot(along / (size * (1 - 0.68 * flat)), across / (size * (1 + 0.25 * flat)))
        chromatin = numpy.maximum(chromatin, (0.75 + 0.25 * flat + 0.2 * grain * (1 - 0.5 * flat)) / (1 + numpy.exp((r - 1) * 9)))
    membranes = (0.85 * skin + walls) * (0.85 + 0.15 * grain)
    return numpy.stack([255 * numpy.clip(part, 0, 1) for part in (membranes, chromatin)]) + 0.5


write(sys.argv[1], (picture(i / (TIMES - 1)) for i in range(TIMES)), (1, 1, 1), "micrometer",
      [("Membranes", "ff4fa3", 40, 235), ("Chromatin", "39d5ff", 40, 220)], seconds=600)
