#include "data/volume_io/dicom_stack.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <set>
#include <utility>

#include "common/text/parse_number.h"
#include "data/volume_io/raw_volume.h"
#include "data/volume_io/stated_field.h"
#include "data/volume_io/world_placement.h"

namespace slabstream {
namespace {

Status Refused(const std::string& why) { return Status::InvalidArgument(why); }

double LargestPart(const Vec3& v) { return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}); }

Status CheckPlace(const DicomSlice& slice) {
  const DicomFrame& frame = *slice.frame;
  if (!frame.position || !frame.directions) {
    return Refused(fmt::format("{} has no {}: its slices have no place", slice.name,
                               frame.position ? "ImageOrientationPatient" : "ImagePositionPatient"));
  }
  if (!IsFinite(*frame.position)) return Refused(fmt::format("{}: ImagePositionPatient is {}", slice.name, InBrackets(*frame.position)));
  const auto& [row, column] = *frame.directions;
  // Written so that NaN is refused.
  const bool sound = std::abs(Length(row) - 1) < 0.01 && std::abs(Length(column) - 1) < 0.01 && std::abs(Dot(row, column)) < 0.01;
  if (!sound) {
    return Refused(fmt::format("{}: ImageOrientationPatient is {}, {}, must be two unit vectors at right angles", slice.name,
                               InBrackets(row), InBrackets(column)));
  }
  if (!frame.spacing) return Refused(slice.name + " has no PixelSpacing");
  const auto& [dx, dy] = *frame.spacing;
  if (dx > 0 && dy > 0 && std::isfinite(dx) && std::isfinite(dy)) return Status::Ok();
  return Refused(fmt::format("{}: PixelSpacing is {:g}, {:g}, must be positive", slice.name, dy, dx));
}

// `slice` against the first of the series.
Status CheckAlike(const DicomSlice& slice, const DicomSlice& first) {
  if (slice.columns != first.columns || slice.rows != first.rows) {
    return Refused(fmt::format("images of several sizes: {} is {} x {}, {} is {} x {}; dcm2niix separates them", slice.name, slice.columns,
                               slice.rows, first.name, first.columns, first.rows));
  }
  for (std::size_t i = 0; i < 2; ++i) {
    const Vec3 &direction = (*slice.frame->directions)[i], &wanted = (*first.frame->directions)[i];
    if (LargestPart(direction - wanted) > kMostTurned) {
      return Refused(fmt::format("images of several orientations: {} of {} are along {}, those of {} along {}; dcm2niix separates them",
                                 i == 0 ? "rows" : "columns", slice.name, InBrackets(direction), first.name, InBrackets(wanted)));
    }
    const double spacing = (*slice.frame->spacing)[i], wanted_spacing = (*first.frame->spacing)[i];
    if (std::abs(spacing - wanted_spacing) > kMostTurned * wanted_spacing) {
      return Refused(fmt::format("images of several pixel spacings: {} has {:g} mm, {} has {:g} mm; dcm2niix separates them", slice.name,
                                 spacing, first.name, wanted_spacing));
    }
  }
  return Status::Ok();
}

Status CheckAll(std::span<const DicomSlice> slices) {
  for (const DicomSlice& slice : slices) {
    if (Status status = CheckPlace(slice); !status.ok()) return status;
    if (Status status = CheckAlike(slice, slices.front()); !status.ok()) return status;
  }
  return Status::Ok();
}

Vec3 NormalOf(const DicomFrame& frame) { return Normalized(Cross((*frame.directions)[0], (*frame.directions)[1])); }

// The values of some attributes, by slice.
struct Values {
  std::vector<std::size_t> of_slice;  // numbers of `distinct`
  std::vector<std::string> distinct;  // in ascending order: of numbers, if all are
  std::string name;                   // of the attributes
};

// None: a slice lacks the attribute, or all have the same value.
std::optional<Values> ValuesOf(std::span<const DicomSlice> slices, std::size_t distinction) {
  const auto value_of = [&](const DicomSlice& slice) -> const std::string& { return slice.frame->distinctions[distinction]; };
  std::set<std::string> all;
  for (const DicomSlice& slice : slices) all.insert(value_of(slice));
  if (all.contains("") || all.size() < 2) return std::nullopt;
  Values values{.distinct = {all.begin(), all.end()}, .name = DistinctionName(distinction)};
  if (std::ranges::all_of(all, [](const std::string& text) { return ParseNumber<double>(text).has_value(); })) {
    std::ranges::stable_sort(values.distinct, {}, [](const std::string& text) { return *ParseNumber<double>(text); });
  }
  std::map<std::string, std::size_t> numbers;
  for (std::size_t i = 0; i < values.distinct.size(); ++i) numbers[values.distinct[i]] = i;
  for (const DicomSlice& slice : slices) values.of_slice.push_back(numbers[value_of(slice)]);
  return values;
}

