// Rows of a dataset as numbers: points, cells and offsets of grids.
//
// Any thread but one that decodes, since it waits.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "common/base/status.h"
#include "data/hdf5/hdf5_array.h"
#include "data/hdf5/hdf5_file.h"
#include "data/sources/array_numbers.h"

namespace slabstream {

// A dataset of `columns` numbers a row, of one axis or two. InvalidArgument: it is another one. Errors of Hdf5File::Dataset and
// MakeHdf5Array. All messages name it.
Result<std::shared_ptr<ChunkedArray>> OpenRows(const std::shared_ptr<Hdf5File>& file, const std::string& dataset, std::uint64_t columns,
                                               const SourceContext& context);
// `count` of its rows from `begin` on, which may be what a file says. DataLoss, naming the dataset: it does not have them.
Result<ArrayBox> RowsOf(const ArrayShape& shape, const std::string& named, std::int64_t begin, std::int64_t count);

// Row by row. Errors of both, and of ReadElements.
template <class T>
Result<AlignedVector<T>> ReadRows(const std::shared_ptr<Hdf5File>& file, const std::string& dataset, const SourceContext& context,
                                  std::int64_t begin, std::int64_t count, std::uint64_t columns = 1) {
  const Result<std::shared_ptr<ChunkedArray>> array = OpenRows(file, dataset, columns, context);
  if (!array.ok()) return array.status();
  const std::string named = file->Named(dataset);
  const Result<ArrayBox> rows = RowsOf((*array)->shape(), named, begin, count);
  if (!rows.ok()) return rows.status();
  return count == 0 ? Result(AlignedVector<T>()) : ReadNumbers<T>(named, *array, *rows);
}

}  // namespace slabstream
