#include "tests/data/hdf5/netcdf_writer.h"

#include <algorithm>
#include <array>
#include <bit>
#include <type_traits>

namespace slabstream {
namespace {

std::string BigEndian(std::uint64_t number, int bytes) {
  std::string text;
  for (int i = bytes; i-- > 0;) text += char(number >> (8 * i) & 0xff);
  return text;
}

std::string Padded(std::string bytes) {
  bytes.resize((bytes.size() + 3) / 4 * 4);
  return bytes;
}

int TypeNumber(std::optional<SampleType> type) {
  constexpr std::array kTypes = {SampleType::kUint8, SampleType::kUint16, SampleType::kUint32, SampleType::kInt64, SampleType::kUint64};
  if (!type) return 2;
  switch (*type) {
    case SampleType::kInt8: return 1;
    case SampleType::kInt16: return 3;
    case SampleType::kInt32: return 4;
    case SampleType::kFloat32: return 5;
    case SampleType::kFloat64: return 6;
    default: return 7 + int(std::ranges::find(kTypes, *type) - kTypes.begin());
  }
}

std::string Element(std::optional<SampleType> type, double value) {
  if (!type) return std::string(1, char(value));
  return VisitSampleType(*type, [&](const auto* null) {
    using T = std::remove_cvref_t<decltype(*null)>;
    auto bytes = std::bit_cast<std::array<char, sizeof(T)>>(T(value));
    std::ranges::reverse(bytes);
    return std::string(bytes.data(), bytes.size());
  });
}

}  // namespace

std::string NetcdfWriter::Count(std::uint64_t number) const { return BigEndian(number, version == 5 ? 8 : 4); }

std::string NetcdfWriter::Name(const std::string& name) const { return Count(name.size()) + Padded(name); }

std::string NetcdfWriter::List(int tag, std::size_t count, const std::string& elements) const {
  return BigEndian(count == 0 ? 0 : std::uint64_t(tag), 4) + Count(count) + elements;
}

std::string NetcdfWriter::Attributes(const std::vector<Attribute>& list) const {
  std::string bytes;
  for (const Attribute& each : list) {
    std::string values = each.text;
    for (const double number : each.numbers) values += Element(each.type, number);
    const bool text = each.numbers.empty();
    bytes += Name(each.name) + BigEndian(std::uint64_t(TypeNumber(text ? std::nullopt : std::optional(each.type))), 4) +
             Count(text ? each.text.size() : each.numbers.size()) + Padded(values);
  }
  return List(12, list.size(), bytes);
}

bool NetcdfWriter::HasRecords(const Variable& variable) const {
  return !variable.dimensions.empty() && dimensions[variable.dimensions[0]].second == 0;
}

std::uint64_t NetcdfWriter::PieceBytes(const Variable& variable) const {
  std::uint64_t bytes = Element(variable.type, 0).size();
  for (const std::size_t number : variable.dimensions) bytes *= std::max<std::uint64_t>(1, dimensions[number].second);
  return bytes;
}

std::string NetcdfWriter::Header(const std::vector<std::uint64_t>& begins) const {
  std::string bytes = "CDF" + std::string(1, char(version)) + (streaming ? std::string(version == 5 ? 8 : 4, '\xff') : Count(records)),
              list;
  for (const auto& [name, size] : dimensions) list += Name(name) + Count(size);
  bytes += List(10, dimensions.size(), list) + Attributes(attributes);
  list.clear();
  for (std::size_t i = 0; i < variables.size(); ++i) {
    const Variable& each = variables[i];
    list += Name(each.name) + Count(each.dimensions.size());
    for (const std::size_t number : each.dimensions) list += Count(number);
    list += Attributes(each.attributes) + BigEndian(std::uint64_t(TypeNumber(each.type)), 4) + Count((PieceBytes(each) + 3) / 4 * 4) +
            BigEndian(begins[i], version == 1 ? 4 : 8);
  }
  return bytes + List(11, variables.size(), list);
}

std::string NetcdfWriter::Bytes() const {
  std::vector<std::uint64_t> begins(variables.size());
  std::string bytes = Header(begins);
  const bool alone = std::ranges::count_if(variables, [&](const Variable& each) { return HasRecords(each); }) == 1;
  // Variables in one piece, then the records.
  for (std::uint64_t record = 0; record <= records; ++record) {
    for (std::size_t i = 0; i < variables.size(); ++i) {
      const Variable& each = variables[i];
      if (HasRecords(each) != (record > 0)) continue;
      if (begins[i] == 0) begins[i] = bytes.size();
      const std::uint64_t count = PieceBytes(each) / Element(each.type, 0).size(), first = record > 0 ? (record - 1) * count : 0;
      std::string piece;
      for (std::uint64_t number = first; number < first + count; ++number) piece += Element(each.type, each.values[number]);
      bytes += record > 0 && alone ? piece : Padded(piece);
    }
  }
  return Header(begins) + bytes.substr(Header(begins).size());
}

}  // namespace slabstream
