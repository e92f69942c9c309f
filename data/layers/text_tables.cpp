// Colour tables that are text, a line for each label. What shows is up to the request, so opacity and the like do not count here.
#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/base/status.h"
#include "common/text/parse_number.h"
#include "data/layers/color_table.h"

namespace slabstream {
namespace {

constexpr std::string_view kSpace = " \t\r";
constexpr std::size_t kShownBytes = 40;

std::string Shown(std::string_view word) { return std::string(word.substr(0, kShownBytes)); }

// Such a table line by line. What is behind a '#' and empty lines do not count.
class TableLines {
 public:
  explicit TableLines(std::string_view text) : rest_(text) {}

  // False at the end.
  bool Next() {
    while (!rest_.empty()) {
      const std::size_t end = std::min(rest_.find('\n'), rest_.size());
      line_ = rest_.substr(0, std::min(end, rest_.find('#')));
      rest_.remove_prefix(std::min(end + 1, rest_.size()));
      ++number_;
      words_.clear();
      for (std::size_t at = line_.find_first_not_of(kSpace); at < line_.size(); at = line_.find_first_not_of(kSpace, at)) {
        const std::size_t behind = std::min(line_.find_first_of(kSpace, at), line_.size());
        words_.push_back(line_.substr(at, behind - at));
        at = behind;
      }
      if (!words_.empty()) return true;
    }
    return false;
  }

  const std::vector<std::string_view>& words() const { return words_; }

  // The line's text from word `first` on, without quotation marks around it.
  std::string From(std::size_t first) const {
    if (first >= words_.size()) return "";
    std::string_view text = line_.substr(std::size_t(words_[first].data() - line_.data()));
    text = text.substr(0, text.find_last_not_of(kSpace) + 1);
    if (text.size() >= 2 && text.front() == '"' && text.back() == '"') text = text.substr(1, text.size() - 2);
    return std::string(text);
  }

  // InvalidArgument, naming the line.
  Status Wrong(const std::string& why) const { return Status::InvalidArgument(fmt::format("line {}: {}", number_, why)); }

  // The value of a label.
  Result<std::uint64_t> Value(std::size_t word) const {
    const auto value = ParseNumber<std::uint64_t>(words_.at(word));
    if (value) return *value;
    return Wrong(fmt::format("the label '{}' is not a whole number of at least 0", Shown(words_[word])));
  }

  // The colour that words `first` to `first` + 2 state, each in [0, greatest].
  Result<LabelColor> Color(std::size_t first, float greatest) const {
    LabelColor color{};
    for (std::size_t i = 0; i < color.size(); ++i) {
      const std::string_view word = words_.at(first + i);
      const auto channel = ParseNumber<float>(word);
      if (!channel || !(*channel >= 0 && *channel <= greatest)) {
        return Wrong(fmt::format("the colour '{}' is not a number in [0, {:g}]", Shown(word), greatest));
      }
      color.at(i) = *channel / greatest;
    }
    return color;
  }

  // Adds the line's label: its value is the first word, its colour the three from `color_word` on, each in [0, greatest]. InvalidArgument:
  // of Value or Color, or there is one of this value already, or there are too many.
  Status AddLabel(ColorTable& table, std::size_t color_word, float greatest, std::string name) const {
    const Result<std::uint64_t> value = Value(0);
    if (!value.ok()) return value.status();
    const Result<LabelColor> color = Color(color_word, greatest);
    if (!color.ok()) return color.status();
    if (!table.entries.emplace(*value, ColorTable::Entry{*color, std::move(name)}).second) {
      return Wrong(fmt::format("label {} is given before", *value));
    }
    if (table.entries.size() > kMaxColorTableEntries) return Wrong(fmt::format("more than {} labels", kMaxColorTableEntries));
    return Status::Ok();
  }

 private:
  std::string_view rest_, line_;
  std::vector<std::string_view> words_;
  int number_ = 0;
};

// The words of the first line that has any. Empty: there is none, or the text has bytes that no text has.
std::vector<std::string_view> FirstWords(std::string_view text) {
  if (text.find('\0') != std::string_view::npos) return {};
  TableLines lines(text);
  return lines.Next() ? lines.words() : std::vector<std::string_view>();
}

bool IsNumber(std::string_view word) { return ParseNumber<double>(word).has_value(); }

// Whether the first `count` words of the first line are numbers.
bool BeginsWithNumbers(const std::vector<std::string_view>& words, std::size_t count) {
  return words.size() >= count && std::all_of(words.begin(), words.begin() + std::ptrdiff_t(count), IsNumber);
}

// `line`: what a line must be, of `least` words or more. The colour stands in three words from `color` on, each number in [0, greatest],
// the name in the word `name`, or from there to the end.
Result<ColorTable> ReadLines(std::string_view file, const char* line, std::size_t least, std::size_t color, float greatest,
                             std::size_t name, bool one_word = false) {
  ColorTable table;
  for (TableLines lines(file); lines.Next();) {
    if (lines.words().size() < least) return lines.Wrong(fmt::format("must be {}", line));
    const Status added = lines.AddLabel(table, color, greatest, one_word ? std::string(lines.words()[name]) : lines.From(name));
    if (!added.ok()) return added;
  }
  return table;
}

}  // namespace

// The .lut of FSLeyes: value, red, green and blue in [0, 1], and the name, which may be left out.
ColorTableFormat FslLut() {
  constexpr std::size_t kNumbers = 4;
  return {.name = "FSLeyes LUT",
          .recognises =
              [](std::string_view file) {
                const auto words = FirstWords(file);
                return BeginsWithNumbers(words, kNumbers) && !BeginsWithNumbers(words, kNumbers + 1);
              },
          .read = [](std::string_view file) { return ReadLines(file, "VALUE RED GREEN BLUE NAME", kNumbers, 1, 1, kNumbers); }};
}

// FreeSurferColorLUT.txt and its like: value, name without spaces, and red, green, blue and transparency, which may be left out, in
// [0, 255].
ColorTableFormat FreeSurferLut() {
  return {.name = "FreeSurfer colour LUT",
          .recognises =
              [](std::string_view file) {
                const auto words = FirstWords(file);
                return words.size() >= 5 && IsNumber(words[0]) && !IsNumber(words[1]) && std::all_of(&words[2], &words[2] + 3, IsNumber);
              },
          .read = [](std::string_view file) { return ReadLines(file, "VALUE NAME RED GREEN BLUE TRANSPARENCY", 5, 2, 255, 1, true); }};
}

// Label descriptions of ITK-SNAP: value, red, green and blue in [0, 255], opacity, whether it shows, whether its mesh shows, and the name
// in quotation marks.
ColorTableFormat ItkSnapLabels() {
  constexpr std::size_t kNumbers = 7;
  return {.name = "ITK-SNAP label descriptions",
          .recognises =
              [](std::string_view file) {
                const auto words = FirstWords(file);
                return words.size() > kNumbers && words[kNumbers].starts_with('"') && BeginsWithNumbers(words, kNumbers);
              },
          .read =
              [](std::string_view file) {
                return ReadLines(file, "VALUE RED GREEN BLUE OPACITY VISIBLE MESH \"NAME\"", kNumbers + 1, 1, 255, kNumbers);
              }};
}

}  // namespace slabstream
