// Samples that are packed in blocks, or written in base64, as a source: chunks of whole rows or slices, each of which is one range of the
// file.
#pragma once

#include <memory>
#include <string>

#include "common/base/status.h"
#include "data/positional/located_volume.h"
#include "data/sources/read_context.h"
#include "data/sources/volume_source.h"

namespace slabstream {

// `volume`: with packed samples, of the file at `path`. Errors of MakeChunkedSource. Reads of boxes: DataLoss, naming file, samples and
// block.
Result<std::shared_ptr<VolumeSource>> OpenPacked(const std::string& path, LocatedVolume volume, const SourceContext& context);

}  // namespace slabstream
