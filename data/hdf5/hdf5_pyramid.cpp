#include <algorithm>
#include <array>
#include <set>
#include <string_view>

#include "data/hdf5/hdf5_format.h"
#include "data/hdf5/hdf5_layouts.h"

namespace slabstream {

int CountNumbered(const std::vector<std::string>& names, const std::string& prefix) {
  const std::set<std::string_view> known(names.begin(), names.end());
  int count = 0;
  while (known.contains(prefix + std::to_string(count))) ++count;
  return count;
}

Result<Pyramid> ReadHdf5(const std::string& path, const ReadOptions& options, const SourceContext& context) {
  const Result<std::shared_ptr<Hdf5File>> file = Hdf5File::Open(path);
  if (!file.ok()) return file.status();
  if (!options.dataset.empty()) return AnyHdf5().read(*file, options, context);
  const std::array layouts = {Imaris(), BigDataViewerHdf5(), AnyHdf5()};
  const auto layout = std::ranges::find_if(layouts, [&](const Hdf5Layout& each) { return each.recognises(**file); });
  return layout->read(*file, options, context);
}

}  // namespace slabstream
