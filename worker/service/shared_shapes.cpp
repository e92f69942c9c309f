#include "worker/service/shared_shapes.h"

#include <fmt/format.h>

#include <algorithm>
#include <list>
#include <utility>

#include "common/base/log.h"
#include "common/wire/payload.h"
#include "worker/shapes/tile_coding.h"

namespace slabstream {
namespace {

constexpr std::size_t kLatest = 3;  // kept, though nobody holds them: a view is often asked for again with another look of the volume

// The payload of a message. It is unpacked when it is first needed.
class TilePayload {
 public:
  TilePayload(const ShapeTiles& message, Bytes payload, std::size_t raw_bytes)
      : raw_bytes_(raw_bytes), packed_(message.packed), payload_(std::move(payload)) {}

  const Result<Bytes>& Raw() {
    std::call_once(once_, [this] { raw_ = packed_ ? UnpackRuns(*packed_, payload_, raw_bytes_) : payload_; });
    return raw_;
  }

 private:
  const std::size_t raw_bytes_;
  const Rare<PackedRuns> packed_;
  const Bytes payload_;
  std::once_flag once_;
  Result<Bytes> raw_ = Bytes();
};

}  // namespace

class SharedShapes::Arrived final : public DrawnTiles {
 public:
  explicit Arrived(const ShapeGrid& grid) : grid_(grid) {}

  void Add(const ShapeTiles& message, const Bytes& payload) {
    std::size_t end = 0;
    for (std::size_t i = 0; i < message.tiles.size(); ++i) {
      const std::uint32_t tile = message.tiles[i];
      if (tile >= grid_.count() || message.bytes[i] > MostBytesOfTile(grid_.PixelsOf(tile))) {
        return LogWarning(fmt::format("shapes: worker {} sent {} bytes of a tile with number {}: it is drawn here", message.from_worker,
                                      message.bytes[i], tile));
      }
      end += message.bytes[i];
    }
    const auto shared = std::make_shared<TilePayload>(message, payload, end);
    const std::lock_guard lock(mutex_);
    std::size_t begin = 0;
    for (std::size_t i = 0; i < message.tiles.size(); ++i) {
      tiles_.try_emplace(message.tiles[i], Part{shared, begin, message.bytes[i]});
      begin += message.bytes[i];
    }
  }

  std::optional<ShapeTile> Take(std::uint32_t tile, const PixelBounds& pixels) override {
    std::unique_lock lock(mutex_);
    const auto taken = tiles_.extract(tile);
    lock.unlock();
    if (taken.empty()) return std::nullopt;
    const auto& [payload, begin, bytes] = taken.mapped();
    const Result<Bytes>& raw = payload->Raw();
    Result<ShapeTile> read = raw.ok() ? ReadTile(raw->span().subspan(begin, bytes), pixels) : raw.status();
    if (read.ok()) return *std::move(read);
    LogWarning(fmt::format("shapes: a tile of another worker is drawn here: {}", read.status().message()));
    return std::nullopt;
  }

 private:
  struct Part {
    std::shared_ptr<TilePayload> payload;
    std::size_t begin = 0, bytes = 0;
  };

  const ShapeGrid grid_;
  std::mutex mutex_;
  std::map<std::uint32_t, Part> tiles_;
};

std::shared_ptr<SharedShapes> SharedShapes::Of(const FrameSetup& setup) {
  static std::mutex mutex;
  static std::list<std::shared_ptr<SharedShapes>> latest;  // the last one used first
  const std::lock_guard lock(mutex);
  const auto found = std::ranges::find_if(latest, [&](const auto& each) { return each->setup_ == setup; });
  if (found != latest.end()) {
    latest.splice(latest.begin(), latest, found);
  } else {
    latest.push_front(std::make_shared<SharedShapes>(setup));
    std::size_t place = 0;
    std::erase_if(latest, [&](const auto& each) { return place++ >= kLatest && each.use_count() == 1; });
  }
  return latest.front();
}

SharedShapes::SharedShapes(const FrameSetup& setup) : setup_(setup), arrived_(std::make_shared<Arrived>(ShapeGrid(FrameBounds(setup)))) {}

Result<std::shared_ptr<const FrameShapes>> SharedShapes::Make(std::span<const std::shared_ptr<const VoxelBlock>> bytes,
                                                              const std::shared_ptr<const FrameLight>& light) {
  const std::lock_guard lock(mutex_);
  if (!shapes_) shapes_ = MakeFrameShapes(setup_, bytes, light, arrived_);
  return *shapes_;
}

void SharedShapes::Add(const ShapeTiles& message, const Bytes& payload) { arrived_->Add(message, payload); }

}  // namespace slabstream
