#include "coordinator/service/dataset_id.h"

#include <fmt/format.h>

#include <algorithm>
#include <span>

#include "common/mesh/mesh_part.h"
#include "common/wire/digest.h"

namespace slabstream {

namespace {

std::string OfStretch(const Stretch& stretch) {
  std::string text;
  for (const Axis axis : kAxes) {
    const std::vector<double>& knots = stretch.knots(axis);
    if (!knots.empty()) text += fmt::format(" {} {:x}", Letter(axis), Digest(std::as_bytes(std::span(knots))));
  }
  return text;
}

std::string OfDescription(const VolumeDescription& description) {
  const auto& [geometry, type, mapping] = description;
  const auto& [size, spacing, orientation, stretch] = geometry;
  const auto numbers = [](const Vec3& v) { return fmt::format("{} {} {}", v.x, v.y, v.z); };
  return fmt::format("{} {} {} {} {} {} {} {} {} {} {} {}{}", size.x, size.y, size.z, numbers(spacing), int(orientation.world),
                     numbers(orientation.origin), numbers(orientation.axes[0]), numbers(orientation.axes[1]), numbers(orientation.axes[2]),
                     int(type), mapping.scale, mapping.offset, OfStretch(stretch));
}

DatasetId IdOf(const std::string& text) { return std::max<DatasetId>(Digest(std::as_bytes(std::span(text))), 1); }

}  // namespace

DatasetId IdOf(const std::string& name, const VolumeDescription& description, const StoredAt& stored) {
  return IdOf(fmt::format("{} {} {} {:x} {}", OfDescription(description), stored.source, stored.level, stored.version, name));
}

DatasetId IdOf(const std::string& name, const Volume& volume, const LabelTable* labels, const ExactSamples* exact, const GridCells* cells) {
  std::string of_labels;
  for (const Label& label : labels == nullptr ? std::vector<Label>() : labels->labels) {
    of_labels += fmt::format(" {} {} {} {} {}", label.value, label.color[0], label.color[1], label.color[2], label.name);
  }
  const std::string text =
      fmt::format("{} {} {:x} {}", OfDescription(volume.description), volume.block.bytes.size(), Digest(volume.block.bytes), name) +
      (exact == nullptr ? "" : fmt::format(" {:x}", Digest(exact->bytes))) + of_labels +
      (cells == nullptr ? "" : " cells " + cells->Digest());
  return IdOf(text);
}

}  // namespace slabstream
