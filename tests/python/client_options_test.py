"""Options: Python's are the command line's, and make the same pictures."""
from __future__ import annotations

import importlib.machinery
import importlib.util
import functools
import inspect
import io
import json
import os
import shutil
import subprocess
import sys
import unittest
import unittest.mock

import numpy as np

import client_support
from client_support import ROOT, WithAService

import slabstream as ss  # noqa: E402
from slabstream import drafts, schema  # noqa: E402
from slabstream.drafts import draft_of, slice_drafts_of  # noqa: E402
from slabstream.errors import error_of  # noqa: E402
from slabstream.options import COMMANDS  # noqa: E402
from slabstream.volumes import check_spacing  # noqa: E402


def load_update():
    loader = importlib.machinery.SourceFileLoader("update_options", str(ROOT / "python" / "update-options"))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader("update_options", loader))
    sys.dont_write_bytecode = True
    loader.exec_module(module)
    return module


update = load_update()

# A colour map as ParaView writes it, and the same as Python's own.
COLOR_MAP = [{"Name": "mine", "RGBPoints": [0, 0, 0, 0.5, 100, 1, 0.5, 0, 255, 1, 1, 1], "Points": [30, 0, 0.5, 0, 200, 0.4, 0.3, 0.5]}]
FUNCTION = ss.TransferFunction(colors=[(0, (0, 0, 0.5)), (100, (1, 0.5, 0)), (255, (1, 1, 1))], opacities=[(30, 0), (200, 0.4, 0.3, 0.5)])
SHINY = [{**COLOR_MAP[0], "Material": {"ambient": 0.6, "diffuse": 0.3, "specular": 0.9, "shininess": 60}}]
REGIONS = [{"Regions": [{"Values": [90, 300], "Slopes": [0, 200], "Color": [1, 0.5, 0], "Opacity": 0.3, "Softness": 0.5},
                        {"Corners": [10, 5, 200, 5, 100, 90], "Color": [0, 0.5, 1]}]}]
OF_REGIONS = ss.TransferFunction(regions=[ss.Region.box((90, 300), (0, 200), (1, 0.5, 0), opacity=0.3, softness=0.5),
                                          ss.Region([(10, 5), (200, 5), (100, 90)], (0, 0.5, 1))])
CAMERA = {"projection": "perspective", "azimuth": 20.0, "elevation": 10.0, "roll": 5.0, "zoom": 1.2, "fov": 25.0}

