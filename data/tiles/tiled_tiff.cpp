#include "data/tiles/tiled_tiff.h"

#include <algorithm>
#include <filesystem>
#include <utility>

#include "common/base/printable.h"
#include "data/sources/chunked_source.h"
#include "data/tiles/tiff_pages_array.h"
#include "data/volume_io/formats.h"
#include "data/volume_io/tiff_stack.h"
#include "data/volume_io/volume_reader.h"
#include "data/volume_io/world_placement.h"

namespace slabstream {
namespace {

bool Recognises(const std::string& path, const ReadOptions&) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) return false;
  const VolumeFormat* const format = FindFormat(path, {});
  return format != nullptr && format->name == "TIFF";
}

// The pictures of one level, at the places of their directories; `picture`: the header of the first one.
struct Pictures {
  std::vector<std::uint64_t> directories;
  RawHeader picture;
  TiffChunks chunks;
};

Result<Pictures> ReadPictures(const TiffFile& file, std::vector<std::uint64_t> directories) {
  const Result<std::unique_ptr<TiffFile>> first = file.At(directories.front());
  if (!first.ok()) return first.status();
  Result<RawHeader> picture = (*first)->ReadHeader();
  if (!picture.ok()) return picture.status();
  const Result<TiffChunks> chunks = (*first)->ReadChunks(*picture);
  if (!chunks.ok()) return chunks.status();
  return Pictures{std::move(directories), *std::move(picture), *chunks};
}

// Of all levels that there are for each slice. What a file says besides, such as a thumbnail of one page, is left out: pictures that are
// not smaller than those before, or of another kind.
Result<std::vector<Pictures>> ReadLevels(const TiffStack& stack) {
  std::vector<const TiffPage*> slices;
  for (std::int64_t i = 0; i < stack.order.count; ++i) slices.push_back(&stack.pages[std::size_t(stack.order.PageOf(i))]);
  std::vector<std::uint64_t> directories;
  for (const TiffPage* slice : slices) directories.push_back(slice->offset);
  Result<Pictures> finest = ReadPictures(*stack.file, std::move(directories));
  if (!finest.ok()) return finest.status();
  std::vector<Pictures> levels = {*std::move(finest)};
  const std::size_t smaller =
      (*std::ranges::min_element(slices, {}, [](const TiffPage* slice) { return slice->smaller.size(); }))->smaller.size();
  for (std::size_t i = 0; i < smaller; ++i) {
    std::vector<std::uint64_t> places;
    for (const TiffPage* slice : slices) places.push_back(slice->smaller[i]);
    Result<Pictures> level = ReadPictures(*stack.file, std::move(places));
    if (!level.ok()) continue;
    const RawHeader &picture = level->picture, &before = levels.back().picture;
    const bool fits = picture.type == before.type && picture.components == before.components && picture.size != before.size &&
                      Min(picture.size, before.size) == picture.size;
    if (fits) levels.push_back(*std::move(level));
  }
  return levels;
}

Result<std::shared_ptr<VolumeSource>> OpenFile(const std::string& path, const ReadOptions& options, const SourceContext& context) {
  if (Status status = CheckVolume(path, options); !status.ok()) return status;
  Result<TiffStack> stack = OpenTiffStack(path, options);
  if (!stack.ok()) return stack.status();
  const RawHeader& header = stack->header;
  if (Status status = CheckChannel(path, header, stack->of_pages); !status.ok()) return status;
  if (stack->of_pages.channel == kLuminance) {
    return Status::InvalidArgument(path + ": cannot be read tile by tile: luminance needs several components of a voxel");
  }
  const Result<WorldPlacement> placed = PlaceInWorld(header, path);
  if (!placed.ok()) return placed.status();
  const VolumeGeometry& geometry = placed->geometry;
  Result<std::vector<Pictures>> levels = ReadLevels(*stack);
  if (!levels.ok()) return levels.status();

  Pyramid pyramid{.orientation = geometry.orientation,
                  .rescale = header.rescale,
                  .info = {.format = "TIFF", .channels = stack->order.channels, .times = stack->order.times, .files = {path}}};
  if (!stack->order.of_channel) pyramid.info.channels.resize(header.components > 1 ? std::size_t(header.components) : 0);
  pyramid.info.channel = stack->order.of_channel ? stack->order.channel : stack->of_pages.channel.value_or(0);
  const auto pool = std::make_shared<TiffPool>(std::move(stack->file));
  for (Pictures& level : *levels) {
    const Vec3 size = ToVec3({level.picture.size.x, level.picture.size.y, geometry.size.z});
    const Vec3 spacing = geometry.spacing * ToVec3(geometry.size) / size;
    std::vector<std::uint64_t> at = {0, 0, 0};
    if (header.components > 1) at.push_back(std::uint64_t(stack->of_pages.channel.value_or(0)));
    // Half a voxel from the corner.
    const Vec3 first = geometry.orientation.ToWorld(0.5 * (spacing - geometry.spacing));
    const std::string name = pyramid.levels.empty() ? path : path + ": level " + std::to_string(pyramid.levels.size());
    pyramid.levels.push_back(
        {.array = std::make_shared<TiffPagesArray>(name, pool, std::move(level.directories), level.picture, level.chunks, context),
         .at = std::move(at),
         .spacing = spacing,
         .origin = geometry.orientation.origin + first});
  }
  return MakeChunkedSource(path, std::move(pyramid), context);
}

Result<std::shared_ptr<VolumeSource>> Open(const std::string& path, const ReadOptions& options, const SourceContext& context) {
  Result<std::shared_ptr<VolumeSource>> source = OpenFile(path, options, context);
  if (!source.ok()) return Printable(source.status());
  return source;
}

}  // namespace

SourceFormat TiledTiff() { return {.name = "TIFF", .recognises = Recognises, .options = {"time", "channel", "spacing"}, .open = Open}; }

}  // namespace slabstream
