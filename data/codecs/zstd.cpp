#include <zstd.h>
#include <zstd_errors.h>

#include <new>

#include "common/memory/pooled_vector.h"
#include "data/codecs/codecs.h"
#include "data/codecs/decoded_bytes.h"

namespace slabstream {
namespace {

struct FreeContext {
  void operator()(ZSTD_DCtx* context) const { ZSTD_freeDCtx(context); }
};

// One for each thread that decodes: making one costs as much as a small chunk.
ZSTD_DCtx& Context() {
  thread_local const std::unique_ptr<ZSTD_DCtx, FreeContext> context(ZSTD_createDCtx());
  if (context == nullptr) throw std::bad_alloc();
  return *context;
}

// Of all frames; `most` if one does not say it. Errors of Decode.
Result<std::uint64_t> DecodedBytes(std::span<const std::byte> in, std::uint64_t most) {
  std::uint64_t bytes = 0;
  while (!in.empty()) {
    const unsigned long long frame = ZSTD_getFrameContentSize(in.data(), in.size());
    if (frame == ZSTD_CONTENTSIZE_ERROR) return DamagedBytes("zstd");
    if (frame == ZSTD_CONTENTSIZE_UNKNOWN) return most;
    if (frame > most - bytes) return TooManyBytes("zstd", frame, most - bytes);
    bytes += frame;
    const std::size_t length = ZSTD_findFrameCompressedSize(in.data(), in.size());
    if (ZSTD_isError(length) != 0) return DamagedBytes("zstd");
    in = in.subspan(length);
  }
  return bytes;
}

Result<Bytes> DecodeZstd(const Bytes& packed, std::uint64_t most) {
  const std::span<const std::byte> in = packed.span();
  const Result<std::uint64_t> bytes = DecodedBytes(in, most);
  if (!bytes.ok()) return bytes.status();
  UnwrittenVector<std::byte> out(*bytes);
  const std::size_t decoded = ZSTD_decompressDCtx(&Context(), out.data(), out.size(), in.data(), in.size());
  if (ZSTD_isError(decoded) != 0) {
    // Nothing said how many bytes there are, or it lied.
    if (ZSTD_getErrorCode(decoded) == ZSTD_error_dstSize_tooSmall) return TooManyBytes("zstd", *bytes + 1, *bytes);
    return Status::DataLoss(fmt::format("damaged: zstd says {}", ZSTD_getErrorName(decoded)));
  }
  out.resize(decoded);
  return Bytes(std::move(out));
}

}  // namespace

SharedCodec ZstdCodec() { return std::make_shared<ChunkCodec>(DecodeZstd); }

}  // namespace slabstream
