"""Compares what Slabstream makes of a changed file with what it made before, and with what the foreign reader makes of it."""
import re

import numpy as np

PLACES = 64
MOST_TIMES, MOST_CHANNELS = 6, 8  # of observe_sources.cpp


def plain(text):
    return re.sub(r"[^a-z0-9]", "", text.lower())


def names_of(node):
    """Words by which a message may name a node."""
    last = [word for word in node.path.split("/") if word not in ("*", "text") and not word.isdigit()][-1]
    return [plain(name) for name in (last.lstrip("@"), *node.names)]


def named(texts, node):
    said = plain(" ".join(texts))
    return any(name and name in said for name in names_of(node))


def voxel_places(answer, voxels):
    if answer.places is not None:
        return np.stack([np.asarray(answer.places[axis])[voxels[:, axis]] for axis in range(3)], axis=1)
    return (answer.affine @ np.c_[voxels, np.ones(len(voxels))].T).T[:, :3]


def our_voxels(level, places):
    """Voxel coordinates of places in the world."""
    steps = np.array(level["axes"], float) * np.array(level["spacing"], float)[:, None]  # row i: a step along axis i
    found = np.linalg.solve(steps.T, (places - np.array(level["origin"], float)).T).T
    for axis, letter in enumerate("xyz"):
        knots = level.get(f"places_{letter}")
        if knots:
            found[:, axis] = np.interp(found[:, axis], knots, np.arange(-1, len(knots) - 1))
    return found


def sorted_rows(rows):
    return rows[np.lexsort(rows.T)]


def shape_difference(observed, answer):
    for name, wanted in (("places", answer.vertices), ("triangles", answer.triangles), ("values", answer.values)):
        if wanted is None:
            continue
        got, wanted = observed.arrays[name], np.asarray(wanted, float)
        if got.size != wanted.size:
            return f"{got.size} numbers of {name}, must be {wanted.size}"
        got = got.reshape(wanted.shape)
        if name == "places":
            got, wanted = sorted_rows(got.round(3)), sorted_rows(wanted.round(3))
        if name != "triangles" and not np.allclose(got, wanted, rtol=1e-4, atol=2e-3, equal_nan=True):
            return f"{name} differ"
    return ""


def slanted(affine):
    """Whether the axes are not at right angles: such voxels are straightened, and lie elsewhere."""
    steps = affine[:3, :3] / np.maximum(np.linalg.norm(affine[:3, :3], axis=0), 1e-30)
    return bool(np.any(np.abs(steps.T @ steps - np.eye(3)) > 1e-3))


def difference(observed, answer, random):
    """Where what was observed differs from the foreign reader's answer, at 64 places of the world; "": nowhere."""
    for name, wanted in answer.facts.items():
        if observed.facts.get(name) != wanted:
            return f"{name} is {observed.facts.get(name)}, must be {wanted}"
    if answer.vertices is not None:
        return shape_difference(observed, answer) if "places" in observed.arrays else "is no shape"
    if not answer.fields or (answer.affine is not None and (not np.all(np.isfinite(answer.affine)) or slanted(answer.affine))):
        return ""
    level = observed.facts["levels"][0]
    size = level["size"]
    for (time, channel), wanted in answer.fields.items():
        if time >= MOST_TIMES or channel >= MOST_CHANNELS:
            continue
        name = f"t{time}c{channel}"
        if name not in observed.arrays:
            return f"time {time}, channel {channel} is not there"
        if observed.arrays[name].size != np.prod(size):
            continue  # another size than that of the first time and channel
        got = observed.arrays[name].reshape(size[::-1])
        voxels = np.unique(np.array([[i & 1, i >> 1 & 1, i >> 2 & 1] for i in range(8)]) * (np.array(wanted.shape) - 1), axis=0)
        voxels = np.unique(np.r_[voxels, random.integers(0, wanted.shape, (PLACES - len(voxels), 3))], axis=0)
        places = voxel_places(answer, voxels) if answer.affine is not None or answer.places is not None else None
        at = voxels.astype(float) if places is None else our_voxels(level, places)
        near = np.rint(at).astype(int)
        for voxel, exact, ours in zip(voxels, at, near):
            where = f"voxel {voxel.tolist()} of time {time}, channel {channel}"
            if np.any(ours < 0) or np.any(ours >= size):
                return f"{where} lies outside"
            if np.any(np.abs(exact - ours) > 0.02):
                return f"{where} lies between voxels"
            value, must = got[ours[2], ours[1], ours[0]], float(wanted[tuple(voxel)])
            if not np.isclose(value, must, rtol=answer.tolerance, atol=1e-30, equal_nan=True):
                return f"{where} is {value}, must be {must}"
    return ""


def judge(node, change, before, after, foreign, random):
    """The verdict of a change, and why. `foreign`: the foreign reader's answer to the changed file; None: it reads none, or refuses it."""
    if after.broken:
        return "crashed", after.broken
    texts = [after.error] if after.error else [note for note in after.notes if note not in before.notes]
    gone = [note for note in before.notes if note not in after.notes]
    if after.error:
        return ("refused", "") if named(texts, node) else ("unnamed", after.error)
    wrong = difference(after, foreign, random) if foreign is not None else ""
    told = bool(texts) and named(texts, node)
    if change.same:
        same = after.arrays.keys() == before.arrays.keys() and all(
            np.allclose(a, before.arrays[name], rtol=1e-6, equal_nan=True) for name, a in after.arrays.items())
        return ("told", "") if told else ("used", "") if same else ("wrong", wrong or "the samples differ")
    if after == before:
        return ("wrong", f"nothing changed, but {wrong}") if wrong else ("ignored", "")
    if told:
        return "told", ""
    if wrong:
        return "wrong", wrong
    if not after.same_data(before):
        return "used", ""
    return ("told", "") if named(gone, node) else ("unnamed", " / ".join(texts))
