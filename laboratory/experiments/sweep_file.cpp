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

#include "client/request/camera_json.h"
#include "client/request/json_value.h"
#include "client/request/values.h"
#include "client/request/volume_argument.h"
#include "common/base/files.h"
#include "common/base/printable.h"
#include "common/cli/parse.h"
#include "common/combining/schemes.h"
#include "common/decomposition/decomposition.h"
#include "common/planning/assignment.h"
#include "common/planning/layout.h"
#include "common/planning/policy_names.h"
#include "common/renderers/registry.h"
#include "laboratory/experiments/request_json.h"

namespace slabstream {
namespace {

constexpr int kMaxSphere = 1024, kMaxHostCores = 1024;

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

BenchCase ReadVolume(const JsonValue& value, SweepPlace place) {
  // What names a volume that is no sphere.
  const char* const source = place == SweepPlace::kHere ? "file" : "dataset";
  if (value.Has("sphere") == value.Has(source)) {
    value.Complain(fmt::format("{} must have either 'sphere' or '{}'{}", value.Shown(), source,
                               place == SweepPlace::kHere ? "" : ": the service has volumes of its own"));
    return {};
  }
  if (value.Has("opacity") && (value.Has(source) || value.Has("transfer"))) {
    value.Complain("'opacity' is that of a sphere without 'transfer'");
    return {};
  }
  SphereRequest sphere;
  double opacity = kTranslucentSphere;
  BenchCase volume;
  std::string name, transfer_name;
  TransferChoice transfer;
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
                {source,
                 [&](const JsonValue& v) {
                   if (Result<BenchCase> parsed = ParseBenchCase(v.Text(), place == SweepPlace::kAtService); parsed.ok()) {
                     volume = *std::move(parsed);
                   } else {
                     v.Complain(parsed.status().message());
                   }
                 }},
                {"transfer",
                 [&](const JsonValue& v) {
                   transfer_name = v.Text();
                   if (auto parsed = ParseTransfer("transfer", transfer_name); parsed.ok()) {
                     transfer.choice = *std::move(parsed);
                   } else {
                     v.Complain(parsed.status().message());
                   }
                 }},
                {"opacity_distance",
                 [&](const JsonValue& v) {
                   transfer.opacity_distance = v.Number({0, kMaxOpacityDistance, true});
                 }},
                {"name", [&](const JsonValue& v) { name = v.Text(); }}});
  if (value.Has("sphere")) volume = SphereCase(sphere, opacity);
  if (value.Has("transfer")) {
    volume.transfer.choice = std::move(transfer.choice);
    volume.opacity.reset();
    volume.name = fmt::format("{}-{}", volume.dataset, std::filesystem::path(transfer_name).stem().string());
  }
  volume.transfer.opacity_distance = transfer.opacity_distance;
  if (!name.empty()) volume.name = name;
  return volume;
}

// A direction as --light takes it.
Vec3 ReadLight(const JsonValue& value) {
  std::vector<std::string> coordinates;
  value.Each([&](const JsonValue& v) { coordinates.push_back(v.Shown()); });
  const Result<Vec3> light = ParseDirection("light", fmt::format("{}", fmt::join(coordinates, ",")));
  if (light.ok()) return *light;
  value.Complain(light.status().message());
  return {};
}

// The name of a renderer, or an object with the parameters of that renderer and what else decides the look.
SweepRenderer ReadRenderer(const JsonValue& value) {
  const auto kind_of = [](const JsonValue& v) { return Renderers()[v.OneOf(RendererNames())]; };
  SweepRenderer read;
  if (value.Shown().starts_with('"')) {
    read.kind = kind_of(value);
    read.name = read.kind->name();
    return read;
  }
  if (value.Has("renderer")) read.kind = kind_of(value.At("renderer"));
  Look& look = read.look;
  std::vector<std::pair<std::string, JsonValue::Read>> fields = {
      {"name", [&](const JsonValue& v) { read.name = v.Text(); }},
      {"renderer", [](const JsonValue&) {}},
      {"shading", [&](const JsonValue& v) { look.shading.model = ShadingModel(v.OneOf(kShadingModelNames)); }},
      {"lights",
       [&](const JsonValue& v) {
         v.Each([&](const JsonValue& light) { look.shading.lights.push_back(ReadLight(light)); }, 0);
         if (look.shading.lights.size() > kMaxLights)
           v.Complain(fmt::format("{} lights are too many: at most {}", look.shading.lights.size(), kMaxLights));
       }},
      {"termination", [&](const JsonValue& v) {
         look.termination = v.Number({0, kMaxTermination});
       }}};
  for (const RendererParameter& parameter : read.kind->parameters()) {
    fields.emplace_back(parameter.name, [&](const JsonValue& v) {
      look.parameters[std::string(parameter.name)] = parameter.choices.empty()
                                                         ? fmt::format("{}", v.Number({parameter.least, parameter.most}))
                                                         : std::string(parameter.choices[v.OneOf(parameter.choices)]);
    });
  }
  value.Fields(fields);
  if (read.name.empty()) read.name = read.kind->name();
  return read;
}