# Python's options, and the command line's. Every option of options.json, every view and every renderer is here; several of them share a
# picture where they do not hide each other, since the command line takes a third of a second to start.
RAYCAST = ["--renderer", "raycast"]
Z = ["--renderer", "zbuffer"]
RENDER_CASES: list[tuple[dict, list[str]]] = [
    ({}, []),
    ({"size": (40, 30), "azimuth": 30, "elevation": -20.5}, ["--size", "40x30", "--azimuth", "30", "--elevation", "-20.5"]),
    ({"size": 32, "azimuth": "1e2", "roll": 15, "zoom": 1.7}, ["--size", "32", "--azimuth", "1e2", "--roll", "15", "--zoom", "1.7"]),
    ({"look_at": (25, 10, 0), "projection": "perspective", "fov": 50},
     ["--look-at", "25,10,0", "--projection", "perspective", "--fov", "50"]),
    ({"projection": "perspective", "distance": 80}, ["--projection", "perspective", "--distance", "80"]),
    ({"eye": np.array([100, -60, 30]), "up": (0, 1, 1)}, ["--eye", "100,-60,30", "--up", "0,1,1"]),
    ({"camera": CAMERA}, ["--camera", "camera.json"]),
    ({"view": "anterior", "fit": True}, ["--view", "anterior", "--fit"]),
    ({"view": "posterior", "clip_box": ((25, None), (None, 18.5), (-5, 12))}, ["--view", "posterior", "--clip-box", "25:,:18.5,-5:12"]),
    ({"view": "superior", "clip_box": ((None, None), (None, None), (None, 50), "%")},
     ["--view", "superior", "--clip-box", ":,:,:50%"]),
    ({"view": "superior", "clip_box": ":50%,:,:"}, ["--view", "superior", "--clip-box", ":50%,:,:"]),
    ({"view": "inferior", "clip_box": "3:20,:,4:9v"}, ["--view", "inferior", "--clip-box", "3:20,:,4:9v"]),
    ({"view": "left", "clip_plane": (1, 0.5, 0, -40)}, ["--view", "left", "--clip-plane", "1,0.5,0,-40"]),
    ({"view": "right", "clip_plane": [(1, 0.5, 0, -40), "0,0,1,0"]},
     ["--view", "right", "--clip-plane", "1,0.5,0,-40", "--clip-plane", "0,0,1,0"]),
    ({"view": "front", "clip_plane": (1, 0, 0, -35), "clip_mode": "cut-away"},
     ["--view", "front", "--clip-plane", "1,0,0,-35", "--clip-mode", "cut-away"]),
    ({"view": "back", "shading": "none", "background": "teal"}, ["--view", "back", "--shading", "none", "--background", "teal"]),
    ({"view": "top", "light": (1, 1, 2), "termination": 0.25}, ["--view", "top", "--light", "1,1,2", "--termination", "0.25"]),
    ({"azimuth": 30, "of_patient": True, "brightness": 0.5}, ["--azimuth", "30", "--of-patient", "--brightness", "0.5"]),
    ({"azimuth": 30, "ambient": 0.5, "diffuse": 0.4, "specular": 0.7, "shininess": 5},
     ["--azimuth", "30", "--ambient", "0.5", "--diffuse", "0.4", "--specular", "0.7", "--shininess", "5"]),
    ({"azimuth": 30, "light": (1, 1, 2), "shadows": 0.75}, ["--azimuth", "30", "--light", "1,1,2", "--shadows", "0.75"]),
    ({"azimuth": 30, "ambient_occlusion": 0.5, "occlusion_radius": 0.25},
     ["--azimuth", "30", "--ambient-occlusion", "0.5", "--occlusion-radius", "0.25"]),
    ({"view": "bottom", "light": [(1, 1, 2), (-1, 0, 0)], "background": (0.1, 0.7, 0.3, 0.4)},
     ["--view", "bottom", "--light", "1,1,2", "--light", "-1,0,0", "--background", "0.1,0.7,0.3,0.4"]),
    ({"azimuth": 30, "plane": ["axial", ss.Plane("sagittal", 20, opacity=0.5)]},
     ["--azimuth", "30", "--plane", "axial", "--plane", "sagittal:x=20,opacity=0.5"]),
    ({"plane": ss.Plane((1, 0, 1), at=(20, 10, 5), map="inferno", range="2%:98%")}, ["--plane", "1/0/1:at=20/10/5,map=inferno,range=2%:98%"]),
    ({"plane": "0/0/1:index=3"}, ["--plane", "z:index=3"]),
    ({"renderer": "splat", "background": "#1020fe80", "depth": 16}, ["--renderer", "splat", "--background", "#1020fe80", "--depth", "16"]),
    ({"renderer": "splat", "footprint": 1.8}, ["--renderer", "splat", "--footprint", "1.8"]),
    ({"renderer": "zbuffer", "shading": "depth-gradient"}, [*Z, "--shading", "depth-gradient"]),
    ({"renderer": "zbuffer", "isovalue": 90, "transfer": "auto"}, [*Z, "--isovalue", "90", "--transfer", "auto"]),
    ({"renderer": "shear", "kernel": "mitchell", "supersampling": 2}, ["--renderer", "shear", "--kernel", "mitchell", "--supersampling", "2"]),
    ({"renderer": "xray", "attenuation": "hounsfield", "energy": 40, "integral_window": 3, "integral_level": 1, "polarity": "dark-bone"},
     ["--renderer", "xray", "--attenuation", "hounsfield", "--energy", "40", "--integral-window", "3", "--integral-level", "1", "--polarity",
      "dark-bone"]),
    ({"fit": True, "clip_box": "25:,:18.5,-5:12"}, ["--fit", "--clip-box", "25:,:18.5,-5:12"]),
    ({"fit": False, "clip_box": "25:,:18.5,-5:12"}, ["--no-fit", "--clip-box", "25:,:18.5,-5:12"]),
    ({"size": 96, "color_bar": True, "font_size": 9}, ["--size", "96", "--color-bar", "--font-size", "9"]),
    ({"renderer": "mip", "interpolation": "nearest", "projection_mode": "mean", "sampling_rate": 2},
     ["--renderer", "mip", "--interpolation", "nearest", "--projection-mode", "mean", "--sampling-rate", "2"]),
    ({"transfer": COLOR_MAP, "opacity_distance": 3.5}, ["--transfer", "map.json", "--opacity-distance", "3.5"]),
    ({"transfer": FUNCTION}, ["--transfer", "map.json"]),
    ({"transfer": SHINY, "ambient": 0.2, "shininess": 20}, ["--transfer", "shiny.json", "--ambient", "0.2", "--shininess", "20"]),
    ({"renderer": "raycast", "sampling_rate": 0.5, "jitter": 0.8}, [*RAYCAST, "--sampling-rate", "0.5", "--jitter", "0.8"]),
    ({"renderer": "raycast", "gradient": "smooth"}, [*RAYCAST, "--gradient", "smooth"]),
    ({"renderer": "raycast", "transfer": OF_REGIONS}, [*RAYCAST, "--transfer", "regions.json"]),
    ({"renderer": "raycast", "transfer": REGIONS, "opacity_distance": 2}, [*RAYCAST, "--transfer", "regions.json", "--opacity-distance", "2"]),
    ({"transfer": "gray-ramp", "scalar_range": (20, 150)}, ["--transfer", "gray-ramp", "--scalar-range", "20:150"]),
    ({"transfer": "gray-ramp", "scalar_range": "2%:98%"}, ["--transfer", "gray-ramp", "--scalar-range", "2%:98%"]),
    ({"renderer": "raycast", "isovalue": [40, (150, "olive", 0.5)]}, [*RAYCAST, "--isovalue", "40,150:olive:0.5"]),
    ({"renderer": "raycast", "isovalue": [(150, (0.1, 0.2, 0.9)), (40, "#ff000060")]},
     [*RAYCAST, "--isovalue", "150:0.1,0.2,0.9,40:#ff000060"]),
    ({"renderer": "raycast", "isovalue": "40:0.5,0.5,0.5:0.2,150"}, [*RAYCAST, "--isovalue", "40:0.5,0.5,0.5:0.2,150"]),
    ({"renderer": "raycast", "gradient_opacity": [(0, 0.1), (20, 1)]}, [*RAYCAST, "--gradient-opacity", "0:0.1,20:1"]),
    ({"renderer": "raycast", "labels": True}, [*RAYCAST, "--label-mode", "tint"]),
    ({"renderer": "raycast", "label_mode": "surface", "label_opacity": {1: 0.2, 3: 0}},
     [*RAYCAST, "--label-mode", "surface", "--label-opacity", "1=0.2,3=0"]),
    ({"renderer": "raycast", "label_mode": "surface", "label_surface": "smooth"},
     [*RAYCAST, "--label-mode", "surface", "--label-surface", "smooth"]),
    ({"renderer": "raycast", "label_tint": 1, "labels_shown": [1, (3, 5)]}, [*RAYCAST, "--label-tint", "1", "--labels-shown", "1,3-5"]),
    ({"renderer": "raycast", "overlay": True}, [*RAYCAST, "--overlay-weight", "1"]),
    ({"renderer": "raycast", "overlay_transfer": "gray-ramp", "overlay_weight": 0.2},
     [*RAYCAST, "--overlay-transfer", "gray-ramp", "--overlay-weight", "0.2"]),
    ({"renderer": "raycast", "overlay_transfer": "opaque", "overlay_range": (0.2, 0.9), "overlay_weight": 0.5},
     [*RAYCAST, "--overlay-transfer", "opaque", "--overlay-range", "0.2:0.9", "--overlay-weight", "0.5"]),
    ({"size": 96, "title": "A ball", "scale_bar": True, "orientation_marker": True, "color_bar": "HU"},
     ["--size", "96", "--title", "A ball", "--scale-bar", "--orientation-marker", "--color-bar=HU"]),
    ({"size": 96, "axes": "grid", "background": "#e0e0ff"}, ["--size", "96", "--axes", "grid", "--background", "#e0e0ff"]),
    ({"size": 96, "axes": "axes", "background": "0.2,0.4,0.1,0.5"}, ["--size", "96", "--axes", "axes", "--background", "0.2,0.4,0.1,0.5"]),
    ({"renderer": "raycast", "label_mode": "highlight", "labels_shown": ["left_?", 3]},
     [*RAYCAST, "--label-mode", "highlight", "--labels-shown", "left_?,3"]),
    ({"renderer": "raycast", "size": 96, "label_mode": "surface", "labels_shown": "1,*_2", "legend": True, "color_bar": True},
     [*RAYCAST, "--size", "96", "--label-mode", "surface", "--labels-shown", "1,*_2", "--legend", "--color-bar"]),
    ({"background": "rebeccapurple"}, ["--background", "rebeccapurple"]),
    ({"decomposition": "kd-tree", "axis": "x", "balance_by": "voxels"}, ["--decomposition", "kd-tree", "--axis", "x", "--balance-by", "voxels"]),
    ({"assignment": "greedy", "groups": 3}, ["--assignment", "greedy", "--groups", "3"]),
    ({"balance": "static", "teams": 2}, ["--balance", "static", "--teams", "2"]),
    ({"combine": "chain:strips=2", "pixel_error": 1e-7}, ["--combine", "chain:strips=2", "--pixel-error", "1e-7"]),  # too little for 16 bits
]
SLICE_CASES: list[tuple[dict, list[str]]] = [
    ({"plane": "anatomical"}, ["--plane", "anatomical"]),
    ({"plane": "zyx", "background": "red", "depth": 16}, ["--plane", "zyx", "--background", "red", "--depth", "16"]),
    ({"plane": "axial", "at": (30, 10, 2), "size": (50, 40)}, ["--plane", "axial", "--at", "30,10,2", "--size", "50x40"]),
    ({"plane": "coronal", "index": 9, "interpolation": "nearest"}, ["--plane", "coronal", "--index", "9", "--interpolation", "nearest"]),
    ({"plane": "anatomical", "scale_bar": True, "orientation_marker": True, "title": "Three"},
     ["--plane", "anatomical", "--scale-bar", "--orientation-marker", "--title", "Three"]),
    ({"plane": "coronal", "color_bar": "HU", "legend": True}, ["--plane", "coronal", "--color-bar=HU", "--legend"]),
    ({"plane": "coronal", "color_bar": True, "font_size": 9}, ["--plane", "coronal", "--color-bar", "--font-size", "9"]),
    ({"plane": "axial", "window": "brain"}, ["--plane", "axial", "--window", "brain"]),
    ({"plane": "axial", "window": "soft-tissue", "level": 90}, ["--plane", "axial", "--window", "soft-tissue", "--level", "90"]),
    ({"plane": "sagittal", "window": 150}, ["--plane", "sagittal", "--window", "150"]),
    ({"plane": "y", "window": 150, "level": 60}, ["--plane", "y", "--window", "150", "--level", "60"]),
    ({"plane": "x", "transfer": "gray-ramp", "scalar_range": (0, 99), "opacity_distance": 2},
     ["--plane", "x", "--transfer", "gray-ramp", "--scalar-range", "0:99", "--opacity-distance", "2"]),
    ({"plane": "z", "projection_mode": "mean", "sampling_rate": 2, "thickness": 8},
     ["--plane", "z", "--projection-mode", "mean", "--sampling-rate", "2", "--thickness", "8"]),
    ({"plane": "axial", "labels": True}, ["--plane", "axial", "--label-mode", "tint"]),
    ({"plane": "axial", "label_mode": "surface", "labels_shown": 2}, ["--plane", "axial", "--label-mode", "surface", "--labels-shown", "2"]),
    ({"plane": "axial", "label_mode": "surface", "label_surface": "smooth"},
     ["--plane", "axial", "--label-mode", "surface", "--label-surface", "smooth"]),
    ({"plane": "axial", "label_mode": "highlight", "labels_shown": "right_*"},
     ["--plane", "axial", "--label-mode", "highlight", "--labels-shown", "right_*"]),
    ({"plane": "axial", "label_tint": 0.3, "overlay": True}, ["--plane", "axial", "--label-tint", "0.3", "--overlay-transfer", "auto"]),
    ({"plane": "axial", "overlay_transfer": "gray-ramp", "overlay_range": "0:0.5", "overlay_weight": "0.7"},
     ["--plane", "axial", "--overlay-transfer", "gray-ramp", "--overlay-range", "0:0.5", "--overlay-weight", "0.7"]),
]


