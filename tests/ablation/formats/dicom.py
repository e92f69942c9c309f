"""DICOM by pydicom: series of files, enhanced multi-frame objects, dose, segmentations, SPECT. The foreign reader is pydicom; voxels lie
by the standard (PS3.3 C.7.6.2, C.7.6.16, C.8.8.3, C.8.4.15), and values are those of the Modality LUT (C.11.1)."""

import collections

import numpy as np
import pydicom
from pydicom.dataset import Dataset, FileDataset, FileMetaDataset
from pydicom.sequence import Sequence
from pydicom.uid import ExplicitVRLittleEndian, generate_uid

from ablation import Answer, Sample
from dicom_documents import DicomDocument

CT, MR, PET, NM = "1.2.840.10008.5.1.4.1.1.2", "1.2.840.10008.5.1.4.1.1.4", "1.2.840.10008.5.1.4.1.1.128", "1.2.840.10008.5.1.4.1.1.20"
ENHANCED_CT, ENHANCED_MR = "1.2.840.10008.5.1.4.1.1.2.1", "1.2.840.10008.5.1.4.1.1.4.1"
ENHANCED_PET, DOSE, SEG = "1.2.840.10008.5.1.4.1.1.130", "1.2.840.10008.5.1.4.1.1.481.2", "1.2.840.10008.5.1.4.1.1.66.4"
PARAMETRIC, LABELMAP = "1.2.840.10008.5.1.4.1.1.30", "1.2.840.10008.5.1.4.1.1.66.7"
SLICES, ROWS, COLUMNS = 4, 6, 7
TURN = np.deg2rad(8)
ALONG_ROW, ALONG_COLUMN = np.array([np.cos(TURN), np.sin(TURN), 0]), np.array([-np.sin(TURN), np.cos(TURN), 0])
SLICE_GROUPS = (0x0020, 0x0028, 0x0054)


def uid(*words):
    return generate_uid(entropy_srcs=[str(word) for word in ("ablation", *words)])


def code(value, scheme, meaning):
    item = Dataset()
    item.CodeValue, item.CodingSchemeDesignator, item.CodeMeaning = value, scheme, meaning
    return item


def item(**elements):
    made = Dataset()
    for keyword, value in elements.items():
        setattr(made, keyword, value)
    return made


def stored_values(shape, dtype, low=0, high=4000, seed=5):
    return np.random.default_rng(seed).integers(low, high, shape).astype(dtype)


def header(sop_class, modality, name, number=0):
    """What objects of all kinds say: patient, study, series, equipment."""
    meta = FileMetaDataset()
    meta.MediaStorageSOPClassUID, meta.MediaStorageSOPInstanceUID = sop_class, uid(name, number)
    meta.TransferSyntaxUID, meta.ImplementationClassUID, meta.ImplementationVersionName = ExplicitVRLittleEndian, uid("made"), "ABLATION_1"
    ds = FileDataset("", {}, file_meta=meta, preamble=b"\0" * 128)
    ds.SpecificCharacterSet = "ISO_IR 100"
    ds.ImageType = ["ORIGINAL", "PRIMARY", "AXIAL"]
    ds.SOPClassUID, ds.SOPInstanceUID, ds.Modality = sop_class, uid(name, number), modality
    ds.InstanceCreationDate, ds.InstanceCreationTime, ds.InstanceCreatorUID = "20240102", "101112", uid("creator")
    ds.StudyDate, ds.SeriesDate, ds.AcquisitionDate, ds.ContentDate = "20240102", "20240102", "20240102", "20240102"
    ds.StudyTime, ds.SeriesTime, ds.AcquisitionTime, ds.ContentTime = "101112", "101213", "101314", "101415"
    ds.AccessionNumber, ds.Manufacturer, ds.InstitutionName, ds.StationName = "A1", "SIEMENS", "Hospital", "CT1"
    ds.ReferringPhysicianName, ds.StudyDescription, ds.SeriesDescription = "Who^A", "Head", "Axial"
    ds.ManufacturerModelName, ds.SoftwareVersions, ds.DeviceSerialNumber, ds.ProtocolName = "Sensation", "VB40", "12345", "Head"
    ds.PatientName, ds.PatientID, ds.PatientBirthDate, ds.PatientSex, ds.PatientAge = "Doe^John", "P1", "19600102", "M", "064Y"
    ds.PatientWeight, ds.PatientSize = 70, 1.8
    ds.StudyInstanceUID, ds.SeriesInstanceUID, ds.FrameOfReferenceUID = uid("study"), uid("series", name), uid("frame")
    ds.StudyID, ds.SeriesNumber, ds.AcquisitionNumber, ds.InstanceNumber = "1", 3, 1, number + 1
    ds.PatientPosition, ds.PositionReferenceIndicator, ds.BodyPartExamined, ds.Laterality = "HFS", "OM", "HEAD", ""
    return ds


