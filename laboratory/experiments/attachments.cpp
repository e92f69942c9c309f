#include "laboratory/experiments/attachments.h"

#include <array>
#include <string_view>

namespace slabstream {
void AttachTimeline(Results& results, const std::string& name, const Timeline& timeline) {
  std::vector<Json> rows;
  const auto add = [&](std::uint32_t worker, std::string_view lane, std::uint32_t frame, std::uint32_t group, std::string_view stage,
                       double begin, double end) {
    rows.push_back({{"worker", worker + 1},
                    {"lane", lane},
                    {"frame", frame + 1},
                    {"group", group + 1},
                    {"stage", stage},
                    {"begin", begin},
                    {"end", end}});
  };
  constexpr std::array<std::string_view, 3> kLanes = {"renders", "combines", "makes pictures"};
  for (const SimulatedSpan& span : timeline.spans)
    add(span.worker, kLanes.at(std::size_t(span.lane)), span.frame, span.group, ToString(span.stage), span.begin, span.end);
  for (const SimulatedMessage& message : timeline.messages)
    add(message.to, "receives", message.frame, message.group, "transfer", message.begin, message.end);
  results.Attach(name, std::move(rows));
}

void AttachBoxes(Results& results, const std::string& name, const MeasuredFrame& frame) {
  std::vector<Json> rows;
  const Index3 size = frame.plan.setup.description.geometry.size;
  for (const Placement& placement : PlacementsOf(frame.plan)) {
    const Box& box = placement.box;
    rows.push_back({{"box", placement.id},
                    {"x0", box.begin.x},
                    {"x1", box.end.x},
                    {"y0", box.begin.y},
                    {"y1", box.end.y},
                    {"z0", box.begin.z},
                    {"z1", box.end.z},
                    {"worker", placement.worker},
                    {"seconds", frame.boxes[placement.id].seconds},
                    {"nx", size.x},
                    {"ny", size.y},
                    {"nz", size.z}});
  }
  results.Attach(name, std::move(rows));
}

}  // namespace slabstream
