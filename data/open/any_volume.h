// Volumes of any format, whether it is read as a whole (data/volume_io) or in parts (data/sources). Where both know a path, the first one
// reads it as a whole, and the second one in parts.
//
// Any thread.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "data/sources/source_format.h"
#include "data/volume_io/volume_reader.h"

namespace slabstream {

// The context of this process, made at its first use. It takes SourceBytes of the memory that was said before, or else of what the
// machine has for the process (common/volume/memory_budget.h).
const SourceContext& ProcessReadContext();
void SetReadMemory(std::uint64_t process_bytes);

// Of the finest level of a source. Its steps are those of the voxels, since a source does not tell how its files store them.
VolumeFileInfo FileInfoOf(const SourceInfo& source);

// Logs a line for each choice among times and channels that the options leave open (data/volume_io/file_parts.h).
void WarnOfPart(const std::string& path, const ReadOptions& options, const VolumeFileInfo& info);

// The same lines, by the headers alone. Errors of CheckAnyVolumeHeaders.
Result<std::vector<std::string>> TextsOfPart(const std::string& path, const ReadOptions& options);

// For whoever shows the volume: logs a line if its values are rounded, and keeps exact samples only of rounded whole numbers.
void PrepareToShow(const std::string& path, LoadedVolume& loaded);

// ReadVolume and WarnOfPart, or ReadFinest.
Result<LoadedVolume> ReadAnyVolume(const std::string& path, const ReadOptions& options = {});
// The finest level of a source that is open; and WarnOfPart. `exact` is there only if whole numbers are rounded.
Result<LoadedVolume> ReadFinest(VolumeSource& source, const std::string& path, const ReadOptions& options);
// CheckVolumeHeaders, or the files of a source, which it opens, or of a compressed stream, which may be larger than the memory.
Result<std::vector<std::string>> CheckAnyVolumeHeaders(const std::string& path, const ReadOptions& options = {});
// Whether ReadVolume knows the path; else only a source can be it.
bool IsReadWhole(const std::string& path, const ReadOptions& options);
// CheckVolume, or whether a format of sources knows the path.
Status CheckAnyVolume(const std::string& path, const ReadOptions& options = {});
bool LooksLikeAnyVolume(const std::string& path);

}  // namespace slabstream
