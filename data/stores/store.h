// Store: bytes by key. A store is a folder, a zip archive, or whatever else keeps objects under names: "0/c/1/2/3". Readers of chunked
// volumes (data/sources) ask it for objects and parts of them; none of them knows where they lie.
//
// Any thread may call a store. It answers on threads of its own, so a slow one holds up nobody who asks.
#pragma once

#include <cstdint>
#include <functional>
#include <future>
#include <limits>
#include <memory>
#include <stop_token>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "common/memory/bytes.h"

namespace slabstream {

// Part of an object: `bytes` from `begin` on, or its last `bytes`.
struct ByteRange {
  static constexpr std::uint64_t kAll = std::numeric_limits<std::uint64_t>::max();

  std::uint64_t begin = 0;
  std::uint64_t bytes = kAll;
  bool from_end = false;  // `begin` is 0
};

// Whether somebody still waits for what is read. Asked again and again, on any thread; null: somebody does.
using StillWanted = std::function<bool()>;

class Store {
 public:
  Store() = default;
  virtual ~Store() = default;
  Store(const Store&) = delete;
  Store& operator=(const Store&) = delete;

  // The bytes, or why there are none. An object that ends before the range does gives fewer; callers check.
  using Done = std::function<void(Result<Bytes>)>;
  // Calls `done` exactly once, on any thread, perhaps before this returns. NotFound: there is no such object. InvalidArgument: the key is
  // no name of an object ("", "..", a part that is empty). Unavailable, DataLoss: it cannot be read; names store and key.
  // ResourceExhausted: more than `most` bytes; nothing is read then. Cancelled: it was not `wanted` any more before a server had answered.
  virtual void Read(const std::string& key, const ByteRange& range, std::uint64_t most, Done done, StillWanted wanted = {}) = 0;

  // Names of what lies in a folder of the store ("" is the store itself), sorted; those of folders end in "/". Waits. InvalidArgument:
  // the store cannot list.
  virtual Result<std::vector<std::string>> List(const std::string& folder) = 0;

  // Begins to find out whether an object that was read is another one now. Stores that cannot tell say no. Errors of Read.
  virtual std::future<Result<bool>> HasChanged(const std::string& key);

  // For messages: "/data/scan.ome.zarr". With a key behind it it names an object.
  virtual const std::string& name() const = 0;
};

inline constexpr std::uint64_t kMostMetadataBytes = std::uint64_t{16} << 20;

// Begins to read a whole object. Errors of Store::Read.
std::future<Result<Bytes>> BeginRead(Store& store, const std::string& key, std::uint64_t most = kMostMetadataBytes);
// Waits for it.
Result<Bytes> ReadNow(Store& store, const std::string& key, std::uint64_t most = kMostMetadataBytes);

// A folder of the file system. Does not check that it exists.
enum class Links : std::uint8_t { kStayInside, kMayLeadOut };  // those that lead out of the folder are not followed, or are
std::shared_ptr<Store> FolderStore(const std::string& path, Links links = Links::kStayInside);
// The objects in a zip archive that are stored or deflated. Reads its directory. NotFound, InvalidArgument, DataLoss, ResourceExhausted.
Result<std::shared_ptr<Store>> ZipStore(const std::string& path);
class HttpTransfers;
class ObjectCache;
struct WebOptions {
  std::string query = {};                 // encoded, that goes with each address; empty: none
  std::vector<std::string> headers = {};  // that go with each request: "NAME:VALUE" or "NAME:@FILE" with the value in a file
};
// The objects below an address (IsUrl, common/text/url.h), "http://HOST/PATH", "https://HOST/PATH" or that of a bucket (FindS3Place), read
// by `transfers`, which must outlive it, and kept in `cache`, if any. Asks for nothing yet. It does not list. Query and headers go to this
// server alone. What a server says of an object with HTTP 403, or with a page of HTML, counts as "there is none" (NotFound) if the server
// then sends another object that was read before; else it is Unavailable. InvalidArgument: another address, or one with a name, a password,
// a query or a fragment; as FindS3Place; a file of a header that cannot be read or holds no text of one line.
//
// As long as a StoresStop lives, what its thread opens reads until it is told to stop: then all reads end as if nobody wanted them.
class StoresStop {
 public:
  explicit StoresStop(std::stop_token stop);
  ~StoresStop();
  StoresStop(const StoresStop&) = delete;
  StoresStop& operator=(const StoresStop&) = delete;
};
Result<std::shared_ptr<Store>> HttpStore(const std::string& address, HttpTransfers& transfers, const ObjectCache* cache = nullptr,
                                         const WebOptions& options = {});
// One file: its only object has the key "file". Does not check that it exists.
std::shared_ptr<Store> FileStore(const std::string& path);

// An address (IsUrl), folder, zip archive (.zip, .ozx) or file. NotFound: there is nothing. Errors of HttpStore and ZipStore.
Result<std::shared_ptr<Store>> OpenStore(const std::string& path, const WebOptions& options = {});

}  // namespace slabstream
