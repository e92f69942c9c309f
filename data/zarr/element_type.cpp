#include "data/zarr/element_type.h"

#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <type_traits>

#include "common/text/parse_number.h"

namespace slabstream::zarr {
namespace {

using metadata::Field;

// "NaN", "-Infinity", "0.5", or the bits in hexadecimal.
template <class T>
std::optional<T> FloatOf(const std::string& text) {
  using Bits = std::conditional_t<sizeof(T) == 2, std::uint16_t, std::conditional_t<sizeof(T) == 4, std::uint32_t, std::uint64_t>>;
  if (!text.starts_with("0x")) {
    const std::optional<double> number = ParseNumber<double>(text);
    return number ? std::optional(T(*number)) : std::nullopt;
  }
  Bits bits = 0;
  const char* const end = text.data() + text.size();
  constexpr int kHexadecimal = 16;
  const auto read = std::from_chars(text.data() + 2, end, bits, kHexadecimal);
  if (text.size() != 2 + 2 * sizeof(T) || read.ec != std::errc() || read.ptr != end) return std::nullopt;
  return std::bit_cast<T>(bits);
}

template <class T>
std::optional<T> WholeOf(const Json& value) {
  if (value.is_number_unsigned()) {
    const auto number = value.get<std::uint64_t>();
    return number <= std::uint64_t(std::numeric_limits<T>::max()) ? std::optional(T(number)) : std::nullopt;
  }
  if (value.is_number_integer()) {
    const auto number = value.get<std::int64_t>();
    if (number >= 0) return WholeOf<T>(Json(std::uint64_t(number)));
    return std::is_signed_v<T> && number >= std::int64_t(std::numeric_limits<T>::min()) ? std::optional(T(number)) : std::nullopt;
  }
  // "0.0", as some write for every type
  constexpr double kExact = 9007199254740992.0;
  if (!value.is_number()) return std::nullopt;
  const double number = value.get<double>();
  if (!(std::abs(number) <= kExact) || number != std::floor(number)) return std::nullopt;
  return number < 0 ? WholeOf<T>(Json(std::int64_t(number))) : WholeOf<T>(Json(std::uint64_t(number)));
}

template <class T>
std::optional<T> ElementOf(const Json& value) {
  if (value.is_boolean()) return T(value.get<bool>() ? 1 : 0);
  if constexpr (!std::is_integral_v<T>) {
    if (value.is_string()) return FloatOf<T>(value.text());
    if (!value.is_number()) return std::nullopt;
    return T(value.get<double>());
  } else {
    if (!value.is_string()) return WholeOf<T>(value);
    const std::string& text = value.text();
    if (const std::optional<T> whole = ParseNumber<T>(text)) return whole;
    const std::optional<double> number = ParseNumber<double>(text);
    return number ? WholeOf<T>(Json(*number)) : std::nullopt;
  }
}

}  // namespace

Result<ElementType> ReadDtype(const Field& dtype) {
  const auto wrong = [&] { return dtype.Wrong("an integer of 1, 2, 4 or 8 bytes or a float of 2, 4 or 8, such as \"<u2\" or \">f4\""); };
  if (!dtype.is_text()) return wrong();
  const std::string& text = dtype.value().text();
  constexpr std::size_t kLength = 3;
  if (text.size() != kLength) return wrong();
  const char order = text[0], kind = text[1], bytes = text[2];
  if (std::string_view("<>|=").find(order) == std::string_view::npos || bytes < '1' || bytes > '8') return wrong();
  if (kind == 'b' && bytes == '1') return ElementType{};
  const std::string name = (kind == 'u' ? "uint" : kind == 'i' ? "int" : kind == 'f' ? "float" : "") + std::to_string(8 * (bytes - '0'));
  const std::optional<SampleType> type = SampleTypeNamed(name);
  if (!type || (order == '|' && bytes != '1')) return wrong();
  constexpr char kOther = std::endian::native == std::endian::little ? '>' : '<';
  return ElementType{*type, order == kOther && bytes != '1'};
}

Result<SampleType> ReadDataType(const Field& data_type) {
  const Field name = data_type.is_text() ? data_type : data_type["name"];  // as every extension point may be written
  if (name.is_text() && name.value() == "bool") return SampleType::kUint8;
  const std::optional<SampleType> type = name.is_text() ? SampleTypeNamed(name.value().text()) : std::nullopt;
  if (!type) return data_type.Wrong("bool or one of " + SampleTypeNames());
  return *type;
}

Result<std::vector<std::byte>> ReadFill(const Field& fill, SampleType type) {
  std::vector<std::byte> bytes(BytesPerSample(type));
  if (!fill.given()) return bytes;
  const bool ok = VisitSampleType(type, [&](const auto* null) {
    const auto element = ElementOf<std::remove_cvref_t<decltype(*null)>>(fill.value());
    if (element) std::memcpy(bytes.data(), &*element, bytes.size());
    return element.has_value();
  });
  if (!ok) return fill.Wrong("a value of " + std::string(ToString(type)));
  return bytes;
}

}  // namespace slabstream::zarr
