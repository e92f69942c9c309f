#include "common/wire/codecs.h"
#include "common/wire/limits.h"

namespace slabstream {

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
  return out;
}

}  // namespace slabstream
