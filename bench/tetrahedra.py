"""A generated unstructured grid for benchmarks: cubes of a unit cube, each split into six tetrahedra, with jittered points and a smooth field."""
import os

import numpy as np

JITTER = 0.15  # of a cube's side, to either side; more may turn tetrahedra inside out
# Kuhn's split: a tetrahedron for each order in which a path from corner 0 to corner 7 takes the axes. Neighbouring cubes cut their common
# face alike. Corner x + 2 y + 4 z.
SPLIT = np.array([[0, 1, 3, 7], [0, 5, 1, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 4, 5, 7], [0, 6, 4, 7]])


def field(points):
    """Waves of different directions, in [-1, 1]: about three to a side, so that many cells show each, and no symmetry hides a mirrored picture."""
    x, y, z = points.T
    return (np.sin(17 * x + 4 * y) + np.sin(14 * y - 6 * z + 1) + np.sin(11 * z + 5 * x + 2)) / 3


# A colour map as ParaView writes it, for the field: blue below, warm above, clear between. Three quarters of the cells show something.
TRANSFER = [{"Name": "waves", "ColorSpace": "RGB",
             "RGBPoints": [-1, 0.2, 0.4, 1, -0.2, 0.5, 0.7, 1, 0.2, 1, 0.8, 0.5, 1, 1, 0.3, 0.1],
             "Points": [-1, 0.1, 0.5, 0, -0.2, 0, 0.5, 0, 0.2, 0, 0.5, 0, 1, 0.1, 0.5, 0]}]


def cubes_a_side(count):
    """Of a grid of about `count` tetrahedra."""
    return max(1, round((count / 6) ** (1 / 3)))


def make(count, seed, layers=None):
    """About `count` tetrahedra: points (n, 3) and values (n) as float32, and the points of each tetrahedron (m, 4) as int64. `layers`:
    (begin, end) of the cubes along z that are made; None: all."""
    n = cubes_a_side(count)
    begin, end = layers or (0, n)
    z, y, x = np.meshgrid(np.arange(begin, end + 1), np.arange(n + 1), np.arange(n + 1), indexing="ij")
    places = np.stack([x, y, z], axis=-1).reshape(-1, 3)
    inner = (places > 0) & (places < n)  # what lies in a side of the cube stays in it
    # Each layer of points by itself, so that pieces have the same.
    moved = np.concatenate([np.random.default_rng([seed, layer]).uniform(-JITTER, JITTER, ((n + 1) ** 2, 3)) for layer in range(begin, end + 1)])
    points = ((places + moved * inner) / n).astype(np.float32)
    first = np.arange((end - begin + 1) * (n + 1) ** 2).reshape([end - begin + 1, n + 1, n + 1])[:-1, :n, :n].ravel()
    corners = first[:, None] + np.array([i + j * (n + 1) + k * (n + 1) ** 2 for k in (0, 1) for j in (0, 1) for i in (0, 1)])
    tetrahedra = corners[:, SPLIT].reshape(-1, 4)
    a, b, c, d = (points[tetrahedra[:, i]].astype(np.float64) for i in range(4))
    if (np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a) <= 0).any():
        raise ValueError(f"seed {seed} turns tetrahedra inside out")
    return points, field(points).astype(np.float32), tetrahedra


def write_pieces(path, count, seed, pieces):
    """A .pvtu and its pieces beside it, layers of the grid along z. Returns how many tetrahedra there are."""
    n = cubes_a_side(count)
    names, total = [], 0
    for piece in range(pieces):
        names.append(f"{os.path.splitext(os.path.basename(path))[0]}-{piece}.vtu")
        layers = (n * piece // pieces, n * (piece + 1) // pieces)
        total += write(os.path.join(os.path.dirname(path), names[-1]), count, seed, layers)
    with open(path, "w", encoding="utf-8") as stream:
        stream.write('<?xml version="1.0"?>\n<VTKFile type="PUnstructuredGrid" version="1.0" byte_order="LittleEndian">\n<PUnstructuredGrid>\n'
                     '<PPointData Scalars="field"><PDataArray type="Float32" Name="field"/></PPointData>\n'
                     '<PPoints><PDataArray type="Float32" Name="Points" NumberOfComponents="3"/></PPoints>\n'
                     + "".join(f'<Piece Source="{name}"/>\n' for name in names) + "</PUnstructuredGrid>\n</VTKFile>\n")
    return total


def write(path, count, seed, layers=None):
    """VTK's XML format, appended raw. Returns how many tetrahedra there are."""
    points, values, tetrahedra = make(count, seed, layers)
    arrays = [("PointData", values, 'type="Float32" Name="field"'), ("Points", points, 'type="Float32" Name="Points" NumberOfComponents="3"'),
              ("Cells", tetrahedra.astype("<i8"), 'type="Int64" Name="connectivity"'),
              ("Cells", np.arange(4, 4 * len(tetrahedra) + 1, 4, dtype="<i8"), 'type="Int64" Name="offsets"'),
              ("Cells", np.full(len(tetrahedra), 10, dtype=np.uint8), 'type="UInt8" Name="types"')]  # 10: VTK_TETRA
    offset, lines = 0, {}
    for element, data, attributes in arrays:
        lines[element] = lines.get(element, "") + f'<DataArray {attributes} format="appended" offset="{offset}"/>\n'
        offset += 8 + data.nbytes
    with open(path, "wb") as stream:
        stream.write(f"""<?xml version="1.0"?>
<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" header_type="UInt64">
<UnstructuredGrid><Piece NumberOfPoints="{len(points)}" NumberOfCells="{len(tetrahedra)}">
<PointData Scalars="field">
{lines['PointData']}</PointData><CellData></CellData>
<Points>
{lines['Points']}</Points>
<Cells>
{lines['Cells']}</Cells>
</Piece></UnstructuredGrid>
<AppendedData encoding="raw">_""".encode())
        for _, data, _ in arrays:
            stream.write(np.uint64(data.nbytes).tobytes() + data.tobytes())
        stream.write(b"</AppendedData></VTKFile>\n")
    return len(tetrahedra)
