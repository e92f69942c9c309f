#include "data/precomputed/segmentation_codec.h"

#include <algorithm>
#include <bit>
#include <cstring>

#include "common/memory/pooled_vector.h"
#include "data/codecs/decoded_bytes.h"

namespace slabstream::precomputed {
namespace {

static_assert(std::endian::native == std::endian::little, "labels are kept as they are stored");

// All places are numbers of 32-bit words, little endian.
class Words {
 public:
  explicit Words(std::span<const std::byte> bytes) : bytes_(bytes), count_(bytes.size() / 4) {}

  std::uint64_t count() const { return count_; }
  std::uint32_t at(std::uint64_t place) const {  // below count()
    std::uint32_t word = 0;
    std::memcpy(&word, bytes_.data() + 4 * place, sizeof(word));
    return word;
  }
  const std::byte* data(std::uint64_t place) const { return bytes_.data() + 4 * place; }
  Words From(std::uint64_t place) const { return Words(bytes_.subspan(4 * place)); }

 private:
  std::span<const std::byte> bytes_;
  std::uint64_t count_;
};

class Segmentation {
 public:
  using Triple = std::array<std::uint64_t, 3>;
  Segmentation(const Triple& size, const Triple& block, std::uint64_t channels, std::size_t label_bytes)
      : size_(size), block_(block), channels_(channels), label_bytes_(label_bytes) {}

  Result<Bytes> Decode(const Bytes& packed, std::uint64_t most) const {
    const std::uint64_t of_channel = size_[0] * size_[1] * size_[2] * label_bytes_, bytes = channels_ * of_channel;
    if (bytes > most) return TooManyBytes(kName, bytes, most);
    const Words words(packed.span());
    if (words.count() < channels_) return DamagedBytes(kName);
    UnwrittenVector<std::byte> out(bytes);
    for (std::uint64_t channel = 0; channel < channels_; ++channel) {
      const std::uint64_t begin = words.at(channel);
      if (begin > words.count() || !DecodeChannel(words.From(begin), out.data() + channel * of_channel)) return DamagedBytes(kName);
    }
    return Bytes(std::move(out));
  }

 private:
  static constexpr std::string_view kName = "compressed_segmentation";

  bool DecodeChannel(const Words& words, std::byte* out) const {
    Triple counts;
    for (std::size_t axis = 0; axis < 3; ++axis) counts[axis] = (size_[axis] - 1) / block_[axis] + 1;
    constexpr std::uint64_t kHeaderWords = 2;
    if (words.count() / kHeaderWords < counts[0] * counts[1] * counts[2]) return false;
    std::uint64_t header = 0;
    for (std::uint64_t z = 0; z < counts[2]; ++z) {
      for (std::uint64_t y = 0; y < counts[1]; ++y) {
        for (std::uint64_t x = 0; x < counts[0]; ++x, header += kHeaderWords) {
          if (!DecodeBlock(words, header, {x * block_[0], y * block_[1], z * block_[2]}, out)) return false;
        }
      }
    }
    return true;
  }

  // Whole blocks are stored, also at the end, where they reach beyond the chunk.
  bool DecodeBlock(const Words& words, std::uint64_t header, const Triple& begin, std::byte* out) const {
    constexpr std::uint32_t kTableMask = 0xffffff;
    const std::uint64_t table = words.at(header) & kTableMask, values = words.at(header + 1), label_words = label_bytes_ / 4;
    const unsigned bits = words.at(header) >> 24;
    if (bits > 32 || (bits != 0 && !std::has_single_bit(bits))) return false;
    Triple end;
    for (std::size_t axis = 0; axis < 3; ++axis) end[axis] = std::min(begin[axis] + block_[axis], size_[axis]);
    for (std::uint64_t z = begin[2]; z < end[2]; ++z) {
      for (std::uint64_t y = begin[1]; y < end[1]; ++y) {
        std::byte* row = out + ((z * size_[1] + y) * size_[0] + begin[0]) * label_bytes_;
        const std::uint64_t first = ((z - begin[2]) * block_[1] + (y - begin[1])) * block_[0];
        for (std::uint64_t x = begin[0]; x < end[0]; ++x, row += label_bytes_) {
          std::uint64_t number = 0;  // of the label in the table
          if (bits != 0) {
            const std::uint64_t bit = (first + x - begin[0]) * bits, place = values + bit / 32;
            if (place >= words.count()) return false;
            number = words.at(place) >> (bit % 32);
            if (bits < 32) number &= (std::uint64_t{1} << bits) - 1;
          }
          const std::uint64_t place = table + number * label_words;
          if (place + label_words > words.count()) return false;
          std::memcpy(row, words.data(place), label_bytes_);
        }
      }
    }
    return true;
  }

  const Triple size_, block_;
  const std::uint64_t channels_;
  const std::size_t label_bytes_;
};

}  // namespace

SharedCodec SegmentationCodec(const std::array<std::uint64_t, 3>& size, const std::array<std::uint64_t, 3>& block, std::uint64_t channels,
                              std::size_t label_bytes) {
  return std::make_shared<ChunkCodec>(
      [of = Segmentation(size, block, channels, label_bytes)](const Bytes& packed, std::uint64_t most) { return of.Decode(packed, most); });
}

}  // namespace slabstream::precomputed
