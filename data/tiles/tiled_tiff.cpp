#include "data/tiles/tiled_tiff.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <filesystem>
#include <mutex>
#include <optional>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include "common/base/printable.h"
#include "common/memory/pooled_vector.h"
#include "data/sources/chunked_array.h"
#include "data/sources/chunked_source.h"
#include "data/volume_io/tiff_file.h"
#include "data/volume_io/tiff_stack.h"
#include "data/volume_io/world_placement.h"

namespace slabstream {
namespace {

constexpr std::size_t kMostOpen = 16;  // directories that nobody uses at the moment

// Where a picture is.
struct TiffPlace {
  std::size_t file = 0;         // in the pool
  std::uint64_t directory = 0;  // its place there
  std::int64_t plane = 0;       // TiffChunk::plane
};

// Open files at directories, which are used by one thread at a time: those that were used last.
class TiffPool {
 public:
  // `files`: their paths.
  explicit TiffPool(std::vector<std::string> files) : files_(std::move(files)) {}

  struct Entry {
    std::size_t number = 0;  // the file's number
    std::uint64_t directory = 0;
    std::unique_ptr<TiffFile> file;
    bool is_new = true;  // nobody has used it
  };
  // Any thread. Errors of TiffFile::Open.
  Result<Entry> Take(const TiffPlace& place) {
    {
      const std::lock_guard lock(mutex_);
      const auto found = std::ranges::find_if(
          entries_, [&](const Entry& entry) { return entry.directory == place.directory && entry.number == place.file; });
      if (found != entries_.end()) {
        Entry entry = std::move(*found);
        entries_.erase(found);
        return entry;
      }
    }
    Result<std::unique_ptr<TiffFile>> file = TiffFile::Open(files_[place.file], place.directory);
    if (!file.ok()) return file.status();
    return Entry{place.file, place.directory, *std::move(file)};
  }

  void Return(Entry entry) {
    entry.is_new = false;
    const std::lock_guard lock(mutex_);
    if (entries_.size() >= kMostOpen) entries_.erase(entries_.begin());
    entries_.push_back(std::move(entry));
  }

 private:
  const std::vector<std::string> files_;
  std::mutex mutex_;            // guards what follows
  std::vector<Entry> entries_;  // the last used one last
};

ArrayShape ShapeOf(std::size_t pages, const RawHeader& picture, const TiffChunks& chunks) {
  ArrayShape shape{.size = {pages, std::uint64_t(picture.size.y), std::uint64_t(picture.size.x)},
                   .chunk = {1, std::uint64_t(chunks.height), std::uint64_t(chunks.width)},
                   .type = picture.type,
                   .cut_at_end = !chunks.tiled(),
                   .fill = std::vector<std::byte>(BytesPerSample(picture.type))};
  if (picture.components > 1) {
    shape.size.push_back(std::uint64_t(picture.components));
    shape.chunk.push_back(chunks.separate ? 1 : std::uint64_t(picture.components));
  }
  return shape;
}

// Pictures of one size in TIFF files as an array of the axes z, y, x, and where a pixel has several components, these.
class TiffPagesArray : public ChunkedArray, public std::enable_shared_from_this<TiffPagesArray> {
 public:
  // `places`: of the pictures, along z. `picture`: the header of each. `name`: for messages.
  TiffPagesArray(std::string name, std::shared_ptr<TiffPool> pool, std::vector<TiffPlace> places, const RawHeader& picture,
                 const TiffChunks& chunks, SourceContext context)
      : name_(std::move(name)),
        pool_(std::move(pool)),
        places_(std::move(places)),
        picture_(picture),
        chunks_(chunks),
        shape_(ShapeOf(places_.size(), picture, chunks)),
        context_(std::move(context)) {}

  const ArrayShape& shape() const override { return shape_; }
  void ReadChunk(std::span<const std::uint64_t> index, ChunkDone done, StillWanted /*wanted*/) override {
    const int component = chunks_.separate ? int(index[3]) : 0;
    const auto slice = std::size_t(index[0]);
    const TiffChunk chunk = {std::int32_t(index[2]), std::int32_t(index[1]), component, places_[slice].plane};
    context_->PostDecode([self = shared_from_this(), slice, chunk, done = std::move(done)] {
      const auto read = [&]() -> Result<std::optional<StoredChunk>> {
        try {
          return self->Read(slice, chunk);
        } catch (const std::exception& error) {
          return Status::ResourceExhausted(fmt::format("{}: a chunk cannot be read: {}", self->name_, error.what()));
        }
      };
      Result<std::optional<StoredChunk>> result = read();
      if (!result.ok()) result = Printable(result.status());
      done(std::move(result));
    });
  }

 private:
  Result<std::optional<StoredChunk>> Read(std::size_t slice, const TiffChunk& chunk) const {
    const std::string place = fmt::format("{}: slice {}", name_, slice);
    const auto failed = [&](const Status& status, const std::string& where) {
      return Status(status.code(), where + ": " + status.message());
    };
    Result<TiffPool::Entry> entry = pool_->Take(places_[slice]);
    if (!entry.ok()) return failed(entry.status(), fmt::format("slice {}", slice));
    if (entry->is_new) {
      if (Status status = CheckPage(place, *entry->file); !status.ok()) return status;
    }
    std::uint64_t bytes = shape_.chunk_bytes();
    if (shape_.cut_at_end) {
      const std::int32_t rows = std::min(chunks_.height, picture_.size.y - chunk.row * chunks_.height);
      bytes = bytes / std::uint64_t(chunks_.height) * std::uint64_t(rows);
    }
    UnwrittenVector<std::byte> elements(bytes, std::byte{0});  // whatever a decoder of libtiff leaves out
    const Result<std::uint64_t> stored = entry->file->ReadChunk(picture_, chunks_, chunk, elements);
    if (!stored.ok()) {
      return failed(stored.status(),
                    fmt::format("slice {}, {} {}, {}", slice, chunks_.tiled() ? "tile" : "strips", chunk.column, chunk.row));
    }
    pool_->Return(*std::move(entry));
    return std::optional(StoredChunk{Bytes(std::move(elements)), *stored});
  }

  // Pages that were not looked at before may be others than the first one, or those of a file that has changed.
  Status CheckPage(const std::string& page, TiffFile& file) const {
    const Result<RawHeader> header = file.ReadHeader();
    if (!header.ok()) return header.status();
    if (Status status = CheckSlice(page, *header, picture_); !status.ok()) return status;
    const Result<TiffChunks> its_chunks = file.ReadChunks(*header);
    if (!its_chunks.ok()) return its_chunks.status();
    if (*its_chunks == chunks_) return Status::Ok();
    return Status::InvalidArgument(fmt::format("{} has tiles or strips of {} x {}, must have {} x {} like the first one", page,
                                               its_chunks->width, its_chunks->height, chunks_.width, chunks_.height));
  }

  const std::string name_;
  const std::shared_ptr<TiffPool> pool_;
  const std::vector<TiffPlace> places_;
  const RawHeader picture_;
  const TiffChunks chunks_;
  const ArrayShape shape_;
  const SourceContext context_;
};

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
                           .times = header.times,
                           .time = int(header.number),
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
         .channel_axis = header.channels.empty() && header.components > 1 ? 3 : -1,
         .spacing = spacing,
         .origin = geometry.orientation.origin + first});
  }
  return MakeChunkedSource(path, std::move(pyramid), context);
}

}  // namespace slabstream
