#include "common/wire/payload.h"

#include <zstd.h>

#include <cstdint>
#include <string>
#include <utility>

#include "common/base/check.h"
#include "common/wire/digest.h"

namespace slabstream {
namespace {

constexpr int kZstdLevel = 1;
constexpr std::size_t kWordBytes = 4;

// All first bytes of the words, then all second ones, and so on. bytes.size() is a multiple of kWordBytes.
PooledVector<std::byte> GroupBySignificance(std::span<const std::byte> bytes) {
  const std::size_t words = bytes.size() / kWordBytes;
  PooledVector<std::byte> grouped(bytes.size());
  const std::byte* __restrict in = bytes.data();
  std::byte* __restrict out = grouped.data();
  for (std::size_t word = 0; word < words; ++word) {  // the compiler vectorises it
    out[word] = in[kWordBytes * word];
    out[words + word] = in[kWordBytes * word + 1];
    out[2 * words + word] = in[kWordBytes * word + 2];
    out[3 * words + word] = in[kWordBytes * word + 3];
  }
  return grouped;
}

PooledVector<std::byte> UngroupBySignificance(std::span<const std::byte> grouped) {
  const std::size_t words = grouped.size() / kWordBytes;
  PooledVector<std::byte> bytes(grouped.size());
  const std::byte* __restrict in = grouped.data();
  std::byte* __restrict out = bytes.data();
  for (std::size_t word = 0; word < words; ++word) {
    out[kWordBytes * word] = in[word];
    out[kWordBytes * word + 1] = in[words + word];
    out[kWordBytes * word + 2] = in[2 * words + word];
    out[kWordBytes * word + 3] = in[3 * words + word];
  }
  return bytes;
}

// Empty if the bytes do not get smaller.
PooledVector<std::byte> Compress(std::span<const std::byte> bytes) {
  if (bytes.empty()) return {};
  PooledVector<std::byte> packed(bytes.size() - 1);
  const std::size_t size = ZSTD_compress(packed.data(), packed.size(), bytes.data(), bytes.size(), kZstdLevel);
  if (ZSTD_isError(size)) return {};  // not enough room
  packed.resize(size);
  return packed;
}

// `out.size()` is the size that the header states.
Status Decompress(std::span<const std::byte> packed, std::span<std::byte> out) {
  const std::size_t size = ZSTD_decompress(out.data(), out.size(), packed.data(), packed.size());
  if (ZSTD_isError(size)) return Status::DataLoss("payload: zstd: " + std::string(ZSTD_getErrorName(size)));
  if (size != out.size()) {
    return Status::DataLoss("payload: " + std::to_string(size) + " unpacked bytes, the header says " + std::to_string(out.size()));
  }
  return Status::Ok();
}

// Checks, before memory is taken for the content, that the zstd frame states the same size as the header.
Status CheckContentSize(std::span<const std::byte> packed, std::uint64_t expected) {
  const unsigned long long size = ZSTD_getFrameContentSize(packed.data(), packed.size());
  if (size == ZSTD_CONTENTSIZE_ERROR || size == ZSTD_CONTENTSIZE_UNKNOWN)
    return Status::DataLoss("payload: not a zstd frame of known size");
  if (size != expected) {
    return Status::DataLoss("payload: zstd frame of " + std::to_string(size) + " bytes, the header says " + std::to_string(expected));
  }
  return Status::Ok();
}

Status CheckLength(std::size_t met, std::uint64_t expected) {
  if (met == expected) return Status::Ok();
  return Status::DataLoss("payload: " + std::to_string(met) + " bytes, the header says " + std::to_string(expected));
}

Status CheckDigest(std::span<const std::byte> bytes, std::uint64_t expected) {
  const std::uint64_t met = Digest(bytes);
  if (met == expected) return Status::Ok();
  return Status::DataLoss("payload: digest " + std::to_string(met) + ", the header says " + std::to_string(expected));
}

}  // namespace

Bytes PackRuns(Bytes payload, Codec codec, EncodedRuns& runs) {
  CHECK_EQ(payload.size(), PayloadBytes(runs.image));
  runs.codec = Codec::kRaw;
  if (codec == Codec::kZstd) {
    if (PooledVector<std::byte> packed = Compress(GroupBySignificance(payload.span())); !packed.empty()) {
      runs.codec = Codec::kZstd;
      payload = Bytes(std::move(packed));
    }
  }
  runs.encoded_bytes = payload.size();
  runs.digest = Digest(payload.span());
  return payload;
}

Result<Bytes> UnpackRuns(const EncodedRuns& runs, const Bytes& payload) {
  return UnpackRuns({runs.codec, runs.encoded_bytes, runs.digest}, payload, PayloadBytes(runs.image));
}

std::optional<Bytes> PackRuns(std::span<const std::byte> payload, PackedRuns& packed) {
  PooledVector<std::byte> bytes = Compress(GroupBySignificance(payload));
  if (bytes.empty()) return std::nullopt;
  packed = {Codec::kZstd, bytes.size(), Digest(bytes)};
  return Bytes(std::move(bytes));
}

Result<Bytes> UnpackRuns(const PackedRuns& packed, const Bytes& payload, std::size_t raw_bytes) {
  if (Status status = CheckLength(payload.size(), packed.bytes); !status.ok()) return status;
  if (Status status = CheckDigest(payload.span(), packed.digest); !status.ok()) return status;
  if (packed.codec == Codec::kRaw) {
    if (Status status = CheckLength(payload.size(), raw_bytes); !status.ok()) return status;
    return payload;
  }
  if (Status status = CheckContentSize(payload.span(), raw_bytes); !status.ok()) return status;
  PooledVector<std::byte> grouped(raw_bytes);
  if (Status status = Decompress(payload.span(), grouped); !status.ok()) return status;
  return Bytes(UngroupBySignificance(grouped));
}

Bytes PackChunk(Bytes samples, Codec codec, Chunk& chunk) {
  CHECK(samples.size() <= kChunkBytes) << "(" << samples.size() << " bytes)";
  chunk.raw_bytes = static_cast<std::uint32_t>(samples.size());
  chunk.digest = Digest(samples.span());
  chunk.codec = Codec::kRaw;
  if (codec == Codec::kZstd && !samples.empty()) {
    if (PooledVector<std::byte> packed = Compress(samples.span()); !packed.empty()) {
      chunk.codec = Codec::kZstd;
      samples = Bytes(std::move(packed));
    }
  }
  chunk.encoded_bytes = static_cast<std::uint32_t>(samples.size());
  return samples;
}

Status UnpackChunk(const Chunk& chunk, std::span<const std::byte> payload, std::span<std::byte> samples) {
  if (samples.size() != chunk.raw_bytes) {
    return Status::InvalidArgument("Chunk.raw_bytes: " + std::to_string(chunk.raw_bytes) + ", but there is room for " +
                                   std::to_string(samples.size()));
  }
  if (Status status = CheckLength(payload.size(), chunk.encoded_bytes); !status.ok()) return status;
  if (chunk.codec == Codec::kRaw) {
    if (Status status = CheckLength(payload.size(), chunk.raw_bytes); !status.ok()) return status;
    std::copy(payload.begin(), payload.end(), samples.begin());
  } else if (Status status = Decompress(payload, samples); !status.ok()) {
    return status;
  }
  return CheckDigest(samples, chunk.digest);
}

}  // namespace slabstream
