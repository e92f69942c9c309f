#include "data/stores/store.h"

#include <filesystem>
#include <utility>

#include "common/text/url.h"
#include "data/stores/http_transfers.h"
#include "data/stores/object_cache.h"

namespace slabstream {

std::future<Result<bool>> Store::HasChanged(const std::string& /*key*/) {
  std::promise<Result<bool>> answer;
  answer.set_value(false);
  return answer.get_future();
}

std::future<Result<Bytes>> BeginRead(Store& store, const std::string& key, std::uint64_t most) {
  auto answer = std::make_shared<std::promise<Result<Bytes>>>();
  std::future<Result<Bytes>> read = answer->get_future();
  store.Read(key, {}, most, [answer](Result<Bytes> bytes) { answer->set_value(std::move(bytes)); });
  return read;
}

Result<Bytes> ReadNow(Store& store, const std::string& key, std::uint64_t most) { return BeginRead(store, key, most).get(); }

Result<std::shared_ptr<Store>> OpenStore(const std::string& path, const WebOptions& options) {
  if (IsUrl(path)) return HttpStore(path, HttpTransfers::OfProcess(), ProcessObjectCache(), options);
  std::error_code error;
  const std::filesystem::file_status about = std::filesystem::status(path, error);
  if (!std::filesystem::exists(about)) return Status::NotFound(path + ": does not exist");
  if (std::filesystem::is_directory(about)) return FolderStore(path);
  if (path.ends_with(".zip") || path.ends_with(".ozx")) return ZipStore(path);
  return FileStore(path);
}

}  // namespace slabstream
