#include "data/volume_io/text_header.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>

#include "common/text/parse_number.h"
#include "common/text/trimmed.h"

namespace slabstream {
namespace {

constexpr std::size_t kMaxHeader = std::size_t{1} << 20;  // bytes
constexpr std::string_view kList = "LIST";

// Without blanks around them and empty ones.
std::vector<std::string> LinesOf(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) {
    if (std::string trimmed(Trimmed(line)); !trimmed.empty()) lines.push_back(std::move(trimmed));
  }
  return lines;
}

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
    if (line.empty() && !format.header_alone) break;
    const std::size_t at = line.find_first_of(format.separators);
    if (line.front() == '#' || at == std::string::npos) continue;
    const std::string written(Trimmed(line.substr(0, at)));
    std::string key = format.ignores_case ? ToLower(written) : written, value(Trimmed(line.substr(at + 1)));
    if (!format.key_value.empty() && line.compare(at, format.key_value.size(), format.key_value) == 0) key += format.key_value;
    const bool names_data = std::ranges::find(format.data_keys, key) != format.data_keys.end();
    if (names_data && value.starts_with(kList)) {
      header.list = LinesOf(text.substr(begin));
      begin = text.size();
    }
    header.fields.emplace(std::move(key), std::move(value));
    if (names_data && format.data_ends_header) break;
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

namespace {

// The names that a pattern such as "slice%03d.raw 0 99 1" stands for. InvalidArgument: it has another form, or stands for too many.
Result<std::vector<std::string>> NamesOfPattern(const TextHeader& text, const std::string& value, std::int64_t slices) {
  constexpr std::int64_t kMostFiles = 1 << 16;
  const auto wrong = [&] {
    return text.Refused(fmt::format(
        "data file '{}' must be NAME FIRST LAST STEP with one %d, such as %03d, in NAME, and stand for 1 to {} files", value, kMostFiles));
  };
  const std::size_t percent = value.find('%'), end = std::min(value.find_first_of(" \t", percent), value.size());
  const std::string name = value.substr(0, end);
  const std::size_t letter = name.find_first_not_of("0123456789", percent + 1);
  if (letter == std::string::npos || std::string_view("diu").find(name[letter]) == std::string_view::npos ||
      name.find('%', letter) != std::string::npos) {
    return wrong();
  }
  const std::string digits = name.substr(percent + 1, letter - percent - 1);
  const int width = digits.empty() ? 0 : ParseNumber<int>(digits).value_or(-1);
  std::vector<std::int64_t> numbers;
  std::istringstream words(value.substr(end));
  for (std::string word; words >> word && numbers.size() < 3;) {
    const std::optional<std::int32_t> number = ParseNumber<std::int32_t>(word);
    if (!number || *number < 0) return wrong();
    numbers.push_back(*number);
  }
  const std::int64_t first = numbers.empty() ? 1 : numbers[0], last = numbers.size() < 2 ? first + slices - 1 : numbers[1],
                     step = numbers.size() < 3 ? 1 : numbers[2];
  const std::int64_t count = step == 0 ? 0 : (last - first) / step + 1;
  if (width < 0 || width > 32 || count < 1 || count > kMostFiles || (last < first) != (step < 0)) return wrong();
  std::vector<std::string> names;
  for (std::int64_t i = 0; i < count; ++i) {
    const std::string number =
        digits.starts_with('0') ? fmt::format("{:0{}}", first + i * step, width) : fmt::format("{:{}}", first + i * step, width);
    names.push_back(name.substr(0, percent) + number + name.substr(letter + 1));
  }
  return names;
}

// Where the samples begin in each of their files, before anything is skipped.
Result<std::vector<PayloadPlace>> PlacesOf(const TextHeader& text, const TextPayload& payload) {
  if (!payload.file) return std::vector<PayloadPlace>{{text.path, text.end}};
  std::vector<std::string> names = {*payload.file};
  if (payload.file->starts_with(kList)) {
    names = text.list;
    if (names.empty()) return text.Refused("data file LIST: no names of files follow");
  } else if (payload.file->find('%') != std::string::npos) {
    Result<std::vector<std::string>> of_pattern = NamesOfPattern(text, *payload.file, payload.slices);
    if (!of_pattern.ok()) return of_pattern.status();
    names = *std::move(of_pattern);
  }
  std::vector<PayloadPlace> places;
  for (const std::string& name : names) places.push_back({std::filesystem::path(text.path).parent_path() / name});
  return places;
}

// Goes behind so many lines of the file. DataLoss: it has fewer. NotFound: no such file.
Status SkipLines(const TextHeader& text, std::int64_t lines, PayloadPlace& place) {
  std::ifstream file(place.file, std::ios::binary);
  if (!file) return Status::NotFound(fmt::format("{}: samples in {}: cannot be opened for reading", text.path, place.file.string()));
  file.seekg(place.offset);
  for (; lines > 0 && file; --lines) file.ignore(std::numeric_limits<std::streamsize>::max(), '\n');
  if (!file || file.eof())
    return Status::DataLoss(fmt::format("{}: samples in {}: has no more lines to skip", text.path, place.file.string()));
  place.offset = std::int64_t(file.tellg());
  return Status::Ok();
}

// The offset of the last `bytes` of a file. NotFound: no such file.
Result<std::int64_t> OffsetOfLast(const TextHeader& text, const std::filesystem::path& file, std::int64_t bytes) {
  std::error_code error;
  const auto file_bytes = std::filesystem::file_size(file, error);
  if (error) return Status::NotFound(fmt::format("{}: samples in {}: {}", text.path, file.string(), error.message()));
  return std::max<std::int64_t>(std::int64_t(file_bytes) - bytes, 0);
}

Result<Payload> PayloadOf(const TextHeader& text, const TextPayload& fields, std::int64_t all_bytes) {
  constexpr std::int64_t kMost = std::int64_t{1} << 62;  // longer than any file
  Result<std::vector<PayloadPlace>> places = PlacesOf(text, fields);
  if (!places.ok()) return places.status();
  const auto files = std::int64_t(places->size());
  if (all_bytes % files != 0) return text.Refused(fmt::format("{} bytes of samples do not divide into {} files", all_bytes, files));
  const std::optional<std::int64_t> lines = ParseNumber<std::int64_t>(fields.lines), bytes = ParseNumber<std::int64_t>(fields.bytes);
  if (!lines || *lines < 0) return text.Refused(fmt::format("{} is '{}', must be at least 0", fields.lines_key, fields.lines));
  const int least = fields.compression == Compression::kNone ? -1 : 0;
  if (!bytes || *bytes < least) {
    return text.Refused(fmt::format("{} is '{}', must be at least {}{}", fields.bytes_key, fields.bytes, least,
                                    least < 0 ? "" : " for compressed samples"));
  }
  for (PayloadPlace& place : *places) {
    if (*lines > 0) {
      if (Status status = SkipLines(text, *lines, place); !status.ok()) return status;
    }
    if (*bytes < 0) {
      const Result<std::int64_t> offset = OffsetOfLast(text, place.file, all_bytes / files);
      if (!offset.ok()) return offset.status();
      place.offset = *offset;
    } else {
      (fields.compression == Compression::kNone ? place.offset : place.skip) += std::min(*bytes, kMost);
    }
  }
  PayloadPlace& first = places->front();
  Payload payload{.file = std::move(first.file),
                  .offset = first.offset,
                  .skip = first.skip,
                  .compression = fields.compression,
                  .big_endian = fields.big_endian};
  payload.more.assign(places->begin() + 1, places->end());
  if (files > 1) payload.part_bytes = all_bytes / files;
  return payload;
}

}  // namespace

Result<LocatedSamples> LocateInTextVolume(const std::string& path, const TextFormat& format, const ReadOptions& options) {
  const Result<TextHeader> text = ReadTextHeader(path, format);
  if (!text.ok()) return text.status();
  Result<RawHeader> header = format.read_header(*text, options);
  if (!header.ok()) return header.status();
  const Result<TextPayload> fields = format.read_payload(*text);
  if (!fields.ok()) return fields.status();
  Result<Payload> payload = PayloadOf(*text, *fields, header->all_bytes());
  if (!payload.ok()) return payload.status();
  return LocatedSamples{*std::move(header), *std::move(payload)};
}

std::string ToLower(std::string text) {
  std::ranges::transform(text, text.begin(), [](unsigned char c) { return char(std::tolower(c)); });
  return text;
}

}  // namespace slabstream
