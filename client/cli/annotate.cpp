// `annotate`, for the Python package: puts pixels over a background and draws annotations onto them, or makes a file of them, so that its
// pictures are those of the command line.
//
// stdin: a line of JSON, and behind it the pixels: width * height * 4 floats of this machine, premultiplied, row 0 first.
//   {"size": [W, H], "panes": [the "geometry" of a picture's record, ...], "title", "scale_bar", "orientation_marker", "sides_only",
//    "axes", "color_bar", "legend", "font_size", "dpi", "background": [R, G, B, A],
//    "file": "jpg" or another ending, "depth", "quality",
//    "key": {"bars": [{"name", "colors": [[value, r, g, b], ...]}, ...], "entries": [{"name", "color": [r, g, b]}, ...]}}
// Only size and panes must be there. stdout: the file; without "file" the pixels that it would show.
#include <algorithm>
#include <array>
#include <cstddef>
#include <iostream>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "client/cli/commands.h"
#include "client/pictures/annotations.h"
#include "client/pictures/picture_writer.h"
#include "client/request/json_value.h"
#include "client/request/picture_record.h"
#include "common/cli/program.h"
#include "common/view/camera.h"

namespace slabstream {
namespace {

constexpr double kMost = 1e300;

struct Order {
  ImageSize size;
  std::vector<PictureGeometry> panes;
  PictureFormat format;
  PictureKey key;
  std::optional<PictureFileType> file;
};

std::vector<double> Numbers(const JsonValue& value, std::size_t count) {
  std::vector<double> numbers;
  value.Each([&](const JsonValue& number) { numbers.push_back(number.Number({-kMost, kMost})); }, count);
  if (numbers.size() > count) value.Complain(value.Shown() + " has too many numbers");
  numbers.resize(count);
  return numbers;
}

Vec3 Vector(const JsonValue& value) {
  const std::vector<double> v = Numbers(value, 3);
  return {v[0], v[1], v[2]};
}

// As GeometryJson writes it.
PictureGeometry Geometry(const JsonValue& value) {
  static constexpr std::array<World, 3> kWorlds = {World::kVoxels, World::kScene, World::kPatient};
  static constexpr std::array<std::string_view, 3> kWorldNames = {NameOf(kWorlds[0]), NameOf(kWorlds[1]), NameOf(kWorlds[2])};
  PictureGeometry geometry;
  static constexpr std::array<std::string_view, 2> kProjections = {NameOf(Projection::kOrthographic), NameOf(Projection::kPerspective)};
  const auto into = [](Vec3& to) { return [&to](const JsonValue& v) { to = Vector(v); }; };
  value.Fields({{"world", [&](const JsonValue& v) { geometry.world = kWorlds.at(v.OneOf(kWorldNames)); }},
                {"unit", [&](const JsonValue& v) { geometry.unit = LengthUnit(v.OneOf(kLengthUnitNames) + 1); }},
                {"projection",
                 [&](const JsonValue& v) {
                   geometry.projection = v.OneOf(kProjections) == 1 ? Projection::kPerspective : Projection::kOrthographic;
                 }},
                {"right", into(geometry.right)},
                {"up", into(geometry.up)},
                {"forward", into(geometry.forward)},
                {"target", into(geometry.target)},
                {"target_depth", JsonValue::Into(geometry.target_depth, {-kMost, kMost})},
                {"pixel_size", JsonValue::Into(geometry.pixel_size, {0, kMost, true})},
                {"box_corner", into(geometry.box_corner)},
                {"box_edges", [&](const JsonValue& v) {
                   std::vector<Vec3> edges;
                   v.Each([&](const JsonValue& edge) { edges.push_back(Vector(edge)); }, 3);
                   if (edges.size() == 3) std::ranges::copy(edges, geometry.box_edges.begin());
                 }}});
  return geometry;
}

Rgb Color(const std::vector<double>& numbers, std::size_t first) {
  return {float(numbers[first]), float(numbers[first + 1]), float(numbers[first + 2])};
}

void ReadKey(const JsonValue& value, PictureKey& key) {
  const auto named = [](std::string& name) {
    return [&name](const JsonValue& v) {
      name = v.Text();
      if (const Status status = CheckTitle("the name", name); !status.ok()) v.Complain(status.message());
    };
  };
  const auto bar = [&](const JsonValue& v) {
    PictureKey::Bar& read = key.bars.emplace_back();
    const auto color = [&](const JsonValue& point) {
      const std::vector<double> numbers = Numbers(point, 4);
      read.colors.push_back({numbers[0], Color(numbers, 1)});
    };
    v.Fields({{"name", named(read.name)}, {"colors", [&](const JsonValue& colors) { colors.Each(color, 2); }}});
    if (read.colors.size() < 2 || !(read.low() < read.high())) v.Complain("has no two colours of rising values");
  };
  const auto entry = [&](const JsonValue& v) {
    PictureKey::Entry& read = key.entries.emplace_back();
    v.Fields({{"name", named(read.name)}, {"color", [&](const JsonValue& color) { read.color = Color(Numbers(color, 3), 0); }}});
  };
  value.Fields({{"bars", [&](const JsonValue& v) { v.Each(bar); }}, {"entries", [&](const JsonValue& v) { v.Each(entry); }}});
}

Result<Order> ParseOrder(const std::string& text) {
  const Result<Json> json = ParseJson(text);
  if (!json.ok()) return json.status();
  Order order;
  std::optional<std::string> mistake;
  const auto size = [&](const JsonValue& v) {
    const std::vector<double> sides = Numbers(v, 2);
    for (const double side : sides) {
      if (!(side >= 1 && side <= kMaxImageSide)) return v.Complain("is no size");
    }
    if (sides[0] * sides[1] > double(kMaxImagePixels)) return v.Complain("is no size");
    order.size = {int(sides[0]), int(sides[1])};
  };
  const auto background = [&](const JsonValue& v) {
    const std::vector<double> channels = Numbers(v, 4);
    order.format.background = {float(channels[0]), float(channels[1]), float(channels[2]), float(channels[3])};
  };
  const auto file = [&](const JsonValue& v) {
    order.file = PictureFileTypeOf("picture." + v.Text());
    if (!order.file) v.Complain("is no ending of pictures");
  };
  auto fields = FormatFields(order.format);
  fields.insert(fields.end(),
                {{"size", size},
                 {"background", background},
                 {"file", file},
                 {"panes", [&](const JsonValue& v) { v.Each([&](const JsonValue& pane) { order.panes.push_back(Geometry(pane)); }, 1); }},
                 {"sides_only", JsonValue::Into(order.format.annotations.sides_only)},
                 {"key", [&](const JsonValue& v) { ReadKey(v, order.key); }}});
  JsonValue(*json, "", mistake).Fields(fields);
  if (mistake) return Status::InvalidArgument(*mistake);
  if (order.size.width == 0 || order.panes.empty()) return Status::InvalidArgument("size or panes are missing");
  return order;
}

// The pixels over the background, and on them the annotations.
Status WritePixels(const Order& order, const PictureImage& image) {
  const Result<ComposedPicture> picture = ComposedPicture::Make(image, order.size, order.format, order.panes, order.key);
  if (!picture.ok()) return picture.status();
  std::vector<float> row(4 * std::size_t(order.size.width));
  for (int y = 0; y < order.size.height; ++y) {
    picture->Row(y, row, {});
    std::cout.write(reinterpret_cast<const char*>(row.data()), std::streamsize(row.size() * sizeof(float)));
  }
  return FlushOutput();
}

Status WriteFile(const Order& order, const PictureImage& image) {
  PictureNotes notes{.geometry = order.panes.front(), .panes = order.panes, .key = order.key, .record = {}};
  const Result<std::vector<std::byte>> file = PictureFile(*order.file, image, order.size, order.format, notes);
  if (!file.ok()) return file.status();
  std::cout.write(reinterpret_cast<const char*>(file->data()), std::streamsize(file->size()));
  return FlushOutput();
}

}  // namespace

Status RunAnnotate() {
  std::string text;
  std::getline(std::cin, text);
  const Result<Order> order = ParseOrder(text);
  if (!order.ok()) return order.status();
  if (Status status = CheckCanDraw(order->format.annotations); !status.ok()) return status;
  LocalImage pixels = MakeLocalImage(PixelFormat::kRgba, {0, 0, order->size.width, order->size.height});
  if (!std::cin.read(reinterpret_cast<char*>(pixels.rgba.data()), std::streamsize(pixels.rgba.size() * sizeof(float)))) {
    return Status::InvalidArgument("there are fewer pixels than the size says");
  }
  const PictureImage image(std::move(pixels));
  return order->file ? WriteFile(*order, image) : WritePixels(*order, image);
}

}  // namespace slabstream
