// Structured grids of VTK in several files (.pvti, .pvtr, and .vtm and its like of images) as sources: each piece is a volume file of its
// own.
#include <algorithm>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "data/mosaic/mosaic_source.h"
#include "data/positional/file_source.h"
#include "data/positional/located_volume.h"
#include "data/positional/turned_box.h"
#include "data/volume_io/formats.h"
#include "data/volume_io/text_header.h"
#include "data/volume_io/vtk_image.h"
#include "data/volume_io/vtk_list.h"

namespace slabstream {

namespace {

constexpr std::string_view kImageEnding = ".pvti", kRectilinearEnding = ".pvtr";

bool EndsIn(const std::string& path, std::string_view ending) { return ToLower(path).ends_with(ending); }

bool Claims(const std::string& path) { return EndsIn(path, kImageEnding) || EndsIn(path, kRectilinearEnding) || ListsImages(path); }

Result<std::shared_ptr<VolumeSource>> Open(const std::string& path, const ReadOptions& options, const SourceContext& context) {
  const Result<ParallelImage> image = EndsIn(path, kImageEnding)         ? ReadParallelImage(path, "PImageData", options)
                                      : EndsIn(path, kRectilinearEnding) ? ReadParallelImage(path, "PRectilinearGrid", options)
                                                                         : ReadImageBlocks(path, options);
  if (!image.ok()) return image.status();
  if (Status status = CheckChannel(path, image->header, options); !status.ok()) return status;
  const Result<WorldPlacement> placed = PlaceInWorld(image->header, path);
  if (!placed.ok()) return placed.status();
  if (placed->slant) return Status::InvalidArgument(path + ": its Direction is not at right angles, which that of pieces must be");
  const VolumeFormat& of_piece = *std::ranges::find(FileFormats(), image->piece_format, &VolumeFormat::name);
  ReadOptions piece_options = options;
  piece_options.array = image->array;
  const Index3& size = placed->geometry.size;
  std::vector<MosaicPart> parts;
  std::vector<std::filesystem::path> files(image->lists.begin(), image->lists.end());
  for (const ParallelImage::Piece& piece : image->pieces) {
    const auto open = [&of_piece, file = piece.file, piece_options, context] { return OpenFile(of_piece, file, piece_options, context); };
    parts.push_back({piece.file, TurnedBox{placed->turn, size, {}, {}}.Turned(piece.box), open});
    files.emplace_back(piece.file);
  }
  SourceInfo info = InfoOfFile("VTK parallel image", path, image->header, *placed, files, Uniform(1), options);
  return MakeMosaic(path, std::move(info), {std::move(parts)});
}

}  // namespace

VolumeFormat VtkParallelImage() {
  std::vector<std::string_view> endings = {kImageEnding, kRectilinearEnding};
  endings.insert(endings.end(), kBlockListEndings.begin(), kBlockListEndings.end());
  return {.name = "VTK parallel image",
          .endings = std::move(endings),
          .claims = Claims,
          .options = {"channel", "array", "resample"},
          .open = Open};
}

}  // namespace slabstream
