#include "data/codecs/inflater.h"

#include <isa-l/igzip_lib.h>

#include <algorithm>

namespace slabstream {

// 87 kB, most of them tables and a window, which ISA-L writes before it reads them.
struct Inflater::State {
  inflate_state stream;
  bool in_header;
  // Kept from call to call, as a header may come in pieces.
  isal_gzip_header gzip;
  isal_zlib_header zlib;

  // DECOMP_OK: the header has ended. END_INPUT: it goes on.
  int ReadHeader(DeflateFrame frame) {
    constexpr std::uint32_t kReservedFlags = 0xe0, kMaxWindow = 7;
    if (frame == DeflateFrame::kBare) return ISAL_DECOMP_OK;
    const int code = frame == DeflateFrame::kGzip ? isal_read_gzip_header(&stream, &gzip) : isal_read_zlib_header(&stream, &zlib);
    if (code != ISAL_DECOMP_OK) return code;
    const bool known = frame == DeflateFrame::kGzip ? (gzip.flags & kReservedFlags) == 0 : zlib.info <= kMaxWindow && zlib.dict_flag == 0;
    return known ? ISAL_DECOMP_OK : ISAL_INVALID_WRAPPER;
  }
};

Inflater::Inflater(DeflateFrame frame) : frame_(frame), state_(std::make_unique_for_overwrite<State>()) { Begin(); }
Inflater::~Inflater() = default;

void Inflater::Begin() {
  isal_inflate_init(&state_->stream);
  // The trailer is compared; headers are ours, as ISA-L cannot go on with one that comes in pieces.
  state_->stream.crc_flag = frame_ == DeflateFrame::kGzip   ? ISAL_GZIP_NO_HDR_VER
                            : frame_ == DeflateFrame::kZlib ? ISAL_ZLIB_NO_HDR_VER
                                                            : ISAL_DEFLATE;
  state_->in_header = true;
  state_->gzip = {};
  state_->zlib = {};
}

StreamState Inflater::Advance(std::span<const std::byte>& in, std::span<std::byte>& out) {
  StreamState step = StreamState::kGoesOn;
  do {
    const std::size_t had = in.size(), room = out.size();
    step = AdvancePiece(in, out);
    if (step == StreamState::kGoesOn && !in.empty() && in.size() == had && !out.empty() && out.size() == room) return StreamState::kDamaged;
  } while (step == StreamState::kGoesOn && !in.empty() && !out.empty());
  return step;
}

StreamState Inflater::AdvancePiece(std::span<const std::byte>& in, std::span<std::byte>& out) {
  constexpr std::size_t kMost = std::size_t{1} << 30;  // ISA-L counts in 32 bits
  inflate_state& stream = state_->stream;
  const auto given = std::uint32_t(std::min(in.size(), kMost)), room = std::uint32_t(std::min(out.size(), kMost));
  stream.next_in = reinterpret_cast<std::uint8_t*>(const_cast<std::byte*>(in.data()));  // which ISA-L does not change
  stream.avail_in = given;
  stream.next_out = reinterpret_cast<std::uint8_t*>(out.data());
  stream.avail_out = room;
  int code = ISAL_DECOMP_OK;
  if (state_->in_header) {
    code = state_->ReadHeader(frame_);
    state_->in_header = code == ISAL_END_INPUT;
  }
  if (code == ISAL_DECOMP_OK) code = isal_inflate(&stream);
  // Beyond damage ISA-L writes what was in its memory before.
  if (code != ISAL_DECOMP_OK && code != ISAL_END_INPUT) return StreamState::kDamaged;
  const bool ended = stream.block_state == ISAL_BLOCK_FINISH;
  // ISA-L takes whole words, and at the end it may hold bytes that are not the member's.
  const std::uint32_t left = stream.avail_in + (ended ? std::uint32_t(stream.read_in_length) / 8 : 0);
  in = in.subspan(given - std::min(left, given));
  out = out.subspan(room - stream.avail_out);
  return ended ? StreamState::kEnded : StreamState::kGoesOn;
}

}  // namespace slabstream
