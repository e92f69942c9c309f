// Codecs of structs that are not simply the fields of their messages (about.proto: own_codec).
#include <array>
#include <string>
#include <utility>
#include <vector>

#include "common/renderers/registry.h"
#include "common/text/url.h"
#include "common/wire/codec.h"
#include "common/wire/codecs.h"
#include "common/wire/limits.h"
#include "common/wire/rules.h"
#include "slabstream/v1/client.pb.h"

namespace slabstream {

void Write(const Status& in, v1::Status& out) {
  out.set_code(static_cast<v1::StatusCode>(static_cast<int>(in.code())));
  out.set_message(WireText(Redacted(in.message()), kMaxTextBytes));
}
void Read(const v1::Status& in, Status& out, Checker& check) {
  const StatusCode code = check.OneOf("code", in.code(), StatusCode::kInvalidArgument, StatusCode::kInternal);
  out = {code, check.Text("message", in.message(), 0, kMaxTextBytes)};
}

void Write(const VolumeDescription& in, v1::VolumeDescription& out) {
  WriteFields(in, out);
  const auto write = [&](Axis axis, auto& places) {
    const std::vector<double>& knots = in.geometry.stretch.knots(axis);
    if (!knots.empty()) places.Add(knots.begin() + 1, knots.end() - 1);
  };
  write(Axis::kX, *out.mutable_x_places());
  write(Axis::kY, *out.mutable_y_places());
  write(Axis::kZ, *out.mutable_z_places());
}
void Read(const v1::VolumeDescription& in, VolumeDescription& out, Checker& check) {
  ReadFields(in, out, check);
  if (check.ok()) Rules(out, check);
  Stretch::Places places;
  const auto read = [&](Axis axis, std::string_view field, const auto& of) {
    std::vector<double>& its = places[std::size_t(Number(axis))];
    ReadNumbers(field, of, its, kMaxVolumeSide, check);
    for (std::size_t i = 0; i < its.size(); ++i) {
      const auto scope = check.In(field, i);
      its[i] = check.Finite("", its[i]);
    }
    if (Status status = check.ok() ? Stretch::Check(its, out.geometry.size[axis]) : Status::Ok(); !status.ok()) {
      check.Fail(field, status.message());
    }
  };
  read(Axis::kX, "x_places", in.x_places());
  read(Axis::kY, "y_places", in.y_places());
  read(Axis::kZ, "z_places", in.z_places());
  if (check.ok()) out.geometry.stretch = Stretch::Make(places, out.geometry.size).value();
}

// The corners of empty bounds mean nothing.
void Write(const PixelBounds& in, v1::PixelBounds& out) {
  if (in.empty()) return;
  out.set_x_begin(static_cast<std::uint32_t>(in.x_begin));
  out.set_y_begin(static_cast<std::uint32_t>(in.y_begin));
  out.set_x_end(static_cast<std::uint32_t>(in.x_end));
  out.set_y_end(static_cast<std::uint32_t>(in.y_end));
}
void Read(const v1::PixelBounds& in, PixelBounds& out, Checker& check) {
  Set(out.x_begin, check.Range("x_begin", in.x_begin(), 0, kMaxFrameSide));
  Set(out.y_begin, check.Range("y_begin", in.y_begin(), 0, kMaxFrameSide));
  Set(out.x_end, check.Range("x_end", in.x_end(), std::uint64_t(out.x_begin), kMaxFrameSide));
  Set(out.y_end, check.Range("y_end", in.y_end(), std::uint64_t(out.y_begin), kMaxFrameSide));
  if (out.empty()) out = {};
}

void Write(const NewLabel& in, v1::NewLabel& out) {
  out.set_value(in.value);
  out.set_name(WireText(in.name, kMaxLabelNameBytes));
  if (!in.color) return;
  out.set_colored(true);
  out.set_red((*in.color)[0]);
  out.set_green((*in.color)[1]);
  out.set_blue((*in.color)[2]);
}
void Read(const v1::NewLabel& in, NewLabel& out, Checker& check) {
  check.That(in.value() >= 1, "value", "0, which is no label");
  out.value = in.value();
  out.name = check.Text("name", in.name(), 0, kMaxLabelNameBytes);
  const auto channel = [&](std::string_view field, float value) { return float(check.Between(field, double(value), 0, 1)); };
  const std::array<float, 3> color = {channel("red", in.red()), channel("green", in.green()), channel("blue", in.blue())};
  if (in.colored()) out.color = color;
}

void Write(const FieldInfo& in, v1::FieldInfo& out) {
  out.set_name(in.name);
  out.set_channel(in.channel);
  out.set_labels(in.labels);
  out.set_shown(in.shown);
  if (in.window) Write(*in.window, *out.mutable_window());
  if (in.color) Write(Rgb{(*in.color)[0], (*in.color)[1], (*in.color)[2]}, *out.mutable_color());
}
void Read(const v1::FieldInfo& in, FieldInfo& out, Checker& check) {
  out.name = check.Text("name", in.name(), 0, kMaxNameBytes);
  out.channel = in.channel();
  out.labels = in.labels();
  out.shown = in.shown();
  if (in.has_window()) ReadPart("window", true, in.window(), out.window.emplace(), check);
  if (!in.has_color()) return;
  Rgb color;
  ReadPart("color", true, in.color(), color, check);
  out.color = {color.r, color.g, color.b};
}

void Write(const ClipSlab& in, v1::ClipSlab& out) {
  WriteFields(in, out);
  if (in.index) out.set_slice(std::uint32_t(*in.index) + 1);
}
void Read(const v1::ClipSlab& in, ClipSlab& out, Checker& check) {
  ReadFields(in, out, check);
  const auto slice = std::int32_t(check.Range("slice", in.slice(), 0, kMaxVolumeSide));
  if (slice > 0) out.index = slice - 1;
}

// ---- what boxes behind need not draw

void Write(const OcclusionMask& in, v1::OcclusionMask& out) {
  out.set_tiles_x(static_cast<std::uint32_t>(in.tiles_x));
  out.set_tiles_y(static_cast<std::uint32_t>(in.tiles_y));
  std::string& bits = *out.mutable_hidden();
  bits.resize((in.steps.size() + 7) / 8);
  for (std::size_t i = 0; i < in.steps.size(); ++i) {
    if (in.steps[i] == kOcclusionSteps) bits[i / 8] = static_cast<char>(bits[i / 8] | 1 << i % 8);
  }
}
void Read(const v1::OcclusionMask& in, OcclusionMask& out, Checker& check) {
  const std::uint32_t tiles_x = check.Range("tiles_x", in.tiles_x(), 0, kMaxOcclusionTiles);
  const std::uint32_t tiles_y = check.Range("tiles_y", in.tiles_y(), tiles_x == 0 ? 0 : 1, tiles_x == 0 ? 0 : kMaxOcclusionTiles);
  const std::size_t tiles = std::size_t{tiles_x} * tiles_y;
  const std::string bits = check.Text("hidden", in.hidden(), (tiles + 7) / 8, (tiles + 7) / 8);
  if (!check.ok()) return;
  const auto bit = [&](std::size_t i) { return static_cast<std::uint8_t>(static_cast<std::uint8_t>(bits[i / 8]) >> i % 8 & 1); };
  for (std::size_t i = tiles; i < 8 * bits.size(); ++i) check.That(bit(i) == 0, "hidden", "a bit beyond the last tile");
  out.tiles_x = static_cast<std::int32_t>(tiles_x);
  out.tiles_y = static_cast<std::int32_t>(tiles_y);
  out.steps.resize(tiles);
  for (std::size_t i = 0; i < tiles; ++i) out.steps[i] = bit(i) != 0 ? kOcclusionSteps : std::uint8_t{0};
}

void Write(const OpaqueFront& in, v1::OpaqueFront& out) {
  out.set_tile(std::uint32_t(in.tile));
  out.set_unit(std::uint32_t(in.unit));
  out.set_tiles_x(std::uint32_t(in.tiles_x));
  out.set_tiles_y(std::uint32_t(in.tiles_y));
  for (const OpaqueFront::Depths& depths : in.tiles) out.mutable_depths()->append(depths.begin(), depths.end());
}
void Read(const v1::OpaqueFront& in, OpaqueFront& out, Checker& check) {
  Set(out.tile, check.Range("tile", in.tile(), kOcclusionTile, kMaxGridSide));
  Set(out.unit, check.Range("unit", in.unit(), 1, kMaxVolumeSide));
  Set(out.tiles_x, check.Range("tiles_x", in.tiles_x(), 1, OpaqueFront::kMostTiles));
  Set(out.tiles_y, check.Range("tiles_y", in.tiles_y(), 1, OpaqueFront::kMostTiles));
  const std::size_t bytes = std::size_t(out.tiles_x) * std::size_t(out.tiles_y) * kOcclusionSteps;
  const std::string depths = check.Text("depths", in.depths(), bytes, bytes);
  if (!check.ok()) return;
  out.tiles.resize(bytes / kOcclusionSteps);
  for (std::size_t i = 0; i < bytes; ++i) out.tiles[i / kOcclusionSteps][i % kOcclusionSteps] = std::uint8_t(depths[i]);
}

// ---- FrameSetup: parts without content do not travel, and renderers travel by name

void Write(const FrameSetup& in, v1::FrameSetup& out) {
  WriteFields(in, out);
  out.set_renderer(std::string(in.renderer->name()));
  out.mutable_parameters()->Add(in.parameters.begin(), in.parameters.end());
  if (!in.sheets.empty()) Write(in.sheets, *out.mutable_sheets());
  if (!in.clip.empty()) Write(in.clip, *out.mutable_clip());
  if (!in.front.empty()) Write(in.front, *out.mutable_front());
}

namespace {

void ReadRenderer(const v1::FrameSetup& in, FrameSetup& out, Checker& check) {
  const Result<const RendererKind*> renderer = RequireRenderer(check.Text("renderer", in.renderer(), 1, kMaxNameBytes));
  if (!renderer.ok()) return check.Adopt(renderer.status());
  SetRenderer(**renderer, out);
  const std::vector<RendererParameter>& parameters = out.renderer->parameters();
  if (std::size_t(in.parameters_size()) != parameters.size()) {
    return check.Fail("parameters", std::to_string(in.parameters_size()) + " values, expected " + std::to_string(parameters.size()));
  }
  std::vector<double> values;
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const auto scope = check.In("parameters", i);
    values.push_back(check.Between("", in.parameters(int(i)), parameters[i].least, parameters[i].greatest()));
  }
  SetParameters(std::move(values), out);
}

}  // namespace

void Read(const v1::FrameSetup& in, FrameSetup& out, Checker& check) {
  ReadRenderer(in, out, check);  // sets the halo, too
  ReadFields(in, out, check);
  const auto read = [&](std::string_view field, bool has, const auto& from, auto& part) {
    if (has) ReadPart(field, true, from, part, check);
  };
  read("sheets", in.has_sheets(), in.sheets(), out.sheets);
  read("clip", in.has_clip(), in.clip(), out.clip);
  read("front", in.has_front(), in.front(), out.front);
  if (check.ok()) Rules(out, check);
}

}  // namespace slabstream
