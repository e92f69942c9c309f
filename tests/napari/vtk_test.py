#!/usr/bin/env python3
"""Meshes of VTK stand in volumes: pictures are those of scenes that are known in closed form (deploy/check napari)."""
from __future__ import annotations

import os
import pathlib
import sys
import unittest

import numpy as np
import pyvista
import vtkmodules.all as vtk

ROOT = pathlib.Path(__file__).resolve().parents[2]
os.environ.setdefault("SLABSTREAM_PROGRAMS", str(ROOT / "build" / "bin"))
sys.path.insert(0, str(ROOT / "python"))

import slabstream as ss  # noqa: E402
import slabstream.vtk as sv  # noqa: E402

PICTURES = os.environ.get("SLABSTREAM_PICTURES")  # a folder: pictures of the tests, to look at
SIDE, WIDTH, HEIGHT = 160, 300, 240
ORIGIN, STEP = np.array((100.0, -50.0, 20.0)), 2.0  # of voxel (0, 0, 0), x, y, z
CENTRE = ORIGIN + STEP * (SIDE - 1) / 2
BALL = (CENTRE, 100.0)                              # of the volume: centre and radius
SPHERE = (CENTRE + (80, -50, 30), 75.0)             # of the mesh: it stands half in the ball
BACKGROUND, RED, BLUE = (0.0, 0.5, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)
FROM = {"front": ((0.3, -1, 0.2), (0, 0, 1)), "behind": ((-0.2, 1, 0.4), (0.5, 0, 1)), "above": ((0.5, 0.3, 1), (0, 1, 0))}


def ball():
    axis = np.arange(SIDE, dtype=np.float32) - (SIDE - 1) / 2
    return np.uint8(STEP * np.sqrt(axis[:, None, None] ** 2 + axis[:, None] ** 2 + axis**2) <= BALL[1]) * 200


def plotter_with(mesh, direction, up, parallel):
    plotter = pyvista.Plotter(off_screen=True, window_size=(WIDTH, HEIGHT))
    plotter.set_background(BACKGROUND)
    plotter.add_mesh(mesh, color=BLUE, lighting=False)
    camera = plotter.camera
    camera.focal_point = CENTRE + (10, 5, -8)
    camera.position = np.array(camera.focal_point) + 900 * np.array(direction) / np.linalg.norm(direction)
    camera.up = up
    camera.view_angle = 25
    camera.parallel_projection = parallel
    camera.parallel_scale = 190
    plotter.renderer.ResetCameraClippingRange()
    return plotter


def rays(camera):
    """By pixel: where its ray begins and its direction, whose length along the view is 1."""
    eye, target = np.array(camera.position), np.array(camera.focal_point)
    forward = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(forward, camera.up)
    right /= np.linalg.norm(right)
    up = np.cross(right, forward)
    x, y = np.meshgrid(np.arange(WIDTH) + 0.5 - WIDTH / 2, HEIGHT / 2 - np.arange(HEIGHT) - 0.5)
    if camera.parallel_projection:
        pixel = 2 * camera.parallel_scale / HEIGHT
        return eye + pixel * (x[..., None] * right + y[..., None] * up), np.broadcast_to(forward, (HEIGHT, WIDTH, 3))
    pixel = 2 * np.tan(np.radians(camera.view_angle / 2)) / HEIGHT
    return np.broadcast_to(eye, (HEIGHT, WIDTH, 3)), forward + pixel * (x[..., None] * right + y[..., None] * up)


def hits(begin, direction, sphere):
    """Where rays enter a sphere and leave it; infinity: they miss it."""
    centre, radius = sphere
    a, b, c = (direction**2).sum(-1), ((begin - centre) * direction).sum(-1), ((begin - centre) ** 2).sum(-1) - radius**2
    root = np.sqrt(np.where(b**2 >= a * c, b**2 - a * c, np.nan))
    return tuple(np.nan_to_num((-b + sign * root) / a, nan=np.inf) for sign in (-1, 1))


def inner(classes):
    """Pixels whose neighbours are all of their class."""
    near = [np.roll(classes, (dy, dx), (0, 1)) for dy in (-1, 0, 1) for dx in (-1, 0, 1)]
    return np.all([each == classes for each in near], axis=0)


