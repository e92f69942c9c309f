// IpcListener: a listening Unix socket and its file, made here and handed to ZeroMQ as a descriptor.
//
// ZeroMQ could bind the path itself, but it first removes what is there, even a living service's socket or a user's file, and removes
// its own file some time after closing. Here a path is taken over only from a socket that nobody listens on, and the file is gone when
// Remove returns.
#pragma once

#include <sys/types.h>

#include <string>

#include "common/base/status.h"

namespace slabstream {

class IpcListener {
 public:
  // Removes a socket file left over from a process that has ended. Unavailable: somebody listens there, or it is not a socket.
  static Status RemoveStale(const std::string& path);

  // Unavailable naming the path: somebody listens there, it is not a socket, no permission, no such directory.
  static Result<IpcListener> Listen(const std::string& path);

  // Returns the descriptor; the caller then owns it.
  int Release();

  // Removes the file unless another process has put its own there meanwhile.
  void Remove();

  IpcListener(IpcListener&& other) noexcept;
  IpcListener& operator=(IpcListener&&) = delete;
  ~IpcListener();  // closes the descriptor unless it was released; leaves the file

 private:
  IpcListener(std::string path, int descriptor);

  std::string path_;
  int descriptor_;
  dev_t device_ = 0;  // the file's device, to know it again
  ino_t inode_ = 0;
};

}  // namespace slabstream
