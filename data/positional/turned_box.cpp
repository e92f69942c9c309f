#include "data/positional/turned_box.h"

#include "data/sources/copy_samples.h"

namespace slabstream {

Box TurnedBox::Stored() const {
  Box stored;
  for (int i = 0; i < 3; ++i) {
    const int axis = turn.from[std::size_t(i)];
    const bool flipped = turn.flipped[std::size_t(i)];
    stored.begin[axis] = flipped ? size[i] - box.end[i] : box.begin[i];
    stored.end[axis] = flipped ? size[i] - box.begin[i] : box.end[i];
  }
  return stored;
}

Box TurnedBox::Turned(const Box& part) const {
  Box turned;
  for (int i = 0; i < 3; ++i) {
    const int axis = turn.from[std::size_t(i)];
    const bool flipped = turn.flipped[std::size_t(i)];
    turned.begin[i] = flipped ? size[i] - part.end[axis] : part.begin[axis];
    turned.end[i] = flipped ? size[i] - part.begin[axis] : part.end[axis];
  }
  return turned;
}

BoxRoom TurnedBox::Place(const Box& turned_part, SampleType type) const {
  const Index3 offset = turned_part.begin - box.begin;
  BoxRoom place = out;
  place.first += (offset.x + offset.y * out.row + offset.z * out.slice) * std::int64_t(CopiedBytes(type, out.exact));
  return place;
}

void TurnedBox::Fill(const Box& part, SampleType type, const std::byte* from, const std::array<std::int64_t, 3>& steps) const {
  const Box turned = Turned(part);
  std::array<std::int64_t, 3> turned_steps{};
  for (std::size_t i = 0; i < 3; ++i) {
    const std::int64_t step = steps[std::size_t(turn.from[i])];
    turned_steps[i] = turn.flipped[i] ? -step : step;
    if (turn.flipped[i]) from += step * (turned.size()[int(i)] - 1) * std::int64_t(BytesPerSample(type));
  }
  CopySamples(type, from, turned_steps, turned.size(), Place(turned, type));
}

}  // namespace slabstream
