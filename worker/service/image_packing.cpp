#include "worker/service/image_packing.h"

#include <algorithm>
#include <array>
#include <utility>

#include "common/base/check.h"
#include "common/base/time.h"
#include "common/wire/payload.h"

namespace slabstream {
namespace {

// No picture is packed and unpacked faster, not even one of a single colour.
constexpr CodecSpeed kFastest = {2e9, 0};
constexpr std::size_t kSampleBytes = std::size_t{64} << 10;  // a fraction of a millisecond

// Packs and unpacks a part from the middle of `payload`, the runs of some image.
CodecSpeed SampleCodec(std::span<const std::byte> payload) {
  constexpr std::size_t kWord = 4;  // the codec packs words
  const std::size_t bytes = std::min(kSampleBytes, payload.size()) / kWord * kWord;
  if (bytes == 0) return {};
  const std::span<const std::byte> sample = payload.subspan((payload.size() - bytes) / 2 / kWord * kWord, bytes);
  const Time begin = MonotonicNow();
  PackedRuns packed;
  const std::optional<Bytes> small = PackRuns(sample, packed);
  if (!small) return {};
  CHECK(UnpackRuns(packed, *small, bytes).ok());
  const double seconds = std::max(std::chrono::duration<double>(MonotonicNow() - begin).count(), 1e-9);
  return {double(bytes) / seconds, double(small->size()) / double(bytes)};
}

}  // namespace

std::optional<LinkCompression> ParseCompression(std::string_view text) {
  constexpr std::array<std::pair<std::string_view, LinkCompression>, 3> kNames = {
      {{"auto", LinkCompression::kAuto}, {"on", LinkCompression::kOn}, {"off", LinkCompression::kOff}}};
  const auto found = std::ranges::find(kNames, text, &std::pair<std::string_view, LinkCompression>::first);
  return found == kNames.end() ? std::nullopt : std::optional(found->second);
}

bool PackingPays(double link_bytes_per_second, const CodecSpeed& codec) {
  // 1 / link > 1 / codec + ratio / link, without the quotients that may be infinite
  return codec.bytes_per_second * (1 - codec.ratio) > link_bytes_per_second;
}

bool MayPack(double link_bytes_per_second) { return PackingPays(link_bytes_per_second, kFastest); }

Bytes PackForLink(Bytes payload, double link_bytes_per_second, Rare<PackedRuns>& packed) {
  packed.reset();
  if (payload.empty() || !MayPack(link_bytes_per_second)) return payload;
  if (!PackingPays(link_bytes_per_second, SampleCodec(payload.span()))) return payload;
  PackedRuns how;
  std::optional<Bytes> small = PackRuns(payload.span(), how);
  if (!small) return payload;
  packed = how;
  return *std::move(small);
}

}  // namespace slabstream