# Of a dataset with two levels.
LEVEL_CASES: list[tuple[dict, list[str]]] = [
    ({"detail": 0.1}, ["--detail", "0.1"]),
    ({"level": "0", "renderer": "raycast"}, ["--level", "0", "--renderer", "raycast"]),
]
# Of a dataset of two channels at three times.
CHANNEL_CASES: list[tuple[dict, list[str]]] = [
    ({"channels": [1]}, ["--channel", "1"]),
    ({"channels": "Actin", "time": 2}, ["--channel", "Actin", "--time", "2"]),
    ({"channels": {"DAPI": {"color": "#f0f", "range": (10, 150), "gamma": 0.5, "opacity": 0.5}, 1: {"shown": False}}, "time": "last"},
     ["--channel", "DAPI", "--channel-color", "DAPI=#f0f", "--channel-range", "DAPI=10:150", "--channel-gamma", "DAPI=0.5",
      "--channel-opacity", "DAPI=0.5", "--time", "last"]),
    ({"channels": {0: {"transfer": "viridis", "range": "2%:98%"}}}, ["--channel", "0", "--channel-transfer", "0=viridis", "--channel-range", "0=2%:98%"]),
    ({"channels": ["Actin"], "color_bar": True, "size": 96}, ["--channel", "Actin", "--color-bar", "--size", "96"]),
    ({"channels": [0, "Actin"], "color_bar": "K", "legend": True, "size": 160},
     ["--channel", "0,Actin", "--color-bar=K", "--legend", "--size", "160"]),
    ({"blend": "add"}, ["--blend", "add"]),
    ({"missing": "last"}, ["--missing", "last"]),
]
CHANNEL_SLICE_CASES: list[tuple[dict, list[str]]] = [
    ({"plane": "z", "channels": {"Actin": {"color": "lime"}}, "time": 1},
     ["--plane", "z", "--channel", "Actin", "--channel-color", "Actin=lime", "--time", "1"]),
    ({"plane": "zyx", "color_bar": True, "size": 96, "channels": [0]}, ["--plane", "zyx", "--color-bar", "--size", "96", "--channel", "0"]),
    ({"plane": "z", "channels": [1], "blend": "max", "missing": "skip"},
     ["--plane", "z", "--channel", "1", "--blend", "max", "--missing", "skip"]),
]
# Of an unstructured grid.
GRID_CASES: list[tuple[dict, list[str]]] = [
    ({"renderer": "slice", "sampling_rate": 2, "azimuth": 30}, ["--renderer", "slice", "--sampling-rate", "2", "--azimuth", "30"]),
    ({"renderer": "auto", "sampling_rate": 4}, ["--renderer", "auto", "--sampling-rate", "4"]),
]
GRID = """# vtk DataFile Version 3.0
a hexahedron
ASCII
DATASET UNSTRUCTURED_GRID
POINTS 8 float
0 0 0 4 0 0 4 3 0 0 3 0 0 0 2 4 0 2 4 3 2 0 3 2
CELLS 1 9
8 0 1 2 3 4 5 6 7
CELL_TYPES 1
12
POINT_DATA 8
SCALARS v float 1
LOOKUP_TABLE default
0 4 4 0 2 6 6 2
"""


