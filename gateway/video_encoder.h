// VideoEncoder: encodes the pictures of a moving view as VP9 (profile 0, 4:2:0, BT.709), one chunk a picture, of constant quality. A chunk
// says what differs from the picture before, so a page needs all of them, in order. One thread at a time.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "client/pictures/composed_picture.h"
#include "common/base/status.h"

namespace slabstream {

class VideoEncoder {
 public:
  VideoEncoder();
  ~VideoEncoder();
  VideoEncoder(const VideoEncoder&) = delete;
  VideoEncoder& operator=(const VideoEncoder&) = delete;

  struct Chunk {
    std::vector<std::byte> bytes;
    bool key = false;  // it can be decoded without earlier ones: the first one, and the first one of another size
  };
  // Transparent parts become black. Internal: libvpx refused; the next chunk is a key then.
  Result<Chunk> Encode(const ComposedPicture& picture);

 private:
  struct Stream;  // of pictures of one size
  std::unique_ptr<Stream> stream_;
};

}  // namespace slabstream
