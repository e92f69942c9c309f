// A target under libFuzzer: fuzz --target=NAME [libFuzzer's flags] [FOLDER...]. libFuzzer leaves flags with two dashes alone.
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string_view>

#include "common/base/log.h"
#include "tests/fuzz/fuzz_target.h"

namespace {

const slabstream::FuzzTarget* chosen = nullptr;

}  // namespace

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  constexpr std::string_view kFlag = "--target=";
  for (int i = 1; i < *argc; ++i) {
    const std::string_view argument = (*argv)[i];
    if (argument.starts_with(kFlag)) chosen = slabstream::FindFuzzTarget(argument.substr(kFlag.size()));
  }
  if (chosen != nullptr) {
    slabstream::InitLog("fuzz", slabstream::LogLevel::kOff);  // readers warn about much that is odd
    return 0;
  }
  (void)std::fprintf(stderr, "fuzz: needs --target=NAME, where NAME is one of:\n");
  for (const slabstream::FuzzTarget& target : slabstream::FuzzTargets())
    (void)std::fprintf(stderr, "  %.*s\n", int(target.name.size()), target.name.data());
  std::exit(2);
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  (void)chosen->run(std::as_bytes(std::span(data, size)));
  return 0;
}
