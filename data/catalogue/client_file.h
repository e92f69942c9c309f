// ClientFile: a file that a client has sent, in a folder of its own below the folder for temporary files. Nobody else may read it, and it
// is deleted with this object. What processes that were killed have left there is deleted when the next one is made.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "common/files/file_descriptor.h"

namespace slabstream {

class ClientFile {
 public:
  // `name`: SentFile::name. Unavailable: it cannot be written; the message names no folder.
  static Result<std::shared_ptr<const ClientFile>> Write(const std::string& name, std::span<const std::byte> bytes);
  ~ClientFile();
  ClientFile(const ClientFile&) = delete;
  ClientFile& operator=(const ClientFile&) = delete;

  std::string path() const { return folder_ + '/' + name_; }
  // InvalidArgument: to read this file is to read one of `files` that the client has not sent, since headers may name any file of this
  // host.
  Status CheckAlone(const std::vector<std::string>& files) const;
  // A message about the file, for its client: without the folder.
  Status ForClient(const Status& status) const;

 private:
  ClientFile(std::string name, std::string folder, FileDescriptor lock)
      : name_(std::move(name)), folder_(std::move(folder)), lock_(std::move(lock)) {}

  const std::string name_, folder_;
  const FileDescriptor lock_;  // on the folder: it is in use
};

}  // namespace slabstream
