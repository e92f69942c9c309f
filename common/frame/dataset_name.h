// Names of datasets. A file of several volumes is several datasets: "fmri@0", "fmri@1", ... are the times of "fmri". Users choose names
// of letters, digits, '.', '_' and '-', so no other name has an '@'. Pure.
#pragma once

#include <fmt/format.h>

#include <string>
#include <string_view>

namespace slabstream {

inline std::string NameAtTime(std::string_view name, int time) { return fmt::format("{}@{}", name, time); }

// "fmri" of "fmri@3"; other names as they are.
inline std::string_view NameWithoutTime(std::string_view name) { return name.substr(0, name.find('@')); }

}  // namespace slabstream