def set_pixels(ds, stored, bits_stored=None, photometric="MONOCHROME2"):
    """Of an image [row, column] or frames [frame, row, column]."""
    bits = stored.dtype.itemsize * 8
    ds.SamplesPerPixel, ds.PhotometricInterpretation = 1, photometric
    ds.Rows, ds.Columns = stored.shape[-2:]
    if stored.ndim == 3:
        ds.NumberOfFrames = stored.shape[0]
    ds.BitsAllocated, ds.BitsStored = bits, bits_stored or bits
    ds.HighBit, ds.PixelRepresentation = ds.BitsStored - 1, int(stored.dtype.kind == "i")
    data = stored.tobytes()
    ds.PixelData = data + b"\0" * (len(data) % 2)
    ds["PixelData"].VR = "OW" if bits > 8 else "OB"


def position(k, step):
    return [round(v, 6) for v in np.array([-30.0, -40.0, 20.0]) + k * step * np.cross(ALONG_ROW, ALONG_COLUMN)]


def set_plane(ds, k, step=2.5):
    ds.ImagePositionPatient = position(k, step)
    ds.ImageOrientationPatient = [round(float(v), 8) for v in (*ALONG_ROW, *ALONG_COLUMN)]
    ds.PixelSpacing = [0.8, 0.7]
    ds.SliceThickness, ds.SliceLocation = 2.5, 20 + k * step


def slices(folder, name, count, make, dtype, low, high):
    for k in range(count):
        ds = make(k)
        if "PixelData" not in ds:
            set_pixels(ds, stored_values((ROWS, COLUMNS), dtype, low, high, k))
        ds.save_as(folder / f"IM{(k * 7) % count:04d}", enforce_file_format=True)


def write_ct(folder, dtype=np.int16, bits=None, rescale=(1, -1024), photometric="MONOCHROME2"):
    def make(k):
        ds = header(CT, "CT", f"ct {np.dtype(dtype).name}", k)
        ds.KVP, ds.XRayTubeCurrent, ds.ExposureTime, ds.Exposure, ds.FilterType = 120, 200, 500, 100, "WEDGE"
        ds.ConvolutionKernel, ds.GantryDetectorTilt, ds.TableHeight, ds.RotationDirection = "H30s", 0, 150, "CW"
        ds.ReconstructionDiameter, ds.DataCollectionDiameter, ds.DistanceSourceToDetector, ds.FocalSpots = 250, 500, 1040, 0.7
        ds.GeneratorPower, ds.SpiralPitchFactor, ds.DistanceSourceToPatient, ds.ContrastBolusAgent = 40, 0.9, 570, "Iodine"
        set_plane(ds, k)
        set_pixels(ds, stored_values((ROWS, COLUMNS), dtype, 1, 4000, k), bits, photometric)
        ds.RescaleSlope, ds.RescaleIntercept, ds.RescaleType = rescale[0], rescale[1], "HU"
        ds.WindowCenter, ds.WindowWidth, ds.WindowCenterWidthExplanation = [40, 300], [400, 1500], ["WINDOW1", "WINDOW2"]
        ds.SmallestImagePixelValue, ds.LargestImagePixelValue = 0, 4000
        if dtype == np.uint16:
            ds.PixelPaddingValue, ds.PixelPaddingRangeLimit = 63, 0
            ds.RescaleType, ds.QuantityDefinitionSequence = "US", Sequence()
        ds.LossyImageCompression, ds.BurnedInAnnotation, ds.PixelAspectRatio = "00", "NO", [8, 7]
        del ds.PixelAspectRatio
        return ds

    slices(folder, "ct", SLICES, make, dtype, 1, 4000)


def mr_header(name, number):
    ds = header(MR, "MR", name, number)
    ds.ImageType = ["ORIGINAL", "PRIMARY", "M", "ND"]
    ds.ScanningSequence, ds.SequenceVariant, ds.ScanOptions, ds.MRAcquisitionType = "GR", "SK", "PFP", "3D"
    ds.SequenceName, ds.RepetitionTime, ds.EchoTime, ds.NumberOfAverages, ds.ImagingFrequency = "*fl3d", 20, 5, 1, 123.2
    ds.ImagedNucleus, ds.EchoNumbers, ds.MagneticFieldStrength, ds.SpacingBetweenSlices, ds.EchoTrainLength = "1H", 1, 3, 2.5, 1
    ds.PercentSampling, ds.PixelBandwidth, ds.FlipAngle, ds.SAR, ds.InPlanePhaseEncodingDirection = 100, 200, 15, 0.1, "ROW"
    ds.AcquisitionMatrix, ds.InversionTime = [0, 7, 6, 0], 900
    return ds


