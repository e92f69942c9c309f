// Arrays of NumPy (.npy), by numpy.lib.format. The indices of an array are z, y, x, however it lies in memory: a[z, y, x]. A fourth one, in
// front, counts volumes: a[time, z, y, x].
#include "data/volume_io/npy_header.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/second_of.h"
#include "common/text/parse_number.h"
#include "data/volume_io/formats.h"
#include "data/volume_io/output.h"

namespace slabstream {
namespace {

constexpr std::string_view kMagic = "\x93NUMPY";

struct Dtype {
  SampleType type = SampleType::kUint8;
  bool big_endian = false;
};

constexpr std::array<std::pair<std::string_view, SampleType>, 12> kTypes = {{
    {"i1", SampleType::kInt8},
    {"u1", SampleType::kUint8},
    {"b1", SampleType::kUint8},  // truth values
    {"i2", SampleType::kInt16},
    {"u2", SampleType::kUint16},
    {"i4", SampleType::kInt32},
    {"u4", SampleType::kUint32},
    {"i8", SampleType::kInt64},
    {"u8", SampleType::kUint64},
    {"f2", SampleType::kFloat16},
    {"f4", SampleType::kFloat32},
    {"f8", SampleType::kFloat64},
}};

// "<f4"
std::optional<Dtype> ParseDtype(std::string_view text) {
  if (text.size() != 3 || std::string_view("<>|=").find(text.front()) == std::string_view::npos) return std::nullopt;
  const bool big_endian = text.front() == '>';
  text.remove_prefix(1);
  const std::optional<SampleType> type = SecondOf(kTypes, text);
  return type ? std::optional(Dtype{*type, big_endian}) : std::nullopt;
}

// What stands behind 'key': in the header's dictionary, up to the end of `closing`, or up to the next comma if that is empty.
std::optional<std::string_view> ValueOf(std::string_view header, const std::string& key, char opening, char closing) {
  const std::size_t at = header.find("'" + key + "':");
  if (at == std::string_view::npos) return std::nullopt;
  header.remove_prefix(at + key.size() + 3);
  const std::size_t begin = header.find_first_not_of(' ');
  if (begin == std::string_view::npos || header[begin] != opening) return std::nullopt;
  const std::size_t end = header.find(closing, begin + 1);
  if (end == std::string_view::npos) return std::nullopt;
  return header.substr(begin + 1, end - begin - 1);
}

// "3, 4, 5" or "3,"
std::optional<std::vector<double>> ParseShape(std::string_view text) {
  std::vector<double> shape;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    std::string_view number = text.substr(begin, end - begin);
    while (number.starts_with(' ')) number.remove_prefix(1);
    while (number.ends_with(' ') || number.ends_with('L')) number.remove_suffix(1);  // L: as Python 2 wrote long integers
    begin = end + 1;
    if (number.empty() && begin >= text.size()) break;
    const std::optional<std::int64_t> parsed = ParseNumber<std::int64_t>(number);
    if (!parsed) return std::nullopt;
    shape.push_back(double(*parsed));
  }
  return shape;
}

// The dictionary in front of the samples, and where they begin.
struct NpyText {
  std::string text;
  std::int64_t end = 0;
};

Result<NpyText> ReadText(const std::string& path) {
  constexpr std::size_t kFirst = 8, kMostBytes = std::size_t{1} << 20;
  const auto wrong = [&](const std::string& why) { return Status::InvalidArgument(path + ": not an array of NumPy: " + why); };
  std::array<std::byte, kFirst + 4> start{};
  // The shortest header is longer than this.
  if (Status status = ReadPayload({.file = path}, start, Extent::kStart); !status.ok()) return status;
  const auto byte = [&](std::size_t i) { return std::to_integer<std::size_t>(start[i]); };
  if (!std::ranges::equal(std::as_bytes(std::span(kMagic)), std::span(start).first(kMagic.size())))
    return wrong("it does not begin with \\x93NUMPY");
  const std::size_t version = byte(6);
  if (version < 1 || version > 3) return wrong(fmt::format("version {} is not supported; supported: 1 to 3", version));
  const std::size_t length_bytes = version == 1 ? 2 : 4;
  std::size_t length = 0;
  for (std::size_t i = length_bytes; i-- > 0;) length = length << 8 | byte(kFirst + i);
  if (length > kMostBytes) return wrong(fmt::format("the header has {} bytes, limit {}", length, kMostBytes));
  NpyText header{std::string(length, '\0'), std::int64_t(kFirst + length_bytes + length)};
  const Payload payload{.file = path, .offset = std::int64_t(kFirst + length_bytes)};
  if (Status status = ReadPayload(payload, std::as_writable_bytes(std::span(header.text)), Extent::kStart); !status.ok()) return status;
  return header;
}

}  // namespace

