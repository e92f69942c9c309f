#include "data/volume_io/nrrd_axes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <sstream>
#include <string_view>

#include "common/text/parse_number.h"
#include "common/text/trimmed.h"

namespace slabstream {
namespace {

enum class Role { kSpace, kTime, kOther };

struct NrrdAxis {
  double size = 1;
  std::string kind;  // in lower case; "": not stated
  Role role = Role::kSpace;
  Vec3 direction;
  std::optional<double> time_step;  // along time, in a space that has it
};

// Of a kind that is stated.
Role RoleOfKind(const std::string& kind) {
  if (kind == "time") return Role::kTime;
  return kind == "domain" || kind == "space" || kind == "???" || kind == "none" ? Role::kSpace : Role::kOther;
}

// "none (1,0,0) (0,2,0)": a vector for each axis, empty for none. Nothing but not-a-numbers is none, too. No value: malformed.
std::optional<std::vector<std::vector<double>>> ParseVectors(std::string_view text) {
  constexpr std::string_view kBlanks = " \t";
  std::vector<std::vector<double>> vectors;
  for (text = Trimmed(text); !text.empty(); text = Trimmed(text)) {
    const bool none = ToLower(std::string(text.substr(0, 4))) == "none";
    const std::size_t end = none ? 4 : text.find(')');
    if (end == std::string_view::npos || (!none && text.front() != '(')) return std::nullopt;
    std::vector<double> vector;
    if (!none) {
      std::istringstream numbers{std::string(text.substr(1, end - 1))};
      for (std::string number; std::getline(numbers, number, ',');) {
        const std::optional<double> parsed = ParseNumber<double>(Trimmed(number));
        if (!parsed) return std::nullopt;
        vector.push_back(*parsed);
      }
      if (vector.empty()) return std::nullopt;
      if (std::ranges::all_of(vector, [](double number) { return std::isnan(number); })) vector.clear();
    }
    vectors.push_back(std::move(vector));
    text.remove_prefix(none ? end : end + 1);
    if (none && !text.empty() && kBlanks.find(text.front()) == std::string_view::npos) return std::nullopt;
  }
  return vectors;
}

// Sets roles and directions. Returns how many numbers a position has.
Result<std::size_t> ReadDirections(const TextHeader& text, const std::string& value, std::vector<NrrdAxis>& axes) {
  const auto wrong = [&](const std::string& why) { return text.NotAVolume(fmt::format("space directions is '{}', {}", value, why)); };
  const auto vectors = ParseVectors(value);
  if (!vectors || vectors->size() != axes.size()) return wrong(fmt::format("must have a vector or none for each of {} axes", axes.size()));
  std::size_t count = 0;
  for (std::size_t i = 0; i < axes.size(); ++i) {
    const std::vector<double>& vector = (*vectors)[i];
    if (vector.empty()) {
      axes[i].role = axes[i].kind == "time" ? Role::kTime : Role::kOther;
      continue;
    }
    if (count == 0) count = vector.size();
    const bool plane = count == 2 && axes.size() == 2;
    if (vector.size() != count || (count < 3 && !plane) || count > 4) return wrong("must have vectors of 3 numbers, or of 4 with time");
    axes[i].direction = {vector[0], vector[1], plane ? 0 : vector[2]};
    const double time = count == 4 ? vector[3] : 0;
    axes[i].role = time != 0 && axes[i].direction == Vec3{} ? Role::kTime : Role::kSpace;
    if (axes[i].role == Role::kTime) axes[i].time_step = time;
    if (time != 0 && axes[i].role == Role::kSpace) return wrong("has an axis that runs along space and time");
  }
  return count;
}

void TakeKinds(const std::vector<double>& sizes, bool stated, std::vector<NrrdAxis>& axes, std::vector<std::string>& notes) {
  for (NrrdAxis& axis : axes) {
    if (!axis.kind.empty()) axis.role = RoleOfKind(axis.kind);
  }
  // As short as a colour.
  if (!stated && axes.size() == 4 && (sizes.front() == 3 || sizes.front() == 4)) {
    axes.front().role = Role::kOther;
    notes.push_back(fmt::format("states no kinds: the first of four axes, of {}, is taken for the components of a voxel", sizes.front()));
  }
  // Of more than three axes of space, those behind are times.
  int space = 0;
  for (NrrdAxis& axis : axes) {
    if (axis.role == Role::kSpace && ++space > 3) axis.role = Role::kTime;
  }
}

}  // namespace

Result<NrrdAxes> ReadNrrdAxes(const TextHeader& text) {
  const auto sizes = text.Sizes("dimension", "sizes");
  if (!sizes.ok()) return sizes.status();
  std::vector<NrrdAxis> all(sizes->size());
  std::istringstream kinds(ToLower(text.Find("kinds").value_or("")));
  for (std::size_t i = 0; i < all.size(); ++i) {
    all[i].size = (*sizes)[i];
    kinds >> all[i].kind;
  }
  NrrdAxes axes;
  if (const auto directions = text.Find("space directions")) {
    const Result<std::size_t> count = ReadDirections(text, *directions, all);
    if (!count.ok()) return count.status();
    axes.space_numbers = *count;
  } else {
    TakeKinds(*sizes, text.Find("kinds").has_value(), all, axes.notes);
  }

  const auto is_space = [](const NrrdAxis& axis) { return axis.role == Role::kSpace; };
  const auto first = std::ranges::find_if(all, is_space);
  const auto count = std::ranges::count_if(all, is_space);
  const bool is_slice = count == 2 && is_space(all.back());
  if (count != 3 && !is_slice) return text.NotAVolume(fmt::format("has {} axes of space, must have 3, or 2 of a slice", count));
  axes.first = std::size_t(first - all.begin());
  std::array<Vec3, 3> steps;
  std::size_t found = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const NrrdAxis& axis = all[i];
    if (is_space(axis)) {
      steps[found++] = axis.direction;
      axes.sizes.push_back(axis.size);
    } else if (found == 0) {
      axes.components *= axis.size;
    } else if (found == 3) {
      // A list is that of a series of volumes.
      const bool channels = axis.role == Role::kOther && !axis.kind.empty() && axis.kind != "list" && RoleOfKind(axis.kind) == Role::kOther;
      if (axis.size != 1 && axes.channels != 1) {
        return text.Refused(fmt::format("axis {} of {} lies behind one of channels: not supported", i + 1, all.size()));
      }
      if (channels) {
        axes.channels = axis.size;
      } else {
        axes.sizes.push_back(axis.size);
      }
    } else if (axis.size != 1) {
      return text.Refused(fmt::format("axis {} of {} lies between axes of space, but is none of them: not supported", i + 1, all.size()));
    }
  }
  const auto is_time = [](const NrrdAxis& axis) { return axis.role == Role::kTime; };
  if (std::ranges::count_if(all, is_time) == 1) {
    const auto time = std::ranges::find_if(all, is_time);
    axes.time = std::size_t(time - all.begin());
    axes.time_step = time->time_step;
  }
  if (is_slice) {
    steps[2] = Length(steps[0]) * Normalized(Cross(steps[0], steps[1]));  // as thick as its first pixel is wide
    axes.sizes.push_back(1);
  }
  if (text.Find("space directions")) axes.directions = steps;
  return axes;
}

}  // namespace slabstream
