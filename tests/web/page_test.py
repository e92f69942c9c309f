#!/usr/bin/env python3
"""The viewer's page in Chromium: the real programs, real events. Screenshots of the states go to a folder of the build.

    page_test.py FOLDER_OF_PROGRAMS FOLDER_FOR_SCREENSHOTS CHROMIUM CHROMEDRIVER [unittest arguments]
"""
import base64
import gzip
import json
import math
import os
import re
import shutil
import signal
import sys
import time
import unittest
import urllib.parse
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "gateway"))
from gateway_test import Programs, wait_until  # noqa: E402
from page import png_pixels  # noqa: E402

import browser  # noqa: E402
from browser import Viewer  # noqa: E402
from proxy import Proxy  # noqa: E402
from slow_link import SlowLink  # noqa: E402
from selenium.webdriver.common.by import By  # noqa: E402
from selenium.webdriver.common.keys import Keys  # noqa: E402

SHOTS, CHROMIUM, CHROMEDRIVER = Path(sys.argv[2]), sys.argv[3], sys.argv[4]


def write_nrrd(path, size, value, space="right-anterior-superior", spacing=2.0):
    x, y, z = size
    data = bytes(value(i, j, k) for k in range(z) for j in range(y) for i in range(x))
    header = (f"NRRD0004\ntype: uint8\ndimension: 3\nspace: {space}\nsizes: {x} {y} {z}\nspace directions: ({spacing},0,0) (0,{spacing},0) (0,0,{spacing})\n"
              "kinds: domain domain domain\nspace origin: (-20,-24,-16)\nencoding: raw\n\n")
    path.write_bytes(header.encode() + data)


SIZE = (22, 26, 18)
SPACING = 2.0
BIG_MEGABYTES = 256


def ball(i, j, k):
    """Brighter to the right, so that no two sides look alike."""
    r = ((i - 10.5) / 10) ** 2 + ((j - 12.5) / 12) ** 2 + ((k - 8.5) / 8) ** 2
    return 60 + 8 * i if r < 1 else 0


def write_grid(path):
    """A hexahedron with a pyramid on it: legacy VTK."""
    points = [(0, 0, 0), (4, 0, 0), (4, 3, 0), (0, 3, 0), (0, 0, 2), (4, 0, 2), (4, 3, 2), (0, 3, 2), (2, 1, 5)]
    lines = ["# vtk DataFile Version 3.0", "grid", "ASCII", "DATASET UNSTRUCTURED_GRID", f"POINTS {len(points)} float", *(" ".join(map(str, p)) for p in points),
             "CELLS 2 15", "8 0 1 2 3 4 5 6 7", "5 4 5 6 7 8", "CELL_TYPES 2", "12", "14",
             f"POINT_DATA {len(points)}", "SCALARS v float 1", "LOOKUP_TABLE default", *(str(x + 2 * z) for x, _, z in points)]
    path.write_text("\n".join(lines) + "\n")


def ply_box(low, high):
    corners = [(x, y, z) for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])]
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return "\n".join(["ply", "format ascii 1.0", "element vertex 8", *(f"property float {axis}" for axis in "xyz"), "element face 6", "property list uchar int vertex_indices", "end_header",
                      *(" ".join(map(str, c)) for c in corners), *("4 " + " ".join(map(str, q)) for q in quads), ""])


# Runs before the page: it believes that "patient" has more than this file, and what it asks of that is kept from the gateway.
MORE = """
const more = ARGUMENT, send = WebSocket.prototype.send, parse = JSON.parse, json = Response.prototype.json;
window.more = more;
window.sent = []; // times, each with the one that was shown then
const told = answer => { for (const dataset of answer?.datasets ?? []) if (dataset.name === 'patient') Object.assign(dataset, more); return answer; };
JSON.parse = (...given) => told(parse(...given));
Response.prototype.json = async function () { return told(await json.call(this)); };
WebSocket.prototype.send = function (text) {
  const message = parse(text);
  if (message.options?.time) window.sent.push([message.options.time, window.drawn[window.drawn.length - 1]?.options.time]);
  for (const name of Object.keys(message.options ?? {})) if (/^(channel|blend$|time$)/.test(name)) delete message.options[name];
  return send.call(this, JSON.stringify(message));
};
"""
CHANNELS = [{"name": "DAPI", "channel": True, "color": "#0000ff", "window": [20, 120], "shown": True},
            {"name": "Actin", "channel": True, "color": None, "window": None, "shown": True},
            {"name": "Tubulin", "channel": True, "color": "#ffff00", "window": [50, 250], "shown": False}]


class PageTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.programs = Programs()
        cls.addClassCleanup(cls.programs.close)
        write_nrrd(cls.programs.folder / "p.nrrd", SIZE, ball)
        write_nrrd(cls.programs.folder / "l.nrrd", SIZE, lambda i, j, k: 0 if ball(i, j, k) == 0 else 1 + i // 8)
        (cls.programs.folder / "names.txt").write_text("1 1 0.2 0.1 left\n2 0.25 0.75 0.5 middle\n3 0.2 0.4 1 right\n")
        cls.programs.run("sphere", "--class", 1, "--size", 24, "--occupancy", 0.2, "-o", "s.nrrd")
        write_grid(cls.programs.folder / "g.vtk")
        write_nrrd(cls.programs.folder / "o.nrrd", SIZE, lambda i, j, k: 10 * k if ball(i, j, k) > 0 else 0)
        cells = "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 22 26 18\nspacings: 0.5 0.5 2\nunits: \"um\" \"um\" \"um\"\nencoding: raw\n\n"
        (cls.programs.folder / "c.nrrd").write_bytes(cells.encode() + bytes(ball(i, j, k) for k in range(18) for j in range(26) for i in range(22)))
        # Half a gigabyte of zeros, of which a file takes little: it is read long enough to be seen.
        big = f"NRRD0004\ntype: uint8\ndimension: 3\nsizes: 1024 1024 {BIG_MEGABYTES}\nencoding: gzip\n\n".encode()
        (cls.programs.folder / "big.nrrd").write_bytes(big + gzip.compress(bytes(1 << 20), 1) * BIG_MEGABYTES)
        cls.programs.run("sphere", "--class", 2, "--size", 130, "-o", "v.nrrd")
        cls.programs.run("convert", "v.nrrd", "v.ome.zarr")
        # Two channels at three times.
        dyes = "NRRD0004\ntype: uint8\ndimension: 5\nsizes: 22 26 18 3 2\nkinds: domain domain domain time vector\nencoding: raw\n\n"
        dyes = dyes.encode() + bytes(ball(i + 2 * t, j, k) if c == 0 else 9 * k for c in range(2) for t in range(3) for k in range(18) for j in range(26) for i in range(22))
        (cls.programs.folder / "dyes.nrrd").write_bytes(dyes)
        (cls.programs.folder / "plate.ply").write_text(ply_box((-30, 5, -30), (30, 12, 25)))
        (cls.programs.folder / "dots.csv").write_text("x,y,z\n" + "".join(f"{20 * math.cos(i / 20)},{20 * math.sin(i / 20)},{i / 8 - 20}\n" for i in range(250)))
        cls.data = ("--data", "plate=plate.ply", "--data", "dots=dots.csv", "--data", "dyes=dyes.nrrd", "--data", "levels=v.ome.zarr", "--data", "patient=p.nrrd,labels=l.nrrd:names.txt,overlay=o.nrrd", "--data", "sphere=s.nrrd", "--data", "grid=g.vtk", "--data", "cells=c.nrrd", "--data", "other=o.nrrd", "--data", "big=big.nrrd", "--data", "later=big.nrrd")
        cls.service, cls.endpoint = cls.programs.up(*cls.data)
        cls.process, cls.gateway = cls.programs.gateway("--endpoint", cls.endpoint)
        wait_until(lambda: cls.gateway.request("/readyz")[0] == 200, "ready")
        cls.driver = browser.start(CHROMIUM, CHROMEDRIVER)
        cls.addClassCleanup(cls.driver.quit)

    def url(self, port=None, token=True, held=None, **fields):
        parts = ([f"token={(held or self.gateway).token}"] if token else []) + [f"{name.replace('_', '-')}={urllib.parse.quote(str(value), safe=',:;')}" for name, value in {"dataset": "patient", **fields}.items()]
        return f"http://127.0.0.1:{port or self.gateway.port}/#{'&'.join(parts)}"

    def viewer(self, port=None, width=1000, height=640, pixels=1, mobile=False, theme="dark", token=True, script="", held=None, **fields):
        """`held`: for the holder of another token."""
        viewer = Viewer(self.driver, self.url(port, token, held, **fields), width, height, pixels, mobile, theme, script)
        self.addCleanup(viewer.close)
        return viewer

    def proxy(self, delay=0.0, answers=None, prefix=""):
        proxy = Proxy(self.gateway.host, self.gateway.port, delay, answers, prefix)
        self.addCleanup(proxy.close)
        return proxy

    def command_line(self, drawn, kind="render"):
        """The pixels of the same picture by the command line."""
        arguments = []
        for name, values in drawn["options"].items():
            for value in values if isinstance(values, list) and not (values and isinstance(values[0], dict)) else [values]:
                if name == "dataset":
                    continue
                if isinstance(value, list):
                    value = json.dumps(value)
                arguments.append(f"--{name}" if value is True else f"--{name}={value}")
        self.programs.run(kind, drawn["options"]["dataset"], "--endpoint", self.endpoint, "-o", "cli.png", *arguments)
        return png_pixels((self.programs.folder / "cli.png").read_bytes())

    def at_the_same_address(self, viewer):
        """Another tab with what the address of this one says; it is closed at the end."""
        other = Viewer(self.driver, viewer.js("location.href").replace("#", f"#token={self.gateway.token}&"))
        self.addCleanup(other.close)
        return other

    def assertSamePixels(self, one, other):
        self.assertEqual(one[:2], other[:2])
        different = sum(a != b for a, b in zip(one[2], other[2]))
        self.assertEqual(different, 0, f"{different} of {len(one[2])} bytes differ")

    def assertFinal(self, viewer, condition):
        """The lossless picture whose options fulfil a condition (Viewer.final) is that of the command line. Returns it."""
        drawn = viewer.final(condition)
        self.assertSamePixels(viewer.pixels(), self.command_line(drawn))
        return drawn

    # ---- the picture

    def test_the_still_picture_is_that_of_the_command_line(self):
        viewer = self.viewer(renderer="raycast", clip_box=":,:0,:", light="1,-1,1", azimuth=200)
        drawn = viewer.settled()
        self.assertEqual(drawn["header"]["type"], "image/png")
        self.assertSamePixels(viewer.pixels(), self.command_line(drawn))
        viewer.save(SHOTS, "picture")
        canvas = viewer.js("(c => [c.width, c.height, c.clientWidth, c.clientHeight])(document.querySelector('canvas'))")
        self.assertEqual(canvas[:2], canvas[2:], "a pixel of the picture is one of the screen")

    def test_pictures_have_the_pixels_of_the_screen(self):
        viewer = self.viewer(width=700, height=500, pixels=2)
        viewer.final("h.size[0] === Math.round(2 * document.querySelector('canvas').clientWidth) && h.size[1] === Math.round(2 * document.querySelector('canvas').clientHeight)")

    def test_dragging_turns_moves_rolls_and_zooms(self):
        viewer = self.viewer()
        before = viewer.settled()["options"]
        viewer.drag(50, 25, steps=8)
        turned = viewer.final(f"o.azimuth !== {before['azimuth']}")
        self.assertAlmostEqual(turned["options"]["azimuth"], before["azimuth"] - 20, places=3)
        self.assertAlmostEqual(turned["options"]["elevation"], before["elevation"] + 10, places=3)
        self.assertTrue(viewer.js("window.drawn.some(d => !d.final && d.header.type === 'image/jpeg')"), "it was seen while it moved")
        self.assertSamePixels(viewer.pixels(), self.command_line(turned))

        viewer.drag(40, -30, keys=["shift"])
        moved = viewer.final(f"o['look-at'] !== '{turned['options']['look-at']}'")
        was, now = turned["header"]["geometry"], moved["header"]["geometry"]
        for i in range(3):  # what was in the middle is 40 pixels to the right and 30 upwards
            self.assertAlmostEqual(now["target"][i], was["target"][i] - was["pixel_size"] * (40 * was["right"][i] + 30 * was["up"][i]), delta=1e-3)

        viewer.wheel(-200, (100, 60))
        zoomed = viewer.final(f"o.zoom > {moved['options']['zoom']}")
        was, now = moved["header"]["geometry"], zoomed["header"]["geometry"]
        for i in range(3):  # the point below the pointer stays there
            point = [g["target"][i] + g["pixel_size"] * (100 * g["right"][i] - 60 * g["up"][i]) for g in (was, now)]
            self.assertAlmostEqual(point[0], point[1], delta=1e-3)

        viewer.drag(0, 60, start=(120, 0), keys=["ctrl"])
        rolled = viewer.final("o.roll !== 0")
        self.assertAlmostEqual(rolled["options"]["roll"], 26.565, places=2)

        viewer.keys("r")
        back = viewer.final(f"o.azimuth === {before['azimuth']} && o.roll === 0 && o['look-at']")
        self.assertAlmostEqual(back["options"]["zoom"], before["zoom"], places=4)

    def test_the_picture_sharpens_and_a_badge_tells_its_level(self):
        viewer = self.viewer(dataset="levels", renderer="raycast", zoom=0.5, layout="quad")
        badge = "document.querySelector('[data-pane=\"3d\"] .pane-level:not([hidden])')?.textContent"
        drawn = viewer.settled()
        first = viewer.js("window.drawn.find(d => d.pane === '3d')")
        self.assertFalse(first["final"])
        self.assertGreater(first["header"]["coarseness"], 1)
        self.assertGreater(first["header"]["statistics"]["levels"][0]["level"], drawn["header"]["statistics"]["levels"][0]["level"])
        self.assertEqual(drawn["header"]["coarseness"], 1)
        viewer.until(f"{badge} === 'Level {drawn['header']['statistics']['levels'][0]['level']} of 0–2'")
        self.assertSamePixels(viewer.pixels(), self.command_line(drawn))
        viewer.until("document.querySelectorAll('.pane-level:not([hidden])').length === 4")
        viewer.final("true", "z")
        viewer.open_section("Dataset")
        viewer.until("[...document.querySelectorAll('.facts dd')].some(d => d.textContent === '3, down to 33 × 33 × 33')")
        viewer.until("document.querySelector('.dataset option[value=levels]').textContent === 'levels (130 × 130 × 130, 3 levels)'")
        viewer.save(SHOTS, "levels")
        # A pixel is wider than two voxels of the middle level even before the page takes the size of the emulated screen.
        narrow = self.viewer(width=360, height=640, mobile=True, theme="light", dataset="levels", renderer="raycast", zoom=0.05)
        self.assertEqual(narrow.settled()["header"]["statistics"]["levels"][0]["level"], 2)
        narrow.until(f"{badge} === 'Level 2 of 0–2'")
        narrow.save(SHOTS, "levels-narrow")
        one = self.viewer()
        one.settled()
        one.until("document.querySelector('.facts dd') !== null")
        self.assertTrue(one.js("document.querySelector('.pane-level').hidden"), "it has one level")

    def test_the_right_button_changes_window_and_level(self):
        viewer = self.viewer(scalar_range="50:150")
        viewer.settled()
        viewer.drag(100, 0, button="right")
        low, high = map(float, viewer.final("o['scalar-range'] !== '50:150'")["options"]["scalar-range"].split(":"))
        self.assertGreater(high - low, 100)
        self.assertAlmostEqual((low + high) / 2, 100, delta=0.01)
        viewer.drag(0, -50, button="right")
        level = sum(map(float, viewer.final(f"o['scalar-range'] !== '{low:g}:{high:g}'")["options"]["scalar-range"].split(":"))) / 2
        self.assertLess(level, 100)
        viewer.keys(Keys.CONTROL, "z")
        viewer.final(f"o['scalar-range'] === '{low:g}:{high:g}'")  # a drag is one step
        viewer.keys(Keys.CONTROL, "z")
        viewer.final("o['scalar-range'] === '50:150'")

    def test_fingers_turn_move_zoom_and_roll(self):
        viewer = self.viewer(width=360, height=640, mobile=True)
        before = viewer.settled()["options"]
        viewer.touch(((0, 0), (40, 0)))
        turned = viewer.final(f"o.azimuth !== {before['azimuth']}")["options"]
        self.assertAlmostEqual(turned["azimuth"], before["azimuth"] - 16, places=2)
        self.assertEqual(turned["zoom"], before["zoom"])
        viewer.touch(((-40, 0), (-80, 0)), ((40, 0), (80, 0)))
        zoomed = viewer.final(f"o.zoom > {1.5 * before['zoom']}")["options"]
        self.assertAlmostEqual(zoomed["zoom"], 2 * before["zoom"], delta=0.05 * before["zoom"])
        self.assertAlmostEqual(zoomed["azimuth"], turned["azimuth"], places=3)
        viewer.touch(((-60, 0), (0, -60)), ((60, 0), (0, 60)), steps=16)
        self.assertAlmostEqual(viewer.final("Math.abs(o.roll) > 86")["options"]["roll"], 90, delta=3)
        viewer.save(SHOTS, "narrow")

    # ---- the link

    def test_a_link_opens_the_same_picture(self):
        viewer = self.viewer(renderer="raycast")
        viewer.settled()
        viewer.drag(33, -21)
        viewer.drag(30, 0, button="right")
        viewer.keys("b", "l")
        drawn = viewer.final("o['clip-box'] !== undefined && h.size[0] < 400")
        viewer.until("location.hash.includes('layout=quad')")
        self.assertNotIn(self.gateway.token, viewer.js("location.href"), "the address holds no token")
        viewer.keys("c")
        plain = viewer.until("window.copied[0]")
        self.assertNotIn(self.gateway.token, plain)
        viewer.find(".share").click()
        viewer.driver.find_element(By.XPATH, "//button[@role='menuitem'][contains(., 'with access')]").click()
        link = viewer.until("window.copied[1]")
        self.assertIn(self.gateway.token, link)
        shown = viewer.pixels()

        other = Viewer(self.driver, link)
        self.addCleanup(other.close)
        same = other.final("o['clip-box'] !== undefined && h.size[0] < 400")
        self.assertEqual(same["options"], drawn["options"])
        self.assertSamePixels(other.pixels(), shown)
        other.driver.refresh()
        other.final("o['clip-box'] !== undefined")  # the token is kept for this tab

    def test_without_a_token_the_page_asks_for_it(self):
        viewer = self.viewer(token=False)
        field = viewer.driver.find_element(By.CSS_SELECTOR, "dialog input")
        viewer.save(SHOTS, "token")
        field.send_keys(self.url())
        viewer.find("dialog .primary").click()
        viewer.settled()
        wrong = self.viewer(token=False, zoom=2)
        wrong.driver.execute_script("sessionStorage.clear()")
        wrong.driver.get(wrong.js("location.href.replace('#', '#token=wrong&')"))
        wrong.driver.refresh()
        wrong.until("document.querySelector('dialog') !== null")

    def test_a_wrong_link_shows_what_is_right_in_it(self):
        viewer = self.viewer(azimuth="x", renderer="nothing", zoom=-3, clip_box="1", function="||", elevation=40)
        viewer.until("document.querySelector('.banner:not([hidden])')?.textContent.includes('nothing')")
        viewer.driver.find_element(By.XPATH, "//option[. = 'Ray casting']").click()
        drawn = viewer.settled()
        self.assertEqual((drawn["options"]["elevation"], drawn["options"]["azimuth"]), (40, 180))
        self.assertFalse(viewer.js("document.querySelector('.banner:not([hidden])') !== null"))

    # ---- the look

    def test_editing_the_function_changes_the_picture(self):
        asked = []
        ramp = [{"Name": "auto", "RGBPoints": [0, 0, 0, 0, 250, 1, 0.5, 0.2], "Points": [0, 0, 0.5, 0, 100, 0.2, 0.5, 0, 250, 0.8, 0.5, 0]}]
        answers = {"/api/v1/transfer": lambda fields, body: asked.append(fields) or ramp,
                   "/api/v1/histogram": lambda fields, body: {"dataset": "patient", "range": [0, 250], "counts": [2 ** (i % 12) for i in range(256)], "percentiles": {}}}
        viewer = self.viewer(self.proxy(answers=answers).port, transfer="opaque")
        drawn = viewer.settled()
        viewer.until("document.querySelectorAll('.editor .plot .point.opacity').length === 3 && document.querySelector('.histogram').getAttribute('d') !== ''")
        self.assertEqual(asked[0], {"dataset": "patient", "transfer": "opaque"})
        before = viewer.pixels()
        viewer.js("document.querySelectorAll('.editor .plot .point.opacity')[1].focus()")
        viewer.driver.switch_to.active_element.send_keys(Keys.ARROW_UP * 5, Keys.ARROW_RIGHT)
        edited = viewer.final("Array.isArray(o.transfer) && Math.abs(o.transfer[0].Points[5] - 0.25) < 1e-6")
        self.assertGreater(edited["options"]["transfer"][0]["Points"][4], 100)
        self.assertNotEqual(viewer.pixels(), before)
        self.assertSamePixels(viewer.pixels(), self.command_line(edited))
        viewer.save(SHOTS, "function")

        # A click adds a point and a drag moves it; Delete takes it away.
        x, y = viewer.js("(b => [b.left + b.width * 0.7, b.top + 60])(document.querySelector('.editor .plot').getBoundingClientRect())")
        for kind, dy in (("mousePressed", 0), ("mouseMoved", 30), ("mouseReleased", 30)):
            viewer.command("Input.dispatchMouseEvent", type=kind, x=x, y=y + dy, button="left", buttons=1, clickCount=1)
        viewer.final("o.transfer[0].Points.length === 16")
        viewer.js("document.querySelector('.editor .plot .point.selected').focus()")
        viewer.driver.switch_to.active_element.send_keys(Keys.DELETE)
        viewer.final("o.transfer[0].Points.length === 12")
        # Undo goes back to the preset, redo forth.
        for _ in range(6):
            viewer.keys(Keys.CONTROL, "z")
        viewer.final("o.transfer === 'opaque'")
        self.assertSamePixels(viewer.pixels(), before)
        viewer.keys(Keys.CONTROL, "y")
        viewer.final("Array.isArray(o.transfer)")

        # What is copied is what --transfer takes.
        viewer.find("[aria-label='Copy for --transfer']").click()
        copied = json.loads(viewer.until("window.copied[0]"))
        (self.programs.folder / "copied.json").write_text(json.dumps(copied))
        now = viewer.final("Array.isArray(o.transfer)")
        now["options"]["transfer"] = "copied.json"
        self.assertSamePixels(viewer.pixels(), self.command_line(now))

    def test_a_colour_map_may_be_dropped(self):
        viewer = self.viewer()
        viewer.settled()
        drop = "(() => { const d = new DataTransfer(); d.items.add(new File([arguments[0]], 'map.json')); document.querySelector('canvas').dispatchEvent(new DragEvent('drop', {bubbles: true, cancelable: true, dataTransfer: d})); return true; })()"
        viewer.js(drop, json.dumps([{"Name": "mine", "RGBPoints": [0, 0, 0, 1, 200, 1, 1, 0]}]))
        self.assertFinal(viewer, "Array.isArray(o.transfer) && o.transfer[0].Name === 'mine'")
        for text, why in (("{", "map.json"), ('{"a": 1}', "no RGBPoints"), ('[{"RGBPoints": [2,0,0,0,1,1,1,1]}]', "ascend"), ('[{"RGBPoints": [2,0,0]}]', "groups of four")):
            viewer.js(drop, text)
            viewer.until("document.querySelector('.message.error')?.textContent.includes(arguments[0])", why)

    def test_without_newer_addresses_of_the_gateway_editing_begins_with_a_ramp(self):
        missing = {"/api/v1/" + name: lambda fields, body: 404 for name in ("transfer", "histogram", "pick", "value")}
        viewer = self.viewer(self.proxy(answers=missing).port)
        viewer.settled()
        viewer.until("!document.querySelector('.editor .hint').hidden")
        viewer.js("document.querySelectorAll('.editor .plot .point.opacity')[1].focus()")
        viewer.driver.switch_to.active_element.send_keys(Keys.ARROW_DOWN)
        viewer.final("Array.isArray(o.transfer)")

    def test_clip_box_handles_fields_and_planes(self):
        viewer = self.viewer()
        viewer.settled()
        viewer.until("document.querySelector('.facts dd') !== null")
        viewer.keys("b")
        viewer.final("o['clip-box'] === ':,:,:'")
        whole = viewer.pixels()
        viewer.js("document.querySelector('.handle[aria-label=\"Clip x to\"]').focus()")
        viewer.driver.switch_to.active_element.send_keys(Keys.ARROW_LEFT * 6)
        drawn = viewer.final("/^:1[0-9.]*,:,:$/.test(o['clip-box'])")
        self.assertEqual(drawn["options"]["clip-box"], ":11,:,:")  # the side is at 23, a voxel has 2
        self.assertNotEqual(viewer.pixels(), whole)
        x, y = viewer.js("(b => [b.left + b.width / 2, b.top + b.height / 2])(document.querySelector('.handle[aria-label=\"Clip z to\"]').getBoundingClientRect())")
        for kind, dy in (("mousePressed", 0), ("mouseMoved", 40), ("mouseMoved", 80), ("mouseReleased", 80)):
            viewer.command("Input.dispatchMouseEvent", type=kind, x=x, y=y + dy, button="left", buttons=1, clickCount=1)
        drawn = viewer.final("/^:11,:,:-?[0-9.]+$/.test(o['clip-box'])")
        at = viewer.js("(b => [b.left + b.width / 2, b.top + b.height / 2])(document.querySelector('.handle[aria-label=\"Clip z to\"]').getBoundingClientRect())")
        self.assertAlmostEqual(at[1], y + 80, delta=3, msg="the handle stays below the pointer")
        viewer.open_section("Clipping")
        field = viewer.find("input[aria-label='y from']")
        field.clear()
        field.send_keys("-4", Keys.ENTER)
        viewer.final("/^:11,-4:,/.test(o['clip-box'])")
        viewer.driver.find_element(By.XPATH, "//button[contains(., 'Cut here')]").click()
        self.assertFinal(viewer, "o['clip-plane'] !== undefined")
        viewer.save(SHOTS, "clip")

    def test_opacity_by_the_gradient(self):
        viewer = self.viewer()
        viewer.settled()
        viewer.until("document.querySelector('.facts dd') !== null")
        viewer.find(".by-gradient input[role=switch]").click()
        # The values span 220 over voxels of 2: a steep gradient is a quarter of that, and the curve reaches 1 at 0.4 of it.
        drawn = viewer.final("o['gradient-opacity'] !== undefined && o.renderer === 'auto' && h.statistics.plan.renderer === 'raycast'")
        first, steep = drawn["options"]["gradient-opacity"].split(",")
        self.assertEqual((first.split(":")[1], steep.split(":")[1]), ("0", "1"))
        self.assertAlmostEqual(float(steep.split(":")[0]), 0.4 * 0.25 * 220 / 2, delta=0.3)
        self.assertSamePixels(viewer.pixels(), self.command_line(drawn))
        viewer.js("document.querySelector('.by-gradient circle[data-index=\"1\"]').focus()")
        viewer.driver.switch_to.active_element.send_keys(Keys.ARROW_DOWN * 20, Keys.INSERT)
        viewer.final("/^[0-9.]+:0,[0-9.]+:0.8,[0-9.]+:0.8$/.test(o['gradient-opacity'])")
        box = viewer.js("(b => [b.left, b.top, b.width, b.height])(document.querySelector('.by-gradient .plot').getBoundingClientRect())")
        x, y = box[0] + box[2] * 0.9, box[1] + 20
        for kind, dy in (("mousePressed", 0), ("mouseMoved", 10), ("mouseMoved", 30), ("mouseReleased", 30)):
            viewer.command("Input.dispatchMouseEvent", type=kind, x=x, y=y + dy, button="left", buttons=1, clickCount=1)
        drawn = viewer.final("o['gradient-opacity'].split(',').length === 4")
        opacity = float(drawn["options"]["gradient-opacity"].split(",")[-1].split(":")[1])
        self.assertTrue(0.3 < opacity < 0.7, opacity)
        viewer.save(SHOTS, "gradient")
        viewer.until("location.hash.includes('gradient-opacity=')")
        other = self.at_the_same_address(viewer)
        self.assertEqual(other.final("o['gradient-opacity'] !== undefined")["options"], drawn["options"])
        viewer.focus()
        viewer.keys("k")
        self.assertIn(" --gradient-opacity ", viewer.until("document.querySelector('dialog pre')?.textContent"))
        viewer.find("dialog [aria-label=Close]").click()
        viewer.find(".by-gradient input[role=switch]").click()
        viewer.final("o['gradient-opacity'] === undefined")
        viewer.keys(Keys.CONTROL, "z")
        viewer.final(f"o['gradient-opacity'] === '{drawn['options']['gradient-opacity']}'")

    def test_regions_of_values_and_gradients(self):
        viewer = self.viewer(renderer="mip")
        viewer.settled()
        viewer.until("document.querySelector('.facts dd') !== null")
        switch, regions = ".by-region input[role=switch]", "o.transfer[0]?.Regions"
        viewer.find(switch).click()
        drawn = viewer.final(f"{regions}?.length === 2 && o.renderer === 'raycast'")
        self.assertEqual(drawn["options"]["transfer"][0]["Regions"][1]["Corners"][2], 220, "the largest value")
        self.assertNotIn("RGBPoints", drawn["options"]["transfer"][0])
        before = viewer.pixels()
        self.assertSamePixels(before, self.command_line(drawn))
        self.assertTrue(viewer.js("document.querySelector('.editor .plot').parentElement.hidden"), "regions stand in the place of the curve")

        # A corner moves by the keyboard, a region by the pointer.
        viewer.js("(document.querySelector('.joint .region[data-index=\"1\"]').focus(), document.querySelector('.joint .point[data-index=\"0\"]').focus(), true)")
        viewer.driver.switch_to.active_element.send_keys(Keys.ARROW_RIGHT * 8, Keys.ARROW_UP * 4)
        was = drawn["options"]["transfer"][0]["Regions"][1]["Corners"]
        viewer.until("(c => c && c[0] > arguments[0] && c[1] > arguments[1])(window.drawn[window.drawn.length - 1].options.transfer[0].Regions[1].Corners)", *was[:2])
        drawn = viewer.final(f"Math.abs({regions}[1].Corners[0] - {was[0]} - 8 * 220 / 256) < 0.1 && {regions}[1].Corners[1] > {was[1]}")
        self.assertEqual(drawn["options"]["transfer"][0]["Regions"][1]["Corners"][2:], was[2:])
        self.assertSamePixels(viewer.pixels(), self.command_line(drawn))
        box = viewer.js("(document.querySelector('.joint').scrollIntoView({block: 'center'}), (b => [b.left, b.top, b.width, b.height])(document.querySelector('.joint .region[data-index=\"0\"]').getBoundingClientRect()))")
        x, y = box[0] + box[2] / 2, box[1] + box[3] / 2
        for kind, share in (("mousePressed", 0), ("mouseMoved", 0.5), ("mouseMoved", 1), ("mouseReleased", 1)):
            viewer.command("Input.dispatchMouseEvent", type=kind, x=x - 20 * share, y=y - 8 * share, button="left", buttons=1, clickCount=1)
        was = drawn["options"]["transfer"][0]["Regions"][0]["Corners"]
        drawn = viewer.final(f"{regions}[0].Corners[0] < {was[0]} - 10 && {regions}[0].Corners[1] > {was[1]}")
        moved = drawn["options"]["transfer"][0]["Regions"][0]["Corners"]
        rises = [math.sqrt(now) - math.sqrt(before) for before, now in zip(was[1::2], moved[1::2])]  # the plot's axis shows roots
        for i in range(4):
            self.assertAlmostEqual(moved[2 * i] - was[2 * i], moved[0] - was[0], places=3)
            self.assertAlmostEqual(rises[i], rises[0], places=2)
        self.assertSamePixels(viewer.pixels(), self.command_line(drawn))
        viewer.find("[aria-label='Softness of the region']").send_keys(Keys.CONTROL, "a", Keys.NULL, "0.75", Keys.ENTER)
        soft = viewer.final(f"{regions}[0].Softness === 0.75")
        self.assertEqual(soft["options"]["transfer"][0]["Regions"], [{**drawn["options"]["transfer"][0]["Regions"][0], "Softness": 0.75}, drawn["options"]["transfer"][0]["Regions"][1]])
        self.assertSamePixels(viewer.pixels(), self.command_line(soft))
        # A double click on an edge inserts a corner, Delete removes it.
        edge = viewer.js("(b => [b.left + b.width / 3, b.bottom - 1])(document.querySelector('.joint .region[data-index=\"0\"]').getBoundingClientRect())")
        for clicks in (1, 2):
            for kind in ("mousePressed", "mouseReleased"):
                viewer.command("Input.dispatchMouseEvent", type=kind, x=edge[0], y=edge[1], button="left", buttons=1, clickCount=clicks)
        viewer.final(f"{regions}[0].Corners.length === 10")
        viewer.js("document.querySelector('.joint .point.selected').focus()")
        viewer.driver.switch_to.active_element.send_keys(Keys.DELETE)
        viewer.final(f"{regions}[0].Corners.length === 8")
        viewer.driver.find_element(By.XPATH, "//button[. = 'Add a region']").click()
        drawn = viewer.final(f"{regions}.length === 3")
        viewer.js("(e => { e.value = '#00ff00'; e.dispatchEvent(new Event('input')); return true; })(document.querySelector('[aria-label=\"Colour of the region\"]'))")
        drawn = self.assertFinal(viewer, f"{regions}[2].Color.join() === '0,1,0'")
        self.assertEqual(viewer.js("new Set([...document.querySelectorAll('.joint ~ .button-row button')].map(b => b.offsetTop)).size"), 1, "the buttons stand in one row")
        viewer.save(SHOTS, "regions")
        for theme in ("dark", "light"):
            viewer.theme(theme)
            self.assertEqual(viewer.driver.execute_script((HERE / "accessibility.js").read_text()), [])

        # The link holds them, and so does the file.
        viewer.until("location.hash.includes('function=')")
        viewer.find("[aria-label='Copy for --transfer']").click()
        copied = viewer.until("window.copied[0]")
        viewer.js("new Promise(done => setTimeout(done, 300))")
        other = self.at_the_same_address(viewer)
        self.assertEqual(other.final(f"{regions}?.length === 3")["options"], drawn["options"])
        viewer.focus()
        self.assertEqual(json.loads(copied)[0]["Regions"], drawn["options"]["transfer"][0]["Regions"])
        viewer.command("Page.setDownloadBehavior", behavior="allow", downloadPath=str(self.programs.folder))
        viewer.find("[aria-label='Save as a file']").click()
        saved = self.programs.folder / "transfer.json"
        wait_until(saved.exists, "saved")
        self.assertEqual(json.loads(saved.read_text()), drawn["options"]["transfer"])
        self.assertEqual(viewer.drawn()["options"], drawn["options"], "saving changes nothing")
        drop = "(() => { const d = new DataTransfer(); d.items.add(new File([arguments[0]], 'map.json')); document.querySelector('canvas').dispatchEvent(new DragEvent('drop', {bubbles: true, cancelable: true, dataTransfer: d})); return true; })()"
        viewer.js(drop, '{"Name": "box", "Regions": [{"Values": [70, 200], "Slopes": [0, 90], "Color": [1, 0, 0]}]}')
        viewer.final(f"{regions}?.length === 1 && o.transfer[0].Name === 'box' && {regions}[0].Corners.join() === '70,0,200,0,200,90,70,90'")
        viewer.js(drop, '{"Regions": [{"Values": [70, 70], "Slopes": [0, 90], "Color": [1, 0, 0]}]}')
        viewer.until("document.querySelector('.message.error')?.textContent.includes('Regions[0]')")

        # Others than ray casting show the automatic function. Switching off goes back to the preset.
        renderer = "[...document.querySelectorAll('select')].find(s => [...s.options].some(o => o.value === 'mip'))"
        choose = "(s => { s.value = arguments[0]; s.dispatchEvent(new Event('change')); return true; })"
        viewer.js(f"{choose}({renderer})", "mip")
        viewer.final("o.renderer === 'mip' && o.transfer === 'auto'")
        self.assertIn("Only ray casting", viewer.js("document.querySelector('.by-region .hint').textContent"))
        viewer.keys(Keys.CONTROL, "z")
        viewer.final(f"o.renderer === 'raycast' && {regions}?.length === 1")
        viewer.keys(Keys.CONTROL, "z")
        viewer.final(f"{regions}?.length === 3")
        viewer.find(switch).click()
        viewer.final("o.transfer === 'auto'")
        self.assertFalse(viewer.js("document.querySelector('.editor .plot').parentElement.hidden"))
        preset = "[...document.querySelectorAll('select')].find(s => [...s.options].some(o => o.value === 'ct-bone-2d'))"
        viewer.js(f"{choose}({renderer})", "mip")
        viewer.js(f"{choose}({preset})", "ct-bone-2d")
        self.assertFinal(viewer, "o.transfer === 'ct-bone-2d' && o.renderer === 'raycast'")
        viewer.until("document.querySelectorAll('.joint .region').length === 2 && !document.querySelector('.joint').parentElement.hidden")
        viewer.until("location.hash.includes('transfer=ct-bone-2d')")
        viewer.find(switch).click()
        viewer.final("o.transfer === 'auto'")

    def test_labels_surfaces_lights_and_renderers(self):
        viewer = self.viewer()
        viewer.settled()
        viewer.until("document.querySelector('.facts dd') !== null")
        viewer.open_section("Labels")
        viewer.driver.find_element(By.XPATH, "//input[@value = 'tint']").click()
        viewer.final("o.renderer === 'auto' && o['label-mode'] === 'tint' && h.statistics.plan.renderer === 'raycast'")
        tinted = viewer.pixels()
        self.assertEqual(viewer.js("[...document.querySelectorAll('[data-label]')].map(row => row.dataset.label + ' ' + row.querySelector('.label-name').textContent)"), ["1 left", "2 middle", "3 right"])
        viewer.find("[data-label='2'] input[type=checkbox]").click()
        drawn = viewer.final("o['labels-shown'] === '1,3'")
        self.assertNotEqual(viewer.pixels(), tinted)
        self.assertSamePixels(viewer.pixels(), self.command_line(drawn))
        viewer.find("[data-label='3'] .only").click()
        viewer.final("o['labels-shown'] === '3'")
        viewer.save(SHOTS, "labels")
        # Of highlights, those that do not show leave the volume as it is; names do as well as numbers.
        viewer.driver.find_element(By.XPATH, "//input[@value = 'highlight']").click()
        self.assertFinal(viewer, "o['label-mode'] === 'highlight' && o['label-tint'] === 0.5")
        field = viewer.driver.find_element(By.XPATH, "//div[label[. = 'Shown']]/input")
        field.clear()
        field.send_keys("m*,3", Keys.ENTER)
        self.assertFinal(viewer, "o['labels-shown'] === 'm*,3'")
        viewer.find("[data-label='2'] input[type=checkbox]").click()
        self.assertFinal(viewer, "o['labels-shown'] === '3'")
        viewer.save(SHOTS, "labels-highlight")
        viewer.open_section("Isosurfaces")
        viewer.driver.find_element(By.XPATH, "//button[contains(., 'Add a surface')]").click()
        self.assertFinal(viewer, "o.isovalue !== undefined && o.transfer === undefined")
        viewer.open_section("Light")
        viewer.driver.find_element(By.XPATH, "//div[@class='button-row']/button[. = 'Left']").click()
        viewer.final("o.light && o.light.length === 1")
        for renderer in ("mip", "zbuffer", "splat", "shear"):
            viewer.js("(s => { s.value = arguments[0]; s.dispatchEvent(new Event('change')); return true; })([...document.querySelectorAll('select')].find(s => [...s.options].some(o => o.value === 'mip')))", renderer)
            self.assertFinal(viewer, f"o.renderer === '{renderer}'")

    def test_the_cells_of_a_grid_are_offered_where_there_are_any(self):
        renderers = "[...[...document.querySelectorAll('select')].find(s => [...s.options].some(o => o.value === 'shear')).options].map(o => o.value)"
        volume = self.viewer()
        volume.settled()
        volume.until("document.querySelector('.facts dd') !== null")
        self.assertNotIn("slice", volume.js(renderers))
        light = "[...document.querySelectorAll('details')].find(d => d.querySelector('h2').textContent === 'Light')"
        self.assertFalse(volume.js(f"{light}.querySelector('.button-row').hidden"))
        viewer = self.viewer(dataset="grid", sampling_rate=2)
        drawn = viewer.final("o['sampling-rate'] === undefined && h.statistics.plan.renderer === 'slice'")
        self.assertEqual(drawn["options"]["renderer"], "auto", "which draws the cells")
        self.assertSamePixels(viewer.pixels(), self.command_line(drawn))
        viewer.until(f"{renderers}.includes('slice')")
        self.assertEqual(viewer.js(renderers)[0], "auto")
        self.assertFalse(viewer.js(f"{light}.querySelector('.button-row').hidden"), "cells are lit, too")
        viewer.js("(s => { s.value = 'slice'; s.dispatchEvent(new Event('change')); return true; })([...document.querySelectorAll('select')].find(s => [...s.options].some(o => o.value === 'slice')))")
        self.assertFinal(viewer, "o.renderer === 'slice' && o['sampling-rate'] === '2'")
        viewer.save(SHOTS, "grid")

    def test_each_renderer_shows_what_it_has(self):
        viewer = self.viewer(renderer="xray")
        viewer.settled()
        section = "[...document.querySelectorAll('details')].find(d => d.querySelector('h2').textContent === 'Transfer function')"
        self.assertTrue(viewer.js(f"{section}.hidden"), "a radiograph has no transfer function")
        control = lambda name: viewer.driver.find_element(By.XPATH, f"//div[label[. = '{name}']]/*[self::select or self::input]")
        control("Polarity").find_element(By.XPATH, "option[. = 'Dark bone']").click()
        viewer.final("o.polarity === 'dark-bone'")
        control("Energy").send_keys("90", Keys.ENTER)
        drawn = viewer.final("o.energy === '90'")
        self.assertNotIn("transfer", drawn["options"])
        self.assertSamePixels(viewer.pixels(), self.command_line(drawn))
        viewer.save(SHOTS, "radiograph")
        viewer.until("location.hash.includes('energy=90') && location.hash.includes('polarity=dark-bone')")
        other = self.at_the_same_address(viewer)
        self.assertEqual(other.final("o.energy === '90'")["options"], drawn["options"])
        viewer.focus()
        control("Renderer").find_element(By.XPATH, "option[. = 'Multi-pass shears']").click()
        control("Kernel").find_element(By.XPATH, "option[. = 'B spline']").click()
        self.assertFinal(viewer, "o.renderer === 'shear' && o.kernel === 'b-spline' && o.energy === undefined")
        self.assertFalse(viewer.js(f"{section}.hidden"))
        wrong = self.viewer(renderer="xray", energy="1e9", polarity="both")
        options = wrong.settled()["options"]
        self.assertTrue("energy" not in options and "polarity" not in options, options)

    def test_an_overlay_has_a_row_as_channels_have(self):
        viewer = self.viewer(renderer="splat")
        viewer.final("o['channel-opacity'] === undefined")
        viewer.until("document.querySelectorAll('.channel').length === 1")
        before = viewer.pixels()
        viewer.find("[aria-label='Show Overlay']").click()
        drawn = viewer.final("o.renderer === 'raycast' && o['channel-opacity'] === 'overlay=1' && o.transfer === 'auto'")
        self.assertNotEqual(viewer.pixels(), before)
        self.assertSamePixels(viewer.pixels(), self.command_line(drawn))
        viewer.until("document.querySelectorAll('.channel .of-channel[d^=M]').length === 1")
        choice = viewer.driver.find_element(By.XPATH, "//div[label[. = 'Colours of Overlay']]/select")
        self.assertIn("Automatic", viewer.js("[...arguments[0].options].map(o => o.text)", choice))
        self.assertFalse(viewer.js("[...document.querySelectorAll('option, button, label')].some(e => e.textContent === 'auto')"), "one word an idea")
        choice.find_element(By.XPATH, "option[. = 'Its colour']").click()
        viewer.js("(e => { e.value = '#00ff00'; e.dispatchEvent(new Event('input')); return true; })(document.querySelector('[aria-label=\"Colour of Overlay\"]'))")
        viewer.final("o['channel-color'] === 'overlay=#00ff00'")
        viewer.find("[aria-label='Opacity of Overlay']").clear()
        viewer.find("[aria-label='Opacity of Overlay']").send_keys("0.5", Keys.ENTER)
        for name, value in (("from", "20"), ("to", "150")):
            viewer.find(f"[aria-label='Overlay, {name}']").clear()
            viewer.find(f"[aria-label='Overlay, {name}']").send_keys(value, Keys.ENTER)
        drawn = viewer.final("o['channel-range'] === 'overlay=20:150' && o['channel-opacity'] === 'overlay=0.5'")
        self.assertSamePixels(viewer.pixels(), self.command_line(drawn))
        viewer.save(SHOTS, "overlay")
        choice.find_element(By.XPATH, "option[. = 'Hot']").click()
        viewer.final("o['channel-transfer'] === 'overlay=hot' && o['channel-color'] === undefined")
        viewer.until("location.hash.includes('overlay%3Dhot') || location.hash.includes('overlay=hot')")
        other = self.at_the_same_address(viewer)
        self.assertFinal(other, "o['channel-transfer'] === 'overlay=hot' && o['channel-range'] === 'overlay=20:150' && o['channel-opacity'] === 'overlay=0.5'")
        viewer.find("[aria-label='Show Overlay']").click()
        viewer.final("!Object.keys(o).some(name => name.startsWith('channel'))")

    def test_a_link_says_with_short_forms_how_the_overlay_looks(self):
        viewer = self.viewer(overlay=1, overlay_transfer="hot", overlay_range="20:150", overlay_weight="0.5", renderer="raycast", layout="quad")
        asked = "o['channel-transfer'] === 'overlay=hot' && o['channel-range'] === 'overlay=20:150' && o['channel-opacity'] === 'overlay=0.5'"
        drawn = viewer.final(f"{asked} && o.transfer === 'auto'")
        self.assertSamePixels(viewer.pixels(), self.command_line(drawn))
        of_slice = viewer.final(asked, "axial")
        self.assertSamePixels(viewer.pixels("axial"), self.command_line(of_slice, "slice"))

    def test_lengths_have_the_unit_of_the_file(self):
        viewer = self.viewer(dataset="cells", layout="quad", measure="distance:0,0,0:3,4,0")
        viewer.settled()
        viewer.until("[...document.querySelectorAll('.facts dd')].some(d => d.textContent === '0.5 × 0.5 × 2 µm')")
        viewer.until("[...document.querySelectorAll('.scale-bar text')].some(t => /^[0-9.]+ µm$/.test(t.textContent))")
        viewer.until("document.querySelector('[data-measure=distance] .measure-text')?.textContent === '5.0 µm'")
        viewer.save(SHOTS, "units")

    def test_slices_are_grey_where_a_label_does_not_show(self):
        viewer = self.viewer(layout="quad", label_mode="tint", renderer="raycast")
        viewer.settled()
        viewer.open_section("Labels")
        viewer.find("[data-label='2'] input[type=checkbox]").click()
        drawn = viewer.final("o['labels-shown'] === '1,3'", "axial")
        self.assertSamePixels(viewer.pixels("axial"), self.command_line(drawn, "slice"))

    def test_labels_have_a_legend(self):
        viewer = self.viewer(label_mode="tint", renderer="raycast")
        viewer.settled()
        legend = "[...document.querySelectorAll('[data-pane=\"3d\"] .label-legend text')].map(t => t.textContent).join()"
        viewer.until(f"{legend} === 'left,middle,right'")
        colors = viewer.js("[...document.querySelectorAll('.label-legend rect')].map(r => r.getAttribute('fill'))")
        self.assertEqual(colors, viewer.js("[...document.querySelectorAll('.label-row .swatch')].map(s => '#' + s.style.background.match(/\\d+/g).map(n => (+n).toString(16).padStart(2, '0')).join(''))"))
        viewer.open_section("Labels")
        viewer.find("[data-label='2'] input[type=checkbox]").click()
        viewer.until(f"{legend} === 'left,right'")
        viewer.save(SHOTS, "legend")
        viewer.driver.find_element(By.XPATH, "//div[label[. = 'Legend']]/input").click()
        viewer.until(f"{legend} === '' && location.hash.includes('legend=0')")

    def test_axes_are_drawn_round_the_volume(self):
        viewer = self.viewer()
        viewer.settled()
        choose = lambda name: viewer.driver.find_element(By.XPATH, f"//div[label[. = 'Axes']]/select/option[. = '{name}']").click()
        choose("Grid")
        drawn = self.assertFinal(viewer, "o.axes === 'grid'")
        self.assertEqual(drawn["options"]["font-size"], 13, "letters of the page's size")
        viewer.until("location.hash.includes('axes=grid')")
        viewer.save(SHOTS, "axes")
        self.assertEqual(self.at_the_same_address(viewer).final("o.axes === 'grid'")["options"], drawn["options"])
        viewer.focus()
        choose("Off")
        viewer.final("o.axes === undefined && o['font-size'] === undefined")

    # ---- the first view

    def test_a_patient_is_seen_from_the_front_and_others_from_aside(self):
        viewer = self.viewer()
        options = viewer.settled()["options"]
        self.assertEqual((options["azimuth"], options["elevation"], options["roll"]), (180, 0, 0))
        viewer.until("[...document.querySelectorAll('[data-pane=\"3d\"] .sides text')].map(t => t.textContent).join('') === 'RLSI'")
        viewer.drag(50, 0)
        viewer.final("o.azimuth === 160")
        viewer.find(".dataset select").find_element(By.XPATH, "option[. = 'sphere']").click()
        viewer.final("o.dataset === 'sphere' && o.azimuth === 30 && o.elevation === 20 && o['look-at']")
        viewer.drag(50, 0)
        viewer.final("o.azimuth === 10")
        viewer.keys("r")
        viewer.final("o.azimuth === 30")
        linked = self.viewer(dataset="sphere", azimuth=180, elevation=0)
        linked.settled()
        linked.until("document.querySelector('.facts dd') !== null")
        self.assertEqual(linked.settled()["options"]["azimuth"], 180, "a link says where one stands")

    def test_reading_tells_how_far_it_is(self):
        viewer = self.viewer(dataset="sphere")
        viewer.settled()
        viewer.js("""(window.said = [], new MutationObserver(() => window.said.push(document.querySelector('.status').textContent, document.querySelector('.progress-text').textContent))
            .observe(document.body, {subtree: true, childList: true, characterData: true}), true)""")
        viewer.find(".dataset select").find_element(By.XPATH, "option[. = 'big']").click()
        viewer.final("o.dataset === 'big'")
        said = viewer.js("window.said.filter(text => /^Reading, [0-9]+ %$/.test(text)).map(text => +text.match(/[0-9]+/)[0])")
        self.assertTrue(said and said == sorted(said) and 1 <= said[0] and said[-1] <= 100, said)

    # ---- behind a proxy

    def test_everything_works_below_a_path(self):
        proxy = self.proxy(prefix="/user/me/proxy/8080")
        viewer = Viewer(self.driver, self.url(proxy.port).replace("/#", "/user/me/proxy/8080/#"))
        self.addCleanup(viewer.close)
        viewer.settled()
        viewer.drag(40, 10)
        self.assertFinal(viewer, "o.azimuth !== 180")
        viewer.until("document.querySelector('.facts dd') !== null")
        viewer.until("document.querySelector('.editor .histogram').getAttribute('d') !== ''")
        viewer.open_section("Labels")
        viewer.driver.find_element(By.XPATH, "//input[@value = 'tint']").click()
        viewer.until("document.querySelectorAll('[data-label]').length === 3")
        viewer.keys("c")
        link = viewer.until("window.copied[0]")
        self.assertTrue(link.startswith(f"http://127.0.0.1:{proxy.port}/user/me/proxy/8080/#"), link)
        viewer.js("(window.saved = [], URL.createObjectURL = blob => { window.saved.push(blob); return '#'; }, true)")
        viewer.keys("s")
        viewer.find("dialog .primary").click()
        viewer.until("window.saved.length === 1 && window.saved[0].type === 'image/png'")
        viewer.find("dialog [aria-label=Close]").click()
        viewer.keys("k")
        self.assertIn("slabstream render patient", viewer.until("document.querySelector('dialog pre')?.textContent"))
        viewer.find("dialog [aria-label=Close]").click()
        viewer.driver.refresh()
        viewer.settled()  # the token is kept for this tab, at this path
        viewer.until("document.querySelector('.facts dd') !== null && document.querySelectorAll('[data-label]').length === 3")
        viewer.until("document.querySelector('.editor .histogram').getAttribute('d') !== ''")
        viewer.until("performance.getEntriesByType('resource').some(entry => entry.name.includes('api/v1/transfer'))")
        proxy.cut()
        viewer.until("document.querySelector('.banner:not([hidden])') === null && document.querySelector('[data-pane=\"3d\"] canvas') !== null")
        viewer.drag(40, 10)
        viewer.final("o.azimuth < 160")
        self.assertEqual([target for target in proxy.strays if target != "/favicon.ico"], [])

    # ---- movies

    @unittest.skipUnless(shutil.which("ffmpeg"), "ffmpeg is not installed")
    def test_a_movie_is_made_and_can_be_cancelled(self):
        viewer = self.viewer()
        viewer.settled()
        viewer.js("(window.saved = [], URL.createObjectURL = blob => { window.saved.push(blob); return '#'; }, true)")
        viewer.keys("v")
        frames = viewer.find("dialog input[aria-label=Frames]")
        frames.clear()
        frames.send_keys("1000")
        viewer.find("dialog .primary").click()
        viewer.until("/^Frame [0-9]+ of 1000/.test(document.querySelector('dialog [role=status]').textContent)")
        self.assertGreater(viewer.js("document.querySelector('dialog progress').value"), 0)
        viewer.save(SHOTS, "movie")
        viewer.driver.find_element(By.XPATH, "//dialog//button[. = 'Cancel']").click()
        viewer.until("document.querySelector('dialog [role=status]').textContent === 'Cancelled.'")
        self.assertEqual(viewer.js("window.saved.length"), 0)
        frames.clear()
        frames.send_keys("12")
        viewer.find("dialog .primary").click()
        viewer.until("/^Saved: 12 frames, 0.5 s/.test(document.querySelector('dialog [role=status]').textContent)")
        kind, size = viewer.js("(b => [b.type, b.size])(window.saved[0])")
        self.assertEqual(kind, "video/mp4")
        self.assertGreater(size, 1000)

    def test_without_ffmpeg_the_command_is_offered(self):
        viewer = self.viewer(self.proxy(answers={"/api/v1/turntable.mp4": lambda fields, body: 501}).port)
        viewer.settled()
        viewer.keys("v")
        viewer.find("dialog .primary").click()
        line = viewer.until("document.querySelector('dialog pre')?.textContent")
        self.assertRegex(line, r"^slabstream turntable patient .* --frames 120 --fps 25 -o turntable.mp4$")
        viewer.save(SHOTS, "movie-elsewhere")

    def test_a_movie_has_a_title_and_bars_and_begins_at_the_front(self):
        asked = []
        viewer = self.viewer(self.proxy(answers={"/api/v1/turntable.mp4": lambda fields, body: asked.append(body) or 501}).port, azimuth=100, elevation=30)
        viewer.settled()
        viewer.keys("v")
        viewer.find("dialog #title").send_keys("Case 7")
        make = lambda: (viewer.find("dialog .primary").click(), viewer.until("document.querySelector('dialog pre') !== null && !document.querySelector('dialog .primary').disabled"))
        make()
        first = asked[-1]
        self.assertEqual((first["title"], first["scale-bar"], first["orientation-marker"]), ("Case 7", True, True))
        self.assertEqual((first["azimuth"], first["elevation"], first["fit"]), (180, 0, True))
        self.assertIn("--title 'Case 7'", viewer.js("document.querySelector('dialog pre').textContent"))
        viewer.driver.find_element(By.XPATH, "//dialog//input[@value = 'view']").click()
        viewer.driver.find_element(By.XPATH, "//dialog//div[label[. = 'Scale bar']]/input").click()
        make()
        self.assertEqual((asked[-1]["azimuth"], asked[-1]["elevation"]), (100, 30))
        self.assertNotIn("scale-bar", asked[-1])

    # ---- files

    def saved(self, viewer, number):
        """The picture that the page saved as its number-th file: width, height, RGBA."""
        viewer.until(f"window.saved.length === {number}")
        data = viewer.driver.execute_async_script("const done = arguments[0], reader = new FileReader(); reader.onload = () => done(reader.result); reader.readAsDataURL(window.saved[window.saved.length - 1]);")
        return png_pixels(base64.b64decode(data.split(",")[1]))

    def test_one_pane_or_all_are_saved_at_any_size(self):
        viewer = self.viewer(layout="quad", measure="distance:-10,0,-2:8,0,-2")
        viewer.settled()
        slices = [viewer.settled(pane) for pane in ("axial", "coronal", "sagittal")]
        viewer.js("(window.saved = [], URL.createObjectURL = blob => { window.saved.push(blob); return '#'; }, true)")
        viewer.keys("s")
        what, marks = viewer.find("dialog select"), viewer.driver.find_element(By.XPATH, "//dialog//div[label[contains(., 'Scale bar')]]/input")
        def save(name, width, height):
            what.find_element(By.XPATH, f"option[. = '{name}']").click()
            for label, side in (("Width", width), ("Height", height)):
                field = viewer.find(f"dialog [aria-label='{label} in pixels']")
                field.clear()
                field.send_keys(str(side))
            viewer.find("dialog .primary").click()
        save("Coronal slice", 300, 200)
        marked = self.saved(viewer, 1)
        marks.click()
        save("Coronal slice", 300, 200)
        plain = self.saved(viewer, 2)
        expected = {**slices[1], "options": {**slices[1]["options"], "size": "300x200"}}
        self.assertSamePixels(plain, self.command_line(expected, "slice"))
        different = [i for i in range(0, len(plain[2]), 4) if plain[2][i:i + 3] != marked[2][i:i + 3]]
        self.assertTrue(100 < len(different) < len(plain[2]) / 4 / 5, f"the marks cover {len(different)} pixels")
        save("All panes", 401, 300)
        every = self.saved(viewer, 3)
        self.assertEqual(every[:2], (401, 300))
        part = {**slices[0], "options": {**slices[0]["options"], "size": "201x150"}}
        expected = self.command_line(part, "slice")
        cut = b"".join(every[2][4 * (401 * y + 200):4 * (401 * y + 401)] for y in range(150))
        self.assertSamePixels((201, 150, cut), expected)
        marks.click()
        save("All panes", 1000, 800)
        self.saved(viewer, 4)
        (SHOTS / "saved-panes.png").write_bytes(base64.b64decode(viewer.driver.execute_async_script("const done = arguments[0], reader = new FileReader(); reader.onload = () => done(reader.result.split(',')[1]); reader.readAsDataURL(window.saved[3]);")))
        self.assertEqual(viewer.js("window.violations"), [])

    # ---- measuring

    def test_distances_and_angles_are_measured_in_slices_and_on_surfaces(self):
        viewer = self.viewer(layout="quad", transfer="opaque")
        viewer.settled()
        viewer.settled("axial")
        viewer.keys("d")
        viewer.until("document.querySelector('.measures') !== null && [...document.querySelectorAll('details')].find(d => d.querySelector('h2').textContent === 'Measure').open")
        click = lambda pane, *at: viewer.drag(0, 0, start=at, pane=pane, steps=1)
        click("axial", -40, 10)
        click("axial", 20, -20)
        text = viewer.until("document.querySelector('[data-measure=distance] .measure-text')?.textContent")
        axial = viewer.drawn("axial")["header"]["geometry"]
        self.assertAlmostEqual(float(text.split()[0]), axial["pixel_size"] * math.hypot(60, 30), delta=0.06)
        self.assertTrue(text.endswith(" mm"), text)
        self.assertEqual(viewer.js("document.querySelector('[data-pane=axial] .measure text').textContent"), text)
        viewer.until("document.querySelector('[data-pane=coronal] .measure.beside') !== null")
        viewer.keys("g")
        for at in ((-30, 0), (0, 0), (0, -30)):
            click("coronal", *at)
        self.assertEqual(viewer.until("document.querySelector('[data-measure=angle] .measure-text')?.textContent"), "90.0°")
        viewer.keys("d")
        viewer.keys(Keys.ENTER, Keys.ARROW_RIGHT, Keys.ARROW_RIGHT, Keys.ENTER, pane="axial")
        viewer.until("[...document.querySelectorAll('[data-measure=distance] .measure-text')].pop().textContent === '4.0 mm'")
        viewer.find("[aria-label='Remove measurement 3']").click()
        viewer.keys(Keys.ESCAPE)
        click("axial", 5, 5)
        viewer.until("location.hash.includes('at=')")  # a click moves the cross-hair again
        viewer.keys("l")
        viewer.until("document.querySelectorAll('.pane').length === 1")
        geometry = viewer.final("h.size[0] > 500")["header"]["geometry"]
        viewer.keys("d")
        # The ball's front is a surface: both points lie on it, so their distance is longer than that in the picture.
        for at in ((-60, 0), (60, 0)):
            click("3d", *at)
            viewer.until("/last|first/.test(document.querySelector('.hint[role=status]').textContent)" if at[0] < 0 else "document.querySelectorAll('[data-measure=distance]').length === 2")
            if at[0] < 0:
                viewer.until("document.querySelector('.hint[role=status]').textContent.includes('last')")
        far = float(viewer.js("[...document.querySelectorAll('[data-measure=distance] .measure-text')][1].textContent").split()[0])
        self.assertAlmostEqual(far, geometry["pixel_size"] * 120, delta=0.5 * SPACING)
        viewer.save(SHOTS, "measure")
        viewer.until("(location.hash.match(/distance:/g) ?? []).length === 2")
        other = self.at_the_same_address(viewer)
        other.settled()
        other.until("document.querySelectorAll('[data-measure]').length === 3 && document.querySelectorAll('[data-pane=\"3d\"] .measure').length === 3")
        self.assertEqual(float(other.js("document.querySelectorAll('[data-measure=distance] .measure-text')[1].textContent").split()[0]), far)
        other.js("document.querySelector('.measures button').click()")
        other.until("document.querySelectorAll('[data-measure]').length === 2")
        other.keys(Keys.CONTROL, "z")
        other.until("document.querySelectorAll('[data-measure]').length === 3")

    def test_profiles_and_boxes_say_what_the_volume_holds(self):
        # Along x values rise by 8 a voxel of 2 mm, from 60 at -20 mm; half way between voxels lies the mean.
        viewer = self.viewer(measure="profile:-10,4,2:10,4,2;box:-10.5,-3,-3:5,5,3;box:-90,0,0:-80,1,1")
        viewer.settled()
        profile = viewer.until("[...document.querySelectorAll('[data-measure=profile] .measure-text')].map(e => e.textContent).find(text => text.includes('to'))")
        self.assertEqual(profile, "20.0 mm, 100 to 180")
        box = viewer.until("[...document.querySelectorAll('[data-measure=box] .measure-text')].map(e => e.textContent).find(text => text.includes('voxels,'))")
        columns = [60 + 8 * i for i in range(SIZE[0]) if -10.5 <= -20 + 2 * i <= 5]
        mean = sum(columns) / len(columns)
        deviation = math.sqrt(sum((value - mean) ** 2 for value in columns) / len(columns))
        count = len(columns) * sum(-3 <= -24 + 2 * j <= 5 for j in range(SIZE[1])) * sum(-3 <= -16 + 2 * k <= 3 for k in range(SIZE[2]))
        self.assertEqual(box, f"mean {mean:.4g} ± {deviation:.3g}, {min(columns)} to {max(columns)}, {count} voxels, 15.5 × 8.0 × 6.0 mm")
        viewer.until("document.querySelectorAll('[data-measure=box] .measure-text')[1].textContent.startsWith('no voxels')")
        viewer.open_section("Measure")
        viewer.save(SHOTS, "profile")

    # ---- the page's habits

    def test_keys_act_wherever_the_focus_is_but_in_text_fields(self):
        viewer = self.viewer()
        viewer.settled()
        viewer.until("document.querySelector('.facts dd') !== null")
        press = lambda *keys: viewer.actions().send_keys(*keys).perform()
        for number, selector in enumerate((".panel select", ".panel input[type=range]", ".panel summary", ".bar .share", ".panel input[role=switch]")):
            viewer.js("([...document.querySelectorAll(arguments[0])].find(e => e.checkVisibility()).focus(), true)", selector)
            press("l")
            viewer.until(f"document.querySelectorAll('.pane').length === {1 if number % 2 else 4}")
        azimuth, density = viewer.settled()["options"]["azimuth"], viewer.js("document.querySelector('.panel input[type=range]').value")
        viewer.js("(document.querySelector('.panel input[type=range]').focus(), true)")
        press(Keys.ARROW_RIGHT)
        viewer.until("document.querySelector('.panel input[type=range]').value !== arguments[0]", density)
        self.assertEqual(viewer.drawn()["options"]["azimuth"], azimuth, "a slider keeps its arrows")
        panes = viewer.js("document.querySelectorAll('.pane').length")
        viewer.js("([...document.querySelectorAll('.panel input[type=number]')].find(e => e.checkVisibility()).focus(), true)")
        press("l")
        press(Keys.TAB)
        self.assertEqual(viewer.js("document.querySelectorAll('.pane').length"), panes, "in fields letters are text")

    def test_shortcuts_are_those_of_every_keyboard(self):
        viewer = self.viewer()
        viewer.settled()

        def press(key, code, modifiers=0):
            for kind in ("rawKeyDown", "keyUp"):
                viewer.command("Input.dispatchKeyEvent", type=kind, key=key, code=code, modifiers=modifiers)

        viewer.drag(30, 0)
        for key, code in (("к", "KeyR"), ("ρ", "KeyR"), ("ר", "KeyR"), ("r", "KeyO")):  # Russian, Greek, Hebrew; Dvorak, where R is printed there
            viewer.drag(30, 0)
            viewer.final("o.azimuth !== 180")
            press(key, code)
            viewer.final("o.azimuth === 180")
        press("é", "Digit2")  # French: the digit is above it
        viewer.final("o.azimuth === 0")
        press("à", "Digit0")
        for key, code, modifiers in (("х", "BracketLeft", 0), ("ü", "BracketLeft", 0), ("[", "Digit8", 3)):  # Russian; German, by place and by AltGr
            before = viewer.final("true")["options"].get("scalar-range", "")
            press(key, code, modifiers)
            viewer.final(f"o['scalar-range'] !== undefined && o['scalar-range'] !== '{before}'")
        last = viewer.final("true")["options"]["scalar-range"]
        press("я", "KeyZ", 2)
        viewer.final(f"o['scalar-range'] !== '{last}'")
        viewer.js("(document.querySelector('.panel').hidden || document.querySelector(\"[aria-label='Settings']\").click(), true)")
        press("p", "Semicolon")  # Dvorak or Bépo: the letter counts
        viewer.until("!document.querySelector('.panel').hidden")

    def test_another_dataset_keeps_what_applies(self):
        viewer = self.viewer(azimuth=140, elevation=20, label_mode="tint", renderer="raycast")
        first = viewer.settled()["options"]
        viewer.drag(20, 0, keys=["shift"])
        viewer.drag(60, 0, button="right")
        before = viewer.final(f"o['scalar-range'] !== undefined && o['look-at'] !== '{first['look-at']}'")

        def show(name):
            viewer.js("(s => (s.value = arguments[0], s.dispatchEvent(new Event('change', {bubbles: true})), true))(document.querySelector('.dataset select'))", name)

        # The same place of the same world: what is seen is the same but for the voxels.
        show("other")
        other = viewer.final("o.dataset === 'other'")
        self.assertEqual({**other["options"], "dataset": 0}, {**{k: v for k, v in before["options"].items() if not k.startswith("label")}, "dataset": 0})
        viewer.keys(Keys.CONTROL, "z")
        viewer.final("o.dataset === 'other' && o['scalar-range'] === undefined")
        viewer.keys(Keys.CONTROL, "y")
        show("patient")
        self.assertEqual(viewer.final("o.dataset === 'patient' && o['label-mode']")["options"], before["options"])
        # Another world: it is framed anew, and seen from where datasets of its kind are.
        show("cells")
        cells = viewer.final("o.dataset === 'cells' && o['look-at'] !== undefined && o.azimuth !== 140")
        self.assertNotEqual(cells["options"]["look-at"], before["options"]["look-at"])
        self.assertEqual(cells["options"]["renderer"], "raycast")
        # A range that the other dataset does not have is dropped.
        far = self.viewer(scalar_range="1000:2000")
        far.final("o['scalar-range'] === '1000:2000'")
        far.js("(s => (s.value = 'other', s.dispatchEvent(new Event('change', {bubbles: true})), true))(document.querySelector('.dataset select'))")
        far.final("o.dataset === 'other' && o['scalar-range'] === undefined")

    def test_a_file_that_is_dropped_is_shown(self):
        viewer = self.viewer()
        viewer.settled()
        drop = """(() => { const d = new DataTransfer(), bytes = Uint8Array.from(atob(arguments[0]), c => c.charCodeAt(0)); d.items.add(new File([bytes], arguments[1]));
            document.querySelector('canvas').dispatchEvent(new DragEvent('drop', {bubbles: true, cancelable: true, dataTransfer: d})); return true; })()"""
        data = (self.programs.folder / "o.nrrd").read_bytes()
        viewer.js(drop, base64.b64encode(data).decode(), "my brain.nrrd")
        self.assertFinal(viewer, "o.dataset === 'my_brain' && o['look-at'] !== undefined")
        viewer.until("document.querySelector('.dataset select').value === 'my_brain' && document.querySelector('.sending').hidden")
        viewer.save(SHOTS, "dropped")
        viewer.js(drop, base64.b64encode(b"nothing").decode(), "notes.txt")
        viewer.until("document.querySelector('.banner:not([hidden])')?.textContent.includes('notes.txt')")
        self.assertNotIn("/tmp", viewer.js("document.querySelector('.banner').textContent"))
        viewer.save(SHOTS, "dropped-wrong")
        viewer.js(drop, "", "empty.nii")
        viewer.until("document.querySelector('.message.error')?.textContent.includes('empty.nii: the file is empty')")

    def test_shapes_show_beside_the_volume(self):
        viewer = self.viewer(azimuth=150, elevation=20)
        viewer.settled()
        without = viewer.pixels()
        offered = viewer.js("[...document.querySelectorAll('.dataset option')].map(o => o.value)")
        self.assertEqual({"plate", "dots", "patient"} & set(offered), {"patient"})
        viewer.open_section("Shapes")
        for name in ("plate", "dots"):
            viewer.find(f"[data-shape={name}] .icon-button").click()
        drawn = viewer.final("o.shape?.join() === 'plate,dots'")
        self.assertNotEqual(viewer.pixels(), without)
        self.assertSamePixels(viewer.pixels(), self.command_line(drawn))
        viewer.until("!document.querySelector('[aria-label=\"Width of dots\"]').closest('.row').hidden")
        self.assertTrue(viewer.js("document.querySelector('[aria-label=\"Width of plate\"]').closest('.row').hidden"))
        put = "((name, value) => { const i = document.querySelector(`input[aria-label='${name}']`); i.value = value; i.dispatchEvent(new Event('input', {bubbles: true})); return true; })(arguments[0], arguments[1])"
        for name, value in (("Width of dots", "7"), ("Colour of dots", "#ff4040"), ("Opacity of plate", "0.4")):
            viewer.js(put, name, value)
        drawn = viewer.final("o.shape?.[0] === 'plate,opacity=0.4' && o.shape[1] === 'dots,color=#ff4040,width=7px'")
        self.assertSamePixels(viewer.pixels(), self.command_line(drawn))
        viewer.save(SHOTS, "shapes")
        viewer.find("[data-shape=plate] .icon-button").click()
        viewer.final("o.shape?.length === 1")
        link = viewer.js("location.hash")
        self.assertIn("shape=plate,shown=0,opacity=0.4;dots,color=#ff4040,width=7px", urllib.parse.unquote(link))
        other = self.viewer(azimuth=150, elevation=20, shape="plate,shown=0,opacity=0.4;dots,color=#ff4040,width=7px")
        self.assertEqual(other.final("o['look-at'] !== undefined")["options"]["shape"], ["dots,color=#ff4040,width=7px"])
        viewer.focus()
        drop = """(() => { const d = new DataTransfer(); d.items.add(new File([arguments[0]], arguments[1]));
            document.querySelector('canvas').dispatchEvent(new DragEvent('drop', {bubbles: true, cancelable: true, dataTransfer: d})); return true; })()"""
        viewer.js(drop, ply_box((0, -30, 0), (12, -20, 12)), "my cube.ply")
        self.assertEqual(viewer.final("o.shape?.length === 2")["options"]["shape"][1], "my_cube")
        self.assertEqual(viewer.js("document.querySelector('.dataset select').value"), "patient")

    def test_a_large_file_is_sent_with_a_bar_and_can_be_given_up(self):
        viewer = self.viewer(self.proxy(delay=0.2).port)
        viewer.settled()
        viewer.js("""(() => { const d = new DataTransfer(); d.items.add(new File([new Uint8Array(40 << 20)], 'large.nrrd'));
            document.querySelector('canvas').dispatchEvent(new DragEvent('drop', {bubbles: true, cancelable: true, dataTransfer: d})); return true; })()""")
        viewer.until("/Sending large.nrrd: [1-9].* of 42 MB/.test(document.querySelector('.sending').textContent)")
        viewer.save(SHOTS, "sending")
        viewer.find(".sending button").click()
        viewer.until("document.querySelector('.sending').hidden")
        wait_until(lambda: all(each["name"] != "large" for each in self.gateway.json("/api/v1/datasets")[1]["datasets"]), "it is dropped")

    def test_what_the_token_does_not_give_is_not_offered(self):
        simulation = self.programs.start("../tests/steered_simulation", self.endpoint, "phi")
        self.addCleanup(self.programs.end, simulation)
        wait_until(lambda: self.gateway.json("/api/v1/parameters?dataset=phi")[0] == 200, "the simulation")
        spy = """window.chosen = 0; window.asked = []; const ask = window.fetch;
            HTMLInputElement.prototype.click = () => { chosen++; };
            window.fetch = (address, init) => { asked.push(String(address)); return ask(address, init); };"""
        drop = """((name, text) => { const d = new DataTransfer(); d.items.add(new File([text], name));
            for (const type of ['dragover', 'drop']) {
              document.querySelector('canvas').dispatchEvent(new DragEvent(type, {bubbles: true, cancelable: true, dataTransfer: d}));
              window.offered ??= document.querySelector('.viewer').dataset.drop;
            }
            return true; })(arguments[0], arguments[1])"""
        for claims, sends, steers in (({}, True, True), ({"view_only": True}, False, False), ({"datasets": ["patient", "phi"]}, False, True)):
            viewer = self.viewer(dataset="phi", held=self.gateway.holding(**claims), script=spy)
            viewer.settled()
            self.assertEqual(viewer.js("document.querySelectorAll('[aria-label^=\"Open a file\"]').length"), int(sends))
            viewer.keys("f")
            self.assertEqual(viewer.js("chosen"), int(sends))
            viewer.keys("?")
            words = viewer.js("document.querySelector('dialog').textContent")
            self.assertEqual(("Open a file" in words, "a volume, or a colour map" in words), (sends, sends))
            viewer.find("dialog [aria-label^=Close]").click()
            viewer.js(drop, "a.nrrd", "nothing")
            viewer.until("offered")
            self.assertEqual(viewer.js("offered"), "Drop a volume, a shape or a colour map" if sends else "Drop a colour map")
            if not sends:
                viewer.until("document.querySelector('.message.error')?.textContent === 'a.nrrd is not sent: you may not send files here.'")
                self.assertEqual(viewer.js("asked.filter(address => address.includes('upload'))"), [])
            viewer.until("document.querySelector('.panel output')?.checkVisibility()")
            parameter = "[...document.querySelectorAll('.panel .row')].find(row => row.textContent.includes('level'))"
            self.assertEqual(viewer.js(f"{parameter}.querySelectorAll('input').length > 0"), steers)
            if not steers:
                self.assertRegex(viewer.js(f"{parameter}.textContent"), "^level[0-9]+$")
                self.assertEqual(viewer.driver.execute_script((HERE / "accessibility.js").read_text()), [])
                viewer.save(SHOTS, "view-only")

    def test_when_the_token_expires_the_picture_stays_and_a_line_says_what_to_do(self):
        spy = "window.opened = 0; window.WebSocket = class extends WebSocket { constructor(...given) { super(...given); opened++; } };"
        banner = "document.querySelector('.banner:not([hidden])')?.textContent"
        for seconds in (5, 20, 80):  # until one is long enough for the first picture
            until = int(time.time()) + seconds
            viewer = self.viewer(held=self.gateway.holding(exp=until), script=spy)
            viewer.until(f"window.drawn.some(d => d.final && d.options['look-at']) || {banner} || document.querySelector('.empty')")
            if viewer.js("window.drawn.some(d => d.final && d.options['look-at'])"):
                break
        picture = viewer.pixels()
        line = time.strftime("The token expired at %Y-%m-%dT%H:%M:%SZ. Open a new link to go on.", time.gmtime(until))
        viewer.until(f"{banner} === arguments[0]", line)
        viewer.until("document.querySelector('.status').textContent === 'Not connected'")
        # Nothing connects again, nor asks.
        before = viewer.js("[opened, performance.getEntriesByType('resource').length]")
        viewer.js("(dispatchEvent(new Event('online')), true)")
        viewer.drag(30, 0)
        viewer.hover((10, 10))
        viewer.keys("k")
        viewer.until("document.querySelector('.message.error') !== null")
        self.assertEqual(viewer.js("[opened, performance.getEntriesByType('resource').length]"), before)
        self.assertEqual(viewer.js(banner), line)
        self.assertSamePixels(viewer.pixels(), picture)
        viewer.save(SHOTS, "expired")
        # So does a page that is loaded then. A new link works in the same tab.
        viewer.driver.refresh()
        viewer.until("document.querySelector('dialog') !== null")
        self.assertEqual(viewer.js("document.querySelector('.empty').textContent"), line)
        viewer.save(SHOTS, "expired-before")
        viewer.driver.get(self.url())
        viewer.settled()

    def test_no_curve_is_made_up_while_a_dataset_is_read(self):
        viewer = self.viewer(dataset="later")
        viewer.until("document.querySelector('.editor .plot .curve') !== null && document.querySelector('.progress-text').textContent.startsWith('Reading')")
        self.assertEqual(viewer.js("[document.querySelector('.editor .plot .curve').getAttribute('d') || '', document.querySelectorAll('.editor .plot .point').length]"), ["", 0])
        viewer.settled()
        viewer.until("document.querySelector('.editor .plot .curve').getAttribute('d').length > 10")

    def test_a_colour_bar_tells_values(self):
        viewer = self.viewer(color_bar=1, background="#ffffff")
        viewer.settled()
        ticks = "[...document.querySelectorAll('[data-pane=\"3d\"] .color-bar text')].map(t => Number(t.textContent.replace('−', '-')))"
        viewer.until(f"{ticks}.length >= 3")
        before = viewer.js(ticks)
        self.assertEqual(before, sorted(before))
        viewer.save(SHOTS, "color-bar")
        viewer.drag(150, 0, button="right")
        viewer.until(f"({ticks}).join() !== '{','.join(f'{tick:g}' for tick in before)}'")
        viewer.open_section("Transfer function")
        viewer.js("[...document.querySelectorAll('.row.toggle')].find(r => r.textContent === 'Colour bar').querySelector('input').click()")
        viewer.until("document.querySelector('.color-bar') === null")

    def test_key_frames_are_kept_and_saved(self):
        viewer = self.viewer()
        viewer.settled()
        viewer.keys("n")
        viewer.drag(50, 25)
        viewer.final("o.azimuth !== 180")
        viewer.keys("n")
        viewer.until("location.hash.includes('path=')")
        viewer.command("Page.setDownloadBehavior", behavior="allow", downloadPath=str(self.programs.folder))
        viewer.open_section("Key frames")
        viewer.driver.find_element(By.XPATH, "//button[contains(., 'Save for --path')]").click()
        saved = self.programs.folder / "path.json"
        wait_until(saved.exists, "saved")
        path = json.loads(saved.read_text())
        self.assertEqual([camera["azimuth"] for camera in path], [180, 160])
        self.assertEqual(set(path[0]), {"projection", "azimuth", "elevation", "roll", "zoom", "look-at"})
        viewer.find("[aria-label='Show key frame 1']").click()
        viewer.final("o.azimuth === 180")
        viewer.keys("v")
        viewer.until("[...document.querySelectorAll('dialog label')].some(l => l.textContent === '2 key frames')")
        viewer.save(SHOTS, "key-frames")

    def test_labels_are_measured(self):
        asked = []
        answer = {"unit": "ml", "labels": [{"value": 2, "name": "middle", "color": "#40c080", "volume": 7.469, "voxels": 934, "non_finite": 0, "mean": 140.5, "deviation": 9.75, "least": 124, "largest": 180}]}
        viewer = self.viewer(self.proxy(answers={"/api/v1/statistics": lambda fields, _: asked.append(fields) or (answer if fields.get("labels") else None)}).port)
        viewer.settled()
        viewer.open_section("Measure")
        viewer.until("[...document.querySelectorAll('.section button')].some(b => b.textContent === 'Labels…' && b.checkVisibility())")
        viewer.driver.find_element(By.XPATH, "//button[contains(., 'Labels…')]").click()
        viewer.until("document.querySelector('.label-table tbody tr')?.innerText.split('\\t').join() === '2,middle,7.469,140.5,9.75,124,180'")
        self.assertEqual(asked[0]["dataset"], "patient")
        viewer.save(SHOTS, "label-table")

    def test_the_clip_box_opens_its_section(self):
        viewer = self.viewer()
        viewer.settled()
        section = "[...document.querySelectorAll('details')].find(d => d.querySelector('h2').textContent === 'Clipping')"
        self.assertFalse(viewer.js(f"{section}.open"))
        viewer.keys("b")
        viewer.until(f"{section}.open && (b => b.top >= 0 && b.top < innerHeight)({section}.getBoundingClientRect())")

    def test_an_old_picture_keeps_its_shape(self):
        proxy = self.proxy()
        viewer = self.viewer(proxy.port)
        viewer.settled()
        self.assertEqual(viewer.js("getComputedStyle(document.querySelector('canvas')).objectFit"), "fill")
        proxy.listener.close()
        proxy.cut()  # no other picture comes
        viewer.command("Emulation.setDeviceMetricsOverride", width=760, height=640, deviceScaleFactor=1, mobile=False)
        viewer.until("(c => Math.abs(c.width / c.height - c.clientWidth / c.clientHeight) > 0.1 && getComputedStyle(c).objectFit === 'contain')(document.querySelector('canvas'))")

    def test_windows_by_name(self):
        viewer = self.viewer(layout="quad")
        viewer.settled()
        choice = viewer.driver.find_element(By.XPATH, "//div[label[. = 'Window for']]/select")
        self.assertEqual(viewer.js("[...arguments[0].options].map(o => o.text)", choice), ["Automatic", "Bone", "Lung", "Mediastinum", "Soft tissue", "Brain", "Liver"])
        choice.find_element(By.XPATH, "option[. = 'Soft tissue']").click()
        drawn = viewer.final("o.window === 400 && o.level === 40", "axial")
        self.assertSamePixels(viewer.pixels("axial"), self.command_line(drawn, "slice"))
        viewer.drag(40, 0, pane="axial", button="right")
        viewer.until("arguments[0].selectedOptions[0].text === 'Own'", choice)
        choice.find_element(By.XPATH, "option[. = 'Automatic']").click()
        viewer.final("o.window === undefined", "axial")

    # ---- channels and times

    def more(self, asked=None, delay=0.0, **more):
        """A port and a script for viewer(), of a gateway whose dataset has more."""
        histogram = {"dataset": "patient", "range": [0, 255], "counts": [1000] + [1] * 200 + [0] * 55, "percentiles": {}}
        note = lambda fields: asked.append(fields) if asked is not None else None
        answers = {"/api/v1/histogram": lambda fields, body: note(fields) or histogram, "/api/v1/transfer": lambda fields, body: note(fields) or [{"RGBPoints": [0, 0, 0, 0, 250, 1, 1, 1]}]}
        return {"port": self.proxy(delay, answers).port, "script": MORE.replace("ARGUMENT", json.dumps(more))}

    def test_names_in_the_picture_have_the_ranges_of_channels(self):
        viewer = self.viewer(**self.more([], fields=CHANNELS), color_bar=1)
        rows = "[...document.querySelectorAll('[data-pane=\"3d\"] .label-legend g')].map(g => [g.querySelector('text').textContent, g.querySelector('rect').getAttribute('fill')])"
        viewer.until(f"{rows}.length === 2")
        names = viewer.js(rows)
        self.assertRegex(names[0][0], r"  20 to 120$")
        self.assertEqual([color for _, color in names], ["#0000ff", "#00ff00"])

    def test_channels_have_a_row_each(self):
        asked = []
        more = self.more(asked, fields=CHANNELS)
        viewer = self.viewer(**more)
        shown = "[...document.querySelectorAll('details')].filter(d => !d.hidden).map(d => d.querySelector('h2').textContent)"
        pressed = "[...document.querySelectorAll('.channel-head > .icon-button')].map(b => b.getAttribute('aria-pressed') === 'true')"
        viewer.final("o['look-at'] && o.transfer === undefined && o.channel === undefined")
        viewer.until("document.querySelectorAll('.channel').length === 3 && document.querySelectorAll('.channel .of-channel[d^=M]').length === 2")
        self.assertEqual(viewer.js(pressed), [True, True, False])
        self.assertNotIn("Transfer function", viewer.js(shown))
        self.assertNotIn("Isosurfaces", viewer.js(shown))
        self.assertEqual(sorted(fields["field"] for fields in asked if "transfer" not in fields)[:2], ["0", "1"])
        self.assertEqual(viewer.js("[...document.querySelectorAll('.channel input[type=color]')].map(c => c.value)"), ["#0000ff", "#00ff00", "#ffff00"])
        row = lambda of, inside: viewer.find(f"[data-channel='{of}'] {inside}")
        type_into = lambda label, value: (viewer.js("(arguments[0].value = '', true)", viewer.find(f"[aria-label='{label}']")), viewer.find(f"[aria-label='{label}']").send_keys(value, Keys.ENTER))
        viewer.js("(e => { e.value = '#ff8800'; e.dispatchEvent(new Event('input')); return true; })(arguments[0])", row(1, "input[type=color]"))
        viewer.final("o['channel-color'] === '1=#ff8800'")
        # The range: as the file says, by keys, by hand, by numbers and from the histogram.
        self.assertEqual(viewer.js("[...document.querySelectorAll('[data-channel=\"0\"] .point')].map(p => +p.getAttribute('aria-valuenow'))"), [20, 120])
        viewer.js("(arguments[0].focus(), true)", row(0, ".point[data-index='1']"))
        viewer.driver.switch_to.active_element.send_keys(Keys.ARROW_LEFT * 10)
        drawn = viewer.final("o['channel-range']?.startsWith('0=20:')")["options"]["channel-range"]
        self.assertTrue(90 < float(drawn.split(":")[1]) < 105, drawn)
        x, y = viewer.js("(b => [b.left + b.width / 2, b.top + b.height / 2])(arguments[0].getBoundingClientRect())", row(0, ".point[data-index='0']"))
        for kind, dx in (("mousePressed", 0), ("mouseMoved", 40), ("mouseReleased", 40)):
            viewer.command("Input.dispatchMouseEvent", type=kind, x=x + dx, y=y, button="left", buttons=1, clickCount=1)
        viewer.final("Number(/^0=(.*):/.exec(o['channel-range'])[1]) > 40")
        type_into("DAPI, from", "11")
        viewer.final("o['channel-range'].startsWith('0=11:')")
        row(1, "[aria-label^=Auto]").click()
        viewer.final("o['channel-range'].endsWith(',1=19.9219:199.219')")
        type_into("Gamma of DAPI", "0.5")
        type_into("Opacity of Actin", "0.7")
        viewer.final("o['channel-gamma'] === '0=0.5' && o['channel-opacity'] === '1=0.7'")
        viewer.save(SHOTS, "channels")
        # The right button moves all ranges that show, as one step for undo.
        before = viewer.drawn()["options"]["channel-range"]
        viewer.drag(60, 0, button="right")
        viewer.final(f"o['channel-range'] !== '{before}' && o['scalar-range'] === undefined")
        viewer.keys(Keys.CONTROL, "z")
        viewer.final(f"o['channel-range'] === '{before}'")
        viewer.driver.find_element(By.XPATH, "//div[label[. = 'Blend']]/select/option[. = 'Max']").click()
        drawn = viewer.final("o.blend === 'max'")["options"]
        # All of it is in the link, and a page that is opened by it shows the same.
        viewer.until("location.hash.includes('blend=max')")
        other = Viewer(self.driver, viewer.js("location.href").replace("#", f"#token={self.gateway.token}&"), script=more["script"])
        self.addCleanup(other.close)
        self.assertEqual(other.final("o.transfer === undefined && o.blend === 'max'")["options"], drawn)
        viewer.focus()
        viewer.driver.find_element(By.XPATH, "//button[contains(., 'As the file says')]").click()
        viewer.final("!Object.keys(o).some(name => /^channel|^blend/.test(name))")

    def test_a_link_shows_channels_and_times_as_the_command_line_does(self):
        looks = {"channel_color": "0=#ff8000,1=#0040ff", "channel_range": "0=80:200,1=10:120", "channel_gamma": "1=0.7", "channel_opacity": "0=0.6"}
        viewer = self.viewer(dataset="dyes", channel="0,1", blend="over", time="2", **looks)
        lower = "d.header.size[1] < 592"  # the pane is, once the player is below it
        asked = " && ".join([lower, *(f"o['{name.replace('_', '-')}'] === '{value}'" for name, value in looks.items())])
        self.assertFinal(viewer, f"o.channel === '0,1' && o.blend === 'over' && o.time === '2' && {asked}")
        other = self.at_the_same_address(viewer)
        self.assertFinal(other, f"o.channel === '0,1' && o.blend === 'over' && o.time === '2' && {asked}")
        # A channel's transfer function: a preset, or its points.
        points = "mine,1|20,0,0,1;200,1,1,0|20,0;200,0.5"
        viewer = self.viewer(dataset="dyes", channel="0,1", channel_transfer=f"0=viridis,1={urllib.parse.quote(points)}", channel_gamma="0=2")
        function = "JSON.parse(/,1=(.*)$/.exec(o['channel-transfer'])[1])[0]"
        shows = f"o['look-at'] && {lower} && o['channel-transfer']?.startsWith('0=viridis,1=') && {function}.RGBPoints.join() === '20,0,0,1,200,1,1,0' && o['channel-gamma'] === undefined"
        drawn = viewer.final(shows)
        self.assertSamePixels(viewer.pixels(), self.command_line(drawn))
        self.assertFinal(self.at_the_same_address(viewer), shows)
        viewer = self.viewer(dataset="dyes", channel="1", time="last")
        self.assertFinal(viewer, f"o.channel === '1' && o.time === '2' && {lower}")

    def test_one_channel_alone_may_have_a_transfer_function(self):
        viewer = self.viewer(**self.more(fields=CHANNELS), channel_color="1=#123456")
        viewer.final("o.transfer === undefined && o['channel-color'] === '1=#123456'")
        viewer.until("document.querySelectorAll('.channel').length === 3")
        functions = "[...document.querySelectorAll('details')].find(d => d.querySelector('h2').textContent === 'Transfer function')"
        solo = lambda name: viewer.find(f"[aria-label='Solo: only {name}']")
        solo("Actin").send_keys(Keys.ENTER)
        viewer.final("o.channel === '1' && o.transfer === undefined && o['channel-color'] === '1=#123456'")
        self.assertEqual(solo("Actin").get_attribute("aria-pressed"), "true")
        viewer.until(f"!{functions}.hidden && {functions}.innerText.includes('takes its place')")
        viewer.driver.find_element(By.XPATH, "//div[label[. = 'Preset']]/select/option[. = 'Opaque']").click()
        viewer.final("o.channel === '1' && o.transfer === 'opaque' && o['channel-color'] === undefined")
        solo("Actin").click()
        viewer.final("o.channel === undefined && o.transfer === undefined && o['channel-color'] === '1=#123456'")
        self.assertTrue(viewer.js(f"{functions}.hidden"))
        for name, channels in (("Tubulin", "0,1,2"), ("DAPI", "1,2"), ("Actin", "2"), ("Tubulin", "0")):  # the last one: none shows
            viewer.find(f"[aria-label='Show {name}']").click()
            drawn = viewer.final(f"o.channel === '{channels}'")
        self.assertEqual(drawn["options"]["channel-opacity"], "0=0")
        viewer.until("location.hash.includes('channel=none')")

    def test_a_channel_whose_name_is_a_number_is_not_confused_with_another_one(self):
        viewer = self.viewer(**self.more(fields=[{**field, "name": str(i + 1)} for i, field in enumerate(CHANNELS)]), channel="1,2", channel_gamma="3=2")
        viewer.until("document.querySelectorAll('.channel').length === 3")
        self.assertEqual(viewer.js("[...document.querySelectorAll('.channel')].map(c => c.dataset.channel)"), ["0", "2", "3"])
        viewer.final("o.channel === '0,2'")
        viewer.find("[aria-label='Show 3']").click()
        viewer.final("o.channel === '0,2,3' && o['channel-gamma'] === '3=2'")

    def test_looks_of_channels_stay_with_their_dataset(self):
        viewer = self.viewer(**self.more(fields=CHANNELS), channel="0,7", channel_range="0=5:6,Actin=7:9", channel_opacity="0=3")
        drawn = viewer.final("o.channel === '0' && o.transfer === undefined")["options"]
        self.assertEqual((drawn["channel-range"], "channel-opacity" in drawn), ("0=5:6", False), "what is wrong in a link is left out")
        viewer.until("document.querySelectorAll('.channel').length === 3")
        viewer.find("[aria-label='Show Actin']").click()
        viewer.final("o['channel-range'] === '0=5:6,1=7:9'")
        show = lambda name: viewer.js("(s => (s.value = arguments[0], s.dispatchEvent(new Event('change', {bubbles: true})), true))(document.querySelector('.dataset select'))", name)
        show("other")
        viewer.final("o.dataset === 'other' && o.channel === undefined && o.transfer === 'auto'")
        viewer.until("document.querySelector('.channel') === null || !document.querySelector('.channel').checkVisibility()")
        viewer.until("!location.hash.includes('channel')")
        show("patient")
        viewer.final("o.dataset === 'patient' && o.channel === undefined && o.transfer === undefined")

    def test_times_are_played_and_stepped_through(self):
        asked = []
        more = self.more(asked, times={"count": 6, "step": 0.5, "unit": "s"}, time=1)
        viewer = self.viewer(**more)
        viewer.settled()
        text, present = "document.querySelector('.player output').textContent", lambda number: f"document.querySelector('.player input').value === '{number}'"
        viewer.until(f"!document.querySelector('.player').hidden && {text} === '0.5 s / 2.5 s'")
        self.assertNotIn("time", viewer.drawn()["options"])
        press = lambda *keys: viewer.actions().send_keys(*keys).perform()
        viewer.keys(".")
        viewer.final("o.time === '2'")
        viewer.keys(",", ",")
        viewer.final("o.time === '0' && o.roll === 0")
        viewer.keys(",")
        viewer.final("o.time === '5'")  # in a loop
        viewer.until("location.hash.includes('time=5')")
        viewer.find("[aria-label=Loop]").click()
        viewer.keys(".")
        viewer.until(f"{present(5)} && {text} === '2.5 s / 2.5 s'")
        viewer.keys(Keys.SHIFT, ".")
        viewer.final("o.roll !== 0")
        # Played to the end: times follow each other, and a time is asked for once the last one is there.
        viewer.js("(window.drawn.length = 0, true)")
        viewer.driver.find_element(By.XPATH, "//label[. = 'Times a second']/../select/option[. = '25 /s']").click()
        viewer.js("(document.querySelector('canvas').focus(), true)")
        press(" ")
        viewer.until("document.querySelector('[aria-label=Play]').getAttribute('aria-pressed') === 'true'")
        viewer.final("o.time === '5'")
        viewer.until("document.querySelector('[aria-label=Play]').getAttribute('aria-pressed') === 'false'")
        played = viewer.js("window.drawn.map(d => +d.options.time)")
        self.assertEqual(played[played.index(0):], sorted(played[played.index(0):]))
        viewer.save(SHOTS, "times")
        press("?")
        viewer.until("[...document.querySelectorAll('dialog[open] h3')].some(h => h.textContent === 'Time')")
        viewer.save(SHOTS, "times-help")
        press(Keys.ESCAPE)
        # In text fields keys are text; on buttons, Space presses.
        viewer.js("([...document.querySelectorAll('.panel input[type=number]')].find(e => e.checkVisibility()).focus(), true)")
        press(" ", ".")
        press(Keys.TAB)
        self.assertEqual(viewer.js(f"[{present(5)}, document.querySelector('[aria-label=Play]').getAttribute('aria-pressed')]"), [True, "false"])
        viewer.js("(document.querySelector('[aria-label=Loop]').focus(), true)")
        press(" ")
        viewer.until("document.querySelector('[aria-label=Loop]').getAttribute('aria-pressed') === 'true'")
        # In a loop, until it is paused; another choice of time is where it goes on.
        press(Keys.SHIFT + Keys.TAB)
        viewer.js("(window.drawn.length = 0, document.querySelector('canvas').focus(), true)")
        press(" ")
        viewer.until("window.drawn.filter(d => d.options.time === '1').length > 0 && window.drawn.filter((d, i, all) => d.options.time < all[i - 1]?.options.time).length > 1")
        press(" ")
        viewer.until("document.querySelector('[aria-label=Play]').getAttribute('aria-pressed') === 'false'")
        # Live: the newest one, also when there are more.
        viewer.find("[aria-label^=Live]").click()
        viewer.final("o.time === '5'")
        viewer.until("location.hash.includes('time=last')")
        viewer.js("(window.more.times = {count: 8, step: 0.5, unit: 's'}, true)")
        viewer.final("o.time === '7'")
        viewer.until(f"{text} === '3.5 s / 3.5 s'")

    def test_times_are_left_out_rather_than_late(self):
        viewer = self.viewer(**self.more(delay=0.1, times={"count": 30}), renderer="raycast")
        viewer.settled()
        viewer.until("!document.querySelector('.player').hidden")
        viewer.js("(window.sent.length = 0, window.drawn.length = 0, true)")
        viewer.driver.find_element(By.XPATH, "//label[. = 'Times a second']/../select/option[. = '25 /s']").click()
        viewer.find("[aria-label=Loop]").click()
        viewer.find("[aria-label=Play]").click()
        viewer.final("o.time === '29'")
        viewer.until("document.querySelector('[aria-label=Play]').getAttribute('aria-pressed') === 'false'")
        sent = viewer.js("window.sent")  # each with the time that was shown then
        self.assertLess(len(sent), 20)
        times = [time for time, _ in sent]
        self.assertEqual(times, sorted(times, key=int))
        for i, (_, shown) in enumerate(sent[2:]):  # the picture before is there; if it has just come, this is not told yet
            self.assertIn(shown, times[i:i + 2], sent)

    def test_a_link_says_the_time_in_any_unit(self):
        for time, number in (("1.5s", "3"), ("500ms", "1"), ("4", "4"), ("last", "5")):
            viewer = self.viewer(**self.more(times={"count": 6, "step": 0.5, "unit": "s"}), time=time)
            viewer.final(f"o.time === '{number}'")
        plain = self.viewer(**self.more(times={"count": 6}), time="2")
        plain.until("document.querySelector('.player output')?.textContent === '2 / 5'")
        far = self.viewer(**self.more(times={"count": 6}), time="9")
        far.final("o.time === undefined")

    def test_channels_and_times_fit_and_have_names(self):
        script = (HERE / "accessibility.js").read_text()
        more = self.more(fields=[{**CHANNELS[0], "name": "A channel of a long name, emission 461 nm"}, *CHANNELS[1:]], times={"count": 40, "step": 250, "unit": "ms"})
        for theme in ("dark", "light"):
            viewer = self.viewer(**more, theme=theme)
            viewer.settled()
            viewer.until("document.querySelectorAll('.channel .of-channel[d^=M]').length === 2")
            self.assertEqual(viewer.driver.execute_script(script), [], theme)
            self.assertTrue(viewer.js("(p => p.scrollWidth <= p.clientWidth)(document.querySelector('.panel'))"))
            viewer.save(SHOTS, f"channels-{theme}")
        narrow = self.viewer(**more, width=320, height=640, mobile=True, theme="light", color_bar=1)
        narrow.settled()
        narrow.find("[aria-label='Settings']").click()
        narrow.until("document.querySelectorAll('.channel .of-channel[d^=M]').length === 2")
        outside = """[...document.querySelectorAll('.player *, .channel *')].filter(e => e.checkVisibility()).filter(e => { const b = e.getBoundingClientRect();
            return b.left < -1 || b.right > innerWidth + 1; }).map(e => e.outerHTML.slice(0, 80))"""
        self.assertEqual(narrow.js(outside), [])
        self.assertEqual(narrow.js("document.documentElement.scrollWidth"), 320)
        small = """[...document.querySelectorAll('.player button, .player select, .channel button, .channel input')].filter(e => e.checkVisibility())
            .filter(e => { const b = e.getBoundingClientRect(); return b.height < 43.5 || (e.matches('button') && b.width < 43.5); }).map(e => e.outerHTML.slice(0, 80))"""
        self.assertEqual(narrow.js(small), [])
        narrow.save(SHOTS, "channels-narrow")

    def test_a_simulation_is_followed_and_steered(self):
        simulation = self.programs.start("../tests/steered_simulation", self.endpoint, "rho")
        self.addCleanup(self.programs.end, simulation)
        told = lambda: self.gateway.json("/api/v1/parameters?dataset=rho")
        wait_until(lambda: told()[0] == 200, "the simulation")
        viewer = self.viewer(dataset="rho", layout="quad", window=250, level=125)
        viewer.settled()
        level = "document.querySelector('#parameter-level')"
        viewer.until(f"{level}?.value === '100' && {level}.checkVisibility()")
        # New times show without a click, in slices, too.
        viewer.js("(window.drawn.length = 0, true)")
        for pane in ("3d", "z"):
            viewer.until("window.drawn.filter(d => d.pane === arguments[0]).length > 3", pane)
        middle = lambda: (lambda width, height, rgba: rgba[4 * (height // 2 * width + width // 2)])(*viewer.pixels("z"))
        wait_until(lambda: 80 < middle() < 120, "the grey of 100")
        viewer.find("#parameter-level").send_keys(Keys.END)
        wait_until(lambda: told()[1]["parameters"][0]["value"] == 250, "the slider steers")
        wait_until(lambda: middle() > 240, "and pictures show it")
        number = viewer.find("[aria-label^='unused, ']")
        number.send_keys(Keys.CONTROL, "a")
        number.send_keys("-0.5", Keys.ENTER)
        wait_until(lambda: told()[1]["parameters"][1]["value"] == -0.5, "the number steers")
        # What others change shows.
        self.gateway.request("/api/v1/parameters", method="POST", body=json.dumps({"dataset": "rho", "set": "level=50"}))
        viewer.until(f"{level}.value === '50'")
        self.assertEqual(viewer.driver.execute_script((HERE / "accessibility.js").read_text()), [])
        viewer.save(SHOTS, "simulation")

    # ---- slices and what lies below the pointer

    def test_slices_share_a_cross_hair(self):
        viewer = self.viewer(layout="quad")
        viewer.settled()
        drawn = [viewer.settled(pane) for pane in ("axial", "coronal", "sagittal")]
        self.assertEqual(len({d["options"]["at"] for d in drawn}), 1)
        self.assertSamePixels(viewer.pixels("coronal"), self.command_line(drawn[1], "slice"))
        before = viewer.pixels("sagittal")
        viewer.drag(0, 0, start=(40, -20), pane="axial", steps=1)
        at = viewer.final(f"o.at !== '{drawn[0]['options']['at']}'", "sagittal")["options"]["at"]
        geometry = drawn[0]["header"]["geometry"]
        for i, value in enumerate(map(float, at.split(","))):
            if abs(geometry["forward"][i]) > 0.5:
                continue  # the slice stays
            self.assertAlmostEqual(value, geometry["target"][i] + geometry["pixel_size"] * (40 * geometry["right"][i] + 20 * geometry["up"][i]), delta=2 * geometry["pixel_size"])
        self.assertNotEqual(viewer.pixels("sagittal"), before)
        viewer.wheel(100, (0, 0), pane="coronal")
        moved = viewer.final(f"o.at !== '{at}'", "axial")["options"]["at"]
        changed = [i for i in range(3) if abs(float(moved.split(",")[i]) - float(at.split(",")[i])) > 1e-6]
        self.assertEqual(changed, [1], "the coronal slice moves along y")
        viewer.keys(Keys.ARROW_UP, pane="axial")
        viewer.final(f"o.at !== '{moved}'", "coronal")
        viewer.drag(40, 0, pane="axial", button="right")
        viewer.final("o.window > 0", "coronal")
        viewer.find("input[aria-label='Window of the slices']").send_keys(Keys.CONTROL, "a", Keys.NULL, "50", Keys.ENTER)
        drawn = viewer.final("o.window === 50", "axial")
        self.assertSamePixels(viewer.pixels("axial"), self.command_line(drawn, "slice"))
        viewer.save(SHOTS, "slices")
        viewer.keys("l")
        viewer.until("document.querySelectorAll('.pane').length === 1")

    def test_the_pointer_tells_position_value_and_label(self):
        asked = []
        answer = {"hit": True, "at": [1.5, -2, 3], "depth": 9, "voxel": [10, 11, 9], "value": 140, "fields": [{"name": "volume", "value": 140}],
                  "label": {"value": 2, "name": "middle"}}
        answers = {"/api/v1/pick": lambda fields, body: asked.append(body) or answer,
                   "/api/v1/value": lambda fields, body: {"at": [float(n) for n in fields["at"].split(",")], "voxel": [1, 2, 3], "inside": True, "value": 99,
                                                          "fields": [{"name": "volume", "value": 99}]}}
        viewer = self.viewer(self.proxy(answers=answers).port, layout="quad")
        viewer.settled()
        viewer.until("document.querySelectorAll('.pane').length === 4")
        viewer.hover((10, 5))
        viewer.until("document.querySelector('.readout').textContent === 'R 1.5  A −2.0  S 3.0 mmvalue 140middle'")
        self.assertEqual((asked[0]["dataset"], asked[0]["size"]), ("patient", "x".join(map(str, viewer.drawn()["header"]["size"]))))
        width, height = viewer.drawn()["header"]["size"]
        self.assertAlmostEqual(asked[-1]["x"], width / 2 + 10, delta=1)
        self.assertAlmostEqual(asked[-1]["y"], height / 2 + 5, delta=1)
        answer.update(shape="vessel", shape_number=0, shape_value=0.25)
        viewer.hover((12, 5))
        viewer.until("document.querySelector('.readout').textContent === 'R 1.5  A −2.0  S 3.0 mmvessel 0.25value 140middle'")
        viewer.settled("axial")
        viewer.hover((10, 5), pane="axial")
        viewer.until("/^R .* mmvalue 99$/.test(document.querySelector('.readout').textContent)")
        viewer.js("document.querySelector('canvas').dispatchEvent(new MouseEvent('dblclick', {clientX: 100, clientY: 100}))")
        viewer.final("o.at === '1.5,-2,3'", "axial")

    def test_known_values_are_picked(self):
        self.assertEqual(self.gateway.request("/api/v1/pick?dataset=patient&x=1&y=1")[0], 200)
        viewer = self.viewer(layout="quad", transfer="opaque", renderer="mip")  # the largest value lies within the ball
        viewer.settled()
        viewer.until("document.querySelectorAll('.pane').length === 4")
        for pane in ("3d", "coronal"):
            viewer.settled(pane)
            viewer.hover((12, -7), pane=pane)
            text = viewer.until("/value[^]*(left|middle|right)/.test(document.querySelector('.readout').innerText) && document.querySelector('.readout').innerText.replaceAll('\u2212', '-')")
            r, value, label = re.match(r"R (\S+) .* mm\s*value (\S+)\s*(\w+)", text, re.DOTALL).groups()
            i = round((float(r) + 20) / 2)  # the volume begins at -20, a voxel has 2 mm
            self.assertEqual((float(value), label), (60 + 8 * i, ("left", "middle", "right")[i // 8]), text)
            viewer.hover((-150, -90), pane=pane)
            viewer.until("!/left|middle|right/.test(document.querySelector('.readout').innerText)")

    # ---- the page

    def test_the_keyboard_does_everything(self):
        viewer = self.viewer()
        drawn = viewer.settled()["options"]
        self.assertTrue(viewer.js("document.activeElement === document.querySelector('canvas')"), "keys work at once")
        press = lambda *keys: viewer.actions().send_keys(*keys).perform()
        press(Keys.ARROW_RIGHT * 2, Keys.ARROW_UP)
        viewer.final(f"o.azimuth === {drawn['azimuth']} - 10 && o.elevation === {drawn['elevation']} - 5")
        press("+", ".", "4")
        viewer.final(f"o.zoom > {drawn['zoom']} && o.azimuth === 90 && o.elevation === 0 && o.roll === 0")
        viewer.keys(Keys.SHIFT, Keys.ARROW_LEFT)
        viewer.final(f"o['look-at'] !== '{drawn['look-at']}'")
        viewer.keys("o")
        viewer.final("o.projection === 'perspective'")
        press("?")
        viewer.until("document.querySelector('dialog[open]') !== null")
        viewer.save(SHOTS, "help")
        press(Keys.ESCAPE)
        viewer.until("document.querySelector('dialog') === null")
        press("m")
        viewer.until("document.querySelector('.machine:not([hidden]) svg.spans rect') !== null")
        # Tab goes through everything in the order of the page, and everything that is reached shows it.
        viewer.js("document.querySelector('.skip').focus()")
        reached = []
        for _ in range(90):
            name, ring = viewer.js("(e => [e.className.baseVal === undefined ? e.getAttribute('aria-label') || e.textContent || e.id : 'svg', getComputedStyle(e).outlineStyle !== 'none' || e.matches('canvas, .point, .segmented input, .handle')])(document.activeElement)")
            if reached and (name == reached[0] or viewer.js("document.activeElement === document.body")):
                break
            reached.append(name)
            self.assertTrue(ring, f"no ring: {name}")
            press(Keys.TAB)
        self.assertEqual(reached[0], "Skip to the picture")
        for name in ("Views", "Help", "Settings", "Save as a file", "Labels"):
            self.assertIn(name, reached)

    def test_names_roles_and_contrasts(self):
        script = (HERE / "accessibility.js").read_text()
        for theme in ("dark", "light"):
            viewer = self.viewer(theme=theme, layout="quad", machine=1, label_mode="tint", renderer="raycast", clip_box=":,:,:")
            viewer.settled()
            viewer.until("document.querySelector('.facts dd') !== null && document.querySelector('svg.spans rect') !== null")
            viewer.js("document.querySelectorAll('details').forEach(d => { d.open = true; })")
            self.assertEqual(viewer.driver.execute_script(script), [], theme)
            viewer.save(SHOTS, f"everything-{theme}")
            viewer.js("document.querySelectorAll('details').forEach((d, i) => { d.open = i > 2; })")
            viewer.keys("?")
            self.assertEqual(viewer.driver.execute_script(script), [], theme)
            viewer.driver.switch_to.active_element.send_keys(Keys.ESCAPE)
            viewer.keys("s")
            self.assertEqual(viewer.driver.execute_script(script), [], theme)
            viewer.save(SHOTS, f"save-{theme}")
            viewer.driver.switch_to.active_element.send_keys(Keys.ESCAPE)
            viewer.keys("k")
            viewer.until("document.querySelector('pre') !== null")
            self.assertIn("slabstream render patient", viewer.js("document.querySelector('pre').textContent"))
            self.assertEqual(viewer.driver.execute_script(script), [], theme)
            viewer.save(SHOTS, f"command-{theme}")

    def test_it_fits_360_pixels(self):
        viewer = self.viewer(width=360, height=640, mobile=True, layout="quad", machine=1)
        viewer.settled()
        outside = """[...document.querySelectorAll('button, select, input, canvas')].filter(e => e.checkVisibility() && !e.closest('.offscreen, .section') && !e.matches('.offscreen')).filter(e => { const b = e.getBoundingClientRect();
            return b.left < -1 || b.right > innerWidth + 1; }).map(e => e.outerHTML.slice(0, 80))"""
        self.assertEqual(viewer.js(outside), [])
        self.assertEqual(viewer.js("document.documentElement.scrollWidth"), 360)
        viewer.save(SHOTS, "narrow-machine")
        viewer.find("[aria-label='Views']").click()
        viewer.driver.find_element(By.XPATH, "//button[@role='menuitem'][contains(., 'Machine panel')]").click()
        viewer.find("[aria-label='Settings']").click()
        viewer.until("document.querySelector('.panel:not([hidden])') !== null")
        # Fingers hit what they mean: 44 pixels each way.
        small = """[...document.querySelectorAll('button, select, summary, .panel input:not([type=checkbox])')].filter(e => e.checkVisibility() && !e.matches('.offscreen, .skip, [type=radio]'))
            .filter(e => { const b = e.getBoundingClientRect(); return b.height < 43.5 || (e.matches('button') && b.width < 43.5); }).map(e => e.outerHTML.slice(0, 80))"""
        self.assertEqual(viewer.js(small), [])
        reset = viewer.find("[aria-label='Reset the view']")
        self.assertTrue(reset.is_displayed())
        self.assertEqual(viewer.js("[document.documentElement.scrollWidth, document.querySelector('.panel').scrollWidth <= 360]"), [360, True])
        viewer.save(SHOTS, "narrow-settings")

    def test_nothing_is_asked_of_other_hosts(self):
        self.driver.get_log("browser")  # forgets what pages of other tests said
        viewer = self.viewer(layout="quad", machine=1)
        viewer.settled()
        viewer.keys("k")
        viewer.until("document.querySelector('pre') !== null")
        names = viewer.js("performance.getEntriesByType('resource').concat(performance.getEntriesByType('navigation')).map(e => e.name)")
        self.assertGreater(len(names), 4)
        self.assertEqual({urllib.parse.urlsplit(name).netloc for name in names}, {self.gateway.authority})
        self.assertEqual(viewer.js("window.violations"), [])
        bad = [entry for entry in viewer.log() if "SEVERE" in entry and "404" not in entry]
        self.assertEqual(bad, [])

    def test_two_viewers_see_each_their_own_view(self):
        one, two = self.viewer(azimuth=10), self.viewer(dataset="sphere", azimuth=80)
        two.settled()
        one.focus()
        self.assertEqual(one.settled()["options"]["azimuth"], 10)
        one.drag(30, 0)
        one.final("o.azimuth !== 10")
        two.focus()
        self.assertEqual(two.drawn()["options"]["azimuth"], 80)
        two.drag(30, 0)
        two.final("o.azimuth !== 80")

    def test_memory_stays_after_a_thousand_pictures(self):
        viewer = self.viewer(width=320, height=240)
        viewer.settled()
        turn = """const [count, done] = [arguments[0], arguments[arguments.length - 1]], canvas = document.querySelector('canvas'); let n = 0;
            const drawn = () => { n += 1; }, turn = () => { if (n >= count) { canvas.removeEventListener('slabstream:drawn', drawn); return done(n); }
                canvas.dispatchEvent(new KeyboardEvent('keydown', {key: 'ArrowRight', bubbles: true})); requestAnimationFrame(turn); };
            canvas.addEventListener('slabstream:drawn', drawn); turn();"""
        used = "(() => { for (let i = 0; i < 4; i++) gc(); return performance.memory.usedJSHeapSize; })()"
        viewer.driver.execute_async_script(turn, 100)
        before = viewer.js(used)
        viewer.driver.execute_async_script(turn, 1000)
        grown = viewer.js(used) - before
        self.assertLess(grown, 3e6, f"1000 pictures left {grown / 1e6:.1f} MB behind")

    # ---- when something is wrong

    def test_a_slow_network(self):
        viewer = self.viewer(self.proxy(delay=0.1).port)  # 200 ms there and back
        viewer.settled()
        viewer.driver.execute_script("window.drawn.length = 0")
        for _ in range(12):
            viewer.drag(20, 3, steps=2)
        drawn = self.assertFinal(viewer, "Math.abs(o.azimuth - 84) < 0.01")
        self.assertGreater(drawn["header"]["statistics"]["round_trip_ms"], 150)

    def test_far_away_what_moves_is_video(self):
        link = SlowLink(self.gateway.port, round_trip_ms=100, megabits=2)
        self.addCleanup(link.close)
        viewer = self.viewer(link.port)
        viewer.settled()
        self.assertTrue(viewer.js("'VideoDecoder' in window"))
        viewer.js("""(() => { const canvas = document.querySelector('canvas'); window.moving = [];
            canvas.addEventListener('slabstream:drawn', e => { const { header } = e.detail, { width, height } = canvas;
                const codes = canvas.getContext('2d').getImageData(0, 0, width, height).data;
                if (!header.final) window.last = { type: header.type, codes, seq: header.seq }, window.moving.push(header.type);
                else if (window.last) { const sums = [0, 0, 0]; let far = 0;
                    for (let i = 0; i < codes.length; i++) if (i % 4 < 3) { const d = codes[i] - last.codes[i]; sums[i % 4] += d; far += Math.abs(d); }
                    window.compared = { type: last.type, seq: last.seq, final: header.seq, bias: sums.map(s => 4 * s / codes.length), far: 4 / 3 * far / codes.length }; } }); })()""")
        for _ in range(20):  # a busy machine may draw no moving picture of the last view
            viewer.js("window.compared = null")
            viewer.drag(20, 3, steps=4)
            compared = viewer.until("window.compared")
            if compared["type"] == "video/vp9" and compared["seq"] == compared["final"]:
                break
        self.assertEqual((compared["type"], compared["seq"]), ("video/vp9", compared["final"]))
        self.assertLess(max(abs(bias) for bias in compared["bias"]), 2, f"the colours are others: {compared}")
        self.assertLess(compared["far"], 4, f"the picture is another: {compared}")

    def test_far_away_zooming_and_moving_follow_at_once(self):
        link = SlowLink(self.gateway.port, round_trip_ms=400, megabits=100)
        self.addCleanup(link.close)
        viewer = self.viewer(link.port)
        viewer.settled()
        # What a view looks like in the task in which it is wanted, and once the service has drawn it.
        viewer.js("""(() => { const canvas = document.querySelector('canvas'), codes = () => canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data;
            const far = (a, b) => { let sum = 0; for (let i = 0; i < a.length; i++) sum += Math.abs(a[i] - b[i]); return 4 / 3 * sum / a.length; };
            window.wanted = (name, step) => { const before = codes(); window[name] = null; step();
                requestAnimationFrame(() => requestAnimationFrame(() => { const soon = codes();
                    canvas.addEventListener('slabstream:drawn', function drawn(e) { if (!e.detail.final) return; canvas.removeEventListener('slabstream:drawn', drawn);
                        window[name] = { moved: far(before, codes()), soon: far(soon, codes()) }; }); })); };
            window.at = (type, more) => { const box = canvas.getBoundingClientRect(); canvas.dispatchEvent(new (type === 'wheel' ? WheelEvent : PointerEvent)(type, { bubbles: true, pointerId: 1, button: 0, clientX: box.left + 0.6 * box.width + (more.dx || 0), clientY: box.top + 0.4 * box.height + (more.dy || 0), ...more })); };
            canvas.setPointerCapture = () => {}; })()""")
        drag = lambda **keys: f"() => {{ at('pointerdown', {json.dumps(keys)}); at('pointermove', {json.dumps({'dx': 40, 'dy': 25, **keys})}); at('pointerup', {json.dumps({'dx': 40, 'dy': 25, **keys})}); }}"
        for name, step in (("zooming", "() => at('wheel', { deltaY: -200 })"), ("moving", drag(shiftKey=True)), ("rolling", drag(ctrlKey=True))):
            viewer.js(f"wanted('{name}', {step})")
            seen = viewer.until(f"window.{name}")
            self.assertGreater(seen["moved"], 3, f"{name}: {seen}")
            self.assertLess(seen["soon"], seen["moved"] / 5, f"{name}: {seen}")

    def test_it_connects_again(self):
        proxy = self.proxy()
        viewer = self.viewer(proxy.port)
        viewer.settled()
        picture = viewer.pixels()
        proxy.cut()
        viewer.driver.execute_script("window.drawn.length = 0")
        viewer.final("true")  # the same view, from the new connection
        self.assertSamePixels(viewer.pixels(), picture)
        viewer.drag(30, 0)
        viewer.final("o.azimuth < 180")

    def test_a_connection_that_dies_without_a_word_is_noticed_and_made_anew(self):
        proxy = self.proxy()
        viewer = self.viewer(proxy.port, layout="quad")
        viewer.settled()
        viewer.final("true", "axial")
        proxy.freeze()
        viewer.drag(30, 0)
        viewer.until("document.querySelector('.status').textContent === 'Not connected'")
        viewer.final("o.azimuth < 180")
        viewer.until("document.querySelector('.status').dataset.state === 'good' && document.querySelector('.banner').hidden")
        viewer.keys(Keys.ARROW_UP, pane="axial")  # the other panes' connections, too
        viewer.js("(window.drawn.length = 0, true)")
        viewer.keys(Keys.ARROW_UP, pane="axial")
        viewer.final("true", "axial")

    def test_without_its_script_the_page_says_so(self):
        viewer = Viewer(self.driver, "about:blank")
        self.addCleanup(viewer.close)
        viewer.command("Network.enable")
        viewer.command("Network.setBlockedURLs", urls=["*page.js"])
        viewer.driver.get(self.url())
        viewer.until("getComputedStyle(document.querySelector('.unstarted')).visibility === 'visible'")
        self.assertIn("script has not started", viewer.js("document.body.innerText"))

    def test_a_worker_is_seen_dying_while_the_picture_stays(self):
        viewer = self.viewer(machine=1)
        viewer.settled()
        viewer.until("document.querySelectorAll('.worker[data-state=well]').length === 2")
        picture = viewer.pixels()
        workers = self.gateway.json("/api/v1/status")[1]["workers"]
        os.kill(workers[0]["pid"], signal.SIGKILL)
        viewer.until("document.querySelector('.worker[data-state=lost]') !== null")
        self.assertSamePixels(viewer.pixels(), picture)
        viewer.drag(30, 0)
        self.assertFinal(viewer, "o.azimuth < 180")
        viewer.save(SHOTS, "worker-lost")

    def test_the_service_ends_and_comes_back(self):
        viewer = self.viewer()
        viewer.settled()
        picture = viewer.pixels()
        self.programs.end(self.service)
        viewer.until("/rendering service is gone|no worker/.test(document.querySelector('.banner:not([hidden])')?.textContent ?? '')")
        self.assertSamePixels(viewer.pixels(), picture)
        viewer.save(SHOTS, "service-gone")
        type(self).service, _ = self.programs.up(*self.data)
        viewer.until("document.querySelector('.banner').hidden")
        viewer.drag(30, 0)
        viewer.final("o.azimuth < 180")


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[5:]])
