#include "data/sources/volume_source.h"

#include <future>

#include "common/base/check.h"

namespace slabstream {

void VolumeSource::Read(int level, const Box& box, std::span<std::byte> out, std::stop_token stop, ReadDone done) {
  Read(level, box, RoomFor(level, box, out), std::move(stop), std::move(done));
}

BoxRoom VolumeSource::RoomFor(int level, const Box& box, std::span<std::byte> out) const {
  const ScalarType type = info().levels.at(std::size_t(level)).description.type;
  CHECK_EQ(out.size(), std::size_t(box.voxel_count()) * BytesPerSample(type));
  return BoxRoom::Dense(box, out.data());
}

Status VolumeSource::ReadNow(int level, const Box& box, std::span<std::byte> out, std::stop_token stop) {
  return ReadNow(level, box, RoomFor(level, box, out), std::move(stop));
}

Status VolumeSource::ReadNow(int level, const Box& box, const BoxRoom& out, std::stop_token stop) {
  std::promise<Status> end;
  std::future<Status> read = end.get_future();
  Read(level, box, out, std::move(stop), [&end](Status status) { end.set_value(std::move(status)); });
  return read.get();
}

std::shared_ptr<VolumeSource> DescribedSource::At(int time, int channel) {
  std::shared_ptr<VolumeSource> at = source_->At(time, channel);
  if (at == nullptr) return nullptr;
  SourceInfo info = info_;
  info.time = time;
  info.channel = channel;
  info.growth = nullptr;  // who names a time does not wait for more
  return Around(std::move(at), std::move(info));
}

std::uint64_t VolumeSource::TakeStoredBytes() {
  const std::uint64_t now = counts().stored_bytes;
  std::uint64_t taken = taken_bytes_;
  while (taken < now && !taken_bytes_.compare_exchange_weak(taken, now)) {
  }
  return taken < now ? now - taken : 0;
}

}  // namespace slabstream
