#include "client/cli/turntable_values.h"

#include <fmt/format.h>

#include "client/movie/movie_format.h"
#include "common/cli/parse.h"

namespace slabstream {

Result<FramePattern> FramePattern::Parse(std::string_view option, std::string_view text) {
  const auto refuse = [&](std::string_view why) {
    return Status::InvalidArgument(fmt::format("{} '{}' {}; it needs one number such as %04d", option, text, why));
  };
  FramePattern pattern;
  int conversions = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    std::string& side = conversions == 0 ? pattern.before_ : pattern.after_;
    if (text[i] != '%') {
      side += text[i];
      continue;
    }
    if (++i < text.size() && text[i] == '%') {
      side += '%';
      continue;
    }
    if (++conversions > 1) return refuse("has more than one conversion");
    pattern.zero_ = i < text.size() && text[i] == '0';
    const std::size_t digits = i;
    while (i < text.size() && text[i] >= '0' && text[i] <= '9') ++i;
    if (i == text.size() || (text[i] != 'd' && text[i] != 'i' && text[i] != 'u')) return refuse("has a conversion that is not an integer");
    if (i > digits) {
      const Result<int> width = ParseInteger(option, text.substr(digits, i - digits), 0, 20);
      if (!width.ok()) return width.status();
      pattern.width_ = *width;
    }
  }
  if (conversions == 0) return refuse("has no place for the frame's number");
  return pattern;
}

Result<TurntableOutput> ParseTurntableOutput(std::string_view option, std::string_view text) {
  TurntableOutput output;
  Result<FramePattern> pattern = FramePattern::Parse(option, text);
  if (MovieFormatOf(std::string(text)) != nullptr) {
    if (pattern.ok())
      return Status::InvalidArgument(fmt::format("{} '{}' has a place for a number, but a movie is one file", option, text));
    output.movie = text;
    return output;
  }
  if (!pattern.ok())
    return Status::InvalidArgument(fmt::format("{}, or the ending of a movie: {}", pattern.status().message(), MovieEndings()));
  output.pictures = *std::move(pattern);
  return output;
}

std::string FramePattern::Name(int index) const {
  return before_ + (zero_ ? fmt::format("{:0{}}", index, width_) : fmt::format("{:{}}", index, width_)) + after_;
}

}  // namespace slabstream