def write_echoes(folder):
    def make(k):
        ds = mr_header("echoes", k)
        ds.EchoNumbers, ds.EchoTime = k // 3 + 1, 5 + 10 * (k // 3)
        set_plane(ds, k % 3)
        return ds

    slices(folder, "echoes", 6, make, np.uint16, 1, 4000)


def write_cine(folder):
    def make(k):
        ds = mr_header("cine", k)
        ds.TriggerTime, ds.NominalInterval, ds.CardiacNumberOfImages, ds.HeartRate = 40 * (k // 2), 800, 3, 75
        ds.TemporalPositionIdentifier, ds.NumberOfTemporalPositions, ds.TemporalResolution = k // 2 + 1, 3, 40
        set_plane(ds, k % 2)
        ds.SmallestImagePixelValue, ds.LargestImagePixelValue = 0, 4000
        return ds

    slices(folder, "cine", 6, make, np.uint16, 1, 4000)


def write_pet(folder):
    def make(k):
        ds = header(PET, "PT", "pet", k)
        ds.ImageType = ["ORIGINAL", "PRIMARY"]
        ds.SeriesType, ds.Units, ds.CountsSource, ds.DecayCorrection = ["STATIC", "IMAGE"], "BQML", "EMISSION", "START"
        ds.CorrectedImage, ds.RandomsCorrectionMethod, ds.AttenuationCorrectionMethod = (
            ["NORM", "DTIM", "ATTN", "SCAT", "DECY"],
            "DLYD",
            "CT",
        )
        ds.ScatterCorrectionMethod, ds.ReconstructionMethod, ds.NumberOfSlices = "Model-based", "OSEM3D 4i8s", SLICES
        ds.ActualFrameDuration, ds.FrameReferenceTime, ds.DecayFactor, ds.DoseCalibrationFactor = 180000, 90000, 1.02, 1
        ds.ScatterFractionFactor, ds.DeadTimeFactor, ds.ImageIndex, ds.SUVType = 0.3, 1.01, k + 1, "BW"
        ds.CollimatorType, ds.PatientGantryRelationshipCodeSequence = "NONE", Sequence([code("F-10470", "SRT", "headfirst")])
        ds.PatientOrientationCodeSequence = Sequence([code("F-10450", "SRT", "recumbent")])
        ds.RadiopharmaceuticalInformationSequence = Sequence(
            [
                item(
                    Radiopharmaceutical="FDG",
                    RadiopharmaceuticalStartTime="093000",
                    RadionuclideTotalDose=370000000,
                    RadionuclideHalfLife=6586.2,
                    RadionuclidePositronFraction=0.97,
                    RadionuclideCodeSequence=Sequence([code("C-111A1", "SRT", "18F")]),
                )
            ]
        )
        set_plane(ds, k)
        ds.RescaleSlope, ds.RescaleIntercept, ds.RescaleType = 0.5 + 0.25 * k, 0, "BQML"
        return ds

    slices(folder, "pet", SLICES, make, np.int16, 1, 4000)


def write_dynamic_pet(folder):
    def make(k):
        ds = header(PET, "PT", "dynamic", k)
        ds.SeriesType, ds.Units, ds.DecayCorrection, ds.NumberOfTimeSlices, ds.NumberOfSlices = ["DYNAMIC", "IMAGE"], "GML", "START", 3, 2
        ds.ActualFrameDuration, ds.FrameReferenceTime, ds.ImageIndex, ds.SUVType = 60000, 30000 + 60000 * (k // 2), k + 1, "BW"
        ds.DecayFactor = 1 + 0.1 * (k // 2)
        set_plane(ds, k % 2)
        ds.RescaleSlope, ds.RescaleIntercept = 0.5 + 0.25 * (k // 2), 0
        return ds

    slices(folder, "dynamic", 6, make, np.int16, 1, 4000)


def multi_frame(sop_class, modality, name, stored, **pixels):
    ds = header(sop_class, modality, name)
    ds.ContentLabel, ds.ContentDescription, ds.ContentCreatorName = "IMAGE", "made", "Who^A"
    ds.PresentationLUTShape, ds.LossyImageCompression, ds.BurnedInAnnotation = "IDENTITY", "00", "NO"
    ds.AcquisitionDateTime, ds.AcquisitionDuration, ds.ContentQualification, ds.VolumetricProperties = (
        "20240102101112",
        10,
        "PRODUCT",
        "VOLUME",
    )
    set_pixels(ds, stored, **pixels)
    ds.DimensionOrganizationSequence = Sequence([item(DimensionOrganizationUID=uid("dimensions"))])
    ds.DimensionOrganizationType = "3D"
    ds.DimensionIndexSequence = Sequence(
        [
            item(
                DimensionOrganizationUID=uid("dimensions"),
                DimensionIndexPointer=0x00209056,
                FunctionalGroupPointer=0x00209111,
                DimensionDescriptionLabel="Stack ID",
            ),
            item(
                DimensionOrganizationUID=uid("dimensions"),
                DimensionIndexPointer=0x00209057,
                FunctionalGroupPointer=0x00209111,
                DimensionDescriptionLabel="In-Stack Position Number",
            ),
        ]
    )
    return ds


def plane_orientation():
    return Sequence([item(ImageOrientationPatient=[round(float(v), 8) for v in (*ALONG_ROW, *ALONG_COLUMN)])])


def measures(step=2.5):
    return Sequence([item(PixelSpacing=[0.8, 0.7], SliceThickness=2.5, SpacingBetweenSlices=step)])


def frame_group(k, time=0, slices_=SLICES, times=1):
    content = item(
        FrameAcquisitionNumber=1,
        FrameReferenceDateTime="20240102101112",
        FrameAcquisitionDateTime="20240102101112",
        FrameAcquisitionDuration=10.0,
        StackID="1",
        InStackPositionNumber=k + 1,
        DimensionIndexValues=[1, k + 1],
    )
    if times > 1:
        content.TemporalPositionIndex, content.DimensionIndexValues = time + 1, [1, k + 1, time + 1]
    return item(FrameContentSequence=Sequence([content]), PlanePositionSequence=Sequence([item(ImagePositionPatient=position(k, 2.5))]))


def window():
    return Sequence([item(WindowCenter=40, WindowWidth=400, WindowCenterWidthExplanation="soft")])


def value_map(slope, intercept, unit):
    return Sequence(
        [
            item(
                RealWorldValueFirstValueMapped=0,
                RealWorldValueLastValueMapped=4095,
                RealWorldValueSlope=float(slope),
                RealWorldValueIntercept=float(intercept),
                LUTExplanation="map",
                LUTLabel="map",
                MeasurementUnitsCodeSequence=Sequence([code(unit, "UCUM", unit)]),
            )
        ]
    )


def write_enhanced_ct(folder):
    ds = multi_frame(ENHANCED_CT, "CT", "enhanced ct", stored_values((SLICES, ROWS, COLUMNS), np.int16, 1, 4000))
    ds.ImageType = ["ORIGINAL", "PRIMARY", "VOLUME", "NONE"]
    ds.SharedFunctionalGroupsSequence = Sequence(
        [
            item(
                PlaneOrientationSequence=plane_orientation(),
                PixelMeasuresSequence=measures(),
                FrameVOILUTSequence=window(),
                PixelValueTransformationSequence=Sequence([item(RescaleSlope=2, RescaleIntercept=-1024, RescaleType="HU")]),
                FrameAnatomySequence=Sequence(
                    [item(FrameLaterality="U", AnatomicRegionSequence=Sequence([code("T-D1100", "SRT", "Head")]))]
                ),
                CTImageFrameTypeSequence=Sequence(
                    [
                        item(
                            FrameType=["ORIGINAL", "PRIMARY", "VOLUME", "NONE"],
                            PixelPresentation="MONOCHROME",
                            VolumetricProperties="VOLUME",
                            VolumeBasedCalculationTechnique="NONE",
                        )
                    ]
                ),
            )
        ]
    )
    ds.PerFrameFunctionalGroupsSequence = Sequence([frame_group(k) for k in (2, 0, 1, 3)])
    ds.save_as(folder / "a.dcm", enforce_file_format=True)


def write_enhanced_mr(folder):
    ds = multi_frame(ENHANCED_MR, "MR", "enhanced mr", stored_values((6, ROWS, COLUMNS), np.uint16, 1, 4000), bits_stored=12)
    ds.SharedFunctionalGroupsSequence = Sequence([item(PlaneOrientationSequence=plane_orientation(), PixelMeasuresSequence=measures())])
    groups = []
    for frame in range(6):
        group = frame_group(frame % 3, frame // 3, 3, 2)
        group.PixelValueTransformationSequence = Sequence([item(RescaleSlope=1.5 + 0.1 * frame, RescaleIntercept=-3, RescaleType="US")])
        group.RealWorldValueMappingSequence = value_map(0.25, 1, "ms")
        group.MREchoSequence = Sequence([item(EffectiveEchoTime=5.5)])
        groups.append(group)
    ds.PerFrameFunctionalGroupsSequence = Sequence(groups)
    ds.save_as(folder / "a.dcm", enforce_file_format=True)


def write_enhanced_pet(folder):
    ds = multi_frame(ENHANCED_PET, "PT", "enhanced pet", stored_values((SLICES, ROWS, COLUMNS), np.uint16, 1, 4000))
    ds.SharedFunctionalGroupsSequence = Sequence([item(PlaneOrientationSequence=plane_orientation(), PixelMeasuresSequence=measures())])
    groups = [frame_group(k) for k in range(SLICES)]
    for k, group in enumerate(groups):
        group.PixelValueTransformationSequence = Sequence([item(RescaleSlope=0.5 + 0.25 * k, RescaleIntercept=0, RescaleType="US")])
        group.RealWorldValueMappingSequence = value_map(0.5 + 0.25 * k, 0, "Bq/ml")
    ds.PerFrameFunctionalGroupsSequence = Sequence(groups)
    ds.save_as(folder / "a.dcm", enforce_file_format=True)


def write_dose(folder, first=0.0):
    ds = header(DOSE, "RTDOSE", f"dose {first}")
    set_pixels(ds, stored_values((SLICES, ROWS, COLUMNS), np.uint32, 1, 400000))
    ds.ImagePositionPatient, ds.ImageOrientationPatient, ds.PixelSpacing, ds.SliceThickness = (
        [-30, -40, 20],
        [1, 0, 0, 0, 1, 0],
        [2, 3],
        None,
    )
    ds.FrameIncrementPointer = 0x3004000C
    ds.GridFrameOffsetVector = [first + 2.5 * k for k in range(SLICES)]
    ds.DoseUnits, ds.DoseType, ds.DoseComment, ds.DoseSummationType, ds.DoseGridScaling = "GY", "PHYSICAL", "plan", "PLAN", 0.00025
    ds.TissueHeterogeneityCorrection, ds.NormalizationPoint = "IMAGE", [0, 0, 20]
    ds.ReferencedRTPlanSequence = Sequence(
        [item(ReferencedSOPClassUID="1.2.840.10008.5.1.4.1.1.481.5", ReferencedSOPInstanceUID=uid("plan"))]
    )
    ds.save_as(folder / "a.dcm", enforce_file_format=True)


def segment(number, label):
    return item(
        SegmentNumber=number,
        SegmentLabel=label,
        SegmentDescription="a part",
        SegmentAlgorithmType="AUTOMATIC",
        SegmentAlgorithmName="net",
        RecommendedDisplayCIELabValue=[30000 + number, 40000, 20000],
        RecommendedDisplayGrayscaleValue=65535,
        TrackingID=label,
        TrackingUID=uid("tracking", number),
        SegmentedPropertyCategoryCodeSequence=Sequence([code("T-D0050", "SRT", "Tissue")]),
        SegmentedPropertyTypeCodeSequence=Sequence([code("T-62000", "SRT", "Liver")]),
    )


def write_segmentation(folder, kind):
    random = np.random.default_rng(5)
    ds = header(LABELMAP if kind == "LABELMAP" else SEG, "SEG", f"seg {kind}")
    ds.ImageType = ["DERIVED", "PRIMARY"]
    ds.ContentLabel, ds.ContentDescription, ds.SegmentationType = "SEGMENTATION", "made", kind
    ds.SegmentsOverlap, ds.LossyImageCompression = "NO", "00"
    labels = random.integers(0, 3, (SLICES, ROWS, COLUMNS)).astype(np.uint8)
    numbers = [] if kind == "LABELMAP" else [1, 2]
    if kind == "LABELMAP":
        frames, of_frames = labels, [(k, None) for k in range(SLICES)]
        ds.PixelPaddingValue = 0
    else:
        of_frames = [(k, n) for n in numbers for k in range(SLICES)]
        frames = np.stack(
            [(labels[k] == n) * 1 if kind == "BINARY" else random.integers(0, 201, (ROWS, COLUMNS)) for k, n in of_frames]
        ).astype(np.uint8)
    set_pixels(ds, frames)
    if kind == "FRACTIONAL":
        ds.SegmentationFractionalType, ds.MaximumFractionalValue = "PROBABILITY", 200
    if kind == "BINARY":
        ds.BitsAllocated, ds.BitsStored, ds.HighBit = 1, 1, 0
        packed = np.packbits(frames.reshape(-1), bitorder="little").tobytes()
        ds.PixelData = packed + b"\0" * (len(packed) % 2)
    ds.SegmentSequence = Sequence([segment(1, "Liver"), segment(2, "Spleen")])
    ds.SharedFunctionalGroupsSequence = Sequence([item(PlaneOrientationSequence=plane_orientation(), PixelMeasuresSequence=measures())])
    groups = []
    for k, number in of_frames:
        group = frame_group(k)
        if number is not None:
            group.SegmentIdentificationSequence = Sequence([item(ReferencedSegmentNumber=number)])
        groups.append(group)
    ds.PerFrameFunctionalGroupsSequence = Sequence(groups)
    ds.save_as(folder / "a.dcm", enforce_file_format=True)


def write_parametric(folder):
    ds = multi_frame(PARAMETRIC, "MR", "parametric", stored_values((SLICES, ROWS, COLUMNS), np.uint16))
    del ds.PixelData, ds.BitsStored, ds.HighBit, ds.PixelRepresentation
    ds.BitsAllocated = 32
    ds.FloatPixelData = np.random.default_rng(5).normal(size=(SLICES, ROWS, COLUMNS)).astype(np.float32).tobytes()
    ds.FloatPixelPaddingValue = -9999.0
    ds.SharedFunctionalGroupsSequence = Sequence(
        [
            item(
                PlaneOrientationSequence=plane_orientation(),
                PixelMeasuresSequence=measures(),
                RealWorldValueMappingSequence=value_map(2, 1, "mm2/s"),
            )
        ]
    )
    ds.PerFrameFunctionalGroupsSequence = Sequence([frame_group(k) for k in range(SLICES)])
    ds.save_as(folder / "a.dcm", enforce_file_format=True)


def write_spect(folder):
    ds = header(NM, "NM", "spect")
    ds.ImageType = ["ORIGINAL", "PRIMARY", "RECON TOMO", "EMISSION"]
    set_pixels(ds, stored_values((SLICES, ROWS, COLUMNS), np.uint16, 1, 4000))
    ds.PixelSpacing, ds.SliceThickness, ds.SpacingBetweenSlices, ds.CountsAccumulated, ds.Units = [4.8, 4.7], 4.8, 4.6, 100000, "CNTS"
    ds.FrameIncrementPointer = [0x00540080]
    ds.NumberOfSlices, ds.SliceVector = SLICES, list(range(1, SLICES + 1))
    ds.NumberOfEnergyWindows, ds.NumberOfDetectors = 1, 1
    ds.EnergyWindowInformationSequence = Sequence(
        [item(EnergyWindowName="Tc99m", EnergyWindowRangeSequence=Sequence([item(EnergyWindowLowerLimit=126, EnergyWindowUpperLimit=154)]))]
    )
    ds.DetectorInformationSequence = Sequence(
        [
            item(
                ImagePositionPatient=[-30, -40, 20],
                ImageOrientationPatient=[1, 0, 0, 0, 1, 0],
                CollimatorType="PARA",
                FieldOfViewShape="RECTANGLE",
                StartAngle=0,
                RadialPosition=200,
                FocalDistance=0,
            )
        ]
    )
    ds.RotationInformationSequence = Sequence(
        [item(StartAngle=0, AngularStep=6, RotationDirection="CW", ScanArc=360, ActualFrameDuration=20000, NumberOfFramesInRotation=60)]
    )
    ds.PatientOrientationCodeSequence = Sequence([code("F-10450", "SRT", "recumbent")])
    ds.RescaleSlope, ds.RescaleIntercept = 1, 0
    ds.save_as(folder / "a.dcm", enforce_file_format=True)


# The foreign reader.


def stored_frames(ds):
    """Frames [frame, row, column] of the bits that are stored."""
    if "FloatPixelData" in ds:
        return np.frombuffer(ds.FloatPixelData, np.float32).reshape(-1, ds.Rows, ds.Columns).astype(float)
    if ds.BitsAllocated != 1 and ds.HighBit != ds.BitsStored - 1:
        raise ValueError("HighBit")
    if not ds.PhotometricInterpretation.startswith("MONOCHROME") or ds.SamplesPerPixel != 1:
        raise ValueError("colour")
    pixels = np.asarray(ds.pixel_array).reshape(-1, ds.Rows, ds.Columns).astype(np.int64)
    bits = ds.BitsStored
    pixels &= (1 << bits) - 1
    if ds.PixelRepresentation == 1:
        pixels = np.where(pixels >> (bits - 1) & 1, pixels - (1 << bits), pixels)
    return pixels.astype(float)


def in_groups(ds, frame, sequence, keyword):
    """What the functional groups of a frame, or those of all frames, say; else the data set."""
    groups = [ds.PerFrameFunctionalGroupsSequence[frame]] if "PerFrameFunctionalGroupsSequence" in ds else []
    groups += list(ds.get("SharedFunctionalGroupsSequence") or [])
    for group in groups:
        for found in group.get(sequence) or []:
            if found.get(keyword) not in (None, ""):
                return found.get(keyword)
    return ds.get(keyword)


def first(ds, frame, *places):
    for sequence, keyword in places:
        found = in_groups(ds, frame, sequence, keyword)
        if found not in (None, ""):
            return found
    return None


def position_of(ds, frame):
    at = in_groups(ds, frame, "PlanePositionSequence", "ImagePositionPatient")
    if "GridFrameOffsetVector" in ds:
        offset, start = float(ds.GridFrameOffsetVector[frame]), float(ds.GridFrameOffsetVector[0])
        directions = np.array(ds.ImageOrientationPatient, float).reshape(2, 3)
        normal = np.cross(*directions)
        at = np.array(at, float)
        return at + normal * (offset if start == 0 else offset - normal @ at)
    if ds.SOPClassUID == NM:
        detector = ds.DetectorInformationSequence[0]
        directions = np.array(detector.ImageOrientationPatient, float).reshape(2, 3)
        return np.array(detector.ImagePositionPatient, float) + np.cross(*directions) * float(ds.SpacingBetweenSlices) * (
            ds.SliceVector[frame] - 1
        )
    return np.array(at, float)


def frames_of(ds, key):
    stored = stored_frames(ds)
    if len(stored) != int(ds.get("NumberOfFrames") or 1):
        raise ValueError("NumberOfFrames")
    if "ModalityLUTSequence" in ds:
        raise ValueError("ModalityLUTSequence")
    for frame, pixels in enumerate(stored):
        slope = in_groups(ds, frame, "PixelValueTransformationSequence", "RescaleSlope")
        intercept = in_groups(ds, frame, "PixelValueTransformationSequence", "RescaleIntercept")
        slope, intercept = float(1 if slope in (None, "") else slope), float(0 if intercept in (None, "") else intercept)
        if "DoseGridScaling" in ds:
            slope, intercept = float(ds.DoseGridScaling), 0.0
        if ds.get("SegmentationType") == "FRACTIONAL":
            slope = 1 / ds.MaximumFractionalValue
        directions = in_groups(ds, frame, "PlaneOrientationSequence", "ImageOrientationPatient")
        if ds.SOPClassUID == NM:
            directions = ds.DetectorInformationSequence[0].ImageOrientationPatient
        yield dict(
            position=position_of(ds, frame),
            directions=np.array(directions, float).reshape(2, 3),
            values=slope * pixels + intercept,
            spacing=np.array(in_groups(ds, frame, "PixelMeasuresSequence", "PixelSpacing"), float),
            key=key(ds, frame),
        )


def stack(frames):
    """Voxels [x, y, z] and their places in LPS, of frames that lie evenly along their normal."""
    normal = np.cross(*frames[0]["directions"])
    frames = sorted(frames, key=lambda frame: normal @ frame["position"])
    at = np.array([frame["position"] for frame in frames])
    step = (at[-1] - at[0]) / (len(at) - 1)
    side = [np.linalg.norm(np.cross(step, normal))]
    if (
        np.any(np.abs(at - at[0] - np.arange(len(at))[:, None] * step) > 0.02 * np.linalg.norm(step))
        or side[0] > 1e-3
        or np.linalg.norm(step) < 1e-3
    ):
        raise ValueError("positions")
    for frame in frames:
        for name in ("directions", "spacing"):
            if np.any(np.abs(frame[name] - frames[0][name]) > 1e-4):
                raise ValueError(name)
    affine = np.eye(4)
    affine[:3, 0] = frames[0]["directions"][0] * frames[0]["spacing"][1]
    affine[:3, 1] = frames[0]["directions"][1] * frames[0]["spacing"][0]
    affine[:3, 2], affine[:3, 3] = step, at[0]
    return np.stack([frame["values"].T for frame in frames], axis=2), np.diag([-1, -1, 1, 1]) @ affine


def no_key(_ds, _frame):
    return 0


def read(paths, key=no_key, as_channels=False, segmentation=None):
    """The series with most files."""
    sets = [pydicom.dcmread(path) for path in paths]
    if segmentation and sets[0].SegmentationType != segmentation:
        raise ValueError("SegmentationType")
    series = collections.Counter(str(ds.get("SeriesInstanceUID", "")) for ds in sets).most_common(1)[0][0]
    frames = [frame for ds in sets if str(ds.get("SeriesInstanceUID", "")) == series for frame in frames_of(ds, key)]
    keys = sorted({frame["key"] for frame in frames})
    stacks = [stack([frame for frame in frames if frame["key"] == value]) for value in keys]
    if any(not np.allclose(affine, stacks[0][1], atol=1e-4) or values.shape != stacks[0][0].shape for values, affine in stacks):
        raise ValueError("the volumes lie elsewhere")
    fields = {(0, i) if as_channels else (i, 0): values for i, (values, _) in enumerate(stacks)}
    return Answer(fields=fields, affine=stacks[0][1])


def read_binary(paths):
    """Segments as labels."""
    segments = read(paths, segment_of, as_channels=True, segmentation="BINARY")
    numbers = sorted({segment_of(pydicom.dcmread(path), frame) for path in paths for frame in range(2 * SLICES)})
    labels = sum(number * segments.fields[0, i] for i, number in enumerate(numbers))
    return Answer(fields={(0, 0): labels}, affine=segments.affine)


def segment_of(ds, frame):
    return int(in_groups(ds, frame, "SegmentIdentificationSequence", "ReferencedSegmentNumber"))


def echo_of(ds, _frame):
    return float(ds.EchoTime)


def trigger_of(ds, _frame):
    return float(ds.TriggerTime)


def reference_time_of(ds, _frame):
    return float(ds.FrameReferenceTime)


def temporal_position_of(ds, frame):
    return int(in_groups(ds, frame, "FrameContentSequence", "TemporalPositionIndex"))


def series(name, kind, write, key=no_key):
    """Of files: what all of them say, and what one of them says otherwise."""

    def documents(folder):
        paths = sorted((folder / "study").iterdir())
        return [DicomDocument(paths, kind, kind == "ct"), DicomDocument(paths[:1], "slice", groups=SLICE_GROUPS)]

    def make(folder):
        (folder / "study").mkdir()
        write(folder / "study")

    return Sample(name, "study", make, documents, lambda folder: read(sorted((folder / "study").iterdir()), key))


def single(name, kind, write, read_file=read):
    return Sample(
        name,
        "a.dcm",
        write,
        lambda folder: [DicomDocument([folder / "a.dcm"], kind, kind == "dose")],
        lambda folder: read_file([folder / "a.dcm"]),
    )


def samples(_):
    return [
        series("ct", "ct", write_ct),
        series("ct-unsigned", "ct", lambda folder: write_ct(folder, np.uint16, 12, (0.5, -100), "MONOCHROME1")),
        series("mr-echoes", "mr", write_echoes, echo_of),
        series("mr-cine", "mr", write_cine, trigger_of),
        series("pet", "pet", write_pet),
        series("pet-dynamic", "pet", write_dynamic_pet, reference_time_of),
        single("enhanced-ct", "enhanced", write_enhanced_ct),
        single("enhanced-mr", "enhanced", write_enhanced_mr, lambda paths: read(paths, temporal_position_of)),
        single("enhanced-pet", "enhanced", write_enhanced_pet),
        single("dose", "dose", write_dose),
        single("dose-absolute", "dose", lambda folder: write_dose(folder, 20.0)),
        single("seg-binary", "segments", lambda folder: write_segmentation(folder, "BINARY"), read_binary),
        single(
            "seg-fractional",
            "segments",
            lambda folder: write_segmentation(folder, "FRACTIONAL"),
            lambda paths: read(paths, segment_of, as_channels=True, segmentation="FRACTIONAL"),
        ),
        single(
            "seg-labelmap",
            "segments",
            lambda folder: write_segmentation(folder, "LABELMAP"),
            lambda paths: read(paths, segmentation="LABELMAP"),
        ),
        single("parametric", "parametric", write_parametric),
        single("spect", "spect", write_spect),
    ]
