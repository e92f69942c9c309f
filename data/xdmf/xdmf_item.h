// DataItem: an array, or a box of one, and where its numbers are: in the XML, in an HDF5 file or in a binary file beside it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include "common/base/status.h"
#include "data/sources/array_numbers.h"
#include "data/sources/chunked_array.h"
#include "data/sources/read_context.h"
#include "data/xdmf/xdmf_document.h"

namespace slabstream {

// What the XML says of an item.
struct XdmfItem {
  enum class Format : std::uint8_t { kText, kHdf5, kBinary };

  std::string named;                // "a.xmf: DataItem 'p'"
  std::vector<std::uint64_t> size;  // of the whole array, each at least 1; 1 to kMaxArrayAxes axes, the slowest first
  // The box of it, along each axis.
  std::vector<std::uint64_t> begin, count;
  Format format = Format::kText;
  std::string_view text = {};           // kText: of the document
  std::string file = {};                // else: its path
  std::string dataset = {};             // kHdf5
  std::optional<SampleType> type = {};  // none: it is not supported. Of HDF5, the file says it
  std::string type_name = {};           // as the XML has it
  std::uint64_t seek = 0;               // kBinary: bytes of the file before it
  bool big_endian = false;

  std::uint64_t elements() const;  // of the box
};

// Opens no other file. InvalidArgument: the item makes no sense or is of a kind that is not supported; the message names it. Errors of
// XdmfDocument::Resolved.
Result<XdmfItem> ParseXdmfItem(XdmfDocument& document, const XdmfElement& element);

// The arrays of items. It holds the last ones, since pieces of a volume are often boxes of one array. Any thread.
class XdmfArrays {
 public:
  explicit XdmfArrays(SourceContext context) : context_(std::move(context)) {}

  const SourceContext& context() const { return context_; }

  // The array, of the item's size but for axes of one element. NotFound: a file is not there. DataLoss: it is too short, or damaged.
  // InvalidArgument: it is no such array.
  Result<std::shared_ptr<ChunkedArray>> Open(const XdmfItem& item);

  // The numbers in the box, the last axis fastest. Errors of Open; InvalidArgument: there are more than `most`. Waits.
  template <class T>
  Result<AlignedVector<T>> ReadNumbers(const XdmfItem& item, std::uint64_t most) {
    if (item.elements() > most) return TooMany(item, most);
    const Result<std::shared_ptr<ChunkedArray>> array = Open(item);
    if (!array.ok()) return array.status();
    return slabstream::ReadNumbers<T>(item.named, *array, BoxIn((*array)->shape(), item));
  }

 private:
  // The item's box, by the axes of its array.
  static ArrayBox BoxIn(const ArrayShape& shape, const XdmfItem& item);
  static Status TooMany(const XdmfItem& item, std::uint64_t most);

  const SourceContext context_;
  // File, dataset, seek, byte order, type and size: what an item says of its array.
  using Key = std::tuple<std::string, std::string, std::uint64_t, bool, std::string, std::vector<std::uint64_t>>;
  std::mutex mutex_;                                   // guards what follows
  std::map<Key, std::shared_ptr<ChunkedArray>> held_;  // at most kMostHeld
};

// Numbers with blanks between them. nullopt: there is anything else, or more than `most`.
std::optional<std::vector<double>> NumbersInText(std::string_view text, std::size_t most);
// The same of whole numbers from 0 on.
std::optional<std::vector<std::uint64_t>> CountsInText(std::string_view text, std::size_t most);

// For each of `wanted` the axis of `sizes` that has it, in the same order; axes of one element may be left out on both sides, and are -1
// then. nullopt: they are not the same.
std::optional<std::vector<int>> MatchAxes(std::span<const std::uint64_t> sizes, std::span<const std::uint64_t> wanted);

}  // namespace slabstream
