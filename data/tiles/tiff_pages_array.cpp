#include "data/tiles/tiff_pages_array.h"

#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <utility>

#include "common/base/printable.h"
#include "common/memory/pooled_vector.h"

namespace slabstream {
namespace {

constexpr std::size_t kMostOpen = 16;  // directories that nobody uses at the moment

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

}  // namespace

Result<TiffPool::Entry> TiffPool::Take(const TiffPlace& place) {
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

void TiffPool::Return(Entry entry) {
  entry.is_new = false;
  const std::lock_guard lock(mutex_);
  if (entries_.size() >= kMostOpen) entries_.erase(entries_.begin());
  entries_.push_back(std::move(entry));
}

TiffPagesArray::TiffPagesArray(std::string name, std::shared_ptr<TiffPool> pool, std::vector<TiffPlace> places, const RawHeader& picture,
                               const TiffChunks& chunks, SourceContext context)
    : state_(std::make_shared<const State>(
          State{std::move(name), std::move(pool), places, picture, chunks, ShapeOf(places.size(), picture, chunks)})),
      context_(std::move(context)) {}

void TiffPagesArray::ReadChunk(std::span<const std::uint64_t> index, ChunkDone done) {
  const int component = state_->chunks.separate ? int(index[3]) : 0;
  const auto slice = std::size_t(index[0]);
  const TiffChunk chunk = {std::int32_t(index[2]), std::int32_t(index[1]), component, state_->places[slice].plane};
  context_->PostDecode([state = state_, slice, chunk, done = std::move(done)] {
    const auto read = [&]() -> Result<std::optional<StoredChunk>> {
      try {
        return state->Read(slice, chunk);
      } catch (const std::exception& error) {
        return Status::ResourceExhausted(fmt::format("{}: a chunk cannot be read: {}", state->name, error.what()));
      }
    };
    Result<std::optional<StoredChunk>> result = read();
    if (!result.ok()) result = Printable(result.status());
    done(std::move(result));
  });
}

// Pages that were not looked at before may be others than the first one, or those of a file that has changed.
Status TiffPagesArray::State::CheckPage(const std::string& page, TiffFile& file) const {
  const Result<RawHeader> header = file.ReadHeader();
  if (!header.ok()) return header.status();
  if (Status status = CheckSlice(page, *header, picture); !status.ok()) return status;
  const Result<TiffChunks> its_chunks = file.ReadChunks(*header);
  if (!its_chunks.ok()) return its_chunks.status();
  if (*its_chunks == chunks) return Status::Ok();
  return Status::InvalidArgument(fmt::format("{} has tiles or strips of {} x {}, must have {} x {} like the first one", page,
                                             its_chunks->width, its_chunks->height, chunks.width, chunks.height));
}

Result<std::optional<StoredChunk>> TiffPagesArray::State::Read(std::size_t slice, const TiffChunk& chunk) const {
  const std::string place = fmt::format("{}: slice {}", name, slice);
  const auto failed = [&](const Status& status, const std::string& where) {
    return Status(status.code(), where + ": " + status.message());
  };
  Result<TiffPool::Entry> entry = pool->Take(places[slice]);
  if (!entry.ok()) return failed(entry.status(), fmt::format("slice {}", slice));
  if (entry->is_new) {
    if (Status status = CheckPage(place, *entry->file); !status.ok()) return status;
  }
  std::uint64_t bytes = shape.chunk_bytes();
  if (shape.cut_at_end) {
    const std::int32_t rows = std::min(chunks.height, picture.size.y - chunk.row * chunks.height);
    bytes = bytes / std::uint64_t(chunks.height) * std::uint64_t(rows);
  }
  UnwrittenVector<std::byte> elements(bytes, std::byte{0});  // whatever a decoder of libtiff leaves out
  const Result<std::uint64_t> stored = entry->file->ReadChunk(picture, chunks, chunk, elements);
  if (!stored.ok()) {
    return failed(stored.status(), fmt::format("slice {}, {} {}, {}", slice, chunks.tiled() ? "tile" : "strips", chunk.column, chunk.row));
  }
  pool->Return(*std::move(entry));
  return std::optional(StoredChunk{Bytes(std::move(elements)), *stored});
}

}  // namespace slabstream
