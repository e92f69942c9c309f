// Where the other programs are that this one starts, and the files that it brings along.
#pragma once

#include <filesystem>
#include <string>

#include "common/base/status.h"

namespace slabstream {

// The folder of this program. Empty if the system does not tell.
std::filesystem::path ProgramFolder();

// Path of a program that lies beside this one; for tests, which lie in a folder of their own, also in the folder bin beside that. NotFound
// if there is none.
Result<std::string> ProgramBeside(const std::string& name);

}  // namespace slabstream
