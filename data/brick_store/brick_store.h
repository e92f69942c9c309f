// Brick stores: volumes that are one compressed stream (data/positional/slice_stream.h), as something that can be read in parts. The stream
// is read once, and what it holds is written as an OME-Zarr with levels into a folder of such stores (store_folder.h), under the identity
// of the data: path, options for reading, and sizes and times of the files. Later ones of the same data use it at once.
//
// Whoever comes while another process writes the same store waits for it. What a process that was killed has written stays, and the next
// one goes on there, although it must read the stream from its beginning.
//
// Any thread.
#pragma once

#include <cstdint>
#include <memory>
#include <stop_token>
#include <string>

#include "common/base/status.h"
#include "common/files/store_folder.h"
#include "data/sources/read_context.h"
#include "data/sources/volume_source.h"

namespace slabstream {

struct StoredStream {
  // The voxels, type, axes and description of the stream. It has the levels of the store only if the finest one has more than kExactBytes:
  // so memory, which decides whether smaller ones are stored, never decides what there is to see. The store is in use as long as this is
  // there.
  std::shared_ptr<VolumeSource> source;
  std::string path;  // the path of the OME-Zarr
};

struct BrickStoreOptions {
  std::uint64_t memory = std::uint64_t{512} << 20;  // bytes that writing takes at most
  std::stop_token stop = {};
};

// `source`: the text of a source (ParseSourceText) that is such a stream. `progress`, if any, counts what is read of the stream.
// Unavailable: the store cannot be written, as where there is no room; in one line that names the place, the bytes that are needed and
// those that are available; or the file changes meanwhile. ResourceExhausted: `memory` is too small. Cancelled. Errors of OpenSource;
// InvalidArgument: it is no stream. Of a failure nothing stays; of what was stopped, all that was written.
Result<StoredStream> OpenStored(const std::string& source, const StoreFolder& stores, const SourceContext& context,
                                const BrickStoreOptions& options, ReadProgress* progress = nullptr);

}  // namespace slabstream
