#include "data/zarr/zarr_array.h"

#include <fmt/format.h>

#include <array>
#include <atomic>
#include <utility>

#include "common/threads/guarded.h"
#include "data/sources/decode_chunk.h"
#include "data/zarr/zarr_layout.h"

namespace slabstream::zarr {
namespace {

using metadata::Join;

constexpr std::uint64_t kIndexBytes = std::uint64_t{32} << 20;  // of shards' indices, for each source

// Codecs may make bytes that they cannot pack a little longer.
std::uint64_t MostStored(std::uint64_t bytes) { return bytes + bytes / 8 + (1 << 16); }

class Array : public ChunkedArray, public std::enable_shared_from_this<Array> {
 public:
  Array(ArrayContext context, std::string path, ZarrLayout layout)
      : context_(std::move(context)), path_(std::move(path)), layout_(std::move(layout)) {}

  const ArrayShape& shape() const override { return layout_.shape; }
  std::string NameOf(std::span<const std::uint64_t> index) const override { return NameOf(KeyOf(index, separator_)); }

  void ReadChunk(std::span<const std::uint64_t> index, ChunkDone done, StillWanted wanted) override {
    if (layout_.sharding) {
      std::uint64_t number = 0;  // in its shard
      for (std::size_t i = 0; i < index.size(); ++i) number += index[i] % layout_.sharding->chunks[i] * layout_.sharding->strides[i];
      return ReadFromShard(KeyOf(index, separator_), number, std::move(done), wanted);
    }
    if (layout_.separator_stated || separator_known_) return ReadObject(KeyOf(index, separator_), std::move(done), wanted);
    auto try_other = [self = shared_from_this(), other = KeyOf(index, '/'), done = std::move(done),
                      wanted](Result<std::optional<StoredChunk>> chunk) mutable {
      if (!chunk.ok() || *chunk) {
        self->separator_known_ = true;
        return done(std::move(chunk));
      }
      auto take_nested = [self, done = std::move(done)](Result<std::optional<StoredChunk>> nested) {
        if (nested.ok() && *nested) {
          self->separator_ = '/';
          self->separator_known_ = true;
        }
        done(std::move(nested));
      };
      self->ReadObject(other, std::move(take_nested), wanted);
    };
    ReadObject(KeyOf(index, separator_), std::move(try_other), wanted);
  }

 private:
  using Index = ShardIndices::Index;

  std::string NameOf(const std::string& key) const { return context_.store->name() + "/" + key; }

  // Of the object that holds a chunk: its own, or its shard.
  std::string KeyOf(std::span<const std::uint64_t> index, char separator) const {
    std::array<std::uint64_t, kMaxArrayAxes> object{};
    for (std::size_t i = 0; i < index.size(); ++i) object.at(i) = layout_.sharding ? index[i] / layout_.sharding->chunks[i] : index[i];
    return Join(path_, layout_.Key(std::span(object).first(index.size()), separator));
  }

  void ReadObject(const std::string& key, ChunkDone done, const StillWanted& wanted) {
    const std::uint64_t most = MostStored(MostEncoded(layout_.codecs, shape().chunk_bytes()));
    auto decode = [self = shared_from_this(), what = NameOf(key), most, done = std::move(done)](Result<Bytes> answer) mutable {
      if (answer.ok() && answer->size() > most) answer = Status::DataLoss(fmt::format("{}: damaged: has more than {} bytes", what, most));
      DecodeOn(self->context_.source, self->layout_.codecs, std::move(answer), self->shape().chunk_bytes(), std::move(what),
               std::move(done));
    };
    // One byte more than there may be tells that there are more.
    context_.store->Read(key, {.bytes = most + 1}, most + 1, std::move(decode), wanted);
  }

  void ReadFromShard(const std::string& key, std::uint64_t number, ChunkDone done, const StillWanted& wanted) {
    auto with_index = [self = shared_from_this(), key, number, done = std::move(done), wanted](Result<Index> answer) mutable {
      // Who read it for all does not want it any more.
      const bool again = answer.status().code() == StatusCode::kCancelled && (!wanted || wanted());
      if (again) return self->ReadFromShard(key, number, std::move(done), wanted);
      if (!answer.ok()) return done(answer.status());
      self->ReadIndexed(key, number, *answer, std::move(done), wanted);
    };
    if (context_.indices->Ask(key, std::move(with_index))) ReadIndex(*layout_.sharding, key, wanted);
  }

