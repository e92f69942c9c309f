// How finished pictures travel: the header of their runs, and their shares.
#pragma once

#include <cstdint>

#include "common/image/run_header.h"

namespace slabstream {

// How a payload is packed. kZstd: bytes of each 32-bit word grouped by significance (all first bytes, then all second, ...), then zstd.
enum class Codec : std::uint8_t { kRaw = 1, kZstd = 2 };

struct EncodedRuns {
  RunImageHeader image;
  Codec codec = Codec::kRaw;
  std::uint64_t encoded_bytes = 0;  // length of the payload frame
  std::uint64_t digest = 0;         // XXH3-64 of the payload frame
  friend bool operator==(const EncodedRuns&, const EncodedRuns&) = default;
};

// A share of a picture, or the whole of it. All shares add up to the picture: where two of them have a pixel, each has a part of its
// colour.
struct PictureShare {
  EncodedRuns runs;
  bool direct = false;  // the payload went straight to the client (SentPicture)
  friend bool operator==(const PictureShare&, const PictureShare&) = default;
};

}  // namespace slabstream
