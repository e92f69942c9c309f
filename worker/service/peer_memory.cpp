#include "worker/service/peer_memory.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <string>
#include <utility>

namespace slabstream {
namespace {

Status Invalid(const std::string& what) { return Status::InvalidArgument("shared image: " + what); }

}  // namespace

bool BorrowedImage::Intact() const {
  return std::ranges::all_of(planes, [&](const BlockName& plane) { return arena->Holds(plane); });
}

Result<std::shared_ptr<const MappedArena>> PeerMemory::Open(const ArenaName& name, Time now) {
  const std::lock_guard lock(mutex_);
  const auto known = std::ranges::find(mappings_, name, &Mapping::name);
  if (known != mappings_.end()) {
    known->last_used = now;
    return known->arena;
  }
  Result<std::shared_ptr<const MappedArena>> arena = MappedArena::Open(name);
  if (arena.ok()) mappings_.push_back({name, *arena, now});
  return arena;
}

Result<BorrowedImage> PeerMemory::Borrow(const SharedImage& image, PixelFormat format, const Bytes& spans, PixelRange range,
                                         const PixelBounds& frame, Time now) {
  Result<std::shared_ptr<const MappedArena>> arena = Open(image.arena, now);
  if (!arena.ok()) return arena.status();
  BorrowedImage borrowed{{.format = format, .bounds = image.bounds, .stride = image.stride, .rows = {}}, *std::move(arena), image.planes};
  ImageView& view = borrowed.view;
  if (view.bounds.empty() || !frame.Contains(view.bounds)) return Invalid("bounds do not lie in the frame");
  const auto width = std::uint64_t(view.bounds.width()), height = std::uint64_t(view.bounds.height());
  if (spans.size() != sizeof(ColumnSpan) * height) return Invalid(std::to_string(spans.size()) + " bytes of row spans");
  view.rows.resize(height);
  std::memcpy(view.rows.data(), spans.span().data(), spans.size());
  const auto fits = [&](const ColumnSpan& row) { return row.begin <= row.end && row.end <= width; };
  if (!std::ranges::all_of(view.rows, fits)) return Invalid("a row span leaves the bounds");

  // Nothing overflows: strides, sides and first pixels were limited when the message was read.
  if (view.stride < width) return Invalid("rows overlap");
  const std::uint64_t pixels = image.first_pixel + (height - 1) * view.stride + width;
  const bool depth = HasDepth(format);
  const std::array<std::uint64_t, 3> pixel_bytes = {4 * sizeof(float), sizeof(float), sizeof(std::uint32_t)};
  std::array<const std::byte*, 3> first = {};
  if (image.planes.size() != (depth ? 3U : 1U)) return Invalid(std::to_string(image.planes.size()) + " planes");
  for (std::size_t i = 0; i < image.planes.size(); ++i) {
    const std::byte* const plane = borrowed.arena->Find(image.planes[i], pixel_bytes[i] * pixels);
    if (plane == nullptr) return Invalid("a plane leaves the memory");
    first[i] = plane + pixel_bytes[i] * image.first_pixel;
  }
  view.rgba = reinterpret_cast<const float*>(first[0]);
  view.depth = reinterpret_cast<const float*>(first[1]);
  view.voxel = reinterpret_cast<const std::uint32_t*>(first[2]);
  Clip(view, range, frame.width());
  if (!borrowed.Intact()) return Status::DataLoss("shared image: it is no longer lent");
  return borrowed;
}

void PeerMemory::CloseIdle(Time now) {
  const std::lock_guard lock(mutex_);
  std::erase_if(mappings_, [now](const Mapping& mapping) { return now - mapping.last_used > kIdle; });
}

std::size_t PeerMemory::size() {
  const std::lock_guard lock(mutex_);
  return mappings_.size();
}

}  // namespace slabstream
