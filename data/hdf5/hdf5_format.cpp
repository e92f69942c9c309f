#include "data/hdf5/hdf5_format.h"

#include <array>
#include <filesystem>
#include <fstream>
#include <string_view>
#include <utility>

namespace slabstream {
namespace {

bool IsHdf5(const std::string& path, const ReadOptions&) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) return false;
  constexpr std::string_view kSignature = "\x89HDF\r\n\x1a\n";
  std::array<char, kSignature.size()> first{};
  return std::ifstream(path, std::ios::binary).read(first.data(), first.size()) &&
         std::string_view(first.data(), first.size()) == kSignature;
}

Result<std::shared_ptr<VolumeSource>> Open(const std::string& path, const ReadOptions& options, const SourceContext& context) {
  Result<Pyramid> pyramid = ReadHdf5(path, options, context);
  if (!pyramid.ok()) return pyramid.status();
  return MakeChunkedSource(path, *std::move(pyramid), context);
}

}  // namespace

VolumeFormat Hdf5() {
  return {.name = "HDF5",
          .endings = {".ims", ".h5", ".hdf5", ".he5", ".nc", ".nc4", ".mnc"},
          .recognises = IsHdf5,
          .options = {"time", "channel", "dataset"},
          .open = Open};
}

}  // namespace slabstream
