// PeerMemory: maps the memory of other workers of this host, to read the images that they lend. A mapping stays a while after its last use.
// It keeps the memory of a dead worker alive, so idle ones are closed. Any thread.
#pragma once

#include <chrono>
#include <memory>
#include <mutex>
#include <vector>

#include "common/base/status.h"
#include "common/base/time.h"
#include "common/image/image_view.h"
#include "common/memory/bytes.h"
#include "common/memory/shared_arena.h"
#include "common/wire/image_messages.h"

namespace slabstream {

// A lent image, to be read.
struct BorrowedImage {
  ImageView view;
  std::shared_ptr<const MappedArena> arena;
  std::vector<BlockName> planes;

  // Call after the last read. False: the pixels read may be arbitrary.
  bool Intact() const;
};

class PeerMemory {
 public:
  static constexpr Duration kIdle = std::chrono::seconds(10);

  // Maps the arena unless it is mapped already. Errors: as MappedArena::Open.
  Result<std::shared_ptr<const MappedArena>> Open(const ArenaName& name, Time now);

  // The pixels of `image` that lie in `range` of `frame`. Accepts any image and payload (`spans`): never reads outside the arena.
  // InvalidArgument: something does not fit. DataLoss: the image is no longer lent. Others: as Open, since an image may wait for longer
  // than a mapping is kept.
  Result<BorrowedImage> Borrow(const SharedImage& image, PixelFormat format, const Bytes& spans, PixelRange range, const PixelBounds& frame,
                               Time now);

  void CloseIdle(Time now);
  std::size_t size();

 private:
  struct Mapping {
    ArenaName name;
    std::shared_ptr<const MappedArena> arena;
    Time last_used;
  };

  std::mutex mutex_;
  std::vector<Mapping> mappings_;  // guarded by mutex_
};

}  // namespace slabstream
