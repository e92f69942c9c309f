#include <algorithm>
#include <string>

#include "common/wire/codecs.h"
#include "common/wire/limits.h"
#include "common/wire/wire_text.h"

namespace slabstream {

// Checker::OneOf takes the enumerators from the structs: the schema must have the same number of them.
static_assert(v1::Axis_MAX == Number(Axis::kZ) + 1);
static_assert(v1::ScalarType_MAX == static_cast<int>(ScalarType::kFloat32));
static_assert(v1::StatusCode_MAX == kStatusCodeCount - 1);
static_assert(v1::PixelFormat_MAX == static_cast<int>(PixelFormat::kSum));
static_assert(v1::Codec_MAX == static_cast<int>(Codec::kZstd));
static_assert(v1::Stage_MAX == kStageCount);

namespace {

// Each index in [min, kMaxVolumeSide].
Index3 ReadIndex(std::string_view field, const v1::Index3& in, std::uint32_t min, Checker& check) {
  const auto scope = check.In(field);
  const auto read = [&](std::string_view axis, std::uint32_t value) {
    return static_cast<std::int32_t>(check.Range(axis, value, min, kMaxVolumeSide));
  };
  return {read("x", in.x()), read("y", in.y()), read("z", in.z())};
}

}  // namespace

// ---- Index3, Vec3, Box

v1::Index3 ToProto(const Index3& in) {
  v1::Index3 out;
  out.set_x(static_cast<std::uint32_t>(in.x));
  out.set_y(static_cast<std::uint32_t>(in.y));
  out.set_z(static_cast<std::uint32_t>(in.z));
  return out;
}

v1::Vec3 ToProto(const Vec3& in) {
  v1::Vec3 out;
  out.set_x(in.x);
  out.set_y(in.y);
  out.set_z(in.z);
  return out;
}

Vec3 FromProto(const v1::Vec3& in, Checker& check) {
  return {check.Finite("x", in.x()), check.Finite("y", in.y()), check.Finite("z", in.z())};
}

v1::Box ToProto(const Box& in) {
  v1::Box out;
  *out.mutable_begin() = ToProto(in.begin);
  *out.mutable_end() = ToProto(in.end);
  return out;
}

Box FromProto(const v1::Box& in, Checker& check) {
  const Box out = {ReadIndex("begin", in.begin(), 0, check), ReadIndex("end", in.end(), 0, check)};
  check.That(!out.empty(), "", "an empty box");
  return out;
}

// ---- PixelBounds, PixelRange

v1::PixelBounds ToProto(const PixelBounds& in) {
  v1::PixelBounds out;
  if (in.empty()) return out;  // its corners mean nothing
  out.set_x_begin(static_cast<std::uint32_t>(in.x_begin));
  out.set_y_begin(static_cast<std::uint32_t>(in.y_begin));
  out.set_x_end(static_cast<std::uint32_t>(in.x_end));
  out.set_y_end(static_cast<std::uint32_t>(in.y_end));
  return out;
}

PixelBounds FromProto(const v1::PixelBounds& in, Checker& check) {
  const auto read = [&](std::string_view field, std::uint32_t value, std::uint32_t min) {
    return static_cast<std::int32_t>(check.Range(field, value, min, kMaxFrameSide));
  };
  PixelBounds out;
  out.x_begin = read("x_begin", in.x_begin(), 0);
  out.y_begin = read("y_begin", in.y_begin(), 0);
  out.x_end = read("x_end", in.x_end(), in.x_begin());
  out.y_end = read("y_end", in.y_end(), in.y_begin());
  return out.empty() ? PixelBounds{} : out;
}

v1::PixelRange ToProto(const PixelRange& in) {
  v1::PixelRange out;
  out.set_begin(in.begin);
  out.set_end(in.end);
  return out;
}

PixelRange FromProto(const v1::PixelRange& in, Checker& check) {
  PixelRange out;
  out.begin = check.Range("begin", in.begin(), 0, kMaxFramePixels);
  out.end = check.Range("end", in.end(), out.begin, kMaxFramePixels);
  return out;
}

// ---- ValueRange, VolumeDescription

v1::ValueRange ToProto(const ValueRange& in) {
  v1::ValueRange out;
  out.set_min(in.min);
  out.set_max(in.max);
  return out;
}

ValueRange FromProto(const v1::ValueRange& in, Checker& check) {
  const ValueRange out = {check.Finite("min", in.min()), check.Finite("max", in.max())};
  check.That(out.min <= out.max, "", "min is above max");
  return out;
}

v1::VolumeDescription ToProto(const VolumeDescription& in) {
  v1::VolumeDescription out;
  *out.mutable_size() = ToProto(in.geometry.size);
  *out.mutable_spacing() = ToProto(in.geometry.spacing);
  out.set_type(WireEnum<v1::ScalarType>(in.type, ScalarType::kUint8));
  out.set_scale(in.mapping.scale);
  out.set_offset(in.mapping.offset);
  return out;
}

VolumeDescription FromProto(const v1::VolumeDescription& in, Checker& check) {
  VolumeDescription out;
  out.geometry.size = ReadIndex("size", in.size(), 1, check);
  out.geometry.spacing = PositiveFromProto("spacing", in.spacing(), check);
  out.type = check.OneOf("type", in.type(), ScalarType::kUint8, ScalarType::kFloat32);
  out.mapping.scale = check.Finite("scale", in.scale());
  out.mapping.offset = check.Finite("offset", in.offset());
  return out;
}

Vec3 PositiveFromProto(std::string_view field, const v1::Vec3& in, Checker& check) {
  const auto scope = check.In(field);
  return {check.Positive("x", in.x()), check.Positive("y", in.y()), check.Positive("z", in.z())};
}

// ---- Status, GroupKey

v1::Status ToProto(const Status& in) {
  v1::Status out;
  out.set_code(WireEnum<v1::StatusCode>(in.code(), StatusCode::kInvalidArgument));
  out.set_message(WireText(in.message(), kMaxTextBytes));
  return out;
}

Status FromProto(const v1::Status& in, Checker& check) {
  const StatusCode code = check.OneOf("code", in.code(), StatusCode::kInvalidArgument, StatusCode::kInternal);
  return {code, check.Text("message", in.message(), 0, kMaxTextBytes)};
}

v1::GroupKey ToProto(const GroupKey& in) {
  v1::GroupKey out;
  out.set_frame(in.frame);
  out.set_attempt(in.attempt);
  out.set_group(in.group);
  return out;
}

GroupKey FromProto(const v1::GroupKey& in, Checker& check) {
  return {.frame = in.frame(), .attempt = in.attempt(), .group = check.Range("group", in.group(), 0, kMaxGroups - 1)};
}

// ---- images

v1::RunImageHeader ToProto(const RunImageHeader& in) {
  v1::RunImageHeader out;
  out.set_format(WireEnum<v1::PixelFormat>(in.format, PixelFormat::kRgba));
  *out.mutable_bounds() = ToProto(in.bounds);
  out.set_run_count(in.run_count);
  out.set_pixel_count(in.pixel_count);
  out.set_color(WireEnum<v1::ColorCoding>(in.color, ColorCoding::kFloat32));
  return out;
}

RunImageHeader FromProto(const v1::RunImageHeader& in, Checker& check) {
  RunImageHeader out;
  out.format = check.OneOf("format", in.format(), PixelFormat::kRgba, PixelFormat::kSum);
  out.color = check.OneOf("color", in.color(), ColorCoding::kFloat32, ColorCoding::kFixed16);
  check.That(out.format == PixelFormat::kRgba || out.color == ColorCoding::kFloat32, "color", "not floats, in a format that is not rgba");
  out.bounds = Read("bounds", in.bounds(), check);
  // At most kMaxFramePixels pixels and 2^32 runs: the payload's length cannot overflow.
  out.pixel_count = check.Range("pixel_count", in.pixel_count(), 0, static_cast<std::uint64_t>(out.bounds.pixel_count()));
  const bool may_be_dense = out.pixel_count == static_cast<std::uint64_t>(out.bounds.pixel_count());
  out.run_count = check.Range("run_count", in.run_count(), may_be_dense || out.pixel_count == 0 ? 0 : 1, out.pixel_count);
  if (const std::uint64_t bytes = PayloadBytes(out); bytes > kMaxRunsBytes) {
    check.Fail("pixel_count", "a payload of " + std::to_string(bytes) + " bytes, at most " + std::to_string(kMaxRunsBytes));
  }
  return out;
}

Codec CodecFromProto(v1::Codec in, Checker& check) { return check.OneOf("codec", in, Codec::kRaw, Codec::kZstd); }

v1::EncodedRuns ToProto(const EncodedRuns& in) {
  v1::EncodedRuns out;
  *out.mutable_image() = ToProto(in.image);
  out.set_codec(WireEnum<v1::Codec>(in.codec, Codec::kRaw));
  out.set_encoded_bytes(in.encoded_bytes);
  out.set_digest(in.digest);
  return out;
}

EncodedRuns FromProto(const v1::EncodedRuns& in, Checker& check) {
  EncodedRuns out;
  out.image = Read("image", in.image(), check);
  check.That(out.image.color == ColorCoding::kFloat32, "image.color", "not floats, to a client");
  check.That(!IsDense(out.image), "image.run_count", "0, of a picture with pixels");
  out.codec = CodecFromProto(in.codec(), check);
  const std::uint64_t raw_bytes = PayloadBytes(out.image);
  out.encoded_bytes = check.Range("encoded_bytes", in.encoded_bytes(), out.codec == Codec::kRaw ? raw_bytes : 1, raw_bytes);
  out.digest = in.digest();
  return out;
}

v1::OcclusionMask ToProto(const OcclusionMask& in) {
  v1::OcclusionMask out;
  out.set_tiles_x(static_cast<std::uint32_t>(in.tiles_x));
  out.set_tiles_y(static_cast<std::uint32_t>(in.tiles_y));
  std::string& bits = *out.mutable_hidden();
  bits.resize((in.hidden.size() + 7) / 8);
  for (std::size_t i = 0; i < in.hidden.size(); ++i) {
    if (in.hidden[i] != 0) bits[i / 8] = static_cast<char>(bits[i / 8] | 1 << i % 8);
  }
  return out;
}

OcclusionMask FromProto(const v1::OcclusionMask& in, Checker& check) {
  const std::uint32_t tiles_x = check.Range("tiles_x", in.tiles_x(), 0, kMaxOcclusionTiles);
  const std::uint32_t tiles_y = check.Range("tiles_y", in.tiles_y(), tiles_x == 0 ? 0 : 1, tiles_x == 0 ? 0 : kMaxOcclusionTiles);
  const std::size_t tiles = std::size_t{tiles_x} * tiles_y;
  const std::string bits = check.Text("hidden", in.hidden(), (tiles + 7) / 8, (tiles + 7) / 8);
  if (!check.ok()) return {};
  const auto bit = [&](std::size_t i) { return static_cast<std::uint8_t>(static_cast<std::uint8_t>(bits[i / 8]) >> i % 8 & 1); };
  for (std::size_t i = tiles; i < 8 * bits.size(); ++i) check.That(bit(i) == 0, "hidden", "a bit beyond the last tile");
  OcclusionMask out;
  out.tiles_x = static_cast<std::int32_t>(tiles_x);
  out.tiles_y = static_cast<std::int32_t>(tiles_y);
  out.hidden.resize(tiles);
  for (std::size_t i = 0; i < tiles; ++i) out.hidden[i] = bit(i);
  return out;
}

// ---- reports

v1::Span ToProto(const Span& in) {
  v1::Span out;
  out.set_stage(WireEnum<v1::Stage>(in.stage, Stage::kFetch));
  out.set_begin_ns(in.begin_ns);
  out.set_end_ns(in.end_ns);
  return out;
}

Span FromProto(const v1::Span& in, Checker& check) {
  return {.stage = check.OneOf("stage", in.stage(), Stage::kFetch, Stage::kSample), .begin_ns = in.begin_ns(), .end_ns = in.end_ns()};
}

v1::RankReport ToProto(const RankReport& in) {
  v1::RankReport out;
  out.set_worker(in.worker);
  out.set_group(in.group);
  out.set_rank(in.rank);
  out.set_box(in.box);
  out.mutable_stage_ns()->Add(in.stage_ns.begin(), in.stage_ns.end());
  WriteAll(in.spans, out.mutable_spans());
  out.set_occupied_voxels(in.occupied_voxels);
  out.set_drawn_voxels(in.drawn_voxels);
  out.set_voxel_bytes(in.voxel_bytes);
  out.set_image_bytes(in.image_bytes);
  *out.mutable_image_bounds() = ToProto(in.image_bounds);
  out.set_image_pixels(in.image_pixels);
  return out;
}

RankReport FromProto(const v1::RankReport& in, Checker& check) {
  RankReport out;
  out.worker = in.worker();
  out.group = in.group();
  out.rank = in.rank();
  out.box = in.box();
  if (in.stage_ns_size() == kStageCount) {
    std::copy(in.stage_ns().begin(), in.stage_ns().end(), out.stage_ns.begin());
  } else {
    check.Fail("stage_ns", std::to_string(in.stage_ns_size()) + " values, expected " + std::to_string(kStageCount));
  }
  out.spans = ReadAll("spans", in.spans(), kMaxSpans, check);
  out.occupied_voxels = in.occupied_voxels();
  out.drawn_voxels = in.drawn_voxels();
  out.voxel_bytes = in.voxel_bytes();
  out.image_bytes = in.image_bytes();
  out.image_bounds = FromProto(in.image_bounds(), check);
  out.image_pixels = in.image_pixels();
  return out;
}

}  // namespace slabstream
