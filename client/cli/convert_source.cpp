#include "client/cli/convert_parts.h"

#include <fmt/format.h>

#include <utility>

#include "client/cli/input_volume.h"
#include "data/open/open_source.h"
#include "data/sources/part_source.h"

namespace slabstream {

Result<SourceToConvert> OpenToConvert(const ConvertOptions& options, const SourceText& source, const ReadContext::Limits& limits) {
  Result<std::shared_ptr<VolumeSource>> opened = OpenSource(source.path, source.options, std::make_shared<ReadContext>(limits));
  if (!opened.ok()) return opened.status();
  const SourceInfo& info = (*opened)->info();
  if (info.finest().geometry.rectilinear()) {
    return Status::InvalidArgument(
        fmt::format("'{}' has a rectilinear grid, which is written on even voxels: --resample even", source.path));
  }
  const std::size_t held = info.whole ? CountIn(info.finest().geometry.size) * BytesPerSample(info.exact.type) : 0;
  if (!options.converts_part()) return SourceToConvert{*std::move(opened), held};
  if (Status status = CheckLevel(options.level, info, source.path); !status.ok()) return status;
  const Index3& size = info.levels[std::size_t(options.level)].description.geometry.size;
  Box box = options.box;
  for (const Axis axis : {Axis::kX, Axis::kY, Axis::kZ}) {
    if (box.end[axis] == 0) box.end[axis] = size[axis];
    if (box.begin[axis] < box.end[axis] && box.end[axis] <= size[axis]) continue;
    return Status::InvalidArgument(fmt::format("--box: {} from {} to {}, but level {} of '{}' has {} voxels there", Letter(axis),
                                               box.begin[axis], box.end[axis], options.level, source.path, size[axis]));
  }
  return SourceToConvert{MakePartSource(*std::move(opened), options.level, box), held};
}

}  // namespace slabstream
