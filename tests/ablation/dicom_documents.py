"""Files of DICOM by pydicom: each element of a data set, in sequences too, is a node."""

import pathlib

import numpy as np
import pydicom
from pydicom.datadict import keyword_for_tag, tag_for_keyword
from pydicom.dataelem import DataElement
from pydicom.multival import MultiValue
from pydicom.uid import DeflatedExplicitVRLittleEndian, ExplicitVRBigEndian, ExplicitVRLittleEndian, ImplicitVRLittleEndian, RLELossless

from ablation import CannotWrite, Change, Document, Node

FREE_TEXT = ("LO", "SH", "ST", "LT", "UT", "PN", "UC")
# Texts that are no free texts: PS3.3 lists terms for them, or they are codes.
CODES = (
    "RescaleType",
    "ModalityLUTType",
    "CodeValue",
    "CodingSchemeDesignator",
    "LUTLabel",
    "ReconstructionMethod",
    "ScatterCorrectionMethod",
    "PixelSpacingCalibrationDescription",
)
# Identifiers that say to readers of images what they have to do with them.
CLASSES = ("SOPClassUID", "MediaStorageSOPClassUID", "TransferSyntaxUID", "FrameOfReferenceUID")
ROLES = {
    "RescaleSlope": "scale",
    "RescaleIntercept": "offset",
    "DoseGridScaling": "scale",
    "PixelPaddingValue": "fill",
    "Units": "unit",
    "DoseUnits": "unit",
    "PixelSpacing": "spacing",
    "SpacingBetweenSlices": "spacing",
    "GridFrameOffsetVector": "spacing",
    "ImagePositionPatient": "affine",
    "ImageOrientationPatient": "affine",
    "RealWorldValueSlope": "scale",
    "RealWorldValueIntercept": "offset",
    "MaximumFractionalValue": "scale",
}
NAMES = {
    "ImagePositionPatient": ("position", "slices"),
    "ImageOrientationPatient": ("orientation", "direction"),
    "PixelSpacing": ("spacing",),
    "Rows": ("pixels", "sizes"),
    "Columns": ("pixels", "sizes"),
    "NumberOfFrames": ("frames", "single slice"),
    "SamplesPerPixel": ("colour", "samples a pixel"),
    "PhotometricInterpretation": ("colour", "MONOCHROME"),
    "PixelData": ("pixels",),
    "FloatPixelData": ("pixels", "Pixel Data"),
    "TransferSyntaxUID": ("transfer syntax",),
    "ImageType": ("localizer", "mosaic", "type"),
    "BitsAllocated": ("bits", "bytes of pixels"),
    "SegmentNumber": ("segment",),
    "SegmentIdentificationSequence": ("segment",),
    "SegmentLabel": ("labels",),
    "PixelRepresentation": ("type", "int8"),
    "DetectorInformationSequence": ("place",),
    "ReferencedSegmentNumber": ("segment",),
    "SeriesInstanceUID": ("series",),
    "SOPInstanceUID": ("copies", "copy"),
    "SliceVector": ("slice",),
    "ModalityLUTSequence": ("Modality LUT",),
    "PlanePositionSequence": ("position",),
    "PlaneOrientationSequence": ("orientation", "direction"),
    "PixelMeasuresSequence": ("spacing",),
    "PerFrameFunctionalGroupsSequence": ("position", "frame"),
    "SharedFunctionalGroupsSequence": ("orientation", "spacing"),
}
SYNTAXES = {
    "implicit": ImplicitVRLittleEndian,
    "big endian": ExplicitVRBigEndian,
    "deflated": DeflatedExplicitVRLittleEndian,
    "RLE": RLELossless,
}
COMMON_GROUPS = (0x0002, 0x0008, 0x0010, 0x0032, 0x0040)
OF_KIND = ("ImageType", "SOPClassUID")  # of these groups, what depends on the kind of object
# Of other groups: series, equipment, frame of reference, pixels (PS3.3 C.7.3 to C.7.6).
COMMON = (
    "AcquisitionNumber",
    "InstanceNumber",
    "Laterality",
    "PositionReferenceIndicator",
    "StudyID",
    "StudyInstanceUID",
    "SeriesNumber",
    "SeriesInstanceUID",
    "FrameOfReferenceUID",
    "SoftwareVersions",
    "DeviceSerialNumber",
    "ProtocolName",
    "BodyPartExamined",
    "PatientPosition",
    "BurnedInAnnotation",
    "LossyImageCompression",
    "SamplesPerPixel",
    "PhotometricInterpretation",
    "Rows",
    "Columns",
    "SliceThickness",
    "ContentLabel",
    "ContentDescription",
    "ContentCreatorName",
)


def is_common(element, keyword):
    return keyword in COMMON or (element.tag.group in COMMON_GROUPS and keyword not in OF_KIND)


def plain_value(element):
    value = element.value
    if isinstance(value, (MultiValue, list)):
        return [plain_value(DataElement(element.tag, element.VR, v)) for v in value]
    if element.VR in ("DS", "FL", "FD") and value not in ("", None):
        return float(value)
    if element.VR in ("IS", "US", "SS", "UL", "SL") and value not in ("", None):
        return int(value)
    if element.VR == "AT":
        return int(value)
    return value if isinstance(value, bytes) else "" if value is None else str(value)


