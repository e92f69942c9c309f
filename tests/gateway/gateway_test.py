#!/usr/bin/env python3
"""The gateway as scripts and pages use it: the real programs, over HTTP and a WebSocket.

    gateway_test.py FOLDER_OF_PROGRAMS [unittest arguments]
"""
import base64
import concurrent.futures
import csv
import gzip
import http.client
import io
import json
import os
import random
import re
import select
import shutil
import signal
import socket
import ssl
import struct
import subprocess
import sys
import tempfile
import time
import unittest
import urllib.parse
from pathlib import Path

from page import Closed, Gateway, Page, Refused, png_pixels, signed, whole

PROGRAMS = Path(sys.argv[1]) if len(sys.argv) > 1 else None
TIMEOUT = 120  # far above what anything needs


def process_ended(pid):
    try:
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] in "ZX"
    except OSError:
        return True


def listening_port(pid):
    """Where the process listens: its own line of the table of sockets."""
    own = set()
    for descriptor in Path(f"/proc/{pid}/fd").iterdir():
        try:
            own.add(os.readlink(descriptor))
        except OSError:
            continue
    sockets = [line.split() for line in Path(f"/proc/{pid}/net/tcp").read_text().splitlines()[1:]]
    return next(int(fields[1].split(":")[1], 16) for fields in sockets if fields[3] == "0A" and f"socket:[{fields[9]}]" in own)


def wait_until(condition, what):
    limit = time.monotonic() + TIMEOUT
    while not condition():
        if time.monotonic() > limit:
            raise AssertionError(what)
        time.sleep(0.02)


class Programs:
    """A folder, and what was started in it."""

    def __init__(self):
        self.folder = Path(tempfile.mkdtemp(prefix="slabstream-gateway-", dir="/tmp"))
        self.environment = {**os.environ, "XDG_RUNTIME_DIR": str(self.folder)}
        for name in ("SLABSTREAM_ENDPOINT", "SLABSTREAM_SERVICE", "DISPLAY", "WAYLAND_DISPLAY"):
            self.environment.pop(name, None)
        self.children = []

    def run(self, *arguments, expect=0):
        result = subprocess.run([str(PROGRAMS / "slabstream"), *map(str, arguments)], cwd=self.folder, env=self.environment,
                                capture_output=True, text=True, timeout=TIMEOUT)
        assert result.returncode == expect, f"{arguments}: {result.returncode} {result.stderr}"
        return result

    def start(self, program, *arguments, **more):
        """A gateway that names no service gets one that does not run."""
        if program == "slabstream-gateway" and not {"--endpoint", "--service"} & set(arguments):
            arguments += ("--endpoint", f"ipc://{self.folder}/nobody")
        child = subprocess.Popen([str(PROGRAMS / program), *map(str, arguments)], cwd=self.folder, stdin=subprocess.DEVNULL,
                                 stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **{"env": self.environment, **more})
        self.children.append(child)
        return child

    def end(self, child):
        if child.poll() is None:
            child.send_signal(signal.SIGTERM)
        child.communicate(timeout=TIMEOUT)
        self.children.remove(child)
        return child.returncode

    def up(self, *arguments):
        endpoint = f"ipc://{self.folder}/s"
        child = self.start("slabstream", "up", "--listen", endpoint, "--workers", "2", "--threads", "1", *arguments)
        line = child.stdout.readline()
        assert "is up" in line, line + child.stderr.read()
        return child, endpoint

    def gateway(self, *arguments, context=None):
        child = self.start("slabstream-gateway", *arguments)
        line = child.stdout.readline().split()
        assert line and line[0] == "ready", child.stderr.read()
        gateway = Gateway(line[1], context)
        return child, gateway

    def close(self):
        """Fails if a program ended before anybody asked it to, and tells its last words."""
        ended = []
        for child in reversed(list(self.children)):
            early = child.poll()
            if early is None:
                child.send_signal(signal.SIGTERM)
            _, errors = child.communicate(timeout=TIMEOUT)
            if early is not None:
                ended.append(f"{child.args} ended by itself with {early}: {errors[-4000:]}")
        self.children.clear()
        shutil.rmtree(self.folder)
        assert not ended, "\n".join(ended)


def write_labels(folder):
    """labels.nrrd, on the grid of a sphere of 20 voxels a side: 3 and 70 in two of its corners; and names.txt, colours for them."""
    voxels = bytes(3 if max(x, y, z) < 4 else 70 if min(x, y, z) > 15 else 0 for z in range(20) for y in range(20) for x in range(20))
    (folder / "labels.nrrd").write_bytes(b"NRRD0004\ntype: uint8\ndimension: 3\nsizes: 20 20 20\nspacings: 1 1 1\nencoding: raw\n\n" + voxels)
    (folder / "names.txt").write_text("3 1 0.5 0 Corner \"low\"\n5 1 1 1 Nowhere\n70 0 0 1 Größte Ecke\n", encoding="utf-8")


NAMES = {"a", "b", "c", "levels", "channels", "times"}  # of datasets


def write_channels(folder):
    """A volume of two channels, which hold 10 and 20, and one of three times, which hold 1, 2 and 3."""
    (folder / "channels" / "4").mkdir(parents=True)
    scale = {"key": "4", "size": [4, 4, 4], "chunk_sizes": [[4, 4, 4]], "resolution": [4, 4, 4], "encoding": "raw"}
    (folder / "channels" / "info").write_text(json.dumps({"data_type": "uint8", "num_channels": 2, "type": "image", "scales": [scale]}))
    (folder / "channels" / "4" / "0-4_0-4_0-4").write_bytes(bytes([10]) * 64 + bytes([20]) * 64)
    header = "{'descr': '|u1', 'fortran_order': False, 'shape': (3, 4, 4, 4), }\n"
    (folder / "times.npy").write_bytes(b"\x93NUMPY\x01\0" + bytes([len(header), 0]) + header.encode() + b"".join(bytes([t]) * 64 for t in (1, 2, 3)))


