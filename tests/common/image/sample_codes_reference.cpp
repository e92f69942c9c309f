#include "tests/common/image/sample_codes_reference.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace slabstream::testing {
namespace {

template <class Code>
Code CodeOf(float sample) {
  constexpr float kMax = std::numeric_limits<Code>::max();
  return Code(std::lround(kMax * std::clamp(sample, 0.0F, 1.0F)));
}

template <class Code>
void StraightCodesOf(const float* premultiplied, std::size_t pixels, Code* codes, const Premultiplied& behind) {
  for (std::size_t i = 0; i < 4 * pixels; i += 4) {
    const auto over = [&](std::size_t c) {
      const float shows_through = (1 - premultiplied[i + 3]) * behind[c];
      return premultiplied[i + c] + shows_through;
    };
    const float alpha = over(3);
    codes[i + 3] = CodeOf<Code>(alpha);
    for (std::size_t c = 0; c < 3; ++c) codes[i + c] = codes[i + 3] > 0 ? CodeOf<Code>(over(c) / alpha) : Code(0);
  }
}

}  // namespace

void SampleCodesReference(const float* samples, std::size_t count, std::uint8_t* codes) {
  for (std::size_t i = 0; i < count; ++i) codes[i] = CodeOf<std::uint8_t>(samples[i]);
}

void StraightCodesReference(const float* premultiplied, std::size_t pixels, std::uint8_t* codes, const Premultiplied& behind) {
  StraightCodesOf(premultiplied, pixels, codes, behind);
}
void StraightCodesReference(const float* premultiplied, std::size_t pixels, std::uint16_t* codes, const Premultiplied& behind) {
  StraightCodesOf(premultiplied, pixels, codes, behind);
}

}  // namespace slabstream::testing
