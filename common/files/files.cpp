#include "common/files/files.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <system_error>
#include <utility>

namespace slabstream {
namespace {

namespace fs = std::filesystem;

// A name in the same folder that no other writer uses.
std::string TemporaryNameFor(const std::string& path) {
  static std::atomic<unsigned> counter{0};
  return fmt::format("{}.{}-{}.tmp", path, ::getpid(), counter++);
}

Status CannotWrite(const std::string& path, const std::string& why) {
  return Status::Unavailable(fmt::format("cannot write '{}': {}", path, why));
}

}  // namespace

OutputFile::OutputFile(std::string path, std::string target, std::string temporary, int descriptor)
    : path_(std::move(path)), target_(std::move(target)), temporary_(std::move(temporary)), descriptor_(descriptor) {}

OutputFile::OutputFile(OutputFile&& other) noexcept
    : path_(std::move(other.path_)),
      target_(std::move(other.target_)),
      temporary_(std::exchange(other.temporary_, {})),
      descriptor_(std::exchange(other.descriptor_, -1)),
      error_(other.error_) {}

OutputFile::~OutputFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
  if (!temporary_.empty()) ::unlink(temporary_.c_str());
}

Result<OutputFile> OutputFile::Create(const std::string& path, unsigned mode) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  const bool direct = fs::exists(status) && !fs::is_regular_file(status) && !fs::is_directory(status);
  std::string target = fs::is_regular_file(status) ? fs::canonical(path, error).string() : path;
  if (target.empty()) target = path;
  std::string temporary = direct ? "" : TemporaryNameFor(target);
  const char* name = direct ? path.c_str() : temporary.c_str();
  // A temporary file is never one that is there: that may be a link which another user of a shared folder has made. Else a process with the
  // same number has left it.
  const auto open = [&] { return ::open(name, O_WRONLY | O_CLOEXEC | (direct ? 0 : O_CREAT | O_EXCL), mode); };
  int descriptor = open();
  if (descriptor < 0 && errno == EEXIST && ::unlink(name) == 0) descriptor = open();
  if (descriptor < 0) return CannotWrite(path, std::strerror(errno));
  return OutputFile(path, std::move(target), std::move(temporary), descriptor);
}

void OutputFile::Keep(int error) {
  if (error_ == 0) error_ = error;
}

template <class WriteSome>
void OutputFile::WriteAll(std::span<const std::byte> bytes, WriteSome&& write_some) {
  while (error_ == 0 && !bytes.empty()) {
    const ssize_t count = write_some(bytes);
    if (count >= 0) {
      bytes = bytes.subspan(std::size_t(count));
    } else if (errno != EINTR) {
      Keep(errno);
    }
  }
}

void OutputFile::Append(std::span<const std::byte> bytes) {
  WriteAll(bytes, [this](std::span<const std::byte> rest) { return ::write(descriptor_, rest.data(), rest.size()); });
}

void OutputFile::WriteAt(std::int64_t offset, std::span<const std::byte> bytes) {
  WriteAll(bytes, [&](std::span<const std::byte> rest) {
    return ::pwrite(descriptor_, rest.data(), rest.size(), offset + (rest.data() - bytes.data()));
  });
}

Status OutputFile::Close() {
  // Some file systems report only here that there is no space. The descriptor is gone even then.
  if (descriptor_ >= 0 && ::close(std::exchange(descriptor_, -1)) != 0) Keep(errno);
  return error_ == 0 ? Status::Ok() : CannotWrite(path_, std::strerror(error_));
}

Status OutputFile::Finish() {
  if (Status status = Close(); !status.ok()) return status;
  if (temporary_.empty()) return Status::Ok();
  if (::rename(temporary_.c_str(), target_.c_str()) != 0) return CannotWrite(path_, std::strerror(errno));
  temporary_.clear();
  return Status::Ok();
}

namespace {

Status Write(Result<OutputFile> file, const std::string& text) {
  if (!file.ok()) return file.status();
  file->Append(text);
  return file->Finish();
}

}  // namespace

Status WriteTextFile(const std::string& path, const std::string& text) { return Write(OutputFile::Create(path), text); }

Status WritePrivateTextFile(const std::string& path, const std::string& text) { return Write(OutputFile::Create(path, 0600), text); }

Result<std::string> ReadPrivateTextFile(const std::string& path, std::size_t max_bytes) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  // systemd gives a service its credentials, which nobody else can reach, by an access list, and that shows as rights of the group.
  const char* const credentials = std::getenv("CREDENTIALS_DIRECTORY");
  const bool credential = credentials != nullptr && fs::path(path).parent_path() == credentials;
  const auto others = credential ? fs::perms::others_all : fs::perms::group_all | fs::perms::others_all;
  if (fs::exists(status) && (status.permissions() & others) != fs::perms::none)
    return Status::InvalidArgument(fmt::format("others can use '{}', which holds a secret (chmod 600)", path));
  return ReadTextFile(path, max_bytes);
}

Result<std::string> ReadTextFile(const std::string& path, std::size_t max_bytes) {
  std::error_code error;
  if (!fs::exists(path, error)) return Status::NotFound(fmt::format("'{}' does not exist", path));
  if (fs::is_directory(path, error)) return Status::InvalidArgument(fmt::format("'{}' is a directory", path));
  std::ifstream file(path, std::ios::binary);
  if (!file) return Status::InvalidArgument(fmt::format("'{}' cannot be read: {}", path, std::strerror(errno)));
  std::string text;
  std::size_t got = 0;
  while (file && got <= max_bytes) {  // one more than allowed tells "too long" from "just right", for pipes too
    text.resize(std::min(max_bytes + 1, std::max(2 * got, std::size_t{1} << 16)));
    file.read(text.data() + got, std::streamsize(text.size() - got));
    got += std::size_t(file.gcount());
  }
  text.resize(got);
  if (text.size() > max_bytes) return Status::ResourceExhausted(fmt::format("'{}' is longer than {} bytes", path, max_bytes));
  return text;
}

Status CheckIsFile(const std::string& path) {
  std::error_code error;
  if (!fs::exists(path, error) || fs::is_regular_file(path, error)) return Status::Ok();
  return Status::InvalidArgument(path + ": not a file that can be read");
}

Status CheckCanWrite(const std::string& option, const std::string& path) {
  const fs::path parent = fs::path(path).parent_path();
  std::error_code error;
  if (fs::is_directory(path, error)) return Status::InvalidArgument(fmt::format("{} '{}' is a directory", option, path));
  if (!parent.empty() && !fs::is_directory(parent, error)) {
    return Status::NotFound(fmt::format("{} '{}': the directory '{}' does not exist", option, path, parent.string()));
  }
  if (fs::exists(path, error) && !fs::is_regular_file(path, error)) return Status::Ok();  // opening a pipe would disturb its reader
  const Status status = OutputFile::Create(path).status();
  return status.ok() ? status : Status::InvalidArgument(fmt::format("{}: {}", option, status.message()));
}

}  // namespace slabstream
