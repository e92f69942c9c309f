#include "common/wire/digest.h"

#include <xxhash.h>
#if defined(__x86_64__) && __has_include(<xxh_x86dispatch.h>)
#define SLABSTREAM_XXH_DISPATCH
#include <immintrin.h>
#include <xxh_x86dispatch.h>  // lets XXH3_64bits choose: AVX-512 is four times as fast as plain SSE2
#endif

namespace slabstream {
namespace {

#ifdef SLABSTREAM_XXH_DISPATCH
// libxxhash 0.8.1 returns with the upper halves of vector registers in use. From then on each SSE instruction preserves them, and so waits
// for the last one that wrote its register: loops after it would take up to four times as long.
[[gnu::target("avx")]] void ClearUpperHalves() { _mm256_zeroupper(); }
#endif

}  // namespace

std::uint64_t Digest(std::span<const std::byte> bytes) {
  const std::uint64_t digest = XXH3_64bits(bytes.data(), bytes.size());
#ifdef SLABSTREAM_XXH_DISPATCH
  if (__builtin_cpu_supports("avx")) ClearUpperHalves();
#endif
  return digest;
}

}  // namespace slabstream