class Pixels(WithAService):
    @classmethod
    def setUpClass(cls) -> None:
        super().setUpClass()
        (cls.folder / "grid.vtk").write_text(GRID)
        added = cls.running.run("data", "add", f"grid={cls.folder}/grid.vtk", "--endpoint", cls.running.endpoint)
        assert added.returncode == 0, added.stderr
        added = cls.running.run("data", "add", f"cells={client_support.write_cells(cls.folder)}", "--endpoint", cls.running.endpoint)
        assert added.returncode == 0, added.stderr
        ball = cls.folder / "ball.nrrd"
        for arguments in (["sphere", "--class", "1", "--size", "80", "-o", ball], ["convert", ball, cls.folder / "levels.ome.zarr"],
                          ["data", "add", f"levels={cls.folder}/levels.ome.zarr", "--endpoint", cls.running.endpoint]):
            done = cls.running.run(*map(str, arguments))
            assert done.returncode == 0, done.stderr
        (cls.folder / "map.json").write_text(json.dumps(COLOR_MAP))
        (cls.folder / "shiny.json").write_text(json.dumps(SHINY))
        (cls.folder / "regions.json").write_text(json.dumps(REGIONS))
        (cls.folder / "camera.json").write_text(json.dumps(CAMERA))
        cls.service = ss.connect(endpoint=cls.running.endpoint)
        cls.addClassCleanup(cls.service.close)

    def compare(self, command: str, cases: list, dataset: str = "head") -> None:
        for python, arguments in cases:
            with self.subTest(command=command, python=python):
                if "size" not in python:
                    python, arguments = {**python, "size": 48}, [*arguments, "--size", "48"]
                image = getattr(self.service, "render" if command == "render" else "slice")(dataset, **python)
                expected = self.running.picture(command, *arguments, dataset=dataset)
                found = client_support.read_png(image.png())
                self.assertEqual(found.dtype, expected.dtype)
                np.testing.assert_array_equal(found, expected)
                if found.dtype == np.uint8:
                    np.testing.assert_array_equal(np.asarray(image), expected)
                self.assertGreater(expected[..., 3].max(), 0)

    def test_render_makes_the_command_lines_pixels(self) -> None:
        self.compare("render", RENDER_CASES)
        self.compare("render", GRID_CASES, "grid")
        self.compare("render", LEVEL_CASES, "levels")
        self.compare("render", CHANNEL_CASES, "cells")

    def test_every_field_changes_the_picture_or_says_that_it_does_not(self) -> None:
        def differ(one, other) -> bool:
            # Who makes a picture how may change it by the termination threshold.
            return one is None or other is None or one.shape != other.shape or np.abs(one - other).max() > 2e-3

        def shown(dataset: str, options: dict):
            try:
                return self.service.render(dataset, **{"size": 48, **options}).rgba
            except ss.SlabstreamError:  # it cannot be had without this option
                return None

        of = {"head": RENDER_CASES, "grid": GRID_CASES, "levels": LEVEL_CASES, "cells": CHANNEL_CASES}
        cases = [(dataset, python) for dataset, listed in of.items() for python, _ in listed]
        for name, option in COMMANDS["render"].items():
            if not option.path or name in ("pixel_error", "blend"):  # which says itself by how much; of several channels
                continue
            with self.subTest(option=name):
                changes = False
                for dataset, python in cases:
                    if name in python:
                        without = shown(dataset, {other: value for other, value in python.items() if other != name})
                        changes = changes or differ(without, shown(dataset, python))
                self.assertEqual(changes, not option.same_picture)

    def test_numbers_of_a_material_are_replaced_by_those_of_the_call(self) -> None:
        plain, shiny = (self.service.render("head", size=48, transfer=transfer).rgba for transfer in (COLOR_MAP, SHINY))
        self.assertGreater(np.abs(plain - shiny).max(), 0.1)
        said = self.service.render("head", size=48, transfer=SHINY, ambient=0.2, diffuse=0.8, specular=0.2, shininess=20).rgba
        np.testing.assert_array_equal(said, plain)

    def test_slice_makes_the_command_lines_pixels(self) -> None:
        self.compare("slice", SLICE_CASES)
        self.compare("slice", CHANNEL_SLICE_CASES, "cells")

    def test_every_option_is_compared(self) -> None:
        for command, cases in (("render", RENDER_CASES + GRID_CASES + LEVEL_CASES + CHANNEL_CASES),
                               ("slice", SLICE_CASES + CHANNEL_SLICE_CASES)):
            compared = {name for python, _ in cases for name in python}
            of_files = {"dpi", "quality"}  # which have no pixels of their own
            self.assertEqual(set(COMMANDS[command]) - compared - {"shape"}, of_files)  # client_shapes_test.py compares shapes
            for name in ("view", "renderer", "plane"):
                if name in COMMANDS[command] and COMMANDS[command][name].choices:  # planes in space have none
                    self.assertEqual({python.get(name) for python, _ in cases} - {None}, set(COMMANDS[command][name].choices))

    def test_presets_are_the_services(self) -> None:
        with self.assertRaisesRegex(ss.NotFound, "no transfer function is named 'crayon', there are auto, gray-ramp"):
            self.service.render("head", transfer="crayon")


