#include "client/request/values.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <limits>
#include <optional>

#include "client/request/named_colors.h"
#include "common/base/did_you_mean.h"
#include "common/base/find_named.h"
#include "common/base/printable.h"
#include "common/cli/parse.h"
#include "common/text/parse_number.h"
#include "common/text/split.h"
#include "common/view/world_limits.h"

namespace slabstream {
namespace {

std::optional<StraightColor> FromHexadecimal(std::string_view digits) {
  const std::size_t length = digits.size() == 3 ? 1 : 2;  // of a number
  if (digits.size() != 3 && digits.size() != 6 && digits.size() != 8) return std::nullopt;
  float channels[4] = {0, 0, 0, 1};
  for (std::size_t i = 0; i < digits.size(); i += length) {
    unsigned value = 0;
    const auto [end, error] = std::from_chars(digits.data() + i, digits.data() + i + length, value, 16);
    if (error != std::errc() || end != digits.data() + i + length) return std::nullopt;
    channels[i / length] = float(value) / (length == 1 ? 15 : 255);
  }
  return StraightColor{channels[0], channels[1], channels[2], channels[3]};
}

}  // namespace

Result<ImageSize> ParseImageSize(std::string_view option, std::string_view text) {
  const std::vector<std::string_view> sides = Split(text, 'x');
  const auto no_digits = [](std::string_view side) {
    return side.empty() || side.find_first_not_of("+-0123456789") != std::string_view::npos;
  };
  if (sides.size() > 2 || std::ranges::any_of(sides, no_digits)) {
    return Status::InvalidArgument(fmt::format("{} '{}' is neither WIDTHxHEIGHT nor one number", option, text));
  }
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
    const Result<double> value = ParseNumber(option, parts[std::size_t(i)], {-kMaxCoordinate, kMaxCoordinate});
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

Result<ScalarRange> ParseScalarRange(std::string_view option, std::string_view text) {
  std::vector<std::string_view> ends = Split(text, ':');
  const auto is_percentile = [](std::string_view end) { return end.ends_with('%'); };
  if (ends.size() != 2 || is_percentile(ends[0]) != is_percentile(ends[1])) {
    return Status::InvalidArgument(fmt::format("{} '{}' is neither LOW:HIGH nor LOW%:HIGH%", option, text));
  }
  ScalarRange range;
  range.percentiles = is_percentile(ends[0]);
  const NumberRange limits = range.percentiles ? NumberRange{0, 100} : NumberRange{-kMaxScalar, kMaxScalar};
  for (std::string_view& end : ends) {
    if (range.percentiles) end.remove_suffix(1);
    const Result<double> value = ParseNumber(option, end, limits);
    if (!value.ok()) return value.status();
    (&end == &ends[0] ? range.min : range.max) = *value;
  }
  if (range.min < range.max) return range;
  return Status::InvalidArgument(fmt::format("{} '{}' must rise", option, text));
}

Result<ClipBox> ParseClipBox(std::string_view option, std::string_view text) {
  ClipBox box;
  const bool percent = text.find('%') != std::string_view::npos, voxels = text.find('v') != std::string_view::npos;
  if (percent) box.unit = ClipUnit::kPercent;
  if (voxels) box.unit = ClipUnit::kVoxels;
  const auto refuse = [&] { return Status::InvalidArgument(fmt::format("{} '{}' is not X0:X1,Y0:Y1,Z0:Z1", option, text)); };
  if (percent && voxels) {
    return Status::InvalidArgument(
        fmt::format("{} '{}' has bounds in voxels (v) and in percent (%): all must have one unit", option, text));
  }
  const std::vector<std::string_view> axes = Split(text, ',');
  if (axes.size() != kAxes.size()) return refuse();
  for (const Axis axis : kAxes) {
    std::vector<std::string_view> ends = Split(axes[std::size_t(Number(axis))], ':');
    if (ends.size() != 2) return refuse();
    for (std::string_view& end : ends) {
      if (end.ends_with('%') || end.ends_with('v')) end.remove_suffix(1);
    }
    for (const bool high : {false, true}) {
      double& bound = high ? box.high[axis] : box.low[axis];
      bound = high ? kMaxCoordinate : -kMaxCoordinate;
      if (ends[high ? 1 : 0].empty()) continue;
      const Result<double> value = ParseNumber(option, ends[high ? 1 : 0], {-kMaxCoordinate, kMaxCoordinate});
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
  const Result<double> offset = ParseNumber(option, text.substr(last + 1), {-kMaxCoordinate, kMaxCoordinate});
  if (!offset.ok()) return offset.status();
  return ClipPlane{*normal, *offset};
}

Result<StraightColor> ParseColor(std::string_view option, std::string_view text) {
  const NamedColor* const named = FindNamed(kNamedColors, text);
  const std::string code = named != nullptr ? fmt::format("#{:06x}", named->code) : std::string(text);
  if (code.starts_with('#')) {
    if (const std::optional<StraightColor> color = FromHexadecimal(std::string_view(code).substr(1))) return *color;
    return Status::InvalidArgument(fmt::format("{} '{}' is neither #rgb nor #rrggbb nor #rrggbbaa", option, text));
  }
  const std::vector<std::string_view> parts = Split(text, ',');
  if (parts.size() != 3 && parts.size() != 4) {
    return Status::InvalidArgument(
        fmt::format("{} '{}' is neither R,G,B[,A] nor #rrggbb nor the name of a colour{}", option, text, DidYouMean(text, kNamedColors)));
  }
  float channels[4] = {0, 0, 0, 1};
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const Result<double> value = ParseNumber(option, parts[i], {0, 1});
    if (!value.ok()) return value.status();
    channels[i] = float(*value);
  }
  return StraightColor{channels[0], channels[1], channels[2], channels[3]};
}

Result<std::vector<Isosurface>> ParseIsosurfaces(std::string_view option, std::string_view text) {
  // Of surfaces without a colour, by their place in the list: bone, blood, fat, nerve and so on.
  static constexpr std::array<Rgb, kMaxIsosurfaces> kColors = {{{0.92F, 0.84F, 0.72F},
                                                                {0.80F, 0.30F, 0.26F},
                                                                {0.38F, 0.60F, 0.86F},
                                                                {0.95F, 0.78F, 0.35F},
                                                                {0.45F, 0.72F, 0.48F},
                                                                {0.66F, 0.48F, 0.78F},
                                                                {0.88F, 0.55F, 0.70F},
                                                                {0.60F, 0.60F, 0.60F}}};
  std::vector<Isosurface> surfaces;
  const std::vector<std::string_view> parts = Split(text, ',');
  for (std::size_t i = 0; i < parts.size(); ++i) {
    if (surfaces.size() == kColors.size()) {
      return Status::InvalidArgument(fmt::format("{} '{}' has more than {} values", option, text, kMaxIsosurfaces));
    }
    std::string_view item = parts[i];
    // A colour that begins with a digit goes on behind two more commas.
    const std::size_t colon = item.find(':');
    if (const std::string_view color = colon == std::string_view::npos ? "" : item.substr(colon + 1);
        !color.empty() && std::string_view("0123456789.").find(color[0]) != std::string_view::npos && i + 2 < parts.size()) {
      item = {item.data(), std::size_t(parts[i + 2].data() + parts[i + 2].size() - item.data())};
      i += 2;
    }
    const std::vector<std::string_view> fields = Split(item, ':');
    if (fields.size() > 3) return Status::InvalidArgument(fmt::format("{} '{}' is not V[:COLOUR[:OPACITY]]", option, item));
    const Result<double> value = ParseNumber(option, fields[0], {-kMaxScalar, kMaxScalar});
    if (!value.ok()) return value.status();
    Isosurface surface{*value, kColors[surfaces.size()], 1};
    if (fields.size() > 1) {
      const Result<StraightColor> color = ParseColor(option, fields[1]);
      if (!color.ok()) return color.status();
      surface.color = {color->r, color->g, color->b};
      surface.opacity = double(color->a);
    }
    if (fields.size() > 2) {
      const Result<double> opacity = ParseNumber(option, fields[2], {0, 1});
      if (!opacity.ok()) return opacity.status();
      surface.opacity = *opacity;
    }
    surfaces.push_back(surface);
  }
  std::ranges::sort(surfaces, {}, &Isosurface::value);
  const auto twice = std::ranges::adjacent_find(surfaces, {}, &Isosurface::value);
  if (twice == surfaces.end()) return surfaces;
  return Status::InvalidArgument(fmt::format("{} '{}' has the value {:g} twice", option, text, twice->value));
}

Result<std::vector<GradientOpacityPoint>> ParseGradientOpacities(std::string_view option, std::string_view text) {
  std::vector<GradientOpacityPoint> points;
  for (const std::string_view item : Split(text, ',')) {
    const std::vector<std::string_view> fields = Split(item, ':');
    if (fields.size() != 2) return Status::InvalidArgument(fmt::format("{} '{}' is not GRADIENT:OPACITY", option, item));
    const Result<double> slope = ParseNumber(option, fields[0], {0, kMaxScalar});
    if (!slope.ok()) return slope.status();
    const Result<double> opacity = ParseNumber(option, fields[1], {0, 1});
    if (!opacity.ok()) return opacity.status();
    points.push_back({*slope, *opacity});
  }
  if (const Status status = Validate(points); !status.ok()) {
    return Status::InvalidArgument(fmt::format("{} '{}': {}", option, text, status.message()));
  }
  return points;
}

// A whole number of at least `least`.
Result<std::uint64_t> ParseLabel(std::string_view option, std::string_view text, std::uint64_t least) {
  const auto value = ParseNumber<std::uint64_t>(text);
  if (value && *value >= least) return *value;
  return Status::InvalidArgument(
      fmt::format("{} has '{}', must be a whole number of at least {}", option, Printable(std::string(text.substr(0, 64))), least));
}

Result<std::vector<LabelOpacity>> ParseLabelOpacities(std::string_view option, std::string_view text) {
  std::vector<LabelOpacity> opacities;
  for (const std::string_view item : Split(text, ',')) {
    const std::vector<std::string_view> fields = Split(item, '=');
    if (fields.size() != 2) return Status::InvalidArgument(fmt::format("{} '{}' is not LABEL=OPACITY", option, item));
    const Result<std::uint64_t> value = ParseLabel(option, fields[0], 1);
    if (!value.ok()) return value.status();
    const Result<double> opacity = ParseNumber(option, fields[1], {0, 1});
    if (!opacity.ok()) return opacity.status();
    opacities.push_back({*value, *opacity});
  }
  return opacities;
}

Result<std::vector<LabelRange>> ParseLabelRanges(std::string_view option, std::string_view text) {
  std::vector<LabelRange> ranges;
  for (const std::string_view item : Split(text, ',')) {
    if (item.find_first_not_of("0123456789-") != std::string_view::npos) {
      if (item.size() > kMaxNameBytes) {
        return Status::InvalidArgument(
            fmt::format("{} has a name of {} bytes, at most {} are possible", option, item.size(), kMaxNameBytes));
      }
      ranges.push_back({.name = std::string(item)});
      continue;
    }
    const std::size_t hyphen = item.find('-');
    const Result<std::uint64_t> first = ParseLabel(option, item.substr(0, hyphen), 1);
    if (!first.ok()) return first.status();
    const Result<std::uint64_t> last = hyphen == std::string_view::npos ? first : ParseLabel(option, item.substr(hyphen + 1), *first);
    if (!last.ok()) return last.status();
    ranges.push_back({*first, *last});
  }
  return ranges;
}

std::string TakeName(std::string_view& text, std::string_view ends) {
  std::string name;
  std::size_t i = 0;
  for (; i < text.size() && ends.find(text[i]) == std::string_view::npos; ++i) {
    if (text[i] == '\\' && i + 1 < text.size()) ++i;
    name += text[i];
  }
  text.remove_prefix(i);
  return name;
}

Status CheckName(std::string_view option, std::string_view text, const std::string& name) {
  if (name.empty()) return Status::InvalidArgument(fmt::format("{} '{}' has an empty name", option, text));
  if (name.size() <= kMaxNameBytes) return Status::Ok();
  return Status::InvalidArgument(fmt::format("{} has a name of {} bytes, at most {} are possible", option, name.size(), kMaxNameBytes));
}

namespace {

// The length of the JSON that `text` begins with; of what is none, that up to a comma.
std::size_t ValueLength(std::string_view text) {
  if (text.empty() || (text[0] != '{' && text[0] != '[')) return std::min(text.find(','), text.size());
  int depth = 0;
  bool quoted = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '"') quoted = !quoted;
    if (quoted) {
      if (text[i] == '\\') ++i;
      continue;
    }
    if (text[i] == '{' || text[i] == '[') ++depth;
    if ((text[i] == '}' || text[i] == ']') && --depth == 0) return i + 1;
  }
  return text.size();
}

}  // namespace

Result<Rgb> ParseOpaqueColor(std::string_view option, std::string_view text) {
  const Result<StraightColor> color = ParseColor(option, text);
  if (!color.ok()) return color.status();
  if (color->a == 1) return Rgb{color->r, color->g, color->b};
  return Status::InvalidArgument(fmt::format("{} '{}' has an opacity of {:g}, but must be opaque", option, text, color->a));
}

Result<std::vector<std::string>> ParseNames(std::string_view option, std::string_view text) {
  std::vector<std::string> names;
  for (std::string_view rest = text;; rest.remove_prefix(1)) {
    names.push_back(TakeName(rest, ","));
    if (Status status = CheckName(option, text, names.back()); !status.ok()) return status;
    if (rest.empty()) return names;
  }
}

Result<std::vector<NamedText>> ParseNamedTexts(std::string_view option, std::string_view text) {
  std::vector<NamedText> found;
  for (std::string_view rest = text;; rest.remove_prefix(1)) {
    std::string_view after = rest;
    std::string name = TakeName(after, ",=");
    const bool named = after.starts_with('=');
    if (!named && found.empty()) return Status::InvalidArgument(fmt::format("{} '{}' is not NAME=VALUE,...", option, text));
    if (named) {
      if (Status status = CheckName(option, text, name); !status.ok()) return status;
      if (std::ranges::find(found, name, &NamedText::name) != found.end())
        return Status::InvalidArgument(fmt::format("{} names '{}' twice", option, name));
      found.push_back({std::move(name), ""});
      rest = after.substr(1);
    } else {
      found.back().text += ',';
    }
    const std::size_t length = ValueLength(rest);
    found.back().text += rest.substr(0, length);
    rest.remove_prefix(length);
    if (rest.empty()) return found;
    if (rest[0] != ',') return Status::InvalidArgument(fmt::format("{} '{}' has '{}' behind a value", option, text, rest.substr(0, 16)));
  }
}

Result<std::vector<SteeredValue>> ParseSteeredValues(std::string_view option, std::string_view text) {
  constexpr double kMost = std::numeric_limits<double>::max();
  const Result<std::vector<NamedText>> named = ParseNamedTexts(option, text);
  if (!named.ok()) return named.status();
  std::vector<SteeredValue> values;
  for (const NamedText& each : *named) {
    const Result<double> value = ParseNumber(fmt::format("{} {}", option, each.name), each.text, {-kMost, kMost});
    if (!value.ok()) return value.status();
    values.push_back({each.name, *value});
  }
  return values;
}

namespace {

// fmt writes the fewest digits that read back the same.
template <class Items>
std::string Joined(const Items& items, const auto& text_of) {
  std::string joined;
  for (const auto& item : items) joined += (joined.empty() ? "" : ",") + text_of(item);
  return joined;
}

}  // namespace

std::string TextOf(const ImageSize& size) { return fmt::format("{}x{}", size.width, size.height); }
std::string TextOf(const Vec3& point) { return fmt::format("{},{},{}", point.x, point.y, point.z); }
std::string TextOf(const ScalarRange& range) {
  const std::string_view unit = range.percentiles ? "%" : "";
  return fmt::format("{}{}:{}{}", range.min, unit, range.max, unit);
}
std::string TextOf(const Rgb& color) { return fmt::format("{},{},{}", color.r, color.g, color.b); }
std::string TextOfName(const std::string& name) {
  std::string text;
  for (const char c : name) text += std::string_view(",=\\").find(c) == std::string_view::npos ? std::string(1, c) : std::string("\\") + c;
  return text;
}
std::string TextOf(const std::vector<std::string>& names) { return Joined(names, TextOfName); }
std::string TextOf(const ClipBox& box) {
  const auto bound = [](double value, double none) { return value == none ? "" : fmt::format("{}", value); };
  const auto bounds = [&](Axis axis) { return bound(box.low[axis], -kMaxCoordinate) + ":" + bound(box.high[axis], kMaxCoordinate); };
  return Joined(kAxes, bounds) + (box.unit == ClipUnit::kVoxels ? "v" : box.unit == ClipUnit::kPercent ? "%" : "");
}
std::string TextOf(const ClipPlane& plane) { return fmt::format("{},{}", TextOf(plane.normal), plane.offset); }
std::string TextOf(const std::vector<Isosurface>& surfaces) {
  return Joined(surfaces,
                [](const Isosurface& s) { return fmt::format("{}:{},{},{}:{}", s.value, s.color.r, s.color.g, s.color.b, s.opacity); });
}
std::string TextOf(const std::vector<GradientOpacityPoint>& points) {
  return Joined(points, [](const GradientOpacityPoint& point) { return fmt::format("{}:{}", point.slope, point.opacity); });
}
std::string TextOf(const std::vector<LabelOpacity>& opacities) {
  return Joined(opacities, [](const LabelOpacity& label) { return fmt::format("{}={}", label.value, label.opacity); });
}
std::string TextOf(const std::vector<LabelRange>& ranges) {
  return Joined(ranges, [](const LabelRange& range) {
    if (!range.name.empty()) {  // a comma would end it
      std::string pattern = range.name;
      std::ranges::replace(pattern, ',', '?');
      return pattern;
    }
    return range.first == range.last ? fmt::format("{}", range.first) : fmt::format("{}-{}", range.first, range.last);
  });
}

}  // namespace slabstream
