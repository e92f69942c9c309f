#include "data/volume_io/dicom_image.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace slabstream {
namespace {

// Names as in PS3.6.
constexpr DicomTag kImageType = 0x00080008, kModality = 0x00080060, kSeriesDescription = 0x0008103e, kSeriesInstanceUid = 0x0020000e,
                   kSeriesNumber = 0x00200011;
constexpr DicomTag kSamplesPerPixel = 0x00280002, kPhotometricInterpretation = 0x00280004, kNumberOfFrames = 0x00280008, kRows = 0x00280010,
                   kColumns = 0x00280011, kBitsAllocated = 0x00280100, kBitsStored = 0x00280101, kHighBit = 0x00280102,
                   kPixelRepresentation = 0x00280103, kModalityLutSequence = 0x00283000;
constexpr DicomTag kImagePositionPatient = 0x00200032, kImageOrientationPatient = 0x00200037, kPixelSpacing = 0x00280030,
                   kRescaleIntercept = 0x00281052, kRescaleSlope = 0x00281053;
// Of multi-frame images.
constexpr DicomTag kSharedGroups = 0x52009229, kFrameGroups = 0x52009230, kPlanePositionSequence = 0x00209113,
                   kPlaneOrientationSequence = 0x00209116, kPixelMeasuresSequence = 0x00289110,
                   kPixelValueTransformationSequence = 0x00289145, kFrameContentSequence = 0x00209111, kMrEchoSequence = 0x00189114,
                   kMrDiffusionSequence = 0x00189117, kCardiacSynchronizationSequence = 0x00189118;
constexpr DicomTag kGridFrameOffsetVector = 0x3004000c, kDoseGridScaling = 0x3004000e;

enum class Kind { kText, kDouble, kLong };

struct Distinction {
  const char* name;
  DicomTag tag;
  Kind kind = Kind::kText;
};

constexpr std::array<Distinction, 18> kDistinctions = {{
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
    {"KVP", 0x00180060},
    {"ConvolutionKernel", 0x00181210},
    {"StackID", 0x00209056},
    {"AcquisitionNumber", 0x00200012},
    {"ImageType", kImageType},
    {"AcquisitionTime", 0x00080032},
}};

const std::vector<WantedElement>& Wanted() {
  static const std::vector<WantedElement> wanted = [] {
    std::vector<WantedElement> all;
    for (const DicomTag tag : {kModality,
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
                               kGridFrameOffsetVector,
                               kDoseGridScaling}) {
      all.push_back({tag});
    }
    for (const DicomTag tag : {kSharedGroups, kFrameGroups, kPlanePositionSequence, kPlaneOrientationSequence, kPixelMeasuresSequence,
                               kPixelValueTransformationSequence, kFrameContentSequence, kMrEchoSequence, kMrDiffusionSequence,
                               kCardiacSynchronizationSequence, kModalityLutSequence}) {
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
    case Kind::kLong: break;
  }
  const std::optional<std::uint32_t> value = elements.Long(distinction.tag);
  return value ? fmt::format("{}", *value) : "";
}

// Takes over what these elements say, and leaves the rest as it is.
void ReadFrame(const DicomElements& elements, DicomFrame& frame) {
  if (const std::vector<double> p = elements.Decimals(kImagePositionPatient); p.size() == 3) frame.position = {p[0], p[1], p[2]};
  if (const std::vector<double> d = elements.Decimals(kImageOrientationPatient); d.size() == 6) {
    frame.directions = {Vec3{d[0], d[1], d[2]}, Vec3{d[3], d[4], d[5]}};
  }
  if (const std::vector<double> s = elements.Decimals(kPixelSpacing); s.size() == 2) frame.spacing = {s[1], s[0]};
  frame.rescale.scale = elements.Decimal(kRescaleSlope).value_or(frame.rescale.scale);
  frame.rescale.offset = elements.Decimal(kRescaleIntercept).value_or(frame.rescale.offset);
  for (std::size_t i = 0; i < kDistinctions.size(); ++i) {
    if (const std::string value = ValueOf(elements, kDistinctions[i]); !value.empty()) frame.distinctions[i] = value;
  }
}

// The functional groups of one frame, or those of all.
void ReadGroups(const DicomElements& groups, DicomFrame& frame) {
  for (const DicomTag group : {kPlanePositionSequence, kPlaneOrientationSequence, kPixelMeasuresSequence, kPixelValueTransformationSequence,
                               kFrameContentSequence, kMrEchoSequence, kMrDiffusionSequence, kCardiacSynchronizationSequence}) {
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

// `claimed` frames if the file can hold them, which is checked before they take memory; else 1, and the damage is noted.
std::int64_t CountFrames(double claimed, DicomImage& image) {
  if (!(claimed >= 1 && claimed <= kMaxVolumeSide && claimed == std::floor(claimed))) {
    image.damage = Status::InvalidArgument(
        fmt::format("{}: NumberOfFrames is {:g}, must be a whole number in [1, {}]", image.path, claimed, kMaxVolumeSide));
    return 1;
  }
  constexpr std::int64_t kLeastFragment = 8;  // bytes
  const auto frames = std::int64_t(claimed);
  const std::int64_t needed = frames * (image.pixels.encapsulated ? kLeastFragment : image.frame_bytes());
  if (image.pixels.bytes >= needed) return frames;
  image.damage = Status::DataLoss(
      fmt::format("{}: truncated: the header speaks of {} frames of {} x {} pixels of {} bits, the file has {} bytes of pixels", image.path,
                  frames, image.columns, image.rows, image.format.bits_allocated, image.pixels.bytes));
  return 1;
}

}  // namespace

std::size_t DistinctionCount() { return kDistinctions.size(); }
const char* DistinctionName(std::size_t distinction) { return kDistinctions[distinction].name; }

SampleType DicomPixelFormat::type() const {
  switch (bits_allocated) {
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
  return image;
}

}  // namespace slabstream
