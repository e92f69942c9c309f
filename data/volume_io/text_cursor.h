// Reads a file with text in it, or a stretch of one, word by word. It keeps a block of the file.
#pragma once

#include <cstddef>
#include <cstdint>
#include <fstream>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "data/volume_io/sample_type.h"

namespace slabstream {

class TextCursor {
 public:
  // From byte `begin` of the file to `end`, or to its end.
  explicit TextCursor(const std::string& path, std::int64_t begin = 0, std::int64_t end = std::int64_t{1} << 62);

  bool is_open() const { return file_.is_open(); }
  std::int64_t offset() const { return offset_; }  // where the byte that is read next is
  void GoTo(std::int64_t offset);

  std::optional<char> Next();
  // Bytes as they are. How many there were, at most out.size().
  std::size_t Read(std::span<std::byte> out);
  // Nothing at the end of the file, or if there are more than kMostLetters.
  std::optional<std::string> Word();
  std::optional<std::string> Line();  // without its line feed
  static constexpr std::size_t kMostLetters = 4096;

 private:
  std::ifstream file_;
  std::int64_t offset_ = 0, end_ = 0;
  std::vector<char> block_;
  std::size_t at_ = 0;
};

// Fills `out` with the numbers that follow, as samples of `type`. DataLoss: there are fewer, or one is no number of this type.
Status ReadTextSamples(TextCursor& cursor, SampleType type, std::span<std::byte> out);

}  // namespace slabstream
