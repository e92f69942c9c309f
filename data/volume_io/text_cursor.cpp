#include "data/volume_io/text_cursor.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string_view>
#include <type_traits>

#include "common/text/parse_number.h"

namespace slabstream {
namespace {

constexpr std::size_t kBlock = std::size_t{1} << 16;  // bytes

bool IsBlank(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

// Programs compute in double and print what they call float: a number that is too small for one is 0.
template <class T>
std::optional<T> ParseSample(std::string_view text) {
  if constexpr (std::is_same_v<T, float>) {
    const std::optional<double> number = ParseNumber<double>(text);
    if (!number || (std::isfinite(*number) && std::abs(*number) > double{std::numeric_limits<float>::max()})) return std::nullopt;
    return float(*number);
  } else if constexpr (std::is_same_v<T, Half>) {
    const std::optional<double> number = ParseNumber<double>(text);
    return number ? std::optional(Half(*number)) : std::nullopt;
  } else {
    return ParseNumber<T>(text);
  }
}

}  // namespace

TextCursor::TextCursor(const std::string& path, std::int64_t begin, std::int64_t end) : file_(path, std::ios::binary), end_(end) {
  GoTo(begin);
}

void TextCursor::GoTo(std::int64_t offset) {
  file_.clear();
  file_.seekg(offset);
  offset_ = offset;
  block_.clear();
  at_ = 0;
}

std::optional<char> TextCursor::Next() {
  if (at_ == block_.size()) {
    block_.resize(std::size_t(std::clamp<std::int64_t>(end_ - offset_, 0, std::int64_t{kBlock})));
    file_.read(block_.data(), std::streamsize(block_.size()));
    block_.resize(std::size_t(file_.gcount()));
    at_ = 0;
    if (block_.empty()) return std::nullopt;
  }
  ++offset_;
  return block_[at_++];
}

std::size_t TextCursor::Read(std::span<std::byte> out) {
  const std::size_t kept = std::min(out.size(), block_.size() - at_);
  std::ranges::copy(std::as_bytes(std::span(block_).subspan(at_, kept)), out.begin());
  at_ += kept;
  offset_ += std::int64_t(kept);
  const auto rest = std::min<std::int64_t>(std::int64_t(out.size() - kept), std::max<std::int64_t>(end_ - offset_, 0));
  if (rest == 0) return kept;
  file_.read(reinterpret_cast<char*>(out.data() + kept), std::streamsize(rest));
  offset_ += file_.gcount();
  return kept + std::size_t(file_.gcount());
}

std::optional<std::string> TextCursor::Word() {
  std::string word;
  while (const std::optional<char> c = Next()) {
    if (!IsBlank(*c)) {
      word += *c;
    } else if (!word.empty()) {
      // The blank is read next, so that the end of a line stays to be found.
      --offset_;
      --at_;
      return word;
    }
    if (word.size() > kMostLetters) return std::nullopt;
  }
  return word.empty() ? std::nullopt : std::optional(word);
}

std::optional<std::string> TextCursor::Line() {
  std::string line;
  bool any = false;
  while (const std::optional<char> c = Next()) {
    any = true;
    if (*c == '\n') break;
    line += *c;
    if (line.size() > kMostLetters) return std::nullopt;
  }
  if (line.ends_with('\r')) line.pop_back();
  return any ? std::optional(line) : std::nullopt;
}

Status ReadTextSamples(TextCursor& cursor, SampleType type, std::span<std::byte> out) {
  return VisitSampleType(type, [&]<class T>(const T*) -> Status {
    const std::span samples(reinterpret_cast<T*>(out.data()), out.size() / sizeof(T));
    for (std::size_t i = 0; i < samples.size(); ++i) {
      const std::optional<std::string> word = cursor.Word();
      if (!word) return Status::DataLoss(fmt::format("truncated: has {} of {} samples", i, samples.size()));
      const std::optional<T> number = ParseSample<T>(std::string_view(*word).substr(word->starts_with('+') ? 1 : 0));
      if (!number) return Status::DataLoss(fmt::format("sample {} is '{}', must be a number of type {}", i, *word, ToString(type)));
      samples[i] = *number;
    }
    return Status::Ok();
  });
}

}  // namespace slabstream
