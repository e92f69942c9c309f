#include "data/volume_io/text_header.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "common/base/parse_number.h"
#include "common/base/trimmed.h"

namespace slabstream {
namespace {

constexpr std::size_t kMaxHeader = std::size_t{1} << 20;  // bytes

Result<TextHeader> ReadTextHeader(const std::string& path, const TextFormat& format) {
  std::ifstream file(path, std::ios::binary);
  if (!file) return Status::NotFound(path + ": cannot be opened for reading");
  // Limits what is read, so that a large binary file is never taken for one endless line.
  std::string text(kMaxHeader, '\0');
  file.read(text.data(), std::streamsize(text.size()));
  text.resize(std::size_t(file.gcount()));

  TextHeader header{.path = path, .format = format.name};
  std::size_t begin = 0;
  while (begin < text.size()) {
    const std::size_t newline = text.find('\n', begin);
    if (newline == std::string::npos && text.size() == kMaxHeader) {
      return header.Refused(fmt::format("the header is longer than {} bytes", kMaxHeader));
    }
    const std::string line(Trimmed(text.substr(begin, newline - begin)));
    begin = newline == std::string::npos ? text.size() : newline + 1;
    if (header.end == 0) header.first_line = line;
    header.end = std::int64_t(begin);
    if (line.empty()) break;
    const std::size_t at = line.find(format.separator);
    if (line.front() == '#' || at == std::string::npos) continue;
    const std::string written(Trimmed(line.substr(0, at))), key = format.ignores_case ? ToLower(written) : written;
    header.fields.emplace(key, Trimmed(line.substr(at + 1)));
    if (key == format.last_key) break;
  }
  if (!header.first_line.starts_with(format.first_line))
    return header.NotAVolume("the first line does not begin with " + format.first_line);
  for (const char* key : format.required) {
    if (header.Find(key).value_or("").empty()) return header.NotAVolume(std::string(key) + " is missing");
  }
  return header;
}

}  // namespace

std::optional<std::string> TextHeader::Find(std::initializer_list<const char*> keys) const {
  for (const char* key : keys) {
    if (const auto found = fields.find(key); found != fields.end()) return found->second;
  }
  return std::nullopt;
}

Result<std::vector<double>> TextHeader::Numbers(std::initializer_list<const char*> keys, std::size_t count,
                                                std::vector<double> if_absent) const {
  const std::optional<std::string> value = Find(keys);
  if (!value) return if_absent;
  std::string text = *value;
  std::ranges::replace_if(
      text, [](char c) { return c == '(' || c == ')' || c == ','; }, ' ');
  std::istringstream words(text);
  std::vector<double> numbers;
  bool all = true;
  for (std::string word; words >> word;) {
    if (word == "none") continue;
    const std::optional<double> number = ParseNumber<double>(std::string_view(word).substr(word.size() > 1 && word[0] == '+' ? 1 : 0));
    all = all && number;
    numbers.push_back(number.value_or(0));
  }
  if (all && numbers.size() == count) return numbers;
  return NotAVolume(fmt::format("{} is '{}', must be {} numbers", *keys.begin(), *value, count));
}

Result<std::vector<double>> TextHeader::Sizes(const char* dimension, const char* sizes) const {
  constexpr std::size_t kMost = 16;  // NRRD's limit. What lies behind the third is read to be reported, unless it is 1.
  const std::string value = Find(dimension).value_or("");
  const std::size_t count = ParseNumber<std::size_t>(value).value_or(0);
  if (count < 1 || count > kMost) return NotAVolume(fmt::format("{} is '{}', must be 3", dimension, value));
  return Numbers({sizes}, count, {});
}

Result<Payload> TextHeader::PayloadIn(const std::optional<std::string>& name) const {
  if (!name) return Payload{.file = path, .offset = end};
  if (name->starts_with("LIST") || name->find('%') != std::string::npos) {
    return Refused("data file '" + *name + "': samples in several files are not supported");
  }
  return Payload{.file = std::filesystem::path(path).parent_path() / *name};  // an absolute name stays as it is
}

Result<std::int64_t> TextHeader::BytesToSkip(const char* key, const std::string& value, const Payload& payload,
                                             std::int64_t sample_bytes) const {
  constexpr std::int64_t kMost = std::int64_t{1} << 62;  // longer than any file
  const std::optional<std::int64_t> bytes = ParseNumber<std::int64_t>(value);
  if (!bytes || *bytes < -1) return Refused(fmt::format("{} is '{}', must be at least -1", key, value));
  if (*bytes >= 0) return std::min(*bytes, kMost);
  std::error_code error;
  const auto file_bytes = std::filesystem::file_size(payload.file, error);
  if (error) return Status::NotFound(fmt::format("{}: samples in {}: {}", path, payload.file.string(), error.message()));
  return std::max<std::int64_t>(std::int64_t(file_bytes) - payload.offset - sample_bytes, 0);
}

Result<LocatedSamples> LocateInTextVolume(const std::string& path, const TextFormat& format, const ReadOptions& options) {
  const Result<TextHeader> text = ReadTextHeader(path, format);
  if (!text.ok()) return text.status();
  Result<RawHeader> header = format.read_header(*text, options);
  if (!header.ok()) return header.status();
  Result<Payload> payload = format.find_payload(*text, header->sample_bytes());
  if (!payload.ok()) return payload.status();
  return LocatedSamples{*std::move(header), *std::move(payload)};
}

std::string ToLower(std::string text) {
  std::ranges::transform(text, text.begin(), [](unsigned char c) { return char(std::tolower(c)); });
  return text;
}

}  // namespace slabstream
