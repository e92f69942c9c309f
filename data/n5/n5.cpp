#include "data/n5/n5.h"

#include <filesystem>
#include <utility>

#include "data/metadata/open_store_for.h"
#include "data/n5/n5_pyramid.h"
#include "data/sources/chunked_source.h"

namespace slabstream {
namespace n5 {
namespace {

bool Recognises(const std::string& path, const ReadOptions&) {
  std::error_code error;
  return std::filesystem::is_directory(path, error) && (std::filesystem::path(path).extension() == ".n5" ||
                                                        std::filesystem::is_regular_file(std::filesystem::path(path) / kAttributes, error));
}

Result<std::shared_ptr<VolumeSource>> Open(const std::string& path, const ReadOptions& options, const SourceContext& context) {
  const Result<std::shared_ptr<Store>> store = OpenStoreFor(path, options);
  if (!store.ok()) return store.status();
  Result<Pyramid> pyramid = OpenPyramid(*store, options, context);
  if (!pyramid.ok()) return pyramid.status();
  return MakeChunkedSource(path, *std::move(pyramid), context);
}

}  // namespace
}  // namespace n5

SourceFormat N5() {
  return {.name = "N5",
          .recognises = n5::Recognises,
          .options = {"time", "channel", "array", "follow-links"},
          .markers = {n5::kAttributes},
          .open = n5::Open};
}

}  // namespace slabstream
