#include "common/planning/validate_request.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <set>
#include <string>

#include "common/base/range_status.h"
#include "common/renderers/registry.h"

namespace slabstream {
namespace {

Status ValidateName(std::string_view field, std::string_view name) {
  if (!name.empty() && name.size() <= kMaxNameBytes) return Status::Ok();
  return Status::InvalidArgument(fmt::format("{} has {} bytes, but must have 1 to {}", field, name.size(), kMaxNameBytes));
}

}  // namespace

Status Validate(const TransferChoice& transfer) {
  if (const auto* preset = std::get_if<std::string>(&transfer.choice)) {
    if (Status s = ValidateName("transfer.preset", *preset); !s.ok()) return s;
  } else if (Status s = Validate(std::get<TransferFunction>(transfer.choice)); !s.ok()) {
    return s;
  }
  if (const auto& range = transfer.scalar_range) {
    const double least = range->percentiles ? 0 : -kMaxScalar, most = range->percentiles ? 100 : kMaxScalar;
    if (Status s = InRange("transfer.scalar_range.min", range->min, least, most); !s.ok()) return s;
    if (Status s = InRange("transfer.scalar_range.max", range->max, least, most); !s.ok()) return s;
    if (!(range->min < range->max)) {
      return Status::InvalidArgument(fmt::format("transfer.scalar_range is {:g} to {:g}, but must rise", range->min, range->max));
    }
  }
  if (Status s = Validate(transfer.isosurfaces); !s.ok()) return s;
  if (Status s = Validate(transfer.gradient_opacities); !s.ok()) return s;
  if (transfer.opacity_distance > 0 && transfer.opacity_distance <= kMaxOpacityDistance) return Status::Ok();
  return Status::InvalidArgument(fmt::format("transfer.opacity_distance is {}, but must lie in (0, {}] voxel lengths",
                                             transfer.opacity_distance, kMaxOpacityDistance));
}

namespace {

Status Validate(const LabelChoice& labels) {
  if (Status s = InRange("labels.mode", int(labels.mode), int(LabelMode::kTint), int(LabelMode::kSurface)); !s.ok()) return s;
  if (Status s = InRange("labels.tint", labels.tint, 0, 1); !s.ok()) return s;
  if (labels.opacities.size() > kMaxLabels) {
    return Status::InvalidArgument(
        fmt::format("labels.opacities has {} labels, at most {} are possible", labels.opacities.size(), kMaxLabels));
  }
  std::set<std::uint32_t> named;
  for (const auto& [value, opacity] : labels.opacities) {
    if (Status s = InRange("labels.opacities.value", int(std::min(value, kMaxLabelValue + 1)), 1, int(kMaxLabelValue)); !s.ok()) return s;
    if (Status s = InRange("labels.opacities.opacity", opacity, 0, 1); !s.ok()) return s;
    if (!named.insert(value).second) return Status::InvalidArgument(fmt::format("labels.opacities names label {} twice", value));
  }
  if (labels.shown.size() > kMaxLabelRanges) {
    return Status::InvalidArgument(
        fmt::format("labels.shown has {} ranges, at most {} are possible", labels.shown.size(), kMaxLabelRanges));
  }
  for (const auto& [first, last] : labels.shown) {
    if (first >= 1 && first <= last && last <= kMaxLabelValue) continue;
    return Status::InvalidArgument(
        fmt::format("labels.shown has the range {} to {}, but must rise in [1, {}]", first, last, kMaxLabelValue));
  }
  return Status::Ok();
}

// Overlays have no isosurfaces and no opacity by gradient.
Status CheckCurvesAlone(const TransferChoice& overlay) {
  const auto* function = std::get_if<TransferFunction>(&overlay.choice);
  const bool alone = overlay.isosurfaces.empty() && overlay.gradient_opacities.empty() &&
                     (function == nullptr || (function->isosurfaces.empty() && function->gradient_opacities.empty()));
  if (alone) return Status::Ok();
  return Status::InvalidArgument("overlay.transfer has isosurfaces or gradient_opacities, which are of the volume alone");
}

// Refuses `option` unless the renderer has the ability.
Status RequireAbility(std::string_view option, const RendererKind& renderer, Ability ability) {
  if (renderer.Can(ability)) return Status::Ok();
  return Status::InvalidArgument(fmt::format("renderer is '{}', but {} needs one of: {}", renderer.name(), option, NamesOfAble(ability)));
}

Status Validate(const Policy& policy) {
  if (Status s = ValidateName("policy.decomposition", policy.decomposition); !s.ok()) return s;
  if (Status s = InRange("policy.axis", int(policy.axis), int(AxisChoice::kX), int(AxisChoice::kView)); !s.ok()) return s;
  if (Status s = InRange("policy.groups", policy.groups, 0, kMaxGroups); !s.ok()) return s;
  if (Status s = ValidateName("policy.load_metric", policy.load_metric); !s.ok()) return s;
  if (Status s = ValidateName("policy.assignment", policy.assignment); !s.ok()) return s;
  if (Status s = ValidateName("policy.balance", policy.balance); !s.ok()) return s;
  if (Status s = ValidateName("policy.combine", policy.combine); !s.ok()) return s;
  if (Status s = InRange("policy.teams", policy.teams, 1, kMaxTeams); !s.ok()) return s;
  return InRange("policy.pixel_error", policy.pixel_error, 0, kMaxPixelError);
}

}  // namespace

Status Validate(const FrameRequest& request) {
  if (Status s = ValidateName("dataset", request.dataset); !s.ok()) return s;
  const Result<const RendererKind*> renderer = RequireRenderer(request.renderer);
  if (!renderer.ok()) return renderer.status();
  const auto parameters = ParseParameters(**renderer, request.parameters);
  if (!parameters.ok()) return parameters.status();
  if (request.shading.model == ShadingModel::kDepthGradient) {
    if (Status s = RequireAbility("shading 'depth-gradient'", **renderer, Ability::kDepthShading); !s.ok()) return s;
  }
  if (request.view.projection == Projection::kPerspective) {
    if (Status s = RequireAbility("projection 'perspective'", **renderer, Ability::kPerspective); !s.ok()) return s;
  }
  if (!request.transfer.isosurfaces.empty()) {
    if (Status s = RequireAbility("isovalue", **renderer, Ability::kIsosurfaces); !s.ok()) return s;
  }
  if (!request.transfer.gradient_opacities.empty()) {
    if (Status s = RequireAbility("gradient-opacity", **renderer, Ability::kGradientOpacity); !s.ok()) return s;
  }
  if (Status s = Validate(request.size); !s.ok()) return s;
  if (Status s = Validate(request.view); !s.ok()) return s;
  if (Status s = Validate(request.clipping); !s.ok()) return s;
  if (Status s = Validate(request.transfer); !s.ok()) return s;
  if (request.labels) {
    if (Status s = RequireAbility("labels", **renderer, Ability::kLabels); !s.ok()) return s;
    if (Status s = Validate(*request.labels); !s.ok()) return s;
  }
  if (request.overlay) {
    if (Status s = RequireAbility("overlay", **renderer, Ability::kOverlay); !s.ok()) return s;
    if (Status s = Validate(request.overlay->transfer); !s.ok()) return Status(s.code(), "overlay." + s.message());
    if (Status s = CheckCurvesAlone(request.overlay->transfer); !s.ok()) return s;
    if (Status s = InRange("overlay.weight", request.overlay->weight, 0, 1); !s.ok()) return s;
  }
  if (Status s = Validate(request.shading); !s.ok()) return s;
  if (Status s = InRange("termination", request.termination, 0, kMaxTermination); !s.ok()) return s;
  return Validate(request.policy);
}

}  // namespace slabstream
