#include "common/volume_io/text_header.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <fstream>
#include <sstream>

#include "common/base/parse_number.h"
#include "common/volume_io/raw_volume.h"

namespace slabstream {
namespace {

std::string Trimmed(const std::string& text) {
  constexpr const char* kBlanks = " \t\r\n";
  const std::size_t begin = text.find_first_not_of(kBlanks);
  return begin == std::string::npos ? "" : text.substr(begin, text.find_last_not_of(kBlanks) - begin + 1);
}

}  // namespace

std::optional<std::string> TextHeader::Find(std::initializer_list<const char*> keys) const {
  for (const char* key : keys) {
    if (const auto found = fields.find(key); found != fields.end()) return found->second;
  }
  return std::nullopt;
}

std::optional<std::vector<double>> TextHeader::Numbers(std::initializer_list<const char*> keys, std::size_t count,
                                                       std::vector<double> if_absent) const {
  std::optional<std::string> text = Find(keys);
  if (!text) return if_absent;
  std::replace_if(
      text->begin(), text->end(), [](char c) { return c == '(' || c == ')' || c == ','; }, ' ');
  std::istringstream words(*text);
  std::vector<double> numbers;
  for (std::string word; words >> word;) {
    if (word == "none") continue;
    const std::optional<double> number = ParseNumber<double>(std::string_view(word).substr(word.size() > 1 && word[0] == '+' ? 1 : 0));
    if (!number) return std::nullopt;
    numbers.push_back(*number);
  }
  return numbers.size() == count ? std::optional(numbers) : std::nullopt;
}

Result<Index3> ToSize(const std::string& path, const std::vector<double>& sides) {
  std::array<std::int64_t, 3> size{};
  for (std::size_t i = 0; i < size.size(); ++i) {
    const double side = sides[i];
    size[i] = side >= 1 && side <= 1e15 && side == double(std::int64_t(side)) ? std::int64_t(side) : 0;
  }
  if (Status status = CheckSize(path, size); !status.ok()) return status;
  return Index3{std::int32_t(size[0]), std::int32_t(size[1]), std::int32_t(size[2])};
}

Result<TextHeader> ReadTextHeader(const std::string& path, char separator, KeyCase key_case, const std::string& last_key) {
  std::ifstream file(path, std::ios::binary);
  if (!file) return Status::NotFound(path + ": cannot be opened for reading");
  // Limits what is read, so that a large binary file is never taken for one endless line.
  std::string text(kMaxTextHeader, '\0');
  file.read(text.data(), std::streamsize(text.size()));
  text.resize(std::size_t(file.gcount()));

  TextHeader header;
  std::size_t begin = 0;
  while (begin < text.size()) {
    const std::size_t newline = text.find('\n', begin);
    if (newline == std::string::npos && text.size() == kMaxTextHeader) {
      return Status::InvalidArgument(path + ": the header is longer than " + std::to_string(kMaxTextHeader) + " bytes");
    }
    const std::string line = Trimmed(text.substr(begin, newline - begin));
    begin = newline == std::string::npos ? text.size() : newline + 1;
    if (header.end == 0) header.first_line = line;
    header.end = std::int64_t(begin);
    if (line.empty()) break;
    const std::size_t at = line.find(separator);
    if (line.front() == '#' || at == std::string::npos) continue;
    const std::string written = Trimmed(line.substr(0, at));
    const std::string key = key_case == KeyCase::kLower ? ToLower(written) : written;
    header.fields.emplace(key, Trimmed(line.substr(at + 1)));
    if (key == last_key) break;
  }
  return header;
}

std::optional<std::int64_t> ToInteger(const std::string& text) { return ParseNumber<std::int64_t>(text); }

std::string ToLower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return char(std::tolower(c)); });
  return text;
}

}  // namespace slabstream
