#include "common/planning/resolved_request.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/base/find_named.h"
#include "common/classification/color_maps.h"
#include "common/planning/brick_visibility.h"
#include "common/planning/framing.h"
#include "common/planning/other_bricks.h"
#include "common/renderers/registry.h"
#include "common/renderers/renderer_choice.h"
#include "common/shapes/packed_shape.h"
#include "common/view/default_view.h"

namespace slabstream {
namespace {

std::string Span(const LabelTable& table) {
  if (table.labels.empty()) return "it has none";
  return fmt::format("it has {} from {} to {}", table.labels.size(), table.labels.front().value, table.labels.back().value);
}

Status NoneNamed(const std::string& name, const LabelTable& table) {
  constexpr std::size_t kMostShown = 8;
  std::vector<std::string> names;
  for (const Label& label : table.labels) {
    if (!label.name.empty()) names.push_back(label.name);
  }
  const std::string more = names.size() > kMostShown ? fmt::format(" and {} more", names.size() - kMostShown) : "";
  names.resize(std::min(names.size(), kMostShown));
  return Status::InvalidArgument(fmt::format("labels.shown: no label is named '{}'; {}{}", name,
                                             names.empty() ? "none has a name" : fmt::format("there are {}", fmt::join(names, ", ")),
                                             more));
}

// The labels of a range, or those that have its name.
Status AddShown(const LabelRange& range, const LabelTable& table, std::vector<LabelLook::Span>& shown) {
  if (!range.name.empty()) {
    const std::size_t before = shown.size();
    for (const Label& label : table.labels) {
      if (Covers(range, label)) shown.push_back({label.value, label.value});
    }
    return shown.size() > before ? Status::Ok() : NoneNamed(range.name, table);
  }
  shown.push_back({range.first, range.last});
  const auto label = std::ranges::lower_bound(table.labels, range.first, {}, &Label::value);  // of many ranges each is looked up
  if (!table.complete || (label != table.labels.end() && label->value <= range.last)) return Status::Ok();
  return Status::InvalidArgument(fmt::format("labels.shown: no label from {} to {}; {}", range.first, range.last, Span(table)));
}

// Spans that rise and do not touch.
std::vector<LabelLook::Span> Joined(std::vector<LabelLook::Span> spans) {
  std::ranges::sort(spans, {}, &LabelLook::Span::first);
  std::vector<LabelLook::Span> joined;
  for (const LabelLook::Span& span : spans) {
    if (joined.empty() || span.first - 1 > joined.back().last) {
      joined.push_back(span);
    } else {
      joined.back().last = std::max(joined.back().last, span.last);
    }
  }
  return joined;
}

// `slice`: of a slice, which keeps the grey values of hidden labels.
Result<LabelLook> ResolveLabels(const LabelChoice& choice, const LabelTable& table, bool slice) {
  LabelLook look{.mode = choice.mode == LabelMode::kSurface ? choice.mode : LabelMode::kTint, .tint = choice.tint};
  look.smooth = choice.surface == LabelSurface::kSmooth;
  if (look.smooth && choice.mode != LabelMode::kSurface) {
    return Status::InvalidArgument("label-surface is 'smooth', but label-mode is not 'surface', the mode in which labels have surfaces");
  }
  look.hides = look.mode == LabelMode::kTint && choice.mode != LabelMode::kHighlight && !slice;
  const auto rgb = [](const LabelColor& color) { return Rgb{color[0], color[1], color[2]}; };
  for (const Label& label : table.labels) look.entries.push_back({label.value, rgb(label.color)});
  for (const LabelRange& range : choice.shown) {
    if (Status added = AddShown(range, table, look.shown); !added.ok()) return added;
  }
  look.shown = Joined(std::move(look.shown));
  for (const auto& [value, opacity] : choice.opacities) {
    auto entry = std::ranges::lower_bound(look.entries, value, {}, &LabelLook::Entry::value);
    if (entry == look.entries.end() || entry->value != value) {
      if (table.complete) return Status::InvalidArgument(fmt::format("labels.opacities: no label {}; {}", value, Span(table)));
      entry = look.entries.insert(entry, {value, rgb(StandardColor(value))});
    }
    entry->opacity = float(opacity);
  }
  return look;
}

}  // namespace

Status CheckHasWhatIsDrawn(const RendererKind& renderer, const std::string& dataset, const VolumeSummary& summary) {
  if (IsOfLabels(summary.description.type)) {
    return Status::InvalidArgument(fmt::format("dataset \"{}\" is one of labels (?ids=yes), which need values that they name", dataset));
  }
  if (!renderer.Can(Ability::kCells) || !summary.cells.empty()) return Status::Ok();
  return Status::InvalidArgument(
      fmt::format("renderer '{}' draws the cells of unstructured grids, and dataset \"{}\" is a volume", renderer.name(), dataset));
}

namespace {

// Voxels of processes stay there, unless the request names how boxes are assigned.
Status ResolveOwners(const VolumeSummary& summary, FrameRequest& request) {
  Policy& policy = request.policy;
  if (summary.stored && NamesOwners(summary.stored->source) && policy.assignment == Policy().assignment && !IsDynamic(policy)) {
    policy.assignment = std::ranges::find_if(Assignments(), &AssignmentEntry::by_owner)->name;
  }
  if (!FindNamed(Assignments(), policy.assignment)->by_owner) {
    if (summary.owned == nullptr || std::ranges::count(*summary.owned, kNoOwner, &OwnedBox::owner) == 0) return Status::Ok();
    return Status::InvalidArgument(
        fmt::format("missing is 'skip', which needs policy.assignment 'owner', but that is '{}'", policy.assignment));
  }
  if (summary.owned == nullptr) {
    return Status::InvalidArgument(
        fmt::format("policy.assignment is '{}', but dataset \"{}\" does not lie in pieces", policy.assignment, request.dataset));
  }
  if (!IsDynamic(policy)) return Status::Ok();
  return Status::InvalidArgument(fmt::format("policy.assignment is '{}', whose boxes stay where they are, but policy.balance is '{}'",
                                             policy.assignment, policy.balance));
}

// Whether the strongest value of a channel is opaque: what shows is a value or a plane, not matter that lets light through.
bool HasFullRange(const FrameRequest& request, const RendererKind& renderer) {
  return request.clipping.slab.has_value() || renderer.format() == PixelFormat::kMaximum;
}

void Brighten(double factor, TransferFunction& transfer) {
  for (ColorPoint& point : transfer.colors) point.color = Brightened(point.color, factor);
  for (Isosurface& surface : transfer.isosurfaces) surface.color = Brightened(surface.color, factor);
  for (TransferRegion& region : transfer.regions) region.color = Brightened(region.color, factor);
}

// The other fields that show.
Result<std::vector<ClassifiedField>> ResolveFields(const FrameRequest& request, const VolumeSummary& volume, const ShownFields& fields,
                                                   const RendererKind& renderer, double opacity_distance) {
  const bool projects = renderer.format() == PixelFormat::kMaximum;
  if (request.blend != Blend::kAuto && (request.blend == Blend::kMax) != projects) {
    return Status::InvalidArgument(fmt::format("blend is {}: renderer '{}' takes {}", projects ? "add or over" : "max", renderer.name(),
                                               projects ? "max" : "add or over"));
  }
  constexpr std::size_t kMostProjected = 4;  // a pixel holds as many values
  if (projects && fields.values() > kMostProjected) {
    return Status::InvalidArgument(
        fmt::format("{} fields of dataset \"{}\" would show, but renderer '{}' shows at most {}: name some with channel", fields.values(),
                    request.dataset, renderer.name(), kMostProjected));
  }
  const auto parameters = ParseParameters(renderer, request.parameters);
  if (projects && fields.values() > 1 && parameters.ok() && renderer.FormatOf(*parameters) != PixelFormat::kMaximum) {
    return Status::InvalidArgument(
        fmt::format("projection-mode is 'mean', which shows one field, but {} of dataset \"{}\" show", fields.values(), request.dataset));
  }
  std::vector<ClassifiedField> resolved;
  for (const FieldVolume& other : fields.others) {
    const CoarserVolume& level = other.levels.front();
    const VolumeGeometry& geometry = level.summary->description.geometry;
    if (geometry.orientation.world != volume.description.geometry.orientation.world) {
      return Status::InvalidArgument(fmt::format("field {} of dataset \"{}\" lies in a {} world, the volume in a {} one", other.number,
                                                 request.dataset, NameOf(geometry.orientation.world),
                                                 NameOf(volume.description.geometry.orientation.world)));
    }
    ClassifiedField& shown = resolved.emplace_back(ClassifiedField{level.dataset, level.summary});
    if (other.labels) {
      Result<LabelLook> labels = ResolveLabels(*LabelsOf(request), *level.summary->labels, request.clipping.slab.has_value());
      if (!labels.ok()) return labels.status();
      shown.labels = *std::move(labels);
      continue;
    }
    Result<FieldLook> look = LookOf(request, *fields.dataset, other.number, *level.summary, HasFullRange(request, renderer));
    if (!look.ok()) return look.status();
    look->range = level.summary->range;
    look->transfer.opacity_distance = opacity_distance;
    Brighten(request.brightness, look->transfer);
    shown.look = *std::move(look);
  }
  return resolved;
}

// What is drawn of even grids alone.
Status CheckRectilinear(const FrameRequest& request, const VolumeSummary& summary, const ShownFields& fields) {
  const auto refused = [&](std::string_view what) {
    return Status::InvalidArgument(
        fmt::format("dataset \"{}\": {} not shown on a rectilinear grid; --resample even resamples it", request.dataset, what));
  };
  const auto is_rectilinear = [](const FieldVolume& field) { return field.levels.front().summary->description.geometry.rectilinear(); };
  if (!summary.description.geometry.rectilinear()) {
    if (std::ranges::none_of(fields.others, is_rectilinear)) return Status::Ok();
    return Status::InvalidArgument(
        fmt::format("dataset \"{}\": its overlay has a rectilinear grid, which is not drawn over another one; --resample even resamples it",
                    request.dataset));
  }
  if (!fields.others.empty()) return refused("several fields are");
  return request.shading.needs_light_volume() ? refused("shadows and ambient occlusion are") : Status::Ok();
}

// Values by a colour map that spans `range`. `of`: of what, in messages.
Status ShowValues(const std::string& of, std::string_view name, const ScalarRange& range, ShapeLook& look) {
  look.coloring = ShapeColoring::kValues;
  const ColorMap* const map = FindNamed(NamedColorMaps(), name);
  if (map == nullptr)
    return Status::InvalidArgument(fmt::format("{} has map '{}', but must have one of: {}", of, name, NamesOf(NamedColorMaps())));
  look.low = range.min;
  look.high = range.max;
  if (!(look.low < look.high)) look.high = std::nextafter(look.low + std::max(1.0, std::abs(look.low)), 1e300);  // one value alone
  for (std::size_t i = 0; i < kShapeMapColors; ++i) look.map.push_back(map->At(double(i) / double(kShapeMapColors - 1)));
  return Status::Ok();
}

// As `slice` shows the volume. Its tone curve spans percentiles of all its values.
Result<ShapeLook> LookOfPlane(const PlaneChoice& choice, const VolumeSummary& volume, const ShownFields& fields) {
  if (fields.dataset != nullptr && HasLabelsAlone(*fields.dataset)) {
    return Status::InvalidArgument("a plane shows values, but the dataset has labels alone");
  }
  const Result<TransferFunction> window = MakePreset("window", volume);
  if (!window.ok()) return window.status();
  const ScalarRange whole = {window->colors.front().value, window->colors.back().value};
  ShapeLook look{.opacity = choice.opacity, .unlit = true};
  const Status shown = ShowValues("a plane", choice.map.empty() ? kStandardPlaneMap : std::string_view(choice.map),
                                  choice.range ? InDataValues(*choice.range, volume) : whole, look);
  return shown.ok() ? Result<ShapeLook>(std::move(look)) : shown;
}

Result<ShapeLook> LookOfShape(const ShapeChoice& choice, const VolumeSummary& dataset) {
  const ShapeInfo* const info = dataset.shape.get();
  if (info == nullptr) {
    return Status::InvalidArgument(fmt::format("shape '{}' is a volume, but must be a mesh, lines or points", choice.shape));
  }
  ShapeLook look{.color = choice.color.value_or(Rgb{1, 1, 1}), .opacity = choice.opacity, .width = choice.width};
  look.width_in_pixels = choice.width_in_pixels;
  const bool by_values = info->has_values && (!choice.map.empty() || choice.range || !(choice.color || info->has_colors));
  if (!by_values) {
    if (!choice.map.empty() || choice.range) {
      return Status::InvalidArgument(
          fmt::format("shape '{}' has {}, but its vertices have no values to colour", choice.shape, choice.range ? "a range" : "a map"));
    }
    if (!choice.color && info->has_colors) look.coloring = ShapeColoring::kVertices;
    return look;
  }
  if (choice.range && choice.range->percentiles) {
    return Status::InvalidArgument(fmt::format("shape '{}' has a range of percentiles, but must have one of values", choice.shape));
  }
  const ScalarRange whole = {double(info->least), double(info->largest)};
  const Status shown =
      ShowValues(fmt::format("shape '{}'", choice.shape), choice.map.empty() ? kStandardShapeMap : std::string_view(choice.map),
                 choice.range.value_or(whole), look);
  return shown.ok() ? Result<ShapeLook>(std::move(look)) : shown;
}

}  // namespace

Status CheckSlices(const FrameRequest& request, const VolumeGeometry& geometry) {
  if (request.clipping.slab) {
    if (Status status = CheckSlice("clip.slab", *request.clipping.slab, geometry); !status.ok()) return status;
  }
  for (const PlaneChoice& plane : request.planes) {
    if (Status status = CheckSlice("plane", plane.slab, geometry); !status.ok()) return status;
  }
  return Status::Ok();
}

Result<ResolvedRequest> ResolveRequest(FrameRequest request, DatasetId dataset, std::shared_ptr<const VolumeSummary> summary,
                                       ShownFields fields) {
  const VolumeGeometry& geometry = summary->description.geometry;
  if (summary->shape != nullptr) {
    return Status::InvalidArgument(fmt::format("dataset \"{}\" is a shape ({}), which shows beside a volume: --shape {}", request.dataset,
                                               NameOf(summary->shape->kind), request.dataset));
  }
  if (Status status = CheckSlices(request, geometry); !status.ok()) return status;
  std::vector<ShapeLook> shapes;
  for (std::size_t i = 0; i < fields.shapes.size(); ++i) {
    Result<ShapeLook> look = LookOfShape(request.shapes[i], *fields.shapes[i].summary);
    if (!look.ok()) return look.status();
    shapes.push_back(*std::move(look));
  }
  for (const PlaneChoice& plane : request.planes) {
    Result<ShapeLook> look = LookOfPlane(plane, *summary, fields);
    if (!look.ok()) return look.status();
    shapes.push_back(*std::move(look));
  }
  if (fields.dataset != nullptr && HasLabelsAlone(*fields.dataset)) {
    const RendererKind* const named = FindRenderer(request.renderer);
    if (LabelsOf(request) == nullptr && named != nullptr && !named->Can(Ability::kLabels)) {
      return Status::InvalidArgument(fmt::format(
          "dataset \"{}\" has labels and no values, and renderer '{}' shows no labels; --label-mode surface chooses one that does",
          request.dataset, request.renderer));
    }
    LabelMode& mode = ShownLabels(request).mode;
    if (mode == LabelMode::kTint || mode == LabelMode::kHighlight) {
      return Status::InvalidArgument(
          fmt::format("label-mode is '{}', but dataset \"{}\" has labels and no values to colour, so it must be auto or surface",
                      mode == LabelMode::kTint ? "tint" : "highlight", request.dataset));
    }
    mode = LabelMode::kSurface;
  }
  const auto weighted = [](const FieldChoice& field) { return field.weight > 0 && field.weight < 1; };
  Result<std::vector<const RendererKind*>> able =
      RenderersFor(request, {fields.values(), std::ranges::any_of(request.fields, weighted), geometry.rectilinear()});
  if (!able.ok()) return able.status();
  // A frame along slices has pixels as wide as voxels, and blurs shapes.
  const auto blurs = [](const RendererKind* kind) { return kind->along_slices(); };
  const bool has_shapes = !fields.shapes.empty() || !request.planes.empty();
  if (has_shapes && !std::ranges::all_of(*able, blurs)) std::erase_if(*able, blurs);
  if (Status status = CheckRectilinear(request, *summary, fields); !status.ok()) return status;
  const RendererKind& renderer = PreferredRenderer(*able, !summary->cells.empty());
  request.renderer = renderer.name();
  if (Status status = CheckNames(request.policy); !status.ok()) return status;
  if (Status status = ResolveOwners(*summary, request); !status.ok()) return status;
  if (Status status = CheckHasWhatIsDrawn(renderer, request.dataset, *summary); !status.ok()) return status;
  const Result<bool> as_channel = ShowsAsChannel(request, fields);
  if (!as_channel.ok()) return as_channel.status();
  Result<TransferFunction> transfer = ResolveTransfer(request.transfer, *summary);
  if (!transfer.ok()) return transfer.status();
  double weight = 1;
  if (*as_channel || !fields.volume_shows) {
    Result<FieldLook> look = LookOf(request, *fields.dataset, fields.volume, *summary, HasFullRange(request, renderer));
    if (!look.ok()) return look.status();
    const double distance = transfer->opacity_distance;
    transfer = std::move(look->transfer);
    transfer->opacity_distance = distance;
    weight = look->weight;
    if (!fields.volume_shows) transfer->opacities = {{double(summary->range.min), 0}};
    if (!fields.volume_shows) weight = 1;
  }
  const auto* const name = std::get_if<std::string>(&request.transfer.choice);
  if (!*as_channel && request.clipping.slab && name != nullptr && FindNamed(TransferPresets(), *name)->map != nullptr) {
    transfer->opacities = {{double(summary->range.min), 1}};
  }
  Brighten(request.brightness, *transfer);
  Result<ClipRegion> clip = MakeClipRegion(request.clipping, geometry);
  if (!clip.ok()) return clip.status();
  Result<std::vector<ClassifiedField>> others = ResolveFields(request, *summary, fields, renderer, transfer->opacity_distance);
  if (!others.ok()) return others.status();
  const ClassifiedVolume volume{dataset, *std::move(transfer), &renderer, *std::move(clip), *std::move(others)};
  request.view = WithDefaults(request.view, geometry.orientation.world);
  std::optional<Ball> framed;
  if (*request.view.fit) {
    const BrickVisibility visibility(*summary, renderer.DrawnTable(volume.transfer(), *summary), OtherBricks(*summary, volume));
    std::vector<Box> shown = visibility.VisibleBricks(volume.clip());
    for (Box& bricks : shown) bricks = geometry.InDataSpace(bricks);
    if (!request.clipping.slab) {
      for (const CoarserVolume& shape : fields.shapes) shown.push_back(BoxAround(*shape.summary->shape, geometry));
      if (!request.planes.empty()) shown.push_back(geometry.bounds());
    }
    framed = FramedBall(request, shown, volume.clip(), geometry);
    if (framed) request.view = FitView(request.view, geometry, *framed);
    request.view.fit = false;
  }
  request.policy = SettledPolicy(request, geometry);
  ResolvedPolicy policy = ResolvePolicy(request.policy, geometry);
  return ResolvedRequest{.frame = std::move(request),
                         .volume = volume,
                         .summary = std::move(summary),
                         .policy = std::move(policy),
                         .framed = framed,
                         .fields = std::move(fields),
                         .weight = weight,
                         .shapes = std::move(shapes)};
}

Result<TransferFunction> ResolveTransfer(const TransferChoice& choice, const VolumeSummary& summary) {
  Result<TransferFunction> transfer = std::holds_alternative<std::string>(choice.choice)
                                          ? MakePreset(std::get<std::string>(choice.choice), summary)
                                          : Result<TransferFunction>(std::get<TransferFunction>(choice.choice));
  if (!transfer.ok()) return transfer;
  transfer->opacity_distance = choice.opacity_distance;
  transfer->isosurfaces = choice.isosurfaces;
  transfer->gradient_opacities = choice.gradient_opacities;
  if (choice.scalar_range) transfer = Stretched(*std::move(transfer), InDataValues(*choice.scalar_range, summary));
  transfer = WithCurvesOfRegions(*std::move(transfer));
  // Values that are almost in one place may not be told apart by what was computed. Workers would not read the frame.
  const auto finite = [](const auto& points) {
    return std::ranges::all_of(points, [](const auto& point) { return std::isfinite(point.value); });
  };
  if (!finite(transfer->colors) || !finite(transfer->opacities))
    return Status::InvalidArgument(
        "the transfer function has points at values that are no numbers: its values are too close to each other");
  return transfer;
}

}  // namespace slabstream
