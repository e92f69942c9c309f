// Names of datasets. Users choose names of letters, digits, '.', '_' and '-'. A file of several volumes is several datasets: "fmri@0",
// "fmri@1", ... are the times of "fmri". No other name has an '@'. Pure.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <string>
#include <string_view>

#include "common/base/status.h"
#include "common/frame/frame_request.h"

namespace slabstream {

// InvalidArgument: it is empty, too long (kMaxNameBytes) or has other characters than letters, digits and "._-".
inline Status CheckDatasetName(const std::string& name) {
  const auto allowed = [](char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '.' || c == '_' || c == '-'; };
  if (!name.empty() && name.size() <= kMaxNameBytes && std::ranges::all_of(name, allowed)) return Status::Ok();
  constexpr std::size_t kMostShown = 512;
  return Status::InvalidArgument(fmt::format("dataset name \"{}\" must have 1 to {} letters, digits, '.', '_' or '-'",
                                             name.size() <= kMostShown ? name : name.substr(0, kMostShown) + "...", kMaxNameBytes));
}

inline std::string NameAtTime(std::string_view name, int time) { return fmt::format("{}@{}", name, time); }

// "fmri" of "fmri@3"; other names as they are.
inline std::string_view NameWithoutTime(std::string_view name) { return name.substr(0, name.find('@')); }

}  // namespace slabstream
