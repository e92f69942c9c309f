#include "laboratory/experiments/sweep_file.h"

#include <fmt/format.h>

#include <array>
#include <filesystem>
#include <optional>
#include <set>
#include <utility>

#include "client/request/json_value.h"
#include "client/request/request_options.h"
#include "client/request/volume_argument.h"
#include "common/base/printable.h"
#include "common/files/files.h"
#include "common/json/json.h"
#include "common/planning/policy_names.h"
#include "common/renderers/registry.h"
#include "common/wire/validate_request.h"

namespace slabstream {
namespace {

constexpr int kMaxSphere = 1024, kMaxHostCores = 1024;

// What was parsed of a value; a default and a complaint if it could not be.
template <class T>
T Taken(const JsonValue& value, Result<T> parsed) {
  if (parsed.ok()) return *std::move(parsed);
  value.Complain(parsed.status().message());
  return {};
}

// Reads a list, entry by entry.
template <class T>
JsonValue::Read Into(std::vector<T>& list, std::function<T(const JsonValue&)> read) {
  return
      [&list, read = std::move(read)](const JsonValue& value) { value.Each([&](const JsonValue& entry) { list.push_back(read(entry)); }); };
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
                {source, [&](const JsonValue& v) { volume = Taken(v, ParseBenchCase(v.Text(), place == SweepPlace::kAtService)); }},
                {"transfer",
                 [&](const JsonValue& v) {
                   transfer_name = v.Text();
                   transfer.choice = Taken(v, ParseTransfer("transfer", transfer_name));
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

// The name of a renderer, or an object with the parameters of that renderer and what else decides the look: at a service also which fields
// of its datasets show, and how.
SweepRenderer ReadRenderer(const JsonValue& value, SweepPlace place) {
  const auto kind_of = [](const JsonValue& v) { return Renderers()[v.OneOf(RendererNames())]; };
  SweepRenderer read;
  if (value.Shown().starts_with('"')) {
    read.kind = kind_of(value);
    read.name = read.kind->name();
    return read;
  }
  auto fields = OptionFields(read.look, {"parameters.", "shading.", "termination"});
  for (auto& [name, take] : OptionFields(read.look, {"channels", "fields.", "blend", "time"})) {
    if (place == SweepPlace::kHere) {
      take = [name = name](const JsonValue& v) {
        v.Complain(fmt::format("'{}' is of datasets of a service; a file may be one channel at one time: \"FILE?channel=1,time=2\"", name));
      };
    }
    fields.emplace_back(name, std::move(take));
  }
  fields.emplace_back("name", [&](const JsonValue& v) { read.name = v.Text(); });
  fields.emplace_back("renderer", [&](const JsonValue& v) { read.kind = kind_of(v); });
  value.Fields(fields);
  if (const auto parameters = ParseParameters(*read.kind, read.look.parameters); !parameters.ok()) {
    value.Complain(parameters.status().message());
  }
  if (read.name.empty()) read.name = read.kind->name();
  return read;
}

SweepView ReadView(const JsonValue& value, std::size_t index) {
  SweepView read{fmt::format("view {}", index + 1), {}};
  FrameRequest request;
  auto fields = OptionFields(request, {"view."});
  fields.emplace_back("name", [&](const JsonValue& v) { read.name = v.Text(); });
  value.Fields(fields);
  if (const Status status = Validate(request.view); !status.ok()) value.Complain(status.message());
  read.view = request.view;
  return read;
}

NamedPolicy ReadPolicy(const JsonValue& value) {
  NamedPolicy read;
  FrameRequest request;
  request.policy.groups = 1;
  auto fields = OptionFields(request, {"policy."});
  fields.emplace_back("name", [&](const JsonValue& v) { read.name = v.Text(); });
  value.Fields(fields);
  read.policy = request.policy;
  if (read.name.empty()) read.name = Describe(read.policy);
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
  std::string text = fmt::format("{} by {}, {}, {}, {} groups, {}", policy.decomposition, BalanceByOf(policy), policy.assignment,
                                 policy.balance, policy.groups == 0 ? kAutomatic : std::to_string(policy.groups),
                                 policy.combine.empty() ? "combined as the service does" : policy.combine);
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
        for (const NamedPolicy& policy : sweep.policies) {
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
  file.Fields({{"title", [&](const JsonValue& v) { sweep.title = v.Text(); }},
               {"size", [&](const JsonValue& v) { ReadSize(v, sweep.size); }},
               {"volumes", Into<BenchCase>(sweep.volumes, [&](const JsonValue& v) { return ReadVolume(v, place); })},
               {"renderers", Into<SweepRenderer>(sweep.renderers, [&](const JsonValue& v) { return ReadRenderer(v, place); })},
               {"views", Into<SweepView>(sweep.views, [&](const JsonValue& v) { return ReadView(v, sweep.views.size()); })},
               {"policies", Into<NamedPolicy>(sweep.policies, ReadPolicy)},
               {"workers", Into<int>(sweep.workers, [](const JsonValue& v) { return v.Integer(1, kMaxSweepWorkers); })},
               {"hosts",
                [&](const JsonValue& v) {
                  constexpr std::array<std::string_view, 2> kTraffic = {"plain", "encrypted"};
                  v.Fields({{"cores", [&](const JsonValue& c) { sweep.host.cores = c.Integer(1, kMaxHostCores); }},
                            {"traffic", [&](const JsonValue& t) { sweep.host.encrypted = t.OneOf(kTraffic) == 1; }}});
                }},
               {"links", Into<SweepLink>(sweep.links, [](const JsonValue& v) {
                  const std::string name = v.Text();
                  return SweepLink{name, Taken(v, ParseLink("link", name))};
                })}});
  for (const char* needed : {"volumes", "policies", "workers"}) {
    const bool from_service = place == SweepPlace::kAtService && needed == std::string_view("workers");
    if (!mistake && !from_service && !json.contains(needed)) mistake = fmt::format("'{}' is missing", needed);
  }
  if (sweep.title.empty()) sweep.title = "Sweep";
  if (sweep.renderers.empty()) sweep.renderers = {{.name = std::string(DefaultRenderer().name())}};
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
