#include "common/renderers/renderer_choice.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <string>
#include <string_view>
#include <utility>
#include <variant>

#include "common/base/check.h"
#include "common/base/find_named.h"
#include "common/classification/transfer_function.h"
#include "common/renderers/registry.h"

namespace slabstream {
namespace {

// Something that a request asks for, and who has it.
struct Need {
  std::string what;
  std::vector<const RendererKind*> able;  // in order of Renderers()
};

bool HasRegions(const TransferChoice& transfer) {
  if (const auto* function = std::get_if<TransferFunction>(&transfer.choice)) return !function->regions.empty();
  const TransferPreset* const preset = FindNamed(TransferPresets(), std::get<std::string>(transfer.choice));
  return preset != nullptr && preset->has_regions;
}

std::vector<Need> NeedsOf(const FrameRequest& request, const FieldsKnown& fields) {
  std::vector<Need> needs;
  const auto add = [&](std::string_view what, const auto& has) {
    Need& need = needs.emplace_back(Need{std::string(what), {}});
    std::ranges::copy_if(Renderers(), std::back_inserter(need.able), has);
  };
  const auto need = [&](bool asked, Ability ability, std::string_view what) {
    if (asked) add(what, [&](const RendererKind* kind) { return kind->Can(ability); });
  };
  need(request.view.projection == Projection::kPerspective, Ability::kPerspective, "projection 'perspective'");
  need(!request.transfer.isosurfaces.empty(), Ability::kIsosurfaces, "isovalue");
  need(!request.transfer.gradient_opacities.empty(), Ability::kGradientOpacity, "gradient-opacity");
  need(HasRegions(request.transfer), Ability::kRegions, "a two-dimensional transfer function");
  need(request.brightness != 1, Ability::kTransfer, "brightness");
  need(request.shading.model == ShadingModel::kDepthGradient, Ability::kDepthShading, "shading 'depth-gradient'");
  need(request.shading.shadows != 0, Ability::kShadows, "shadows");
  need(request.shading.ambient_occlusion != 0, Ability::kShadows, "ambient-occlusion");
  const LabelChoice* const labels = LabelsOf(request);
  need(labels != nullptr, Ability::kLabels, "labels");
  need(labels != nullptr && labels->surface == LabelSurface::kSmooth, Ability::kSmoothLabels, "label-surface 'smooth'");
  need(fields.weighted, Ability::kFields, "channel-opacity");
  need(fields.count > 1, Ability::kFields, fmt::format("a picture of {} fields", fields.count));
  need(fields.rectilinear, Ability::kRectilinear, "a rectilinear grid that --resample even does not resample");
  need(!request.shapes.empty() || !request.planes.empty(), Ability::kShapes, "a picture with shapes");
  for (const auto& [name, text] : request.parameters) {
    add(name, [&](const RendererKind* kind) { return FindParameter(*kind, name) != nullptr; });
  }
  return needs;
}

std::vector<const RendererKind*> AbleToDoAll(const std::vector<Need>& needs) {
  std::vector<const RendererKind*> able(Renderers().begin(), Renderers().end());
  for (const Need& need : needs) {
    std::erase_if(able, [&](const RendererKind* kind) { return std::ranges::find(need.able, kind) == need.able.end(); });
  }
  return able;
}

std::string InWords(const Need& need) {
  std::vector<std::string_view> names;
  for (const RendererKind* kind : need.able) names.push_back(kind->name());
  return fmt::format("{} needs one of: {}", need.what, fmt::join(names, ", "));
}

// Of needs that no renderer has all of. Those without which the others still cannot be had together are left out: mostly two remain.
Status CannotBeHadTogether(std::vector<Need> needs) {
  for (std::size_t i = 0; i < needs.size();) {
    std::vector<Need> others = needs;
    others.erase(others.begin() + std::ptrdiff_t(i));
    if (AbleToDoAll(others).empty()) {
      needs = std::move(others);
    } else {
      ++i;
    }
  }
  std::vector<std::string> words;
  for (const Need& need : needs) words.push_back(InWords(need));
  return Status::InvalidArgument(fmt::format("no renderer does all that is asked: {}", fmt::join(words, "; ")));
}

}  // namespace

Result<std::vector<const RendererKind*>> RenderersFor(const FrameRequest& request, const FieldsKnown& fields) {
  const RendererKind* const named = FindRenderer(request.renderer);
  if (named == nullptr && request.renderer != kAutomatic) return NoSuchRenderer(request.renderer, fmt::format("{}, ", kAutomatic));
  if (named != nullptr) {
    if (const auto values = ParseParameters(*named, request.parameters); !values.ok()) return values.status();
  } else if (Status status = CheckParameters(request.parameters); !status.ok()) {
    return status;
  }
  const std::vector<Need> needs = NeedsOf(request, fields);
  if (named == nullptr) {
    std::vector<const RendererKind*> able = AbleToDoAll(needs);
    return able.empty() ? Result<std::vector<const RendererKind*>>(CannotBeHadTogether(needs)) : std::move(able);
  }
  const auto lacked = std::ranges::find_if(needs, [&](const Need& need) { return std::ranges::count(need.able, named) == 0; });
  if (lacked == needs.end()) return std::vector{named};
  return Status::InvalidArgument(fmt::format("renderer is '{}', but {}", request.renderer, InWords(*lacked)));
}

const RendererKind& PreferredRenderer(const std::vector<const RendererKind*>& able, bool has_cells) {
  CHECK(!able.empty());
  const auto found = std::ranges::find_if(able, [&](const RendererKind* kind) { return kind->Can(Ability::kCells) == has_cells; });
  return found == able.end() ? *able.front() : **found;
}

}  // namespace slabstream
