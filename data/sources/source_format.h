// SourceFormat: by what a format of sources is recognised, and how it is opened. The formats have a folder each; SourceFormats()
// (data/open/open_source.h) is the only list (docs/adding.md).
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/status.h"
#include "data/sources/read_context.h"
#include "data/sources/volume_source.h"
#include "data/volume_io/read_options.h"

namespace slabstream {

using SourceContext = std::shared_ptr<ReadContext>;

struct SourceFormat {
  std::string_view name;  // "OME-Zarr"
  // Whether this path is of the format: by its ending, by what a folder holds, or by a file's first bytes. Looks at little.
  bool (*recognises)(const std::string& path, const ReadOptions& options) = nullptr;
  std::vector<std::string_view> options = {};  // names of the options (ReadOptionList) that it takes
  std::vector<std::string_view> markers =
      {};  // objects, at least one of which each volume of the format has; none: it is no store of objects
  // NotFound, Unavailable: it cannot be read. InvalidArgument: it is no such volume, or needs something that is not supported, which the
  // message names; an option that does not suit it. DataLoss: damaged metadata. ResourceExhausted.
  Result<std::shared_ptr<VolumeSource>> (*open)(const std::string& path, const ReadOptions& options,
                                                const SourceContext& context) = nullptr;
};

}  // namespace slabstream
