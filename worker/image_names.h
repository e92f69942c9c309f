// Names for images: the machine chooses handles, so it can name an image before the executor has made it.
#pragma once

#include <vector>

#include "worker/worker_machine.h"

namespace slabstream {

using WorkerActions = std::vector<WorkerAction>;

class ImageNames {
 public:
  ImageHandle Next() { return ++last_; }

 private:
  ImageHandle last_ = 0;
};

}  // namespace slabstream
