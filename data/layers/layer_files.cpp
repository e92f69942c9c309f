#include "data/layers/layer_files.h"

#include <filesystem>
#include <system_error>

#include "common/base/status.h"
#include "data/volume_io/read_options.h"

namespace slabstream {

void SetLabelFiles(const std::string& text, LayerFiles& files) {
  const std::size_t colon = text.rfind(':');
  const auto exists = [](const std::string& volume) {
    const Result<SourceText> source = ParseSourceText(volume);
    std::error_code error;
    return source.ok() && std::filesystem::exists(source->path, error);
  };
  files.labels = text;
  files.label_colors.clear();
  if (colon == std::string::npos || colon + 1 == text.size() || exists(text) || !exists(text.substr(0, colon))) return;
  files.labels = text.substr(0, colon);
  files.label_colors = text.substr(colon + 1);
}

std::string LabelText(const LayerFiles& files) {
  return files.label_colors.empty() ? files.labels : files.labels + ":" + files.label_colors;
}

}  // namespace slabstream
