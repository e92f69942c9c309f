// Files that are written whole or not at all, and small text files that are read within a limit. Every program writes its files through
// OutputFile: pictures, volumes, JSON.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "common/base/status.h"

namespace slabstream {

// A file that is being written. The bytes go to a temporary file in the same folder. Finish replaces the target by it, but only after every
// write and the close have succeeded, so a full disk neither leaves half a file nor costs the file that was there before. A target that
// exists and is no regular file, such as a device or a pipe, is written directly.
//
// Each failure is Unavailable, such as "cannot write 'a.png': No space left on device". The first one stays: later writes do nothing, and
// Close and Finish return it. One thread at a time.
class OutputFile {
 public:
  // `mode`: who may use the file, less the process's umask.
  static Result<OutputFile> Create(const std::string& path, unsigned mode = 0666);
  OutputFile(OutputFile&& other) noexcept;
  OutputFile& operator=(OutputFile&&) = delete;
  ~OutputFile();  // removes the temporary file unless Finish has succeeded

  void Append(std::span<const std::byte> bytes);
  void Append(const std::string& text) { Append(std::as_bytes(std::span(text))); }
  void WriteAt(std::int64_t offset, std::span<const std::byte> bytes);  // later appends go on behind the last byte written by Append
  bool ok() const { return error_ == 0; }
  // Where the bytes go until Finish: for another program that writes them instead.
  const std::string& written_path() const { return temporary_.empty() ? path_ : temporary_; }

  Status Close();   // nothing can be written afterwards; the target is still untouched
  Status Finish();  // closes if need be, then puts the file in its place

 private:
  OutputFile(std::string path, std::string target, std::string temporary, int descriptor);
  void Keep(int error);  // the first errno stays
  // write_some(rest) returns the number of bytes written, or -1 with errno.
  template <class WriteSome>
  void WriteAll(std::span<const std::byte> bytes, WriteSome&& write_some);

  std::string path_;       // as the caller wrote it, for messages
  std::string target_;     // `path_` with links resolved
  std::string temporary_;  // empty: written directly, or already in its place
  int descriptor_ = -1;
  int error_ = 0;  // errno of the first failure
};

// Unavailable, naming the path, if it cannot be written.
Status WriteTextFile(const std::string& path, const std::string& text);

// The same for a secret: the file is readable by its owner alone.
Status WritePrivateTextFile(const std::string& path, const std::string& text);

// NotFound: no such file. ResourceExhausted: longer than `max_bytes`. Messages name the path.
Result<std::string> ReadTextFile(const std::string& path, std::size_t max_bytes);

// The same for a secret. InvalidArgument: others can read the file.
Result<std::string> ReadPrivateTextFile(const std::string& path, std::size_t max_bytes);

// For paths that other files name: to open a pipe would wait for its writer. InvalidArgument, naming the path: it is there, and no regular
// file.
Status CheckIsFile(const std::string& path);

// Checks, before long work begins, that a file can be created as `path`; leaves nothing behind. Else InvalidArgument or NotFound with the
// reason; the message begins with `option`.
Status CheckCanWrite(const std::string& option, const std::string& path);

}  // namespace slabstream
