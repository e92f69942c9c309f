#include "data/layers/table_lines.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "common/text/parse_number.h"

namespace slabstream {
namespace {

constexpr std::string_view kSpace = " \t\r";
constexpr std::size_t kShownBytes = 40;

std::string Shown(std::string_view word) { return std::string(word.substr(0, kShownBytes)); }

}  // namespace

bool TableLines::Next() {
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

std::string TableLines::From(std::size_t first) const {
  if (first >= words_.size()) return "";
  std::string_view text = line_.substr(std::size_t(words_[first].data() - line_.data()));
  text = text.substr(0, text.find_last_not_of(kSpace) + 1);
  if (text.size() >= 2 && text.front() == '"' && text.back() == '"') text = text.substr(1, text.size() - 2);
  return std::string(text);
}

Status TableLines::Wrong(const std::string& why) const { return Status::InvalidArgument(fmt::format("line {}: {}", number_, why)); }

Result<std::uint32_t> TableLines::Value(std::size_t word) const {
  const auto value = ParseNumber<std::uint32_t>(words_.at(word));
  if (value && *value <= kMaxLabelValue) return *value;
  return Wrong(fmt::format("the label '{}' is not a whole number in [0, {}]", Shown(words_[word]), kMaxLabelValue));
}

Result<LabelColor> TableLines::Color(std::size_t first, float greatest) const {
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

Status TableLines::AddLabel(ColorTable& table, std::size_t color_word, float greatest, std::string name) const {
  const Result<std::uint32_t> value = Value(0);
  if (!value.ok()) return value.status();
  const Result<LabelColor> color = Color(color_word, greatest);
  if (!color.ok()) return color.status();
  if (!table.entries.emplace(*value, ColorTable::Entry{*color, std::move(name)}).second) {
    return Wrong(fmt::format("label {} is given before", *value));
  }
  if (table.entries.size() > kMaxColorTableEntries) return Wrong(fmt::format("more than {} labels", kMaxColorTableEntries));
  return Status::Ok();
}

std::vector<std::string_view> FirstWords(std::string_view text) {
  if (text.find('\0') != std::string_view::npos) return {};
  TableLines lines(text);
  return lines.Next() ? lines.words() : std::vector<std::string_view>();
}

bool IsNumber(std::string_view word) { return ParseNumber<double>(word).has_value(); }

}  // namespace slabstream
