// A source whose files must stay as they were when it was opened: what is read from other ones is an error, never a wrong volume.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "data/sources/volume_source.h"

namespace slabstream {

using OpenFunction = std::function<Result<std::shared_ptr<VolumeSource>>()>;

// The source that `open` gives, with SourceInfo::version. Its reads look at SourceInfo::files when they have ended, and fail if one has
// changed since (FileStamp): Unavailable, naming `path`. Errors of `open` and StampFiles; Unavailable: the files change while it is opened.
Result<std::shared_ptr<VolumeSource>> OpenUnchanged(const std::string& path, const OpenFunction& open);

// A digest of sizes and times of files: the same on every host that sees the same files. NotFound, Unavailable: one
// cannot be looked at.
Result<std::uint64_t> VersionOf(const std::vector<std::string>& files);

}  // namespace slabstream
