"""DICOM: series that pydicom writes in the transfer syntaxes that it encodes, and the volumes of its test files."""
import glob
import importlib.util
import os
import warnings

import numpy as np
import pydicom
from pydicom.dataset import FileDataset, FileMetaDataset
from pydicom.uid import ExplicitVRBigEndian, ExplicitVRLittleEndian, ImplicitVRLittleEndian, JPEG2000Lossless, JPEGLSLossless, RLELossless, generate_uid

from case import LPS, Case, turned

SYNTAXES = [ImplicitVRLittleEndian, ExplicitVRLittleEndian, ExplicitVRBigEndian, RLELossless, JPEGLSLossless, JPEG2000Lossless]


def series(random, folder, number):
    syntax = SYNTAXES[number % len(SYNTAXES)]
    rows, columns, slices = *(int(n) for n in random.integers(32, 50, 2)), int(random.integers(3, 9))
    bits, signed = int(random.choice([8, 12, 16])), bool(random.integers(2))
    least = -(1 << bits - 1) if signed else 0
    dtype = np.dtype(("i" if signed else "u") + ("1" if bits == 8 else "2"))
    voxels = random.integers(least, least + (1 << bits), (slices, rows, columns)).astype(dtype)
    axes, spacing, origin = turned(random), random.uniform(0.3, 4, 3), random.normal(scale=100, size=3)
    slope, intercept = int(random.integers(1, 4)), int(random.integers(-1000, 1000))
    place = os.path.join(folder, f"series{number}")
    os.makedirs(place)
    uid = generate_uid()
    for k in random.permutation(slices):
        meta = FileMetaDataset()
        meta.MediaStorageSOPClassUID, meta.MediaStorageSOPInstanceUID = "1.2.840.10008.5.1.4.1.1.2", generate_uid()
        meta.TransferSyntaxUID = syntax if not syntax.is_encapsulated else ExplicitVRLittleEndian
        slice_ = FileDataset(os.path.join(place, f"{random.integers(1 << 30)}-{k}"), {}, file_meta=meta, preamble=b"\0" * 128,
                             is_implicit_VR=syntax == ImplicitVRLittleEndian, is_little_endian=syntax != ExplicitVRBigEndian)
        slice_.SOPClassUID, slice_.SOPInstanceUID = meta.MediaStorageSOPClassUID, meta.MediaStorageSOPInstanceUID
        slice_.Modality, slice_.SeriesInstanceUID, slice_.SeriesNumber = "CT", uid, 1
        slice_.ImagePositionPatient = [f"{x:.10g}" for x in origin + axes[:, 2] * spacing[2] * k]
        slice_.ImageOrientationPatient = [f"{x:.12g}" for x in [*axes[:, 0], *axes[:, 1]]]
        slice_.PixelSpacing = [f"{spacing[1]:.10g}", f"{spacing[0]:.10g}"]
        slice_.Rows, slice_.Columns, slice_.SamplesPerPixel, slice_.PhotometricInterpretation = rows, columns, 1, "MONOCHROME2"
        slice_.BitsAllocated, slice_.BitsStored, slice_.HighBit = 8 * dtype.itemsize, bits, bits - 1
        slice_.PixelRepresentation, slice_.RescaleSlope, slice_.RescaleIntercept = int(signed), slope, intercept
        big = syntax == ExplicitVRBigEndian
        slice_.PixelData = voxels[k].astype(dtype.newbyteorder(">") if big else dtype).tobytes()
        slice_["PixelData"].VR = "OW" if bits > 8 else "OB"
        if syntax.is_encapsulated:
            slice_.compress(syntax, generate_instance_uid=False)
        slice_.save_as(slice_.filename, enforce_file_format=True)
    affine = np.eye(4)
    affine[:3, :3], affine[:3, 3] = axes * spacing, origin
    values = voxels.transpose(2, 1, 0).astype(np.int64) * slope + intercept
    return Case(f"series {number} {syntax.name} {dtype} {bits} bits", place, values, LPS @ affine)


def enhanced(path):
    """The frames of a multi-frame file in the order of their places; None: it is no such volume."""
    data = pydicom.dcmread(path, force=True)
    groups = data.get("PerFrameFunctionalGroupsSequence")
    if not groups or len(groups) < 2 or int(data.get("SamplesPerPixel", 1)) != 1 or "SegmentSequence" in data:
        return None
    shared = data.SharedFunctionalGroupsSequence[0]

    def of(frame, sequence):
        return (frame if sequence in frame else shared)[sequence][0]

    row, column = np.array(of(groups[0], "PlaneOrientationSequence").ImageOrientationPatient, float).reshape(2, 3)
    spacing = np.array(of(groups[0], "PixelMeasuresSequence").PixelSpacing, float)
    places = np.array([of(frame, "PlanePositionSequence").ImagePositionPatient for frame in groups], float)
    order = np.argsort(places @ np.cross(row, column))
    steps = np.diff(places[order], axis=0)
    if np.linalg.norm(steps, axis=1).min() < 1e-3 or np.ptp(steps, axis=0).max() > 1e-3:
        return None
    transform = [of(groups[k], "PixelValueTransformationSequence") for k in order]
    values = np.array([data.pixel_array[k] * float(t.RescaleSlope) + float(t.RescaleIntercept) for k, t in zip(order, transform)])
    affine = np.eye(4)
    affine[:3, :3] = np.c_[row * spacing[1], column * spacing[0], steps.mean(axis=0)]
    affine[:3, 3] = places[order[0]]
    return Case(os.path.basename(path), path, values.transpose(2, 1, 0), LPS @ affine)


def packaged():
    """Files of pydicom and pydicom-data. pydicom's own search for them would fetch more from the network."""
    folders = [os.path.join(os.path.dirname(pydicom.__file__), "data", "test_files")]
    if data := importlib.util.find_spec("data_store"):
        folders += [os.path.join(place, "data") for place in data.submodule_search_locations]
    return sorted(path for folder in folders for path in glob.glob(os.path.join(folder, "**", "*.dcm"), recursive=True))


def cases(random, folder, count, skipped):
    warnings.simplefilter("ignore")  # pydicom's, about files that are wrong on purpose
    for path in packaged():
        try:
            case = enhanced(path)
        except Exception:  # files that are wrong on purpose, and syntaxes without a decoder here
            continue
        if case:
            yield case
    for number in range(count):
        yield series(random, folder, number)
