// Inflates gzip, zlib and bare deflate piece by piece with ISA-L. Whoever has the bytes lends them: a chunk as a whole, a file in pieces.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "data/codecs/growing_bytes.h"

namespace slabstream {

// How the deflated bytes are framed. kGzip: RFC 1952. kZlib: RFC 1950, without a preset dictionary. kBare: not at all, so that only damage
// that deflate itself does not allow is found.
enum class DeflateFrame : std::uint8_t { kGzip, kZlib, kBare };

// One thread at a time.
class Inflater {
 public:
  // Throws std::bad_alloc.
  explicit Inflater(DeflateFrame frame);
  ~Inflater();

  DeflateFrame frame() const { return frame_; }

  // Begins a member, with its header.
  void Begin();

  // Goes on until the member ends or one of the two is used up, and moves both to what is left of them. kEnded: the checksum and the length
  // in the frame are those of the bytes. Then `in` begins behind the member; of kZlib and kBare only if all of it came in one call.
  // kDamaged: neither has moved, and what `out` holds is of no use. The last one.
  StreamState Advance(std::span<const std::byte>& in, std::span<std::byte>& out);

 private:
  struct State;
  StreamState AdvancePiece(std::span<const std::byte>& in, std::span<std::byte>& out);

  const DeflateFrame frame_;
  const std::unique_ptr<State> state_;
};

}  // namespace slabstream
