#include "data/volume_io/file_parts.h"

#include <fmt/format.h>

#include <utility>

#include "data/volume_io/chosen_channel.h"

namespace slabstream {

std::vector<std::string> ShownTexts(const std::string& path, const FileParts& parts, const ReadOptions& options) {
  std::vector<std::string> texts;
  if (!options.time && parts.times > 1) {
    texts.push_back(
        fmt::format("{}: shows time {} of {}; --time takes another one: 0 to {}", path, parts.time, parts.times, parts.times - 1));
  }
  if (auto channel = ShownChannelText(path, parts.channels, parts.channel, options)) texts.push_back(*std::move(channel));
  if (!options.channel && parts.components > 1) {
    const bool colour = parts.components == 3 || parts.components == 4;
    texts.push_back(fmt::format("{}: shows component 0 of {}; --channel takes another one: 0 to {}{}", path, parts.components,
                                parts.components - 1, colour ? ", or luminance, of red, green and blue" : ""));
  }
  return texts;
}

}  // namespace slabstream
