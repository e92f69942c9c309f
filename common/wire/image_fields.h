// Messages of the images plane.
#pragma once

#include <algorithm>
#include <string>

#include "common/wire/image_messages.h"
#include "common/wire/value_fields.h"
#include "slabstream/v1/images.pb.h"

namespace slabstream {

void Fields(auto& io, Is<BlockName> auto& m) {
  using P = v1::SharedBlock;
  io.Range("offset", m.offset, &P::offset, &P::set_offset, 0, kArenaBytes);
  io.Range("generation", m.generation, &P::generation, &P::set_generation, 1, kMaxUint64);
  io.Range("slot", m.slot, &P::slot, &P::set_slot, 0, kArenaSlots - 1);
  io.Check([&](Checker& check) {
    check.That(m.offset % kBlockAlignment == 0, "offset", std::to_string(m.offset) + " is no multiple of a page");
  });
}

void Fields(auto& io, Is<SharedImage> auto& m) {
  using P = v1::SharedImage;
  io.Range("arena", m.arena.id, &P::arena, &P::set_arena, 1, kMaxUint64);
  io.Any(m.arena.pid, &P::pid, &P::set_pid);
  io.Any(m.arena.file_descriptor, &P::file_descriptor, &P::set_file_descriptor);
  io.Message("bounds", m.bounds, &P::bounds, &P::mutable_bounds);
  io.Check([&](Checker& check) { check.That(!m.bounds.empty(), "bounds", "no pixels"); });
  io.Range("stride", m.stride, &P::stride, &P::set_stride, std::uint64_t(std::max(m.bounds.width(), 1)), kMaxFrameSide);
  io.Range("first_pixel", m.first_pixel, &P::first_pixel, &P::set_first_pixel, 0, kMaxFramePixels);
  io.Messages("planes", m.planes, &P::planes, &P::mutable_planes, 3);
}

void Fields(auto& io, Is<PackedRuns> auto& m) {
  using P = v1::PackedRuns;
  io.OneOf("codec", m.codec, &P::codec, &P::set_codec, Codec::kRaw, Codec::kZstd);
  io.Range("bytes", m.bytes, &P::bytes, &P::set_bytes, 1, kMaxRunsBytes - 1);
  io.Any(m.digest, &P::digest, &P::set_digest);
  io.Check([&](Checker& check) { check.That(m.codec != Codec::kRaw, "codec", "raw, of packed runs"); });
}

inline void CheckPayload(const PartialImage& m, Checker& check) {
  check.That(m.image.format != PixelFormat::kRgbaDepth, "image.format", "that of a finished picture, which is not combined any more");
  check.That(m.image.color != ColorCoding::kStraight8 || HasVoxel(m.image.format), "image.color", "8 bits, of colours that blend");
  if (m.shared) {
    check.That(m.image.bounds.empty() && m.image.pixel_count == 0, "image", "runs beside a shared image");
    const std::size_t planes = HasDepth(m.image.format) ? 3 : 1;
    check.That(m.shared->planes.size() == planes, "shared.planes",
               std::to_string(m.shared->planes.size()) + " of " + std::to_string(planes));
    check.That(!m.packed, "packed", "beside a shared image");
  }
  if (m.packed) {
    const std::uint64_t raw = PayloadBytes(m.image);
    check.That(m.packed->bytes < raw, "packed.bytes",
               std::to_string(m.packed->bytes) + " are not less than the " + std::to_string(raw) + " of the runs");
  }
}

v1::PartialImage ProtoOf(const PartialImage&);
void Fields(auto& io, Is<PartialImage> auto& m) {
  using P = v1::PartialImage;
  io.Any(m.epoch, &P::epoch, &P::set_epoch);
  io.Any(m.from_worker, &P::from_worker, &P::set_from_worker);
  io.Message("key", m.key, &P::key, &P::mutable_key);
  io.Range("step", m.step, &P::step, &P::set_step, 0, kMaxSteps);  // one past the last step is the whole group image
  io.Range("interval_begin", m.interval.begin, &P::interval_begin, &P::set_interval_begin, 0, kMaxRanks - 1);
  io.Range("interval_end", m.interval.end, &P::interval_end, &P::set_interval_end, m.interval.begin + 1, kMaxRanks);
  io.Message("pixels", m.pixels, &P::pixels, &P::mutable_pixels);
  io.Message("image", m.image, &P::image, &P::mutable_image);
  io.Messages("reports", m.reports, &P::reports, &P::mutable_reports, kMaxReports);
  io.Optional("shared", m.shared, &P::has_shared, &P::shared, &P::mutable_shared);
  io.Optional("packed", m.packed, &P::has_packed, &P::packed, &P::mutable_packed);
  io.Any(m.acknowledge, &P::acknowledge, &P::set_acknowledge);
  io.Check([&](Checker& check) { CheckPayload(m, check); });
}

v1::ImageReceived ProtoOf(const ImageReceived&);
void Fields(auto& io, Is<ImageReceived> auto& m) {
  using P = v1::ImageReceived;
  io.Any(m.epoch, &P::epoch, &P::set_epoch);
  io.Any(m.from_worker, &P::from_worker, &P::set_from_worker);
  io.Range("number", m.number, &P::number, &P::set_number, 1, kMaxUint64);
}

v1::ImageRefused ProtoOf(const ImageRefused&);
void Fields(auto& io, Is<ImageRefused> auto& m) {
  using P = v1::ImageRefused;
  io.Any(m.epoch, &P::epoch, &P::set_epoch);
  io.Any(m.from_worker, &P::from_worker, &P::set_from_worker);
  io.Message("key", m.key, &P::key, &P::mutable_key);
  io.Range("step", m.step, &P::step, &P::set_step, 0, kMaxSteps);
  io.Message("pixels", m.pixels, &P::pixels, &P::mutable_pixels);
}

}  // namespace slabstream