// Milliseconds, if the attribute holds them.
TimeAxis TimesOf(const Values& values) {
  static constexpr std::string_view kMilliseconds[] = {"TriggerTime", "NominalCardiacTriggerDelayTime", "FrameReferenceTime"};
  const auto count = std::int64_t(values.distinct.size());
  if (std::ranges::find(kMilliseconds, values.name) == std::end(kMilliseconds)) return {.count = int(count)};
  std::vector<double> times;
  for (const std::string& text : values.distinct) {
    times.push_back(ParseNumber<double>(text).value_or(std::numeric_limits<double>::quiet_NaN()));
  }
  return StatedTimes(count, times, "ms");
}

// Two attributes as one, of the pairs of values that there are.
Values Both(const Values& a, const Values& b) {
  const auto pair_of = [&](std::size_t slice) { return a.of_slice[slice] * b.distinct.size() + b.of_slice[slice]; };
  std::map<std::size_t, std::size_t> numbers;
  for (std::size_t i = 0; i < a.of_slice.size(); ++i) numbers[pair_of(i)];
  Values both{.name = a.name + " and " + b.name};
  for (auto& [pair, number] : numbers) {
    number = both.distinct.size();
    both.distinct.push_back(fmt::format("{} and {}", a.distinct[pair / b.distinct.size()], b.distinct[pair % b.distinct.size()]));
  }
  for (std::size_t i = 0; i < a.of_slice.size(); ++i) both.of_slice.push_back(numbers[pair_of(i)]);
  return both;
}

// What divides slices, which lie at these places (numbers from 0), into volumes that each have one slice at every place: an attribute, or
// two of them. None: nothing does.
std::optional<Values> WhatTellsApart(std::span<const DicomSlice> slices, const std::vector<std::size_t>& places, std::size_t place_count) {
  if (slices.size() % place_count != 0) return std::nullopt;
  const std::size_t wanted = slices.size() / place_count;
  const auto divides = [&](const Values& values) {
    std::vector<bool> taken(slices.size());
    for (std::size_t i = 0; i < slices.size() && values.distinct.size() == wanted; ++i) {
      const std::size_t at = values.of_slice[i] * place_count + places[i];
      if (taken[at]) return false;
      taken[at] = true;
    }
    return values.distinct.size() == wanted;
  };
  std::vector<Values> candidates;
  for (std::size_t i = 0; i < DistinctionCount(); ++i) {
    std::optional<Values> values = ValuesOf(slices, i);
    if (!values || values->distinct.size() > wanted) continue;
    if (divides(*values)) return values;
    candidates.push_back(*std::move(values));
  }
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    for (std::size_t k = i + 1; k < candidates.size(); ++k) {
      Values both = Both(candidates[i], candidates[k]);
      if (divides(both)) return both;
    }
  }
  return std::nullopt;
}

// "EchoTime 4.6, 9.2"
std::string Text(const Values& values) {
  constexpr std::size_t kShown = 3;
  std::string text = values.name;
  for (std::size_t i = 0; i < std::min(values.distinct.size(), kShown); ++i) text += (i == 0 ? " " : ", ") + values.distinct[i];
  return text + (values.distinct.size() > kShown ? ", ..." : "");
}

// Slices by their height along the normal.
class SortedSlices {
 public:
  SortedSlices(std::span<const DicomSlice> slices, const Vec3& normal) : slices_(slices), order_(slices.size()) {
    std::iota(order_.begin(), order_.end(), std::size_t{0});
    std::vector<double> heights;
    for (const DicomSlice& slice : slices) heights.push_back(Dot(*slice.frame->position, normal));
    std::ranges::stable_sort(order_, {}, [&](std::size_t i) { return heights[i]; });
    for (const std::size_t i : order_) heights_.push_back(heights[i]);
  }

