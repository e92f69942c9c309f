// The samples of a volume file, behind its header: where they lie and how they are packed. Reading detects every truncation and holds one
// copy of the samples.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>
#include <span>

#include "common/base/status.h"
#include "data/volume_io/read_progress.h"

namespace slabstream {

class InflateReader;

inline constexpr std::int64_t kMaxDeflateRatio = 1032;  // zlib's technical notes: 1032:1 at most

struct Payload {
  std::filesystem::path file;
  std::int64_t offset = 0;  // bytes of the file before the samples (or before the compressed stream)
  bool compressed = false;  // gzip or zlib, whichever its first bytes say
  bool wrapped = true;      // a compressed stream has such a header; else it is deflated bytes alone
  std::int64_t skip = 0;    // bytes of the decompressed stream before the samples
  bool big_endian = false;
};

bool BeginsLikeGzip(const std::filesystem::path& file);

// Checks, before memory is taken, that the file is long enough for `bytes` of samples: a compressed one, at the largest ratio that deflate
// reaches. DataLoss: it is not. NotFound: no such file.
Status CheckHolds(const Payload& payload, std::int64_t bytes);

// How far a compressed stream is read: to its end, so that its checksum is verified, or only as far as wanted, as for a header inside it.
enum class Extent { kStart, kWholeStream };

// The bytes of a payload's samples, as they are in the file, from the first to the last. Messages name the file. One thread at a time.
class PayloadStream {
 public:
  // `bytes`: of the samples, for messages.
  PayloadStream(const Payload& payload, std::int64_t bytes);
  ~PayloadStream();

  // First: goes to the samples. NotFound: no such file. DataLoss: it is truncated or damaged in front of them.
  Status Open();
  // Fills `out` with the next bytes. DataLoss: truncated or damaged.
  Status Read(std::span<std::byte> out);
  // Behind the last sample: reads a compressed stream to its end. DataLoss: damaged, as its checksum tells.
  Status Finish();

 private:
  Status Truncated() const;

  const Payload payload_;
  const std::int64_t expected_;
  std::int64_t found_ = 0;
  std::ifstream file_;
  std::unique_ptr<InflateReader> inflate_;  // none: not compressed
};

// Fills `out` with the bytes as they are in the file (byte order is not touched). DataLoss: truncated or damaged. NotFound: no such file.
// `progress`, if any, counts what is read.
Status ReadPayload(const Payload& payload, std::span<std::byte> out, Extent extent = Extent::kWholeStream,
                   ReadProgress* progress = nullptr);

}  // namespace slabstream
