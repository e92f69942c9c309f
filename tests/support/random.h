// Random: the source of randomness in tests. Its seed is printed with every failure and can be given back: SLABSTREAM_SEED=123 ctest ...
//
//   Random random(7);
//   SCOPED_TRACE(random.trace());
#pragma once

#include <cstdint>
#include <cstdlib>
#include <random>
#include <string>

namespace slabstream {

class Random {
 public:
  explicit Random(std::uint64_t seed) : seed_(SeedFromEnvironment(seed)), engine_(seed_) {}

  std::string trace() const { return "SLABSTREAM_SEED=" + std::to_string(seed_); }

  // Uniform in [low, high].
  template <class T = int>
  T Integer(T low, T high) {
    return std::uniform_int_distribution<T>(low, high)(engine_);
  }
  // Uniform in [low, high).
  double Real(double low, double high) { return std::uniform_real_distribution<double>(low, high)(engine_); }
  bool Chance(double probability) { return Real(0, 1) < probability; }

 private:
  static std::uint64_t SeedFromEnvironment(std::uint64_t seed) {
    const char* text = std::getenv("SLABSTREAM_SEED");
    return text == nullptr ? seed : std::strtoull(text, nullptr, 10);
  }

  std::uint64_t seed_;
  std::mt19937_64 engine_;
};

}  // namespace slabstream
