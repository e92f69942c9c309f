#include "data/precomputed/sharding.h"

#include <fmt/format.h>

#include <bit>
#include <utility>

#include "data/codecs/codecs.h"

namespace slabstream::precomputed {
namespace {

std::uint64_t NumberAt(const Bytes& bytes, std::uint64_t place) {
  std::uint64_t number = 0;
  for (unsigned i = 0; i < 8; ++i) number |= std::to_integer<std::uint64_t>(bytes.span()[8 * place + i]) << (8 * i);
  return number;
}

// The first 64 bits of MurmurHash3_x86_128 of the eight bytes of a number, with the seed 0 (Appleby 2011, in the public domain).
std::uint64_t Murmur(std::uint64_t key) {
  constexpr std::uint32_t kC1 = 0x239b961b, kC2 = 0xab0e9789, kC3 = 0x38b34ae5, kBytes = 8;
  std::uint32_t h1 = std::rotl(std::uint32_t(key) * kC1, 15) * kC2, h2 = std::rotl(std::uint32_t(key >> 32) * kC2, 16) * kC3;
  std::uint32_t h3 = 0, h4 = 0;
  const auto mix = [](std::uint32_t& h) {
    h ^= h >> 16;
    h *= 0x85ebca6b;
    h ^= h >> 13;
    h *= 0xc2b2ae35;
    h ^= h >> 16;
  };
  const auto add = [&] {
    h1 += h2 + h3 + h4;
    h2 += h1;
    h3 += h1;
    h4 += h1;
  };
  for (std::uint32_t* const h : {&h1, &h2, &h3, &h4}) *h ^= kBytes;
  add();
  for (std::uint32_t* const h : {&h1, &h2, &h3, &h4}) mix(*h);
  add();
  return std::uint64_t{h2} << 32 | h1;
}

std::uint64_t LowBits(std::uint64_t number, unsigned bits) { return bits >= 64 ? number : number & ((std::uint64_t{1} << bits) - 1); }
std::uint64_t WithoutLowBits(std::uint64_t number, unsigned bits) { return bits >= 64 ? 0 : number >> bits; }

Status TakeBits(const metadata::Field& field, unsigned most, unsigned& bits) {
  const Result<std::uint64_t> number = field.Whole(0, most);
  if (number.ok()) bits = unsigned(*number);
  return number.status();
}

// One of two names; the second one is true.
Status TakeName(const metadata::Field& field, std::string_view no, std::string_view yes, bool& value) {
  if (!field.is_text() || (field.value() != no && field.value() != yes)) return field.Wrong(fmt::format("{} or {}", no, yes));
  value = field.value() == yes;
  return Status::Ok();
}

}  // namespace

Result<Sharding> ParseSharding(const metadata::Field& field) {
  constexpr unsigned kMostBits = 64, kMostMinishardBits = 32;
  constexpr std::string_view kType = "neuroglancer_uint64_sharded_v1";
  Sharding sharding;
  const metadata::Field type = field["@type"], index = field["minishard_index_encoding"], data = field["data_encoding"];
  if (!type.is_text() || type.value() != kType) return type.Wrong(kType);
  if (Status status = TakeBits(field["preshift_bits"], kMostBits, sharding.preshift_bits); !status.ok()) return status;
  if (Status status = TakeBits(field["minishard_bits"], kMostMinishardBits, sharding.minishard_bits); !status.ok()) return status;
  if (Status status = TakeBits(field["shard_bits"], kMostBits - sharding.minishard_bits, sharding.shard_bits); !status.ok()) return status;
  if (Status status = TakeName(field["hash"], "identity", "murmurhash3_x86_128", sharding.murmur); !status.ok()) return status;
  if (index.given()) {
    if (Status status = TakeName(index, "raw", "gzip", sharding.gzip_index); !status.ok()) return status;
  }
  if (data.given()) {
    if (Status status = TakeName(data, "raw", "gzip", sharding.gzip_data); !status.ok()) return status;
  }
  return sharding;
}

std::uint64_t ChunkNumber(const std::array<std::uint64_t, 3>& place, const std::array<std::uint64_t, 3>& counts) {
  std::uint64_t number = 0;
  unsigned to = 0;
  for (unsigned bit = 0; bit < 64 && to < 64; ++bit) {
    for (std::size_t axis = 0; axis < 3 && to < 64; ++axis) {
      if (std::uint64_t{1} << bit < counts[axis]) number |= (place[axis] >> bit & 1) << to++;
    }
  }
  return number;
}

ShardPlace PlaceOf(const Sharding& sharding, std::uint64_t chunk) {
  const std::uint64_t key = WithoutLowBits(chunk, sharding.preshift_bits), hash = sharding.murmur ? Murmur(key) : key;
  const std::uint64_t shard = LowBits(WithoutLowBits(hash, sharding.minishard_bits), sharding.shard_bits);
  return {fmt::format("{:0{}x}.shard", shard, (sharding.shard_bits + 3) / 4), LowBits(hash, sharding.minishard_bits)};
}

Result<ByteRange> MinishardRange(const Sharding& sharding, const Bytes& entry) {
  constexpr std::size_t kEntryBytes = 16;
  if (entry.size() != kEntryBytes) return Status::DataLoss("the shard ends within its index");
  const std::uint64_t begin = NumberAt(entry, 0), end = NumberAt(entry, 1);
  if (end < begin || end - begin > kMostMinishardBytes || begin > metadata::kMostElements) {
    return Status::DataLoss(fmt::format("the index of the shard is damaged: a minishard lies from {} to {}", begin, end));
  }
  return ByteRange{.begin = sharding.index_bytes() + begin, .bytes = end - begin};
}

Result<std::optional<ByteRange>> ChunkRange(const Sharding& sharding, Bytes index, std::uint64_t chunk) {
  if (sharding.gzip_index) {
    Result<Bytes> unpacked = GzipCodec()->Decode(std::move(index), kMostMinishardBytes);
    if (!unpacked.ok()) return unpacked.status();
    index = *std::move(unpacked);
  }
  constexpr std::size_t kRowBytes = 24;
  if (index.size() % kRowBytes != 0) return Status::DataLoss(fmt::format("the index of a minishard has {} bytes", index.size()));
  // Three rows: differences of numbers, gaps between chunks, and their lengths.
  const std::uint64_t count = index.size() / kRowBytes;
  std::uint64_t number = 0, begin = 0;
  for (std::uint64_t i = 0; i < count; ++i) {
    number += NumberAt(index, i);
    begin += NumberAt(index, count + i);
    const std::uint64_t bytes = NumberAt(index, 2 * count + i);
    if (number == chunk) {
      if (begin > metadata::kMostElements) return Status::DataLoss("the index of a minishard is damaged: a chunk lies behind every end");
      return std::optional(ByteRange{.begin = sharding.index_bytes() + begin, .bytes = bytes});
    }
    begin += bytes;
  }
  return std::optional<ByteRange>();
}

}  // namespace slabstream::precomputed
