"""XDMF: boxes of arrays that h5py and numpy wrote, which numpy cuts; grids of cells that meshio wrote."""
import os

import h5py
import meshio
import numpy as np

from case import Case, samples, scaled

NUMBERS = {np.uint8: "UInt 1", np.int16: "Int 2", np.uint16: "UInt 2", np.int32: "Int 4", np.float32: "Float 4", np.float64: "Float 8"}


def text_of(numbers):
    return " ".join(str(number) for number in numbers)


def array_item(random, folder, name, stored):
    """The item of an array in an HDF5 or a binary file, of any layout."""
    attributes = f'Dimensions="{text_of(stored.shape)}"'
    if random.integers(2):
        with h5py.File(os.path.join(folder, f"{name}.h5"), "w") as file:
            chunks = tuple(int(random.integers(1, side + 1)) for side in stored.shape) if random.integers(2) else None
            file.create_dataset("group/a", data=stored, chunks=chunks, compression="gzip" if chunks else None, shuffle=bool(chunks))
        return f'<DataItem Format="HDF" {attributes}>{name}.h5:/group/a</DataItem>'
    order, skipped = random.choice(["Little", "Big"]), int(random.integers(0, 9))
    kind, precision = NUMBERS[stored.dtype.type].split()
    with open(os.path.join(folder, f"{name}.raw"), "wb") as file:
        file.write(bytes(skipped) + stored.astype(stored.dtype.newbyteorder("<" if order == "Little" else ">")).tobytes())
    attributes += f' Format="Binary" NumberType="{kind}" Precision="{precision}" Endian="{order}" Seek="{skipped}"'
    return f"<DataItem {attributes}>{name}.raw</DataItem>"


def grids(random, folder):
    """Cubes of one kind of cell or of two, and times that share them, with a linear field. The lattice has a voxel for each cube."""
    sides = random.integers(2, 6, 3)
    points = np.stack(np.meshgrid(*(np.arange(side + 1) for side in sides), indexing="ij"), -1).reshape(-1, 3).astype(float)
    numbers = np.arange(len(points)).reshape(sides + 1)
    corners = np.stack([numbers[x:sides[0] + x, y:sides[1] + y, z:sides[2] + z].ravel()
                        for x, y, z in ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))], -1)
    wedges = corners[:, [0, 1, 3, 4, 5, 7, 1, 2, 3, 5, 6, 7]].reshape(-1, 6)
    tetrahedra = wedges[:, [0, 1, 2, 3, 1, 2, 3, 4, 2, 3, 4, 5]].reshape(-1, 4)
    half, slope = len(corners) // 2, random.normal(size=3)
    mixed = [("hexahedron", corners[:half]), ("wedge", wedges[2 * half:])]
    voxels = ((np.moveaxis(np.indices(sides), 0, -1) + 0.5) @ slope).astype(np.float32)
    affine, options = scaled((1, 1, 1), (0.5, 0.5, 0.5)), f"lattice={max(sides)},array=f"
    for kind, cells in (("hexahedron", [("hexahedron", corners)]), ("wedge", [("wedge", wedges)]), ("tetra", [("tetra", tetrahedra)]),
                        ("mixed", mixed)):
        for data in ("XML", "Binary", "HDF"):
            path = os.path.join(folder, f"{kind}{data}.xdmf")
            meshio.write(path, meshio.Mesh(points, cells, point_data={"f": points @ slope}), data_format=data)
            yield Case(f"meshio {kind} {data}", path, voxels, affine, options, tolerance=2e-5)
    path = os.path.join(folder, "times.xdmf")
    with meshio.xdmf.TimeSeriesWriter(path, data_format="XML") as writer:
        writer.write_points_cells(points, mixed)
        for time in range(3):
            writer.write_data(time, point_data={"f": points @ slope + time})
    for time in range(3):
        yield Case(f"meshio time {time}", path, voxels + np.float32(time), affine, f"{options},time={time}", tolerance=2e-5)


def cases(random, folder, count, skipped):
    yield from grids(random, folder)
    for number in range(count):
        stored = samples(random, tuple(int(side) for side in random.integers(2, 9, 4)), random.choice(list(NUMBERS)))
        begin = [int(random.integers(side)) for side in stored.shape]
        size = [1] + [int(random.integers(1, side - first + 1)) for side, first in zip(stored.shape[1:], begin[1:])]
        box = stored[tuple(slice(first, first + side) for first, side in zip(begin, size))][0]
        item = array_item(random, folder, f"x{number}", stored)
        selection = f"<DataItem>{text_of(begin)} 1 1 1 1 {text_of(size)}</DataItem>"
        cells = bool(random.integers(2))
        spacing, origin = random.uniform(0.3, 3, 3), random.normal(scale=10, size=3)  # x, y, z
        points = [side + cells for side in box.shape]
        if random.integers(2):
            mesh = (f'<Topology TopologyType="3DCoRectMesh" Dimensions="{text_of(points)}"/><Geometry GeometryType="ORIGIN_DXDYDZ">'
                    f"<DataItem>{text_of(origin[::-1])}</DataItem><DataItem>{text_of(spacing[::-1])}</DataItem></Geometry>")
        else:
            points = [max(side, 2) for side in points] if cells else points
            axes = [start + step * np.arange(side) for start, step, side in zip(origin, spacing, points[::-1])]
            lone = [step for step, side in zip(spacing, points[::-1]) if side > 1]
            spacing = [step if side > 1 else min(lone, default=1) for step, side in zip(spacing, points[::-1])]
            mesh = (f'<Topology TopologyType="3DRectMesh" Dimensions="{text_of(points)}"/><Geometry GeometryType="VXVYVZ">' +
                    "".join(f"<DataItem>{text_of(axis)}</DataItem>" for axis in axes) + "</Geometry>")
        path = os.path.join(folder, f"x{number}.xmf")
        with open(path, "w") as file:
            file.write(f'<?xml version="1.0"?>\n<!DOCTYPE Xdmf SYSTEM "Xdmf.dtd" []>\n<Xdmf Version="3.0"><Domain><Grid>{mesh}'
                       f'<Attribute Name="a" Center="{"Cell" if cells else "Node"}"><DataItem ItemType="HyperSlab">{selection}{item}'
                       "</DataItem></Attribute></Grid></Domain></Xdmf>\n")
        affine = scaled(spacing, np.asarray(origin) + (np.asarray(spacing) / 2 if cells else 0))
        yield Case(f"{number} {box.shape} {stored.dtype} {'cells' if cells else 'points'}", path, box.transpose(2, 1, 0), affine)
