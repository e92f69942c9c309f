// Surfaces in GIFTI (.gii), as version 1.0 of its specification has them: an array of places, one of triangles, and perhaps one with a
// value for each place. Where a matrix leads to the scanner's space, it is applied.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include "common/text/base64.h"
#include "common/volume/memory_budget.h"
#include "data/codecs/codecs.h"
#include "data/shapes/parsing.h"
#include "data/shapes/shape_formats.h"
#include "data/volume_io/decompressor.h"
#include "data/volume_io/text_header.h"
#include "data/volume_io/xml_events.h"

namespace slabstream {
namespace {

struct GiftiArray {
  XmlTag tag;
  std::string_view data, space, matrix;  // texts of elements in it; that of the scanner's space comes before others
};

// The numbers of an array, decoded.
struct GiftiNumbers {
  Bytes bytes;
  SampleType type = SampleType::kFloat32;
  bool swapped = false, by_columns = false;
  std::size_t rows = 0, columns = 1;

  double At(std::size_t row, std::size_t column) const {
    return NumberAt({bytes.span(), swapped}, type, BytesPerSample(type) * (by_columns ? column * rows + row : row * columns + column));
  }
};

constexpr std::string_view kScanner = "NIFTI_XFORM_SCANNER_ANAT";

Result<std::vector<GiftiArray>> FindArrays(std::string_view text) {
  std::vector<GiftiArray> arrays;
  std::size_t begin = 0;
  bool gifti = false;
  const auto start = [&](const XmlTag& tag) {
    begin = std::size_t(tag.end);
    gifti = gifti || tag.name == "GIFTI";
    if (tag.name == "DataArray") arrays.push_back({tag, {}, {}, {}});
    return gifti;
  };
  std::string_view space;
  const auto end = [&](const XmlTag& tag) {
    if (arrays.empty()) return;
    const std::string_view inside = text.substr(begin, std::max(std::size_t(tag.begin), begin) - begin);
    GiftiArray& array = arrays.back();
    if (tag.name == "Data") array.data = inside;
    if (tag.name == "TransformedSpace") space = inside;
    if (tag.name == "MatrixData" && (array.matrix.empty() || space.find(kScanner) != std::string_view::npos)) {
      array.matrix = inside;
      array.space = space;
    }
  };
  if (Status status = ReadXml(text, {start, end}); !status.ok()) return status;
  if (!gifti) return Status::InvalidArgument("not a GIFTI file: its first element is not GIFTI");
  return arrays;
}

Result<Bytes> Decoded(const GiftiArray& array, SampleType type, std::uint64_t count) {
  const std::string encoding = array.tag.Attribute("Encoding");
  const bool text = encoding == "ASCII", packed = encoding == "GZipBase64Binary";
  if (!text && !packed && encoding != "Base64Binary")
    return Status::InvalidArgument(fmt::format("Encoding is '{}', must be ASCII, Base64Binary or GZipBase64Binary", Shortened(encoding)));
  // The most numbers that so many letters can hold.
  const std::uint64_t most = text ? array.data.size() : array.data.size() * (packed ? kMaxDeflateRatio : 1) / BytesPerSample(type);
  if (count > most) return Status::DataLoss(fmt::format("truncated: {} numbers cannot be in {} letters", count, array.data.size()));
  const std::uint64_t bytes = count * BytesPerSample(text ? SampleType::kFloat64 : type);
  if (Status status = CheckFitsMemory(std::int64_t(bytes + array.data.size()), "an array"); !status.ok()) return status;
  if (text) {
    std::vector<double> numbers(count);
    std::string_view rest = array.data;
    for (double& number : numbers) {
      const std::string_view word = TakeWord(rest);
      if (!ToNumber(word)) return Status::DataLoss(fmt::format("has '{}', must be one of {} numbers", Shortened(word), count));
      number = *ToNumber(word);
    }
    const auto all = std::as_bytes(std::span(numbers));
    return Bytes(std::vector<std::byte>(all.begin(), all.end()));
  }
  std::vector<std::byte> letters;
  letters.reserve(array.data.size());
  std::ranges::copy_if(BytesOf(array.data), std::back_inserter(letters), [](std::byte b) { return b > std::byte{' '}; });
  const std::optional<std::size_t> length = DecodeBase64(letters, letters);
  if (!length) return Status::DataLoss("its base64 is damaged");
  letters.resize(*length);
  Result<Bytes> decoded = packed ? ZlibCodec()->Decode(Bytes(std::move(letters)), bytes) : Bytes(std::move(letters));
  if (decoded.ok() && decoded->size() != bytes) return Status::DataLoss(fmt::format("has {} bytes, must have {}", decoded->size(), bytes));
  return decoded;
}

Result<GiftiNumbers> ReadNumbers(const GiftiArray& array, std::size_t columns) {
  const auto attribute = [&](const std::string& name) { return array.tag.Attribute(name); };
  const std::string type_name = attribute("DataType"), dimensions = attribute("Dimensionality");
  constexpr std::string_view kPrefix = "NIFTI_TYPE_";
  const auto type = SampleTypeNamed(type_name.starts_with(kPrefix) ? ToLower(type_name.substr(kPrefix.size())) : "");
  if (!type) return Status::InvalidArgument(fmt::format("DataType '{}' is not supported", Shortened(type_name)));
  const auto rows = ParseNumber<std::uint32_t>(attribute("Dim0")), found = ParseNumber<std::uint32_t>(attribute("Dim1"));
  if (!rows || (dimensions == "1" ? 1 : found.value_or(0)) != columns) {
    return Status::InvalidArgument(fmt::format("has {} dimensions of '{}' and '{}', must have {} columns", Shortened(dimensions),
                                               Shortened(attribute("Dim0")), Shortened(attribute("Dim1")), columns));
  }
  Result<Bytes> bytes = Decoded(array, *type, std::uint64_t{*rows} * columns);
  if (!bytes.ok()) return bytes.status();
  const bool text = attribute("Encoding") == "ASCII";
  return GiftiNumbers{*std::move(bytes),
                      text ? SampleType::kFloat64 : *type,
                      !text && attribute("Endian") == "BigEndian",
                      attribute("ArrayIndexingOrder") == "ColumnMajorOrder",
                      *rows,
                      columns};
}

// Row by row, 16 numbers.
void SetMatrix(std::string_view text, ShapeBuilder& builder) {
  std::array<double, 16> m{};
  for (double& number : m) {
    const std::string_view word = TakeWord(text);
    if (!ToNumber(word)) return builder.Wrong(fmt::format("MatrixData has '{}', must be 16 numbers", Shortened(word)));
    number = *ToNumber(word);
  }
  builder.SetMap({{Vec3{m[0], m[4], m[8]}, Vec3{m[1], m[5], m[9]}, Vec3{m[2], m[6], m[10]}}, {m[3], m[7], m[11]}});
}

}  // namespace

void ReadGifti(std::string_view bytes, ShapeBuilder& builder) {
  const Result<std::vector<GiftiArray>> arrays = FindArrays(bytes);
  if (!arrays.ok()) return builder.Fail(arrays.status());
  // The first array with this intent; none: with another one than places and triangles, and a value for each place.
  std::array<GiftiNumbers, 3> found;
  for (const GiftiArray& array : *arrays) {
    const std::string intent = array.tag.Attribute("Intent");
    const std::size_t which = intent == "NIFTI_INTENT_POINTSET" ? 0 : intent == "NIFTI_INTENT_TRIANGLE" ? 1 : 2;
    if (found[which].rows > 0 || (which == 2 && (array.tag.Attribute("Dimensionality") != "1" || found[0].rows == 0))) continue;
    Result<GiftiNumbers> numbers = ReadNumbers(array, which == 2 ? 1 : 3);
    if (!numbers.ok())
      return builder.Fail(Status(numbers.status().code(), fmt::format("array {}: {}", Shortened(intent), numbers.status().message())));
    if (which == 2 && numbers->rows != found[0].rows) continue;
    found[which] = *std::move(numbers);
    if (which != 0) continue;
    if (array.tag.Attribute("DataType") == "NIFTI_TYPE_FLOAT32") builder.SetFloats();
    if (array.space.find(kScanner) != std::string_view::npos) SetMatrix(array.matrix, builder);
  }
  const auto& [places, triangles, values] = found;
  builder.Expect(places.rows, triangles.rows);
  if (values.rows > 0) builder.Has(kValue);
  for (std::size_t i = 0; i < places.rows; ++i) {
    VertexRow row = {places.At(i, 0), places.At(i, 1), places.At(i, 2)};
    if (values.rows > 0) row[kValue] = values.At(i, 0);
    builder.AddVertex(row);
  }
  for (std::size_t i = 0; i < triangles.rows; ++i)
    builder.AddTriangle(ToWhole(triangles.At(i, 0)), ToWhole(triangles.At(i, 1)), ToWhole(triangles.At(i, 2)));
}

}  // namespace slabstream
