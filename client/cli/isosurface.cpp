// `isosurface`: the isosurface of a volume, or the surface of a label, as a mesh in a file.
#include <fmt/format.h>

#include <algorithm>
#include <iostream>
#include <memory>
#include <span>

#include "client/cli/commands.h"
#include "client/cli/input_volume.h"
#include "client/cli/progress.h"
#include "data/isosurface/make_isosurface.h"
#include "data/isosurface/mesh_file.h"
#include "data/open/open_source.h"
#include "data/sources/read_context.h"
#include "data/stores/object_cache.h"

namespace slabstream {

Status RunIsosurface(const IsosurfaceCommandOptions& options) {
  if (Status kept = KeepObjects(options.cache); !kept.ok()) return kept;
  if (options.isovalue.has_value() == options.label.has_value()) return Status::InvalidArgument("give one of --isovalue and --label");
  if (FindMeshFormat(options.output) == nullptr)
    return Status::InvalidArgument(fmt::format("--output '{}' must end in one of {}", options.output, MeshEndings()));
  if (Status status = CheckCanWrite("--output", options.output); !status.ok()) return status;
  Result<SourceText> source = ParseSourceText(options.source);
  if (!source.ok()) return source.status();
  source->options.describe = true;
  if (options.label) source->options.labels = true;
  if (Status status = CheckInputVolume(*source); !status.ok()) return status;
  const Result<std::shared_ptr<VolumeSource>> opened =
      OpenSource(source->path, source->options, std::make_shared<ReadContext>(ReadContext::Limits()));
  if (!opened.ok()) return opened.status();
  const SourceInfo& info = (*opened)->info();
  WarnOfPart(source->path, source->options, info);
  if (options.isovalue && info.labels) {
    return Status::InvalidArgument(fmt::format("--isovalue: '{}' has labels, which are no values: --label N", options.source));
  }
  if (Status status = CheckLevel(options.level, info, source->path); !status.ok()) return status;

  ProgressBar bar(options.progress, 1);
  ByteProgress shown(bar, "reading " + source->path);
  const auto progress = [&](std::uint64_t done, std::uint64_t all) {
    shown.Show(done, all);
    return !shown.stop().stop_requested();
  };
  const Result<MeshCounts> made = MakeIsosurface(**opened,
                                                 {.level = options.level,
                                                  .isovalue = options.isovalue.value_or(0),
                                                  .label = options.label,
                                                  .caps = options.caps,
                                                  .share = options.share,
                                                  .progress = progress},
                                                 options.output);
  if (made.status().code() == StatusCode::kCancelled) return Status::Cancelled(fmt::format("stopped: '{}' is not written", options.output));
  if (!made.ok()) return made.status();
  bar.Clear();
  if (made->whole) {
    std::cout << fmt::format("wrote {}: {} vertices, {} triangles\n", options.output, made->vertices, made->triangles);
  } else if (made->missing_parts.empty()) {
    std::cout << fmt::format("made part {} of {}; another process has joined the parts\n", options.share.part, options.share.parts);
  } else {
    const auto& missing = made->missing_parts;
    const auto first = std::span(missing).first(std::min<std::size_t>(missing.size(), 8));
    std::cout << fmt::format("made part {} of {}; {} missing: {}{}\n", options.share.part, options.share.parts, missing.size(),
                             fmt::join(first, ", "), missing.size() > first.size() ? ", ..." : "");
  }
  return Status::Ok();
}

}  // namespace slabstream
