// Parses where the pictures of `turntable` go. Pure. Errors as in common/cli/parse.h.
#pragma once

#include <string>
#include <string_view>

#include "common/base/status.h"

namespace slabstream {

// A file name with exactly one integer conversion, such as "frame_%04d.png"; "%%" stands for a percent sign.
class FramePattern {
 public:
  static Result<FramePattern> Parse(std::string_view option, std::string_view text);
  std::string Name(int index) const;  // index >= 0

 private:
  std::string before_, after_;
  int width_ = 0;  // digits, filled with zeros if zero_ or else with blanks
  bool zero_ = false;
};

// Where a turntable goes: a picture for each frame, or a movie of them.
struct TurntableOutput {
  FramePattern pictures;
  std::string movie;  // its path (MovieFormatOf); empty: pictures
};
Result<TurntableOutput> ParseTurntableOutput(std::string_view option, std::string_view text);

}  // namespace slabstream
