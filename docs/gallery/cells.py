"""Makes a volume of cells by formulas, as a microscope of four colours might show them: cells.py OUT.ome.zarr. Needs numpy.

A layer of cells: nuclei with chromatin, membranes where cells touch, filaments that grow from beside each nucleus, and vesicles."""
import sys

import numpy
from ome_zarr import blurred, noise, write

SIZE, SPACING = (80, 224, 288), 0.25  # z, y, x; micrometres
random = numpy.random.default_rng(4)
z, y, x = numpy.meshgrid(*map(numpy.arange, SIZE), indexing="ij", sparse=True)

# Where cells are: points that keep apart.
centres = []
while len(centres) < 17:
    at = random.uniform((0, 0), SIZE[1:])
    if all(numpy.hypot(*(at - other)) > 52 for other in centres):
        centres.append(at)
centres = numpy.array(centres)

# Distances along bent lines, so that walls are not flat.
bend = [6 * noise(random, SIZE, 14) for _ in range(2)]
distances = numpy.stack([numpy.hypot(y + bend[0] - cy, x + bend[1] - cx) for cy, cx in centres])
cell = distances.argmin(0)
near, second = numpy.partition(distances, 1, axis=0)[:2]
middle = 0.47 * SIZE[0]
height = 22 + 10 * numpy.exp(-((near / 24) ** 2)) + noise(random, SIZE, 12)
inside = 1 / (1 + numpy.exp(-(height - abs(z - middle)) / 0.8))  # 1 in the layer
wall = numpy.exp(-(((second - near) / 3.2) ** 2)) * inside
skin = 0.16 * numpy.exp(-(((abs(z - middle) - height) / 1.5) ** 2))
membranes = wall * (0.75 + 0.25 * noise(random, SIZE, 2)) + skin

# Nuclei: ellipsoids, brighter at the rim and in clumps, dark in one or two nucleoli.
nuclei, grain = numpy.zeros(SIZE), noise(random, SIZE, 1.6)
for cy, cx in centres:
    turn, axes = random.uniform(0, numpy.pi), random.uniform((11, 19, 15), (14, 23, 18))
    u = (y - cy) * numpy.cos(turn) + (x - cx) * numpy.sin(turn)
    v = (x - cx) * numpy.cos(turn) - (y - cy) * numpy.sin(turn)
    r = numpy.sqrt(((z - middle) / axes[0]) ** 2 + (u / axes[1]) ** 2 + (v / axes[2]) ** 2)
    body = 1 / (1 + numpy.exp((r - 1) * 14))
    texture = 0.62 + 0.2 * grain + 0.25 * numpy.exp(-(((r - 0.9) / 0.09) ** 2))
    for _ in range(2):
        hole = random.uniform(-0.4, 0.4, 3) * axes
        d = (z - middle - hole[0]) ** 2 + (u - hole[1]) ** 2 + (v - hole[2]) ** 2
        texture = texture * (1 - 0.85 * numpy.exp(-d / 14))
    nuclei = numpy.maximum(nuclei, body * numpy.clip(texture, 0, 1.2))

# Filaments: walks of small steps, outwards from a point beside the nucleus, to the wall of the cell.
filaments = numpy.zeros(SIZE)
for number, (cy, cx) in enumerate(centres):
    angle = random.uniform(0, 2 * numpy.pi)
    start = numpy.array([middle + 8, cy + 20 * numpy.sin(angle), cx + 20 * numpy.cos(angle)])
    at = numpy.tile(start, (130, 1))
    way = random.standard_normal((130, 3)) * (0.5, 1, 1)
    alive = numpy.ones(130, bool)
    for _ in range(260):
        way += 0.14 * random.standard_normal(way.shape) - (0.004, 0, 0) * numpy.sign(at - middle) * (abs(at - middle) > 18)
        way /= numpy.linalg.norm(way, axis=1, keepdims=True)
        at += 0.5 * way
        i = numpy.rint(at).astype(int)
        alive &= ((i >= 0) & (i < SIZE)).all(1)
        i = i[alive]
        alive[alive] = (cell[tuple(i.T)] == number) & (inside[tuple(i.T)] > 0.6) & (nuclei[tuple(i.T)] < 0.3)
        numpy.add.at(filaments, tuple(numpy.rint(at[alive]).astype(int).T), 1)
filaments = blurred(numpy.minimum(filaments, 6), 0.8)

# Vesicles: bright points of several sizes, most of them near a nucleus.
vesicles = numpy.zeros(SIZE)
for sigma, count in ((1.3, 90), (1.9, 30)):
    points = numpy.zeros(SIZE)
    for number, (cy, cx) in enumerate(centres):
        at = numpy.rint(random.normal((middle, cy, cx), (12, 19, 19), (count, 3))).astype(int)
        at = at[((at >= 0) & (at < SIZE)).all(1)]
        at = at[(cell[tuple(at.T)] == number) & (nuclei[tuple(at.T)] < 0.1) & (inside[tuple(at.T)] > 0.9)]
        points[tuple(at.T)] = random.uniform(0.5, 1, len(at))
    vesicles = numpy.maximum(vesicles, 15 * sigma**3 * blurred(points, sigma))

made = [255 * numpy.clip(part, 0, 1) for part in (nuclei, membranes, 1.3 * filaments, vesicles)]
write(sys.argv[1], [numpy.stack(made) + 0.5], (SPACING,) * 3, "micrometer",
      [("Nuclei", "3fa9ff", 30, 220), ("Membranes", "ff3d9a", 40, 230), ("Filaments", "46e07c", 25, 200), ("Vesicles", "ffc738", 40, 220)])
