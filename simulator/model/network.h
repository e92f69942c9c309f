// Network: when messages arrive, by a link model. Wires are reserved in the order of the calls, so call in order of time.
#pragma once

#include <cstdint>
#include <vector>

#include "simulator/model/link_model.h"

namespace slabstream {

class Network {
 public:
  // Ends are numbered [0, ends).
  Network(const LinkModel& link, std::uint32_t ends);

  struct Passage {
    double begin = 0, end = 0;  // the first byte enters the first wire; the last one has arrived
  };
  Passage Send(std::uint32_t from, std::uint32_t to, double bytes, double now);

 private:
  struct Wire {
    double bytes_per_second = 0;
    double free_at = 0;
  };
  struct Path {
    std::uint32_t wires[4];
    int count = 0;
  };
  Path FindPath(std::uint32_t from, std::uint32_t to) const;

  const LinkModel link_;
  std::uint32_t ends_;
  std::vector<Wire> wires_;  // kSwitched, kFatTree: out of every end, into every end, up from every group, down to every group
};

}  // namespace slabstream
