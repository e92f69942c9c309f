#!/usr/bin/env python3
"""Holds channels, times and overlays against what other programs wrote (deploy/check fields).

Other programs write images of several channels and times. `slabstream info` must tell their names, colours, windows and times,
`slabstream value` their samples, and slices and largest values of a channel, or of the channels that show, at a time must be what numpy and
scipy make of the array. An overlay on a turned grid of its own must have the values that scipy.ndimage.map_coordinates interpolates. A line
for each family, and one for each file that differs, with its command. Exit status 1 if one did.
"""
import argparse
import json
import os
import re
import shlex
import subprocess
import sys
import tempfile
import time

import numpy as np
import SimpleITK
from PIL import Image
from scipy.ndimage import map_coordinates

from files import FAMILIES, Overlay

LPS = np.array([-1, -1, 1])  # from left, posterior, superior to right, anterior, superior
SCALE = 7  # pixels of a voxel of a slice
CODES = 0.51  # by which a code of 8 bits may differ: it is rounded
NEAR = 1e-3  # of a voxel, within which a point is as well outside as inside of a volume


class Wrong(Exception):
    """What differs, in one line."""


class Program:
    def __init__(self, path):
        self.path = path

    def run(self, *arguments):
        """What it prints."""
        ran = subprocess.run([self.path, *map(str, arguments)], capture_output=True, text=True, timeout=300, stdin=subprocess.DEVNULL, check=False)
        if ran.returncode != 0:
            raise Wrong(f"{shlex.join(['slabstream', *map(str, arguments)])[:600]}: {ran.stderr.strip()}")
        return ran.stdout

    def values(self, source, places, *options):
        points = [word for place in places for word in ("--at", ",".join(repr(float(x)) for x in place))]
        return json.loads(self.run("value", source, "--local", "--json", *options, *points))

    def picture(self, command, source, *options):
        """Codes of R, G, B, A, and the file."""
        with tempfile.NamedTemporaryFile(suffix=".png") as file:
            self.run(command, source, "--local", "-o", file.name, *options)
            return np.asarray(Image.open(file.name).convert("RGBA")).astype(int), self.run("info", file.name)


def agree(what, found, expected, tolerance=0.0):
    if expected is None or isinstance(expected, (str, bool)):
        same = found == expected
    else:
        same = found is not None and np.allclose(found, expected, rtol=tolerance, atol=tolerance)
    if not same:
        raise Wrong(f"{what} is {found}, must be {expected}")


def called(random, case, channel):
    """The channel by its name or its number. A name goes before a number."""
    name = case.names[channel]
    return str(channel) if not name or (str(channel) not in case.names and random.random() < 0.5) else name


def in_a_list(name):
    return re.sub(r"([\\,=])", r"\\\1", name)


def check_info(program, case):
    told = json.loads(program.run("info", case.path, "--json"))
    agree("the number of times", told["times"], case.voxels.shape[0])
    agree("the step of times", told["time_step"], case.time_step, 1e-6)
    agree("the spacing", told["spacing"], case.spacing, 1e-6)
    agree("the number of channels", len(told["channels"]), case.voxels.shape[1])
    for number, channel in enumerate(told["channels"]):
        agree(f"the name of channel {number}", channel["name"], case.names[number])
        agree(f"the colour of channel {number}", channel["color"], case.colours[number])
        agree(f"whether channel {number} shows", channel["shown"], case.shown[number])
        window = channel["window"] and (channel["window"]["min"], channel["window"]["max"])
        agree(f"the window of channel {number}", window, case.windows[number], 1e-6)


def time_of(random, case, number):
    last = case.voxels.shape[0] - 1
    return str(random.choice([str(number), f"{number * case.time_step!r}s", "last" if number == last else str(number)]))


