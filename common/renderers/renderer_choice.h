// RenderersFor(): which renderers can make the picture of a request. Each part of a request that not all of them can do is a need; the
// schema names the ability of each field, too, for those who offer it (About::ability).
#pragma once

#include <vector>

#include "common/base/status.h"
#include "common/frame/frame_request.h"
#include "common/renderers/renderer_kind.h"

namespace slabstream {

// What is known of the fields that show, once their dataset is.
struct FieldsKnown {
  std::size_t count = 1;
  bool weighted = false;     // some have a weight below 1
  bool rectilinear = false;  // the volume's grid is rectilinear
};

// The renderer that the request names, or if that is kAutomatic, all that have what it needs, in order of preference (Renderers()); never
// none. InvalidArgument: no renderer has this name, or has such a parameter; a parameter's text is no valid value; the renderer lacks what
// the request needs, or no renderer has all of it: the error then names what cannot be had together.
Result<std::vector<const RendererKind*>> RenderersFor(const FrameRequest& request, const FieldsKnown& fields = {});

// The first of `able` that draws the cells of an unstructured grid, if the dataset is one, or that draws voxels; else the first one.
// `able` is not empty.
const RendererKind& PreferredRenderer(const std::vector<const RendererKind*>& able, bool has_cells);

}  // namespace slabstream
