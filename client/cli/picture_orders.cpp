#include "client/cli/picture_orders.h"

#include <fmt/format.h>

#include <map>
#include <string_view>

#include "common/frame/dataset_name.h"
#include "data/open/source_name.h"
#include "data/volume_io/read_options.h"

namespace slabstream {
namespace {

// Of a file: its name, and its time.
std::string NameOf(const std::string& source) {
  const Result<SourceText> parsed = ParseSourceText(source);
  const std::string name = NameOfSource(source);
  return parsed.ok() && parsed->options.time ? NameAtTime(name, parsed->options.time->first) : name;
}

std::string WithName(std::string path, const std::string& name) {
  for (std::size_t at = path.find(kNamePlace); at != std::string::npos; at = path.find(kNamePlace, at + name.size())) {
    path.replace(at, std::string_view(kNamePlace).size(), name);
  }
  return path;
}

// Each source needs files of its own.
Status CheckPlace(const char* option, const std::string& path, std::size_t sources) {
  if (sources == 1 || path.empty() || path.find(kNamePlace) != std::string::npos) return Status::Ok();
  return Status::InvalidArgument(fmt::format("{} '{}' has no place for {}, which {} SOURCEs need", option, path, kNamePlace, sources));
}

}  // namespace

Result<std::vector<PictureOrder>> PictureOrders(const RenderOptions& options) {
  const FrameOptions& all = options.frame;
  const std::pair<const char*, const std::string&> paths[] = {
      {"--output", options.output}, {"--stats", all.stats_path}, {"--trace", all.trace_path}, {"--save-camera", all.camera_path}};
  for (const auto& [option, path] : paths) {
    if (Status status = CheckPlace(option, path, options.sources.size()); !status.ok()) return status;
  }
  std::vector<PictureOrder> orders;
  std::map<std::string, std::string> named;
  for (const SourceChoice& source : options.sources) {
    const std::string name = all.connection.local_workers > 0 ? NameOf(source.source) : source.source;
    if (const auto [other, is_new] = named.emplace(name, source.source); !is_new) {
      return Status::InvalidArgument(fmt::format("SOURCE '{}' and SOURCE '{}' have the same name, {}, so their pictures would be one file",
                                                 other->second, source.source, name));
    }
    PictureOrder& order = orders.emplace_back(PictureOrder{all, WithName(options.output, name)});
    order.frame.source = source.source;
    order.frame.request.transfer = source.transfer;
    for (std::string* path : {&order.frame.stats_path, &order.frame.trace_path, &order.frame.camera_path}) *path = WithName(*path, name);
  }
  return orders;
}

}  // namespace slabstream
