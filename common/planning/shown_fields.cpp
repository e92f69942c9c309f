#include "common/planning/shown_fields.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <ranges>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>

#include "common/base/did_you_mean.h"
#include "common/base/printable.h"
#include "common/text/parse_number.h"

namespace slabstream {
namespace {

// Of channels that have no colour of their own, by number.
constexpr std::array<Rgb, 8> kChannelColors = {
    {{1, 0, 1}, {0, 1, 0}, {0, 1, 1}, {1, 1, 0}, {1, 0, 0}, {0.2F, 0.4F, 1}, {1, 0.5F, 0}, {1, 1, 1}}};
constexpr std::array<Rgb, 3> kComponentColors = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};  // by kComponentNames
constexpr int kShownUnasked = 4;                                                      // channels, if the dataset says nothing of them
constexpr double kTopOpacity = 0.25;                                                  // of a voxel length of the strongest value
constexpr double kLow = 10, kHigh = 99.5;  // percentiles of values above the background that are dark and bright

std::string NameOf(const DatasetFields& dataset, int number) {
  const std::string& name = dataset.fields[std::size_t(number)].name;
  return name.empty() ? fmt::format("{}", number) : fmt::format("{} ({})", number, Printable(name));
}

// A field of values, by name or by number.
Result<int> FieldNamed(const std::string& text, const FrameRequest& request, const DatasetFields& dataset) {
  const auto values = std::span(dataset.fields).first(std::size_t(dataset.values()));
  const auto named = std::ranges::find(values, text, &FieldInfo::name);
  if (named != values.end()) return int(named - values.begin());
  if (const auto number = ParseNumber<int>(text); number && *number >= 0 && *number < dataset.values()) return *number;
  constexpr int kMostNamed = 12;
  std::vector<std::string> names, all;
  for (int i = 0; i < dataset.values(); ++i) {
    if (i < kMostNamed) names.push_back(NameOf(dataset, i));
    all.push_back(dataset.fields[std::size_t(i)].name);
  }
  const std::string more = all.size() > names.size() ? fmt::format(" and {} more", all.size() - names.size()) : "";
  return Status::InvalidArgument(fmt::format("dataset \"{}\" has no field '{}': it has {}{}{}", request.dataset, Printable(text),
                                             fmt::join(names, ", "), more, DidYouMean(text, all)));
}

bool SaysWhatShows(const DatasetFields& dataset) {
  return std::ranges::any_of(dataset.fields,
                             [](const FieldInfo& field) { return field.channel && (field.color || field.window || !field.shown); });
}

// "3.5s": a number and a unit of time, in seconds.
std::optional<double> Seconds(double number, std::string_view unit) {
  struct Unit {
    std::string_view name;
    double seconds;
  };
  constexpr std::array<Unit, 9> kUnits = {
      {{"ns", 1e-9}, {"us", 1e-6}, {"\u00b5s", 1e-6}, {"ms", 1e-3}, {"s", 1}, {"min", 60}, {"h", 3600}, {"d", 86400}, {"a", 31557600}}};
  const auto found = std::ranges::find(kUnits, unit, &Unit::name);
  return found == kUnits.end() ? std::nullopt : std::optional(number * found->seconds);
}

// The looks of fields of values.
auto ChoicesOfValues(const FrameRequest& request) {
  return request.fields | std::views::filter([](const FieldChoice& choice) { return !choice.labels; });
}

const FieldChoice* ChoiceOf(const FrameRequest& request, const DatasetFields& dataset, int number) {
  for (const FieldChoice& choice : ChoicesOfValues(request)) {
    const Result<int> field = FieldNamed(choice.field, request, dataset);
    if (field.ok() && *field == number) return &choice;
  }
  return nullptr;
}

// From clear at range.min to `top` at range.max; in a plane, from black to the colour, opaque.
TransferFunction Ramp(const Rgb& color, const ScalarRange& range, double gamma, double top, bool plane) {
  constexpr int kParts = 16;  // of the curve, unless it is a line
  TransferFunction ramp{.colors = {}, .opacities = {}};
  const int parts = gamma == 1 ? 1 : kParts;
  for (int i = 0; i <= parts; ++i) {
    const double t = double(i) / parts, value = range.min + t * (range.max - range.min), part = std::pow(t, gamma);
    if (plane) {
      const auto dark = float(part);
      ramp.colors.push_back({value, {dark * color.r, dark * color.g, dark * color.b}});
    } else {
      ramp.opacities.push_back({value, top * part});
    }
  }
  if (plane) ramp.opacities = {{range.min, 1}};
  if (!plane) ramp.colors = {{range.min, color}};
  return ramp;
}

}  // namespace

