// N5 containers in folders as sources.
#include <filesystem>

#include "data/metadata/open_store_for.h"
#include "data/n5/n5_pyramid.h"
#include "data/volume_io/formats.h"

namespace slabstream {
namespace n5 {
namespace {

bool Recognises(const std::string& path, const ReadOptions&) {
  std::error_code error;
  return std::filesystem::is_directory(path, error) && (std::filesystem::path(path).extension() == ".n5" ||
                                                        std::filesystem::is_regular_file(std::filesystem::path(path) / kAttributes, error));
}

}  // namespace
}  // namespace n5

VolumeFormat N5() {
  return {.name = "N5",
          .recognises = n5::Recognises,
          .options = {"time", "channel", "array", "follow-links"},
          .markers = {n5::kAttributes},
          .open = OpenInStore<n5::OpenPyramid>};
}

}  // namespace slabstream
