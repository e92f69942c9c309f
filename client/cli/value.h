// `value`: what a dataset or a file holds at points of its world.
#pragma once

#include <string>
#include <vector>

#include "client/cli/options.h"
#include "common/base/status.h"

namespace slabstream {

struct ValueOptions {
  ConnectionOptions connection;
  std::string source;               // a name of the catalogue; a path with local_workers > 0
  LayerFiles layers;                // with local_workers > 0
  std::vector<std::string> points;  // as ParsePoint takes them; 1 ... kMaxSamplePoints
  bool json = false;
};

Status RunValue(const ValueOptions& options);

}  // namespace slabstream