SweepView ReadView(const JsonValue& value, std::size_t index) {
  SweepView read{fmt::format("view {}", index + 1), {}};
  auto fields = ViewFields(read.view);
  fields.insert(fields.begin(), {"name", [&](const JsonValue& v) { read.name = v.Text(); }});
  value.Fields(fields);
  if (const Status status = Validate(read.view); !status.ok()) value.Complain(status.message());
  return read;
}

SweepPolicy ReadPolicy(const JsonValue& value) {
  SweepPolicy read;
  Policy& policy = read.policy;
  policy.groups = 1;
  value.Fields({{"name", [&](const JsonValue& v) { read.name = v.Text(); }},
                {"decomposition", [&](const JsonValue& v) { policy.decomposition = ReadName(v, Decompositions()); }},
                {"split", [&](const JsonValue& v) { policy.load_metric = ReadName(v, LoadMetrics()); }},
                {"assignment", [&](const JsonValue& v) { policy.assignment = ReadName(v, Assignments()); }},
                {"axis", [&](const JsonValue& v) { policy.axis = AxisChoice(v.OneOf(kAxisChoiceNames)); }},
                {"balance", [&](const JsonValue& v) { policy.balance = NamesIn(BalanceModes())[v.OneOf(NamesIn(BalanceModes()))]; }},
                {"pixel_error",
                 [&](const JsonValue& v) {
                   policy.pixel_error = v.Number({0, kMaxPixelError});
                 }},
                {"groups", [&](const JsonValue& v) { policy.groups = v.Is(kAutomatic) ? 0 : v.Integer(0, kMaxGroups); }},
                {"teams", [&](const JsonValue& v) { policy.teams = v.Integer(1, kMaxTeams); }},
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

// A simulated frame has one kind of team.
void CheckTeamsAreEqual(const Sweep& sweep, std::optional<std::string>& mistake) {
  for (std::size_t i = 0; i < sweep.policies.size(); ++i) {
    for (const int p : sweep.workers) {
      const int teams = sweep.policies[i].policy.teams;
      if (teams < p && p % teams != 0 && !mistake) mistake = fmt::format("policies[{}].teams: {} must divide {} workers", i, teams, p);
    }
  }
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
  std::string text = fmt::format("{} by {}, {}, {}, {} groups, {}", policy.decomposition, LoadMetricOf(policy), policy.assignment,
                                 policy.balance, policy.groups == 0 ? kAutomatic : std::to_string(policy.groups), policy.combine);
  if (policy.axis != AxisChoice::kAuto) text += fmt::format(", axis {}", NameOf(policy.axis));
  if (policy.teams > 1) text += fmt::format(", {} teams", policy.teams);
  if (policy.pixel_error > 0) text += fmt::format(", error {}", policy.pixel_error);
  return text;
}

std::vector<SweepFrame> FramesOf(const Sweep& sweep) {
  std::vector<SweepFrame> frames;
  for (const BenchCase& volume : sweep.volumes) {
    for (const SweepRenderer& renderer : sweep.renderers) {
      for (const SweepView& view : sweep.views) {
        for (const SweepPolicy& policy : sweep.policies) {
          SweepFrame& made = frames.emplace_back();
          made.frame = {volume, sweep.size, view.view, policy.policy, 1, renderer.look};
          made.frame.volume.renderer = renderer.kind;
          made.names = {{"part", fmt::format("{}, {}, {}", volume.name, renderer.name, view.name)},
                        {"volume", volume.name},
                        {"view", view.name},
                        {"variant", policy.name}};
        }
      }
    }
  }
  return frames;
}

Result<Sweep> ParseSweep(const std::string& path, std::string_view text, SweepPlace place) {
  const Result<Json> parsed = ParseJson(text);
  if (!parsed.ok()) return Status::InvalidArgument(fmt::format("FILE '{}': {}", path, parsed.status().message()));
  const Json& json = *parsed;
  std::optional<std::string> mistake;
  Sweep sweep;
  const JsonValue file(json, "", mistake);
  for (const char* own : {"workers", "links", "hosts"}) {
    if (place == SweepPlace::kAtService && file.Has(own))
      mistake = fmt::format("'{}': a running service has its own, so leave them out", own);
  }
  file.Fields(
      {{"title", [&](const JsonValue& v) { sweep.title = v.Text(); }},
       {"size", [&](const JsonValue& v) { ReadSize(v, sweep.size); }},
       {"volumes", [&](const JsonValue& v) { v.Each([&](const JsonValue& e) { sweep.volumes.push_back(ReadVolume(e, place)); }); }},
       {"renderers", [&](const JsonValue& v) { v.Each([&](const JsonValue& e) { sweep.renderers.push_back(ReadRenderer(e)); }); }},
       {"views", [&](const JsonValue& v) { v.Each([&](const JsonValue& e) { sweep.views.push_back(ReadView(e, sweep.views.size())); }); }},
       {"policies", [&](const JsonValue& v) { v.Each([&](const JsonValue& e) { sweep.policies.push_back(ReadPolicy(e)); }); }},
       {"workers",
        [&](const JsonValue& v) { v.Each([&](const JsonValue& e) { sweep.workers.push_back(e.Integer(1, kMaxSweepWorkers)); }); }},
       {"hosts",
        [&](const JsonValue& v) {
          constexpr std::array<std::string_view, 2> kTraffic = {"plain", "encrypted"};
          v.Fields({{"cores", [&](const JsonValue& c) { sweep.host.cores = c.Integer(1, kMaxHostCores); }},
                    {"traffic", [&](const JsonValue& t) { sweep.host.encrypted = t.OneOf(kTraffic) == 1; }}});
        }},
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
    const bool from_service = place == SweepPlace::kAtService && needed == std::string_view("workers");
    if (!mistake && !from_service && !json.contains(needed)) mistake = fmt::format("'{}' is missing", needed);
  }
  if (sweep.title.empty()) sweep.title = "Sweep";
  if (sweep.renderers.empty()) sweep.renderers = {{.name = std::string(kDefaultRenderer)}};
  if (sweep.views.empty()) sweep.views = {{"view 1", BenchView(Projection::kOrthographic, 1, 12)}};
  if (sweep.links.empty() && place == SweepPlace::kHere) sweep.links = {{"10gbit", *ParseLink("link", "10gbit")}};
  CheckNamesDiffer(sweep.volumes, "volumes", mistake);
  CheckNamesDiffer(sweep.renderers, "renderers", mistake);
  CheckNamesDiffer(sweep.views, "views", mistake);
  CheckNamesDiffer(sweep.policies, "policies", mistake);
  CheckNamesDiffer(sweep.links, "links", mistake);
  CheckTeamsAreEqual(sweep, mistake);
  const std::size_t machines = place == SweepPlace::kHere ? sweep.workers.size() * sweep.links.size() : 1;
  const std::size_t cases = sweep.volumes.size() * sweep.renderers.size() * sweep.views.size() * sweep.policies.size() * machines;
  if (!mistake && cases > kMaxSweepCases) mistake = fmt::format("{} cases are too many: at most {}", cases, kMaxSweepCases);
  if (mistake) return Printable(Status::InvalidArgument(fmt::format("FILE '{}': {}", path, *mistake)));
  return sweep;
}

Result<Sweep> ReadSweep(const std::string& path, SweepPlace place) {
  const Result<std::string> text = ReadTextFile(path, kMaxSweepBytes);
  if (!text.ok()) return Status(text.status().code(), "FILE " + text.status().message());
  return ParseSweep(path, *text, place);
}

}  // namespace slabstream
