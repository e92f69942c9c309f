#include "client/cli/files.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <system_error>

namespace slabstream {

Result<std::string> ReadTextFile(const std::string& path, std::size_t max_bytes) {
  std::error_code error;
  if (!std::filesystem::exists(path, error)) return Status::NotFound(fmt::format("'{}' does not exist", path));
  if (std::filesystem::is_directory(path, error)) return Status::InvalidArgument(fmt::format("'{}' is a directory", path));
  std::ifstream file(path, std::ios::binary);
  if (!file) return Status::InvalidArgument(fmt::format("'{}' cannot be read: {}", path, std::strerror(errno)));
  std::string text(max_bytes + 1, '\0');  // one more than allowed tells "too long" from "just right", for pipes too
  file.read(text.data(), std::streamsize(text.size()));
  text.resize(std::size_t(file.gcount()));
  if (text.size() > max_bytes) return Status::ResourceExhausted(fmt::format("'{}' is longer than {} bytes", path, max_bytes));
  return text;
}

Status WriteTextFile(const std::string& path, const std::string& text) {
  const std::string temporary = fmt::format("{}.{}.tmp", path, ::getpid());
  {
    std::ofstream file(temporary, std::ios::binary | std::ios::trunc);
    file << text;
    file.flush();
    if (!file) {
      const std::string reason = std::strerror(errno);
      std::error_code ignored;
      std::filesystem::remove(temporary, ignored);
      return Status::Unavailable(fmt::format("cannot write '{}': {}", path, reason));
    }
  }
  std::error_code error;
  std::filesystem::rename(temporary, path, error);
  if (!error) return Status::Ok();
  std::error_code ignored;
  std::filesystem::remove(temporary, ignored);
  return Status::Unavailable(fmt::format("cannot write '{}': {}", path, error.message()));
}

Status CheckOutputDirectory(const std::string& option, const std::string& path) {
  const std::filesystem::path parent = std::filesystem::path(path).parent_path();
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) return Status::InvalidArgument(fmt::format("{} '{}' is a directory", option, path));
  if (parent.empty() || std::filesystem::is_directory(parent, error)) return Status::Ok();
  return Status::NotFound(fmt::format("{} '{}': the directory '{}' does not exist", option, path, parent.string()));
}

}  // namespace slabstream