class Drift(unittest.TestCase):
    def test_the_version_is_the_programs(self) -> None:
        said = subprocess.run([client_support.PROGRAM, "--version"], capture_output=True, text=True, check=True).stdout
        self.assertEqual(said, f"slabstream {ss.__version__}\n")

    def test_options_are_those_that_the_program_prints(self) -> None:
        self.assertEqual(update.OPTIONS.read_text(), update.options_text(client_support.PROGRAM), "run python/update-options")

    def test_colours_are_those_of_the_command_line(self) -> None:
        self.assertEqual(update.COLORS.read_text(), update.colors_text(), "run python/update-options")
        self.assertEqual(len(json.loads(update.COLORS.read_text())), 148, "as many as CSS names")

    def test_the_schema_is_that_of_proto(self) -> None:
        from google.protobuf import descriptor_pb2

        protoc = os.environ.get("SLABSTREAM_PROTOC") or shutil.which("protoc")
        if protoc is None:
            self.skipTest("install protobuf-compiler")
        kept, made = (
            descriptor_pb2.FileDescriptorSet.FromString(content) for content in (update.SCHEMA.read_bytes(), update.schema_bytes(protoc))
        )
        self.assertEqual({file.name: file for file in kept.file}, {file.name: file for file in made.file}, "run python/update-options")

    def test_every_option_has_its_place_in_a_request(self) -> None:
        self.assertEqual({name for command in COMMANDS.values() for name, option in command.items() if not option.path}, set(drafts._PUT))
        for command in COMMANDS.values():
            for option in command.values():
                *outer, field = option.path.split(".")
                if option.path and outer != ["parameters"]:
                    short = {"overlay": schema.FieldChoice(), "labels": schema.LabelChoice()}  # forms of a field's look
                    holder = short.get(".".join(outer)) or functools.reduce(getattr, outer, schema.FrameRequest())
                    self.assertIn(field, holder.DESCRIPTOR.fields_by_name, option.path)

    def test_signatures_and_help_show_them(self) -> None:
        signature = inspect.signature(ss.Service.render)
        self.assertLessEqual(set(COMMANDS["render"]), set(signature.parameters))
        self.assertEqual(signature.parameters["zoom"].default, "1")
        self.assertIn("Degrees that the eye turns", ss.render.__doc__)
        self.assertIn("plane: NAME", ss.Volume.slice.__doc__)
        words = " ".join(ss.render.__doc__.split())
        self.assertIn("Look at a side, instead of azimuth and elevation", words)
        self.assertIn("(default: 1; from 0.001 to 10000)", words)


    def test_texts_of_the_service_say_keywords(self) -> None:
        for text, expected in (
            ("view.up needs view.eye; without an eye, view.roll_degrees turns the picture", "up needs eye; without an eye, roll turns the picture"),
            ("--clip-box '1' is not X0:X1,Y0:Y1,Z0:Z1", "clip_box '1' is not X0:X1,Y0:Y1,Z0:Z1"),
            ("clipping.clip_planes[0].normal is 0,0,0", "clip_plane[0].normal is 0,0,0"),
            ("--labels needs --local; see --keys, a.nrrd and docs/x.md", "labels needs --local; see --keys, a.nrrd and docs/x.md"),
        ):
            self.assertEqual(str(error_of(1, text)), expected)


