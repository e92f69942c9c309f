// A level of a source in pieces that are read one after the other, so that it is never in memory as a whole.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "common/base/status.h"
#include "data/sources/volume_source.h"

namespace slabstream {

inline constexpr std::int64_t kPieceBytes = std::int64_t{16} << 20;  // bytes of most pieces; no piece has more than twice as many

// They tile the level, and begin at multiples of kBrick. Each holds whole blocks of the source, as far as that fits into 2 * kPieceBytes.
std::vector<Box> PiecesOf(const SourceLevel& level);

// Calls take(block) for each box in turn, on this thread, while the next `ahead` ones are being read. Errors of VolumeSource::Read;
// Cancelled: `stop` was told to stop.
Status ReadPieces(VolumeSource& source, int level, const std::vector<Box>& boxes, std::size_t ahead,
                  const std::function<void(const VoxelBlock&)>& take, const std::stop_token& stop = {});

}  // namespace slabstream
