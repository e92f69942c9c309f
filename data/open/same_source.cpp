#include "data/open/same_source.h"

#include "data/open/open_source.h"
#include "data/volume_io/read_options.h"

namespace slabstream {

Result<std::shared_ptr<VolumeSource>> OpenSameSource(const StoredAt& stored, const SourceContext& context) {
  Result<SourceText> text = ParseSourceText(stored.source);
  if (!text.ok()) return text.status();
  text->options.describe = true;
  Result<std::shared_ptr<VolumeSource>> source = OpenSource(text->path, text->options, context);
  if (!source.ok()) return source;
  const SourceInfo& info = (*source)->info();
  const bool same = info.version == stored.version && std::size_t(stored.level) < info.levels.size() &&
                    info.levels[std::size_t(stored.level)].block == stored.block.end;
  return same ? source : Status::Unavailable(text->path + ": another one than the coordinator's");
}

}  // namespace slabstream
