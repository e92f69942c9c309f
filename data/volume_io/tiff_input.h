// TiffInput: the bytes of a TIFF file as libtiff asks for them, but for the place of the first directory: any directory may be the first
// one. libtiff's own way to a directory walks through all others.
#pragma once

#include <tiffio.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

#include "common/base/status.h"
#include "common/files/file_descriptor.h"

namespace slabstream {

// One thread at a time.
class TiffInput {
 public:
  // `directory`: its place in the file, 0: the first one. NotFound: the file cannot be opened.
  static Result<TiffInput> Open(const std::string& path, std::uint64_t directory);
  TiffInput(TiffInput&&) = default;

  // How many bytes there were.
  std::size_t ReadAt(std::uint64_t begin, std::byte* out, std::size_t bytes) const;
  std::uint64_t size() const { return size_; }

  // A handle that reads this, which must stay where it is. Null: it is no TIFF.
  TIFF* OpenTiff(const char* name, TIFFOpenOptions* options);

 private:
  explicit TiffInput(FileDescriptor file) : file_(std::move(file)) {}
  void SetFirst(std::uint64_t directory);
  static TiffInput& Of(thandle_t handle) { return *static_cast<TiffInput*>(handle); }

  FileDescriptor file_;
  std::uint64_t size_ = 0, at_ = 0;
  // Bytes of the header that say where the first directory is; none: the file's own ones.
  struct FirstDirectory {
    std::uint64_t begin = 0;
    std::array<std::byte, 8> bytes{};
    std::size_t count = 0;
  } first_;
};

}  // namespace slabstream
