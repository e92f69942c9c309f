// Renderers(): the list of all renderers, and how requests name them.
//
// To add one, write common/renderers/NAME (planning half) and worker/renderers/NAME (pixel half) and add NAME to the list in
// common/renderers/CMakeLists.txt. docs/adding.md has the recipe.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/renderers/renderer_kind.h"

namespace slabstream {

// In the order of the list; the first one is the default.
std::span<const RendererKind* const> Renderers();

std::vector<std::string_view> RendererNames();
// "splat, mip": those that have the ability.
std::string NamesOfAble(std::string_view ability);

// Null: no renderer has this name.
const RendererKind* FindRenderer(std::string_view name);

// InvalidArgument, naming all renderers, if none has this name.
Result<const RendererKind*> RequireRenderer(std::string_view name);

// The value of each parameter of `kind`, from the request's texts or its default. InvalidArgument, naming the parameter, its text and its
// limits: a parameter that the renderer does not have, or a text that is no valid value.
Result<std::vector<double>> ParseParameters(const RendererKind& kind, const ParameterTexts& texts);

}  // namespace slabstream
