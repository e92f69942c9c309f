#include "data/xdmf/xdmf_item.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <numeric>
#include <utility>

#include "common/base/printable.h"
#include "common/text/parse_number.h"
#include "common/text/trimmed.h"
#include "data/hdf5/hdf5_array.h"
#include "data/hdf5/hdf5_file.h"
#include "data/sources/file_array.h"
#include "data/volume_io/payload.h"

namespace slabstream {
namespace {

constexpr std::size_t kMostTextNumbers = std::size_t{1} << 20;  // samples as text
constexpr std::size_t kMostHeld = 16;                           // arrays, which may each hold a file open
constexpr int kMostBoxes = 16;                                  // boxes of boxes

template <class T>
std::optional<std::vector<T>> WordsOf(std::string_view text, std::size_t most) {
  std::vector<T> numbers;
  for (text = Trimmed(text); !text.empty(); text = Trimmed(text)) {
    const std::size_t end = std::min(text.find_first_of(" \t\r\n"), text.size());
    const std::optional<T> number = ParseNumber<T>(text.substr(0, end));
    if (!number || numbers.size() == most) return std::nullopt;
    numbers.push_back(*number);
    text.remove_prefix(end);
  }
  return numbers;
}

std::uint64_t ProductOf(const std::vector<std::uint64_t>& sizes) {
  return std::accumulate(sizes.begin(), sizes.end(), std::uint64_t{1}, std::multiplies());
}

struct TypeName {
  std::string_view name;
  std::uint64_t bytes;
  SampleType type;
};
constexpr TypeName kTypes[] = {{"float", 4, SampleType::kFloat32}, {"float", 8, SampleType::kFloat64}, {"float", 2, SampleType::kFloat16},
                               {"int", 4, SampleType::kInt32},     {"int", 1, SampleType::kInt8},      {"int", 2, SampleType::kInt16},
                               {"int", 8, SampleType::kInt64},     {"uint", 4, SampleType::kUint32},   {"uint", 1, SampleType::kUint8},
                               {"uint", 2, SampleType::kUint16},   {"uint", 8, SampleType::kUint64},   {"char", 1, SampleType::kInt8},
                               {"uchar", 1, SampleType::kUint8},   {"short", 2, SampleType::kInt16},   {"ushort", 2, SampleType::kUint16}};

// Without a precision, the first of its name.
std::optional<SampleType> TypeOf(const std::string& name, const std::string& precision) {
  const auto* const found = std::ranges::find_if(kTypes, [&](const TypeName& each) {
    return each.name == name && (precision.empty() || ParseNumber<std::uint64_t>(precision) == each.bytes);
  });
  return found == std::end(kTypes) ? std::nullopt : std::optional(found->type);
}

class ItemParser {
 public:
  explicit ItemParser(XdmfDocument& document) : document_(document) {}

  Result<XdmfItem> Parse(const XdmfElement& element, int depth) {
    const Result<const XdmfElement*> resolved = document_.Resolved(element);
    if (!resolved.ok()) return resolved.status();
    const XdmfElement& item = **resolved;
    const std::string kind = item.Word({"ItemType", "Type"});
    if (depth == kMostBoxes) return document_.Wrong(item, fmt::format("lies in more than {} others", kMostBoxes));
    if (kind == "hyperslab") return ParseBox(item, depth);
    if (kind.empty() || kind == "uniform") return ParseUniform(item);
    return document_.Wrong(item, fmt::format("ItemType '{}' is not supported; supported: Uniform and HyperSlab", Printable(kind)));
  }

