#include "data/positional/slice_stream.h"

#include <algorithm>
#include <array>
#include <new>
#include <utility>

#include "common/base/check.h"
#include "common/base/printable.h"
#include "common/volume/memory_budget.h"
#include "data/positional/turned_box.h"

namespace slabstream {

SliceStream::SliceStream(std::string path, LocatedVolume volume, ReadProgress* progress, SourceContext context)
    : path_(std::move(path)), volume_(std::move(volume)), context_(std::move(context)), progress_(progress) {}

VolumeSource::Counts SliceStream::counts() const {
  const std::lock_guard lock(mutex_);
  return counts_;
}

void SliceStream::Read(int level, const Box& box, const BoxRoom& out, std::stop_token stop, ReadDone done) {
  const VolumeDescription& description = info().levels.front().description;
  CHECK(level == 0 && !box.empty() && description.geometry.bounds().Contains(box)) << "a box outside the volume";
  context_->PostDecode([this, box, out, stop = std::move(stop), done = std::move(done)] { done(ReadBox(box, out, stop)); });
}

Status SliceStream::ReadBox(const Box& box, const BoxRoom& out, const std::stop_token& stop) {
  const std::lock_guard lock(mutex_);
  Status status;
  try {
    status = Printable(ReadSlices(box, out, stop));
  } catch (const std::bad_alloc&) {
    status = Status::ResourceExhausted(path_ + ": its slices do not fit the memory");
  }
  if (!status.ok()) stream_.reset();  // the next read begins anew
  return status;
}

Status SliceStream::Rewind() {
  if (progress_ != nullptr && counted_ == 0) progress_->Begin(volume_.header.sample_bytes());
  stream_ = std::make_unique<PayloadStream>(volume_.payload, volume_.header.sample_bytes());
  next_ = 0;
  return stream_->Open();
}

Status SliceStream::ReadSlices(const Box& box, const BoxRoom& out, const std::stop_token& stop) {
  constexpr std::size_t kPiece = std::size_t{1} << 20;  // stays in a processor's cache between the two steps
  const RawHeader& header = volume_.header;
  const std::size_t slice_bytes = std::size_t(header.sample_bytes() / header.size.z), sample_bytes = BytesPerSample(header.type);
  const std::array<std::int64_t, 3> steps = {header.components, std::int64_t{header.components} * header.size.x,
                                             std::int64_t{header.components} * header.size.x * header.size.y};
  const TurnedBox to{.turn = volume_.turn, .size = info().levels.front().description.geometry.size, .box = box, .out = out};
  const Box wanted = to.Stored();
  if (stream_ == nullptr || next_ > wanted.begin.z) {
    if (Status status = Rewind(); !status.ok()) return status;
  }
  const auto at_once = std::int32_t(std::clamp<std::size_t>(kPiece / slice_bytes, 1, std::size_t(header.size.z)));
  if (stored_.empty()) {
    if (Status status = CheckFitsMemory(at_once * std::int64_t(slice_bytes), path_); !status.ok()) return status;
    stored_.resize(std::size_t(at_once) * slice_bytes);
  }
  while (next_ < wanted.end.z) {
    if (stop.stop_requested()) return Status::Cancelled(path_ + ": reading was cancelled");
    const std::int32_t limit = next_ < wanted.begin.z ? wanted.begin.z : wanted.end.z;  // what lies in front of the box is passed over
    const std::int32_t count = std::min(at_once, limit - next_);
    const std::span bytes = std::span(stored_).first(std::size_t(count) * slice_bytes);
    if (Status status = stream_->Read(bytes); !status.ok()) return status;
    counts_.stored_bytes += bytes.size();
    if (next_ >= wanted.begin.z) {
      if (volume_.payload.big_endian) SwapByteOrder(header.type, bytes);
      const Box part = {{wanted.begin.x, wanted.begin.y, next_}, {wanted.end.x, wanted.end.y, next_ + count}};
      const auto first = std::size_t(wanted.begin.x * steps[0] + wanted.begin.y * steps[1] + volume_.component);
      to.Fill(part, header.type, stored_.data() + first * sample_bytes, steps);
    }
    next_ += count;
    if (progress_ != nullptr && next_ > counted_)
      progress_->Add(std::int64_t(next_ - std::exchange(counted_, next_)) * std::int64_t(slice_bytes));
  }
  return next_ == header.size.z ? stream_->Finish() : Status::Ok();
}

}  // namespace slabstream
