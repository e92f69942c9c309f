#include "client/cli/values.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "common/cli/parse.h"

namespace slabstream {
namespace {

std::vector<std::string_view> Split(std::string_view text, char separator) {
  std::vector<std::string_view> parts;
  for (std::size_t begin = 0;;) {
    const std::size_t end = text.find(separator, begin);
    parts.push_back(text.substr(begin, end - begin));
    if (end == std::string_view::npos) return parts;
    begin = end + 1;
  }
}

}  // namespace

Result<ImageSize> ParseImageSize(std::string_view option, std::string_view text) {
  const std::vector<std::string_view> sides = Split(text, 'x');
  if (sides.size() > 2) return Status::InvalidArgument(fmt::format("{} '{}' is neither WIDTHxHEIGHT nor one number", option, text));
  const Result<int> width = ParseInteger(option, sides.front(), 1, kMaxImageSide);
  if (!width.ok()) return width.status();
  const Result<int> height = ParseInteger(option, sides.back(), 1, kMaxImageSide);
  if (!height.ok()) return height.status();
  if (const std::int64_t pixels = std::int64_t{*width} * *height; pixels > kMaxImagePixels) {
    return Status::InvalidArgument(fmt::format("{} '{}' has {} pixels, at most {} are rendered", option, text, pixels, kMaxImagePixels));
  }
  return ImageSize{*width, *height};
}

Result<Vec3> ParsePoint(std::string_view option, std::string_view text) {
  const std::vector<std::string_view> parts = Split(text, ',');
  if (parts.size() != 3) return Status::InvalidArgument(fmt::format("{} '{}' is not X,Y,Z", option, text));
  Vec3 point;
  for (int i = 0; i < 3; ++i) {
    const Result<double> value = ParseNumber(option, parts[std::size_t(i)], {-kMaxWorldCoordinate, kMaxWorldCoordinate});
    if (!value.ok()) return value.status();
    point[i] = *value;
  }
  return point;
}

Result<Vec3> ParseDirection(std::string_view option, std::string_view text) {
  Result<Vec3> direction = ParsePoint(option, text);
  if (direction.ok() && *direction == Vec3{}) return Status::InvalidArgument(fmt::format("{} {} has no direction", option, text));
  return direction;
}

Result<ClipBox> ParseClipBox(std::string_view option, std::string_view text) {
  ClipBox box;
  std::string_view bounds = text;
  if (text.ends_with('%')) box.unit = ClipUnit::kPercent;
  if (text.ends_with('v')) box.unit = ClipUnit::kVoxels;
  if (box.unit != ClipUnit::kWorld) bounds.remove_suffix(1);
  const auto refuse = [&] { return Status::InvalidArgument(fmt::format("{} '{}' is not X0:X1,Y0:Y1,Z0:Z1", option, text)); };
  const std::vector<std::string_view> axes = Split(bounds, ',');
  if (axes.size() != kAxes.size()) return refuse();
  for (const Axis axis : kAxes) {
    const std::vector<std::string_view> ends = Split(axes[std::size_t(Number(axis))], ':');
    if (ends.size() != 2) return refuse();
    for (const bool high : {false, true}) {
      double& bound = high ? box.high[axis] : box.low[axis];
      bound = high ? kMaxWorldCoordinate : -kMaxWorldCoordinate;
      if (ends[high ? 1 : 0].empty()) continue;
      const Result<double> value = ParseNumber(option, ends[high ? 1 : 0], {-kMaxWorldCoordinate, kMaxWorldCoordinate});
      if (!value.ok()) return value.status();
      bound = *value;
    }
    if (box.low[axis] < box.high[axis]) continue;
    return Status::InvalidArgument(
        fmt::format("{} '{}': {} runs from {:g} to {:g}, but must rise", option, text, Letter(axis), box.low[axis], box.high[axis]));
  }
  return box;
}

Result<ClipPlane> ParseClipPlane(std::string_view option, std::string_view text) {
  const std::size_t last = text.rfind(',');
  if (last == std::string_view::npos || std::ranges::count(text, ',') != 3) {
    return Status::InvalidArgument(fmt::format("{} '{}' is not NX,NY,NZ,D", option, text));
  }
  const Result<Vec3> normal = ParseDirection(option, text.substr(0, last));
  if (!normal.ok()) return normal.status();
  const Result<double> offset = ParseNumber(option, text.substr(last + 1), {-kMaxWorldCoordinate, kMaxWorldCoordinate});
  if (!offset.ok()) return offset.status();
  return ClipPlane{*normal, *offset};
}

Result<StraightColor> ParseColor(std::string_view option, std::string_view text) {
  const std::vector<std::string_view> parts = Split(text, ',');
  if (parts.size() != 3 && parts.size() != 4) {
    return Status::InvalidArgument(fmt::format("{} '{}' is neither R,G,B nor R,G,B,A", option, text));
  }
  float channels[4] = {0, 0, 0, 1};
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const Result<double> value = ParseNumber(option, parts[i], {0, 1});
    if (!value.ok()) return value.status();
    channels[i] = float(*value);
  }
  return StraightColor{channels[0], channels[1], channels[2], channels[3]};
}

Result<FramePattern> FramePattern::Parse(std::string_view option, std::string_view text) {
  const auto refuse = [&](std::string_view why) {
    return Status::InvalidArgument(fmt::format("{} '{}' {}; it needs one number such as %04d", option, text, why));
  };
  FramePattern pattern;
  int conversions = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    std::string& side = conversions == 0 ? pattern.before_ : pattern.after_;
    if (text[i] != '%') {
      side += text[i];
      continue;
    }
    if (++i < text.size() && text[i] == '%') {
      side += '%';
      continue;
    }
    if (++conversions > 1) return refuse("has more than one conversion");
    pattern.zero_ = i < text.size() && text[i] == '0';
    const std::size_t digits = i;
    while (i < text.size() && text[i] >= '0' && text[i] <= '9') ++i;
    if (i == text.size() || (text[i] != 'd' && text[i] != 'i' && text[i] != 'u')) return refuse("has a conversion that is not an integer");
    if (i > digits) {
      const Result<int> width = ParseInteger(option, text.substr(digits, i - digits), 0, 20);
      if (!width.ok()) return width.status();
      pattern.width_ = *width;
    }
  }
  if (conversions == 0) return refuse("has no place for the frame's number");
  return pattern;
}

std::string FramePattern::Name(int index) const {
  return before_ + (zero_ ? fmt::format("{:0{}}", index, width_) : fmt::format("{:{}}", index, width_)) + after_;
}

}  // namespace slabstream