std::string TitleOf(const ShownFields& shown, int number) {
  if (shown.dataset == nullptr) return "volume";
  const std::vector<FieldInfo>& fields = shown.dataset->fields;
  const std::string& name = fields[std::size_t(number)].name;
  if (!name.empty()) return name;
  return std::ranges::count(fields, true, &FieldInfo::channel) > 1 ? fmt::format("channel {}", number) : "volume";
}

Result<FieldNumbers> FieldsToShow(const FrameRequest& request, const DatasetFields& dataset) {
  const int count = dataset.values();
  std::vector<bool> shows(std::size_t(count), false);
  if (request.channels.empty()) {
    const bool any = std::ranges::any_of(dataset.fields, [](const FieldInfo& field) { return field.channel && field.shown; });
    const bool said = any && SaysWhatShows(dataset);  // a file that shows nothing says nothing
    int shown = 0;
    for (int i = 0; i < count; ++i) {
      const FieldInfo& field = dataset.fields[std::size_t(i)];
      shows[std::size_t(i)] = field.channel && (field.shown || !any) && shown < (said ? int(kMaxShownFields) : kShownUnasked);
      shown += shows[std::size_t(i)] ? 1 : 0;
    }
  }
  for (const std::string& channel : request.channels) {
    const Result<int> number = FieldNamed(channel, request, dataset);
    if (!number.ok()) return number.status();
    shows[std::size_t(*number)] = true;
  }
  std::vector<const FieldChoice*> named(std::size_t(count), nullptr);
  for (const FieldChoice& choice : ChoicesOfValues(request)) {
    const Result<int> number = FieldNamed(choice.field, request, dataset);
    if (!number.ok()) return number.status();
    if (const FieldChoice* const other = std::exchange(named[std::size_t(*number)], &choice)) {
      return Status::InvalidArgument(fmt::format("field {} of dataset \"{}\" has two looks, as '{}' and as '{}'", *number, request.dataset,
                                                 Printable(other->field), Printable(choice.field)));
    }
    const bool named_alone = !dataset.fields[std::size_t(*number)].channel;  // to name it shows it
    if (choice.shown || named_alone) shows[std::size_t(*number)] = choice.shown.value_or(true);
    if (choice.weight == 0) shows[std::size_t(*number)] = false;
  }
  FieldNumbers found;
  std::vector<int>& numbers = found.numbers;
  for (int i = 0; i < count; ++i) {
    if (shows[std::size_t(i)]) numbers.push_back(i);
  }
  found.volume_shows = !numbers.empty() && dataset.fields[std::size_t(numbers.front())].channel;
  if (!found.volume_shows) numbers.insert(numbers.begin(), 0);
  if (numbers.size() > kMaxShownFields) {
    return Status::InvalidArgument(
        fmt::format("{} fields of dataset \"{}\" would show, at most {} can", numbers.size(), request.dataset, kMaxShownFields));
  }
  return found;
}

