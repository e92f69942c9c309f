#include "data/hdf5/hdf5_rows.h"

#include <fmt/format.h>

#include <utility>

namespace slabstream {

Result<std::shared_ptr<ChunkedArray>> OpenRows(const std::shared_ptr<Hdf5File>& file, const std::string& dataset, std::uint64_t columns,
                                               const SourceContext& context) {
  Result<std::shared_ptr<Hdf5Dataset>> found = file->Dataset(dataset);
  if (!found.ok()) return found.status();
  const std::vector<std::uint64_t>& size = (*found)->size();
  if (size.size() > 2 || (size.size() == 2 ? size[1] : 1) != columns) {
    return Status::InvalidArgument(
        fmt::format("{} is of {}, must have {} numbers a row", file->Named(dataset), fmt::join(size, " x "), columns));
  }
  return MakeHdf5Array(*std::move(found), context);
}

Result<ArrayBox> RowsOf(const ArrayShape& shape, const std::string& named, std::int64_t begin, std::int64_t count) {
  const auto rows = std::int64_t(shape.size.front());
  if (begin < 0 || count < 0 || begin > rows || count > rows - begin) {
    return Status::DataLoss(fmt::format("{} has {} rows, but {} from row {} on are needed", named, rows, count, begin));
  }
  ArrayBox box{{std::uint64_t(begin)}, {std::uint64_t(count)}};
  if (shape.size.size() == 2) {
    box.begin.push_back(0);
    box.count.push_back(shape.size.back());
  }
  return box;
}

}  // namespace slabstream
