// LentImages: images that other workers of this host read in this process' memory instead of receiving them.
//
//   1. Lend pins the memory and describes it in the message, which then carries no pixels.
//   2. The receiver combines straight from there. If it cannot open the memory, it answers ImageRefused: then Find the
//      image and send it as runs.
//   3. Forget releases the images of groups that are over: they have been read, or are no longer needed.
// No message says that an image was read. When a group is done, all images lent for it have been read, because an image is passed on only
// after everything that went into it was read. A late reader notices (common/memory/shared_arena.h). Any thread.
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "common/image/image_view.h"
#include "common/memory/pooled_vector.h"
#include "worker/machine/worker_machine.h"

namespace slabstream {

struct LentImage {
  Peer to;
  PartialImage message;
  ImageView view;
  std::vector<BlockPin> pins;
};

class LentImages {
 public:
  static constexpr std::size_t kLeastBytes = std::size_t{32} << 10;  // bytes of pixels: smaller images are sent as quickly
  static constexpr std::size_t kMostBytes = std::size_t{2} << 30;    // lent at a time

  // Fills message.shared for `view` of `image` and returns the payload. None: the memory is private, the image is small, or too much is
  // lent already.
  std::optional<Bytes> Lend(const LocalImage& image, const ImageView& view, const Peer& to, PartialImage& message);

  // The image lent with this message, if it has not been forgotten. The memory stays as long as the result does.
  std::shared_ptr<const LentImage> Find(const GroupKey& key, std::uint32_t step, const PixelRange& pixels);

  template <class Predicate>
  void Forget(Predicate over) {
    const std::lock_guard lock(mutex_);
    std::erase_if(lent_, [&](const auto& lent) {
      if (!over(lent->message.key)) return false;
      bytes_ -= lent->view.pixel_bytes();
      return true;
    });
  }

  std::size_t bytes();

 private:
  std::mutex mutex_;
  std::vector<std::shared_ptr<const LentImage>> lent_;  // guarded by mutex_
  std::size_t bytes_ = 0;                               // bytes of their pixels, guarded by mutex_
};

}  // namespace slabstream
