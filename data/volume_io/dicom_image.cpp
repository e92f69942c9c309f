#include "data/volume_io/dicom_image.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace slabstream {
namespace {

// Names as in PS3.6.
constexpr DicomTag kImageType = 0x00080008, kSopClassUid = 0x00080016, kSopInstanceUid = 0x00080018, kModality = 0x00080060,
                   kSeriesDescription = 0x0008103e, kSeriesInstanceUid = 0x0020000e, kSeriesNumber = 0x00200011;
constexpr DicomTag kSamplesPerPixel = 0x00280002, kPhotometricInterpretation = 0x00280004, kNumberOfFrames = 0x00280008, kRows = 0x00280010,
                   kColumns = 0x00280011, kBitsAllocated = 0x00280100, kBitsStored = 0x00280101, kHighBit = 0x00280102,
                   kPixelRepresentation = 0x00280103, kModalityLutSequence = 0x00283000;
constexpr DicomTag kImagePositionPatient = 0x00200032, kImageOrientationPatient = 0x00200037, kPixelSpacing = 0x00280030,
                   kRescaleIntercept = 0x00281052, kRescaleSlope = 0x00281053, kSpacingBetweenSlices = 0x00180088;
// Of multi-frame images.
constexpr DicomTag kSharedGroups = 0x52009229, kFrameGroups = 0x52009230, kPlanePositionSequence = 0x00209113,
                   kPlaneOrientationSequence = 0x00209116, kPixelMeasuresSequence = 0x00289110,
                   kPixelValueTransformationSequence = 0x00289145, kFrameContentSequence = 0x00209111, kMrEchoSequence = 0x00189114,
                   kMrDiffusionSequence = 0x00189117, kCardiacSynchronizationSequence = 0x00189118;
constexpr DicomTag kGridFrameOffsetVector = 0x3004000c, kDoseGridScaling = 0x3004000e;
constexpr DicomTag kDetectorInformationSequence = 0x00540022, kSliceVector = 0x00540080;
constexpr DicomTag kSegmentationType = 0x00620001, kSegmentSequence = 0x00620002, kSegmentNumber = 0x00620004, kSegmentLabel = 0x00620005,
                   kSegmentIdentificationSequence = 0x0062000a, kReferencedSegmentNumber = 0x0062000b, kMaximumFractionalValue = 0x0062000e;

// kVector: a number for each frame of the file. kDimension: one of the numbers of a frame.
enum class Kind { kText, kDouble, kLong, kVector, kDimension };

struct Distinction {
  const char* name;
  DicomTag tag;
  Kind kind = Kind::kText;
  std::size_t dimension = 0;
};

constexpr DicomTag kDimensionIndexValues = 0x00209157;

constexpr std::array<Distinction, 28> kDistinctions = {{
    {"TemporalPositionIdentifier", 0x00200100},
    {"TemporalPositionIndex", 0x00209128, Kind::kLong},
    {"EchoNumbers", 0x00180086},
    {"EchoTime", 0x00180081},
    {"EffectiveEchoTime", 0x00189082, Kind::kDouble},
    {"DiffusionBValue", 0x00189087, Kind::kDouble},
    {"InversionTime", 0x00180082},
    {"FlipAngle", 0x00181314},
    {"TriggerTime", 0x00181060},
    {"NominalCardiacTriggerDelayTime", 0x00209153, Kind::kDouble},
    {"NominalPercentageOfCardiacPhase", 0x00209241, Kind::kDouble},
    {"FrameReferenceTime", 0x00541300},
    {"TimeSlotVector", 0x00540070, Kind::kVector},
    {"TimeSliceVector", 0x00540100, Kind::kVector},
    {"PhaseVector", 0x00540030, Kind::kVector},
    {"RRIntervalVector", 0x00540060, Kind::kVector},
    {"EnergyWindowVector", 0x00540010, Kind::kVector},
    {"KVP", 0x00180060},
    {"ConvolutionKernel", 0x00181210},
    {"StackID", 0x00209056},
    {"AcquisitionNumber", 0x00200012},
    {"ImageType", kImageType},
    {"AcquisitionTime", 0x00080032},
    {"DimensionIndexValues[1]", kDimensionIndexValues, Kind::kDimension, 0},
    {"DimensionIndexValues[2]", kDimensionIndexValues, Kind::kDimension, 1},
    {"DimensionIndexValues[3]", kDimensionIndexValues, Kind::kDimension, 2},
    {"DimensionIndexValues[4]", kDimensionIndexValues, Kind::kDimension, 3},
    {"DimensionIndexValues[5]", kDimensionIndexValues, Kind::kDimension, 4},
}};

const std::vector<WantedElement>& Wanted() {
  static const std::vector<WantedElement> wanted = [] {
    std::vector<WantedElement> all;
    for (const DicomTag tag : {kSopClassUid,
                               kSopInstanceUid,
                               kModality,
                               kSeriesDescription,
                               kSeriesInstanceUid,
                               kSeriesNumber,
                               kSamplesPerPixel,
                               kPhotometricInterpretation,
                               kNumberOfFrames,
                               kRows,
                               kColumns,
                               kBitsAllocated,
                               kBitsStored,
                               kHighBit,
                               kPixelRepresentation,
                               kImagePositionPatient,
                               kImageOrientationPatient,
                               kPixelSpacing,
                               kRescaleIntercept,
                               kRescaleSlope,
                               kSpacingBetweenSlices,
                               kGridFrameOffsetVector,
                               kDoseGridScaling,
                               kSliceVector,
                               kSegmentationType,
                               kSegmentNumber,
                               kSegmentLabel,
                               kReferencedSegmentNumber,
                               kMaximumFractionalValue}) {
      all.push_back({tag});
    }
    for (const DicomTag tag :
         {kSharedGroups, kFrameGroups, kPlanePositionSequence, kPlaneOrientationSequence, kPixelMeasuresSequence,
          kPixelValueTransformationSequence, kFrameContentSequence, kMrEchoSequence, kMrDiffusionSequence, kCardiacSynchronizationSequence,
          kModalityLutSequence, kDetectorInformationSequence, kSegmentSequence, kSegmentIdentificationSequence}) {
      all.push_back({tag, true});
    }
    for (const Distinction& distinction : kDistinctions) all.push_back({distinction.tag});
    return all;
  }();
  return wanted;
}

std::string ValueOf(const DicomElements& elements, const Distinction& distinction) {
  switch (distinction.kind) {
    case Kind::kText: return elements.Text(distinction.tag);
    case Kind::kDouble: {
      const std::optional<double> value = elements.Double(distinction.tag);
      return value ? fmt::format("{:g}", *value) : "";
    }
    case Kind::kLong: {
      const std::optional<std::uint32_t> value = elements.Long(distinction.tag);
      return value ? fmt::format("{}", *value) : "";
    }
    case Kind::kDimension: {
      const std::vector<std::uint32_t> values = elements.Longs(distinction.tag);
      return distinction.dimension < values.size() ? fmt::format("{}", values[distinction.dimension]) : "";
    }
    case Kind::kVector: break;
  }
  return "";
}

// Takes over what these elements say, and leaves the rest as it is.
void ReadFrame(const DicomElements& elements, DicomFrame& frame) {
  if (const std::vector<double> p = elements.Decimals(kImagePositionPatient); p.size() == 3) frame.position = {p[0], p[1], p[2]};
  if (const std::vector<double> d = elements.Decimals(kImageOrientationPatient); d.size() == 6) {
    frame.directions = {Vec3{d[0], d[1], d[2]}, Vec3{d[3], d[4], d[5]}};
  }
  if (const std::vector<double> s = elements.Decimals(kPixelSpacing); s.size() == 2) frame.spacing = {s[1], s[0]};
  if (const std::optional<double> spacing = elements.Decimal(kSpacingBetweenSlices)) frame.slice_spacing = spacing;
  if (const std::optional<std::uint16_t> segment = elements.Short(kReferencedSegmentNumber)) frame.segment = *segment;
  frame.rescale.scale = elements.Decimal(kRescaleSlope).value_or(frame.rescale.scale);
  frame.rescale.offset = elements.Decimal(kRescaleIntercept).value_or(frame.rescale.offset);
  for (std::size_t i = 0; i < kDistinctions.size(); ++i) {
    if (const std::string value = ValueOf(elements, kDistinctions[i]); !value.empty()) frame.distinctions[i] = value;
  }
}

// The functional groups of one frame, or those of all.
void ReadGroups(const DicomElements& groups, DicomFrame& frame) {
  for (const DicomTag group :
       {kPlanePositionSequence, kPlaneOrientationSequence, kPixelMeasuresSequence, kPixelValueTransformationSequence, kFrameContentSequence,
        kMrEchoSequence, kMrDiffusionSequence, kCardiacSynchronizationSequence, kSegmentIdentificationSequence}) {
    ReadFrame(groups.FirstItem(group), frame);
  }
}

// The frames of a radiation dose lie along the normal of the first, by these offsets, or at these places of it (PS3.3 C.8.8.3.2).
void PlaceDose(const std::vector<double>& offsets, std::vector<DicomFrame>& frames) {
  const DicomFrame& first = frames.front();
  if (offsets.size() != frames.size() || !first.position || !first.directions) return;
  const Vec3 normal = Cross((*first.directions)[0], (*first.directions)[1]), origin = *first.position;
  const double start = offsets.front() == 0 ? 0 : Dot(normal, origin);
  for (std::size_t i = 0; i < frames.size(); ++i) frames[i].position = origin + (offsets[i] - start) * normal;
}

// The frames of reconstructed nuclear medicine lie along the normal of the first, whose place the detector has. The sign of
// SpacingBetweenSlices is their direction (PS3.3 C.8.4.15), SliceVector says which slice each frame is. Frames of other types, such as
// projections, are no slices.
void PlaceNuclear(const DicomElements& elements, const std::vector<std::string>& image_type, DicomImage& image) {
  const std::string type = image_type.size() > 2 ? image_type[2] : "";
  if (type != "RECON TOMO" && type != "RECON GATED TOMO") {
    image.trouble = Status::InvalidArgument(fmt::format(
        "{}: frames of nuclear medicine of the type '{}' are no slices; those of RECON TOMO and RECON GATED TOMO are", image.path, type));
    return;
  }
  DicomFrame first = image.frames.front();
  ReadFrame(elements.FirstItem(kDetectorInformationSequence), first);
  const double spacing = first.slice_spacing.value_or(0);
  if (spacing == 0 || !std::isfinite(spacing)) {
    image.trouble = Status::InvalidArgument(image.path + ": has no SpacingBetweenSlices, by which slices of nuclear medicine lie");
    return;
  }
  const std::vector<std::uint16_t> slices = elements.Shorts(kSliceVector);
  for (std::size_t i = 0; i < image.frames.size() && first.position && first.directions; ++i) {
    const double slice = i < slices.size() ? slices[i] - 1.0 : double(i);
    image.frames[i].position = *first.position + slice * spacing * Cross((*first.directions)[0], (*first.directions)[1]);
    image.frames[i].directions = first.directions;
  }
  for (std::size_t k = 0; k < kDistinctions.size(); ++k) {
    if (kDistinctions[k].kind != Kind::kVector) continue;
    const std::vector<std::uint16_t> values = elements.Shorts(kDistinctions[k].tag);
    for (std::size_t i = 0; i < std::min(values.size(), image.frames.size()); ++i) {
      image.frames[i].distinctions[k] = std::to_string(values[i]);
    }
  }
}

void ReadSegments(const DicomElements& elements, DicomImage& image) {
  const std::string type = elements.Text(kSegmentationType);
  image.segmentation = type == "BINARY"       ? DicomSegmentation::kBinary
                       : type == "FRACTIONAL" ? DicomSegmentation::kFractional
                       : type == "LABELMAP"   ? DicomSegmentation::kLabelMap
                                              : DicomSegmentation::kNone;
  for (const DicomElements& segment : elements.Items(kSegmentSequence)) {
    image.segments.push_back({segment.Short(kSegmentNumber).value_or(0), segment.Text(kSegmentLabel)});
  }
}

// `claimed` frames if the file can hold them, which is checked before they take memory; else 1, and the damage is noted.
std::int64_t CountFrames(double claimed, DicomImage& image) {
  if (!(claimed >= 1 && claimed <= kMaxVolumeSide && claimed == std::floor(claimed))) {
    image.trouble = Status::InvalidArgument(
        fmt::format("{}: NumberOfFrames is {:g}, must be a whole number in [1, {}]", image.path, claimed, kMaxVolumeSide));
    return 1;
  }
  constexpr std::int64_t kLeastFragment = 8;  // bytes
  const auto frames = std::int64_t(claimed);
  const std::int64_t needed = image.pixels.encapsulated ? frames * kLeastFragment : (frames * image.frame_bits() + 7) / 8;
  if (image.pixels.bytes >= needed) return frames;
  image.trouble = Status::DataLoss(
      fmt::format("{}: truncated: the header speaks of {} frames of {} x {} pixels of {} bits, the file has {} bytes of pixels", image.path,
                  frames, image.columns, image.rows, image.format.bits_allocated, image.pixels.bytes));
  return 1;
}

}  // namespace

