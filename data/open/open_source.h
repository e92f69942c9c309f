// OpenSource: opens a volume as a source, whatever its format. VolumeFormats() is the list of all formats: those of files
// (data/volume_io/formats.h), and those of chunks, which have a folder each (docs/adding.md).
//
// Any thread.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "common/volume/stored_at.h"
#include "data/sources/read_context.h"
#include "data/sources/volume_source.h"
#include "data/volume_io/read_options.h"

namespace slabstream {

struct VolumeFormat;

const std::vector<VolumeFormat>& VolumeFormats();

// By the ending of a file, else by what is there. Null: no format knows the path, or it is an address, of which nobody knows before it is
// asked.
const VolumeFormat* FindFormat(const std::string& path, const ReadOptions& options = {});

// Whether OpenSource would try this path: it exists, a format knows it and takes the options; or it is an address. NotFound: no such file.
// InvalidArgument: not a volume, or an option that its format does not take or lacks. Messages name the path.
Status CheckVolume(const std::string& path, const ReadOptions& options = {});
// The same without options, as for the files of a folder.
bool LooksLikeVolume(const std::string& path);

// Reads headers and checks what can be checked without the samples: sizes, types, the lengths of files, orientation. Errors of CheckVolume
// and FindRemoteFormat; InvalidArgument: more than three dimensions, several components, a side above kMaxVolumeSide; DataLoss: truncated;
// ResourceExhausted: it does not fit the memory, and cannot be read in parts; Unavailable: its files change meanwhile (OpenUnchanged, which
// also says what becomes of a source whose files change later). `beside`, if any: what is open there, by options that differ in time and
// channel at most. Where it can, it gives those without reading anything (VolumeSource::At).
Result<std::shared_ptr<VolumeSource>> OpenSource(const std::string& path, const ReadOptions& options, const SourceContext& context,
                                                 VolumeSource* beside = nullptr);

// The source of a dataset, opened once more: by another process, or for another purpose. Unavailable: it is another one than the
// coordinator's. Errors of ParseSourceText and OpenSource. Waits.
Result<std::shared_ptr<VolumeSource>> OpenSameSource(const StoredAt& stored, const SourceContext& context);
// The same without reading anything: what `beside` gives, which was opened as `text` says. Null: it gives none.
std::shared_ptr<VolumeSource> SameSourceBeside(VolumeSource& beside, const std::string& text, const StoredAt& stored);

// The context of this process, made at its first use. It takes SourceBytes of the memory that was said before, or else of what the
// machine has for the process (common/volume/memory_budget.h).
const SourceContext& ProcessReadContext();
void SetReadMemory(std::uint64_t process_bytes);

}  // namespace slabstream