def check_values(program, case, random):
    for number in range(case.voxels.shape[0]):
        for channel in range(case.voxels.shape[1]):
            voxels = case.voxels[number, channel]
            at = np.unique(random.integers(0, voxels.shape, (20, 3)), axis=0)
            name = called(random, case, channel)
            options = ["--channel", in_a_list(name), "--time", time_of(random, case, number)]
            for sample, voxel in zip(program.values(case.path, at[:, ::-1] * case.spacing, *options), at):
                agree(f"{shlex.join(options)}: the value at {voxel.tolist()} (z, y, x)", sample["value"], voxels[tuple(voxel)], 1e-6)


def plane(voxels, size):
    """A slice, interpolated at the pixels of a picture that it fills; y goes up."""
    y, x = np.mgrid[: size[1], : size[0]]
    return map_coordinates(voxels.astype(float), [(size[1] - y - 0.5) / SCALE - 0.5, (x + 0.5) / SCALE - 0.5], order=1, mode="nearest")


def ramp(values, window):
    return np.clip((values - window[0]) / (window[1] - window[0]), 0, 1)


def rgb(colour):
    return np.array(list(bytes.fromhex(colour[1:]))) / 255


def check_pictures(program, case, random):
    times, channels, slices, height, width = case.voxels.shape
    number, channel, index = (int(random.integers(count)) for count in (times, channels, slices))
    name, when, size = in_a_list(called(random, case, channel)), time_of(random, case, number), (width * SCALE, height * SCALE)
    of_channel = case.voxels[number, channel]
    window = float(of_channel.min()), float(of_channel.max())
    look = ["--channel", name, "--time", when, "--channel-color", f"{name}=white", "--channel-range", f"{name}={window[0]!r}:{window[1]!r}"]
    options = ["--plane", "z", "--index", index, "--size", f"{size[0]}x{size[1]}"]
    found, _ = program.picture("slice", case.path, *options, *look)
    compare("slice", [*options, *look], found[..., 0], 255 * ramp(plane(of_channel[index], size), window))

    # All that show, in the file's colours and windows: light adds.
    if all(case.windows) and sum(case.shown) <= 4:
        found, _ = program.picture("slice", case.path, *options, "--time", when)
        light = sum(ramp(plane(case.voxels[number, c, index], size), case.windows[c])[..., None] * rgb(case.colours[c])
                    for c in range(channels) if case.shown[c])
        compare("slice", [*options, "--time", when], found[..., :3], 255 * np.minimum(1, light))

    # The largest of a column of voxels, where the picture's record says that a pixel lies.
    options = ["--renderer", "mip", "--view", "top", "--size", "64"]
    found, record = program.picture("render", case.path, *options, *look)
    numbers = {key: np.array(rest.split(), float) for key, rest in re.findall(r"^  (target|pixel_size) +(.*)$", record, re.MULTILINE)}
    y, x = np.mgrid[:64, :64]
    across = numbers["pixel_size"] / case.spacing[0]
    at = [numbers["target"][1] / case.spacing[1] + (31.5 - y) * across, numbers["target"][0] / case.spacing[0] + (x - 31.5) * across]
    columns = [map_coordinates(of_channel[k].astype(float), at, order=1, mode="nearest") for k in range(slices)]
    inside = np.all([(a > -0.5 + NEAR) & (a < side - 0.5 - NEAR) for a, side in zip(at, (height, width))], axis=0)
    compare("render", [*options, *look], found[..., 3][inside], 255 * ramp(np.max(columns, axis=0), window)[inside])


def compare(command, options, found, expected, tolerance=CODES):
    difference = np.abs(found - expected)
    if difference.max() > tolerance:
        at = np.unravel_index(difference.argmax(), difference.shape)
        raise Wrong(f"{command} {shlex.join(map(str, options))}: pixel {[int(i) for i in at]} is {found[at]}, must be {expected[at]:.2f}")


def interpolated(image, places):
    """At places of ITK's world, and by how many voxels these lie outside."""
    matrix = np.array(image.GetDirection()).reshape(3, 3) * image.GetSpacing()
    at = (np.linalg.inv(matrix) @ (places.reshape(-1, 3) - image.GetOrigin()).T)[::-1]
    voxels = SimpleITK.GetArrayFromImage(image).astype(float)
    sides = np.array(voxels.shape)[:, None]
    values, beyond = map_coordinates(voxels, at, order=1, mode="nearest"), np.max(np.abs(at - (sides - 1) / 2) - sides / 2, axis=0)
    return values.reshape(places.shape[:-1]), beyond.reshape(places.shape[:-1])