  const std::vector<std::size_t>& order() const { return order_; }
  std::size_t size() const { return order_.size(); }
  const DicomSlice& operator[](std::size_t place) const { return slices_[order_[place]]; }
  const Vec3& position(std::size_t place) const { return *(*this)[place].frame->position; }
  double height(std::size_t place) const { return heights_[place] - heights_[0]; }       // above the lowest
  double gap(std::size_t place) const { return heights_[place + 1] - heights_[place]; }  // to the next

  // The number of each slice's place, in the order of the series, and of how many places.
  std::vector<std::size_t> Places(std::size_t& count) const {
    const double least = kSamePlace * (heights_.back() - heights_.front()) / double(size() - 1);
    std::vector<std::size_t> places(size());
    count = 1;
    for (std::size_t i = 1; i < size(); ++i) {
      if (gap(i - 1) > least) ++count;
      places[order_[i]] = count - 1;
    }
    return places;
  }

  // For several slices at one place, of this many.
  Status Crowded(const std::vector<std::size_t>& places, std::size_t place_count) const {
    std::size_t begin = 0, end = 0;  // [begin, end): the first place with several
    while (places[order_[begin]] != places[order_[begin + 1]]) ++begin;
    for (end = begin + 1; end < size() && places[order_[end]] == places[order_[begin]];) ++end;
    return Refused(
        fmt::format("{} images at {} positions, {} of them at {}, such as {} and {}, and no attribute divides them into volumes; "
                    "dcm2niix may separate them",
                    size(), place_count, end - begin, InBrackets(position(begin)), (*this)[begin].name, (*this)[begin + 1].name));
  }

  // Slices that do not lie where an even stack from `origin` with these steps has them.
  Status CheckEven(const Vec3& origin, const std::array<Vec3, 3>& steps, const Vec3& normal) const {
    for (std::size_t i = 0; i < size(); ++i) {
      const Vec3 off = position(i) - origin - double(i) * steps[2];
      const double along = Dot(off, normal) / Dot(steps[2], normal);
      const Vec3 aside = off - along * steps[2];
      if (std::abs(along) > kMostOffPlace) return Uneven();
      for (std::size_t axis = 0; axis < 2; ++axis) {
        const double voxels = Dot(aside, steps[axis]) / Dot(steps[axis], steps[axis]);
        if (std::abs(voxels) > kMostOffPlace) {
          return Refused(fmt::format("{} lies {:.2g} pixels beside its place in an even stack, limit {}; dcm2niix may convert the series",
                                     (*this)[i].name, std::abs(voxels), kMostOffPlace));
        }
      }
    }
    return Status::Ok();
  }

 private:
  // Missing slices, or uneven distances?
  Status Uneven() const {
    std::vector<double> gaps;
    for (std::size_t i = 0; i + 1 < size(); ++i) gaps.push_back(gap(i));
    std::vector<double> sorted = gaps;
    std::ranges::sort(sorted);
    const double usual = sorted[(sorted.size() - 1) / 2];
    std::size_t missing = 0, first = size();
    bool whole = true;
    for (std::size_t i = 0; i < gaps.size(); ++i) {
      const double steps = std::round(gaps[i] / usual);
      whole = whole && std::abs(gaps[i] / usual - steps) <= kMostOffPlace && steps >= 1;
      if (steps < 2) continue;
      missing += std::size_t(std::min(steps, double(kMaxVolumeSide))) - 1;
      first = std::min(first, i);
    }
    if (whole && missing > 0) {
      return Refused(fmt::format("{} missing: from {} to {} it is {:g} mm, elsewhere {:g} mm; export the whole series again",
                                 missing == 1 ? "1 slice is" : fmt::format("{} slices are", missing), (*this)[first].name,
                                 (*this)[first + 1].name, gaps[first], usual));
    }
    return Refused(fmt::format(
        "the distance between slices varies from {:g} to {:g} mm; a slice may lie {} of a voxel off its place in an even stack; "
        "dcm2niix makes an even one",
        sorted.front(), sorted.back(), kMostOffPlace));
  }

  std::span<const DicomSlice> slices_;
  std::vector<std::size_t> order_;
  std::vector<double> heights_;  // in that order
};

}  // namespace

