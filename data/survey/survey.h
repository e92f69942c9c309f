// Survey: what is known about a source before anybody draws it. Statistics are those of the whole volume, or, of a large one, of a coarse
// level or of a sample; so the first picture waits for no pass over all voxels.
//
//   level 0 takes at most `exact`   range, histogram and ranges of bricks of level 0
//   else                            range and histogram of the finest level of at most `coarse` or, if that takes more than `exact`, of a
//                                   sample of `coarse` bytes of the coarsest one, spread evenly
// This depends on the source alone, never on the memory of a process: a transfer function that is made for the range of a dataset must not
// depend on it either. Values beyond that range are drawn as the nearest one in it.
//
// Any thread. Reads in pieces; takes some tens of MiB.
#pragma once

#include <cstdint>
#include <memory>

#include "common/base/status.h"
#include "common/volume/summary.h"
#include "data/sources/volume_source.h"
#include "data/volume_io/read_progress.h"

namespace slabstream {

inline constexpr std::int64_t kExactBytes = std::int64_t{1} << 30, kSurveyBytes = std::int64_t{128} << 20;
struct SurveyBytes {
  std::int64_t exact = kExactBytes, coarse = kSurveyBytes;
  std::size_t places = 1;  // that a sample is taken from, at least, if the level has as many
};
// The survey of a source behind an address reads less: the first picture waits until the bytes have come.
inline constexpr SurveyBytes kFarSurvey = {.exact = 8 << 20, .coarse = 8 << 20};
// Of voxels that are made on demand, a sample costs as much as the block that it lies in.
inline constexpr SurveyBytes kMadeSurvey = {.exact = 8 << 20, .coarse = 8 << 20, .places = 8};
// `far`: the source is behind an address.
SurveyBytes SurveyBytesOf(const SourceInfo& info, bool far);

struct Survey {
  int level = 0;        // the level that `summary` describes
  bool sample = false;  // a sample of that level was read, not all of it
  // The summary of that level. It has no bricks if only a sample was read.
  std::shared_ptr<const VolumeSummary> summary;
};

// `progress`, if any, counts what is read, on this thread. Errors of VolumeSource::Read.
Result<Survey> SurveySource(VolumeSource& source, const SurveyBytes& most = {}, ReadProgress* progress = nullptr);

}  // namespace slabstream
