#include "laboratory/experiments/sweep_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <utility>

#include "client/cli/json_value.h"
#include "common/base/files.h"
#include "common/cli/parse.h"
#include "common/combining/schemes.h"
#include "common/decomposition/decomposition.h"
#include "common/planning/assignment.h"
#include "common/planning/layout.h"
#include "common/planning/policy_names.h"
#include "common/renderers/registry.h"
#include "laboratory/experiments/frame_case.h"

namespace slabstream {
namespace {

constexpr int kMaxSphere = 1024;

template <class Entries>
std::vector<std::string_view> NamesIn(const Entries& entries) {
  std::vector<std::string_view> names;
  names.reserve(entries.size());
  for (const auto& entry : entries) names.push_back(entry.name);
  return names;
}

// Includes the choice to leave it open.
template <class Entries>
std::string ReadName(const JsonValue& value, const Entries& entries) {
  std::vector<std::string_view> names = NamesIn(entries);
  if (std::ranges::find(names, kAutomatic) == names.end()) names.push_back(kAutomatic);
  return std::string(names[value.OneOf(names)]);
}

BenchCase ReadVolume(const JsonValue& value) {
  if (value.Has("sphere") == value.Has("file")) {
    value.Complain(fmt::format("{} must have either 'sphere' or 'file'", value.Shown()));
    return {};
  }
  SphereRequest sphere;
  double opacity = kTranslucentSphere;
  std::string file, transfer;
  value.Fields({{"sphere",
                 [&](const JsonValue& v) {
                   v.Fields({{"class", [&](const JsonValue& c) { sphere.sphere_class = SphereClass(c.Integer(1, 2)); }},
                             {"size", [&](const JsonValue& s) { sphere.size = s.Integer(2, kMaxSphere); }},
                             {"occupancy", [&](const JsonValue& o) {
                                sphere.occupancy = o.Number({0, 0.52, true});
                              }}});
                 }},
                {"opacity",
                 [&](const JsonValue& v) {
                   opacity = v.Number({0, 1, true});
                 }},
                {"file", [&](const JsonValue& v) { file = v.Text(); }},
                {"transfer", [&](const JsonValue& v) { transfer = v.Text(); }}});
  if (!value.Has("file")) {
    if (value.Has("transfer")) value.Complain("a sphere has 'opacity', not 'transfer'");
    return SphereCase(sphere, opacity);
  }
  if (value.Has("opacity")) value.Complain("a file has 'transfer', not 'opacity'");
  Result<BenchCase> parsed = ParseBenchCase(transfer.empty() ? file : file + ":" + transfer, false);
  if (parsed.ok()) return *std::move(parsed);
  value.Complain(parsed.status().message());
  return {};
}

SweepView ReadView(const JsonValue& value, std::size_t index) {
  SweepView read{fmt::format("view {}", index + 1), {}};
  const NumberRange angle{-kMaxAngleDegrees, kMaxAngleDegrees};
  constexpr std::array<std::string_view, 2> kProjections = {"orthographic", "perspective"};
  ViewParameters& view = read.view;
  value.Fields(
      {{"name", [&](const JsonValue& v) { read.name = v.Text(); }},
       {"projection",
        [&](const JsonValue& v) { view.projection = v.OneOf(kProjections) == 0 ? Projection::kOrthographic : Projection::kPerspective; }},
       {"azimuth", [&](const JsonValue& v) { view.azimuth_degrees = v.Number(angle); }},
       {"elevation", [&](const JsonValue& v) { view.elevation_degrees = v.Number(angle); }},
       {"roll", [&](const JsonValue& v) { view.roll_degrees = v.Number(angle); }},
       {"zoom",
        [&](const JsonValue& v) {
          view.zoom = v.Number({kMinZoom, kMaxZoom});
        }},
       {"fov", [&](const JsonValue& v) {
          view.fov_degrees = v.Number({kMinFovDegrees, kMaxFovDegrees});
        }}});
  return read;
}

SweepPolicy ReadPolicy(const JsonValue& value) {
  SweepPolicy read;
  Policy& policy = read.policy;
  policy.groups = 1;
  constexpr std::array<std::string_view, 5> kAxes = {"x", "y", "z", "auto", "view"};
  value.Fields({{"name", [&](const JsonValue& v) { read.name = v.Text(); }},
                {"decomposition", [&](const JsonValue& v) { policy.decomposition = ReadName(v, Decompositions()); }},
                {"split", [&](const JsonValue& v) { policy.load_metric = ReadName(v, LoadMetrics()); }},
                {"assignment", [&](const JsonValue& v) { policy.assignment = ReadName(v, Assignments()); }},
                {"axis", [&](const JsonValue& v) { policy.axis = AxisChoice(v.OneOf(kAxes)); }},
                {"balance", [&](const JsonValue& v) { policy.balance = NamesIn(BalanceModes())[v.OneOf(NamesIn(BalanceModes()))]; }},
                {"pixel_error",
                 [&](const JsonValue& v) {
                   policy.pixel_error = v.Number({0, kMaxPixelError});
                 }},
                {"groups", [&](const JsonValue& v) { policy.groups = v.Integer(1, kMaxGroups); }},
                {"combine", [&](const JsonValue& v) {
                   policy.combine = v.Text();
                   if (policy.combine == kAutomatic) return;
                   if (const auto parsed = ParseCombining(policy.combine); !parsed.ok()) v.Complain(parsed.status().message());
                 }}});
  if (read.name.empty()) read.name = Describe(policy);
  return read;
}

void ReadSize(const JsonValue& value, ImageSize& size) {
  if (value.Shown().starts_with("[")) {
    std::vector<int> sides;
    value.Each([&](const JsonValue& v) { sides.push_back(v.Integer(1, kMaxImageSide)); });
    if (sides.size() != 2) return value.Complain(fmt::format("{} must be [width, height] or one number", value.Shown()));
    size = {sides[0], sides[1]};
  } else {
    size.width = size.height = value.Integer(1, kMaxImageSide);
  }
  if (std::int64_t(size.width) * size.height > kMaxImagePixels)
    value.Complain(fmt::format("{} has more than {} pixels", value.Shown(), kMaxImagePixels));
}

// Names distinguish cases.
template <class T>
void CheckNamesDiffer(const std::vector<T>& entries, const char* list, std::optional<std::string>& mistake) {
  std::set<std::string> seen;
  for (const T& entry : entries) {
    if (!seen.insert(entry.name).second && !mistake) mistake = fmt::format("{}: two of them are called '{}'", list, entry.name);
  }
}

}  // namespace

std::string Describe(const Policy& policy) {
  return fmt::format("{} by {}, {}, {}, {} groups, {}{}", policy.decomposition, LoadMetricOf(policy), policy.assignment, policy.balance,
                     policy.groups, policy.combine, policy.pixel_error > 0 ? fmt::format(", error {}", policy.pixel_error) : "");
}

Result<Sweep> ParseSweep(const std::string& path, std::string_view text) {
  std::optional<std::string> mistake;
  Json json;
  try {
    json = Json::parse(text);
  } catch (const Json::parse_error& error) {
    std::string what = error.what();
    std::ranges::replace(what, '\n', ' ');
    return Status::InvalidArgument(fmt::format("FILE '{}' is not JSON: {}", path, what.substr(what.find("] ") + 2)));
  }
  Sweep sweep;
  const JsonValue file(json, "", mistake);
  file.Fields(
      {{"title", [&](const JsonValue& v) { sweep.title = v.Text(); }},
       {"size", [&](const JsonValue& v) { ReadSize(v, sweep.size); }},
       {"volumes", [&](const JsonValue& v) { v.Each([&](const JsonValue& e) { sweep.volumes.push_back(ReadVolume(e)); }); }},
       {"renderers",
        [&](const JsonValue& v) { v.Each([&](const JsonValue& e) { sweep.renderers.push_back(Renderers()[e.OneOf(RendererNames())]); }); }},
       {"views", [&](const JsonValue& v) { v.Each([&](const JsonValue& e) { sweep.views.push_back(ReadView(e, sweep.views.size())); }); }},
       {"policies", [&](const JsonValue& v) { v.Each([&](const JsonValue& e) { sweep.policies.push_back(ReadPolicy(e)); }); }},
       {"workers",
        [&](const JsonValue& v) { v.Each([&](const JsonValue& e) { sweep.workers.push_back(e.Integer(1, kMaxSweepWorkers)); }); }},
       {"links", [&](const JsonValue& v) {
          v.Each([&](const JsonValue& e) {
            const std::string name = e.Text();
            const Result<LinkModel> link = ParseLink("link", name);
            if (link.ok()) {
              sweep.links.push_back({name, *link});
            } else {
              e.Complain(link.status().message());
            }
          });
        }}});
  for (const char* needed : {"volumes", "policies", "workers"}) {
    if (!mistake && !json.contains(needed)) mistake = fmt::format("'{}' is missing", needed);
  }
  if (sweep.title.empty()) sweep.title = "Sweep";
  if (sweep.renderers.empty()) sweep.renderers = {FindRenderer(kDefaultRenderer)};
  if (sweep.views.empty()) sweep.views = {{"view 1", BenchView(Projection::kOrthographic, 1, 12)}};
  if (sweep.links.empty()) sweep.links = {{"10gbit", *ParseLink("link", "10gbit")}};
  CheckNamesDiffer(sweep.volumes, "volumes", mistake);
  CheckNamesDiffer(sweep.views, "views", mistake);
  CheckNamesDiffer(sweep.policies, "policies", mistake);
  CheckNamesDiffer(sweep.links, "links", mistake);
  const std::size_t cases = sweep.volumes.size() * sweep.renderers.size() * sweep.views.size() * sweep.policies.size() *
                            sweep.workers.size() * sweep.links.size();
  if (!mistake && cases > kMaxSweepCases) mistake = fmt::format("{} cases are too many: at most {}", cases, kMaxSweepCases);
  if (mistake) return Status::InvalidArgument(fmt::format("FILE '{}': {}", path, *mistake));
  return sweep;
}

Result<Sweep> ReadSweep(const std::string& path) {
  const Result<std::string> text = ReadTextFile(path, kMaxSweepBytes);
  if (!text.ok()) return Status(text.status().code(), "FILE " + text.status().message());
  return ParseSweep(path, *text);
}

}  // namespace slabstream
