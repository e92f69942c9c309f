#include "common/renderers/registry.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>

#include "common/base/parse_number.h"

// Each renderer's folder defines Kind() in a namespace with the renderer's name.
#define SLABSTREAM_RENDERER(folder) \
  namespace slabstream::folder {    \
  const RendererKind& Kind();       \
  }
#include "renderer_list.inc"
#undef SLABSTREAM_RENDERER

namespace slabstream {
namespace {

Result<double> ParseParameter(const RendererParameter& parameter, const std::string& text) {
  if (!parameter.choices.empty()) {
    const auto choice = std::ranges::find(parameter.choices, text);
    if (choice != parameter.choices.end()) return double(choice - parameter.choices.begin());
    return Status::InvalidArgument(
        fmt::format("{} is '{}', but must be one of: {}", parameter.name, text, fmt::join(parameter.choices, ", ")));
  }
  const std::optional<double> value = ParseNumber<double>(text);
  if (value && *value >= parameter.least && *value <= parameter.most) return *value;
  return Status::InvalidArgument(
      fmt::format("{} is '{}', but must be a number in [{}, {}]", parameter.name, text, parameter.least, parameter.most));
}

}  // namespace

std::span<const RendererKind* const> Renderers() {
#define SLABSTREAM_RENDERER(folder) &folder::Kind(),
  static const std::array kinds = std::to_array<const RendererKind*>({
#include "renderer_list.inc"
  });
#undef SLABSTREAM_RENDERER
  return kinds;
}

std::vector<std::string_view> RendererNames() {
  std::vector<std::string_view> names;
  for (const RendererKind* kind : Renderers()) names.push_back(kind->name());
  return names;
}

std::string NamesOfAble(std::string_view ability) {
  std::vector<std::string_view> names;
  for (const RendererKind* kind : Renderers()) {
    if (std::ranges::count(kind->AbilityNames(), ability) != 0) names.push_back(kind->name());
  }
  return fmt::format("{}", fmt::join(names, ", "));
}

const RendererKind* FindRenderer(std::string_view name) {
  const auto found = std::ranges::find(Renderers(), name, &RendererKind::name);
  return found == Renderers().end() ? nullptr : *found;
}

Result<const RendererKind*> RequireRenderer(std::string_view name) {
  if (const RendererKind* kind = FindRenderer(name)) return kind;
  return Status::InvalidArgument(fmt::format("renderer is '{}', but must be one of: {}", name, fmt::join(RendererNames(), ", ")));
}

Result<std::vector<double>> ParseParameters(const RendererKind& kind, const ParameterTexts& texts) {
  std::vector<double> values;
  for (const RendererParameter& parameter : kind.parameters()) {
    const auto text = texts.find(parameter.name);
    if (text == texts.end()) {
      values.push_back(parameter.standard);
      continue;
    }
    Result<double> value = ParseParameter(parameter, text->second);
    if (!value.ok()) return value.status();
    values.push_back(*value);
  }
  for (const auto& [name, text] : texts) {
    if (std::ranges::find(kind.parameters(), name, &RendererParameter::name) != kind.parameters().end()) continue;
    return Status::InvalidArgument(fmt::format("{} is '{}', but the renderer '{}' has no such parameter", name, text, kind.name()));
  }
  return values;
}

}  // namespace slabstream
