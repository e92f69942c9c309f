// Volumes at addresses (common/text/url.h).
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string_view>

#include "common/base/status.h"
#include "data/open/unchanged_source.h"
#include "data/volume_io/formats.h"

namespace slabstream {

class Store;

struct RemoteFormat {
  const VolumeFormat* format = nullptr;  // of those that were given
  std::uint64_t version = 0;             // the version of the markers that are there
};

// The first of the formats of which a marker, a JSON object, lies in this store. NotFound: there is no marker. Unavailable: no answer, or
// none that tells. Waits.
Result<RemoteFormat> FindRemoteFormat(Store& store, std::span<const VolumeFormat> formats);

// The source that `open` gives, without files, of a version that this one and the number of its times tell, and with a note of the address'
// own query, if it has one. Errors of `open`.
Result<std::shared_ptr<VolumeSource>> OpenRemote(std::uint64_t version, std::string_view query, const OpenFunction& open);

}  // namespace slabstream
