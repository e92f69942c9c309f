// AttributedFile: a file of datasets with attributes, by paths, as HDF5 and classic netCDF are. What describes images (hdf5_image.h) asks
// it alone.
//
// Any thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/base/printable.h"
#include "common/base/status.h"
#include "data/sources/chunked_array.h"
#include "data/sources/read_context.h"
#include "data/volume_io/sample_type.h"

namespace slabstream {

struct DatasetFacts {
  std::string path;                 // "/group/name"
  std::vector<std::uint64_t> size;  // the last axis varies fastest; each at least 1, at most kMaxArrayAxes axes
  SampleType type = SampleType::kUint8;
  bool enumeration = false;  // an enumeration of more than truth values, which are uint8
};

class AttributedFile {
 public:
  virtual ~AttributedFile() = default;
  AttributedFile(const AttributedFile&) = delete;
  AttributedFile& operator=(const AttributedFile&) = delete;

  const std::string& path() const { return path_; }
  // "a.h5: dataset '/x'"
  std::string Named(const std::string& dataset) const { return path_ + ": dataset '" + Printable(dataset) + "'"; }
  virtual std::string format() = 0;  // "netCDF-4"

  virtual bool Has(const std::string& object) = 0;
  // Names in a group, in natural order; none if there is no such group. ResourceExhausted: more than kMostNames.
  static constexpr std::size_t kMostNames = 65536;
  virtual Result<std::vector<std::string>> Names(const std::string& group) = 0;

  // Attributes of an object; "/": of the file. nullopt: there is none, or it holds something else or too much.
  static constexpr std::size_t kMostAttributeBytes = 64 << 10;
  virtual std::optional<std::string> Text(const std::string& object, const std::string& attribute) = 0;
  virtual std::optional<std::vector<std::string>> Texts(const std::string& object, const std::string& attribute) = 0;  // one or more
  virtual std::optional<std::vector<double>> Numbers(const std::string& object, const std::string& attribute) = 0;     // one or more

  // Paths of the datasets with the coordinates of a dataset's axes (they need not be there), one for each axis, "" where there is none;
  // empty: the file does not say.
  virtual std::vector<std::string> DimensionScales(const std::string& dataset) = 0;

  struct Found {
    std::vector<std::string> paths;   // paths of datasets with at least `axes` axes, sorted
    std::vector<std::string> closed;  // paths of objects that cannot be opened
  };
  virtual Found Datasets(int axes) = 0;

  // NotFound: there is no such dataset. InvalidArgument: its type or the way it is stored is not supported; the message names it.
  // DataLoss: the file is too short for it. ResourceExhausted: chunks of more than kMostChunkBytes.
  virtual Result<DatasetFacts> Describe(const std::string& dataset) = 0;
  // Its samples. `as`: what they are taken for, of as many bytes as their type; nullopt: what the file says. Errors of Describe.
  virtual Result<std::shared_ptr<ChunkedArray>> Array(const std::string& dataset, const SourceContext& context,
                                                      std::optional<SampleType> as) = 0;
  // The numbers in a small dataset (at most kMostSmallNumbers), row by row. Errors of Describe; ResourceExhausted; DataLoss.
  static constexpr std::uint64_t kMostSmallNumbers = 1 << 20;
  virtual Result<std::vector<double>> SmallDataset(const std::string& dataset) = 0;

 protected:
  explicit AttributedFile(std::string path) : path_(std::move(path)) {}

  // A dataset's number of axes and their sizes are as DatasetFacts says. InvalidArgument, naming it.
  Status CheckSize(const std::string& dataset, const std::vector<std::uint64_t>& size) const;

 private:
  const std::string path_;
};

}  // namespace slabstream
