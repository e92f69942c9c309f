#include "data/sources/volume_source.h"

#include <future>
#include <utility>

namespace slabstream {

Status VolumeSource::ReadNow(int level, const Box& box, std::span<std::byte> out, std::stop_token stop) {
  std::promise<Status> end;
  std::future<Status> read = end.get_future();
  Read(level, box, out, std::move(stop), [&end](Status status) { end.set_value(std::move(status)); });
  return read.get();
}

}  // namespace slabstream
