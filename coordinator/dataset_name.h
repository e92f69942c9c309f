// Names of datasets in the catalogue.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <string>

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

}  // namespace slabstream
