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

// In the order of the list.
std::span<const RendererKind* const> Renderers();

// What kAutomatic means for a dataset: the first renderer that draws its cells, if it is an unstructured grid, or the first that does not.
const RendererKind& DefaultRenderer(bool has_cells = false);

std::vector<std::string_view> RendererNames();
// "splat, mip": those that have the ability.
std::string NamesOfAble(std::string_view ability);

// Null: no renderer has this name.
const RendererKind* FindRenderer(std::string_view name);

// InvalidArgument, naming all renderers, if none has this name.
Result<const RendererKind*> RequireRenderer(std::string_view name);

// Those that may make the picture of a request for this name: the one of this name, or all that kAutomatic may mean. InvalidArgument: as
// RequireRenderer.
Result<std::vector<const RendererKind*>> RenderersFor(std::string_view name);

// A value as requests write it.
std::string TextOf(const RendererParameter& parameter, double value);

// The value of each parameter of `kind`, from the request's texts or its default. InvalidArgument, naming the parameter, its text and its
// limits: a parameter that the renderer does not have, or a text that is no valid value.
Result<std::vector<double>> ParseParameters(const RendererKind& kind, const ParameterTexts& texts);
// The same errors: a parameter that none of RenderersFor(name) has, or a text that is no valid value.
Status CheckParameters(std::string_view name, std::span<const RendererKind* const> renderers, const ParameterTexts& texts);

}  // namespace slabstream
