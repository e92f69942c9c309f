#!/usr/bin/env python3
"""A real napari shows by the plugin what it shows by itself, and follows its user (deploy/check napari). Needs a display with OpenGL."""
from __future__ import annotations

import contextlib
import functools
import http.server
import os
import pathlib
import subprocess
import sys
import tempfile
import threading
import time
import unittest

import dask.array as da
import napari
import numpy as np
import zarr
from qtpy.QtWidgets import QApplication

ROOT = pathlib.Path(__file__).resolve().parents[2]
os.environ.setdefault("SLABSTREAM_PROGRAMS", str(ROOT / "build" / "bin"))
sys.path[:0] = [str(ROOT / "python"), str(ROOT / "integrations" / "napari")]

import slabstream as ss  # noqa: E402
from napari_slabstream import layers as plugin_layers  # noqa: E402
from napari_slabstream.layers import camera_model  # noqa: E402
from napari_slabstream.pictures import Pictures  # noqa: E402

PATIENCE = 120
PICTURES = os.environ.get("SLABSTREAM_PICTURES")  # a folder: pictures of the tests, to look at
SHAPE = (40, 60, 50)


def blobs(at=0.0, shape=SHAPE):
    """No symmetry; z, y, x; 0 to 200."""
    z, y, x = (np.linspace(-1, 1, side, dtype=np.float32) for side in shape)
    z, y, x = z[:, None, None], y[None, :, None], x[None, None, :]
    values = np.exp(-4 * ((x - at) ** 2 + (1.3 * y) ** 2 + z**2)) + 0.8 * np.exp(-20 * ((x - 0.5) ** 2 + (y + 0.3) ** 2 + (z - 0.4) ** 2))
    return np.uint8(np.clip(160 * values, 0, 200))


def moments_until(holds, what):
    end = time.monotonic() + PATIENCE
    while not holds():
        assert time.monotonic() < end, what
        QApplication.processEvents()
        time.sleep(0.002)


class OfNapari(unittest.TestCase):
    def setUp(self):
        self.viewer = napari.Viewer(ndisplay=3, show=True)
        self.viewer.window.resize(760, 420)
        QApplication.processEvents()

    def tearDown(self):
        self.viewer.close()
        QApplication.processEvents()

    def open(self):
        self.dock, self.widget = self.viewer.window.add_plugin_dock_widget("napari-slabstream")
        self.widget.pictured.connect(lambda sharp: self.counts.append(sharp))
        self.counts = []
        QApplication.processEvents()
        self.viewer.reset_view()

    def settle(self):
        QApplication.processEvents()
        moments_until(lambda: self.widget.settled, "there is no sharp picture")
        QApplication.processEvents()

    def canvas(self, name=None):
        shown = self.viewer.screenshot(canvas_only=True, flash=False)[..., :3]
        if PICTURES and name:
            import imageio.v3
            imageio.v3.imwrite(f"{PICTURES}/{name}.png", shown)
        return shown.astype(float)

    def both(self, name):
        """What the canvas shows by the plugin, and by napari alone."""
        self.settle()
        self.assertEqual(self.widget._said.text(), "")
        ours = self.canvas(f"{name}-ours")
        self.widget._on.setChecked(False)
        QApplication.processEvents()
        theirs = self.canvas(f"{name}-napari")
        self.widget._on.setChecked(True)
        return ours, theirs

    def same(self, name, mean=1.0, most=0.01):
        """Alike but for `most` of the pixels: those at borders, and steps of rays."""
        ours, theirs = self.both(name)
        self.assertGreater((theirs.max(-1) > 30).mean(), 0.003, "napari shows nothing")
        off = np.abs(ours - theirs).max(-1)
        self.assertLess(off.mean(), mean, name)
        self.assertLess((off > 16).mean(), most, name)


