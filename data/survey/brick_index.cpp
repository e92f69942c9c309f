#include "data/survey/brick_index.h"

#include <blosc.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <memory>
#include <optional>
#include <type_traits>
#include <utility>

#include "common/volume/memory_budget.h"
#include "data/codecs/codecs.h"

namespace slabstream {
namespace {

static_assert(std::endian::native == std::endian::little, "integers and samples are copied as they are");

std::size_t BricksOf(const SourceLevel& level) { return CountIn(CubesOver(level.description.geometry.size, kBrick)); }

void Append(std::vector<std::byte>& bytes, std::span<const std::byte> more) { bytes.insert(bytes.end(), more.begin(), more.end()); }

template <class Integer>
void AppendInteger(std::vector<std::byte>& bytes, Integer value) {
  Append(bytes, std::as_bytes(std::span(&value, 1)));
}

template <class T>
constexpr std::pair<T, T> NotReadOf() {
  if constexpr (std::is_floating_point_v<T>) return {kNotRead.min, kNotRead.max};
  return {std::numeric_limits<T>::max(), std::numeric_limits<T>::lowest()};
}

template <class T>
Result<std::vector<std::byte>> PackLevel(const BrickRangeList& bricks) {
  std::vector<T> samples(2 * bricks.size());
  for (std::size_t i = 0; i < bricks.size(); ++i) {
    const auto [low, high] = bricks[i] == kNotRead ? NotReadOf<T>() : std::pair(T(bricks[i].min), T(bricks[i].max));
    samples[i] = low;
    samples[bricks.size() + i] = high;
  }
  const std::size_t bytes = samples.size() * sizeof(T);
  if (bytes > BLOSC_MAX_BUFFERSIZE) return Status::ResourceExhausted("an index of so many bricks cannot be written");
  std::vector<std::byte> packed(bytes + BLOSC_MAX_OVERHEAD);
  constexpr int kEffort = 5, kThreads = 1;
  const int size =
      blosc_compress_ctx(kEffort, BLOSC_SHUFFLE, sizeof(T), bytes, samples.data(), packed.data(), packed.size(), "zstd", 0, kThreads);
  if (size <= 0) return Status::Internal("an index cannot be packed");
  packed.resize(std::size_t(size));
  AppendInteger(packed, Crc32c(packed));
  return packed;
}

template <class T>
Status UnpackLevel(std::span<const std::byte> packed, BrickRangeList& bricks) {
  static const CodecChain kChain = {BloscCodec(), Crc32cCodec()};
  const auto owner = std::make_shared<std::span<const std::byte>>(packed);
  const Result<Bytes> bytes = DecodeChain(kChain, Bytes(owner, packed), 2 * bricks.size() * sizeof(T));
  if (!bytes.ok()) return bytes.status();
  const std::byte* const low_bytes = bytes->span().data();
  const std::byte* const high_bytes = low_bytes + bricks.size() * sizeof(T);
  for (std::size_t i = 0; i < bricks.size(); ++i) {
    T low, high;
    std::memcpy(&low, low_bytes + i * sizeof(T), sizeof(T));
    std::memcpy(&high, high_bytes + i * sizeof(T), sizeof(T));
    const ValueRange range = {float(low), float(high)};
    if (std::pair(low, high) == NotReadOf<T>()) {
      bricks[i] = kNotRead;
    } else if ((std::is_floating_point_v<T> && range == kNoFiniteValue) ||
               (std::isfinite(range.min) && std::isfinite(range.max) && range.min <= range.max)) {
      bricks[i] = range;
    } else {
      return Status::DataLoss("a range ends before it begins");
    }
  }
  return Status::Ok();
}

// Takes bytes from the front of what is left.
class Reader {
 public:
  explicit Reader(std::span<const std::byte> bytes) : left_(bytes) {}

