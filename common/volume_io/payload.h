// The samples of a volume file, behind its header: where they lie and how they are packed. Reading detects every truncation and holds one
// copy of the samples.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>

#include "common/base/status.h"

namespace slabstream {

struct Payload {
  std::filesystem::path file;
  std::int64_t offset = 0;  // bytes of the file before the samples (or before the compressed stream)
  bool compressed = false;  // gzip or zlib, whichever its first bytes say
  std::int64_t skip = 0;    // bytes of the decompressed stream before the samples
  bool big_endian = false;
};

// Checks, before memory is taken, that the file is long enough for `bytes` of samples: a compressed one, at the largest ratio that deflate
// reaches. DataLoss: it is not. NotFound: no such file.
Status CheckHolds(const Payload& payload, std::int64_t bytes);

// Fills `out` with the bytes as they are in the file (byte order is not touched). A compressed stream is read to its end, so that its
// checksum is verified. DataLoss: truncated or damaged. NotFound: no such file.
Status ReadPayload(const Payload& payload, std::span<std::byte> out);

// The same, but ignores what follows: for headers inside a compressed stream.
Status ReadPayloadStart(const Payload& payload, std::span<std::byte> out);

}  // namespace slabstream