class Scenes(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.volume = ss.load(ball(), spacing=STEP, origin=ORIGIN[::-1])

    @classmethod
    def tearDownClass(cls):
        cls.volume.close()

    def compose(self, plotter, name, **options):
        image = sv.compose(plotter, self.volume.service, self.volume.name, **options)
        if PICTURES:
            image.save(f"{PICTURES}/{name}.png")
        return image

    def check(self, image, begin, direction):
        of_ball, of_sphere = hits(begin, direction, BALL)[0], hits(begin, direction, SPHERE)[0]
        classes = np.select([np.minimum(of_ball, of_sphere) == np.inf, of_ball < of_sphere], [0, 1], 2)
        seen = np.select([image.rgba[..., i] > 0.45 for i in (1, 0)], [0, 1], 2)
        self.assertGreater(min((classes == each).sum() for each in (0, 1, 2)), 1500)
        wrong = (seen != classes) & inner(classes)
        self.assertEqual(wrong.sum(), 0, np.argwhere(wrong)[:5])
        return of_ball, of_sphere, inner(classes)

    def test_a_sphere_half_in_an_opaque_ball(self):
        sphere = pyvista.Sphere(center=SPHERE[0], radius=SPHERE[1], theta_resolution=200, phi_resolution=200)
        for parallel in (True, False):
            for side, (direction, up) in FROM.items():
                with self.subTest(side=side, parallel=parallel):
                    plotter = plotter_with(sphere, direction, up, parallel)
                    look = {"isovalue": (100, "red"), "shading": "none"}
                    image = self.compose(plotter, f"{side}-{parallel}", renderer="zbuffer", **look)
                    begin, along = rays(plotter.camera)
                    of_ball, of_sphere, inside = self.check(image, begin, along)
                    eye = plotter.camera.distance - image.geometry.target_depth
                    expected = np.minimum(of_ball, of_sphere) - eye
                    seen = inside & np.isfinite(expected)
                    off = np.abs(image.depth[seen] - expected[seen])
                    self.assertLess(np.median(off), STEP)
                    self.assertTrue(np.isinf(image.depth[inside & ~np.isfinite(expected)]).all())
                    plotter.close()

    def test_a_plain_vtk_renderer(self):
        source = vtk.vtkSphereSource()
        source.SetCenter(SPHERE[0])
        source.SetRadius(SPHERE[1])
        source.SetThetaResolution(200)
        source.SetPhiResolution(200)
        mapper = vtk.vtkPolyDataMapper()
        mapper.SetInputConnection(source.GetOutputPort())
        actor = vtk.vtkActor()
        actor.SetMapper(mapper)
        actor.GetProperty().SetColor(BLUE)
        actor.GetProperty().LightingOff()
        renderer, window = vtk.vtkRenderer(), vtk.vtkRenderWindow()
        window.SetOffScreenRendering(1)
        window.SetSize(WIDTH, HEIGHT)
        window.AddRenderer(renderer)
        renderer.AddActor(actor)
        renderer.SetBackground(BACKGROUND)
        like = plotter_with(pyvista.Sphere(), *FROM["front"], parallel=True)
        renderer.GetActiveCamera().DeepCopy(like.camera)
        renderer.ResetCameraClippingRange()
        image = self.compose(renderer, "renderer", renderer="zbuffer", isovalue=(100, "red"), shading="none")
        self.check(image, *rays(like.camera))
        like.close()

    def test_what_would_not_be_the_scene_is_refused(self):
        plotter = plotter_with(pyvista.Sphere(center=SPHERE[0], radius=SPHERE[1]), *FROM["front"], parallel=True)
        for options, why in (({"background": "white"}, "background is given"), ({"renderer": "raycast"}, "the picture has no depths")):
            with self.assertRaisesRegex(ss.InvalidArgument, why):
                self.compose(plotter, "refused", **options)
        plotter.close()


class Out(unittest.TestCase):
    def test_a_volume(self):
        array = np.arange(24, dtype=np.uint16).reshape(2, 3, 4)
        found = ss.to_pyvista(array, spacing=(3, 2, 1), origin=(7, 6, 5), direction=((1, 0, 0), (0, 0, 1), (0, -1, 0)))
        self.assertEqual((found.dimensions, found.spacing, found.origin), ((4, 3, 2), (1, 2, 3), (5, 6, 7)))
        np.testing.assert_array_equal(found.point_data["values"].reshape(2, 3, 4), array)
        back = ss.volumes.volume_of(found)
        np.testing.assert_array_equal(back.samples, array)
        self.assertEqual(back.grid.steps, ((0, -1, 0), (2, 0, 0), (0, 0, 3)))

    def test_a_picture(self):
        rgba, depth = np.zeros((2, 3, 4), np.float32), np.arange(6, dtype=np.float32).reshape(2, 3)
        rgba[0, 2] = 1
        found = ss.to_pyvista(ss.Image(rgba, depth))
        self.assertEqual(found.dimensions, (3, 2, 1))
        self.assertEqual(found.point_data["rgba"][5].tolist(), [255] * 4)  # the upper right corner is the last point
        self.assertEqual(found.point_data["depth"].tolist(), [3, 4, 5, 0, 1, 2])


if __name__ == "__main__":
    unittest.main()