std::size_t DistinctionCount() { return kDistinctions.size(); }
const char* DistinctionName(std::size_t distinction) { return kDistinctions[distinction].name; }

SampleType DicomPixelFormat::type() const {
  if (is_float) return bits_allocated == 64 ? SampleType::kFloat64 : SampleType::kFloat32;
  switch (bits_allocated) {
    case 1:
    case 8: return is_signed ? SampleType::kInt8 : SampleType::kUint8;
    case 16: return is_signed ? SampleType::kInt16 : SampleType::kUint16;
    default: return is_signed ? SampleType::kInt32 : SampleType::kUint32;
  }
}

Result<DicomImage> ReadDicomImage(const std::string& path) {
  const Result<DicomFile> file = ReadDicomFile(path, Wanted());
  if (!file.ok()) return file.status();
  const DicomElements& elements = file->elements;
  DicomImage image{.path = path,
                   .instance_uid = elements.Text(kSopInstanceUid),
                   .series_uid = elements.Text(kSeriesInstanceUid),
                   .modality = elements.Text(kModality),
                   .description = elements.Text(kSeriesDescription),
                   .number = elements.Text(kSeriesNumber),
                   .modality_lut = elements.Has(kModalityLutSequence),
                   .columns = elements.Short(kColumns).value_or(0),
                   .rows = elements.Short(kRows).value_or(0),
                   .samples_per_pixel = elements.Short(kSamplesPerPixel).value_or(1),
                   .photometric = elements.Text(kPhotometricInterpretation),
                   .transfer_syntax = file->transfer_syntax,
                   .pixels = file->pixels};
  const std::vector<std::string> type = elements.Texts(kImageType);
  image.localizer = std::ranges::count(type, "LOCALIZER") > 0;
  image.mosaic = std::ranges::count(type, "MOSAIC") > 0;
  image.format.bits_allocated = elements.Short(kBitsAllocated).value_or(0);
  image.format.bits_stored = elements.Short(kBitsStored).value_or(image.format.bits_allocated);
  image.format.high_bit = elements.Short(kHighBit).value_or(image.format.bits_stored - 1);
  image.format.is_signed = elements.Short(kPixelRepresentation).value_or(0) == 1;
  image.format.is_float = image.pixels.floats;
  ReadSegments(elements, image);

  image.media_directory = file->media_class == "1.2.840.10008.1.3.10";
  const std::int64_t frame_count = CountFrames(elements.Decimal(kNumberOfFrames).value_or(1), image);
  DicomFrame shared;
  shared.distinctions.resize(kDistinctions.size());
  ReadFrame(elements, shared);
  if (const std::optional<double> scaling = elements.Decimal(kDoseGridScaling)) shared.rescale.scale = *scaling;
  ReadGroups(elements.FirstItem(kSharedGroups), shared);
  // A position of the file as a whole is that of its only frame.
  const bool multi_frame = frame_count > 1;
  const std::vector<DicomElements>& groups = elements.Items(kFrameGroups);
  const std::vector<double> offsets = elements.Decimals(kGridFrameOffsetVector);
  if (multi_frame && offsets.empty()) shared.position.reset();
  image.frames.assign(std::size_t(frame_count), shared);
  for (std::size_t i = 0; i < std::min(groups.size(), image.frames.size()); ++i) ReadGroups(groups[i], image.frames[i]);
  if (multi_frame && !offsets.empty()) PlaceDose(offsets, image.frames);
  if (elements.Text(kSopClassUid) == "1.2.840.10008.5.1.4.1.1.20" && image.trouble.ok()) PlaceNuclear(elements, type, image);
  // Shares of a segment are in [0, MaximumFractionalValue].
  const double most = elements.Short(kMaximumFractionalValue).value_or(0);
  if (image.segmentation != DicomSegmentation::kFractional || most == 0) return image;
  for (DicomFrame& frame : image.frames) frame.rescale = {1 / most, 0};
  return image;
}

}  // namespace slabstream
