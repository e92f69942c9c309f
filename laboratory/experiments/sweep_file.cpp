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

#include "client/cli/values.h"
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

// One value of the file and its place. Whatever is wrong is noted in the reader that all values of a file share; the first mistake stays,
// and what is read after it does not matter.
class Value {
 public:
  Value(const Json& json, std::string place, std::optional<std::string>& mistake)
      : json_(&json), place_(std::move(place)), mistake_(&mistake) {}

  const std::string& place() const { return place_; }
  void Complain(const std::string& what) const {
    if (!*mistake_) *mistake_ = place_.empty() ? what : fmt::format("{}: {}", place_, what);
  }
  std::string Shown() const {
    constexpr std::size_t kMost = 60;
    std::string text = json_->dump(-1, ' ', false, Json::error_handler_t::replace);
    return text.size() <= kMost ? text : text.substr(0, kMost) + "...";
  }

  // An object with no other fields than these; calls the function of each that is there.
  void Fields(const std::vector<std::pair<std::string, std::function<void(const Value&)>>>& fields) const {
    if (!json_->is_object()) return Complain(fmt::format("{} must be an object", Shown()));
    for (const auto& [name, value] : json_->items()) {
      const auto found = std::ranges::find(fields, name, &std::pair<std::string, std::function<void(const Value&)>>::first);
      if (found != fields.end()) {
        found->second(Value(value, place_.empty() ? name : place_ + "." + name, *mistake_));
        continue;
      }
      std::string known;
      for (const auto& field : fields) known += (known.empty() ? "" : ", ") + field.first;
      Complain(fmt::format("'{}' is no field; there are {}", name, known));
    }
  }
  // A list that is not empty.
  void Each(const std::function<void(const Value&)>& read) const {
    if (!json_->is_array() || json_->empty()) return Complain(fmt::format("{} must be a list of at least one", Shown()));
    for (std::size_t i = 0; i < json_->size(); ++i) read(Value((*json_)[i], fmt::format("{}[{}]", place_, i), *mistake_));
  }
  bool Has(const char* field) const { return json_->is_object() && json_->contains(field); }

  std::string Text() const {
    if (json_->is_string()) return json_->get<std::string>();
    Complain(fmt::format("{} must be a text", Shown()));
    return "";
  }
  double Number(const NumberRange& range) const {
    const double value = json_->is_number() ? json_->get<double>() : std::nan("");
    const bool inside = std::isfinite(value) && value <= range.max && (range.min_open ? value > range.min : value >= range.min);
    if (!inside) Complain(fmt::format("{} must be a number in {}{}, {}]", Shown(), range.min_open ? "(" : "[", range.min, range.max));
    return inside ? value : range.max;
  }
  int Integer(int min, int max) const {
    const bool inside = json_->is_number_integer() && json_->get<double>() >= min && json_->get<double>() <= max;
    if (!inside) Complain(fmt::format("{} must be a whole number in [{}, {}]", Shown(), min, max));
    return inside ? json_->get<int>() : min;
  }
  std::size_t OneOf(std::span<const std::string_view> names) const {
    const std::string text = Text();
    const auto found = std::ranges::find(names, text);
    if (found != names.end()) return std::size_t(found - names.begin());
    Complain(fmt::format("{} must be one of {}", Shown(), fmt::join(names, ", ")));
    return 0;
  }

 private:
  const Json* json_;
  std::string place_;
  std::optional<std::string>* mistake_;
};

template <class Entries>
std::vector<std::string_view> NamesIn(const Entries& entries) {
  std::vector<std::string_view> names;
  for (const auto& entry : entries) names.push_back(entry.name);
  return names;
}

// With the choice to leave it open.
template <class Entries>
std::string ReadName(const Value& value, const Entries& entries) {
  std::vector<std::string_view> names = NamesIn(entries);
  if (std::ranges::find(names, kAutomatic) == names.end()) names.push_back(kAutomatic);
  return std::string(names[value.OneOf(names)]);
}

