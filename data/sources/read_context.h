// ReadContext: what all sources of a process share: threads that decode, memory for chunks under way, and a cache of decoded chunks.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "data/sources/chunk_cache.h"

namespace slabstream {

// Who must answer for what lies at a source: "example.org:8080", or a bucket; "": it lies in files.
std::string ServerOf(std::string_view source);

class ReadContext {
 public:
  // Tasks at a time beside two for each thread that decodes: enough for a web server that is asked for many chunks at a time
  // (HttpTransfers::kMostOfAHost), and some that wait there, so that neighbours in a shard become one request. More would gain nothing:
  // what waits here is dropped when nobody wants it any more, what is asked for comes.
  static constexpr std::size_t kMostAsked = 48;

  struct Limits {
    std::size_t decode_threads = 0;  // 0: as many as there are cores
    // Bytes of chunks of files that are read or decoded, and likewise of those of servers; of files one chunk may always be, and of each
    // server, if they do not take twice as much.
    std::uint64_t under_way_bytes = std::uint64_t{128} << 20;
    std::uint64_t cache_bytes = std::uint64_t{64} << 20;  // bytes of decoded chunks that may be needed again
    std::uint64_t small_bytes = 0;  // bytes of a level behind an address whose chunks all stay, since each is a request
  };
  explicit ReadContext(const Limits& limits);
  ~ReadContext();
  ReadContext(const ReadContext&) = delete;
  ReadContext& operator=(const ReadContext&) = delete;

  // Runs `task` on a thread that decodes. Any thread.
  void PostDecode(std::function<void()> task);
  // Runs `task` at once or when there is room for it and for so many bytes, in the order of its server. `server`: who may not answer; "":
  // it reads files. So nobody waits for another server, and files wait for none. `task` must see to it that Release is called once for the
  // bytes. It throws nothing, and begins work rather than doing it, since it may run on the thread of another one that ends.
  void Admit(std::uint64_t bytes, std::function<void()> task, const std::string& server = {});
  void Release(std::uint64_t bytes, const std::string& server = {});

  ChunkCache& cache();
  std::uint64_t small_bytes() const;

 private:
  struct State;
  const std::shared_ptr<State> state_;
};

using SourceContext = std::shared_ptr<ReadContext>;

}  // namespace slabstream
