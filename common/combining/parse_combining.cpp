#include <fmt/format.h>

#include <optional>
#include <string>

#include "common/base/did_you_mean.h"
#include "common/base/find_named.h"
#include "common/combining/schemes.h"
#include "common/text/parse_number.h"

namespace slabstream {
namespace {

Status Invalid(std::string_view text, const std::string& what) { return Status::InvalidArgument(fmt::format("'{}': {}", text, what)); }

// Cuts `text` before the first `separator`; the rest follows it, none if there is no separator.
std::string_view CutFirst(std::optional<std::string_view>& text, char separator) {
  const std::size_t end = text->find(separator);
  const std::string_view first = text->substr(0, end);
  text = end == std::string_view::npos ? std::nullopt : std::optional(text->substr(end + 1));
  return first;
}

Result<std::uint32_t> ParseArgument(std::string_view what, std::string_view text, std::uint32_t least, std::uint32_t most) {
  const std::optional<std::uint32_t> value = ParseNumber<std::uint32_t>(text);
  if (value && *value >= least && *value <= most) return *value;
  return Status::InvalidArgument(fmt::format("{} is '{}', but must be a number in [{}, {}]", what, text, least, most));
}

Status ParseFactors(std::string_view text, const CombiningEntry& scheme, CombiningArguments& arguments) {
  for (std::optional<std::string_view> rest = text; rest;) {
    if (arguments.factors.size() == scheme.most_factors) {
      return Status::InvalidArgument(
          fmt::format("{} takes at most {} factor{}", scheme.name, scheme.most_factors, scheme.most_factors == 1 ? "" : "s"));
    }
    const Result<std::uint32_t> factor = ParseArgument("a factor", CutFirst(rest, 'x'), 2, kMaxFactor);
    if (!factor.ok()) return factor.status();
    arguments.factors.push_back(*factor);
  }
  return Status::Ok();
}

Status ParseItem(std::string_view item, const CombiningEntry& scheme, CombiningArguments& arguments) {
  constexpr std::string_view kStrips = "strips=";
  if (scheme.takes_strips && item.starts_with(kStrips)) {
    if (arguments.strips != 0) return Status::InvalidArgument("strips are given twice");
    const Result<std::uint32_t> strips = ParseArgument("strips", item.substr(kStrips.size()), 1, kMaxStrips);
    if (!strips.ok()) return strips.status();
    arguments.strips = *strips;
    return Status::Ok();
  }
  if (scheme.most_factors > 0) return ParseFactors(item, scheme, arguments);
  return Status::InvalidArgument(
      fmt::format("{} takes {} after its name, not '{}'", scheme.name, scheme.arguments.empty() ? "nothing" : scheme.arguments, item));
}

}  // namespace

Result<CombiningChoice> ParseCombining(std::string_view text) {
  std::optional<std::string_view> rest = text;
  const std::string_view name = CutFirst(rest, ':');
  const CombiningEntry* scheme = FindNamed(CombiningSchemes(), name);
  if (scheme == nullptr) {
    return Status::InvalidArgument(
        fmt::format("'{}' is not one of {}{}", name, NamesOf(CombiningSchemes()), DidYouMean(name, CombiningSchemes())));
  }
  CombiningChoice choice = {scheme, {}};
  while (rest) {
    if (const Status status = ParseItem(CutFirst(rest, ','), *scheme, choice.arguments); !status.ok())
      return Invalid(text, status.message());
  }
  return choice;
}

}  // namespace slabstream
