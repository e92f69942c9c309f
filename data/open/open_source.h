// OpenSource: opens a volume as a source, whatever its format. SourceFormats() is the only list of formats; a new one is a folder that
// defines its SourceFormat, and its line there (docs/adding.md).
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "data/sources/source_format.h"

namespace slabstream {

const std::vector<SourceFormat>& SourceFormats();

// Whether OpenSource may open it: a format knows the path, or it is an address, of which nobody knows before it is asked.
bool IsReadInParts(const std::string& path, const ReadOptions& options = {});

// Null: no format knows the path, or it is an address.
const SourceFormat* FindSourceFormat(const std::string& path, const ReadOptions& options = {});

// Errors of SourceFormat::open, FindRemoteFormat and OpenUnchanged, which says what becomes of a source whose files change; InvalidArgument
// also for an option that the format does not take, and NotFound if there is no such path.
Result<std::shared_ptr<VolumeSource>> OpenSource(const std::string& path, const ReadOptions& options, const SourceContext& context);

}  // namespace slabstream
