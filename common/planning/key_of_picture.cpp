#include "common/planning/key_of_picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>

#include "common/base/printable.h"

namespace slabstream {
namespace {

void AddBar(const ShownFields& shown, int number, const TransferFunction& transfer, PictureKey& key) {
  double most = 0;
  for (const OpacityPoint& point : transfer.opacities) most = std::max(most, point.opacity);
  if (most == 0) return;
  std::vector<ColorPoint> colors = transfer.colors;
  if (colors.size() == 1 && transfer.opacities.front().opacity == 0) {  // a channel: one colour, from clear to opaque
    colors.clear();
    for (const OpacityPoint& point : transfer.opacities) {
      colors.push_back({point.value, Brightened(transfer.colors.front().color, point.opacity / most)});
    }
  }
  if (transfer.opacities.size() > 1) {  // beyond their ends, values have the colours of the ends
    const ColorPoint low = {transfer.opacities.front().value, colors.front().color};
    const ColorPoint high = {transfer.opacities.back().value, colors.back().color};
    if (low.value < colors.front().value) colors.insert(colors.begin(), low);
    if (high.value > colors.back().value) colors.push_back(high);
  }
  if (colors.front().value < colors.back().value) key.bars.push_back({Printable(TitleOf(shown, number)), std::move(colors)});
}

}  // namespace

PictureKey KeyOf(const ResolvedRequest& request) {
  const ShownFields& shown = request.fields;
  PictureKey key;
  AddBar(shown, shown.volume, request.volume.transfer(), key);
  for (std::size_t i = 0; i < shown.others.size(); ++i) {
    const ClassifiedField& field = request.volume.fields()[i];
    if (!field.labels) {
      AddBar(shown, shown.others[i].number, field.look.transfer, key);
      continue;
    }
    const std::vector<LabelRange>& wanted = LabelsOf(request.frame)->shown;
    for (const Label& label : field.summary->labels->labels) {
      if (!wanted.empty() && std::ranges::none_of(wanted, [&](const LabelRange& range) { return Covers(range, label); })) continue;
      const std::string name = label.name.empty() ? fmt::format("{}", label.value) : Printable(label.name);
      key.entries.push_back({name, {label.color[0], label.color[1], label.color[2]}});
    }
  }
  for (const Isosurface& surface : request.volume.transfer().isosurfaces) {
    key.entries.push_back({fmt::format("{:g}", surface.value), surface.color});
  }
  return key;
}

}  // namespace slabstream
