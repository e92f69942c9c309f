// Tractograms: lines along bundles of fibres. TrackVis (.trk, versions 1 and 2) has places in the axes of voxels, in mm from the corner of
// the first one; MRtrix (.tck) has those of the scanner's space.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "data/shapes/parsing.h"
#include "data/shapes/shape_formats.h"
#include "data/volume_io/text_header.h"

namespace slabstream {
namespace {

// Which axis of the world a voxel axis runs along most, and whether against it.
struct Direction {
  int axis = 0;
  bool against = false;
};
using Directions = std::array<Direction, 3>;

// Each axis of the world once, so that the sum of cosines is the largest.
Directions DirectionsOf(const std::array<Vec3, 3>& steps) {
  std::array<int, 3> axes = {0, 1, 2}, best = axes;
  double most = -1;
  do {
    double sum = 0;
    for (std::size_t voxel = 0; voxel < 3; ++voxel) sum += std::abs(steps[voxel][axes[voxel]]) / Length(steps[voxel]);
    if (sum > most) best = axes;
    most = std::max(most, sum);
  } while (std::ranges::next_permutation(axes).found);
  Directions directions;
  for (std::size_t voxel = 0; voxel < 3; ++voxel) directions[voxel] = {best[voxel], steps[voxel][best[voxel]] < 0};
  return directions;
}

// "RAS": letters for the ends of the axes. None: they are not letters of three axes.
std::optional<Directions> DirectionsNamed(std::string_view letters) {
  constexpr std::string_view kEnds = "RLAPSI";
  Directions directions;
  int axes = 0;
  for (std::size_t voxel = 0; voxel < 3; ++voxel) {
    const std::size_t end = kEnds.find(letters[voxel]);
    if (end == std::string_view::npos) return std::nullopt;
    directions[voxel] = {int(end / 2), end % 2 == 1};
    axes |= 1 << directions[voxel].axis;
  }
  return axes == 7 ? std::optional(directions) : std::nullopt;
}

// From places in mm along the voxels' axes, as voxel_order names them, through voxels to vox_to_ras.
void SetTrkMap(const BinaryHeader& header, ShapeBuilder& builder) {
  std::array<Vec3, 3> steps = {Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}};
  Vec3 origin;
  const bool placed = header.At<std::int32_t>(992) >= 2 && header.At<float>(500) != 0;
  for (int row = 0; placed && row < 3; ++row) {
    const std::size_t at = 440 + 16 * std::size_t(row);
    for (std::size_t column = 0; column < 3; ++column) steps[column][row] = header.At<float>(at + 4 * column);
    origin[row] = header.At<float>(at + 12);
  }
  std::string order;
  for (std::size_t i = 0; i < 3; ++i) order.push_back(header.At<char>(948 + i));
  std::ranges::transform(order, order.begin(), [](char c) { return c >= 'a' && c <= 'z' ? char(c - 'a' + 'A') : c; });
  const std::optional<Directions> from = DirectionsNamed(order[0] == '\0' ? "LPS" : order);
  if (!from) return builder.Wrong(fmt::format("voxel_order is '{}', must be letters of three axes, such as RAS", Shortened(order.c_str())));
  const Directions to = DirectionsOf(steps);
  AffineMap map{{}, origin};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto other = std::size_t(std::ranges::find(to, (*from)[axis].axis, &Direction::axis) - to.begin());
    const double size = header.At<std::int16_t>(6 + 2 * axis), spacing = header.At<float>(12 + 4 * other);
    if (!(spacing > 0)) return builder.Wrong(fmt::format("voxel_size {} is {}, must be above 0", other, spacing));
    const bool flipped = (*from)[axis].against != to[other].against;
    // The voxel's number along an axis of vox_to_ras is place / spacing - 0.5, or counted from the end; which one, as nibabel has it.
    map.steps[other] = ((flipped ? -1 : 1) / spacing) * steps[axis];
    map.offset = map.offset + (flipped ? size - 0.5 : -0.5) * steps[axis];
  }
  builder.SetMap(map);
}

}  // namespace

