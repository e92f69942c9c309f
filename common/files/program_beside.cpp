#include "common/files/program_beside.h"

#include <fmt/format.h>
#include <unistd.h>

namespace slabstream {

std::filesystem::path ProgramFolder() {
  std::error_code error;
  return std::filesystem::read_symlink("/proc/self/exe", error).parent_path();
}

Result<std::string> ProgramBeside(const std::string& name) {
  const std::filesystem::path folder = ProgramFolder();
  for (const std::filesystem::path& program : {folder / name, folder.parent_path() / "bin" / name}) {
    if (!folder.empty() && ::access(program.c_str(), X_OK) == 0) return program.string();
  }
  return Status::NotFound(fmt::format("the program '{}' is missing; deploy/build makes all programs", (folder / name).string()));
}

}  // namespace slabstream