class WithService(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.programs = Programs()
        cls.addClassCleanup(cls.programs.close)
        cls.programs.run("sphere", "--class", 1, "--size", 24, "--occupancy", 0.2, "-o", "a.nrrd")
        cls.programs.run("sphere", "--class", 2, "--size", 20, "--occupancy", 0.3, "-o", "b.nrrd")
        write_labels(cls.programs.folder)
        write_channels(cls.programs.folder)
        cls.programs.run("sphere", "--class", 2, "--size", 130, "-o", "large.nrrd")
        cls.programs.run("convert", "large.nrrd", "large.ome.zarr")
        _, cls.endpoint = cls.programs.up("--data", "a=a.nrrd", "--data", "b=b.nrrd", "--data", "c=b.nrrd,labels=labels.nrrd:names.txt", "--data", "levels=large.ome.zarr", "--data", "channels=channels",
                                          "--data", "times=times.npy")
        cls.process, cls.gateway = cls.programs.gateway("--endpoint", cls.endpoint)
        wait_until(lambda: cls.gateway.request("/readyz")[0] == 200, "ready")

    def page(self, **more):
        page = Page(self.gateway, **more)
        self.addCleanup(page.close)
        return page

    def get(self, path, **fields):
        return self.gateway.request(path + "?" + urllib.parse.urlencode(fields, doseq=True))


class UploadTest(WithService):
    """Files that pages send."""

    def post(self, body=b"", **fields):
        status, _, answer = self.gateway.request("/api/v1/upload?" + urllib.parse.urlencode(fields), method="POST", body=body)
        return status, json.loads(answer)

    def send(self, name, data, part=1 << 20):
        status, begun = self.post(file=name, bytes=len(data))
        self.assertEqual(status, 200, begun)
        for begin in range(0, len(data), part):
            status, answer = self.post(data[begin:begin + part], upload=begun["upload"], begin=begin)
            if status != 200:
                return status, answer
            self.assertEqual(answer["received"], min(begin + part, len(data)))
        self.assertEqual(answer["dataset"], begun["dataset"])
        return begun["upload"], begun["dataset"]

    def read(self, name):
        return (self.programs.folder / name).read_bytes()

    def names(self):
        return {dataset["name"] for dataset in self.gateway.json("/api/v1/datasets")[1]["datasets"]}

    def test_a_file_is_a_dataset_until_it_is_dropped(self):
        noise = random.Random(3).randbytes(128 ** 3)  # more than what may be under way at a time
        (self.programs.folder / "noise.nrrd").write_bytes(b"NRRD0004\ntype: uint8\ndimension: 3\nsizes: 128 128 128\nencoding: raw\n\n" + noise)
        upload, name = self.send("my noise (1).nrrd", self.read("noise.nrrd"), 300_000)
        self.assertEqual(name, "my_noise_1_")
        self.assertEqual(self.gateway.json(f"/api/v1/value?dataset={name}&at=3,4,5")[1]["value"], noise[3 + 128 * (4 + 128 * 5)])
        second, other = self.send("../../my noise (1).nrrd", self.read("a.nrrd"))
        self.assertEqual(other, "_")
        again, third = self.send("a.nrrd", self.read("a.nrrd"))
        self.assertEqual(third, "a-2")
        one, same = (png_pixels(self.get("/api/v1/render.png", dataset=each, size=32)[2]) for each in ("a", third))
        self.assertEqual(one, same)
        for each in (upload, second, again):
            self.assertEqual(self.post(upload=each, drop="true"), (200, {}))
        wait_until(lambda: self.names() <= NAMES, "they are gone")
        self.assertEqual(self.get("/api/v1/render.png", dataset=name, size=16)[0], 404)
        status, answer = self.post(b"x", upload=upload, begin=0)
        self.assertEqual((status, "no such upload" in answer["error"]), (404, True))

    def test_a_mesh_is_a_shape_beside_the_volume(self):
        header = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
        meshes = [self.send(name, (header + f"{x} 0 0\n{x + 9} 0 0\n{x} 9 9\n3 0 1 2\n").encode()) for name, x in (("left.ply", 0), ("right.ply", 4))]
        wait_until(lambda: {each["name"] for each in self.gateway.json("/api/v1/datasets")[1]["datasets"] if each["is_shape"]} == {"left", "right"}, "they are listed as shapes")
        looks = ["left,color=red", "right,color=#0000ff,opacity=0.5"]
        status, _, by_query = self.get("/api/v1/render.png", dataset="a", size=32, fit="true", shape=looks)
        self.assertEqual(status, 200, by_query[:300])
        body = json.dumps({"dataset": "a", "size": 32, "fit": True, "shape": looks}).encode()
        status, _, by_body = self.gateway.request("/api/v1/render.png", method="POST", body=body)
        self.assertEqual(status, 200, by_body[:300])
        self.assertEqual(png_pixels(by_query), png_pixels(by_body))
        self.assertNotEqual(png_pixels(by_query), png_pixels(self.get("/api/v1/render.png", dataset="a", size=32, fit="true")[2]))
        self.assertIn("--shape", self.gateway.json("/api/v1/command?" + urllib.parse.urlencode({"dataset": "a", "shape": looks}, doseq=True))[1]["command"])
        # A corner of the volume, seen along +y; the triangles lie in the plane y = z.
        status, _, answer = self.get("/api/v1/pick", dataset="a", x=29.5, y=70.5, size=100, renderer="raycast", fit="false", azimuth=0,
                                     elevation=0, shape=["right", *looks])
        seen = json.loads(answer)
        self.assertEqual((status, seen["hit"], seen["shape"], seen["shape_number"], seen["shape_value"]), (200, True, "left", 1, None), answer)
        self.assertEqual(seen["voxel"], [3, 3, 3])
        self.assertAlmostEqual(seen["at"][1], seen["at"][2], 4)
        described = self.gateway.json("/api/v1/openapi.json")[1]
        self.assertIn("shape", [each.get("name") for each in described["paths"]["/api/v1/render.png"]["get"]["parameters"]])
        for look, sentence in (("left,colour=red", "must have one of: color, opacity"), ("nobody", "nobody"), ("a", "a")):
            status, _, answer = self.get("/api/v1/render.png", dataset="a", size=16, shape=look)
            self.assertIn(status, (400, 404), look)
            self.assertIn(sentence, json.loads(answer)["error"])
        for upload, _ in meshes:
            self.post(upload=upload, drop="true")

    def test_what_is_no_volume_is_refused_without_paths(self):
        upload, name = self.send("notes.nrrd", b"NRRD0004\nnonsense\n")
        status, body = self.gateway.json(f"/api/v1/histogram?dataset={name}")
        self.assertNotEqual(status, 200)
        self.assertIn("notes.nrrd", body["error"])
        self.assertNotIn("/tmp", body["error"])
        self.post(upload=upload, drop="true")

    def test_a_header_cannot_name_other_files(self):
        secret = self.programs.folder / "secret"
        secret.write_bytes(bytes(range(64)))
        for named in (str(secret), "../" + self.programs.folder.name + "/secret"):
            header = f"NRRD0004\ntype: uint8\ndimension: 3\nsizes: 4 4 4\nencoding: raw\ndata file: {named}\n".encode()
            upload, name = self.send("header.nhdr", header)
            status, body = self.gateway.json(f"/api/v1/histogram?dataset={name}")
            self.assertNotEqual(status, 200)
            self.assertRegex(body["error"], "another file, 'secret'")
            self.post(upload=upload, drop="true")

    def test_limits(self):
        self.assertEqual(self.post(file="a.nii", bytes=0)[0], 400)
        self.assertEqual(self.post(file="a.nii", bytes="x")[0], 400)
        status, answer = self.post(file="a.nii", bytes=(1 << 30) + 1)
        self.assertEqual((status, "--max-upload" in answer["error"]), (413, True))
        self.assertEqual(self.gateway.request("/api/v1/upload?file=a&bytes=1", method="POST", body=b"", token=False)[0], 401)
        self.assertEqual(self.gateway.request("/api/v1/upload?file=a&bytes=1")[0], 405)
        _, begun = self.post(file="a.nii", bytes=10)
        for begin, body in ((1, b"a"), (0, b"a" * 11), (11, b"")):
            self.assertEqual(self.post(body, upload=begun["upload"], begin=begin)[0], 400, begin)
        self.assertEqual(self.post(b"abc", upload=begun["upload"], begin=0), (200, {"received": 3}))
        self.assertEqual(self.post(b"abc", upload=begun["upload"], begin=0), (200, {"received": 3}), "its answer was lost")
        self.post(upload=begun["upload"], drop="true")
        _, none = self.programs.gateway("--endpoint", self.endpoint, "--max-upload", "0")
        self.assertEqual(none.request("/api/v1/upload?file=a&bytes=1", method="POST", body=b"")[0], 403)

    def test_files_go_with_their_gateway(self):
        child, gateway = self.programs.gateway("--endpoint", self.endpoint)
        data = self.read("a.nrrd")
        wait_until(lambda: gateway.request("/readyz")[0] == 200, "ready")
        begun = gateway.json(f"/api/v1/upload?file=gone.nrrd&bytes={len(data)}", method="POST", body=b"")[1]
        self.assertEqual(gateway.json(f"/api/v1/upload?upload={begun['upload']}&begin=0", method="POST", body=data)[1]["dataset"], "gone")
        wait_until(lambda: "gone" in self.names(), "it is there")
        child.kill()
        child.wait()
        self.programs.end(child)
        wait_until(lambda: "gone" not in self.names(), "it is gone")


class HttpTest(WithService):
    def test_pictures_are_the_files_of_the_command_line(self):
        cases = [
            ("render", {"size": "40x30"}),
            ("render", {"azimuth": "-30.5", "elevation": 20, "zoom": 1.5, "renderer": "raycast", "sampling-rate": 2}),
            ("render", {"renderer": "mip", "projection": "perspective", "fov": 40, "background": "#102030"}),
            ("render", {"renderer": "zbuffer", "isovalue": "1:red:1", "light": ["1,0,0", "0,1,1"], "depth": 16}),
            ("render", {"renderer": "raycast", "isovalue": "1:blue:0.5", "clip-box": ":,:,0:", "clip-plane": ["1,0,0,5", "0,-1,0,5"]}),
            ("render", {"transfer": "opaque", "scalar-range": "10%:90%", "decomposition": "kd-tree", "combine": "tree:2"}),
            ("render", {"eye": "-40,-50,10", "look-at": "1,2,3", "up": "0,1,1", "shading": "none", "termination": 0}),
            ("slice", {"plane": "zyx"}),
            ("slice", {"plane": "x", "index": 3, "window": 2, "level": 1, "background": "white"}),
            ("render", {"size": 200, "color-bar": "true", "brightness": 0.5, "transfer": "viridis"}),
            ("render", {"size": 200, "color-bar": "Density, kg/m³", "title": "Both", "scale-bar": "true", "transfer": "auto", "renderer": "raycast",
                        "isovalue": "1:blue:0.5", "legend": "true"}),
            ("render", {"size": 200, "axes": "grid", "background": "white", "azimuth": 30}),
            ("slice", {"size": 160, "plane": "zyx", "color-bar": "T", "title": "Planes", "scale-bar": "true", "orientation-marker": "true"}),
            ("slice", {"size": 160, "label-mode": "tint", "legend": "true", "dataset": "c"}),
            ("render", {"dataset": "channels", "channel": "1", "channel-color": "1=green,0=#f0f", "channel-range": "1=0:30"}),
            ("render", {"dataset": "channels", "channel": ["1"], "channel-transfer": "1=opaque", "channel-opacity": "1=0.5", "blend": "add"}),
            ("slice", {"dataset": "channels", "size": 160, "plane": "zyx", "channel": 0, "channel-gamma": "0=0.5", "color-bar": "true"}),
            ("render", {"dataset": "channels", "size": 160, "channel": "0,1", "color-bar": "true", "legend": "true"}),
            ("render", {"dataset": "times", "time": "last", "transfer": "opaque"}),
        ]
        for kind, options in cases:
            with self.subTest(kind=kind, **{k.replace("-", "_"): v for k, v in options.items()}):
                options = {"size": "48", "dataset": "a", **options}
                arguments = [f"--{name}={value}" for name, values in options.items() if name != "dataset" for value in (values if isinstance(values, list) else [values])]
                self.programs.run(kind, options["dataset"], "--endpoint", self.endpoint, "-o", "file.png", *arguments)
                file = (self.programs.folder / "file.png").read_bytes()
                status, headers, body = self.get(f"/api/v1/{kind}.png", **options)
                self.assertEqual(status, 200, body)
                self.assertEqual(headers["Content-Type"], "image/png")
                self.assertEqual(body, file)
                posted = self.gateway.request(f"/api/v1/{kind}.png", method="POST", body=json.dumps(options))
                self.assertEqual(posted[2], file)

    def test_other_endings_make_other_files(self):
        options = {"dataset": "a", "size": 60, "dpi": 200, "font-size": 9.5, "title": "A", "quality": 70, "background": "white"}
        arguments = [f"--{name}={value}" for name, value in options.items() if name != "dataset"]
        for ending, media in (("jpg", "image/jpeg"), ("webp", "image/webp"), ("tif", "image/tiff"), ("exr", "image/x-exr"),
                              ("pdf", "application/pdf"), ("svg", "image/svg+xml")):
            with self.subTest(ending=ending):
                self.programs.run("render", "a", "--endpoint", self.endpoint, "-o", f"file.{ending}", *arguments)
                status, headers, body = self.get(f"/api/v1/render.{ending}", **options)
                self.assertEqual((status, headers["Content-Type"]), (200, media))
                if ending != "svg":  # cairo counts the parts of its pictures in a process, and names them by their numbers
                    self.assertEqual(body, (self.programs.folder / f"file.{ending}").read_bytes())
        self.assertTrue(self.get("/api/v1/slice.pdf", dataset="a", size=40, plane="zyx")[2].startswith(b"%PDF"))
        self.assertEqual(self.get("/api/v1/render.gif", dataset="a")[0], 404)
        status, body = self.gateway.json("/api/v1/render.webp?dataset=a&size=16384x10")
        self.assertEqual((status, body["error"]), (400, "--size 16384x10 is too large for .webp, which has at most 16383 pixels a side"))

    def test_a_colour_bar_has_a_caption_or_none(self):
        options = {"dataset": "a", "size": 200}
        plain, bare, named = (self.get("/api/v1/render.png", **options, **bar)[2] for bar in ({}, {"color-bar": ""}, {"color-bar": "K"}))
        self.assertEqual(self.get("/api/v1/render.png", **options, **{"color-bar": "false"})[2], plain)
        for value, same in ((True, bare), (False, plain), ("K", named), ("", bare)):
            body = json.dumps({**options, "color-bar": value})
            self.assertEqual(self.gateway.request("/api/v1/render.png", method="POST", body=body)[2], same, value)
        self.assertEqual(len({plain, bare, named}), 3)
        _, command = self.gateway.json("/api/v1/command?" + urllib.parse.urlencode({**options, "color-bar": "K", "legend": "true"}))
        self.assertIn("--color-bar=K --legend", command["command"])

    def test_a_color_map_may_be_sent(self):
        color_map = [{"Name": "m", "RGBPoints": [0, 0, 0, 1, 5, 1, 1, 0], "Points": [0, 0, 0.5, 0, 5, 1, 0.5, 0]}]
        (self.programs.folder / "map.json").write_text(json.dumps(color_map))
        self.programs.run("render", "a", "--endpoint", self.endpoint, "--size=32", "--transfer=map.json", "-o", "file.png")
        file = (self.programs.folder / "file.png").read_bytes()
        body = json.dumps({"dataset": "a", "size": 32, "transfer": color_map})
        self.assertEqual(self.gateway.request("/api/v1/render.png", method="POST", body=body)[2], file)
        status, command = self.gateway.json("/api/v1/command", method="POST", body=body)
        self.assertEqual(status, 200)
        self.assertIn("--transfer color-map.json", command["command"])
        self.assertIn("RGBPoints", command["files"]["color-map.json"])
        # A number that is said replaces that of the map's material, even if it is the standard one.
        shiny = [{**color_map[0], "Material": {"ambient": 0.7}}]
        pixels = lambda **said: png_pixels(self.gateway.request("/api/v1/render.png", method="POST", body=json.dumps({"dataset": "a", "size": 32, "transfer": shiny, **said}))[2])
        self.assertNotEqual(pixels(), png_pixels(file))
        self.assertEqual(pixels(ambient=0.2), png_pixels(file))

    def test_the_command_makes_the_picture(self):
        options = {"dataset": "a", "azimuth": 33, "size": "32x24", "title": "it's", "clip-box": "-3:3,:,:"}
        _, command = self.gateway.json("/api/v1/command?" + urllib.parse.urlencode(options))
        line = command["command"].replace("slabstream", str(PROGRAMS / "slabstream"), 1) + f" --endpoint {self.endpoint}"
        subprocess.run(["bash", "-c", line], cwd=self.programs.folder, env=self.programs.environment, check=True, capture_output=True)
        self.assertEqual((self.programs.folder / "picture.png").read_bytes(), self.get("/api/v1/render.png", **options)[2])

    def test_errors_say_what_the_command_line_says(self):
        for fields, status, why in [
            ({"dataset": "a", "azimuth": "x"}, 400, "--azimuth 'x' is not a number"),
            ({"dataset": "a", "size": "100000"}, 400, "out of range"),
            ({"dataset": "a", "what": "1"}, 400, "there is no option 'what'"),
            ({"dataset": "a", "transfer": "/etc/passwd"}, 400, "--transfer"),
            ({"dataset": "a", "camera": "c.json"}, 400, "no option"),
            ({"dataset": "a", "view": "top", "azimuth": 1}, 400, "excludes"),
            ({"size": 32}, 400, "dataset is missing"),
            ({"dataset": "none"}, 404, "none"),
        ]:
            got, body = self.gateway.json("/api/v1/render.png?" + urllib.parse.urlencode(fields))
            self.assertEqual((got, list(body)), (status, ["error"]), body)
            self.assertIn(why, body["error"])
            self.assertNotIn("\n", body["error"])
        self.assertEqual(self.gateway.request("/nothing")[0], 404)
        self.assertEqual(self.gateway.request("/api/v1/status", method="DELETE")[0], 405)
        self.assertEqual(self.gateway.request("/api/v1/datasets", method="POST", body="{}")[0], 405)
        self.assertEqual(self.gateway.request("/api/v1/render.png", method="POST", body="{")[0], 400)
        self.assertEqual(self.gateway.request("/api/v1/view")[0], 426)

    def datasets_with(self, loaded):
        """The catalogue by name, once the gateway knows that this dataset is loaded."""
        listed = lambda: {d["name"]: d for d in self.gateway.json("/api/v1/datasets")[1]["datasets"]}  # noqa: E731
        wait_until(lambda: listed()[loaded]["state"] == "ready", f"{loaded} is loaded")
        return listed()

    def test_what_the_service_has(self):
        self.get("/api/v1/render.png", dataset="a", size=16)
        datasets = self.datasets_with("a")
        self.assertEqual(set(datasets), NAMES)
        self.assertEqual(datasets["a"]["size"], [24, 24, 24])
        self.assertEqual([level["size"] for level in datasets["a"]["levels"]], [[24, 24, 24]])
        status, service = self.gateway.json("/api/v1/status")
        self.assertEqual((status, len(service["workers"])), (200, 2))

    def test_levels_are_chosen_and_told(self):
        pictures = {}
        for fields in ({"level": 0}, {"level": 1}, {"level": 2}, {"detail": 0.1}, {"detail": 100}):
            status, _, pictures[str(fields)] = self.get("/api/v1/render.png", dataset="levels", size=64, renderer="raycast", **fields)
            self.assertEqual(status, 200)
        pixels = {name: png_pixels(picture) for name, picture in pictures.items()}
        self.assertEqual(pixels["{'detail': 0.1}"], pixels["{'level': 0}"])
        self.assertEqual(pixels["{'detail': 100}"], pixels["{'level': 2}"])
        self.assertEqual(len({picture[2] for picture in pixels.values()}), 3)
        self.assertIn(b'"levels":[2]', pictures["{'level': 2}"], "the record tells the level")
        levels = self.datasets_with("levels")["levels"]["levels"]
        self.assertEqual([level["size"] for level in levels], [[130] * 3, [65] * 3, [33] * 3])
        self.assertEqual(levels[0]["voxel_bytes"], 130**3)
        for fields, said in (({"level": 3}, "has levels 0 to 2"), ({"level": "x"}, "level"), ({"detail": -1}, "detail")):
            status, _, body = self.get("/api/v1/render.png", dataset="levels", size=64, **fields)
            self.assertEqual(status, 400)
            self.assertIn(said, json.loads(body)["error"])

    def ask(self, question, **fields):
        status, body = self.gateway.json(f"/api/v1/{question}?" + urllib.parse.urlencode(fields))
        self.assertEqual(status, 200, body)
        return body

    def test_the_histogram_counts_every_voxel(self):
        histogram = self.ask("histogram", dataset="a")
        self.assertEqual((histogram["dataset"], len(histogram["counts"]), sum(histogram["counts"])), ("a", 256, 24 ** 3))
        low, high = histogram["range"]
        self.assertEqual(low, 0)
        self.assertTrue(128 <= high <= 255)
        self.assertEqual(histogram["non_finite"], 0)
        percentiles = histogram["percentiles"]
        self.assertEqual({"1", "50", "99", "99.9"} - set(percentiles), set())
        values = [percentiles[key] for key in sorted(percentiles, key=float)]
        self.assertEqual(values, sorted(values))
        info = json.loads(self.programs.run("info", "a.nrrd", "--json").stdout)
        self.assertEqual(histogram["counts"], info["histogram"])

    def test_channels_and_times_are_told_and_asked_about(self):
        for field, value in (("0", 10), ("1", 20)):
            self.assertEqual(self.ask("histogram", dataset="channels", field=field)["range"], [value, value])
            self.assertEqual(self.ask("value", dataset="channels", field=field, at="4,4,4")["value"], value)
            self.assertEqual(self.ask("statistics", dataset="channels", field=field)["mean"], value)
        for time, value in (("0", 1), ("1", 2), ("last", 3)):
            self.assertEqual(self.ask("histogram", dataset="times", time=time)["range"], [value, value])
            profile = self.ask("profile", **{"dataset": "times", "time": time, "from": "0,0,0", "to": "1,0,0", "samples": 2})
            self.assertEqual(profile["values"], [value, value])
        self.assertEqual(self.ask("histogram", dataset="times")["range"], [1, 3], "of all times, as pictures are drawn")
        channels = self.datasets_with("channels")["channels"]
        self.assertEqual(channels["fields"], 2 * [{"name": "", "channel": True, "labels": False, "shown": True}])
        self.assertEqual((channels["times"], channels["field"], channels["time"]), ({"count": 1}, 0, 0))
        self.assertEqual(self.datasets_with("times")["times"]["times"]["count"], 3)
        listed = self.programs.run("data", "list", "--endpoint", self.endpoint).stdout
        self.assertIn("channels 0, 1\n", listed)
        self.assertIn("    3 times", listed)
        shown = json.loads(self.get("/api/v1/transfer", dataset="channels", field="1", **{"transfer": "window"})[2])
        self.assertIn("RGBPoints", shown[0])

    def test_labels_have_their_names_and_colours(self):
        self.assertEqual(self.ask("labels", dataset="c"), {"dataset": "c", "labels": [
            {"value": 3, "name": "Corner \"low\"", "color": "#ff8000"}, {"value": 70, "name": "Größte Ecke", "color": "#0000ff"}], "complete": True})
        self.assertEqual(self.ask("labels", dataset="a"), {"dataset": "a", "labels": [], "complete": False})
        self.assertEqual(self.ask("value", dataset="c", at="19,19,19")["label"], {"value": 70, "name": "Größte Ecke"})

    def test_values_at_points(self):
        centre = self.ask("value", dataset="b", at="9.5,9.5,9.5")
        self.assertEqual((centre["inside"], centre["voxel"], centre["at"]), (True, [10, 10, 10], [9.5, 9.5, 9.5]))
        self.assertGreaterEqual(centre["value"], 128)
        self.assertNotIn("label", centre)
        self.assertEqual(self.ask("value", dataset="b", at="0,0,0")["value"], 0)
        outside = self.ask("value", dataset="b", at="-1,1e9,0")
        self.assertEqual((outside["inside"], outside["voxel"], outside["value"]), (False, None, None))

    def test_profiles_and_boxes(self):
        profile = self.ask("profile", **{"dataset": "b", "from": "-2.25,9.5,9.5", "to": "9.25,9.5,9.5", "samples": 24})
        self.assertEqual((profile["length"], profile["from"], profile["to"]), (11.5, [-2.25, 9.5, 9.5], [9.25, 9.5, 9.5]))
        self.assertEqual(len(profile["values"]), 24)
        self.assertEqual(profile["values"][:4], [None] * 4, "the volume begins at -0.5")
        for i, value in list(enumerate(profile["values"]))[4:]:  # every 0.5
            self.assertAlmostEqual(value, self.ask("value", dataset="b", at=f"{-2.25 + 0.5 * i},9.5,9.5")["interpolated"], 6)
        between = [self.ask("value", dataset="b", at=f"{x},9,9") for x in (3, 3.5, 4)]
        self.assertAlmostEqual(between[1]["interpolated"], (between[0]["value"] + between[2]["value"]) / 2, 9)

        joint = self.ask("joint-histogram", dataset="b")
        self.assertEqual((len(joint["counts"]), joint["range"]), (joint["values"] * joint["slopes"], self.ask("histogram", dataset="b")["range"]))
        self.assertEqual(sum(joint["counts"]), 18 ** 3, "of 20 voxels along each axis the outermost ones have no slope")
        self.assertGreater(joint["steepest"], 0)

        values = [self.ask("value", dataset="b", at=f"{x},9,{z}")["value"] for x in range(3, 7) for z in (9, 10)]
        box = self.ask("statistics", dataset="b", box="2.5:6,8.5:9.4,9:10")
        mean = sum(values) / len(values)
        self.assertEqual((box["voxels"], box["non_finite"], box["least"], box["largest"]), (8, 0, min(values), max(values)))
        self.assertAlmostEqual(box["mean"], mean, 9)
        self.assertAlmostEqual(box["deviation"], (sum((value - mean) ** 2 for value in values) / len(values)) ** 0.5, 9)
        self.assertEqual(self.ask("statistics", dataset="b")["voxels"], 20 ** 3, "without a box: all")
        empty = self.ask("statistics", dataset="b", box="100:101,0:1,0:1")
        self.assertEqual(empty, {"voxels": 0, "non_finite": 0, "mean": None, "deviation": None, "least": None, "largest": None})

    def test_labels_are_measured(self):
        found = self.ask("statistics", dataset="c", labels="true")
        self.assertEqual((found["unit"], [(each["value"], each["voxels"], each["volume"]) for each in found["labels"]]),
                         ("voxels^3", [(3, 64, 64), (70, 64, 64)]))
        corner = self.ask("statistics", dataset="c", box="0:3,0:3,0:3")
        self.assertEqual({name: found["labels"][0][name] for name in corner}, corner)
        self.assertEqual(found["labels"][0]["name"], 'Corner "low"')
        boxed = self.ask("statistics", dataset="c", labels="true", box="0:3,0:3,-0.5:0.5")
        self.assertEqual([each["voxels"] for each in boxed["labels"]], [16, 0])
        self.assertIsNone(boxed["labels"][1]["mean"])
        status, headers, body = self.get("/api/v1/statistics", dataset="c", labels="true", format="csv")
        self.assertEqual((status, headers["Content-Type"]), (200, "text/csv; charset=utf-8"))
        lines = list(csv.DictReader(io.StringIO(body.decode(), newline="")))
        self.assertEqual([(line["value"], line["name"], line["voxels"]) for line in lines],
                         [("3", 'Corner "low"', "64"), ("70", "Größte Ecke", "64")])
        self.assertEqual(float(lines[0]["mean"]), corner["mean"])

    def test_pixels_show_points(self):
        # The ball's surface, seen along +y: from its geometry by hand.
        from_above = {"dataset": "b", "renderer": "zbuffer", "size": 100, "fit": "false"}
        options = {**from_above, "azimuth": 0, "elevation": 0}
        hit = self.ask("pick", x=50, y=50, **options)
        self.assertTrue(hit["hit"] and hit["inside"])
        self.assertAlmostEqual(hit["at"][0], 9.5, 6)
        self.assertAlmostEqual(hit["at"][2], 9.5, 6)
        self.assertLess(hit["at"][1], 5)
        self.assertGreaterEqual(hit["value"], 128)
        self.assertEqual(hit["voxel"][1], round(hit["at"][1] + 0.25))
        posted = self.gateway.json("/api/v1/pick", method="POST", body=json.dumps({"x": 50, "y": 50, **options}))
        self.assertEqual(posted, (200, hit))
        self.assertEqual(self.ask("pick", x=0, y=0, **options), {"hit": False})
        self.assertEqual(hit["fields"], [{"name": "volume", "value": hit["value"]}])
        # Of a picture of two channels a point has the values of both.
        both = self.ask("pick", dataset="channels", x=50, y=50, size=100, renderer="mip", channel="0,1", azimuth=0, elevation=0)
        at = ",".join(map(str, both["at"]))
        self.assertEqual([field["name"] for field in both["fields"]], ["channel 0", "channel 1"])
        for number, field in enumerate(both["fields"]):
            self.assertEqual(self.ask("value", dataset="channels", at=at, field=number)["fields"], [field])
        self.assertEqual(self.ask("value", dataset="channels", at=at, field="0,1")["fields"], both["fields"])
        # The other renderers see about the same surface.
        for renderer in ("raycast", "splat"):
            other = self.ask("pick", x=50, y=50, transfer="opaque", **(options | {"renderer": renderer}))
            self.assertAlmostEqual(other["depth"], hit["depth"], delta=1, msg=renderer)
        # A view from above picks by the same camera as the picture.
        above = self.ask("pick", x=50, y=50, view="top", **from_above)
        self.assertAlmostEqual(above["at"][0], 9.5, 6)
        self.assertGreater(above["at"][2], 14)

    def test_transfer_is_what_the_command_line_prints(self):
        for preset in ("auto", "opaque", "gray-ramp"):
            body = self.get("/api/v1/transfer", dataset="a", transfer=preset)[2].decode()
            self.assertEqual(body, self.programs.run("transfer", preset, "a.nrrd").stdout)
        body = self.get("/api/v1/transfer", **{"dataset": "a", "transfer": "opaque", "scalar-range": "10:20"})[2].decode()
        self.assertEqual(body, self.programs.run("transfer", "opaque", "a.nrrd", "--scalar-range", "10:20").stdout)

    def test_wrong_questions_are_refused_with_a_line(self):
        for question, fields, status, why in [
            ("histogram", {}, 400, "dataset is missing"),
            ("histogram", {"dataset": "none"}, 404, "none"),
            ("histogram", {"dataset": "a", "size": 3}, 400, "no option 'size'"),
            ("labels", {"dataset": "none"}, 404, "none"),
            ("labels", {"dataset": "a", "value": 3}, 400, "no option 'value'"),
            ("value", {"dataset": "a"}, 400, "at is missing"),
            ("value", {"dataset": "a", "at": "1,2"}, 400, "1,2"),
            ("value", {"dataset": "a", "at": "1,2,nan"}, 400, "nan"),
            ("value", {"dataset": "x" * 300, "at": "1,2,3"}, 400, "300 bytes"),
            ("profile", {"dataset": "a", "from": "0,0,0"}, 400, "to is missing"),
            ("profile", {"dataset": "a", "from": "0,0,0", "to": "1,1,1", "samples": 1}, 400, "samples"),
            ("joint-histogram", {"dataset": "nonesuch"}, 404, "nonesuch"),
            ("statistics", {"dataset": "a", "labels": "maybe"}, 400, "labels 'maybe' is neither true nor false"),
            ("histogram", {"dataset": "channels", "field": "2"}, 400, "has no field '2': it has 0, 1"),
            ("value", {"dataset": "times", "time": "3", "at": "0,0,0"}, 400, "time is '3', but dataset \"times\" has times 0 to 2"),
            ("histogram", {"dataset": "a", "field": "x" * 300}, 400, "field or time has 300 bytes, at most 256 are possible"),
            ("statistics", {"dataset": "a", "format": "csv"}, 400, "format 'csv' is the table of labels"),
            ("statistics", {"dataset": "a", "labels": "true"}, 400, "has no labels"),
            ("statistics", {"dataset": "a", "box": "1:0,0:1,0:1"}, 400, "box"),
            ("statistics", {"dataset": "nonesuch", "box": "0:1,0:1,0:1"}, 404, "nonesuch"),
            ("pick", {"dataset": "a", "x": 1}, 400, "y is missing"),
            ("pick", {"dataset": "a", "x": 33, "y": 1, "size": 32}, 400, "out of range"),
            ("pick", {"dataset": "a", "x": 3, "y": 1, "zoom": -1}, 400, "zoom"),
            ("value", {"dataset": "a", "at": "0,0,0", "field": ",".join("0" * 17)}, 400, "channels"),
            ("transfer", {"dataset": "a", "transfer": "nothing"}, 400, "nothing"),
            ("transfer", {"dataset": "a", "azimuth": 3}, 400, "azimuth"),
        ]:
            got, body = self.gateway.json(f"/api/v1/{question}?" + urllib.parse.urlencode(fields))
            self.assertEqual((got, list(body)), (status, ["error"]), (question, fields, body))
            self.assertIn(why, body["error"])
            self.assertNotIn("\n", body["error"])
        self.assertEqual(self.gateway.request("/api/v1/histogram", method="POST", body="{}")[0], 405)

    def test_an_option_is_given_once(self):
        for target, body in (("/api/v1/command?dataset=a&size=20&size=30", None), ("/api/v1/command", '{"dataset": "a", "size": 20, "size": 30}'),
                             ("/api/v1/command?size=20", '{"dataset": "a", "size": 30}'), ("/api/v1/pick?dataset=a&x=1&x=2&y=3", None)):
            status, answer = self.gateway.json(target, **({} if body is None else {"method": "POST", "body": body}))
            self.assertEqual(status, 400, (target, body, answer))

    def test_a_render_that_nobody_waits_for_is_cancelled(self):
        heavy = {"dataset": "a", "renderer": "raycast", "sampling-rate": 16, "size": 4000, "opacity-distance": 1000, "termination": 0}
        def status():
            return json.loads(self.programs.run("status", "--endpoint", self.endpoint, "--json").stdout)

        before = status()["frames_done"]
        for _ in range(3):
            with self.gateway.connect() as connection:
                target = "/api/v1/render.png?" + urllib.parse.urlencode(heavy)
                connection.sendall(f"GET {target} HTTP/1.1\r\nHost: {self.gateway.authority}\r\nAuthorization: Bearer {self.gateway.token}\r\n\r\n"
                                   .encode())
        wait_until(lambda: b'slabstream_gateway_refusals_total{reason="gone"} 3\n' in self.gateway.request("/metrics")[2], "three are gone")
        wait_until(lambda: status()["running"] + status()["queued"] == 0, "nothing runs")
        self.assertEqual((status()["frames_done"], status()["frames_failed"]), (before, 0))
        self.assertEqual(self.get("/api/v1/render.png", dataset="a", size=16)[0], 200)

    def test_only_who_has_the_token_may_ask(self):
        for path in ("/metrics", "/api/v1/datasets", "/api/v1/status", "/api/v1/render.png?dataset=a", "/api/v1/view"):
            self.assertEqual(self.gateway.request(path, token=False)[0], 401, path)
            self.assertEqual(self.gateway.request(path, token=False, headers={"Authorization": "Bearer wrong"})[0], 401)
        for path in ("/", "/assets/page.js", "/livez", "/readyz", "/api/v1/openapi.json"):
            status, headers, _ = self.gateway.request(path, token=False)
            self.assertEqual(status, 200, path)
            self.assertNotIn("unsafe", headers["Content-Security-Policy"])
            self.assertEqual(headers["X-Content-Type-Options"], "nosniff")
        path = "/api/v1/datasets?token="
        self.assertEqual(self.gateway.request(path + self.gateway.token, token=False)[0], 200)
        self.assertEqual(self.gateway.request(path + self.gateway.token[:-1], token=False)[0], 401)

    def test_the_page_is_compressed_for_those_who_take_that(self):
        for path in ("/", "/assets/page.js", "/assets/page.css", "/assets/icon.svg"):
            whole_file = self.gateway.request(path, headers={"Accept-Encoding": "identity"})[2]
            for accepted, packed in (("gzip", True), ("deflate, gzip;q=1.0, *;q=0.5", True), ("GZIP", True), ("*", True), ("br", False), ("identity", False),
                                     ("gzip;q=0", False), ("*, gzip ; q=0.000", False), ("", False), ("gzip;q=0.001", True)):
                for method in ("GET", "HEAD"):
                    status, headers, body = self.gateway.request(path, method=method, headers={"Accept-Encoding": accepted})
                    self.assertEqual(
                        (status, headers["Vary"], headers["Content-Encoding"]),
                        (200, "Accept-Encoding, Origin", "gzip" if packed else None),
                        accepted,
                    )
                    if method == "GET":
                        self.assertEqual(len(body), int(headers["Content-Length"]))
                        self.assertEqual(gzip.decompress(body) if packed else body, whole_file)
                        length = len(body)
                    else:
                        self.assertEqual((body, int(headers["Content-Length"])), (b"", length))
        total = sum(len(self.gateway.request(path, headers={"Accept-Encoding": "gzip"})[2]) for path in ("/", "/assets/page.js", "/assets/page.css"))
        self.assertLess(total, 150_000)

    def test_the_page_uses_relative_addresses_only(self):
        for path in ("/", "/assets/page.js", "/assets/page.css"):
            text = self.gateway.request(path)[2].decode().replace("http://www.w3.org/2000/svg", "")  # a name, not an address
            self.assertIsNone(re.search(r"""(src|href)=["']/|["']/api|https?://""", text), path)
            self.assertNotRegex(text, r"<script>|\son\w+=|style=")

    def test_foreign_names_and_pages_are_refused(self):
        own = self.gateway.authority
        port = own.rsplit(":")[-1]
        for headers, status in [
            ({"Host": own}, 200), ({"Host": "localhost:" + port}, 200), ({"Host": "localhost:1"}, 200), ({"Host": "evil.example"}, 403),
            ({"Host": "127.0.0.1.evil.example"}, 403), ({"Host": f"127.0.0.1:{port}.evil.example"}, 403),
            ({"Host": "localhost:evil.example"}, 403), ({"Host": f"[::1]:{port}.evil.example"}, 403), ({"Host": "127.0.0.1:65536"}, 403),
            ({"Host": "[::1]:1"}, 200), ({"Origin": "http://" + own}, 200), ({"Origin": "http://evil.example"}, 403),
            ({"Origin": "null"}, 403), ({"Origin": "https://" + own}, 403), ({"Origin": "http://localhost:1"}, 200)]:
            self.assertEqual(self.gateway.request("/livez", headers=headers)[0], status, headers)
            if status == 200:
                self.page(headers=headers).close()
            else:
                with self.assertRaisesRegex(Refused, "403"):
                    Page(self.gateway, headers=headers)
        self.assertIn(b" 403 ", self.gateway.raw(b"GET / HTTP/1.1\r\nConnection: close\r\n\r\n"))  # no Host
        for twice in (f"Host: {own}\r\nHost: evil.example", f"Host: {own}\r\nHost: {own}", f"Host: {own}\r\nOrigin: http://{own}\r\nOrigin: http://evil.example"):
            self.assertIn(b" 400 ", self.gateway.raw(f"GET /livez HTTP/1.1\r\n{twice}\r\nConnection: close\r\n\r\n".encode()), twice)
        with self.assertRaisesRegex(Refused, "401"):
            Page(self.gateway, protocols=["slabstream.view.v1"])
        with self.assertRaisesRegex(Refused, "400"):
            Page(self.gateway, protocols=["slabstream.token." + self.gateway.token])

    def test_pages_of_other_origins_ask_as_browsers_want_it(self):
        def allowed(answer):
            return {name.lower(): value for name, value in answer[1].items() if name.lower().startswith("access-control-")}

        wanted = {"Access-Control-Request-Method": "POST", "Access-Control-Request-Headers": "authorization,content-type"}
        for path in ("/api/v1/render.png", "/api/v1/upload", "/assets/page.js", "/"):
            answer = self.gateway.request(path, method="OPTIONS", token=False, headers={"Origin": "http://localhost:5173", **wanted})
            self.assertEqual((answer[0], answer[2], answer[1]["Vary"]), (204, b"", "Origin"), path)
            self.assertEqual(
                allowed(answer),
                {
                    "access-control-allow-origin": "http://localhost:5173",
                    "access-control-allow-methods": "GET, HEAD, POST",
                    "access-control-allow-headers": "Authorization, Content-Type",
                    "access-control-max-age": "600",
                    "access-control-expose-headers": "Slabstream-Renderer",
                },
            )
        mine, foreign = {"Origin": "http://127.0.0.1:5173"}, {"Origin": "https://evil.example"}
        self.assertEqual(self.gateway.request("/nothing", method="OPTIONS", headers={**mine, **wanted})[0], 404)
        self.assertEqual(self.gateway.request("/api/v1/status", method="OPTIONS")[0], 405)
        # A page may read its answers, also those that refuse it.
        for path, token, status in (
            ("/api/v1/status", True, 200),
            ("/api/v1/status", False, 401),
            ("/api/v1/render.png?dataset=none", True, 404),
            ("/assets/page.js", False, 200),
            ("/nothing", True, 404),
        ):
            answer = self.gateway.request(path, token=token, headers=mine)
            self.assertEqual((answer[0], answer[1]["Access-Control-Allow-Origin"]), (status, mine["Origin"]), path)
            self.assertIn("Origin", answer[1]["Vary"])
            # Other pages get nothing, and caches keep what they got for nobody else.
            for method in ("GET", "OPTIONS"):
                answer = self.gateway.request(path, method=method, headers={**foreign, **wanted})
                self.assertEqual((answer[0], allowed(answer), answer[1]["Vary"]), (403, {}, "Origin"), path)
                self.assertEqual(
                    json.loads(answer[2])["error"], "Origin 'https://evil.example' is another site; --origin names those that may ask"
                )
            self.assertEqual(allowed(self.gateway.request(path, token=token)), {})
        self.page(headers=mine).close()

    def test_hostile_requests(self):
        host = f"Host: {self.gateway.authority}\r\n".encode()
        for data, status in [
            (b"GET / HTTP/1.1\r\n" + host + b"X: " + b"x" * 40000 + b"\r\n\r\n", b" 431 "),
            (b"POST /api/v1/render.png HTTP/1.1\r\n" + host + b"Content-Length: 2000000\r\n\r\n" + b" " * 70000, b" 413 "),
            (b"\x00\x01\x02\r\n\r\n", b" 400 "),
            (b"GET /%zz?a=% HTTP/1.1\r\nConnection: close\r\n" + host + b"\r\n", b" 400 "),
            (b"GET /../../etc/passwd HTTP/1.1\r\nConnection: close\r\n" + host + b"\r\n", b" 404 "),
            (b"GET / HTTP/1.1\r\n" + host + b"Content-Length: -1\r\n\r\n", b" 400 "),
        ]:
            self.assertIn(status, self.gateway.raw(data).split(b"\r\n")[0], data[:60])
        seed = random.randrange(1 << 30)
        chance = random.Random(seed)
        whole_request = b"GET /api/v1/view HTTP/1.1\r\n" + host + b"Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n\r\n"
        for _ in range(100):
            altered = bytearray(whole_request)
            for _ in range(chance.randrange(1, 6)):
                altered[chance.randrange(len(altered))] = chance.randrange(256)
            with self.gateway.connect() as connection:
                connection.sendall(altered)
        self.assertEqual(self.gateway.request("/livez")[0], 200, f"seed {seed}")

    def test_the_document_fits_the_server(self):
        document = self.gateway.json("/api/v1/openapi.json")[1]
        self.assertEqual(document["openapi"], "3.0.3")
        for path, methods in document["paths"].items():
            for method, operation in methods.items():
                status, _, _ = self.gateway.request(path, method=method.upper(), token=False)
                self.assertEqual(status, 200 if operation.get("security") == [] else 401, (path, method))
                status, headers, body = self.gateway.request(path, method=method.upper(), body="{}" if method == "post" else None)
                self.assertIn(str(status), operation["responses"], path)
                self.assertIn(headers["Content-Type"].split(";")[0], operation["responses"][str(status)]["content"])
            for method in {"get", "post"} - methods.keys():
                self.assertEqual(self.gateway.request(path, method=method.upper(), body="{}")[0], 405, (path, method))
        for kind in ("render", "slice"):
            operations = document["paths"][f"/api/v1/{kind}.png"]
            names = [parameter["name"] for parameter in operations["get"]["parameters"]]
            self.assertEqual(sorted(names), sorted(operations["post"]["requestBody"]["content"]["application/json"]["schema"]["properties"]))
            for name in names:  # each is known: a wrong value is what is complained about
                _, body = self.gateway.json(f"/api/v1/{kind}.png?{name}=%01&dataset=none")
                self.assertNotIn("there is no option", body["error"], name)

    def test_metrics_are_in_prometheus_form(self):
        self.get("/api/v1/render.png", dataset="a", size=16)
        status, _, body = self.gateway.request("/metrics")
        self.assertEqual(status, 200)
        text = body.decode()
        families, seen = {}, set()
        for line in text.rstrip("\n").split("\n"):
            if line.startswith("# TYPE "):
                _, _, name, kind = line.split(" ")
                self.assertNotIn(name, families)
                families[name] = kind
            elif not line.startswith("# HELP "):
                match = re.fullmatch(r'([a-z_]+)(\{(?:[a-z]+="[^"\\\n]*",?)+\})? ([-+0-9.e]+)', line)
                self.assertIsNotNone(match, line)
                self.assertNotIn(match[1] + (match[2] or ""), seen)
                seen.add(match[1] + (match[2] or ""))
                base = re.sub("_(bucket|sum|count)$", "", match[1])
                self.assertTrue(match[1] in families or families.get(base) == "histogram", line)
                float(match[3])
        counts = [int(n) for n in re.findall(r'gateway_stage_seconds_bucket\{stage="latency",le="[^"]+"\} (\d+)', text)]
        self.assertEqual(counts, sorted(counts))
        self.assertGreater(counts[-1], 0)
        self.assertRegex(text, "slabstream_service_workers 2\n")
        if shutil.which("promtool"):
            subprocess.run(["promtool", "check", "metrics"], input=text, text=True, check=True)


# What each request needs: a token at all, one that may change things, one for all datasets, both.
NONE, VIEW, STEER, WATCH, SEND = "none", "view", "steer", "watch", "send"
PICTURES = [f"/api/v1/{kind}.{ending}" for kind in ("render", "slice") for ending in ("png", "jpg", "webp", "tif", "exr", "pdf", "svg")]
QUESTIONS = [f"/api/v1/{name}" for name in ("histogram", "joint-histogram", "labels", "value", "profile", "statistics", "transfer")]
BOTH = [*PICTURES, "/api/v1/command", "/api/v1/pick", "/api/v1/turntable.mp4"]  # by GET and POST
RIGHTS = [("GET", path, NONE) for path in ("/livez", "/readyz", "/api/v1/openapi.json", "/api/v1/options")] + [
    ("GET", "/metrics", WATCH), ("POST", "/api/v1/parameters", STEER), ("POST", "/api/v1/upload", SEND)] + [
    ("GET", path, VIEW) for path in (*BOTH, *QUESTIONS, "/api/v1/access", "/api/v1/status", "/api/v1/datasets", "/api/v1/parameters", "/api/v1/view")] + [
    ("POST", path, VIEW) for path in BOTH]


class TokenTest(WithService):
    """What holders of tokens may do that expire, or that are for viewing or some datasets alone."""

    FIELDS = {"at": "1,1,1", "from": "0,0,0", "to": "1,1,1", "x": 3, "y": 3, "size": 16, "frames": 1, "file": "a.nrrd", "bytes": 10}
    TAKEN = {
        "value": ["at"],
        "profile": ["from", "to"],
        "pick": ["x", "y", "size"],
        "upload": ["file", "bytes"],
        "render": ["size"],
        "slice": ["size"],
        "turntable": ["size", "frames"],
    }

    def ask(self, gateway, path, method, dataset, in_body=False):
        """The status of a request that is right but for the token, and its error."""
        fields = {name: self.FIELDS[name] for name in self.TAKEN.get(path.split("/")[-1].split(".")[0], [])}
        if dataset and path not in ("/api/v1/upload", "/metrics", "/livez", "/readyz"):
            fields["dataset"] = dataset
        body = json.dumps(fields) if in_body else "" if method == "POST" else None
        target = path if in_body else path + "?" + urllib.parse.urlencode(fields)
        status, headers, answer = gateway.request(target, method=method, body=body)
        return status, json.loads(answer)["error"] if status in (401, 403, 404) else ""

    def test_every_request_wants_its_right(self):
        known = {
            (method.upper(), path) for path, methods in self.gateway.json("/api/v1/openapi.json")[1]["paths"].items() for method in methods
        }
        self.assertEqual(known - {(method, path) for method, path, _ in RIGHTS}, set(), "the test has every request")
        own, expired = self.gateway, self.gateway.holding(exp=int(time.time()))
        given = {own.holding(): {NONE, VIEW, STEER, WATCH, SEND}, own.holding(view_only=True): {NONE, VIEW, WATCH},
                 own.holding(datasets=["a"]): {NONE, VIEW, STEER}, own.holding(datasets=["a"], view_only=True): {NONE, VIEW}}
        for method, path, need in RIGHTS:
            asked = (method, path)
            for gateway, rights in given.items():
                status, why = self.ask(gateway, path, method, "a")
                if need in rights:
                    self.assertNotIn(status, (401, 403), asked)
                    self.assertEqual(status, self.ask(own, path, method, "a")[0], asked)
                else:
                    self.assertEqual(status, 403, asked)
                    self.assertRegex(why, "^the token is (view-only|for dataset a alone)$")
            self.assertEqual(self.ask(expired, path, method, "a")[0] == 401, need != NONE, asked)
            if need in (VIEW, STEER) and path not in ("/api/v1/access", "/api/v1/status", "/api/v1/datasets", "/api/v1/view"):
                for in_body in (False, True) if method == "POST" else (False,):
                    for other in ("b", "none"):  # whether there is one or not
                        self.assertEqual(
                            self.ask(own.holding(datasets=["a"]), path, method, other, in_body),
                            (404, "there is no such dataset"),
                            asked,
                        )
        upload = own.json("/api/v1/upload?file=x.nrrd&bytes=1", method="POST", body=b"")[1]["upload"]
        drop = f"/api/v1/upload?upload={upload}&drop=true"
        self.assertEqual(own.holding(view_only=True).json(drop, method="POST", body=b""), (403, {"error": "the token is view-only"}))
        self.assertEqual(own.json(drop, method="POST", body=b""), (200, {}))

    def test_other_datasets_are_not_told_of(self):
        holder = self.gateway.holding(datasets=["a", "gone"])
        self.get("/api/v1/histogram", dataset="b")  # the service knows it well
        names = lambda gateway, path: {each["name"] for each in gateway.json(path)[1]["datasets"]}  # noqa: E731
        for path in ("/api/v1/datasets", "/api/v1/status"):
            self.assertEqual((names(self.gateway, path) >= NAMES, names(holder, path)), (True, {"a"}), path)
        # The service's error would list its datasets.
        self.assertIn("the catalogue has a, b", self.gateway.json("/api/v1/histogram?dataset=gone")[1]["error"])
        for path in (
            "histogram?dataset=gone",
            "render.png?dataset=gone&size=16",
            "pick?dataset=gone&x=1&y=1",
            "turntable.mp4?dataset=gone&size=16&frames=1",
        ):
            self.assertEqual(holder.json("/api/v1/" + path), (404, {"error": "there is no such dataset"}), path)
        # No way to say it twice.
        for target, body in (("/api/v1/command?dataset=a&dataset=b", None), ("/api/v1/command?dataset=b", '{"dataset": "a"}'),
                             ("/api/v1/command?dataset=a", '{"dataset": "b"}'), ("/api/v1/command", '{"dataset": ["a", "b"]}'),
                             ("/api/v1/command", '{"dataset": "a", "dataset": "b"}'), ("/api/v1/command?%64ataset=b", None)):
            status, answer = holder.json(target, **({} if body is None else {"method": "POST", "body": body}))
            self.assertIn(status, (400, 404), (target, body, answer))

    def test_a_shape_is_a_dataset_in_every_spelling(self):
        corners = "1 1 1\n20 1 1\n1 20 18\n"
        (self.programs.folder / "secret.ply").write_text(
            "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n"
            "property list uchar int vertex_indices\nend_header\n" + corners + "3 0 1 2\n")
        self.programs.run("data", "add", f"secret={self.programs.folder}/secret.ply", "--endpoint", self.endpoint)
        both, one = self.gateway.holding(datasets=["a", "secret"]), self.gateway.holding(datasets=["a"])
        paths = [*PICTURES, "/api/v1/command", "/api/v1/pick", "/api/v1/turntable.mp4"]
        page = Page(one)
        self.addCleanup(page.close)
        for spelling in ("shape", "mesh", "lines", "points"):
            for name in ("secret", "none", "secret,color=red,opacity=0.5", "a,secret"):
                for path in paths:
                    fields = {"dataset": "a", spelling: name, **{key: self.FIELDS[key] for key in self.TAKEN.get(path.split("/")[-1].split(".")[0], [])}}
                    asked = path, fields
                    if "slice" in path:
                        fields["plane"] = "zyx"
                    answers = [one.json(path + "?" + urllib.parse.urlencode(fields)), one.json(path, method="POST", body=json.dumps(fields))]
                    if name == "a,secret" or "slice" in path and answers[0][0] == 400:
                        self.assertEqual([status for status, _ in answers], [400, 400], asked)
                    else:
                        self.assertEqual(answers, 2 * [(404, {"error": "there is no such dataset"})], asked)
            seq = page.view({"dataset": "a", "size": 16, spelling: "secret"})
            error = page.text("error", lambda error: error["seq"] == seq)  # noqa: B023
            self.assertEqual((error["code"], error["error"]), ("not found", "there is no such dataset"))
            for gateway in (both, self.gateway):
                self.assertEqual(gateway.request(f"/api/v1/render.png?dataset=a&size=16&{spelling}=secret")[0], 200)
        page.final(page.view({"dataset": "a", "size": 16}))

    def test_a_page_sees_what_its_token_shows(self):
        page = Page(self.gateway.holding(datasets=["a", "gone"]))
        self.addCleanup(page.close)
        self.assertEqual([each["name"] for each in page.text("status", lambda status: status["datasets"])["datasets"]], ["a"])
        page.final(page.view({"dataset": "a", "size": 16}))
        for name, why in (
            ("b", "there is no such dataset"),
            ("none", "there is no such dataset"),
            ("gone", "there is no such dataset"),
        ):
            seq = page.view({"dataset": name, "size": 16})
            error = page.text("error")
            self.assertEqual((error["seq"], error["error"]), (seq, why))
            seq = page.view({"dataset": name, "size": 16, "plane": "zyx"}, picture="slice")
            self.assertEqual(page.text("error", lambda error: error["seq"] == seq)["error"], why)
        page.final(page.view({"dataset": "a", "size": 16}))

    def test_it_ends_at_its_time_also_in_an_open_stream(self):
        until = int(time.time()) + 4
        holder = self.gateway.holding(exp=until)
        page = Page(holder)
        self.addCleanup(page.close)
        page.final(page.view({"dataset": "a", "size": 16}))
        with self.assertRaises(Closed) as closed:
            while time.time() < until + TIMEOUT:  # the status comes each second
                page.receive()
        self.assertGreaterEqual(time.time(), until)
        line = time.strftime("the token expired at %Y-%m-%dT%H:%M:%SZ", time.gmtime(until))
        self.assertEqual((closed.exception.code, closed.exception.reason), (4401, line))
        for path in ("/api/v1/status", "/api/v1/render.png?dataset=a"):
            status, headers, body = holder.request(path)
            self.assertEqual((status, headers["WWW-Authenticate"], json.loads(body)), (401, "Bearer", {"error": line}))
        with self.assertRaisesRegex(Refused, "401"):
            Page(holder)
        self.assertEqual(self.get("/api/v1/status")[0], 200)

    def test_a_token_that_is_wrong_gives_nothing(self):
        secret, hour = self.gateway.token, int(time.time()) + 3600
        token = signed(secret, {"exp": hour})
        missing = self.gateway.json("/api/v1/status", token=False)[1]["error"]
        def asked(token):
            return self.gateway.json("/api/v1/status", token=False, headers={"Authorization": "Bearer " + token})
        self.assertEqual(asked(token)[0], 200)
        self.assertEqual(self.gateway.request("/api/v1/status?token=" + token, token=False)[0], 200)
        unsigned = token.rsplit(".", 1)[0]
        for wrong in (
            unsigned,
            unsigned + ".",
            signed("x" * 22, {"exp": hour}),
            signed("", {"exp": hour}),
            token[:-1],
            token + "A",
            secret + "." + token,
            signed(secret, {"exp": hour}, {"alg": "none"}).rsplit(".", 1)[0] + ".",
        ):
            self.assertEqual(asked(wrong), (401, {"error": missing}), wrong)
        for claims, header, why in (
            ({}, None, "no claim exp"),
            ({"exp": hour}, {"alg": "none"}, "HS256"),
            ({"exp": hour}, {"typ": "JWT"}, "HS256"),
            ({"exp": hour}, {"alg": "HS256", "crit": ["exp"]}, "'crit'"),
            ({"exp": hour}, {"alg": "HS256", "crit": []}, "'crit'"),
            ({"exp": hour}, {"alg": "HS256", "b64": False}, "'b64'"),
            ([], None, "object"),
            ({"exp": str(hour)}, None, "'exp'"),
            ({"exp": hour, "datasets": "a"}, None, "'datasets'"),
            ({"exp": hour, "datasets": [1]}, None, "'datasets'"),
            ({"exp": hour, "view_only": 1}, None, "'view_only'"),
            ({"exp": hour, "nbf": hour}, None, "'nbf'"),
            ({"exp": -1}, None, "expired at 1970"),
            ({"exp": 1e300, "datasets": None}, None, "'datasets'"),
        ):
            status, answer = asked(signed(secret, claims, header))
            self.assertEqual((status, why in answer["error"], "\n" in answer["error"]), (401, True, False), answer)
        nothing = self.gateway.holding(datasets=[])
        self.assertEqual(nothing.json("/api/v1/datasets"), (200, {"datasets": []}))

    def test_the_command_line_makes_one(self):
        token, link = self.programs.run("token", "--for", "1h", "--dataset", "a", "--view-only").stdout.splitlines()
        self.assertEqual(link, f"http://{self.gateway.authority}/#token={token}&dataset=a")
        holder = Gateway(link)
        self.assertEqual(holder.json("/api/v1/datasets")[1]["datasets"][0]["name"], "a")
        self.assertEqual(holder.request("/api/v1/render.png?dataset=b")[0], 404)
        self.assertEqual(holder.request("/api/v1/upload?file=a.nrrd&bytes=3", method="POST", body=b"")[0], 403)
        claims = json.loads(base64.urlsafe_b64decode(token.split(".")[1] + "=="))
        self.assertAlmostEqual(claims["exp"], time.time() + 3600, delta=TIMEOUT)
        several = self.programs.run("token", "--for", "90s", "--dataset", "a,b", "--dataset", "c").stdout.splitlines()
        self.assertEqual({each["name"] for each in Gateway(several[1]).json("/api/v1/datasets")[1]["datasets"]}, {"a", "b", "c"})
        for arguments, why in (
            (["--for", "0s"], "--for 0s is less than 1s"),
            (["--for", "500ms"], "--for 500ms is less than 1s"),
            (["--for", "day"], "is not a time"),
            (["--for", "9000h"], "out of range"),
            ([], "--for"),
            (["--for", "1h", "--dataset", ""], "--dataset"),
            (["--for", "1h", "--dataset", "x" * 300], "--dataset has 300 bytes, must have 1 to 256"),
            (["--for", "1h", "--token-file", "none"], "--token-file"),
        ):
            error = self.programs.run("token", *arguments, expect=2).stderr
            self.assertEqual((why in error, len(error.splitlines())), (True, 1), error)


class SteeringTest(WithService):
    def test_parameters_of_a_simulation_are_told_and_changed(self):
        self.programs.start("../tests/steered_simulation", self.endpoint, "rho")
        wait_until(lambda: self.get("/api/v1/parameters", dataset="rho")[0] == 200, "the simulation")
        first = self.gateway.json("/api/v1/parameters?dataset=rho")[1]
        self.assertEqual(first["parameters"], [{"name": "level", "value": 100, "least": 0, "most": 250}, {"name": "unused", "value": 0, "least": -1, "most": 1}])
        self.assertAlmostEqual(first["simulated"], first["time"] / 100)
        post = lambda **fields: self.gateway.json("/api/v1/parameters", method="POST", body=json.dumps({"dataset": "rho", **fields}))
        status, steered = post(set="level=200,unused=-0.5")
        self.assertEqual((status, [parameter["value"] for parameter in steered["parameters"]]), (200, [200, -0.5]))
        listed = lambda: [each["simulation"] for each in self.gateway.json("/api/v1/datasets")[1]["datasets"] if each["name"] == "rho"]
        wait_until(lambda: any(each["parameters"] == steered["parameters"] and each["time"] > first["time"] for each in listed()), "the list tells")
        for fields, status, why in [
            ({"set": "level=251"}, 400, '"rho": level is 251, must be in [0, 250]'),
            ({"set": "unused=1,lever=1"}, 400, "\"rho\" has no parameter 'lever', must be one of: level, unused"),
            ({"set": "level"}, 400, "set 'level' is not NAME=VALUE,..."),
            ({"set": "level=x"}, 400, "set level 'x' is not a number"),
            ({"level": 3}, 400, "there is no option 'level'"),
            ({"dataset": "a", "set": "level=1"}, 400, '"a": no simulation holds it'),
            ({"dataset": "none"}, 404, 'no dataset "none"'),
        ]:
            self.assertEqual(post(**fields), (status, {"error": why}))
        self.assertEqual(self.gateway.json("/api/v1/parameters?dataset=rho&set=level=1"), (405, {"error": "parameters are set by POST"}))
        self.assertEqual(self.gateway.json("/api/v1/parameters?dataset=rho")[1]["parameters"], steered["parameters"])


class ViewTest(WithService):
    def test_a_still_picture_is_that_of_the_command_line(self):
        page = self.page()
        self.assertEqual(page.receive()["type"], "hello")
        self.assertEqual(page.text("status")["service"], "ready")
        for options in ({"azimuth": 30, "renderer": "raycast"}, {"clip-box": ":,:,3:", "scale-bar": True}, {"renderer": "mip", "size": "64x40"},
                        {"clip-box": "500:600,:,:"}, {"size": 160, "axes": "axes"}, {"size": 160, "color-bar": "K", "legend": True, "renderer": "zbuffer", "isovalue": 1, "transfer": "auto"}):
            options = {"dataset": "a", "size": 48, **options}
            header, data, count = page.final(page.view(options))
            self.assertEqual(count, 2)  # one that moves, and the still one
            fields = {k: "true" if v is True else v for k, v in options.items()}
            self.assertEqual(whole(header, data), png_pixels(self.get("/api/v1/render.png", **fields)[2]), options)
        options = {"dataset": "a", "size": 40, "plane": "zyx", "background": "#204060"}
        header, data, _ = page.final(page.view(options, picture="slice"))
        self.assertEqual(whole(header, data, b"\x20\x40\x60\xff"), png_pixels(self.get("/api/v1/slice.png", **options)[2]))
        options.update({"size": 160, "color-bar": "", "title": "Planes", "scale-bar": "true"})
        header, data, _ = page.final(page.view(options, picture="slice"))
        self.assertEqual(whole(header, data), png_pixels(self.get("/api/v1/slice.png", **options)[2]))

    def test_pictures_become_finer_until_they_are_as_asked_for(self):
        page = self.page()
        options = {"dataset": "levels", "size": 160, "renderer": "raycast", "detail": 0.9}
        seq = page.view(options)
        headers = []
        while not headers or not headers[-1]["final"]:
            header, data = page.picture()
            headers.append(header)
            page.ack(header["frame"])
        self.assertEqual({header["seq"] for header in headers}, {seq})
        used = [header["statistics"]["levels"][0]["level"] for header in headers]
        self.assertGreater(used[0], used[-1], "the first picture is of a coarser level")
        self.assertEqual(used, sorted(used, reverse=True))
        self.assertGreater(headers[0]["coarseness"], 1)
        self.assertEqual(headers[-1]["coarseness"], 1)
        self.assertEqual(whole(headers[-1], data), png_pixels(self.get("/api/v1/render.png", **options)[2]))
        # A level that the view names is drawn at once.
        header, data, count = page.final(page.view({"dataset": "levels", "size": 160, "renderer": "raycast", "level": 2}))
        self.assertEqual((count, header["statistics"]["levels"][0]["level"]), (2, 2))

    def test_moving_pictures_are_jpeg_of_what_shows(self):
        page = self.page()
        page.view({"dataset": "a", "size": 200, "zoom": 0.5, "renderer": "raycast"}, timeline=True)
        header, data = page.picture()
        self.assertEqual((header["type"], header["final"], header["size"]), ("image/jpeg", False, [200, 200]))
        self.assertEqual(data[:2], b"\xff\xd8")
        x, y, width, height = header["bounds"]
        self.assertTrue(0 < x and x + width < 200 and 40 < width < 160 and 0 < y and y + height < 200 and 40 < height < 160, header["bounds"])
        statistics = header["statistics"]
        self.assertEqual(statistics["workers"], 2)
        self.assertTrue({"render"} <= {entry["stage"] for entry in statistics["timeline"]})
        self.assertEqual({entry["worker"] for entry in statistics["timeline"]}, {w["worker"] for w in page.text("status")["workers"]})
        self.assertEqual(statistics["bytes"]["picture"], len(data))
        self.assertAlmostEqual(sum(v * v for v in header["geometry"]["right"]), 1)

    def test_the_next_times_are_fetched_while_times_are_played(self):
        page = self.page()
        view = lambda time: page.final(page.view({"dataset": "times", "size": 32, "time": str(time)}))
        view(0)
        page.text("status", lambda status: any(each["name"] == "times" and "times" in each for each in status["datasets"]))
        done = self.gateway.json("/api/v1/status")[1]["frames_done"]
        view(1)
        # It is drawn once, since there are no levels; and 2 and 0 are fetched, which follow 1.
        wait_until(lambda: self.gateway.json("/api/v1/status")[1]["frames_done"] >= done + 3, "the next times")

    def test_the_latest_view_wins_and_a_slow_page_gets_few(self):
        page = self.page()
        page.view({"dataset": "a", "size": 64})
        first, _ = page.picture()
        for i in range(300):
            last = page.view({"dataset": "a", "size": 64, "azimuth": i})
        # Nothing more comes while the first one is not acknowledged; the status comes each second.
        pictures = 0
        for _ in range(40):
            message = page.receive()
            pictures += isinstance(message, tuple)
            if not isinstance(message, tuple) and message["type"] == "status":
                break
        self.assertEqual(pictures, 0)
        page.ack(first["frame"])
        header, data, count = page.final(last)
        self.assertLessEqual(count, 4)
        self.assertEqual(whole(header, data), png_pixels(self.get("/api/v1/render.png", dataset="a", size=64, azimuth=299)[2]))

    def test_a_wrong_view_is_answered_and_the_next_one_is_shown(self):
        page = self.page()
        seq = page.view({"dataset": "a", "azimuth": "x"})
        error = page.text("error")
        self.assertEqual((error["seq"], error["error"]), (seq, "--azimuth 'x' is not a number"))
        self.assertEqual(page.view({"dataset": "none"}), page.text("error")["seq"])
        page.final(page.view({"dataset": "a", "size": 16}))

    def test_wrong_messages_end_the_session_with_a_reason(self):
        for opcode, payload, code in [(1, b"{", 1008), (1, b"[]", 1008), (1, b'{"type": "view", "seq": 0, "options": {}}', 1008), (2, b"x", 1003),
                                      (1, b'"' + b"x" * (1 << 20) + b'"', 1009), (1, b"\xff\xfe", 1007), (1, b"[" * 100000, 1008), (3, b"x", 1002)]:
            page = self.page()
            try:
                page.send_frame(opcode, payload)
                with self.assertRaises(Closed) as closed:
                    while True:
                        page.receive()
                self.assertEqual(closed.exception.code, code, payload[:40])
            except ConnectionError:
                self.assertEqual(code, 1009)  # the gateway may hang up before it has read a message that is too long
            page.close()
        page = self.page()
        page.view({"dataset": "a", "size": 16})
        page.seq = 0
        page.view({"dataset": "a", "size": 16})
        with self.assertRaisesRegex(Closed, "does not rise"):
            while True:
                page.receive()
        self.assertEqual(self.gateway.request("/livez")[0], 200)

    def test_sessions_share_the_service(self):
        pages = [self.page() for _ in range(3)]
        views = [(page, page.view({"dataset": name, "size": 40, "azimuth": 7 * i})) for i, (page, name) in enumerate(zip(pages, "aba"))]
        for i, (page, seq) in enumerate(views):
            header, data, _ = page.final(seq)
            self.assertEqual(whole(header, data), png_pixels(self.get("/api/v1/render.png", dataset="aba"[i], size=40, azimuth=7 * i)[2]))
        self.assertIn(b"slabstream_gateway_sessions 3\n", self.gateway.request("/metrics")[2])


def movie_pixels(picture):
    """A frame of a movie: a picture's red, green and blue, before black."""
    width, height, rgba = picture
    return b"".join(bytes((c * rgba[i + 3] + 127) // 255 for c in rgba[i:i + 3]) for i in range(0, 4 * width * height, 4))


class TurntableTest(unittest.TestCase):
    """Scripts stand in for ffmpeg: what it reads and writes is what matters here."""

    def setUp(self):
        self.programs = Programs()
        self.addCleanup(self.programs.close)
        self.programs.run("sphere", "--class", 1, "--size", 16, "--occupancy", 0.2, "-o", "a.nrrd")
        self.programs.environment["PATH"] = f"{self.programs.folder}/bin:{os.environ['PATH']}"
        (self.programs.folder / "bin").mkdir()
        for time in range(3):
            self.programs.run("sphere", "--class", 1, "--size", 16, "--occupancy", 0.05 * (time + 1), "-o", f"t_{time}.nrrd")
        self.service, self.endpoint = self.programs.up("--data", "a=a.nrrd", "--data", "times=t_*.nrrd")

    def gateway(self, script):
        if script:
            program = self.programs.folder / "bin" / "ffmpeg"
            program.write_text("#!/bin/sh\n" + script + "\n")
            program.chmod(0o755)
        else:
            self.programs.environment["PATH"] = str(self.programs.folder / "bin")
        self.process, gateway = self.programs.gateway("--endpoint", self.endpoint)
        wait_until(lambda: gateway.request("/readyz")[0] == 200, "ready")
        return gateway

    def opened(self, gateway, **fields):
        """A connection that has asked for a movie, and read its first bytes."""
        connection = gateway.connect()
        self.addCleanup(connection.close)
        target = "/api/v1/turntable.mp4?" + urllib.parse.urlencode({"dataset": "a", "size": 64, **fields})
        connection.sendall(f"GET {target} HTTP/1.1\r\nHost: {gateway.authority}\r\nAuthorization: Bearer {gateway.token}\r\n\r\n".encode())
        self.assertIn(b" 200 ", connection.recv(13))
        return connection

    def encoders(self):
        """Processes that the gateway has started."""
        found = []
        for stat in Path("/proc").glob("[0-9]*/stat"):
            try:
                state, parent = stat.read_text().rsplit(")", 1)[1].split()[:2]
            except OSError:
                continue
            if int(parent) == self.process.pid and state not in "ZX":
                found.append(stat.parent.name)
        return found

    def test_its_frames_are_pictures_all_around(self):
        gateway = self.gateway('echo "$@" > arguments; exec cat')
        fields = {"dataset": "a", "size": "24x16", "azimuth": 350, "background": "#204060", "renderer": "mip"}
        status, headers, body = gateway.request("/api/v1/turntable.mp4?" + urllib.parse.urlencode({**fields, "frames": 5, "turns": 2, "fps": 12.5}))
        self.assertEqual((status, headers["Content-Type"], headers["Transfer-Encoding"]), (200, "video/mp4", "chunked"))
        frames = [movie_pixels(png_pixels(gateway.request("/api/v1/render.png?" + urllib.parse.urlencode({**fields, "azimuth": (350 + 144 * i) % 360}))[2]))
                  for i in range(5)]
        self.assertEqual(len(body), 5 * 24 * 16 * 3)
        self.assertEqual(body, b"".join(frames))
        arguments = (self.programs.folder / "arguments").read_text()
        for part in (" -video_size 24x16 -framerate 12.5 ", "+frag_every_frame", " pipe:1"):
            self.assertIn(part, arguments)
        posted = gateway.request("/api/v1/turntable.mp4", method="POST", body=json.dumps({**fields, "frames": 5, "turns": 2}))
        self.assertEqual(posted[2], body)
        marked = {**fields, "size": "160x120", "color-bar": "K"}
        movie = gateway.request("/api/v1/turntable.mp4?" + urllib.parse.urlencode({**marked, "frames": 2}))[2]
        frames = [movie_pixels(png_pixels(gateway.request("/api/v1/render.png?" + urllib.parse.urlencode({**marked, "azimuth": azimuth}))[2]))
                  for azimuth in (350, 170)]
        self.assertEqual(movie, b"".join(frames))
        # Through cameras: the first one is the first frame, the last one the last.
        path = [{"azimuth": 10, "elevation": 30}, {"azimuth": 50, "zoom": 2}]
        look = {"dataset": "a", "size": "24x16", "background": "#204060", "renderer": "mip"}
        moved = gateway.request("/api/v1/turntable.mp4", method="POST", body=json.dumps({**look, "frames": 3, "path": path}))[2]
        ends = [movie_pixels(png_pixels(gateway.request("/api/v1/render.png?" + urllib.parse.urlencode({**look, **camera}))[2])) for camera in path]
        self.assertEqual((moved[:len(ends[0])], moved[-len(ends[1]):]), tuple(ends))
        self.assertEqual(len(moved), 3 * len(ends[0]))
        timed = [{"time": 2, **path[0]}, {"time": 2.5, **path[1]}]
        moved = gateway.request("/api/v1/turntable.mp4", method="POST", body=json.dumps({**look, "fps": 8, "path": timed}))[2]
        self.assertEqual(len(moved), 5 * len(ends[0]), "as many frames as half a second has")
        # To clients of HTTP/1.0 the end of the connection is the movie's.
        old = gateway.raw(f"GET /api/v1/turntable.mp4?dataset=a&size=16&frames=2&token={gateway.token} HTTP/1.0\r\nHost: {gateway.authority}\r\n\r\n".encode())
        self.assertEqual(len(old.split(b"\r\n\r\n", 1)[1]), 2 * 16 * 16 * 3)
        head = gateway.request("/api/v1/turntable.mp4?dataset=a&size=16&frames=2", method="HEAD")
        self.assertEqual((head[0], head[2]), (200, b""))

    def test_it_is_cut_off_when_its_token_expires(self):
        gateway = self.gateway("exec cat")
        until = int(time.time()) + 3
        connection = self.opened(gateway.holding(exp=until), size=256, frames=1000)  # far more than what buffers hold
        wait_until(lambda: time.time() >= until, "it has expired")
        answer, most = b"", 100 << 20
        while len(answer) < most and (part := connection.recv(1 << 20)):
            answer += part
        self.assertLess(len(answer), most)
        self.assertFalse(answer.endswith(b"0\r\n\r\n"), "there is no last chunk")
        wait_until(lambda: not self.encoders(), "the encoder has ended")

    def test_its_frames_are_spread_over_times(self):
        gateway = self.gateway("exec cat")
        fields = {"dataset": "times", "size": "24x16", "renderer": "mip", "background": "#204060", "no-fit": "true"}
        pictures = [movie_pixels(png_pixels(gateway.request("/api/v1/render.png?" + urllib.parse.urlencode({**fields, "time": time}))[2]))
                    for time in range(3)]
        self.assertEqual(len(set(pictures)), 3)
        for options, shown in [({"time": "0:2"}, [0, 1, 2]), ({"time": "0:2:2"}, [0, 2]), ({"time": "1:2", "frames": 5}, [1, 1, 1, 2, 2]),
                               ({"time": "2", "frames": 2}, [2, 2])]:
            movie = gateway.request("/api/v1/turntable.mp4?" + urllib.parse.urlencode({**fields, "turns": 0, **options}))[2]
            self.assertEqual(movie, b"".join(pictures[time] for time in shown), options)

    def test_wrong_ones_are_refused_before_they_begin(self):
        gateway = self.gateway("exec cat")
        for fields, status, why in [
            ({}, 400, "dataset is missing"), ({"dataset": "none"}, 404, "none"), ({"dataset": "a", "frames": 0}, 400, "[1, 1000]"),
            ({"dataset": "a", "frames": 1001}, 400, "[1, 1000]"), ({"dataset": "a", "turns": -1}, 400, "turns"), ({"dataset": "a", "fps": "nan"}, 400, "fps"),
            ({"dataset": "a", "size": "33x32"}, 400, "must be even"), ({"dataset": "a", "size": "4096x2048"}, 400, "at most 4194304"),
            ({"dataset": "a", "eye": "1,2,3"}, 400, "--eye"), ({"dataset": "a", "time": "2:1"}, 400, "time"),
            ({"dataset": "times", "time": "1:3"}, 400, "times 0 to 2"), ({"dataset": "times", "time": "0:5000"}, 400, "[1, 1000]"),
            ({"dataset": "a", "path": "[{}, {}]", "azimuth": 3}, 400, "path excludes azimuth"), ({"dataset": "a", "path": "[{}]"}, 400, "2 to 1000 cameras"),
            ({"dataset": "a", "path": '[{}, {"zoom": 0}]'}, 400, "camera 2 of the path: zoom"), ({"dataset": "a", "what": 1}, 400, "no option 'what'")]:
            got, body = gateway.json("/api/v1/turntable.mp4?" + urllib.parse.urlencode(fields))
            self.assertEqual((got, list(body)), (status, ["error"]), fields)
            self.assertIn(why, body["error"])
        wait_until(lambda: not self.encoders(), "no encoder is left")

    def test_without_ffmpeg_it_says_what_to_install(self):
        status, body = self.gateway(None).json("/api/v1/turntable.mp4?dataset=a")
        self.assertEqual(status, 501)
        self.assertIn("the program ffmpeg, which makes movies, is not in $PATH (Debian package ffmpeg)", body["error"])

    def test_an_encoder_that_fails_cuts_the_movie_off(self):
        gateway = self.gateway("echo 'no luck' >&2; exit 3")
        status, body = gateway.json("/api/v1/turntable.mp4?dataset=a&size=64&frames=50")
        self.assertEqual((status, body["error"]), (503, "ffmpeg exited with status 3: no luck"))
        self.programs.end(self.process)
        gateway = self.gateway("head -c 20000; exit 1")
        with self.assertRaises(http.client.HTTPException):  # no last chunk
            gateway.request("/api/v1/turntable.mp4?dataset=a&size=64&frames=50")
        self.assertEqual(gateway.request("/livez")[0], 200)

    def test_closed_connections_end_their_movies(self):
        gateway = self.gateway("exec cat")
        def status():
            return json.loads(self.programs.run("status", "--endpoint", self.endpoint, "--json").stdout)

        first, second = self.opened(gateway, size=256, frames=1000), self.opened(gateway, size=256, frames=1000)
        refused = gateway.json("/api/v1/turntable.mp4?dataset=a&size=16")
        self.assertEqual((refused[0], refused[1]["error"]), (429, "2 movies are under way, which is the limit"))
        # Nobody reads them, so rendering waits: what lies between is a few frames.
        wait_until(lambda: status()["running"] + status()["queued"] == 0, "nothing runs")
        done = status()["frames_done"]
        self.assertLess(done, 200)
        for connection in (first, second):
            connection.close()
        wait_until(lambda: not self.encoders(), "the encoders have ended")
        wait_until(lambda: gateway.request("/api/v1/turntable.mp4?dataset=a&size=16&frames=2")[0] == 200, "there is room again")
        # One more runs when the gateway ends.
        self.opened(gateway, size=256, frames=1000)
        self.assertEqual(self.programs.end(self.process), 0)

    @unittest.skipUnless(shutil.which("ffmpeg"), "ffmpeg is not installed")
    def test_ffmpeg_makes_a_movie_of_it(self):
        os.symlink(shutil.which("ffmpeg"), self.programs.folder / "bin" / "ffmpeg")
        self.programs.environment["PATH"] = str(self.programs.folder / "bin")
        self.process, gateway = self.programs.gateway("--endpoint", self.endpoint)
        status, _, body = gateway.request("/api/v1/turntable.mp4?dataset=a&size=64&frames=30")
        self.assertEqual(status, 200)
        self.assertEqual((body[4:8], body.count(b"moof")), (b"ftyp", 30))


class SlowReaderTest(WithService):
    """Those who ask and do not read."""

    def memory(self):
        """What the gateway has in memory now, in bytes."""
        lines = dict(line.split(":", 1) for line in Path(f"/proc/{self.process.pid}/status").read_text().splitlines())
        return 1024 * int(lines["VmRSS"].split()[0])

    def test_they_are_dropped_and_memory_stays(self):
        # Noise: a lossless picture of some megabytes, which no buffer of a socket takes.
        side = 48
        noise = random.Random(5).randbytes(side ** 3)
        header = f"NRRD0004\ntype: uint8\ndimension: 3\nsizes: {side} {side} {side}\nspacings: 1 1 1\nencoding: raw\n\n".encode()
        (self.programs.folder / "noise.nrrd").write_bytes(header + noise)
        self.programs.run("data", "add", f"noise={self.programs.folder}/noise.nrrd", "--endpoint", self.endpoint)
        view = {"dataset": "noise", "size": 1200, "renderer": "mip", "background": "#000000"}
        warm = self.page()
        warm.final(warm.view(view))
        warm.close()
        before = self.memory()
        pages = [self.page(receive_bytes=4096) for _ in range(3)]
        for turn in range(400):
            for page in pages:
                page.view({**view, "azimuth": turn})
        with self.gateway.connect(receive_bytes=4096) as connection:
            target = "/api/v1/render.png?" + urllib.parse.urlencode({**view, "size": 2000, "depth": 16})
            connection.sendall(f"GET {target} HTTP/1.1\r\nHost: {self.gateway.authority}\r\nAuthorization: Bearer {self.gateway.token}\r\n\r\n".encode())
            most = before

            def dropped():
                nonlocal most
                most = max(most, self.memory())
                metrics = self.gateway.request("/metrics")[2]
                return b"slabstream_gateway_sessions 0\n" in metrics and b'refusals_total{reason="slow reader"}' in metrics

            wait_until(dropped, "all are dropped")
        # The largest picture is 64 MB of floats, the others 23: a few are on their way, but not 1200.
        self.assertLess(most - before, 400 << 20)
        self.assertEqual(self.get("/api/v1/render.png", dataset="a", size=16)[0], 200)


class ManyPagesTest(WithService):
    """More pages than there are sessions."""

    def test_one_token_does_not_keep_out_others(self):
        first = self.page()
        first.final(first.view({"dataset": "a", "size": 16}))
        others = [self.page() for _ in range(63)]
        shown = others[0]
        shown.final(shown.view({"dataset": "a", "size": 16}))
        with self.assertRaisesRegex(Refused, "429"):
            self.page()
        guest = self.gateway.holding(view_only=True)
        pages = []
        for _ in range(3):
            pages.append(Page(guest))
            self.addCleanup(pages[-1].close)
            pages[-1].final(pages[-1].view({"dataset": "a", "size": 16}))
        with self.assertRaises(Closed) as closed:  # it has drawn a picture, but no other one for longer
            while True:
                first.receive()
        self.assertEqual(closed.exception.code, 4408)
        # Those who have shown a picture since stay.
        shown.final(shown.view({"dataset": "a", "size": 16, "azimuth": 3}))
        with self.assertRaisesRegex(Refused, "429"):
            self.page()


class CrowdTest(WithService):
    """Those who open connections and send next to nothing."""

    def drip(self, source):
        connection = self.gateway.connect(source=source)
        self.addCleanup(connection.close)
        connection.sendall(f"GET /livez HTTP/1.1\r\nHost: {self.gateway.authority}\r\nX: ".encode())
        return connection

    def answers(self, connection):
        connection.sendall(b"x\r\nConnection: close\r\n\r\n")
        try:
            return connection.recv(65536).startswith(b"HTTP/1.1 200 ")
        except OSError:
            return False

    def test_the_slowest_make_room_for_others(self):
        page = self.page()
        first = self.drip("127.0.0.1")
        many = [self.drip("127.0.0.2") for _ in range(300)]
        # As many as one address may have, and those are the latest of it: nobody waits for the others.
        self.assertEqual(self.gateway.request("/livez")[0], 200)
        self.assertIn(b'refusals_total{reason="connections"} 172\n', self.gateway.request("/metrics")[2])
        self.assertFalse(self.answers(many[0]))
        self.assertTrue(self.answers(many[-1]))
        # Others fill what is left. The next ones take the places of the address that has most.
        crowd = [self.drip(f"127.0.0.{3 + i % 100}") for i in range(200)]
        self.assertEqual(self.gateway.request("/livez")[0], 200)
        self.assertTrue(self.answers(first))
        self.assertTrue(all(self.answers(connection) for connection in crowd))
        page.final(page.view({"dataset": "a", "size": 16}))


class LeavingTest(WithService):
    """Those who close their connections while the gateway works for them."""

    TRIES, AT_ONCE = 100, 8

    def leave(self, random_number):
        if random_number.random() < 0.4:
            connection = self.gateway.connect()
            path = random_number.choice(["/api/v1/render?dataset=channels&size=300", "/api/v1/point?dataset=times&at=1,1,1", "/api/v1/info?dataset=b"])
            connection.sendall(f"GET {path} HTTP/1.1\r\nHost: {self.gateway.authority}\r\nAuthorization: Bearer {self.gateway.token}\r\n\r\n".encode())
        else:
            page = Page(self.gateway)
            connection = page.socket
            for time_shown in range(random_number.randrange(1, 5)):
                # Pictures that take long to pack, of which those that move are JPEG.
                page.view({"dataset": "times", "time": str(time_shown % 3)} if random_number.random() < 0.3 else {"dataset": "b", "size": 1000, "zoom": 2})
                if random_number.random() < 0.5:
                    message = page.receive()
                    if isinstance(message, tuple):
                        page.ack(message[0]["frame"])
        select.select([], [], [], random_number.uniform(0, 0.15))  # any moment of the work
        if random_number.random() < 0.5:  # with a reset
            connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        connection.close()

    def test_who_leaves_at_any_moment_spoils_nothing(self):
        seed = random.randrange(1 << 30)
        with self.subTest(seed=seed), concurrent.futures.ThreadPoolExecutor(self.AT_ONCE) as threads:
            numbers = random.Random(seed)
            for done in [threads.submit(self.leave, random.Random(numbers.random())) for _ in range(self.TRIES)]:
                done.result()
            page = self.page()
            page.final(page.view({"dataset": "a", "size": 16}))
            self.assertIsNone(self.process.poll())
            metrics = lambda: self.gateway.request("/metrics")[2].decode()
            wait_until(lambda: re.search(r"^slabstream_gateway_sessions 1$", metrics(), re.MULTILINE), "all sessions but this one end")


class ServiceLossTest(unittest.TestCase):
    def test_a_session_survives_the_service(self):
        programs = Programs()
        self.addCleanup(programs.close)
        programs.run("sphere", "--class", 1, "--size", 16, "--occupancy", 0.2, "-o", "a.nrrd")
        _, gateway = programs.gateway("--endpoint", f"ipc://{programs.folder}/s")  # before there is a service
        self.assertEqual(gateway.request("/readyz")[0], 503)
        self.assertEqual(gateway.request("/api/v1/render.png?dataset=a")[0], 503)
        page = Page(gateway)
        self.addCleanup(page.close)
        self.assertEqual(page.text("status")["service"], "gone")
        first = page.view({"dataset": "a", "size": 32})
        service, _ = programs.up("--data", "a=a.nrrd")
        page.final(first)
        wait_until(lambda: gateway.request("/readyz")[0] == 200, "ready")
        programs.end(service)
        self.assertNotEqual(page.text("status", lambda status: status["service"] == "gone")["reason"], "")
        second = page.view({"dataset": "a", "size": 32, "azimuth": 40})
        programs.up("--data", "a=a.nrrd")
        header, data, _ = page.final(second)
        self.assertEqual(whole(header, data), png_pixels(gateway.request("/api/v1/render.png?dataset=a&size=32&azimuth=40")[2]))


class StartTest(unittest.TestCase):
    def setUp(self):
        self.programs = Programs()
        self.addCleanup(self.programs.close)

    def refused(self, *arguments):
        child = self.programs.start("slabstream-gateway", *arguments)
        out, err = child.communicate(timeout=TIMEOUT)
        self.programs.children.remove(child)
        self.assertEqual((out, len(err.splitlines())), ("", 1), err)
        return child.returncode, err

    def test_off_loopback_it_wants_tls_or_a_proxy(self):
        code, why = self.refused("--listen", "0.0.0.0:0")
        self.assertEqual(code, 2)
        self.assertIn("--tls-cert and --tls-key, or --behind-proxy", why)
        for arguments in (["--listen", "here"], ["--behind-proxy", "x"], ["--tls-cert", "a"], ["--token-file", "none"],
                          ["--tls-cert", "none", "--tls-key", "none"], ["--endpoint", "x"]):
            self.assertEqual(self.refused(*arguments)[0], 2, arguments)

    def test_behind_a_proxy(self):
        _, gateway = self.programs.gateway("--behind-proxy", "https://viewer.example.org:8443", "--listen", "127.0.0.1")
        self.assertEqual(gateway.authority, "viewer.example.org:8443")

    def test_below_a_path(self):
        child = self.programs.start("slabstream-gateway", "--behind-proxy", "https://viewer.example.org/render")
        address, token = child.stdout.readline().split()[1].split("#token=")
        self.assertEqual(address, "https://viewer.example.org/render/")
        gateway = Gateway(f"http://127.0.0.1:{listening_port(child.pid)}/#token={token}")
        # The proxy may leave the path in requests, or take it away.
        for base in ("/render", ""):
            for path, token, status in (
                ("/", False, 200),
                ("/assets/page.js", False, 200),
                ("/livez", False, 200),
                ("/api/v1/options?a=b", False, 200),
                ("/metrics", True, 200),
                ("/metrics", False, 401),
                ("/nothing", True, 404),
                ("//livez", True, 404),
            ):
                self.assertEqual(gateway.request(base + path, token=token)[0], status, base + path)
            page = Page(
                gateway, target=base + "/api/v1/view", headers={"Host": "viewer.example.org", "Origin": "https://viewer.example.org"}
            )
            self.assertEqual(page.receive()["type"], "hello")
            page.close()
        status, headers, _ = gateway.request("/render?x=1", token=False)
        self.assertEqual((status, headers["Location"]), (308, "/render/?x=1"), "the page's addresses are relative")
        for path in ("/rende/livez", "/render2/livez", "/renderlivez", "/render/render/livez", "/RENDER/livez", "/x/render/livez"):
            self.assertEqual(
                gateway.json(path),
                (404, {"error": f"there is nothing at '{path.removeprefix('/render') if path.startswith('/render/') else path}'"}),
            )
        for wrong in ("https://viewer.example.org/render?x", "/render/", "https://a/../b"):
            self.assertEqual(self.refused("--behind-proxy", wrong)[0], 2, wrong)

    def test_a_token_of_a_file(self):
        file = self.programs.folder / "token"
        file.write_text("0123456789abcdef\n")
        file.chmod(0o644)
        code, why = self.refused("--token-file", "token")
        self.assertEqual(code, 2)
        self.assertIn("others can use 'token', which holds a secret", why)
        file.chmod(0o600)
        child = self.programs.start("slabstream-gateway", "--token-file", "token", "--listen", "127.0.0.1")
        word, address = child.stdout.readline().split()
        self.assertEqual(word, "ready")
        self.assertNotIn("0123456789abcdef", address)  # standard output is kept by whoever collects logs
        self.assertEqual(Gateway(address + "#token=0123456789abcdef").request("/metrics")[0], 200)

    def test_tokens_last_as_long_as_the_token_that_they_are_signed_with(self):
        refused = self.programs.run("token", "--for", "1h", expect=1).stderr
        self.assertIn("no gateway of this user runs here; --token-file names the file of its token", refused)
        for name, text in (("kept", "Jb8fXqkz3mYw0nT5sVQy1A"), ("short", "0123456789abcdef")):
            (self.programs.folder / name).write_text(text + "\n")
            (self.programs.folder / name).chmod(0o600)
        self.assertIn(
            "has 16 characters; to sign others it needs at least 22",
            self.programs.run("token", "--for", "1h", "--token-file", "short", expect=2).stderr,
        )
        (token,) = self.programs.run(
            "token", "--for", "1h", "--token-file", "kept"
        ).stdout.splitlines()  # no gateway of it runs: there is no link
        for _ in range(2):
            child, _ = self.programs.gateway()  # another one
            kept = self.programs.start("slabstream-gateway", "--token-file", "kept", "--behind-proxy", "https://viewer.example.org/render/")
            kept.stdout.readline()
            gateway = Gateway(f"http://127.0.0.1:{listening_port(kept.pid)}/#token={token}")
            self.assertEqual(gateway.request("/metrics")[0], 200)
            links = [self.programs.run("token", "--for", "1h", *more).stdout.splitlines()[1] for more in ((), ("--token-file", "kept"))]
            for link in links:
                self.assertTrue(link.startswith("https://viewer.example.org/render/#token=eyJ"), link)
            records = list((self.programs.folder / "slabstream").glob("*.gateway"))
            self.assertEqual([record.stat().st_mode & 0o777 for record in records], 2 * [0o600])
            for each in (child, kept):
                self.programs.end(each)
            self.assertEqual(list((self.programs.folder / "slabstream").glob("*.gateway")), [], "the secret goes with its gateway")
        child, _ = self.programs.gateway()
        child.kill()
        child.wait()
        self.programs.end(child)
        self.programs.run("token", "--for", "1h", expect=1)
        self.assertEqual(list((self.programs.folder / "slabstream").glob("*.gateway")), [], "also that of one which was killed")

    def test_pages_that_are_named_may_show_it_and_ask(self):
        _, gateway = self.programs.gateway("--origin", "vscode-webview:", "--origin", "https://Hub.example.org:443")
        policy = gateway.request("/")[1]["Content-Security-Policy"]
        self.assertTrue(policy.endswith("frame-ancestors 'self' http://localhost:* http://127.0.0.1:* vscode-webview: https://hub.example.org"), policy)
        for origin, status in (("https://hub.example.org", 200), ("vscode-webview://0a1b", 200), ("http://localhost:8888", 200),
                               ("https://hub.example.org.evil.example", 403), ("https://example.org", 403), ("null", 403)):
            answer = gateway.request("/assets/page.js", token=False, headers={"Origin": origin})
            self.assertEqual((answer[0], answer[1]["Access-Control-Allow-Origin"]), (status, origin if status == 200 else None), origin)
            if status == 200:
                Page(gateway, headers={"Origin": origin}).close()
            else:
                with self.assertRaisesRegex(Refused, "403"):
                    Page(gateway, headers={"Origin": origin})
        for wrong in ("*", "x", "https://a;b", "https://a b", "a:b", "'none'", "https:"):
            self.assertEqual(self.refused("--origin", wrong)[0], 2, wrong)

    def test_view_with_a_port_and_a_token_that_stay(self):
        self.programs.run("sphere", "--class", 1, "--size", 16, "--occupancy", 0.2, "-o", "a.nrrd")
        addresses = []
        for _ in range(2):
            child = self.programs.start("slabstream", "view", "a.nrrd", "--no-browser", "--port", "0", "--token-file", "kept")
            addresses.append(child.stdout.readline().split()[-1])
            self.assertEqual(Gateway(addresses[-1]).request("/api/v1/render.png?dataset=a&size=16")[0], 200)
            self.assertEqual(self.programs.end(child), 0)
        tokens = [Gateway(address).token for address in addresses]
        self.assertEqual(tokens, 2 * [(self.programs.folder / "kept").read_text().strip()])
        self.assertEqual((self.programs.folder / "kept").stat().st_mode & 0o777, 0o600)
        self.programs.run("view", "a.nrrd", "--port", "70000", expect=2)

    @unittest.skipUnless(shutil.which("openssl"), "openssl is not installed")
    def test_tls(self):
        subprocess.run(["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-keyout", "key.pem", "-out", "cert.pem", "-days", "2", "-subj",
                        "/CN=127.0.0.1", "-addext", "subjectAltName=IP:127.0.0.1"], cwd=self.programs.folder, check=True, capture_output=True)
        self.programs.run("sphere", "--class", 1, "--size", 16, "--occupancy", 0.2, "-o", "a.nrrd")
        _, endpoint = self.programs.up("--data", "a=a.nrrd")
        context = ssl.create_default_context(cafile=self.programs.folder / "cert.pem")
        _, gateway = self.programs.gateway("--tls-cert", "cert.pem", "--tls-key", "key.pem", "--endpoint", endpoint, context=context)
        self.assertEqual(gateway.scheme, "https")
        self.assertEqual(gateway.request("/api/v1/render.png?dataset=a&size=16")[0], 200)
        page = Page(gateway)
        self.addCleanup(page.close)
        page.final(page.view({"dataset": "a", "size": 16}))
        plain = Gateway(f"http://{gateway.authority}/#token={gateway.token}")
        with self.assertRaises((OSError, http.client.HTTPException)):
            plain.request("/livez")

    def test_view_starts_what_is_missing_and_ends_it(self):
        self.programs.run("sphere", "--class", 1, "--size", 16, "--occupancy", 0.2, "-o", "my ball.nrrd")
        child = self.programs.start("slabstream", "view", "my ball.nrrd", "--no-browser")
        line = child.stdout.readline()
        gateway = Gateway(line.split()[-1])
        self.assertIn("&dataset=my_ball", line)
        self.assertEqual(gateway.request("/api/v1/render.png?dataset=my_ball&size=16")[0], 200)
        service = gateway.json("/api/v1/status")[1]
        child.send_signal(signal.SIGINT)
        _, err = child.communicate(timeout=TIMEOUT)
        self.programs.children.remove(child)
        self.assertEqual((child.returncode, err), (0, ""))
        for pid in [service["pid"]] + [worker["pid"] for worker in service["workers"]]:
            wait_until(lambda pid=pid: process_ended(pid), f"process {pid} has ended")
        with self.assertRaises(OSError):
            gateway.request("/livez")

    def test_it_ends_while_pages_are_open(self):
        self.programs.run("sphere", "--class", 1, "--size", 24, "--occupancy", 0.2, "-o", "a.nrrd")
        _, endpoint = self.programs.up("--data", "a=a.nrrd")
        child, gateway = self.programs.gateway("--endpoint", endpoint)
        wait_until(lambda: gateway.request("/readyz")[0] == 200, "ready")
        pages = [Page(gateway) for _ in range(3)]
        for page in pages:
            self.addCleanup(page.close)
        pages[0].final(pages[0].view({"dataset": "a", "size": 64}))
        pages[1].view({"dataset": "a", "size": 1024, "renderer": "raycast"})  # is rendered when the end comes, or just done
        child.send_signal(signal.SIGTERM)
        _, err = child.communicate(timeout=TIMEOUT)
        self.programs.children.remove(child)
        self.assertEqual((child.returncode, err), (0, ""))

    def test_it_ends_while_the_service_does_not_answer(self):
        self.programs.run("sphere", "--class", 1, "--size", 16, "--occupancy", 0.2, "-o", "a.nrrd")
        _, endpoint = self.programs.up("--data", "a=a.nrrd")
        child, gateway = self.programs.gateway("--endpoint", endpoint)
        wait_until(lambda: gateway.request("/readyz")[0] == 200, "ready")
        coordinator = gateway.json("/api/v1/status")[1]["pid"]
        page = Page(gateway)
        self.addCleanup(page.close)
        os.kill(coordinator, signal.SIGSTOP)
        try:
            wait_until(lambda: gateway.request("/readyz")[0] == 503, "the service is gone")
            child.send_signal(signal.SIGTERM)
            child.communicate(timeout=TIMEOUT)
        finally:
            os.kill(coordinator, signal.SIGCONT)
        self.programs.children.remove(child)
        self.assertEqual(child.returncode, 0)

    def test_view_at_a_service(self):
        self.programs.run("sphere", "--class", 1, "--size", 16, "--occupancy", 0.2, "-o", "a.nrrd")
        self.programs.run("sphere", "--class", 2, "--size", 16, "--occupancy", 0.2, "-o", "b.nrrd")
        _, endpoint = self.programs.up("--data", "a=a.nrrd")
        for source, dataset in (("a", "a"), ("b.nrrd", "b")):
            child = self.programs.start("slabstream", "view", source, "--no-browser", "--endpoint", endpoint)
            gateway = Gateway(child.stdout.readline().split()[-1])
            self.assertEqual(gateway.request(f"/api/v1/render.png?dataset={dataset}&size=16")[0], 200)
            child.send_signal(signal.SIGINT)
            child.communicate(timeout=TIMEOUT)
            self.programs.children.remove(child)
            self.assertEqual(child.returncode, 0)
        self.programs.run("status", "--endpoint", endpoint)  # still there
        refused = self.programs.run("view", "none", "--no-browser", "--endpoint", endpoint, expect=2).stderr
        self.assertEqual(refused, "slabstream view: SOURCE 'none' is neither a file nor a dataset of the service\n")

    def test_view_without_a_display_says_that_it_opened_no_browser(self):
        self.programs.run("sphere", "--class", 1, "--size", 16, "--occupancy", 0.2, "-o", "a.nrrd")
        child = self.programs.start("slabstream", "view", "a.nrrd")
        Gateway(child.stdout.readline().split()[-1])
        self.assertEqual(child.stdout.readline(), "No browser was opened, because there is no display here: open this address in one.\n")
        self.assertEqual(child.stdout.readline(), "Ctrl-C ends it.\n")
        self.assertEqual(self.programs.end(child), 0)

    def test_view_says_what_is_missing(self):
        refused = self.programs.run("view", "none.nrrd", "--no-browser", "--endpoint", f"ipc://{self.programs.folder}/none", expect=1)
        self.assertEqual(len(refused.stderr.splitlines()), 1)
        self.assertIn("'none.nrrd' is no file, and no service answers", refused.stderr)


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[2:]])
