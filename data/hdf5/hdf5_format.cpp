#include "data/hdf5/hdf5_format.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <set>
#include <string_view>
#include <utility>

#include "data/hdf5/hdf5_layouts.h"

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

int CountNumbered(const std::vector<std::string>& names, const std::string& prefix) {
  const std::set<std::string_view> known(names.begin(), names.end());
  int count = 0;
  while (known.contains(prefix + std::to_string(count))) ++count;
  return count;
}

Result<Pyramid> ReadHdf5(const std::string& path, const ReadOptions& options, const SourceContext& context) {
  const Result<std::shared_ptr<Hdf5File>> file = Hdf5File::Open(path);
  if (!file.ok()) return file.status();
  // A path names a dataset of any file, and a bare name a mesh of openPMD.
  const bool is_mesh = options.dataset.find('/') == std::string::npos && OpenPmd().recognises(**file);
  if (!options.dataset.empty() && !is_mesh) return AnyHdf5().read(*file, options, context);
  const std::array layouts = {Imaris(), BigDataViewerHdf5(), OpenPmd(), AnyHdf5()};
  const auto layout = std::ranges::find_if(layouts, [&](const Hdf5Layout& each) { return each.recognises(**file); });
  return layout->read(*file, options, context);
}

VolumeFormat Hdf5() {
  return {.name = "HDF5",
          .endings = {".ims", ".h5", ".hdf5", ".he5", ".nc", ".nc4", ".mnc"},
          .recognises = IsHdf5,
          .options = {"time", "channel", "dataset"},
          .open = Open};
}

}  // namespace slabstream
