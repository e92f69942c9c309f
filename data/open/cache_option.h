// --cache: what web servers send is kept on disk (data/stores/object_cache.h). All programs that read volumes have it.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/cli/add_option.h"
#include "common/volume/memory_budget.h"

namespace slabstream {

// `bytes`: the budget. 0 if the option is not there.
inline Option AddCacheOption(const Command& app, std::uint64_t& bytes) {
  return AddParsed(app, "--cache", bytes, ParseMemoryLimit,
                   "Keep on disk what web servers send of volumes, in at most so many bytes: 10G or 512M. The processes of a user share it")
      .TypeName("SIZE")
      .Default("none");
}

// The same for a program that this one starts.
inline void AddCacheArgument(std::vector<std::string>& arguments, std::uint64_t bytes) {
  if (bytes != 0) arguments.insert(arguments.end(), {"--cache", std::to_string(bytes >> 20) + "MiB"});
}

}  // namespace slabstream