void ReadTrk(std::string_view bytes, ShapeBuilder& builder) {
  constexpr std::size_t kHeader = 1000;
  if (!bytes.starts_with("TRACK")) return builder.Wrong("not a TrackVis file: it does not begin with TRACK");
  if (bytes.size() < kHeader) return builder.Truncated(fmt::format("has {} bytes, the header 1000", bytes.size()));
  const auto stated = [&](bool swapped) { return BinaryHeader(BytesOf(bytes), swapped).At<std::int32_t>(996); };
  const bool swapped = stated(true) == kHeader;
  if (!swapped && stated(false) != kHeader) return builder.Wrong(fmt::format("hdr_size is {}, must be {}", stated(false), kHeader));
  const BinaryHeader numbers(BytesOf(bytes), swapped);
  const int scalars = numbers.At<std::int16_t>(36), properties = numbers.At<std::int16_t>(238), lines = numbers.At<std::int32_t>(988);
  if (scalars < 0 || properties < 0) return builder.Wrong(fmt::format("has {} scalars and {} properties", scalars, properties));
  SetTrkMap(numbers, builder);
  if (scalars > 0) builder.Has(kValue);
  std::size_t at = kHeader;
  const auto has = [&](std::size_t count) { return bytes.size() - at >= count; };
  // The number of lines may be 0, for not known.
  for (std::int64_t line = 0; builder.ok() && (lines > 0 ? line < lines : at < bytes.size()); ++line) {
    const std::int64_t points = has(4) ? numbers.At<std::int32_t>(at) : 0, of_point = std::int64_t{4} * (3 + scalars);
    if (points < 0) return builder.Wrong(fmt::format("line {} has {} points", line, points));
    if (!has(4 + std::size_t(points * of_point + 4 * properties))) return builder.Truncated(fmt::format("ends in line {}", line));
    at += 4;
    for (std::int64_t point = 0; point < points; ++point, at += std::size_t(of_point)) {
      VertexRow row = {numbers.At<float>(at), numbers.At<float>(at + 4), numbers.At<float>(at + 8)};
      if (scalars > 0) row[kValue] = numbers.At<float>(at + 12);
      builder.AddVertex(row);
    }
    at += std::size_t(4 * properties);
    builder.EndLine();
  }
}

void ReadTck(std::string_view bytes, ShapeBuilder& builder) {
  std::string_view rest = bytes;
  if (TakeLine(rest) != "mrtrix tracks") return builder.Wrong("not a file of tracks of MRtrix: the first line is not 'mrtrix tracks'");
  std::string_view datatype, file;
  for (std::string_view line = TakeLine(rest); line != "END"; line = TakeLine(rest)) {
    if (rest.empty()) return builder.Truncated("the header has no END");
    const std::string_view key = TakeWord(line);
    if (key == "datatype:") datatype = Trimmed(line);
    if (key == "file:") file = Trimmed(line);
  }
  const bool doubles = datatype.starts_with("Float64"), big_endian = datatype.ends_with("BE");
  if ((!doubles && !datatype.starts_with("Float32")) || (!big_endian && !datatype.ends_with("LE")))
    return builder.Wrong(fmt::format("datatype is '{}', must be Float32LE, Float32BE, Float64LE or Float64BE", Shortened(datatype)));
  const std::string_view dot = TakeWord(file);
  const auto offset = ToNumber<std::size_t>(TakeWord(file));
  if (dot != "." || !offset || *offset > bytes.size())
    return builder.Wrong(fmt::format("file is '{} ...', must be '. ' and a byte of this file, at most {}", Shortened(dot), bytes.size()));
  const BinaryHeader numbers(BytesOf(bytes), big_endian);
  const SampleType type = doubles ? SampleType::kFloat64 : SampleType::kFloat32;
  const std::size_t each = BytesPerSample(type);
  if (!doubles) builder.SetFloats();
  // A place that is not a number ends a line, an infinite one the file.
  for (std::size_t at = *offset; builder.ok(); at += 3 * each) {
    if (at + 3 * each > bytes.size()) return builder.Truncated("no infinite place ends the lines");
    const VertexRow row = {NumberAt(numbers, type, at), NumberAt(numbers, type, at + each), NumberAt(numbers, type, at + 2 * each)};
    const auto all = [&](bool (*is)(double)) { return is(row[kX]) && is(row[kY]) && is(row[kZ]); };
    const bool ends = all([](double x) { return std::isinf(x); });
    if (ends || all([](double x) { return std::isnan(x); })) {
      builder.EndLine();
    } else {
      builder.AddVertex(row);
    }
    if (ends) return;
  }
}

}  // namespace slabstream
