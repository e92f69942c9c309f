#include "data/volume_io/decompressor.h"

#include <algorithm>
#include <array>
#include <optional>
#include <vector>

#include "data/codecs/bunzipper.h"
#include "data/codecs/inflater.h"

namespace slabstream {
namespace {

// gzip or zlib, whichever the first byte says. Only gzip has further members.
class Deflate {
 public:
  StreamState Advance(std::span<const std::byte>& in, std::span<std::byte>& out) {
    if (in.empty() && !inflater_) return StreamState::kGoesOn;
    if (!inflater_) inflater_.emplace(char(in[0]) == kMagic ? DeflateFrame::kGzip : DeflateFrame::kZlib);
    return inflater_->Advance(in, out);
  }
  bool BeginMember(std::byte first) {
    if (inflater_->frame() != DeflateFrame::kGzip || char(first) != kMagic) return false;
    inflater_->Begin();
    return true;
  }

 private:
  static constexpr char kMagic = '\x1f';
  std::optional<Inflater> inflater_;
};

class BareDeflate : public Inflater {
 public:
  BareDeflate() : Inflater(DeflateFrame::kBare) {}
  bool BeginMember(std::byte) { return false; }
};

class Bzip2 : public Bunzipper {
 public:
  bool BeginMember(std::byte first) {
    if (char(first) != 'B') return false;
    Begin();
    return true;
  }
};

// A codec advances over bytes in and bytes out, and begins a further member where its first byte is one.
template <class Codec>
class StreamDecompressor : public Decompressor {
 public:
  StreamDecompressor(std::ifstream& file, std::int64_t offset) : file_(file), input_(std::size_t{1} << 16) { file_.seekg(offset); }

  std::size_t Read(std::span<std::byte> out) override {
    const std::size_t wanted = out.size();
    while (!out.empty() && state_ != StreamState::kDamaged && !drained_) {
      const bool more = !left_.empty() || Refill();
      // What follows the end of a member is another one, or padding, which is ignored.
      if (state_ == StreamState::kEnded && !(more && codec_.BeginMember(left_[0]))) break;
      state_ = codec_.Advance(left_, out);
      drained_ = !more && !out.empty();
    }
    return wanted - out.size();
  }

  bool damaged() const override { return state_ == StreamState::kDamaged; }

  bool EndsWell() override {
    std::vector<std::byte> rest(input_.size());
    while (state_ != StreamState::kEnded && Read(rest) == rest.size()) {
    }
    return state_ == StreamState::kEnded;
  }

 private:
  bool Refill() {
    file_.read(reinterpret_cast<char*>(input_.data()), std::streamsize(input_.size()));
    left_ = std::span(input_).first(std::size_t(file_.gcount()));
    return !left_.empty();
  }

  std::ifstream& file_;
  std::vector<std::byte> input_;
  std::span<const std::byte> left_;  // of input_
  Codec codec_;
  StreamState state_ = StreamState::kGoesOn;
  bool drained_ = false;  // without further bytes the codec gives no more, and is not asked again: ISA-L would write anywhere
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
  if (compression == Compression::kBareDeflate) return std::make_unique<StreamDecompressor<BareDeflate>>(file, offset);
  return std::make_unique<StreamDecompressor<Deflate>>(file, offset);
}

}  // namespace slabstream
