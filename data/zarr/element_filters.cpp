#include "data/zarr/element_filters.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <type_traits>
#include <utility>

#include "common/memory/pooled_vector.h"
#include "data/codecs/codecs.h"
#include "data/codecs/decoded_bytes.h"
#include "data/zarr/element_type.h"

namespace slabstream::zarr {
namespace {

using metadata::Field;

constexpr std::size_t kBlock = 4096;  // elements that are turned around at a time

bool IsInteger(SampleType type) {
  return VisitSampleType(type, [](const auto* null) { return std::is_integral_v<std::remove_cvref_t<decltype(*null)>>; });
}

template <class T, class Wide>
T Narrowed(Wide value) {
  if constexpr (!std::is_integral_v<T> || std::is_integral_v<Wide>) {
    return T(value);  // integers modulo their range
  } else {
    if (std::isnan(value)) return T{0};
    const auto low = double(std::numeric_limits<T>::min()), high = std::ldexp(1.0, std::numeric_limits<T>::digits);
    return value < low ? std::numeric_limits<T>::min() : value >= high ? std::numeric_limits<T>::max() : T(value);
  }
}

// Each element of `from` becomes one of `to`; in between it is a Wide, of which `decode` makes another one.
template <class Wide, class Decode>
Bytes Turned(SampleType from, SampleType to, std::span<const std::byte> in, Decode&& decode) {
  const std::size_t count = in.size() / BytesPerSample(from);
  UnwrittenVector<std::byte> out(count * BytesPerSample(to));
  std::array<Wide, kBlock> block;
  for (std::size_t begin = 0; begin < count; begin += kBlock) {
    const std::size_t some = std::min(kBlock, count - begin);
    VisitSampleType(from, [&](const auto* null) {
      std::remove_cvref_t<decltype(*null)> element;
      for (std::size_t i = 0; i < some; ++i) {
        std::memcpy(&element, in.data() + (begin + i) * sizeof element, sizeof element);
        block[i] = decode(Wide(element));
      }
    });
    VisitSampleType(to, [&](const auto* null) {
      using To = std::remove_cvref_t<decltype(*null)>;
      for (std::size_t i = 0; i < some; ++i) {
        const To element = Narrowed<To>(block[i]);
        std::memcpy(out.data() + (begin + i) * sizeof element, &element, sizeof element);
      }
    });
  }
  return Bytes(std::move(out));
}

// What is stored is of another type, differences, or of another scale.
enum class Kind : std::uint8_t { kConverted, kDifferences, kScaled };

SharedCodec Elements(Kind kind, SampleType type, SampleType stored, double scale = 1, double offset = 0) {
  const std::size_t bytes_each = BytesPerSample(type), stored_each = BytesPerSample(stored);
  const auto decode = [=](const Bytes& packed, std::uint64_t most) -> Result<Bytes> {
    const std::span<const std::byte> in = packed.span();
    if (in.size() % stored_each != 0) {
      return Status::DataLoss(fmt::format("has {} bytes, must have a multiple of {}", in.size(), stored_each));
    }
    const std::uint64_t bytes = in.size() / stored_each * bytes_each;
    if (bytes > most) return TooManyBytes("a chunk", bytes, most);
    if (kind == Kind::kScaled) return Turned<double>(stored, type, in, [=](double value) { return value / scale + offset; });
    const bool differences = kind == Kind::kDifferences;
    if (IsInteger(stored) && IsInteger(type)) {
      return Turned<std::uint64_t>(stored, type, in, [differences, sum = std::uint64_t{0}](std::uint64_t value) mutable {
        return differences ? sum += value : value;
      });
    }
    return Turned<double>(stored, type, in, [differences, sum = 0.0](double value) mutable { return differences ? sum += value : value; });
  };
  return std::make_shared<ChunkCodec>(decode, bytes_each, stored_each);
}

// Truth values, eight to a byte, the first one in the highest bit; the first byte says how many bits of the last one count for nothing.
Result<Bytes> UnpackBits(const Bytes& packed, std::uint64_t most) {
  const std::span<const std::byte> in = packed.span();
  if (in.empty()) return DamagedBytes("packbits");
  constexpr std::uint64_t kBits = 8;
  const std::uint64_t bits = kBits * (in.size() - 1), unused = std::to_integer<std::uint64_t>(in[0]);
  if (unused > std::min(bits, kBits - 1)) return DamagedBytes("packbits");
  if (bits - unused > most) return TooManyBytes("packbits", bits - unused, most);
  UnwrittenVector<std::byte> out(bits - unused);
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = in[1 + i / kBits] >> (kBits - 1 - i % kBits) & std::byte{1};
  return Bytes(std::move(out));
}

Result<ElementType> TypeOr(const Field& field, SampleType usual) {
  return field.given() ? ReadDtype(field) : Result<ElementType>(ElementType{usual});
}

}  // namespace

bool IsElementFilter(std::string_view name) {
  static constexpr std::array<std::string_view, 6> kNames = {"delta", "fixedscaleoffset", "astype", "quantize", "bitround", "packbits"};
  return std::ranges::find(kNames, name) != kNames.end();
}

Result<ElementFilter> ReadElementFilter(std::string_view name, const Field& settings, SampleType type, bool swaps) {
  ElementFilter filter{.stored = type};
  if (name == "bitround") return filter;  // what it rounds stays an element
  if (name == "packbits") {
    if (type != SampleType::kUint8) return settings.Wrong("left out: packbits takes truth values");
    filter.chain.push_back(std::make_shared<ChunkCodec>(UnpackBits));
    return filter;
  }
  const bool astype = name == "astype";
  const Field from = settings[astype ? "decode_dtype" : "dtype"], to = settings[astype ? "encode_dtype" : "astype"];
  const Result<ElementType> given = TypeOr(from, type), stored = TypeOr(to, type);
  if (!given.ok()) return given.status();
  if (!stored.ok()) return stored.status();
  if (given->type != type) return from.Wrong(fmt::format("{}, the type of what goes in", ToString(type)));
  const auto swap = [&](const ElementType& element) {
    if (swaps && element.swapped) filter.chain.push_back(SwapBytesCodec(BytesPerSample(element.type)));
  };
  swap(*given);
  if (name == "fixedscaleoffset") {
    const Result<double> scale = settings["scale"].Number(), offset = settings["offset"].Number();
    if (!scale.ok()) return scale.status();
    if (!offset.ok()) return offset.status();
    if (*scale == 0) return settings["scale"].Wrong("a number other than 0");
    filter.chain.push_back(Elements(Kind::kScaled, type, stored->type, *scale, *offset));
  } else {
    filter.chain.push_back(Elements(name == "delta" ? Kind::kDifferences : Kind::kConverted, type, stored->type));
  }
  swap(*stored);
  filter.stored = stored->type;
  return filter;
}

}  // namespace slabstream::zarr