  void ReadIndex(const Sharding& sharding, const std::string& key, const StillWanted& wanted) {
    const ByteRange range{.bytes = sharding.index_bytes, .from_end = sharding.index_at_end};
    auto decode = [self = shared_from_this(), key](Result<Bytes> answer) {
      const Result<Index> index = Guarded("reading the index of a shard", [&] { return self->DecodeIndex(key, std::move(answer)); });
      self->context_.indices->Put(key, index);
    };
    context_.store->Read(key, range, sharding.index_bytes, std::move(decode), wanted);
  }

  Result<Index> DecodeIndex(const std::string& key, Result<Bytes> answer) const {
    if (answer.status().code() == StatusCode::kNotFound) return Index();
    if (!answer.ok()) return answer.status();
    constexpr std::uint64_t kPairBytes = 16;
    const Sharding& sharding = *layout_.sharding;
    Result<Bytes> numbers = DecodeChain(sharding.index_codecs, *std::move(answer), kPairBytes * sharding.chunk_count());
    if (numbers.ok()) return Index(std::make_shared<const ShardIndex>(*std::move(numbers)));
    return Status(numbers.status().code(), fmt::format("{}: index of the shard: {}", NameOf(key), numbers.status().message()));
  }

  void ReadIndexed(const std::string& key, std::uint64_t number, const Index& index, ChunkDone done, const StillWanted& wanted) {
    const std::optional<ByteRange> range = index == nullptr ? std::nullopt : index->Find(number);
    if (!range) return done(std::optional<StoredChunk>());
    std::string what = fmt::format("{}: chunk {} of the shard", NameOf(key), number);
    // If it is damaged, its shard may have been replaced since the index was read.
    auto decoded = [self = shared_from_this(), key, done = std::move(done)](Result<std::optional<StoredChunk>> chunk) {
      if (!chunk.ok() && chunk.status().code() != StatusCode::kCancelled) self->context_.indices->Forget(key);
      done(std::move(chunk));
    };
    const std::uint64_t bytes = range->bytes, most = MostStored(MostEncoded(layout_.codecs, shape().chunk_bytes()));
    if (bytes > most || range->begin > ~bytes) {
      return decoded(Status::DataLoss(fmt::format("{}: damaged: the index says that it has {} bytes at {}", what, bytes, range->begin)));
    }
    auto decode = [self = shared_from_this(), what = std::move(what), bytes, decoded = std::move(decoded)](Result<Bytes> answer) mutable {
      if (answer.status().code() == StatusCode::kNotFound) answer = Status::Unavailable(what + ": the shard is gone");
      if (answer.ok() && answer->size() != bytes) {
        answer = Status::DataLoss(fmt::format("{}: damaged: the shard ends after {} of its {} bytes", what, answer->size(), bytes));
      }
      DecodeOn(self->context_.source, self->layout_.codecs, std::move(answer), self->shape().chunk_bytes(), std::move(what),
               std::move(decoded));
    };
    context_.store->Read(key, *range, most, std::move(decode), wanted);
  }

  const ArrayContext context_;
  const std::string path_;
  const ZarrLayout layout_;
  // A chunk that was found tells it, where the metadata do not.
  std::atomic<char> separator_ = layout_.key_separator;
  std::atomic<bool> separator_known_ = false;
};

}  // namespace

ArrayContext MakeArrayContext(std::shared_ptr<Store> store, SourceContext source) {
  return {std::move(store), std::move(source), std::make_shared<ShardIndices>(kIndexBytes)};
}

Result<ZarrArray> OpenArray(const ArrayContext& context, const ZarrNode& node) {
  Result<ZarrLayout> layout = node.version == 2 ? ParseLayout2(node.metadata_field()) : ParseLayout3(node.metadata_field());
  if (!layout.ok()) return layout.status();
  ZarrArray opened{.from = layout->from, .dimension_names = layout->dimension_names};
  opened.array = std::make_shared<Array>(context, node.path, *std::move(layout));
  return opened;
}

}  // namespace slabstream::zarr
