#include "client/request/key_of_picture.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/base/printable.h"

namespace slabstream {
namespace {

bool IsShown(const Label& label, const LabelChoice& choice) {
  return choice.shown.empty() || std::ranges::any_of(choice.shown, [&](const LabelRange& range) { return Covers(range, label); });
}

}  // namespace

PictureKey KeyOf(const FrameRequest& request, const SummaryReply& summary) {
  PictureKey key;
  TransferFunction transfer = summary.transfer;
  if (transfer.colors.size() == 1 && transfer.opacities.size() > 1 &&
      transfer.opacities.front().opacity == 0) {  // a channel: one colour, from clear to opaque
    transfer.colors = {{transfer.opacities.front().value, {0, 0, 0}}, {transfer.opacities.back().value, transfer.colors.front().color}};
  }
  const double low = transfer.colors.front().value, high = transfer.colors.back().value;
  const bool visible = std::ranges::any_of(transfer.opacities, [](const OpacityPoint& point) { return point.opacity > 0; });
  if (visible && low < high) {
    key.bar = PictureKey::Bar{.colors = transfer.colors, .low = low, .high = high};
    for (ColorPoint& point : key.bar->colors) point.color = Brightened(point.color, request.brightness);
  }
  for (const Label& label : request.labels ? summary.labels : std::vector<Label>()) {
    if (!IsShown(label, *request.labels)) continue;
    const std::string name = label.name.empty() ? fmt::format("{}", label.value) : Printable(label.name);
    key.entries.push_back({name, {label.color[0], label.color[1], label.color[2]}});
  }
  for (const Isosurface& surface : request.transfer.isosurfaces) {
    key.entries.push_back({fmt::format("{:g}", surface.value), Brightened(surface.color, request.brightness)});
  }
  return key;
}

}  // namespace slabstream
