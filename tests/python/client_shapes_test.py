"""Meshes, lines and points given as arrays: the pictures are those of files, and they stay at the service as long as they are kept here."""
from __future__ import annotations

import gc
import itertools
import types
import unittest

import numpy as np

from client_support import PROGRAMS, WithAService  # noqa: F401

import slabstream as ss  # noqa: E402
from slabstream import page_state, shapes  # noqa: E402
from slabstream.drafts import draft_of  # noqa: E402

VIEW = dict(size=48, azimuth=30, elevation=20, renderer="raycast", fit=True)
# Round the head of client_support.
CENTRE = np.array((26, 32, 29))


def ball(radius: float = 12, rings: int = 12) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and faces."""
    polar, around = np.meshgrid(np.linspace(0, np.pi, rings), np.linspace(0, 2 * np.pi, 2 * rings, endpoint=False), indexing="ij")
    places = np.stack([np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), np.cos(polar)], axis=-1).reshape(-1, 3)
    faces = []
    for i, j in itertools.product(range(rings - 1), range(2 * rings)):
        a, b = 2 * rings * i + j, 2 * rings * i + (j + 1) % (2 * rings)
        faces += [(a, a + 2 * rings, b), (b, a + 2 * rings, b + 2 * rings)]
    return (radius * places + CENTRE).astype(np.float32), np.array(faces)


def ply(vertices: np.ndarray, faces: np.ndarray, more: dict[str, np.ndarray] | None = None) -> str:
    """Text. `more`: properties of vertices."""
    columns = {"x": vertices[:, 0], "y": vertices[:, 1], "z": vertices[:, 2], **(more or {})}
    kinds = {name: "uchar" if array.dtype == np.uint8 else "float" for name, array in columns.items()}
    lines = ["ply", "format ascii 1.0", f"element vertex {len(vertices)}", *(f"property {kind} {name}" for name, kind in kinds.items()),
             f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header"]
    lines += [" ".join(repr(each.item()) for each in row) for row in zip(*columns.values())]
    return "\n".join([*lines, *(f"3 {a} {b} {c}" for a, b, c in faces), ""])


class Shapes(WithAService):
    def setUp(self) -> None:
        self.service = ss.connect(endpoint=self.running.endpoint)
        self.addCleanup(self.service.close)

    def names(self) -> list[str]:
        return [dataset.name for dataset in self.service.datasets() if dataset.is_shape]

    def expect_file(self, shape: object, name: str, content: str | bytes, **look: object) -> np.ndarray:
        """The picture of a shape is that of a file; and it differs from that without a shape."""
        path = self.folder / name
        path.write_bytes(content.encode() if isinstance(content, str) else content)
        self.service.add_data(f"file={path}")
        try:
            picture = self.service.render("head", shape=[{"shape": shape, **look}], **VIEW).rgba
            np.testing.assert_array_equal(picture, self.service.render("head", shape={"shape": "file", **look}, **VIEW).rgba)
        finally:
            self.service.remove_data("file")
        self.assertGreater(np.abs(picture - self.service.render("head", **VIEW).rgba).max(), 0.1)
        return picture

    def test_a_mesh_of_arrays_is_that_of_its_file(self) -> None:
        vertices, faces = ball()
        self.expect_file(ss.Mesh(vertices, faces), "ball.ply", ply(vertices, faces))
        seen = self.expect_file(ss.Mesh(vertices, faces), "ball.ply", ply(vertices, faces), color="red", opacity=0.5)
        self.assertGreater(seen[..., 0].sum(), 2 * seen[..., 1].sum() * 0.5)

    def test_arrays_by_vertex_arrive(self) -> None:
        vertices, faces = ball()
        towards = (vertices - CENTRE).astype(np.float32)
        normals = towards / np.linalg.norm(towards, axis=1, keepdims=True)
        colors = np.rint(127 * (1 + normals)).astype(np.uint8)
        values = vertices[:, 2].copy()
        as_properties = {**dict(zip(("nx", "ny", "nz"), normals.T)), **dict(zip(("red", "green", "blue"), colors.T))}
        self.expect_file(ss.Mesh(vertices, faces, normals=normals, colors=colors), "c.ply", ply(vertices, faces, as_properties))
        self.expect_file(ss.Mesh(vertices, faces, colors=colors / 255), "c.ply", ply(vertices, faces, dict(zip(("red", "green", "blue"), colors.T))))
        for look in ({}, {"map": "plasma", "range": (20, 30)}):
            self.expect_file(ss.Mesh(vertices, faces, values=values), "v.ply", ply(vertices, faces, {"value": values}), **look)

    def test_points_and_lines_arrive(self) -> None:
        vertices, _ = ball(rings=5)
        radii = np.linspace(0.5, 2, len(vertices)).astype(np.float32)
        np.save(self.folder / "points.npy", np.column_stack([vertices, radii]))
        self.expect_file(ss.Points(vertices, radii=radii), "p.npy", (self.folder / "points.npy").read_bytes())
        table = "x,y,z\n" + "".join(f"{x!r},{y!r},{z!r}\n" for x, y, z in vertices.tolist())
        self.expect_file(ss.Points(vertices), "p.csv", table, width="6px", color="lime")
        parts = [vertices[:20], vertices[20:]]
        tck = b"mrtrix tracks\ndatatype: Float32LE\ncount: 2\nfile: . 64\nEND\n".ljust(64, b"\0")
        tck += b"".join(part.astype("<f4").tobytes() + np.full(3, np.nan, "<f4").tobytes() for part in parts) + np.full(3, np.inf, "<f4").tobytes()
        for shape in (ss.Lines(parts), ss.Lines(vertices, [0, 20]), ss.Lines(vertices.tolist(), np.array([0, 20], np.uint8))):
            self.expect_file(shape, "l.tck", tck, width=1.5)

    def test_one_is_sent_once_and_ends_with_its_object(self) -> None:
        mesh = ss.Mesh(*ball())
        first = self.service.render("head", shape=mesh, **VIEW)
        names = self.names()
        self.assertEqual(len(names), 1)
        other = self.service.render("head", shape=mesh.look(color="red", opacity=0.5), **VIEW)
        self.assertFalse((first.rgba == other.rgba).all())
        self.assertEqual(len([*self.service.turntable("head", 2, shape=mesh, size=16)]), 2)
        self.assertIsNotNone(self.service.pick("head", 24, 24, shape=mesh, **VIEW))
        self.assertEqual(self.names(), names)
        with ss.connect(endpoint=self.running.endpoint) as another:
            another.render("head", shape=mesh, **VIEW)
            self.assertEqual(len(self.names()), 2)
        frame = self.service.submit("head", shape=ss.Mesh(*ball(8)), **VIEW)
        frame.result()
        del mesh, frame
        self.expect_none()

    def test_what_lies_under_a_pixel_may_be_a_shape(self) -> None:
        vertices, faces = ball(20)
        mesh = ss.Mesh(vertices, faces, values=vertices[:, 2].copy())
        view = {**VIEW, "azimuth": 0, "elevation": 0, "fit": False, "look_at": tuple(CENTRE), "transfer": "none"}
        seen = self.service.pick("head", 24, 24, shape=[mesh.look(opacity=0.2), mesh.look(opacity=0.9)], **view)
        assert seen is not None
        self.assertEqual((seen.shape, seen.shape_number), (self.names()[0], 1))
        self.assertAlmostEqual(float(np.linalg.norm(np.array(seen.at) - CENTRE)), 20, delta=0.7)
        self.assertAlmostEqual(seen.shape_value or 0, seen.at[2], delta=1e-3)
        # Far from the volume.
        seen = self.service.pick("head", 24, 24, shape=ss.Points(CENTRE[None] - (0, 500, 0), radii=9), **view)
        assert seen is not None
        self.assertEqual((seen.index, seen.value, seen.shape_number, seen.shape_value), (None, None, 0, None))
        self.assertLess(seen.at[1], -400)
        self.assertIsNone(self.service.pick("head", 24, 24, **view))

    def expect_none(self) -> None:
        for _ in range(600):
            gc.collect()
            if not self.names():
                return
            ss.connect(endpoint=self.running.endpoint).close()
        self.fail(f"there are still {self.names()}")

    def test_one_that_the_service_has_lost_is_sent_again(self) -> None:
        mesh = ss.Mesh(*ball())
        picture = self.service.render("head", shape=mesh, **VIEW).rgba
        connection = self.service._asking._connection
        connection._loop.call(lambda: connection._loop.requests.fail_all("a test"))
        self.service.status()  # by the same thread
        np.testing.assert_array_equal(self.service.render("head", shape=mesh, **VIEW).rgba, picture)
        self.assertEqual(len(self.names()), 1)

    def test_load_and_render_take_shapes(self) -> None:
        self.addCleanup(ss.shutdown)
        array = np.zeros((20, 20, 20), np.uint8)
        image = ss.render(array, shape=ss.Points([[10, 10, 10]], radii=4).look(color="red"), size=32)
        red, green = image.rgba[16, 16, :2]
        self.assertGreater(red, 0.5)
        self.assertLess(green, red / 2)

    def test_meshes_of_pyvista_and_trimesh_are_taken(self) -> None:
        vertices, faces = ball()
        colors = np.tile(np.array((200, 100, 0, 255), np.uint8), (len(vertices), 1))
        expected = self.service.render("head", shape=ss.Mesh(vertices, faces, colors=colors), **VIEW).rgba

        class Arrays(dict):
            active_normals, active_scalars = None, colors

        flat = np.insert(faces, 0, 3, axis=1).ravel()
        polydata = types.SimpleNamespace(points=vertices, faces=flat, lines=np.array([], int), point_data=Arrays())
        trimesh = types.SimpleNamespace(vertices=vertices, faces=faces, visual=types.SimpleNamespace(kind="vertex", vertex_colors=colors))
        quads = types.SimpleNamespace(points=vertices, faces=np.array([4, 0, 1, 2, 3]), lines=[], point_data=Arrays(), triangulate=lambda: polydata)
        for given in (polydata, trimesh, quads, ss.shape_of(polydata)):
            np.testing.assert_array_equal(self.service.render("head", shape=given, **VIEW).rgba, expected)
        order = [5, 3, 8, 9, 1]
        lines = types.SimpleNamespace(points=vertices, faces=[], lines=[3, 5, 3, 8, 2, 9, 1], point_data=Arrays(radius=np.ones(len(vertices))))
        lines.point_data.active_scalars = vertices[:, 0]
        self.assertEqual(ss.shape_of(lines)._file, ss.Lines(vertices[order], [0, 3], radii=np.ones(5), values=vertices[order, 0])._file)
        lines.lines = []
        self.assertEqual(ss.shape_of(lines)._file, ss.Points(vertices, radii=np.ones(len(vertices)), values=vertices[:, 0])._file)

    def test_viewers_keep_shapes(self) -> None:
        from slabstream.viewer import Viewer
        viewer = Viewer(self.service, "head", None, None, {"shape": ss.Mesh(*ball()).look(color="red"), "size": 32})
        gc.collect()
        name, = self.names()
        self.assertEqual(viewer.first["shape"], f"{name},color=#ff0000")
        np.testing.assert_array_equal(viewer.picture().rgba, self.service.render("head", fit=True, shape=f"{name},color=red", size=32, background="#0d1014").rgba)
        viewer.close()
        self.expect_none()


class Options(unittest.TestCase):
    def test_texts_and_dicts_say_the_same(self) -> None:
        for text, given in (
            ("lung", "lung"),
            ("lung,color=pink,opacity=0.4", {"shape": "lung", "color": "pink", "opacity": 0.4}),
            (r"a\,b,color=1,0,1,width=3px", {"shape": "a,b", "color": (1, 0, 1), "width": "3px"}),
            ("fibres,width=2.5,map=plasma,range=1:2", {"shape": "fibres", "width": 2.5, "map": "plasma", "range": (1, 2), "color": None}),
        ):
            frame = draft_of("head", {"shape": text}).frame
            self.assertEqual(frame, draft_of("head", {"shape": [given]}).frame)
            page = page_state.texts_of(draft_of("head", {"shape": [given, "other"]}), {"shape": [given]})
            self.assertEqual(draft_of("head", page_state.options_of(page)).frame.shapes[0], frame.shapes[0])

    def test_mistakes_are_named(self) -> None:
        for given, sentence in (
            ("lung,colour=red", "has 'colour', but must have one of: color, opacity, width, map, range"),
            ({"shape": "lung", "size": 3}, "has 'size', but must have one of"),
            ("lung,opacity=0", r"shape opacity 0 is out of range \(0, 1\]"),
            ("lung,color=red,color=blue", "names 'color' twice"),
            ("lung,color=#ff000080", "must be opaque"),
            ({"shape": "lung", "width": "wide"}, "shape width wide|shape width 'wide' is not a number"),
            ("", "must be a name of 1 to 256 bytes"),
            (3, "a int is no shape"),
            (["a"] * 65, "has 65 shapes, at most 64"),
            (["a", {"shape": "b", "range": (2, 1)}], r"shape\[1\] range \(2, 1\) must rise"),
        ):
            with self.subTest(given=given), self.assertRaisesRegex(ss.InvalidArgument, sentence):
                draft_of("head", {"shape": given})

    def test_arrays_are_checked(self) -> None:
        v, f = np.eye(3), np.array([[0, 1, 2]])
        for make, sentence in (
            (lambda: ss.Mesh(v[:, :2], f), r"vertices has the shape \(3, 2\), must have \(N, 3\)"),
            (lambda: ss.Mesh(np.zeros((0, 3)), f), "vertices has 0 rows, must have 1 to"),
            (lambda: ss.Mesh(v.astype(str), f), "vertices has elements of type <U32, must be whole or real numbers"),
            (lambda: ss.Mesh(v + [[0], [np.nan], [0]], f), r"vertices\[1\] is not finite"),
            (lambda: ss.Mesh(v, f + 1), r"faces has 3, must be in \[0, 2\]"),
            (lambda: ss.Mesh(v, -f), r"faces has -1, must be in \[0, 2\]"),
            (lambda: ss.Mesh(v, f.astype(float)), "faces has elements of type float64, must be whole numbers"),
            (lambda: ss.Mesh(v, f[:0]), r"faces has the shape \(0, 3\), must have \(M, 3\)"),
            (lambda: ss.Mesh(v, f, normals=v[:2]), r"normals has the shape \(2, 3\), must have \(3, 3\)"),
            (lambda: ss.Mesh(v, f, colors=v * 2), r"colors must be uint8, or real numbers in \[0, 1\]"),
            (lambda: ss.Mesh(v, f, colors=v[:, :1]), r"colors has the shape \(3, 1\), must have \(3, 3 or 4\)"),
            (lambda: ss.Mesh(v, f, values=[1, 2]), r"values has the shape \(2,\), must have \(3,\)"),
            (lambda: ss.Mesh(v, f, values=[1, 2, np.inf]), "values must be finite, or NaN"),
            (lambda: ss.Points(v, radii=-1), r"radii -1 is out of range"),
            (lambda: ss.Points(v, radii=[1, -2, 1]), "radii has -2, must be at least 0"),
            (lambda: ss.Lines([]), r"points has no line|points has elements|points has the shape \(0,\)"),
            (lambda: ss.Lines([v, v[:1]]), "line 1 has 1 points, must have at least 2"),
            (lambda: ss.Lines(v, [1]), r"begins has the shape \(1,\), must have \(L,\) and begin with 0"),
            (lambda: ss.Lines(v, [0, 5]), r"begins has 5, must be in \[0, 2\]"),
        ):
            with self.subTest(sentence=sentence), self.assertRaisesRegex(ss.InvalidArgument, sentence):
                make()
        self.assertEqual(repr(ss.Lines([v, v])), "<slabstream.Lines of 6 vertices in 2 lines>")
        self.assertIsInstance(ss.Points(v, values=[1, np.nan, 2]), shapes.Shape)


if __name__ == "__main__":
    unittest.main()
