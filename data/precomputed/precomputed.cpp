// Neuroglancer's precomputed volumes in folders as sources.
#include <filesystem>

#include "data/metadata/open_store_for.h"
#include "data/precomputed/precomputed_pyramid.h"
#include "data/volume_io/formats.h"

namespace slabstream {
namespace precomputed {
namespace {

// A folder with an info file that names scales, or says that it is such a volume.
bool Recognises(const std::string& path, const ReadOptions&) {
  std::error_code error;
  const std::string info = (std::filesystem::path(path) / kInfo).string();
  if (!std::filesystem::is_regular_file(info, error)) return false;
  constexpr std::uint64_t kMostBytes = std::uint64_t{1} << 20;
  const Result<Bytes> bytes = ReadNow(*FolderStore(path, Links::kMayLeadOut), kInfo, kMostBytes);
  if (!bytes.ok()) return false;
  const std::string_view text(reinterpret_cast<const char*>(bytes->span().data()), bytes->size());
  return text.find("\"scales\"") != std::string_view::npos || text.find("neuroglancer_multiscale_volume") != std::string_view::npos;
}

}  // namespace
}  // namespace precomputed

VolumeFormat Precomputed() {
  return {.name = "Neuroglancer precomputed",
          .recognises = precomputed::Recognises,
          .options = {"channel", "follow-links"},
          .markers = {precomputed::kInfo},
          .open = OpenInStore<precomputed::OpenPyramid>};
}

}  // namespace slabstream