Result<DicomStack> ArrangeSlices(std::span<const DicomSlice> slices) {
  if (Status status = CheckAll(slices); !status.ok()) return status;
  if (slices.size() < 2) return Refused("a single slice, a volume has at least 2");

  const DicomSlice& any = slices.front();
  const Vec3 row = Normalized((*any.frame->directions)[0]), column = Normalized((*any.frame->directions)[1]);
  const Vec3 normal = NormalOf(*any.frame);
  const SortedSlices sorted(slices, normal);
  std::size_t count = 0;  // of slices in a volume
  const std::vector<std::size_t> places = sorted.Places(count);
  if (count > std::size_t{kMaxVolumeSide}) return Refused(fmt::format("{} slices, limit {}", count, kMaxVolumeSide));
  DicomStack stack;
  stack.order = sorted.order();
  if (count < slices.size()) {
    const std::optional<Values> apart = count < 2 ? std::nullopt : WhatTellsApart(slices, places, count);
    if (!apart) return sorted.Crowded(places, count);
    for (std::size_t i = 0; i < slices.size(); ++i) stack.order[apart->of_slice[i] * count + places[i]] = i;
    stack.times = TimesOf(*apart);
    stack.told_apart = Text(*apart);
  }
  stack.size = {any.columns, any.rows, std::int32_t(count)};
  const Vec3 first = *slices[stack.order[0]].frame->position, last = *slices[stack.order[count - 1]].frame->position;
  stack.steps = {(*any.frame->spacing)[0] * row, (*any.frame->spacing)[1] * column, (last - first) / double(count - 1)};
  for (std::size_t begin = 0; begin < slices.size(); begin += count) {
    std::vector<DicomSlice> volume;
    for (std::size_t i = begin; i < begin + count; ++i) volume.push_back(slices[stack.order[i]]);
    if (Status status = SortedSlices(volume, normal).CheckEven(first, stack.steps, normal); !status.ok()) return status;
  }
  stack.origin = kRasFromLps * first + Vec3{};  // 0 instead of -0
  for (Vec3& step : stack.steps) step = kRasFromLps * step;
  return stack;
}

Result<DicomStack> ArrangeSegments(std::span<const DicomSlice> frames) {
  if (Status status = CheckAll(frames); !status.ok()) return status;
  const DicomFrame& any = *frames.front().frame;
  const SortedSlices sorted(frames, NormalOf(any));
  const std::size_t last = frames.size() - 1;
  // The distance of slices.
  const double same = kSamePlace * any.slice_spacing.value_or((*any.spacing)[0]);
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < last; ++i) {
    if (sorted.gap(i) > same) least = std::min(least, sorted.gap(i));
  }
  if (!std::isfinite(least)) return Refused("a single slice, a volume has at least 2");
  const auto places_by = [&](double step) {
    std::vector<std::int32_t> places(frames.size());
    for (std::size_t i = 0; i <= last; ++i) {
      const double place = sorted.height(i) / step;
      if (!(place <= kMaxVolumeSide - 1) || std::abs(place - std::round(place)) > kMostOffPlace) return std::vector<std::int32_t>();
      places[sorted.order()[i]] = std::int32_t(std::round(place));
    }
    return places;
  };
  std::vector<std::int32_t> places;
  if (any.slice_spacing && *any.slice_spacing > 0) places = places_by(*any.slice_spacing);
  if (places.empty()) places = places_by(least);
  if (places.empty()) {
    return Refused(
        fmt::format("its frames do not lie in slices {:g} mm apart, as the nearest two do; dcm2niix may make an even stack", least));
  }
  // A stack without gaps, of a frame for each slice.
  const std::int32_t count = places[sorted.order()[last]] + 1;
  const Vec3 step = (sorted.position(last) - sorted.position(0)) / double(count - 1);
  std::vector<DicomFrame> filled(std::size_t(count), DicomFrame{.directions = any.directions, .spacing = any.spacing});
  for (std::int32_t z = 0; z < count; ++z) filled[std::size_t(z)].position = sorted.position(0) + double(z) * step;
  std::vector<DicomSlice> slices(std::size_t(count), frames.front());
  std::set<std::pair<std::int32_t, int>> taken;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const DicomFrame& frame = *frames[i].frame;
    if (!taken.emplace(places[i], frame.segment).second) {
      return Refused(fmt::format("{} is one of several of segment {} at {}", frames[i].name, frame.segment, InBrackets(*frame.position)));
    }
    filled[std::size_t(places[i])].position = frame.position;
    slices[std::size_t(places[i])].name = frames[i].name;
  }
  for (std::int32_t z = 0; z < count; ++z) slices[std::size_t(z)].frame = &filled[std::size_t(z)];
  Result<DicomStack> stack = ArrangeSlices(slices);
  if (!stack.ok()) return stack;
  stack->order.clear();
  stack->places = std::move(places);
  return stack;
}

}  // namespace slabstream