Result<int> TimeToShow(const FrameRequest& request, const DatasetFields& dataset) {
  const TimeAxis& times = dataset.times;
  if (request.time.empty()) return dataset.time;
  if (request.time == kLastTime) return times.count - 1;
  const auto wrong = [&](const std::string& why) {
    return Status::InvalidArgument(fmt::format("time is '{}', {}", Printable(request.time), why));
  };
  const std::string there = times.count == 1 ? fmt::format("but dataset \"{}\" has one time, 0", request.dataset)
                                             : fmt::format("but dataset \"{}\" has times 0 to {}", request.dataset, times.count - 1);
  if (const auto number = ParseNumber<int>(request.time))
    return *number >= 0 && *number < times.count ? Result<int>(*number) : wrong(there);
  const std::size_t unit = std::min(request.time.find_first_not_of("0123456789.+-eE"), request.time.size());
  const auto number = ParseNumber<double>(request.time.substr(0, unit));
  const std::optional<double> seconds = number ? Seconds(*number, request.time.substr(unit)) : std::nullopt;
  if (!seconds) return wrong("but must be a number, a number with a unit such as 3.5s, or last");
  const std::optional<double> step = times.step ? Seconds(*times.step, times.unit) : std::nullopt;
  if (!step) return wrong(fmt::format("but dataset \"{}\" does not tell when its times were: name one by its number", request.dataset));
  const double nearest = std::round(*seconds / *step);
  if (!(nearest >= 0 && nearest < times.count))
    return wrong(
        fmt::format("but dataset \"{}\" has times from 0 to {:g} {}", request.dataset, (times.count - 1) * *times.step, times.unit));
  return int(nearest);
}

Result<ShownAtTime> WhatShows(const FrameRequest& request, std::shared_ptr<const DatasetFields> dataset) {
  static const auto kOneField = std::make_shared<const DatasetFields>();
  if (dataset == nullptr) dataset = kOneField;
  Result<FieldNumbers> shown = FieldsToShow(request, *dataset);
  if (!shown.ok()) return shown.status();
  const Result<int> time = TimeToShow(request, *dataset);
  if (!time.ok()) return time.status();
  ShownAtTime found{.fields = {.dataset = std::move(dataset), .volume = shown->numbers.front(), .volume_shows = shown->volume_shows},
                    .numbers = std::move(shown->numbers),
                    .time = *time};
  for (const int number : found.numbers) {
    if (number != found.fields.volume) found.fields.others.push_back({.number = number});
  }
  const bool alone = HasLabelsAlone(*found.fields.dataset);
  if (alone) found.fields.volume_shows = false;
  if (LabelsOf(request) != nullptr || alone) {
    const std::optional<int> labels = found.fields.dataset->labels();
    if (!labels) {
      return Status::InvalidArgument(
          fmt::format("dataset \"{}\" has no labels: it cannot be shown with --label-mode, --label-tint, --label-opacity or --labels-shown",
                      request.dataset));
    }
    found.numbers.push_back(*labels);
    found.fields.others.push_back({.number = *labels, .labels = true});
  }
  return found;
}

Result<bool> ShowsAsChannel(const FrameRequest& request, const ShownFields& shown) {
  if (shown.dataset == nullptr) return false;
  const std::vector<FieldInfo>& fields = shown.dataset->fields;
  const auto* preset = std::get_if<std::string>(&request.transfer.choice);
  const bool usual = preset != nullptr && (*preset == kAutomatic || (request.clipping.slab && *preset == "window"));  // that of slices
  const bool said =
      !usual || request.transfer.scalar_range || !request.transfer.isosurfaces.empty() || !request.transfer.gradient_opacities.empty();
  if (said && HasLabelsAlone(*shown.dataset)) {
    return Status::InvalidArgument(fmt::format(
        "dataset \"{}\" has labels and no values, which transfer, scalar-range, isovalue and gradient-opacity are about", request.dataset));
  }
  const bool own = ChoiceOf(request, *shown.dataset, shown.volume) != nullptr;
  const FieldInfo& volume = fields[std::size_t(shown.volume)];
  const bool names_channel = std::ranges::any_of(ChoicesOfValues(request), [&](const FieldChoice& choice) {
    const Result<int> number = FieldNamed(choice.field, request, *shown.dataset);
    return number.ok() && fields[std::size_t(*number)].channel;
  });
  if (!said)
    return own || !request.channels.empty() || (fields.size() > 1 && volume.channel && (volume.color || names_channel)) ||
           std::ranges::any_of(shown.others, [&](const FieldVolume& other) { return fields[std::size_t(other.number)].channel; });
  const auto others =
      std::ranges::count_if(shown.others, [&](const FieldVolume& other) { return fields[std::size_t(other.number)].channel; });
  if (others == 0 && !own) return false;
  if (others == 0) return Status::InvalidArgument("the transfer function is given twice: by transfer and by the look of the field");
  return Status::InvalidArgument(fmt::format(
      "transfer is that of one channel, but {} of dataset \"{}\" show: show one, or give each its own look", others + 1, request.dataset));
}

