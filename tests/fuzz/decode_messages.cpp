// Messages: what arrives as the first frame on a socket of the service.
#include "tests/common/wire/decode_any_input.h"
#include "tests/common/wire/samples.h"
#include "tests/fuzz/decoders.h"
#include "tests/fuzz/recorded_traffic.h"

namespace slabstream {

bool DecodeMessage(std::span<const std::byte> input) { return DecodeAnyInput(input); }

std::vector<FuzzBytes> MessageSeeds() {
  std::vector<FuzzBytes> seeds = RecordedHeaders();
  for (const AnyMessage& sample : AllSamples()) seeds.push_back(Encode(sample));
  return seeds;
}

}  // namespace slabstream