class Requests(unittest.TestCase):
    def test_values_are_pythons_or_the_command_lines(self) -> None:
        for python, text in (
            ({"size": (64, 32)}, {"size": "64x32"}),
            ({"look_at": [1, 2, 3.5]}, {"look_at": "1,2,3.5"}),
            ({"clip_box": ((1, 2), (None, 3), (0, None), "v")}, {"clip_box": "1:2,:3,0:v"}),
            ({"isovalue": [300, (120, "red", 0.3)]}, {"isovalue": "300,120:red:0.3"}),
            ({"label_opacity": {3: 0.5, 7: 0}}, {"label_opacity": "3=0.5,7=0"}),
            ({"labels_shown": [1, range(5, 7)]}, {"labels_shown": "1,5-6"}),
            ({"labels_shown": ["Temporal_*", 3, "5-6"]}, {"labels_shown": "Temporal_*,3,5-6"}),
            ({"groups": 4, "zoom": np.float32(0.5)}, {"groups": "4", "zoom": "0.5"}),
            ({"detail": "auto", "groups": "auto"}, {"detail": "0", "groups": "0"}),
            ({"light": np.eye(3)}, {"light": ["1,0,0", "0,1,0", "0,0,1"]}),
            ({"time": 17}, {"time": "17"}),
            ({"channels": [0, "Actin"]}, {"channels": "0,Actin"}),
            ({"channels": np.int64(2)}, {"channels": "2"}),
            ({"channels": {0: None, "Actin": True, 3: False}}, {"channels": "0,Actin"}),
            ({"channels": {0: {"color": (0, 1, 0), "range": (1, 9)}}}, {"channels": {"0": {"color": "lime", "range": "1:9", "shown": True}}}),
        ):
            self.assertEqual(draft_of("a", python), draft_of("a", text))

    def test_none_is_not_given(self) -> None:
        self.assertEqual(draft_of("a", {"zoom": None, "labels": None, "eye": None}), draft_of("a", {}))
        self.assertEqual(draft_of("a", {"labels": False, "overlay": False}), draft_of("a", {}))

    def test_a_picture_of_isosurfaces_shows_nothing_else_unless_asked(self) -> None:
        self.assertEqual(draft_of("a", {"isovalue": 3}).frame.transfer.preset, "none")
        self.assertEqual(draft_of("a", {"isovalue": 3, "transfer": "auto"}).frame.transfer.preset, "auto")

    def test_mistakes_name_the_option_the_value_and_the_limit(self) -> None:
        for given, sentence in (
            ({"zoom": 0}, "zoom 0 is out of range [0.001, 10000]"),
            ({"zoom": "wide"}, "zoom 'wide' is not a number"),
            ({"zoom": float("nan")}, "zoom nan is not a number"),
            ({"zoom": True}, "zoom True is not a number"),
            ({"opacity_distance": 0}, "opacity_distance 0 is out of range (0, 1000000]"),
            ({"teams": 0}, "teams 0 is out of range [1, 1024]"),
            ({"teams": 1.5}, "teams 1.5 is not a whole number in [1, 1024]"),
            ({"groups": 2000}, "groups 2000 is out of range [0, 1024]"),
            ({"sampling_rate": 100}, "sampling_rate 100 is out of range [0.1, 16]"),
            ({"label_tint": 2}, "label_tint 2 is out of range [0, 1]"),
            ({"labels_shown": ["x" * 257]}, "labels_shown has a name of 257 bytes, at most 256 are possible"),
            ({"labels_shown": "1,"}, "labels_shown '' is not a whole number"),
            ({"labels_shown": "9-5"}, "labels_shown 5 is out of range [9, 18446744073709551615]"),
            ({"size": 0}, "size 0 is out of range [1, 16384]"),
            ({"size": (1, 2, 3)}, "size (1, 2, 3) is neither WIDTHxHEIGHT nor one number"),
            ({"shading": "toon"}, "shading 'toon' is not one of phong, none, depth-gradient"),
            ({"renderer": "crayon"}, "renderer 'crayon' is not one of auto, splat, raycast, zbuffer, shear, mip, slice"),
            ({"fit": "yes"}, "fit 'yes' is neither True nor False"),
            ({"look_at": (1, 2)}, "look_at (1, 2) is not X,Y,Z"),
            ({"light": (0, 0, 0)}, "light [0, 0, 0] has no direction"),
            ({"scalar_range": (5, 5)}, "scalar_range (5, 5) must rise"),
            ({"scalar_range": "5:7%"}, "scalar_range '5:7%' is neither LOW:HIGH nor LOW%:HIGH%"),
            ({"clip_box": ((3, 1), (0, 1), (0, 1))}, "clip_box ((3, 1), (0, 1), (0, 1)): x runs from 3 to 1, but must rise"),
            ({"background": "blurple"}, "background 'blurple' is neither R,G,B[,A] nor #rrggbb nor the name of a colour"),
            ({"background": "#12345"}, "background '#12345' is neither #rgb nor #rrggbb nor #rrggbbaa"),
            ({"channels": []}, "channels shows 0 channels, must be 1 to 16"),
            ({"channels": {0: False}}, "channels shows 0 channels, must be 1 to 16"),
            ({"channels": [""]}, "channels '' is neither a number nor a name of 1 to 256 bytes"),
            ({"channels": {0: {"hue": 1}}}, "channels[0] has the field 'hue', must be one of: color, range, gamma"),
            ({"channels": {"a": {"color": "#ff000080"}}}, "channels['a'] color '#ff000080' has an opacity of 0.50"),
            ({"channels": {0: {"gamma": 0}}}, "channels[0] gamma 0 is out of range [0.01, 100]"),
            ({"channels": {0: {"opacity": 2}}}, "channels[0] opacity 2 is out of range [0, 1]"),
            ({"channels": {0: {"range": (5, 1)}}}, "channels[0] range (5, 1) must rise"),
            ({"channels": {0: "red"}}, "channels[0] 'red' is no look"),
            ({"channels": 1.5}, "channels 1.5 is neither a number nor a name"),
            ({"blend": "multiply"}, "blend 'multiply' is not one of auto, add, over, max"),
            ({"time": 1.5}, "time 1.5 must be a text of 1 to 256 bytes"),
            ({"channel": 1}, "there is no option 'channel'; did you mean 'channels'?"),
            ({"isovalue": [3, 3]}, "isovalue [3, 3] has the value 3 twice"),
            ({"transfer": "none.json"}, "transfer 'none.json' does not exist"),
            ({"transfer": 3}, "transfer 3 is neither the name of a preset nor a colour map of ParaView or matplotlib"),
            ({"look_at": (1e301, 0, 0)}, "look_at 1e+301 is out of range [-1e+300, 1e+300]"),
            ({"transfer": {"Points": []}}, "transfer: not a colour map: RGBPoints is missing"),
            ({"transfer": {"Regions": [{"Values": [0, 1], "Color": [1, 1, 1]}]}}, "transfer: Regions[0] must have either Corners or Values and Slopes"),
            ({"transfer": {"Regions": [{"Corners": [0, 1], "Color": [1, 1, 1]}]}},
             "transfer: Regions[0].Corners must be an array of 6 to 64 numbers, 2 a corner"),
            ({"transfer": {"Regions": [{"Shape": 1}]}}, "transfer: Regions[0] has the field 'Shape', must be one of: Corners, Values"),
            ({"camera": {"lens": 1}}, "camera has the field 'lens', which cameras do not have"),
            ({"view": "left", "azimuth": 3}, "view excludes azimuth"),
            ({"up": (0, 0, 1)}, "up requires eye"),
            ({"labels": "atlas.nii"}, "labels 'atlas.nii' must be True"),
            ({"azimut": 3}, "there is no option 'azimut'; did you mean 'azimuth'?"),
            ({"output": "a.png"}, "there is no option 'output'"),
        ):
            with self.subTest(given=given), self.assertRaises(ss.SlabstreamError) as caught:
                draft_of("a", given)
            self.assertTrue(str(caught.exception).startswith(sentence), f"{caught.exception} is not {sentence}")
            self.assertNotIn("\n", str(caught.exception))
        self.assertRaises(ValueError, draft_of, "a", {"zoom": 0})
        self.assertRaises(TypeError, draft_of, "a", {"azimut": 0})
        self.assertRaises(ss.InvalidArgument, draft_of, "", {})

    def test_mistakes_of_slices(self) -> None:
        for given, sentence in (
            ({"index": 3}, "index 3 is the number of a slice of one plane, but there are 3"),
            ({"plane": "x", "index": 3, "at": (0, 0, 0)}, "index excludes at"),
            ({"level": 3}, "level requires window"),
            ({"window": "bones"}, "window 'bones' is neither a number nor one of bone, lung"),
            ({"title": "two\nlines"}, "title 'two\\nlines' must be one line"),
            ({"thickness": 3, "labels": True}, "thickness 3 is no plane"),
            ({"azimuth": 3}, "there is no option 'azimuth'"),
        ):
            with self.subTest(given=given), self.assertRaises(ss.InvalidArgument) as caught:
                slice_drafts_of("a", given)
            self.assertTrue(str(caught.exception).startswith(sentence), str(caught.exception))


