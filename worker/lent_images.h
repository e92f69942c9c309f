// LentImages: images that other workers of this host read in this process' memory instead of having them sent.
//
//   1. Lend pins the memory and describes it in the message, which then goes without pixels.
//   2. The receiver combines straight from there. If it cannot open the memory it says so (ImageRefused): Find, and send the same as runs.
//   3. Forget lets go of what was lent for groups that are over: their images have been read, or nobody needs them any more.
// No message tells that an image was read. That a group is done says it of all that was lent for it, since an image is passed on only when
// everything that went into it has been read; and a reader that was late for any reason notices (common/base/shared_arena.h).
// Any thread.
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "common/base/pooled_vector.h"
#include "common/image/image_view.h"
#include "worker/worker_machine.h"

namespace slabstream {

struct LentImage {
  Peer to;
  PartialImage message;
  ImageView view;
  std::vector<BlockPin> pins;
};

class LentImages {
 public:
  static constexpr std::size_t kLeastBytes = std::size_t{32} << 10;  // of pixels: fewer are sent as quickly
  static constexpr std::size_t kMostBytes = std::size_t{2} << 30;    // lent at a time

  // Fills message.shared for `view` of `image` and returns the payload. None: the memory is private, the image is small, or too much is
  // lent already.
  std::optional<Bytes> Lend(const LocalImage& image, const ImageView& view, const Peer& to, PartialImage& message);

  // What was lent with this message, if it has not been forgotten; the memory stays as long as the result does.
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
  std::size_t bytes_ = 0;                               // of their pixels, guarded by mutex_
};

}  // namespace slabstream
