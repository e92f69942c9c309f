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

// In the order of the list, which is that of preference.
std::span<const RendererKind* const> Renderers();

// The renderer of a request that asks for nothing special (renderer_choice.h): the first one that draws the cells of unstructured grids, or
// the first one that draws voxels.
const RendererKind& DefaultRenderer(bool has_cells = false);

std::vector<std::string_view> RendererNames();
// "splat, mip": those that have the ability.
std::string NamesOfAble(std::string_view ability);

// Null: no renderer has this name.
const RendererKind* FindRenderer(std::string_view name);

// InvalidArgument, naming all renderers, if none has this name.
Result<const RendererKind*> RequireRenderer(std::string_view name);

// The error for an unknown name. `others`: what may stand in place of a renderer's name, each followed by ", ".
Status NoSuchRenderer(std::string_view name, std::string_view others = "");

// Null: the renderer does not have it.
const RendererParameter* FindParameter(const RendererKind& kind, std::string_view name);

// A value as requests write it.
std::string TextOf(const RendererParameter& parameter, double value);

// The value of each parameter of `kind`, from the request's texts or its default. InvalidArgument, naming the parameter, its text and its
// limits: a parameter that the renderer does not have, or a text that is no valid value.
Result<std::vector<double>> ParseParameters(const RendererKind& kind, const ParameterTexts& texts);
// The same errors, if no renderer has the parameter.
Status CheckParameters(const ParameterTexts& texts);

}  // namespace slabstream