class Names(unittest.TestCase):
    def test_presets_are_those_of_the_command_line(self) -> None:
        presets = ss.presets()
        self.assertIn("mri-head", presets)
        self.assertIn("bones", presets["ct-bone"])

    def test_one_number_is_a_spacing(self) -> None:
        self.assertEqual(check_spacing(2), check_spacing((2, 2, 2)))
        self.assertEqual(check_spacing(np.float32(0.5)), (0.5, 0.5, 0.5))
        self.assertRaises(ss.InvalidArgument, check_spacing, 0)
        self.assertRaises(ss.InvalidArgument, check_spacing, (1, 2))

    def test_without_a_desktop_show_says_what_to_do(self) -> None:
        image = ss.Image(np.zeros((2, 2, 4), np.float32))
        with unittest.mock.patch.dict(os.environ, {"DISPLAY": "", "WAYLAND_DISPLAY": ""}), self.assertRaises(ss.Unavailable) as caught:
            image.show()
        self.assertIn("save()", str(caught.exception))


class Pictures(unittest.TestCase):
    def test_png_files_are_read_back_the_same(self) -> None:
        rgba = np.zeros((3, 5, 4), np.float32)
        rgba[1] = (0.5, 0.25, 0, 0.5)
        rgba[2] = (2, 0, 0.7, 1)
        image = ss.Image(rgba)
        np.testing.assert_array_equal(np.asarray(image)[1:, 0], [[255, 128, 0, 128], [255, 0, 179, 255]])
        for bits in (8, 16):
            np.testing.assert_array_equal(client_support.read_png(image.png(bits))[..., 3] > 0, rgba[..., 3] > 0)
        np.testing.assert_array_equal(client_support.read_png(image._repr_png_()), np.asarray(image))
        try:
            import PIL.Image
        except ImportError:
            return
        np.testing.assert_array_equal(np.asarray(PIL.Image.open(io.BytesIO(image.png()))), np.asarray(image))
        self.assertEqual(PIL.Image.fromarray(np.asarray(image)).size, image.size)


if __name__ == "__main__":
    unittest.main()
