#include "data/volume_io/decompressor.h"

#include <bzlib.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <new>
#include <vector>

namespace slabstream {
namespace {

enum class Step { kMore, kEnd, kDamaged };

// The two libraries have the same kind of stream: bytes in, bytes out, and how many of each are left.
template <bool kBare>
struct Deflate {
  static constexpr bool kHasMembers = !kBare;
  static constexpr char kMagic = '\x1f';  // of a further member
  z_stream stream{};

  bool Begin() {
    // zlib's inflateInit2: tell gzip from zlib by the header; a negative window: there is no header
    constexpr int kLargestWindow = 15, kDetectHeader = 32;
    return inflateInit2(&stream, kBare ? -kLargestWindow : kLargestWindow + kDetectHeader) == Z_OK;
  }
  Step Advance() {
    const int code = inflate(&stream, Z_NO_FLUSH);
    return code == Z_STREAM_END ? Step::kEnd : code == Z_OK ? Step::kMore : Step::kDamaged;
  }
  void End() { inflateEnd(&stream); }
};

struct Bzip2 {
  static constexpr bool kHasMembers = true;
  static constexpr char kMagic = 'B';
  bz_stream stream{};

  bool Begin() { return BZ2_bzDecompressInit(&stream, 0, 0) == BZ_OK; }
  Step Advance() {
    const int code = BZ2_bzDecompress(&stream);
    return code == BZ_STREAM_END ? Step::kEnd : code == BZ_OK ? Step::kMore : Step::kDamaged;
  }
  void End() { BZ2_bzDecompressEnd(&stream); }
};

template <class Codec>
class StreamDecompressor : public Decompressor {
 public:
  StreamDecompressor(std::ifstream& file, std::int64_t offset) : file_(file), input_(std::size_t{1} << 16) {
    file_.seekg(offset);
    Begin();
  }
  ~StreamDecompressor() override { codec_.End(); }
  StreamDecompressor(const StreamDecompressor&) = delete;
  StreamDecompressor& operator=(const StreamDecompressor&) = delete;

  std::size_t Read(std::span<std::byte> out) override {
    auto& stream = codec_.stream;
    std::size_t done = 0;
    while (done < out.size() && step_ != Step::kDamaged) {
      if (stream.avail_in == 0 && !Refill()) break;
      if (step_ == Step::kEnd && !NextMember()) break;
      const std::size_t room = std::min(out.size() - done, std::size_t{1} << 30);  // both count in 32 bits
      SetPointer(stream.next_out, reinterpret_cast<char*>(out.data() + done));
      stream.avail_out = unsigned(room);
      step_ = codec_.Advance();
      done += room - stream.avail_out;
    }
    return done;
  }

  bool damaged() const override { return step_ == Step::kDamaged; }

  bool EndsWell() override {
    std::vector<std::byte> rest(input_.size());
    while (step_ != Step::kEnd && Read(rest) == rest.size()) {
    }
    return step_ == Step::kEnd;
  }

 private:
  template <class Pointer>
  static void SetPointer(Pointer& pointer, char* to) {
    pointer = reinterpret_cast<Pointer>(to);
  }
  void Begin() {
    if (!codec_.Begin()) throw std::bad_alloc();
  }
  bool Refill() {
    file_.read(input_.data(), std::streamsize(input_.size()));
    SetPointer(codec_.stream.next_in, input_.data());
    codec_.stream.avail_in = unsigned(file_.gcount());
    return codec_.stream.avail_in > 0;
  }
  // What follows the end of a stream is another member, or padding, which is ignored.
  bool NextMember() {
    const auto next = codec_.stream.next_in;
    const auto left = codec_.stream.avail_in;
    if (!Codec::kHasMembers || char(*next) != Codec::kMagic) return false;
    codec_.End();
    codec_ = {};
    Begin();
    codec_.stream.next_in = next;
    codec_.stream.avail_in = left;
    step_ = Step::kMore;
    return true;
  }

  std::ifstream& file_;
  std::vector<char> input_;
  Codec codec_;
  Step step_ = Step::kMore;
};

}  // namespace

Compression CompressionOf(const std::filesystem::path& path) {
  std::array<char, 3> first{};
  std::ifstream(path, std::ios::binary).read(first.data(), first.size());
  if (first[0] == '\x1f' && first[1] == '\x8b') return Compression::kDeflate;
  return first == std::array{'B', 'Z', 'h'} ? Compression::kBzip2 : Compression::kNone;
}

std::int64_t MaxRatio(Compression compression) {
  constexpr std::int64_t kMaxBzip2Ratio = std::int64_t{900000} / 5 * 259 / 32;
  return compression == Compression::kNone ? 1 : compression == Compression::kBzip2 ? kMaxBzip2Ratio : kMaxDeflateRatio;
}

std::unique_ptr<Decompressor> Decompressor::Make(Compression compression, std::ifstream& file, std::int64_t offset) {
  if (compression == Compression::kBzip2) return std::make_unique<StreamDecompressor<Bzip2>>(file, offset);
  if (compression == Compression::kBareDeflate) return std::make_unique<StreamDecompressor<Deflate<true>>>(file, offset);
  return std::make_unique<StreamDecompressor<Deflate<false>>>(file, offset);
}

}  // namespace slabstream