 private:
  Result<XdmfItem> ParseUniform(const XdmfElement& element) {
    const auto wrong = [&](const std::string& why) { return document_.Wrong(element, why); };
    XdmfItem item{.named = document_.Named(element)};
    const std::string dimensions = element.Attribute({"Dimensions"}), format = element.Word({"Format"});
    const std::string type = element.Word({"NumberType", "DataType"}), precision = element.Word({"Precision"});
    const std::string endian = element.Word({"Endian"}), seek = element.Word({"Seek"}), compression = element.Word({"Compression"});
    item.type_name = type + precision;
    item.type = TypeOf(type.empty() ? "float" : type, precision);
    item.text = element.text;
    std::optional<std::vector<std::uint64_t>> size = CountsInText(dimensions, kMaxArrayAxes);
    if (size && size->empty() && (format.empty() || format == "xml")) {
      if (Status status = document_.Spend(item.text.size() / 8); !status.ok()) return status;
      const auto numbers = NumbersInText(item.text, kMostTextNumbers);
      size = {numbers ? numbers->size() : 1};
    }
    std::uint64_t left = std::uint64_t{1} << 58;  // with 8 bytes each more than a file has
    const auto fits = [&](std::uint64_t along) { return along >= 1 && (left /= along) > 0; };
    if (!size || size->empty() || !std::ranges::all_of(*size, fits)) {
      return wrong(fmt::format("Dimensions is '{}', must be 1 to {} whole numbers above 0", Printable(dimensions), kMaxArrayAxes));
    }
    item.size = item.count = *size;
    item.begin.assign(size->size(), 0);
    if (format.empty() || format == "xml") return item;
    std::string file(item.text);
    if (format == "hdf" || format == "hdf5") {
      item.format = XdmfItem::Format::kHdf5;
      const std::size_t colon = file.find(':');
      if (colon == std::string::npos) return wrong(fmt::format("is '{}', must be FILE:/DATASET", Printable(file)));
      item.dataset = (file.substr(colon + 1).starts_with('/') ? "" : "/") + file.substr(colon + 1);
      file.resize(colon);
    } else if (format == "binary") {
      item.format = XdmfItem::Format::kBinary;
      const std::optional<std::uint64_t> bytes = seek.empty() ? 0 : ParseNumber<std::uint64_t>(seek);
      if (!bytes || *bytes > std::uint64_t{1} << 61) return wrong(fmt::format("Seek is '{}', must be a number of bytes", Printable(seek)));
      if (endian != "big" && endian != "little" && endian != "native" && !endian.empty()) {
        return wrong(fmt::format("Endian is '{}', must be Big, Little or Native", Printable(endian)));
      }
      if (!compression.empty() && compression != "raw") {
        return wrong(fmt::format("Compression is '{}', which is not supported; supported: Raw", Printable(compression)));
      }
      item.seek = *bytes;
      item.big_endian = endian == "big";
    } else {
      return wrong(fmt::format("Format '{}' is not supported; supported: XML, HDF and Binary", Printable(format)));
    }
    if (file.empty()) return wrong("names no file");
    item.file = (std::filesystem::path(document_.path()).parent_path() / file).string();
    return item;
  }

  // The first item has the start, the stride and the count along each axis of the second.
  Result<XdmfItem> ParseBox(const XdmfElement& element, int depth) {
    const std::vector<const XdmfElement*> items = XdmfDocument::Children(element, "DataItem");
    if (items.size() != 2) return document_.Wrong(element, fmt::format("is a HyperSlab of {} items, must have 2", items.size()));
    Result<XdmfItem> item = Parse(*items[1], depth + 1);
    if (!item.ok()) return item;
    const Result<const XdmfElement*> selection = document_.Resolved(*items[0]);
    if (!selection.ok()) return selection.status();
    const std::size_t axes = item->size.size();
    const auto numbers = CountsInText((*selection)->text, 3 * axes);
    const auto wrong = [&](const std::string& why) {
      return document_.Wrong(element, fmt::format("its selection '{}' {}", Printable(std::string((*selection)->text)), why));
    };
    if (!numbers || numbers->size() != 3 * axes) return wrong(fmt::format("must be start, stride and count of {} axes", axes));
    for (std::size_t axis = 0; axis < axes; ++axis) {
      const std::uint64_t begin = (*numbers)[axis], stride = (*numbers)[axes + axis], count = (*numbers)[2 * axes + axis];
      if (stride != 1 && count != 1) return wrong(fmt::format("has a stride of {}, which is not supported; supported: 1", stride));
      if (count < 1 || begin > item->count[axis] || count > item->count[axis] - begin) {
        return wrong(fmt::format("reaches out of the {} elements along axis {}", item->count[axis], axis));
      }
      item->begin[axis] += begin;
      item->count[axis] = count;
    }
    item->named = document_.Named(element);
    return item;
  }