def element_of(tag, vr, value):
    try:
        if vr == "DS":
            value = (
                [f"{float(v):.10g}" for v in value] if isinstance(value, (list, tuple)) else f"{float(value):.10g}" if value != "" else ""
            )
        if vr in ("IS", "US", "SS", "UL", "SL", "AT"):
            value = [int(v) for v in value] if isinstance(value, (list, tuple)) else int(value) if value != "" else ""
        return DataElement(tag, vr, value)
    except (TypeError, ValueError, OverflowError) as error:
        raise CannotWrite(str(error)) from error


def kind_of(keyword, vr):
    if vr == "UI":
        return "" if keyword in CLASSES else "identifier"
    if vr in ("DA", "TM", "DT"):
        return "date"
    return "comment" if vr in FREE_TEXT and keyword not in CODES else ""


def name_of(tag):
    return keyword_for_tag(tag) or f"{tag.group:04x},{tag.element:04x}"


class DicomDocument(Document):
    """Files that say something in common: a change changes each of them. `name`: of the kind of object, in paths. What objects of all kinds
    say (patient, study, equipment: groups 0008, 0010, ...) has the name `common`, and is told only if `common`, so that it is not changed
    in each of many samples. `groups`: only elements of these groups are nodes."""

    def __init__(self, paths, name, common=False, groups=None):
        self.paths, self.name, self.common, self.groups = [pathlib.Path(path) for path in paths], name, common, groups
        self.sets = [pydicom.dcmread(path) for path in self.paths]
        self.syntax = None

    def nodes(self):
        nodes = list(self._walk([s.file_meta for s in self.sets], "")) if self.common else []
        return nodes + list(self._walk(self.sets, ""))

    def _walk(self, sets, path):
        for element in sets[0]:
            if not path and self.groups and element.tag.group not in self.groups:
                continue
            if element.tag.element == 0:
                continue  # lengths of groups, which the writer counts
            keyword = name_of(element.tag)
            shared = not path and not self.groups and is_common(element, keyword)
            if shared and not self.common:
                continue
            here = f"{path or ('common' if shared else self.name)}/{keyword}"
            yield self._node(here, keyword, element, sets)
            if element.VR == "SQ":
                for item in range(len(element.value)):
                    inside = [s[element.tag].value[item] for s in sets if element.tag in s and item < len(s[element.tag].value)]
                    yield Node(
                        f"{here}/*", None, None, lambda s=sets, t=element.tag, i=item: self._remove_item(s, t, i), NAMES.get(keyword, ())
                    )
                    yield from self._walk(inside, f"{here}/*")

    @staticmethod
    def _remove_item(sets, tag, item):
        for each in sets:
            del each[tag].value[item]

    def _node(self, path, keyword, element, sets):
        sequence = element.VR == "SQ"
        binary = element.VR in ("OB", "OW", "OF", "OD", "OB or OW")
        node = Node(
            path,
            None if sequence or binary else plain_value(element),
            None if sequence or binary else lambda new, t=element.tag, vr=element.VR: self._set(sets, t, vr, new),
            lambda t=element.tag: self._remove(sets, t),
            NAMES.get(keyword, ()),
            ROLES.get(keyword, ""),
            kind_of(keyword, element.VR),
        )
        if keyword == "TransferSyntaxUID":
            node.more = [Change(name, lambda s=s: setattr(self, "syntax", s), same=True) for name, s in SYNTAXES.items()]
        elif keyword == "ImageOrientationPatient":
            node.more = [Change("axes exchanged", lambda v=node.value: node.set(v[3:] + v[:3]))]
        elif keyword == "BitsAllocated" and node.value == 16 and not self.groups:
            node.more = [Change("samples of 32 bits", self._widen, same=True)]
        return node

    @staticmethod
    def _set(sets, tag, vr, value):
        for each in sets:
            each[tag] = element_of(tag, vr, value)

    @staticmethod
    def _remove(sets, tag):
        for each in sets:
            if tag in each:
                del each[tag]

    def _widen(self):
        for each in self.sets:
            signed = each.PixelRepresentation == 1
            stored = np.frombuffer(each.PixelData, np.int16 if signed else np.uint16)
            each.PixelData = stored.astype(np.int32 if signed else np.uint32).tobytes()
            each.BitsAllocated, each.BitsStored, each.HighBit = 32, 32, 31

    def add(self, path, value):
        words = path.split("/")
        inside = list(self.sets)
        for word in words[1:-1]:
            if word != "*":
                if any(word not in s for s in inside):
                    raise CannotWrite(path)
                inside = [s.get(word).value[0] for s in inside]
        tag = tag_for_keyword(words[-1])
        if tag is None or value is None:
            raise CannotWrite(path)
        for each in inside:
            if tag in each:
                raise CannotWrite(path)
            each[tag] = element_of(tag, pydicom.datadict.dictionary_VR(tag), value)

    def save(self):
        for path, each in zip(self.paths, self.sets):
            little = True
            if self.syntax == RLELossless:
                each.compress(RLELossless, generate_instance_uid=False)
            elif self.syntax is not None:
                each.file_meta.TransferSyntaxUID = self.syntax
                if self.syntax == ExplicitVRBigEndian and "PixelData" in each and each.BitsAllocated == 16:
                    each.PixelData = np.frombuffer(each.PixelData, "<u2").astype(">u2").tobytes()
                little = self.syntax != ExplicitVRBigEndian
            syntax = each.file_meta.get("TransferSyntaxUID", "")
            if syntax in SYNTAXES.values() or syntax == ExplicitVRLittleEndian:
                each.save_as(path, enforce_file_format=False)
            else:
                each.save_as(path, implicit_vr=False, little_endian=little, enforce_file_format=False)
