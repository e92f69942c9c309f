#include "common/base/program_beside.h"

#include <fmt/format.h>
#include <unistd.h>

#include <filesystem>

namespace slabstream {

Result<std::string> ProgramBeside(const std::string& name) {
  std::error_code error;
  const std::filesystem::path folder = std::filesystem::read_symlink("/proc/self/exe", error).parent_path();
  for (const std::filesystem::path& program : {folder / name, folder.parent_path() / "bin" / name}) {
    if (!error && ::access(program.c_str(), X_OK) == 0) return program.string();
  }
  return Status::NotFound(fmt::format("the program '{}' is missing", (folder / name).string()));
}

}  // namespace slabstream