class Follows(OfNapari):
    def setUp(self):
        super().setUp()
        self.layer = self.viewer.add_image(blobs(), scale=(2, 1, 1.5), translate=(10, -5, 3), rotate=(10, 20, 30), colormap="viridis",
                                           contrast_limits=(20, 190), rendering="mip")
        self.open()

    def test_the_camera(self):
        camera = camera_model(self.viewer)
        self.same("straight")
        camera.angles = (20, 35, 10)
        self.same("turned")
        camera.center = np.array(camera.center) + (4, -6, 9)
        camera.zoom *= 1.7
        self.same("near")
        camera.perspective = 40
        self.same("perspective")
        camera.orientation = ("away", "down", "left")
        self.same("left")
        camera.orientation = ("away", "up", "left")
        camera.perspective = 0
        self.same("away")
        self.viewer.window.resize(640, 520)
        self.same("resized")

    def test_the_look(self):
        layer = self.layer
        camera_model(self.viewer).angles = (10, -40, 5)
        for name, value in (("contrast_limits", (60, 140)), ("gamma", 0.5), ("colormap", "magma"), ("opacity", 0.6),
                            ("colormap", "viridis"), ("rendering", "minip"), ("rendering", "average"), ("blending", "additive"),
                            ("rendering", "mip"), ("scale", (1, 2, 1)), ("data", blobs(0.4))):
            setattr(layer, name, value)
            if layer.rendering == "average":
                layer.contrast_limits = (0, 70)
            with self.subTest(name=name, value=str(value)[:20]):
                self.same(f"{name}-{layer.rendering}", mean=3.0 if layer.rendering == "average" else 1.0)

    def test_volumes_that_add_up_opacity_show(self):
        for mode in ("iso", "translucent", "additive", "attenuated_mip"):
            self.layer.rendering = mode
            self.layer.iso_threshold = 90
            self.settle()
            shown = self.canvas(mode).max(-1)
            self.assertGreater((shown > 60).mean(), 0.004, mode)
            self.assertEqual(shown[0, 0], 0)

    def test_several_layers(self):
        self.layer.colormap = "green"
        for blending in ("additive", "translucent", "minimum", "opaque"):
            other = self.viewer.add_image(blobs(-0.5), colormap="red", blending=blending, scale=(2, 1, 1.5), rendering="mip",
                                          contrast_limits=(20, 190))
            self.layer.blending = "additive" if blending == "minimum" else "translucent"
            camera_model(self.viewer).angles = (20, 35, 10)
            if blending in ("additive", "minimum"):
                self.same(f"two-{blending}", most=0.02)
                other.visible = False
                self.same(f"two-{blending}-hidden")
            else:  # napari tests depths of the samples, and so a layer stands in the other
                self.settle()
                shown = self.canvas(f"two-{blending}")
                self.assertGreater(min((shown[..., 0] > 60).sum(), (shown[..., 1] > 60).sum()), 150)
            self.viewer.layers.remove(other)
        self.same("one")

    def test_two_dimensions_and_closing_leave_napari_alone(self):
        self.settle()
        node = self.widget._canvas.layer_to_visual[self.layer].node
        self.assertFalse(node.visible)
        self.layer.visible = False
        QApplication.processEvents()
        self.layer.visible = True
        self.settle()
        self.assertFalse(node.visible)
        self.viewer.dims.ndisplay = 2
        QApplication.processEvents()
        self.assertFalse(self.widget._node.visible)
        self.assertGreater((self.canvas("flat") > 60).any(-1).mean(), 0.005)
        self.viewer.dims.ndisplay = 3
        self.settle()
        self.viewer.window.remove_dock_widget(self.dock)
        QApplication.processEvents()
        self.assertTrue(self.widget._canvas.layer_to_visual[self.layer].node.visible)
        self.assertIsNone(self.widget._node.parent)
        self.assertGreater((self.canvas("closed") > 60).any(-1).mean(), 0.005)

    def test_the_newest_view_wins(self):
        self.settle()
        self.counts.clear()
        free, bring = threading.Event(), Pictures._bring

        def slowly(*given):
            free.wait(PATIENCE)
            return bring(*given)

        Pictures._bring = slowly
        try:
            self.widget._send_again()
            for number in range(20):  # the first of these holds the thread
                camera_model(self.viewer).angles = (number, 2 * number, 10)
                QApplication.processEvents()
        finally:
            free.set()
            Pictures._bring = bring
        self.settle()
        self.assertEqual(self.counts, [False, False, True])  # of the first, and of the last
        self.same("newest")

    def test_points_stand_before_volumes(self):
        self.viewer.add_points([self.layer.data_to_world((20, 30, 25))], size=12, face_color="white", border_width=0)
        self.settle()
        height, width, _ = self.canvas("points").shape
        self.assertGreater((self.canvas() == 255).all(-1).sum(), 50)

    def test_an_array_that_was_changed_is_sent_again(self):
        self.settle()
        before = self.canvas()
        self.layer.data[...] = blobs(0.4)
        self.layer.refresh()
        self.widget._send_again()
        self.settle()
        self.assertGreater(np.abs(self.canvas() - before).mean(), 2)

    def test_what_cannot_be_shown_stays_naparis_and_says_why(self):
        self.layer.shear = (0.5, 0, 0)
        moments_until(lambda: "right angles" in self.widget._said.text(), "nothing is said")
        QApplication.processEvents()
        self.assertTrue(self.widget._canvas.layer_to_visual[self.layer].node.visible)
        self.layer.shear = (0, 0, 0)
        self.same("upright")
        self.assertEqual(self.widget._said.text(), "")


class Quiet(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *_):
        pass


