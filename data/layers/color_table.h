// Colour tables of labels, as other programs write them. ColorTableFormats() is the only list; a new format is a file that defines its
// ColorTableFormat, and its line there. A table is a small file: it is read as a whole, within a limit, and recognised by what is in it.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/status.h"
#include "common/volume/labels.h"

namespace slabstream {

inline constexpr std::size_t kMaxColorTableBytes = std::size_t{4} << 20;
inline constexpr std::size_t kMaxColorTableEntries = std::size_t{1} << 16;

struct ColorTable {
  struct Entry {
    LabelColor color{};
    std::string name = {};  // "": none
    friend bool operator==(const Entry&, const Entry&) = default;
  };
  std::map<std::uint64_t, Entry> entries;  // by the value of a label; that of 0, no label, does not matter
  // Colours for labels without an entry: for the values 1, 2, 3 and so on, over and over again.
  std::vector<LabelColor> sequence = {};
  friend bool operator==(const ColorTable&, const ColorTable&) = default;
};

struct ColorTableFormat {
  std::string_view name;                      // "ITK-SNAP"
  bool (*recognises)(std::string_view file);  // by the bytes of a file
  // InvalidArgument: what is wrong, and in which line.
  Result<ColorTable> (*read)(std::string_view file);
};
const std::vector<ColorTableFormat>& ColorTableFormats();

// `file`: the bytes of a file; `path` begins messages. InvalidArgument, one line: of no known format, or damaged.
Result<ColorTable> ParseColorTable(std::string_view file, const std::string& path);
// NotFound: no such file; ResourceExhausted: longer than kMaxColorTableBytes; InvalidArgument as of ParseColorTable.
Result<ColorTable> ReadColorTable(const std::string& path);

}  // namespace slabstream
