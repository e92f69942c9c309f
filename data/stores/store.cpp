#include "data/stores/store.h"

#include <future>
#include <utility>

namespace slabstream {

Result<Bytes> ReadNow(Store& store, const std::string& key, std::uint64_t most) {
  std::promise<Result<Bytes>> answer;
  std::future<Result<Bytes>> read = answer.get_future();
  store.Read(key, {}, most, [&answer](Result<Bytes> bytes) { answer.set_value(std::move(bytes)); });
  return read.get();
}

}  // namespace slabstream
