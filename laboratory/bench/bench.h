// `slabstream bench`: measures the standard cases, or the user's volumes, on turntables of both projections.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "client/cli/options.h"
#include "common/base/status.h"
#include "common/frame/frame_request.h"

namespace slabstream {

class RendererKind;

inline constexpr int kMaxBenchSize = 8192;

struct BenchOptions {
  std::vector<std::string> cases;  // in the syntax of ParseBenchCase; empty: all standard ones
  ConnectionOptions connection;
  int size = 512;                                               // pixels a side, [1, kMaxBenchSize]
  int frames = 12;                                              // in a turn of each projection, [1, kMaxTurntableFrames]
  int turns = 2;                                                // [1, kMaxTurns]
  std::optional<const RendererKind*> renderer;                  // replaces that of each case
  ParameterTexts parameters;                                    // parameters for the renderers of all cases
  double termination = kDefaultTermination;                     // of all frames, as in FrameRequest
  std::vector<ShapeChoice> shapes;                              // that all pictures show
  std::string json_path, pictures_directory, export_directory;  // empty: not wanted
  bool list = false;
  std::string command;  // as it was typed
};

Status RunBench(const BenchOptions& options);

}  // namespace slabstream
