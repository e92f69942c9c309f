// How much of the machine other programs use meanwhile, since they disturb what is measured.
#pragma once

#include <optional>

namespace slabstream {

// Counts from its construction on. /proc/stat counts in hundredths of a second: of shorter times than some tenths little can be said.
class OtherLoad {
 public:
  OtherLoad();
  // The share of all cores' time that other programs and the system took, in [0, 1]; nullopt if less than 0.2 s have passed, or the system
  // does not tell.
  std::optional<double> Share() const;

 private:
  struct Times {
    double total = 0, busy = 0, own = 0;  // seconds of processor time: of all cores, not idle, of this process and its ended children
  };
  static std::optional<Times> Now();
  std::optional<Times> begin_;
};

// Processor time of a fixed loop over numbers that lie in the cache: the same whenever the machine is as fast. Seconds.
double ReferenceLoopSeconds();

}  // namespace slabstream
