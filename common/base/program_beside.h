// Where the other programs are that this one starts.
#pragma once

#include <string>

#include "common/base/status.h"

namespace slabstream {

// Path of a program that lies beside this one; for tests, which lie in a folder of their own, also in the folder bin beside that. NotFound
// if there is none.
Result<std::string> ProgramBeside(const std::string& name);

}  // namespace slabstream
