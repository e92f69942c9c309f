// Values that several messages are made of.
#pragma once

#include <cmath>
#include <limits>
#include <string>

#include "common/image/run_image.h"
#include "common/text/url.h"
#include "common/volume/layers.h"
#include "common/wire/client_messages.h"
#include "common/wire/fields.h"
#include "common/wire/limits.h"
#include "slabstream/v1/types.pb.h"

namespace slabstream {

// Checker::OneOf takes the enumerators from the structs: the schema must have the same number of them.
static_assert(v1::Axis_MAX == Number(Axis::kZ) + 1);
static_assert(v1::ScalarType_MAX == static_cast<int>(ScalarType::kFloat32));
static_assert(v1::StatusCode_MAX == kStatusCodeCount - 1);
static_assert(v1::PixelFormat_MAX == static_cast<int>(PixelFormat::kSum));
static_assert(v1::Codec_MAX == static_cast<int>(Codec::kZstd));
static_assert(v1::Stage_MAX == kStageCount);

inline constexpr WorkerId kMaxWorkerId = std::numeric_limits<WorkerId>::max();
inline constexpr std::uint64_t kMaxUint64 = std::numeric_limits<std::uint64_t>::max();

void Fields(auto& io, Is<WebTraffic> auto& m) {
  using P = v1::WebTraffic;
  io.Text("server", m.server, &P::server, &P::mutable_server, 1, kMaxNameBytes);
  io.Any(m.requests, &P::requests, &P::set_requests);
  io.Any(m.retries, &P::retries, &P::set_retries);
  io.Any(m.failures, &P::failures, &P::set_failures);
  io.Any(m.unchanged, &P::unchanged, &P::set_unchanged);
  io.Any(m.bytes, &P::bytes, &P::set_bytes);
  io.Any(m.milliseconds, &P::milliseconds, &P::set_milliseconds);
}

// ---- geometry

void Fields(auto& io, Is<Index3> auto& m) {
  using P = v1::Index3;
  io.Range("x", m.x, &P::x, &P::set_x, 0, kMaxVolumeSide);
  io.Range("y", m.y, &P::y, &P::set_y, 0, kMaxVolumeSide);
  io.Range("z", m.z, &P::z, &P::set_z, 0, kMaxVolumeSide);
}

void Fields(auto& io, Is<Vec3> auto& m) {
  using P = v1::Vec3;
  io.Finite("x", m.x, &P::x, &P::set_x);
  io.Finite("y", m.y, &P::y, &P::set_y);
  io.Finite("z", m.z, &P::z, &P::set_z);
}

inline void CheckPositive(std::string_view field, const Vec3& v, Checker& check) {
  const auto scope = check.In(field);
  check.Positive("x", v.x);
  check.Positive("y", v.y);
  check.Positive("z", v.z);
}

// Unit vectors at right angles, z = x cross y, but for rounding.
inline bool AreRightHanded(const Vec3& x, const Vec3& y, const Vec3& z) {
  constexpr double kTolerance = 1e-6;
  const auto near = [](double a, double b) { return std::abs(a - b) <= kTolerance; };
  return near(Length(x), 1) && near(Length(y), 1) && near(Dot(x, y), 0) && Length(Cross(x, y) - z) <= kTolerance;
}

void Fields(auto& io, Is<Box> auto& m) {
  using P = v1::Box;
  io.Message("begin", m.begin, &P::begin, &P::mutable_begin);
  io.Message("end", m.end, &P::end, &P::mutable_end);
  io.Check([&](Checker& check) { check.That(!m.empty(), "", "an empty box"); });
}

void Fields(auto& io, Is<PixelBounds> auto& m) {
  using P = v1::PixelBounds;
  io.Range("x_begin", m.x_begin, &P::x_begin, &P::set_x_begin, 0, kMaxFrameSide);
  io.Range("y_begin", m.y_begin, &P::y_begin, &P::set_y_begin, 0, kMaxFrameSide);
  io.Range("x_end", m.x_end, &P::x_end, &P::set_x_end, std::uint64_t(m.x_begin), kMaxFrameSide);
  io.Range("y_end", m.y_end, &P::y_end, &P::set_y_end, std::uint64_t(m.y_begin), kMaxFrameSide);
}

// The corners of empty bounds mean nothing.
inline void Write(const PixelBounds& in, v1::PixelBounds& out) {
  if (!in.empty()) WriteFields(in, out);
}
inline void Read(const v1::PixelBounds& in, PixelBounds& out, Checker& check) {
  ReadFields(in, out, check);
  if (out.empty()) out = {};
}

void Fields(auto& io, Is<PixelRange> auto& m) {
  using P = v1::PixelRange;
  io.Range("begin", m.begin, &P::begin, &P::set_begin, 0, kMaxFramePixels);
  io.Range("end", m.end, &P::end, &P::set_end, m.begin, kMaxFramePixels);
}

// ---- volumes

void Fields(auto& io, Is<ValueRange> auto& m) {
  using P = v1::ValueRange;
  io.Finite("min", m.min, &P::min, &P::set_min);
  io.Finite("max", m.max, &P::max, &P::set_max);
  io.Check([&](Checker& check) { check.That(m.min <= m.max, "", "min is above max"); });
}

void Fields(auto& io, Is<Orientation> auto& m) {
  using P = v1::Orientation;
  io.OneOf("world", m.world, &P::world, &P::set_world, World::kVoxels, World::kPatient);
  io.Message("origin", m.origin, &P::origin, &P::mutable_origin);
  io.Message("x_axis", m.axes[0], &P::x_axis, &P::mutable_x_axis);
  io.Message("y_axis", m.axes[1], &P::y_axis, &P::mutable_y_axis);
  io.Message("z_axis", m.axes[2], &P::z_axis, &P::mutable_z_axis);
  io.Check([&](Checker& check) {
    check.That(AreRightHanded(m.axes[0], m.axes[1], m.axes[2]), "x_axis", "not of three right-handed unit vectors at right angles");
  });
}

// The unit is left out if the file states none.
inline void Write(const Orientation& in, v1::Orientation& out) {
  WriteFields(in, out);
  if (in.unit) out.set_unit(v1::LengthUnit(*in.unit));
}
inline void Read(const v1::Orientation& in, Orientation& out, Checker& check) {
  ReadFields(in, out, check);
  if (in.unit() == v1::LENGTH_UNIT_UNSPECIFIED) return;
  out.unit = check.OneOf("unit", in.unit(), LengthUnit::kVoxel, LengthUnit::kMetre);
  check.That(*out.unit > LengthUnit::kFile, "unit", "none that a file states");
}

void Fields(auto& io, Is<VolumeDescription> auto& m) {
  using P = v1::VolumeDescription;
  io.Message("size", m.geometry.size, &P::size, &P::mutable_size);
  io.Message("spacing", m.geometry.spacing, &P::spacing, &P::mutable_spacing);
  io.Message("orientation", m.geometry.orientation, &P::orientation, &P::mutable_orientation);
  io.OneOf("type", m.type, &P::type, &P::set_type, ScalarType::kUint8, ScalarType::kFloat32);
  io.Finite("scale", m.mapping.scale, &P::scale, &P::set_scale);
  io.Finite("offset", m.mapping.offset, &P::offset, &P::set_offset);
  io.Check([&](Checker& check) {
    CheckPositive("spacing", m.geometry.spacing, check);
    const auto scope = check.In("size");
    check.Range("x", std::uint32_t(m.geometry.size.x), 1, kMaxVolumeSide);
    check.Range("y", std::uint32_t(m.geometry.size.y), 1, kMaxVolumeSide);
    check.Range("z", std::uint32_t(m.geometry.size.z), 1, kMaxVolumeSide);
  });
}

inline void Write(const LayerTypes& in, v1::LayerTypes& out) {
  if (in.labels) out.set_label_bytes(std::uint32_t(BytesPerSample(*in.labels)));
  out.set_overlay(in.overlay.has_value());
  out.set_cells(in.cells);
}
inline void Read(const v1::LayerTypes& in, LayerTypes& out, Checker& check) {
  const std::uint32_t label_bytes = check.Range("label_bytes", in.label_bytes(), 0, 2);
  if (label_bytes > 0) out.labels = label_bytes == 1 ? ScalarType::kUint8 : ScalarType::kUint16;
  if (in.overlay()) out.overlay = ScalarType::kFloat32;
  out.cells = in.cells();
}

// ---- Status, GroupKey

inline void Write(const Status& in, v1::Status& out) {
  out.set_code(static_cast<v1::StatusCode>(static_cast<int>(in.code())));
  out.set_message(WireText(Redacted(in.message()), kMaxTextBytes));
}
inline void Read(const v1::Status& in, Status& out, Checker& check) {
  const StatusCode code = check.OneOf("code", in.code(), StatusCode::kInvalidArgument, StatusCode::kInternal);
  out = {code, check.Text("message", in.message(), 0, kMaxTextBytes)};
}

void Fields(auto& io, Is<GroupKey> auto& m) {
  using P = v1::GroupKey;
  io.Any(m.frame, &P::frame, &P::set_frame);
  io.Any(m.attempt, &P::attempt, &P::set_attempt);
  io.Range("group", m.group, &P::group, &P::set_group, 0, kMaxGroups - 1);
}

// ---- images

void Fields(auto& io, Is<RunImageHeader> auto& m) {
  using P = v1::RunImageHeader;
  io.OneOf("format", m.format, &P::format, &P::set_format, PixelFormat::kRgba, PixelFormat::kSum);
  io.OneOf("color", m.color, &P::color, &P::set_color, ColorCoding::kFloat32, ColorCoding::kStraight8);
  io.Message("bounds", m.bounds, &P::bounds, &P::mutable_bounds);
  // At most kMaxFramePixels pixels and 2^32 runs: the payload's length cannot overflow.
  const auto pixels = static_cast<std::uint64_t>(m.bounds.pixel_count());
  io.Range("pixel_count", m.pixel_count, &P::pixel_count, &P::set_pixel_count, 0, pixels);
  const bool may_have_no_runs = m.pixel_count == 0 || m.pixel_count == pixels;
  io.Range("run_count", m.run_count, &P::run_count, &P::set_run_count, may_have_no_runs ? 0 : 1, m.pixel_count);
  io.Check([&](Checker& check) {
    check.That(MayCode(m.format, m.color), "color", "that of another format");
    if (const std::uint64_t bytes = PayloadBytes(m); bytes > kMaxRunsBytes) {
      check.Fail("pixel_count", "a payload of " + std::to_string(bytes) + " bytes, at most " + std::to_string(kMaxRunsBytes));
    }
  });
}

void Fields(auto& io, Is<EncodedRuns> auto& m) {
  using P = v1::EncodedRuns;
  io.Message("image", m.image, &P::image, &P::mutable_image);
  io.OneOf("codec", m.codec, &P::codec, &P::set_codec, Codec::kRaw, Codec::kZstd);
  const std::uint64_t raw_bytes = PayloadBytes(m.image);
  io.Range("encoded_bytes", m.encoded_bytes, &P::encoded_bytes, &P::set_encoded_bytes, m.codec == Codec::kRaw ? raw_bytes : 1, raw_bytes);
  io.Any(m.digest, &P::digest, &P::set_digest);
  io.Check([&](Checker& check) {
    const bool codes = m.image.format == PixelFormat::kRgba && m.image.color == ColorCoding::kStraight8;
    check.That(m.image.color == ColorCoding::kFloat32 || codes, "image.color", "of images between workers");
    check.That(!IsDense(m.image), "image.run_count", "0, of a picture with pixels");
  });
}

void Fields(auto& io, Is<PictureShare> auto& m) {
  using P = v1::PictureShare;
  io.Message("runs", m.runs, &P::runs, &P::mutable_runs);
  io.Any(m.direct, &P::direct, &P::set_direct);
}

inline void Write(const OcclusionMask& in, v1::OcclusionMask& out) {
  out.set_tiles_x(static_cast<std::uint32_t>(in.tiles_x));
  out.set_tiles_y(static_cast<std::uint32_t>(in.tiles_y));
  std::string& bits = *out.mutable_hidden();
  bits.resize((in.steps.size() + 7) / 8);
  for (std::size_t i = 0; i < in.steps.size(); ++i) {
    if (in.steps[i] == kOcclusionSteps) bits[i / 8] = static_cast<char>(bits[i / 8] | 1 << i % 8);
  }
}
inline void Read(const v1::OcclusionMask& in, OcclusionMask& out, Checker& check) {
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

// ---- reports

void Fields(auto& io, Is<Span> auto& m) {
  using P = v1::Span;
  io.OneOf("stage", m.stage, &P::stage, &P::set_stage, Stage::kFetch, Stage::kSample);
  io.Any(m.begin_ns, &P::begin_ns, &P::set_begin_ns);
  io.Any(m.end_ns, &P::end_ns, &P::set_end_ns);
}

void Fields(auto& io, Is<RankReport> auto& m) {
  using P = v1::RankReport;
  io.Any(m.worker, &P::worker, &P::set_worker);
  io.Any(m.group, &P::group, &P::set_group);
  io.Any(m.rank, &P::rank, &P::set_rank);
  io.Any(m.box, &P::box, &P::set_box);
  io.Row("stage_ns", m.stage_ns, &P::stage_ns, &P::mutable_stage_ns);
  io.Messages("spans", m.spans, &P::spans, &P::mutable_spans, kMaxSpans);
  io.Any(m.occupied_voxels, &P::occupied_voxels, &P::set_occupied_voxels);
  io.Any(m.drawn_voxels, &P::drawn_voxels, &P::set_drawn_voxels);
  io.Any(m.voxel_bytes, &P::voxel_bytes, &P::set_voxel_bytes);
  io.Any(m.image_bytes, &P::image_bytes, &P::set_image_bytes);
  io.Message("image_bounds", m.image_bounds, &P::image_bounds, &P::mutable_image_bounds);
  io.Any(m.image_pixels, &P::image_pixels, &P::set_image_pixels);
  io.Any(m.stored_bytes, &P::stored_bytes, &P::set_stored_bytes);
}

}  // namespace slabstream