  std::optional<std::span<const std::byte>> Take(std::uint64_t bytes) {
    if (bytes > left_.size()) return std::nullopt;
    const std::span<const std::byte> taken = left_.first(bytes);
    left_ = left_.subspan(bytes);
    return taken;
  }
  template <class Integer>
  std::optional<Integer> TakeInteger() {
    const auto bytes = Take(sizeof(Integer));
    if (!bytes) return std::nullopt;
    Integer value;
    std::memcpy(&value, bytes->data(), sizeof(value));
    return value;
  }
  bool TakeText(std::string_view text) {
    const auto bytes = Take(text.size());
    return bytes && std::ranges::equal(*bytes, std::as_bytes(std::span(text)));
  }
  bool empty() const { return left_.empty(); }

 private:
  std::span<const std::byte> left_;
};

}  // namespace

Result<BrickIndex> EmptyIndex(const SourceInfo& source) {
  std::size_t bricks = 0;
  for (const SourceLevel& level : source.levels) bricks += BricksOf(level);
  if (Status fits = CheckFitsMemory(std::int64_t(bricks * sizeof(ValueRange)), "an index of the bricks"); !fits.ok()) return fits;
  BrickIndex index;
  for (const SourceLevel& level : source.levels) index.levels.emplace_back(BricksOf(level), kNotRead);
  return index;
}

double ShareRead(const BrickIndex& index) {
  std::size_t all = 0, read = 0;
  for (const BrickRangeList& level : index.levels) {
    all += level.size();
    read += level.size() - std::size_t(std::ranges::count(level, kNotRead));
  }
  return all == 0 ? 0 : double(read) / double(all);
}

BrickRangeList DataRanges(const BrickRangeList& indexed, const VolumeDescription& level) {
  BrickRangeList ranges(indexed.size());
  const ValueRange any = AnyValue(level);
  std::ranges::transform(indexed, ranges.begin(),
                         [&](const ValueRange& brick) { return brick == kNotRead ? any : DataRange(level, brick); });
  return ranges;
}

Result<std::vector<std::byte>> EncodeIndex(const BrickIndex& index, const SourceInfo& source, std::string_view name) {
  std::vector<std::byte> bytes;
  Append(bytes, std::as_bytes(std::span(kIndexMagic)));
  AppendInteger(bytes, std::uint32_t(name.size()));
  Append(bytes, std::as_bytes(std::span(name)));
  for (std::size_t i = 0; i < index.levels.size(); ++i) {
    const Result<std::vector<std::byte>> packed =
        VisitStoredType(source.levels[i].description.type, [&]<class T>(const T*) { return PackLevel<T>(index.levels[i]); });
    if (!packed.ok()) return packed.status();
    AppendInteger(bytes, std::uint64_t(packed->size()));
    Append(bytes, *packed);
  }
  return bytes;
}

Result<BrickIndex> DecodeIndex(std::span<const std::byte> bytes, const SourceInfo& source, std::string_view name) {
  const Status ends = Status::DataLoss("it ends too early");
  Reader reader(bytes);
  if (!reader.TakeText(kIndexMagic)) return Status::DataLoss("it does not begin as an index");
  const auto name_size = reader.TakeInteger<std::uint32_t>();
  if (!name_size) return ends;
  const auto of_name = reader.Take(*name_size);
  if (!of_name) return ends;
  if (!std::ranges::equal(*of_name, std::as_bytes(std::span(name)))) return Status::NotFound("it is of other files, or of what they were");
  Result<BrickIndex> index = EmptyIndex(source);
  if (!index.ok()) return index;
  for (std::size_t i = 0; i < index->levels.size(); ++i) {
    const auto size = reader.TakeInteger<std::uint64_t>();
    if (!size) return ends;
    const auto packed = reader.Take(*size);
    if (!packed) return ends;
    const Status unpacked =
        VisitStoredType(source.levels[i].description.type, [&]<class T>(const T*) { return UnpackLevel<T>(*packed, index->levels[i]); });
    if (!unpacked.ok()) return unpacked;
  }
  if (!reader.empty()) return Status::DataLoss("there is something behind its end");
  return index;
}

}  // namespace slabstream
