#include "data/volume_io/dicom_stack.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

#include "data/volume_io/raw_volume.h"
#include "data/volume_io/world_placement.h"

namespace slabstream {
namespace {

Status Refused(const std::string& why) { return Status::InvalidArgument(why); }

double LargestPart(const Vec3& v) { return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}); }

Status CheckPlace(const DicomSlice& slice) {
  const DicomFrame& frame = *slice.frame;
  if (!frame.position || !frame.directions) {
    return Refused(fmt::format("{} has no {}: its slices have no place (a secondary capture?)", slice.name,
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

// "; EchoTime tells them apart: 4.6, 9.2", or nothing if no attribute does.
std::string Distinguished(const std::vector<const DicomFrame*>& frames) {
  for (std::size_t i = 0; i < DistinctionCount(); ++i) {
    std::set<std::string> values;
    for (const DicomFrame* frame : frames) values.insert(frame->distinctions[i]);
    if (values.size() != frames.size() || values.contains("")) continue;
    constexpr std::size_t kShown = 3;
    std::string text = fmt::format("; {} tells them apart", DistinctionName(i));
    std::size_t shown = 0;
    for (const std::string& value : values) {
      if (++shown > kShown) break;
      text += fmt::format("{} {}", shown == 1 ? ":" : ",", value);
    }
    return text + (values.size() > kShown ? ", ..." : "");
  }
  return "";
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
  double gap(std::size_t place) const { return heights_[place + 1] - heights_[place]; }  // to the next

  // Several slices at the same position.
  Status CheckDistinct() const {
    const double least = kSamePlace * (heights_.back() - heights_.front()) / double(size() - 1);
    std::size_t places = 1, begin = 0, end = 0;  // [begin, end): the first place with several
    for (std::size_t i = 0; i + 1 < size(); ++i) {
      if (gap(i) > least) {
        ++places;
      } else if (end == 0 || end == i + 1) {
        begin = end == 0 ? i : begin;
        end = i + 2;
      }
    }
    if (places == size()) return Status::Ok();
    std::vector<const DicomFrame*> frames;
    for (std::size_t i = begin; i < end; ++i) frames.push_back((*this)[i].frame);
    return Refused(fmt::format("{} images at {} positions, {} of them at {}, such as {} and {}{}; dcm2niix separates them", size(), places,
                               end - begin, InBrackets(position(begin)), (*this)[begin].name, (*this)[begin + 1].name,
                               Distinguished(frames)));
  }

  // Slices that do not lie where an even stack with these steps has them.
  Status CheckEven(const std::array<Vec3, 3>& steps, const Vec3& normal) const {
    for (std::size_t i = 0; i < size(); ++i) {
      const Vec3 off = position(i) - position(0) - double(i) * steps[2];
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
  for (const DicomSlice& slice : slices) {
    if (Status status = CheckPlace(slice); !status.ok()) return status;
    if (Status status = CheckAlike(slice, slices.front()); !status.ok()) return status;
  }
  if (slices.size() < 2) return Refused("a single slice, a volume has at least 2");
  if (slices.size() > std::size_t{kMaxVolumeSide}) return Refused(fmt::format("{} slices, limit {}", slices.size(), kMaxVolumeSide));

  const DicomSlice& any = slices.front();
  const Vec3 row = Normalized((*any.frame->directions)[0]), column = Normalized((*any.frame->directions)[1]);
  const Vec3 normal = Normalized(Cross(row, column));
  const SortedSlices sorted(slices, normal);
  if (Status status = sorted.CheckDistinct(); !status.ok()) return status;
  DicomStack stack;
  stack.size = {any.columns, any.rows, std::int32_t(slices.size())};
  stack.order = sorted.order();
  stack.steps = {(*any.frame->spacing)[0] * row, (*any.frame->spacing)[1] * column,
                 (sorted.position(slices.size() - 1) - sorted.position(0)) / double(slices.size() - 1)};
  if (Status status = sorted.CheckEven(stack.steps, normal); !status.ok()) return status;
  stack.origin = kRasFromLps * sorted.position(0) + Vec3{};  // 0 instead of -0
  for (Vec3& step : stack.steps) step = kRasFromLps * step;
  return stack;
}

}  // namespace slabstream
