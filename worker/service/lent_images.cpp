#include "worker/service/lent_images.h"

#include <algorithm>
#include <array>
#include <span>
#include <utility>

namespace slabstream {

std::optional<Bytes> LentImages::Lend(const LocalImage& image, const ImageView& view, const Peer& to, PartialImage& message) {
  const std::optional<ArenaName> arena = SharedBlocksArena();
  if (!arena || view.pixel_bytes() < kLeastBytes) return std::nullopt;
  auto lent = std::make_shared<LentImage>(LentImage{to, {}, view, {}});
  SharedImage shared{*arena, view.bounds, std::uint32_t(view.stride), std::uint64_t(view.rgba - image.rgba.data()) / 4, {}};
  std::array<std::optional<BlockPin>, 3> planes = {PinOf(image.rgba), PinOf(image.depth), PinOf(image.voxel)};
  for (std::size_t i = 0; i < (HasDepth(view.format) ? 3U : 1U); ++i) {
    std::optional<BlockPin>& pin = planes[i];
    if (!pin || !pin->name()) return std::nullopt;
    shared.planes.push_back(*pin->name());
    lent->pins.push_back(*std::move(pin));
  }
  message.image = {.format = view.format};
  message.shared = std::move(shared);
  lent->message = message;

  const std::lock_guard lock(mutex_);
  if (bytes_ + view.pixel_bytes() > kMostBytes) {
    message.shared.reset();
    return std::nullopt;
  }
  bytes_ += view.pixel_bytes();
  lent_.push_back(std::move(lent));
  const auto spans = std::as_bytes(std::span(view.rows));
  return Bytes(std::vector<std::byte>(spans.begin(), spans.end()));
}

std::shared_ptr<const LentImage> LentImages::Find(const GroupKey& key, std::uint32_t step, const PixelRange& pixels) {
  const std::lock_guard lock(mutex_);
  const auto found = std::ranges::find_if(
      lent_, [&](const auto& lent) { return lent->message.key == key && lent->message.step == step && lent->message.pixels == pixels; });
  return found == lent_.end() ? nullptr : *found;
}

std::size_t LentImages::bytes() {
  const std::lock_guard lock(mutex_);
  return bytes_;
}

}  // namespace slabstream
