#include "data/volume_io/tiff_input.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <system_error>

namespace slabstream {

Result<TiffInput> TiffInput::Open(const std::string& path, std::uint64_t directory) {
  TiffInput input(FileDescriptor(::open(path.c_str(), O_RDONLY | O_CLOEXEC)));
  struct stat state {};
  if (input.file_.number() < 0 || ::fstat(input.file_.number(), &state) != 0) {
    return Status::NotFound(fmt::format("{}: cannot be opened for reading: {}", path, std::generic_category().message(errno)));
  }
  input.size_ = std::uint64_t(state.st_size);
  if (directory != 0) input.SetFirst(directory);
  return input;
}

std::size_t TiffInput::ReadAt(std::uint64_t begin, std::byte* out, std::size_t bytes) const {
  if (begin >= size_) return 0;
  const std::size_t done = ReadBytesAt(file_.number(), begin, {out, bytes});
  for (std::size_t i = 0; i < first_.count; ++i) {
    const std::uint64_t place = first_.begin + i;
    if (place >= begin && place < begin + done) out[place - begin] = first_.bytes[i];
  }
  return done;
}

TIFF* TiffInput::OpenTiff(const char* name, TIFFOpenOptions* options) {
  const auto read = [](thandle_t handle, void* out, tmsize_t bytes) {
    TiffInput& input = Of(handle);
    const std::size_t done = input.ReadAt(input.at_, static_cast<std::byte*>(out), std::size_t(bytes));
    input.at_ += done;
    return tmsize_t(done);
  };
  const auto write = [](thandle_t, void*, tmsize_t) { return tmsize_t{-1}; };
  const auto seek = [](thandle_t handle, toff_t to, int from) {
    TiffInput& input = Of(handle);
    input.at_ = from == SEEK_CUR ? input.at_ + to : from == SEEK_END ? input.size_ + to : to;
    return toff_t{input.at_};
  };
  const auto close = [](thandle_t) { return 0; };
  const auto size = [](thandle_t handle) { return toff_t{Of(handle).size_}; };
  return TIFFClientOpenExt(name, "rm", this, read, write, seek, close, size, nullptr, nullptr, options);
}

void TiffInput::SetFirst(std::uint64_t directory) {
  constexpr std::byte kBig{43};  // BigTIFF's number, 42 is TIFF's
  std::array<std::byte, 4> start{};
  ReadAt(0, start.data(), start.size());
  const bool little = start[0] == std::byte{'I'}, big = start[little ? 2 : 3] == kBig;
  first_ = {big ? 8U : 4U, std::bit_cast<std::array<std::byte, 8>>(directory), big ? 8U : 4U};
  if (!little) std::reverse(first_.bytes.begin(), first_.bytes.begin() + std::ptrdiff_t(first_.count));
}

}  // namespace slabstream
