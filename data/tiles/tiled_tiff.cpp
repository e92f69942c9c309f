#include "data/tiles/tiled_tiff.h"

#include <algorithm>
#include <filesystem>
#include <set>
#include <utility>

#include "data/sources/chunked_source.h"
#include "data/tiles/tiff_pages_array.h"
#include "data/volume_io/tiff_stack.h"
#include "data/volume_io/world_placement.h"

namespace slabstream {
namespace {

// The pictures of one level; `picture`: the header of the first one.
struct Pictures {
  std::vector<TiffPlace> places;
  RawHeader picture;
  TiffChunks chunks;
};

Result<Pictures> ReadPictures(const TiffStack& stack, std::vector<TiffPlace> places) {
  const Result<std::unique_ptr<TiffFile>> first = TiffFile::Open(stack.files[places.front().file], places.front().directory);
  if (!first.ok()) return first.status();
  Result<RawHeader> picture = (*first)->ReadHeader();
  if (!picture.ok()) return picture.status();
  const Result<TiffChunks> chunks = (*first)->ReadChunks(*picture);
  if (!chunks.ok()) return chunks.status();
  return Pictures{std::move(places), *std::move(picture), *chunks};
}

// Of all levels that there are for each slice. What a file says besides, such as a thumbnail of one page, is left out: pictures that are
// not smaller than those before, or of another kind.
Result<std::vector<Pictures>> ReadLevels(const TiffStack& stack) {
  std::vector<TiffPlace> places;
  for (const TiffSlice& slice : stack.slices) places.push_back({slice.file, slice.directory, slice.plane});
  Result<Pictures> finest = ReadPictures(stack, std::move(places));
  if (!finest.ok()) return finest.status();
  std::vector<Pictures> levels = {*std::move(finest)};
  const auto levels_of = [](const TiffSlice& slice) { return slice.plane > 0 ? 0 : slice.smaller.size(); };
  const std::size_t smaller = levels_of(*std::ranges::min_element(stack.slices, {}, levels_of));
  for (std::size_t i = 0; i < smaller; ++i) {
    std::vector<TiffPlace> of_level;
    for (const TiffSlice& slice : stack.slices) of_level.push_back({slice.file, slice.smaller[i]});
    Result<Pictures> level = ReadPictures(stack, std::move(of_level));
    if (!level.ok()) continue;
    const RawHeader &picture = level->picture, &before = levels.back().picture;
    const bool fits = picture.type == before.type && picture.components == before.components && picture.size != before.size &&
                      Min(picture.size, before.size) == picture.size;
    if (fits) levels.push_back(*std::move(level));
  }
  return levels;
}

// Those whose change makes another volume of it: `path`, and the files that slices are in.
std::vector<std::string> WatchedFiles(const std::string& path, const TiffStack& stack) {
  std::set<std::string> files;
  for (const TiffSlice& slice : stack.slices) files.insert(stack.files[slice.file]);
  files.erase(path);
  std::vector<std::string> all = {path};
  all.insert(all.end(), files.begin(), files.end());
  return all;
}

}  // namespace

Result<std::shared_ptr<VolumeSource>> OpenTiff(const std::string& path, const ReadOptions& options, const SourceContext& context) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) return std::shared_ptr<VolumeSource>();
  Result<TiffStack> stack = OpenTiffStack(path, options);
  if (!stack.ok()) return stack.status();
  const RawHeader& header = stack->header;
  if (Status status = CheckChannel(path, header, stack->of_pages); !status.ok()) return status;
  if (stack->of_pages.channel == kLuminance) return std::shared_ptr<VolumeSource>();
  const Result<WorldPlacement> placed = PlaceInWorld(header, path);
  if (!placed.ok()) return placed.status();
  const VolumeGeometry& geometry = placed->geometry;
  Result<std::vector<Pictures>> levels = ReadLevels(*stack);
  if (!levels.ok()) return levels.status();

  Pyramid pyramid{.orientation = geometry.orientation,
                  .rescale = header.rescale,
                  .info = {.format = "TIFF",
                           .channels = header.channels,
                           .channel = header.channels.empty() ? stack->of_pages.channel.value_or(0) : header.channel,
                           .times = int(header.volumes),
                           .time = int(header.number),
                           .window = stack->window,
                           .notes = header.notes,
                           .files = WatchedFiles(path, *stack)}};
  if (header.channels.empty() && header.components > 1) {
    pyramid.info.channels.resize(std::size_t(header.components));
    pyramid.info.components = header.components;
  }
  const auto pool = std::make_shared<TiffPool>(stack->files);
  for (Pictures& level : *levels) {
    const Vec3 size = ToVec3({level.picture.size.x, level.picture.size.y, geometry.size.z});
    const Vec3 spacing = geometry.spacing * ToVec3(geometry.size) / size;
    std::vector<std::uint64_t> at = {0, 0, 0};
    if (header.components > 1) at.push_back(std::uint64_t(stack->of_pages.channel.value_or(0)));
    // Half a voxel from the corner.
    const Vec3 first = geometry.orientation.ToWorld(0.5 * (spacing - geometry.spacing));
    const std::string name = pyramid.levels.empty() ? path : path + ": level " + std::to_string(pyramid.levels.size());
    pyramid.levels.push_back(
        {.array = std::make_shared<TiffPagesArray>(name, pool, std::move(level.places), level.picture, level.chunks, context),
         .at = std::move(at),
         .spacing = spacing,
         .origin = geometry.orientation.origin + first});
  }
  return MakeChunkedSource(path, std::move(pyramid), context);
}

}  // namespace slabstream
