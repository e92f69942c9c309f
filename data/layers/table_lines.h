// TableLines: colour tables that are text, line by line. What is behind a '#' and empty lines do not count.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/status.h"
#include "data/layers/color_table.h"

namespace slabstream {

class TableLines {
 public:
  explicit TableLines(std::string_view text) : rest_(text) {}

  // False at the end.
  bool Next();
  int number() const { return number_; }  // the line's number, from 1
  const std::vector<std::string_view>& words() const { return words_; }
  // The line's text from word `first` on, without quotation marks around it.
  std::string From(std::size_t first) const;

  // InvalidArgument, naming the line.
  Status Wrong(const std::string& why) const;
  // The value of a label: a whole number in [0, kMaxLabelValue].
  Result<std::uint32_t> Value(std::size_t word) const;
  // The colour that words `first` to `first` + 2 state, each in [0, greatest].
  Result<LabelColor> Color(std::size_t first, float greatest) const;
  // Adds the line's label: its value is the first word, its colour the three from `color_word` on, each in [0, greatest]. InvalidArgument:
  // of Value or Color, or there is one of this value already, or there are too many.
  Status AddLabel(ColorTable& table, std::size_t color_word, float greatest, std::string name) const;

 private:
  std::string_view rest_, line_;
  std::vector<std::string_view> words_;
  int number_ = 0;
};

// The words of the first line that has any. Empty: there is none, or the text has bytes that no text has.
std::vector<std::string_view> FirstWords(std::string_view text);
bool IsNumber(std::string_view word);

}  // namespace slabstream
