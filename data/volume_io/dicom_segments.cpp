#include "data/volume_io/dicom_segments.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <span>

#include "data/volume_io/chosen_channel.h"
#include "data/volume_io/dicom_frames.h"

namespace slabstream {
namespace {

// "2 'Liver'"
std::string Text(const DicomSegment& segment) { return fmt::format("{} '{}'", segment.number, segment.label); }

// Writes `number` where `mask` is not 0. Returns another number that is there already; 0: there is none.
template <class Label>
Label Merge(std::span<const std::byte> mask, Label number, std::byte* labels) {
  for (std::size_t i = 0; i < mask.size(); ++i) {
    if (mask[i] == std::byte{0}) continue;
    Label there = 0;
    std::memcpy(&there, labels + i * sizeof(Label), sizeof(Label));
    if (there != 0) return there;
    std::memcpy(labels + i * sizeof(Label), &number, sizeof(Label));
  }
  return 0;
}

}  // namespace

Status CheckSegments(const DicomImage& image) {
  const bool label_map = image.segmentation == DicomSegmentation::kLabelMap;
  for (std::size_t i = 0; i < image.frames.size() && !label_map; ++i) {
    const int number = image.frames[i].segment;
    if (number == 0 || std::ranges::count(image.segments, number, &DicomSegment::number) != 1) {
      return Status::InvalidArgument(fmt::format(
          "{}: frame {} is of segment {}, which SegmentSequence must describe once, and as 1 or more", image.path, i + 1, number));
    }
  }
  const SampleType type = image.format.type();
  if (type == SampleType::kUint8 || (label_map && type == SampleType::kUint16)) return Status::Ok();
  return Status::InvalidArgument(fmt::format("{}: pixels of the segmentation are {}, must be uint8{}", image.path, ToString(type),
                                             label_map ? " or uint16" : " or bits"));
}

Result<RawVolume> ReadSegments(const std::string& path, const DicomSeries& series, RawHeader header, const ReadOptions& options) {
  const DicomImage& image = series.images.front();
  std::vector<DicomSegment> segments = image.segments;
  std::ranges::sort(segments, {}, &DicomSegment::number);
  std::vector<std::string> names;
  for (const DicomSegment& segment : segments) names.push_back(Text(segment));

  const bool binary = image.segmentation == DicomSegmentation::kBinary, fractional = image.segmentation == DicomSegmentation::kFractional;
  std::optional<int> channel;  // none: all segments
  if (fractional || (binary && options.channel)) {
    for (std::string& name : names) header.channels.push_back({.name = std::move(name)});
    const Result<int> chosen = ChosenChannel(path, header.channels, options);
    if (!chosen.ok()) return chosen.status();
    channel = *chosen;
    header.channel = *channel;
  } else {
    header.notes.push_back(fmt::format("labels are the numbers of segments: {}", fmt::join(names, ", ")));
  }
  const double apart = Length(header.steps[2]);
  if (std::abs(image.frames.front().slice_spacing.value_or(0) - apart) > 1e-3 * apart) {
    header.notes.push_back(
        fmt::format("slices lie {:g} mm apart, as the nearest two frames do; SpacingBetweenSlices does not say so", apart));
  }
  header.labels = !fractional;
  const bool wide = binary && segments.back().number > std::numeric_limits<std::uint8_t>::max();
  header.type = wide ? SampleType::kUint16 : image.format.type();
  if (fractional) header.rescale = image.frames.front().rescale;
  ReadOptions one_component = options;
  if (channel) one_component.channel.reset();
  Result<RawVolume> raw = TakeMemory(path, header, one_component);
  if (!raw.ok() || options.headers_only) return raw;

  std::vector<DicomFrameNumber> frames;
  for (std::size_t i = 0; i < image.frames.size(); ++i) {
    if (!channel || image.frames[i].segment == segments[std::size_t(*channel)].number) frames.push_back({&image, i});
  }
  Result<DicomFrameReader> reader = DicomFrameReader::Start(frames, {.type = image.format.type()});
  if (!reader.ok()) return reader.status();
  AlignedVector<std::byte> mask(std::size_t(image.frame_pixels()));
  const std::size_t slice_bytes = mask.size() * BytesPerSample(header.type);
  for (const DicomFrameNumber& each : frames) {
    const std::span<std::byte> slice =
        std::span(raw->bytes).subspan(std::size_t(series.stack.places[each.frame]) * slice_bytes, slice_bytes);
    if (Status status = reader->Read(binary ? std::span<std::byte>(mask) : slice); !status.ok()) return status;
    const int number = image.frames[each.frame].segment;
    int other = 0;
    if (binary) other = wide ? Merge(mask, std::uint16_t(number), slice.data()) : Merge(mask, std::uint8_t(number), slice.data());
    if (other != 0) {
      const auto name_of = [&](int of) { return Text(*std::ranges::find(segments, of, &DicomSegment::number)); };
      return Status::InvalidArgument(fmt::format("{}: segments {} and {} overlap; --channel takes one, of 0 to {}", path, name_of(other),
                                                 name_of(number), segments.size() - 1));
    }
    if (options.progress != nullptr) options.progress->Add(std::int64_t(slice_bytes));
  }
  return raw;
}

}  // namespace slabstream