class Data(OfNapari):
    def test_times(self):
        movie = np.stack([blobs(at) for at in (-0.5, 0, 0.5)])
        self.viewer.add_image(movie, rendering="mip", contrast_limits=(20, 190))
        self.open()
        for number in (0, 2, 1):
            self.viewer.dims.set_current_step(0, number)
            self.same(f"time-{number}")
        self.viewer.dims.order = (0, 2, 3, 1)  # the axes as the user turns them
        self.same("order")

    def test_a_large_array_of_dask_is_computed_chunk_by_chunk(self):
        made = []

        def part(block_info=None):
            (z, z_end), (y, y_end), (x, x_end) = block_info[None]["array-location"]
            made.append((z, y, x))
            return blobs()[z:z_end, y:y_end, x:x_end]

        array = da.map_blocks(part, chunks=((25, 15), (30, 30), (50,)), dtype=np.uint8, meta=np.empty((0, 0, 0), np.uint8))
        self.viewer.add_image(array, rendering="mip", contrast_limits=(20, 190))
        most, plugin_layers._OWNED_BYTES = plugin_layers._OWNED_BYTES, 4096
        try:
            self.open()
            self.same("dask")
        finally:
            plugin_layers._OWNED_BYTES = most
        ((_, source),) = self.widget._pictures._sources.values()
        self.assertIsInstance(source.kept, ss.Owner)
        self.assertLess(len(made), 100)

    def store(self, folder):
        """An OME-Zarr of two channels and three levels, in which the programs look alike."""
        both = np.stack([blobs(), blobs(0.5)])
        path = pathlib.Path(folder) / "cells.zarr"
        group = zarr.open_group(str(path), mode="w", zarr_format=2)
        axes = [{"name": "c", "type": "channel"}] + [{"name": name, "type": "space"} for name in "zyx"]
        levels = []
        for level in range(2):
            step = 2**level
            group.create_array(str(level), data=both[:, ::step, ::step, ::step], chunks=(1, 20, 20, 20),
                               chunk_key_encoding={"name": "v2", "separator": "/"})
            levels.append({"path": str(level), "coordinateTransformations": [{"type": "scale", "scale": [1, 2 * step, step, step]}]})
        group.attrs["multiscales"] = [{"version": "0.4", "axes": axes, "datasets": levels}]
        group.attrs["omero"] = {"channels": [{"label": name, "color": "FF0000", "window": {"start": 0, "end": 200, "min": 0, "max": 255}}
                                             for name in ("DAPI", "Actin")]}
        return path, [da.from_zarr(str(path), component=str(level)) for level in range(2)]

    def check_store(self, folder, address):
        """By its address, and by value, it is the same picture."""
        _, levels = self.store(folder)
        added = self.viewer.add_image(levels, channel_axis=0, name=["DAPI", "Actin"], rendering="mip", contrast_limits=(20, 190),
                                      scale=(2, 1, 1), colormap=["green", "red"], blending="additive", metadata={"slabstream": address})
        self.open()
        camera_model(self.viewer).angles = (20, 35, 10)
        self.settle()
        self.assertEqual(self.widget._said.text(), "")
        sources = [source for _, source in self.widget._pictures._sources.values()]
        self.assertEqual([source.options for source in sources], [{"channels": [0]}, {"channels": [1]}])
        shown = self.canvas(f"store-{'http' in address}")
        self.assertGreater(min((shown[..., 0] > 60).sum(), (shown[..., 1] > 60).sum()), 300)
        for layer in added:
            layer.metadata = {}
        self.widget._send_again()
        self.settle()
        self.assertTrue(all(source.options == {} for _, source in self.widget._pictures._sources.values()))
        self.assertLess(np.abs(self.canvas() - shown).max(), 4)

    def test_a_store_is_read_by_the_service(self):
        with tempfile.TemporaryDirectory() as folder:
            self.check_store(folder, f"{folder}/cells.zarr")

    def test_a_store_behind_an_address_is_read_by_the_service(self):
        with tempfile.TemporaryDirectory() as folder, contextlib.ExitStack() as ends:
            server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Quiet, directory=folder))
            ends.callback(server.server_close)
            ends.callback(server.shutdown)
            threading.Thread(target=server.serve_forever, daemon=True).start()
            self.check_store(folder, f"http://127.0.0.1:{server.server_port}/cells.zarr")

    def test_a_store_that_napari_opens(self):
        with tempfile.TemporaryDirectory() as folder:
            path, _ = self.store(folder)
            (layer,) = self.viewer.open(str(path / "0"), plugin="napari", layer_type="image", rendering="mip", contrast_limits=(20, 190))
            self.assertEqual(plugin_layers.address_of(layer), None)  # a folder of another name
            os.symlink(path / "0", f"{folder}/array.zarr")
            self.viewer.layers.clear()
            (layer,) = self.viewer.open(f"{folder}/array.zarr", plugin="napari", layer_type="image", rendering="mip",
                                        contrast_limits=(20, 190))
            self.assertEqual(plugin_layers.address_of(layer), f"{folder}/array.zarr")
            self.open()
            self.same("opened")
            self.viewer.layers.clear()
            array = zarr.create_array(f"{folder}/one", data=blobs(), chunks=(20, 20, 20))
            layer = self.viewer.add_image(array, rendering="mip", contrast_limits=(20, 190))
            self.assertEqual(plugin_layers.address_of(layer), f"{folder}/one")
            self.same("array")
            source = list(self.widget._pictures._sources.values())[-1][1]
            self.assertEqual(source.options, {"channels": [0]})  # by its address

if __name__ == "__main__":
    unittest.main()