Result<NpyHeader> ReadNpyHeader(const std::string& path) {
  const Result<NpyText> text = ReadText(path);
  if (!text.ok()) return text.status();
  const auto wrong = [&](const std::string& why) { return Status::InvalidArgument(path + ": not an array of NumPy: " + why); };
  const auto descr = ValueOf(text->text, "descr", '\'', '\'');
  const std::optional<Dtype> dtype = descr ? ParseDtype(*descr) : std::nullopt;
  if (!dtype)
    return wrong(
        fmt::format("dtype '{}' is not supported; supported: integers, floats and truth values", descr.value_or("of several fields")));
  const bool fortran = text->text.find("'fortran_order': True") != std::string::npos;
  if (!fortran && text->text.find("'fortran_order': False") == std::string::npos) return wrong("fortran_order is neither True nor False");
  const auto shape_text = ValueOf(text->text, "shape", '(', ')');
  std::optional<std::vector<double>> shape = shape_text ? ParseShape(*shape_text) : std::nullopt;
  if (!shape) return wrong("its shape is missing");
  return NpyHeader{dtype->type, dtype->big_endian, fortran, *std::move(shape), text->end};
}

namespace {

Result<LocatedSamples> Locate(const std::string& path, const ReadOptions& options) {
  Result<NpyHeader> npy = ReadNpyHeader(path);
  if (!npy.ok()) return npy.status();
  std::vector<double>& shape = npy->shape;
  if (shape.size() == 4 && npy->fortran)
    return Status::InvalidArgument(path + ": not a volume of NumPy: a shape of 4 sizes in Fortran order is not supported");

  RawHeader header{.type = npy->type};
  const Vec3 spacing = options.spacing.value_or(Vec3{1, 1, 1});
  header.steps = StepsOf(spacing);
  if (npy->fortran) {
    // The first axis of the array, z or of a slice y, runs fastest.
    std::swap(header.steps[0], header.steps[shape.size() == 2 ? 1 : 2]);
  } else {
    std::ranges::reverse(shape);
  }
  if (Status status = SetSize(header, path, std::move(shape), options); !status.ok()) return status;
  return LocatedSamples{header, {.file = path, .offset = npy->end, .big_endian = npy->big_endian}};
}

Status Write(const FileSamples& samples, const std::string& path) {
  const Index3& size = samples.geometry().size;
  const auto* const type = std::ranges::find(kTypes, samples.type(), [](const auto& entry) { return entry.second; });
  std::string text = fmt::format("{{'descr': '{}{}', 'fortran_order': False, 'shape': ({}, {}, {}), }}",
                                 BytesPerSample(samples.type()) == 1 ? '|' : '<', type->first, size.z, size.y, size.x);
  // Samples begin at a multiple of 64 bytes.
  constexpr std::size_t kBefore = 10, kAlignment = 64;
  text.append(kAlignment - (kBefore + text.size() + 1) % kAlignment, ' ').append("\n");
  const std::string header = std::string(kMagic) + '\1' + '\0' + char(text.size() & 0xff) + char(text.size() >> 8) + text;
  return WriteHeaderAndSamples(path, header, samples);
}

}  // namespace

VolumeFormat Npy() {
  return {.name = "NumPy",
          .endings = {".npy"},
          .options = {"time", "spacing"},
          .locate = Locate,
          .written_endings = {".npy"},
          .write = Write,
          .keeps = {.spacing = false, .axes = false, .units = {}}};
}

}  // namespace slabstream