def check_overlay(program, case, random):
    """The overlay's value is that at the centre of the volume's voxel."""
    image = case.image
    indices = np.unique(random.integers(0, image.GetSize(), (80, 3)), axis=0)
    places = np.array([image.TransformIndexToPhysicalPoint(index.tolist()) for index in indices])
    expected, beyond = interpolated(case.overlay, places)
    for sample, index, value, far in zip(program.values(case.path, places * LPS, "--overlay", case.overlay_path), indices, expected, beyond):
        agree(f"the volume's value at {index.tolist()}", sample["value"], image.GetPixel(index.tolist()), 1e-5)
        if abs(far) > NEAR:
            agree(f"the overlay's value at {index.tolist()}", sample["fields"][1]["value"], value if far < 0 else None, 2e-3)
    if image.GetDirection() == (1, 0, 0, 0, 1, 0, 0, 0, 1):
        check_covered_slice(program, case, random)


def check_covered_slice(program, case, random):
    """The overlay covers the volume where it is. To the right and up are a patient's right and anterior, against ITK's x and y."""
    width, height, slices = case.image.GetSize()
    index, size = int(random.integers(slices)), (width * SCALE, height * SCALE)
    look = ["--channel-color", "0=white,overlay=white", "--channel-range", "0=-200:200,overlay=-200:200"]
    options = ["--overlay", case.overlay_path, "--plane", "z", "--index", index, "--size", f"{size[0]}x{size[1]}", *look]
    found, _ = program.picture("slice", case.path, *options)
    y, x = np.mgrid[: size[1], : size[0]]
    at = np.stack([width - 0.5 - (x + 0.5) / SCALE, (y + 0.5) / SCALE - 0.5, np.full(x.shape, index)], axis=-1)
    places = at * case.image.GetSpacing() + case.image.GetOrigin()
    (under, _), (over, beyond) = interpolated(case.image, places), interpolated(case.overlay, places)
    sure = np.abs(beyond) > NEAR
    expected = 255 * ramp(np.where(beyond < 0, over, under), (-200, 200))
    compare("slice", options, found[..., 0][sure], expected[sure], 0.6)  # float32 places the overlay


def what_is_wrong(program, case, random):
    """"": nothing."""
    try:
        if isinstance(case, Overlay):
            check_overlay(program, case, random)
            return ""
        check_info(program, case)
        check_values(program, case, random)
        check_pictures(program, case, random)
        return ""
    except Wrong as wrong:
        return str(wrong)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", required=True, help="slabstream")
    parser.add_argument("--seed", type=int, default=int(time.time()), help="default: the time")
    parser.add_argument("--family", action="append", choices=FAMILIES, help="only these; may be repeated")
    parser.add_argument("--random", type=int, default=20, metavar="COUNT", help="files of a family (default 20)")
    parser.add_argument("--keep", metavar="FOLDER", help="write the files there, and leave them")
    options = parser.parse_args()
    print(f"seed {options.seed}", flush=True)
    failed = 0
    with tempfile.TemporaryDirectory() as temporary:
        folder = options.keep or temporary
        os.makedirs(folder, exist_ok=True)
        for family in options.family or FAMILIES:
            random = np.random.default_rng([options.seed, list(FAMILIES).index(family)])
            wrong = []
            for number in range(options.random):
                case = FAMILIES[family](random, folder, number)
                if said := what_is_wrong(Program(options.program), case, random):
                    wrong.append(f"  {case.name} {os.path.basename(case.path)}: {said}")
            print("\n".join([f"{family:9} {options.random} files, {len(wrong)} differ", *wrong]), flush=True)
            failed += len(wrong)
    print(f"{failed} differ")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