Result<FieldLook> LookOf(const FrameRequest& request, const DatasetFields& dataset, int number, const VolumeSummary& summary, bool full) {
  const FieldInfo& field = dataset.fields[std::size_t(number)];
  const FieldChoice* const found = ChoiceOf(request, dataset, number);
  const FieldChoice choice = found != nullptr ? *found : FieldChoice{};
  FieldLook look{.transfer = {}, .range = summary.range, .weight = choice.weight, .blend = request.blend};
  if (look.blend == Blend::kAuto || look.blend == Blend::kMax) look.blend = field.channel ? Blend::kAdd : Blend::kOver;
  const auto* const preset = std::get_if<std::string>(&choice.choice);
  // An overlay has no colour of its own.
  const bool ramp = preset != nullptr && *preset == kAutomatic && (field.channel || field.color || choice.color);
  std::optional<ScalarRange> range = choice.scalar_range;
  if (ramp) {
    if (!range && field.window) range = ScalarRange{double(field.window->min), double(field.window->max)};
    ScalarRange shown = InDataValues(range.value_or(ScalarRange{kLow, kHigh, true}), summary);
    if (!(shown.min < shown.max)) shown = {double(summary.range.min), double(summary.range.max)};
    Rgb color = kChannelColors[std::size_t(number) % kChannelColors.size()];
    const auto component = std::ranges::find(kComponentNames, field.name);
    if (component != kComponentNames.end()) color = kComponentColors.at(std::size_t(component - kComponentNames.begin()));
    if (field.color) color = {(*field.color)[0], (*field.color)[1], (*field.color)[2]};
    look.transfer = Ramp(choice.color.value_or(color), shown, choice.gamma, full ? 1 : kTopOpacity, request.clipping.slab.has_value());
  } else {
    Result<TransferFunction> transfer =
        preset != nullptr ? MakePreset(*preset, summary) : Result<TransferFunction>(std::get<TransferFunction>(choice.choice));
    if (!transfer.ok()) return transfer.status();
    if (range) transfer = Stretched(*std::move(transfer), InDataValues(*range, summary));
    look.transfer = *std::move(transfer);
  }
  if (!look.transfer.regions.empty()) {
    return Status::InvalidArgument(fmt::format(
        "field {} has a two-dimensional transfer function, which only the field of a picture of one has", NameOf(dataset, number)));
  }
  const auto finite = [](const auto& points) {
    return std::ranges::all_of(points, [](const auto& point) { return std::isfinite(point.value); });
  };
  if (!finite(look.transfer.colors) || !finite(look.transfer.opacities)) {
    return Status::InvalidArgument(
        fmt::format("the transfer function of field {} has points at values that are no numbers: they are too close to each other",
                    NameOf(dataset, number)));
  }
  look.transfer.isosurfaces.clear();
  look.transfer.gradient_opacities.clear();
  look.transfer.material.reset();
  return look;
}

}  // namespace slabstream
