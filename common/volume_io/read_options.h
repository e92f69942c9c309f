// How a volume file is to be read, where its format leaves that open.
#pragma once

#include <string>

namespace slabstream {

struct ReadOptions {
  std::string series;  // of a DICOM folder: its number or UID; "": the only one
};

}  // namespace slabstream
