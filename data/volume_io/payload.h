// The samples of a volume file, behind its header: where they lie and how they are packed. Reading detects every truncation and holds one
// copy of the samples.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>
#include <span>
#include <vector>

#include "common/base/status.h"
#include "data/volume_io/decompressor.h"
#include "data/volume_io/read_progress.h"

namespace slabstream {

// Where samples begin in a file.
struct PayloadPlace {
  std::filesystem::path file;
  std::int64_t offset = 0;  // bytes of the file before the samples (or before the compressed stream)
  std::int64_t skip = 0;    // bytes of the decompressed stream before the samples
};

struct Payload {
  // As of PayloadPlace.
  std::filesystem::path file;
  std::int64_t offset = 0, skip = 0;
  Compression compression = Compression::kNone;
  bool big_endian = false;
  // Where the samples continue, packed alike, if they lie in several files. Each of the files, the first one too, has part_bytes of them.
  std::vector<PayloadPlace> more = {};
  std::int64_t part_bytes = 0;  // 0: there is one file
  std::int64_t passed = 0;      // bytes of the first file's part_bytes that Pass has left out

  bool compressed() const { return compression != Compression::kNone; }
  PayloadPlace place() const { return {file, offset, skip}; }
  // All files but `path`.
  std::vector<std::filesystem::path> FilesBeside(const std::filesystem::path& path) const;
  // Goes on by so many bytes of the file, or of the stream if it is compressed.
  void Skip(std::int64_t bytes) { (compressed() ? skip : offset) += bytes; }
  // Leaves out the first `bytes` of the samples. Call it once.
  void Pass(std::int64_t bytes);
};

// Checks, before memory is taken, that the files are long enough for `bytes` of samples: compressed ones, at the largest ratio that their
// compression reaches. DataLoss: one is not. NotFound: no such file.
Status CheckHolds(const Payload& payload, std::int64_t bytes);

// How far a compressed stream is read: to its end, so that its checksum is verified, or only as far as wanted, as for a header inside it.
enum class Extent { kStart, kWholeStream };

// The bytes of a payload's samples, as they are in the files, from the first to the last. Messages name the file. One thread at a time.
class PayloadStream {
 public:
  // `bytes`: of the samples, for messages.
  PayloadStream(const Payload& payload, std::int64_t bytes);
  ~PayloadStream();

  // First: goes to the samples. NotFound: no such file. DataLoss: it is truncated or damaged in front of them.
  Status Open();
  // Fills `out` with the next bytes. DataLoss: truncated or damaged. NotFound: no such file.
  Status Read(std::span<std::byte> out);
  // Behind the last sample: reads a compressed stream to its end. DataLoss: damaged, as its checksum tells.
  Status Finish();

 private:
  Status OpenPart(const PayloadPlace& place, std::int64_t bytes);
  Status ReadPart(std::span<std::byte> out);
  Status Truncated() const;
  Status Damaged() const;

  const Payload payload_;
  std::int64_t left_;          // bytes of the samples that are still to be read
  std::size_t next_part_ = 0;  // an index of payload_.more
  // The file that is read.
  std::filesystem::path name_;
  std::int64_t part_bytes_ = 0, found_ = 0;
  std::ifstream file_;
  std::unique_ptr<Decompressor> decompressor_;  // none: not compressed
};

// Fills `out` with the bytes as they are in the file (byte order is not touched). DataLoss: truncated or damaged. NotFound: no such file.
// `progress`, if any, counts what is read.
Status ReadPayload(const Payload& payload, std::span<std::byte> out, Extent extent = Extent::kWholeStream,
                   ReadProgress* progress = nullptr);

}  // namespace slabstream