BenchCase ReadVolume(const Value& value) {
  if (value.Has("sphere") == value.Has("file")) {
    value.Complain(fmt::format("{} must have either 'sphere' or 'file'", value.Shown()));
    return {};
  }
  SphereRequest sphere;
  double opacity = kTranslucentSphere;
  std::string file, transfer;
  value.Fields({{"sphere",
                 [&](const Value& v) {
                   v.Fields({{"class", [&](const Value& c) { sphere.sphere_class = SphereClass(c.Integer(1, 2)); }},
                             {"size", [&](const Value& s) { sphere.size = s.Integer(2, kMaxSphere); }},
                             {"occupancy", [&](const Value& o) {
                                sphere.occupancy = o.Number({0, 0.52, true});
                              }}});
                 }},
                {"opacity",
                 [&](const Value& v) {
                   opacity = v.Number({0, 1, true});
                 }},
                {"file", [&](const Value& v) { file = v.Text(); }},
                {"transfer", [&](const Value& v) { transfer = v.Text(); }}});
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

SweepView ReadView(const Value& value, std::size_t index) {
  SweepView read{fmt::format("view {}", index + 1), {}};
  const NumberRange angle{-kMaxAngleDegrees, kMaxAngleDegrees};
  constexpr std::array<std::string_view, 2> kProjections = {"orthographic", "perspective"};
  ViewParameters& view = read.view;
  value.Fields(
      {{"name", [&](const Value& v) { read.name = v.Text(); }},
       {"projection",
        [&](const Value& v) { view.projection = v.OneOf(kProjections) == 0 ? Projection::kOrthographic : Projection::kPerspective; }},
       {"azimuth", [&](const Value& v) { view.azimuth_degrees = v.Number(angle); }},
       {"elevation", [&](const Value& v) { view.elevation_degrees = v.Number(angle); }},
       {"roll", [&](const Value& v) { view.roll_degrees = v.Number(angle); }},
       {"zoom",
        [&](const Value& v) {
          view.zoom = v.Number({kMinZoom, kMaxZoom});
        }},
       {"fov", [&](const Value& v) {
          view.fov_degrees = v.Number({kMinFovDegrees, kMaxFovDegrees});
        }}});
  return read;
}

SweepPolicy ReadPolicy(const Value& value) {
  SweepPolicy read;
  Policy& policy = read.policy;
  policy.groups = 1;
  constexpr std::array<std::string_view, 5> kAxes = {"x", "y", "z", "auto", "view"};
  value.Fields({{"name", [&](const Value& v) { read.name = v.Text(); }},
                {"decomposition", [&](const Value& v) { policy.decomposition = ReadName(v, Decompositions()); }},
                {"split", [&](const Value& v) { policy.split = ReadName(v, WorkSplits()); }},
                {"assignment", [&](const Value& v) { policy.assignment = ReadName(v, Assignments()); }},
                {"axis", [&](const Value& v) { policy.axis = AxisChoice(v.OneOf(kAxes)); }},
                {"balance", [&](const Value& v) { policy.balance = NamesIn(BalanceModes())[v.OneOf(NamesIn(BalanceModes()))]; }},
                {"pixel_error",
                 [&](const Value& v) {
                   policy.pixel_error = v.Number({0, kMaxPixelError});
                 }},
                {"groups", [&](const Value& v) { policy.groups = v.Integer(1, kMaxGroups); }},
                {"combine", [&](const Value& v) {
                   policy.combine = v.Text();
                   if (policy.combine == kAutomatic) return;
                   if (const auto parsed = ParseCombining(policy.combine); !parsed.ok()) v.Complain(parsed.status().message());
                 }}});
  if (read.name.empty()) read.name = Describe(policy);
  return read;
}

void ReadSize(const Value& value, ImageSize& size) {
  if (value.Shown().starts_with("[")) {
    std::vector<int> sides;
    value.Each([&](const Value& v) { sides.push_back(v.Integer(1, kMaxImageSide)); });
    if (sides.size() != 2) return value.Complain(fmt::format("{} must be [width, height] or one number", value.Shown()));
    size = {sides[0], sides[1]};
  } else {
    size.width = size.height = value.Integer(1, kMaxImageSide);
  }
  if (std::int64_t(size.width) * size.height > kMaxImagePixels)
    value.Complain(fmt::format("{} has more than {} pixels", value.Shown(), kMaxImagePixels));
}

// Cases are told apart by name.
template <class T>
void CheckNamesDiffer(const std::vector<T>& entries, const char* list, std::optional<std::string>& mistake) {
  std::set<std::string> seen;
  for (const T& entry : entries) {
    if (!seen.insert(entry.name).second && !mistake) mistake = fmt::format("{}: two of them are called '{}'", list, entry.name);
  }
}

}  // namespace

std::string Describe(const Policy& policy) {
  return fmt::format("{} by {}, {}, {}, {} groups, {}{}", policy.decomposition, SplitOf(policy), policy.assignment, policy.balance,
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
  const Value file(json, "", mistake);
  file.Fields(
      {{"title", [&](const Value& v) { sweep.title = v.Text(); }},
       {"size", [&](const Value& v) { ReadSize(v, sweep.size); }},
       {"volumes", [&](const Value& v) { v.Each([&](const Value& e) { sweep.volumes.push_back(ReadVolume(e)); }); }},
       {"renderers",
        [&](const Value& v) { v.Each([&](const Value& e) { sweep.renderers.push_back(Renderers()[e.OneOf(RendererNames())]); }); }},
       {"views", [&](const Value& v) { v.Each([&](const Value& e) { sweep.views.push_back(ReadView(e, sweep.views.size())); }); }},
       {"policies", [&](const Value& v) { v.Each([&](const Value& e) { sweep.policies.push_back(ReadPolicy(e)); }); }},
       {"workers", [&](const Value& v) { v.Each([&](const Value& e) { sweep.workers.push_back(e.Integer(1, kMaxSweepWorkers)); }); }},
       {"links", [&](const Value& v) {
          v.Each([&](const Value& e) {
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

}  // namespace slabstream