  XdmfDocument& document_;
};

// All numbers of an item that is text.
Result<std::vector<double>> ReadText(const XdmfItem& item) {
  const std::uint64_t elements = ProductOf(item.size);
  auto numbers = NumbersInText(item.text, std::min<std::uint64_t>(elements, kMostTextNumbers));
  if (numbers && numbers->size() == elements) return *std::move(numbers);
  return Status::InvalidArgument(
      fmt::format("{}: its text must be {} numbers, of which up to {} are read", item.named, elements, kMostTextNumbers));
}

Result<std::shared_ptr<ChunkedArray>> OpenText(const XdmfItem& item) {
  const Result<std::vector<double>> numbers = ReadText(item);
  if (!numbers.ok()) return numbers.status();
  AlignedVector<std::byte> bytes(numbers->size() * sizeof(double));
  std::ranges::copy(std::as_bytes(std::span(*numbers)), bytes.begin());
  return MakeHeldArray(
      {.size = item.size, .chunk = item.size, .type = SampleType::kFloat64, .fill = std::vector<std::byte>(sizeof(double))},
      Bytes(std::move(bytes)));
}

Result<std::shared_ptr<ChunkedArray>> OpenInFile(const XdmfItem& item, const SourceContext& context) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(item.file, error)) {
    return Status::NotFound(fmt::format("{}: samples in {}: no such file", item.named, item.file));
  }
  if (item.format == XdmfItem::Format::kBinary) {
    if (!item.type) return Status::InvalidArgument(fmt::format("{}: NumberType '{}' is not supported", item.named, item.type_name));
    const std::int64_t bytes = std::int64_t(ProductOf(item.size) * BytesPerSample(*item.type));
    if (Status status = CheckHolds({.file = item.file, .offset = std::int64_t(item.seek)}, bytes); !status.ok()) return status;
    ArrayShape shape{.size = item.size, .type = *item.type, .fill = std::vector<std::byte>(BytesPerSample(*item.type))};
    return MakePlainArray(item.file, item.file, std::move(shape), {.begin = item.seek, .big_endian = item.big_endian}, context);
  }
  const Result<std::shared_ptr<Hdf5File>> file = Hdf5File::Open(item.file);
  if (!file.ok()) return file.status();
  Result<std::shared_ptr<Hdf5Dataset>> dataset = (*file)->Dataset(item.dataset);
  if (!dataset.ok()) return dataset.status();
  if (!MatchAxes((*dataset)->size(), item.size)) {
    return Status::InvalidArgument(fmt::format("{}: Dimensions say {}, but {} is of {}", item.named, fmt::join(item.size, " x "),
                                               (*file)->Named(item.dataset), fmt::join((*dataset)->size(), " x ")));
  }
  return MakeHdf5Array(*std::move(dataset), context);
}

}  // namespace

std::uint64_t XdmfItem::elements() const { return ProductOf(count); }

std::optional<std::vector<double>> NumbersInText(std::string_view text, std::size_t most) { return WordsOf<double>(text, most); }
std::optional<std::vector<std::uint64_t>> CountsInText(std::string_view text, std::size_t most) {
  return WordsOf<std::uint64_t>(text, most);
}

std::optional<std::vector<int>> MatchAxes(std::span<const std::uint64_t> sizes, std::span<const std::uint64_t> wanted) {
  std::vector<int> axes;
  std::size_t next = 0;
  const auto skip = [&] {
    while (next < sizes.size() && sizes[next] == 1) ++next;
  };
  for (const std::uint64_t size : wanted) {
    if (size > 1) skip();
    const bool there = next < sizes.size() && sizes[next] == size;
    if (!there && size > 1) return std::nullopt;
    axes.push_back(there ? int(next++) : -1);
  }
  skip();
  return next == sizes.size() ? std::optional(std::move(axes)) : std::nullopt;
}

Result<XdmfItem> ParseXdmfItem(XdmfDocument& document, const XdmfElement& element) { return ItemParser(document).Parse(element, 0); }

Result<std::shared_ptr<ChunkedArray>> XdmfArrays::Open(const XdmfItem& item) {
  if (item.format == XdmfItem::Format::kText) return OpenText(item);
  const Key key(item.file, item.dataset, item.seek, item.big_endian, item.type_name, item.size);
  const std::lock_guard lock(mutex_);
  if (const auto found = held_.find(key); found != held_.end()) return found->second;
  Result<std::shared_ptr<ChunkedArray>> array = OpenInFile(item, context_);
  if (!array.ok()) return array;
  if (held_.size() == kMostHeld) held_.clear();
  held_.emplace(key, *array);
  return array;
}

ArrayBox XdmfArrays::BoxIn(const ArrayShape& shape, const XdmfItem& item) {
  const std::vector<int> axes = *MatchAxes(shape.size, item.size);
  ArrayBox box{std::vector<std::uint64_t>(shape.size.size(), 0), std::vector<std::uint64_t>(shape.size.size(), 1)};
  for (std::size_t i = 0; i < axes.size(); ++i) {
    if (axes[i] < 0) continue;
    box.begin[std::size_t(axes[i])] = item.begin[i];
    box.count[std::size_t(axes[i])] = item.count[i];
  }
  return box;
}

Status XdmfArrays::TooMany(const XdmfItem& item, std::uint64_t most) {
  return Status::InvalidArgument(fmt::format("{}: is of {} numbers, must be at most {}", item.named, fmt::join(item.count, " x "), most));
}

}  // namespace slabstream
