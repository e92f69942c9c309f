// Expands bzip2 piece by piece. Whoever has the bytes lends them: a chunk as a whole, a file in pieces.
#pragma once

#include <bzlib.h>

#include <cstddef>
#include <new>
#include <span>

#include "data/codecs/growing_bytes.h"

namespace slabstream {

// One thread at a time.
class Bunzipper {
 public:
  // Throws std::bad_alloc.
  Bunzipper() { Init(); }
  ~Bunzipper() { BZ2_bzDecompressEnd(&stream_); }
  Bunzipper(const Bunzipper&) = delete;
  Bunzipper& operator=(const Bunzipper&) = delete;

  // Begins a further stream. Throws std::bad_alloc.
  void Begin() {
    BZ2_bzDecompressEnd(&stream_);
    Init();
  }

  // Goes on, and moves both to what is left of them. kEnded: the stream ends there, and its checksum is that of the bytes. Throws
  // std::bad_alloc.
  StreamState Advance(std::span<const std::byte>& in, std::span<std::byte>& out) {
    const auto given = CountFor<unsigned>(in), room = CountFor<unsigned>(out);
    stream_.next_in = const_cast<char*>(reinterpret_cast<const char*>(in.data()));  // which bzip2 does not change
    stream_.avail_in = given;
    stream_.next_out = reinterpret_cast<char*>(out.data());
    stream_.avail_out = room;
    const int code = BZ2_bzDecompress(&stream_);
    if (code == BZ_MEM_ERROR) throw std::bad_alloc();
    in = in.subspan(given - stream_.avail_in);
    out = out.subspan(room - stream_.avail_out);
    return code == BZ_STREAM_END ? StreamState::kEnded : code == BZ_OK ? StreamState::kGoesOn : StreamState::kDamaged;
  }

 private:
  void Init() {
    stream_ = {};
    if (BZ2_bzDecompressInit(&stream_, 0, 0) != BZ_OK) throw std::bad_alloc();
  }

  bz_stream stream_;
};

}  // namespace slabstream
