#include <algorithm>
#include <limits>
#include <string>

#include "common/wire/codecs.h"
#include "common/wire/limits.h"

namespace slabstream {

v1::SharedImage ToProto(const SharedImage& in) {
  v1::SharedImage out;
  out.set_arena(in.arena.id);
  out.set_pid(in.arena.pid);
  out.set_file_descriptor(in.arena.file_descriptor);
  *out.mutable_bounds() = ToProto(in.bounds);
  out.set_stride(in.stride);
  out.set_first_pixel(in.first_pixel);
  WriteAll(in.planes, out.mutable_planes());
  return out;
}

SharedImage FromProto(const v1::SharedImage& in, Checker& check) {
  SharedImage out;
  out.arena.id = check.Range("arena", in.arena(), 1, std::numeric_limits<std::uint64_t>::max());
  out.arena.pid = in.pid();
  out.arena.file_descriptor = in.file_descriptor();
  out.bounds = Read("bounds", in.bounds(), check);
  check.That(!out.bounds.empty(), "bounds", "no pixels");
  out.stride = check.Range("stride", in.stride(), std::uint32_t(std::max(out.bounds.width(), 1)), kMaxFrameSide);
  out.first_pixel = check.Range("first_pixel", in.first_pixel(), 0, kMaxFramePixels);
  out.planes = ReadAll("planes", in.planes(), 3, check);
  return out;
}

v1::SharedBlock ToProto(const BlockName& in) {
  v1::SharedBlock out;
  out.set_offset(in.offset);
  out.set_generation(in.generation);
  out.set_slot(in.slot);
  return out;
}

BlockName FromProto(const v1::SharedBlock& in, Checker& check) {
  check.That(in.offset() % kBlockAlignment == 0, "offset", std::to_string(in.offset()) + " is no multiple of a page");
  return {.offset = check.Range("offset", in.offset(), 0, kArenaBytes),
          .generation = check.Range("generation", in.generation(), 1, std::numeric_limits<std::uint64_t>::max()),
          .slot = check.Range("slot", in.slot(), 0, kArenaSlots - 1)};
}

v1::PackedRuns ToProto(const PackedRuns& in) {
  v1::PackedRuns out;
  out.set_codec(WireEnum<v1::Codec>(in.codec, Codec::kRaw));
  out.set_bytes(in.bytes);
  out.set_digest(in.digest);
  return out;
}

PackedRuns FromProto(const v1::PackedRuns& in, Checker& check) {
  PackedRuns out;
  out.codec = check.OneOf("codec", in.codec(), Codec::kRaw, Codec::kZstd);
  check.That(out.codec != Codec::kRaw, "codec", "raw, of packed runs");
  out.bytes = check.Range("bytes", in.bytes(), 1, kMaxRunsBytes - 1);
  out.digest = in.digest();
  return out;
}

v1::PartialImage ToProto(const PartialImage& in) {
  v1::PartialImage out;
  out.set_epoch(in.epoch);
  out.set_from_worker(in.from_worker);
  *out.mutable_key() = ToProto(in.key);
  out.set_step(in.step);
  out.set_interval_begin(in.interval.begin);
  out.set_interval_end(in.interval.end);
  *out.mutable_pixels() = ToProto(in.pixels);
  *out.mutable_image() = ToProto(in.image);
  WriteAll(in.reports, out.mutable_reports());
  if (in.shared) *out.mutable_shared() = ToProto(*in.shared);
  if (in.packed) *out.mutable_packed() = ToProto(*in.packed);
  out.set_acknowledge(in.acknowledge);
  return out;
}

PartialImage FromProto(const v1::PartialImage& in, Checker& check) {
  PartialImage out;
  out.epoch = in.epoch();
  out.from_worker = in.from_worker();
  out.key = Read("key", in.key(), check);
  out.step = check.Range("step", in.step(), 0, kMaxSteps);  // one past the last step is the whole group image
  out.interval.begin = check.Range("interval_begin", in.interval_begin(), 0, kMaxRanks - 1);
  out.interval.end = check.Range("interval_end", in.interval_end(), out.interval.begin + 1, kMaxRanks);
  out.pixels = Read("pixels", in.pixels(), check);
  out.image = Read("image", in.image(), check);
  check.That(out.image.format != PixelFormat::kRgbaDepth, "image.format", "that of a finished picture, which is not combined any more");
  out.reports = ReadAll("reports", in.reports(), kMaxReports, check);
  if (in.has_shared()) {
    out.shared = Read("shared", in.shared(), check);
    check.That(out.image.bounds.empty() && out.image.pixel_count == 0, "image", "runs beside a shared image");
    const std::size_t planes = HasDepth(out.image.format) ? 3 : 1;
    check.That(out.shared->planes.size() == planes, "shared.planes",
               std::to_string(out.shared->planes.size()) + " of " + std::to_string(planes));
    check.That(!in.has_packed(), "packed", "beside a shared image");
  }
  if (in.has_packed()) {
    out.packed = Read("packed", in.packed(), check);
    const std::uint64_t raw = PayloadBytes(out.image);
    check.That(out.packed->bytes < raw, "packed.bytes",
               std::to_string(out.packed->bytes) + " are not less than the " + std::to_string(raw) + " of the runs");
  }
  out.acknowledge = in.acknowledge();
  return out;
}

v1::ImageRefused ToProto(const ImageRefused& in) {
  v1::ImageRefused out;
  out.set_epoch(in.epoch);
  out.set_from_worker(in.from_worker);
  *out.mutable_key() = ToProto(in.key);
  out.set_step(in.step);
  *out.mutable_pixels() = ToProto(in.pixels);
  return out;
}

v1::ImageReceived ToProto(const ImageReceived& in) {
  v1::ImageReceived out;
  out.set_epoch(in.epoch);
  out.set_from_worker(in.from_worker);
  out.set_number(in.number);
  return out;
}

ImageReceived FromProto(const v1::ImageReceived& in, Checker& check) {
  return {.epoch = in.epoch(),
          .from_worker = in.from_worker(),
          .number = check.Range("number", in.number(), 1, std::numeric_limits<std::uint64_t>::max())};
}

ImageRefused FromProto(const v1::ImageRefused& in, Checker& check) {
  return {.epoch = in.epoch(),
          .from_worker = in.from_worker(),
          .key = Read("key", in.key(), check),
          .step = check.Range("step", in.step(), 0, kMaxSteps),
          .pixels = Read("pixels", in.pixels(), check)};
}

}  // namespace slabstream
