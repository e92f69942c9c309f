// Volumes at addresses (common/base/url.h).
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "common/base/status.h"
#include "data/open/unchanged_source.h"
#include "data/sources/source_format.h"

namespace slabstream {

struct RemoteFormat {
  const SourceFormat* format = nullptr;  // of those that were given
  std::uint64_t version = 0;             // of the markers that are there
};

// The first of the formats of which a marker lies at this address. NotFound: there is no marker. InvalidArgument: another kind of address.
// Unavailable: no answer. Waits.
Result<RemoteFormat> FindRemoteFormat(const std::string& url, std::span<const SourceFormat> formats);

// The source that `open` gives, without files and of this version. Errors of `open`.
Result<std::shared_ptr<VolumeSource>> OpenRemote(std::uint64_t version, const OpenFunction& open);

}  // namespace slabstream
