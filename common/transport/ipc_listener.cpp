#include "common/transport/ipc_listener.h"

#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <system_error>
#include <utility>

#include "common/base/check.h"

namespace slabstream {
namespace {

constexpr int kBacklog = 100;  // ZeroMQ's default

sockaddr_un AddressOf(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  CHECK_LT(path.size(), sizeof(address.sun_path));  // ParseEndpoint has checked it
  std::memcpy(address.sun_path, path.data(), path.size());
  return address;
}

Status Unavailable(const std::string& path, const std::string& why) {
  return Status::Unavailable("endpoint \"ipc://" + path + "\": " + why);
}
Status SystemError(const std::string& path, int error) { return Unavailable(path, std::generic_category().message(error)); }

bool Bind(int descriptor, const sockaddr_un& address) {
  return ::bind(descriptor, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0;
}

}  // namespace

Status IpcListener::RemoveStale(const std::string& path) {
  const sockaddr_un address = AddressOf(path);
  struct stat file {};
  if (::lstat(path.c_str(), &file) != 0) return errno == ENOENT ? Status::Ok() : SystemError(path, errno);
  if (!S_ISSOCK(file.st_mode)) return Unavailable(path, "a file that is not a socket is there");
  const int probe = ::socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (probe < 0) return SystemError(path, errno);
  const int error = ::connect(probe, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0 ? 0 : errno;
  ::close(probe);
  if (error == 0 || error == EAGAIN) return Unavailable(path, "already in use");  // EAGAIN: its backlog is full
  if (error != ECONNREFUSED && error != ENOENT) return SystemError(path, error);
  if (::unlink(path.c_str()) != 0 && errno != ENOENT) return SystemError(path, errno);
  return Status::Ok();
}

Result<IpcListener> IpcListener::Listen(const std::string& path) {
  const sockaddr_un address = AddressOf(path);
  const int descriptor = ::socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (descriptor < 0) return SystemError(path, errno);
  IpcListener listener(path, descriptor);
  if (!Bind(descriptor, address)) {
    if (errno != EADDRINUSE) return SystemError(path, errno);
    if (Status status = RemoveStale(path); !status.ok()) return status;
    if (!Bind(descriptor, address)) return SystemError(path, errno);
  }
  struct stat file {};
  if (::listen(descriptor, kBacklog) != 0 || ::lstat(path.c_str(), &file) != 0) return SystemError(path, errno);
  listener.device_ = file.st_dev;
  listener.inode_ = file.st_ino;
  return listener;
}

IpcListener::IpcListener(std::string path, int descriptor) : path_(std::move(path)), descriptor_(descriptor) {}

IpcListener::IpcListener(IpcListener&& other) noexcept
    : path_(std::move(other.path_)), descriptor_(std::exchange(other.descriptor_, -1)), device_(other.device_), inode_(other.inode_) {}

IpcListener::~IpcListener() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

int IpcListener::Release() { return std::exchange(descriptor_, -1); }

void IpcListener::Remove() {
  struct stat file {};
  if (::lstat(path_.c_str(), &file) == 0 && file.st_dev == device_ && file.st_ino == inode_) ::unlink(path_.c_str());
}

}  // namespace slabstream
