// Payload frames: chunks of voxels and runs of images, packed or not. zstd itself says what they must unpack to.
//
// input: u8 kind (even: chunk, odd: runs), u8 codec (even: raw, odd: zstd), u32 bytes that the header states, u8 (0: a wrong digest),
// payload
#include <zstd.h>

#include <algorithm>

#include "common/wire/digest.h"
#include "common/wire/payload.h"
#include "tests/fuzz/decoders.h"
#include "tests/support/random.h"

namespace slabstream {
namespace {

constexpr std::uint32_t kMostRawBytes = 1 << 18;

// What the payload stands for; nothing if it cannot be `raw_bytes` long. `codec`: of the header.
std::optional<FuzzBytes> Unpacked(std::span<const std::byte> payload, Codec codec, std::size_t raw_bytes) {
  FuzzBytes out(raw_bytes);
  if (codec == Codec::kRaw) {
    if (payload.size() != raw_bytes) return std::nullopt;
    std::copy(payload.begin(), payload.end(), out.begin());
    return out;
  }
  if (ZSTD_decompress(out.data(), out.size(), payload.data(), payload.size()) != raw_bytes) return std::nullopt;
  return out;
}

bool DecodeChunk(std::span<const std::byte> payload, Codec codec, std::uint32_t stated, bool right_digest) {
  const std::uint32_t raw_bytes = 1 + stated % kMostRawBytes;
  const std::optional<FuzzBytes> expected = Unpacked(payload, codec, raw_bytes);
  Chunk chunk{.codec = codec, .raw_bytes = raw_bytes, .encoded_bytes = std::uint32_t(payload.size())};
  chunk.digest = (expected ? Digest(*expected) : 0) ^ (right_digest ? 0 : 1);
  FuzzBytes samples(raw_bytes);
  const Status status = UnpackChunk(chunk, payload, samples);
  CHECK_EQ(status.ok(), expected.has_value() && right_digest) << status.message();
  if (!status.ok()) {
    CheckRefusal(status);
    return false;
  }
  CHECK(samples == *expected);
  Chunk again;
  const Bytes packed = PackChunk(Bytes(samples), Codec::kZstd, again);
  FuzzBytes unpacked(raw_bytes);
  CHECK(UnpackChunk(again, packed.span(), unpacked).ok());
  CHECK(unpacked == samples);
  return true;
}

// Words of four bytes are grouped by significance before they are packed, so only the length of what comes out is known beforehand.
bool DecodeRuns(std::span<const std::byte> payload, Codec codec, std::uint32_t stated, bool right_digest) {
  const std::size_t raw_bytes = stated % kMostRawBytes / 4 * 4;
  const std::uint64_t digest = Digest(payload) ^ (right_digest ? 0 : 1);
  const PackedRuns header{codec, payload.size(), digest};
  const Result<Bytes> runs = UnpackRuns(header, Bytes(FuzzBytes(payload.begin(), payload.end())), raw_bytes);
  if (!runs.ok()) {
    CheckRefusal(runs.status());
    return false;
  }
  CHECK(right_digest);
  CHECK(Unpacked(payload, codec, raw_bytes).has_value());
  CHECK_EQ(runs->size(), raw_bytes);
  PackedRuns again;
  const std::optional<Bytes> packed = PackRuns(runs->span(), again);
  if (!packed) return true;  // it does not get smaller
  const Result<Bytes> unpacked = UnpackRuns(again, *packed, raw_bytes);
  CHECK(unpacked.ok()) << unpacked.status().message();
  CHECK(std::ranges::equal(unpacked->span(), runs->span()));
  return true;
}

FuzzBytes Seed(bool is_runs, Codec codec, std::size_t raw_bytes, std::span<const std::byte> payload) {
  const auto stated = std::uint32_t(is_runs ? raw_bytes : raw_bytes - 1);
  return FuzzSeed()
      .Put(std::uint8_t(is_runs))
      .Put(std::uint8_t(codec == Codec::kZstd))
      .Put(stated)
      .Put(std::uint8_t{1})
      .Put(payload)
      .bytes();
}

}  // namespace

bool DecodePayload(std::span<const std::byte> bytes) {
  FuzzInput input(bytes);
  const bool is_runs = input.Take<std::uint8_t>() % 2 != 0;
  const Codec codec = input.Take<std::uint8_t>() % 2 != 0 ? Codec::kZstd : Codec::kRaw;
  const auto stated = input.Take<std::uint32_t>();
  const bool right_digest = input.Take<std::uint8_t>() != 0;
  return is_runs ? DecodeRuns(input.rest(), codec, stated, right_digest) : DecodeChunk(input.rest(), codec, stated, right_digest);
}

std::vector<FuzzBytes> PayloadSeeds() {
  Random random(41);
  std::vector<FuzzBytes> seeds;
  for (const std::size_t size : {4, 64, 1000, 4096}) {
    FuzzBytes smooth(size), noise(size);
    for (std::size_t i = 0; i < size; ++i) {
      smooth[i] = std::byte(i / 50);
      noise[i] = std::byte(random.Integer(0, 255));
    }
    for (const FuzzBytes& samples : {smooth, noise}) {
      for (const Codec codec : {Codec::kRaw, Codec::kZstd}) {
        Chunk chunk;
        const Bytes packed = PackChunk(Bytes(samples), codec, chunk);
        seeds.push_back(Seed(false, chunk.codec, size, packed.span()));
      }
      seeds.push_back(Seed(true, Codec::kRaw, size, samples));
      PackedRuns runs;
      if (const std::optional<Bytes> packed = PackRuns(samples, runs)) seeds.push_back(Seed(true, Codec::kZstd, size, packed->span()));
    }
  }
  return seeds;
}

}  // namespace slabstream
