// Hdf5File and Hdf5Dataset: what sources want to know of HDF5 files. libhdf5 reads the metadata; it does not read samples, since it
// does so on one thread at a time: a dataset says where in the file its chunks lie, and how they are packed.
//
// A file is hostile until proven otherwise: it cannot make this process open another file (external links, external storage and virtual
// datasets are refused) or take memory that nothing here has checked.
//
// Any thread. libhdf5 has one lock for the process (Hdf5Lock, in hdf5_file.cpp), which all functions here take.
#pragma once

#include <hdf5.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "common/memory/bytes.h"
#include "data/sources/chunked_array.h"

namespace slabstream {

class Hdf5Dataset;

class Hdf5File : public std::enable_shared_from_this<Hdf5File> {
 public:
  // NotFound, Unavailable: it cannot be opened. InvalidArgument: it is no HDF5 file, or is damaged. Messages name the path.
  static Result<std::shared_ptr<Hdf5File>> Open(const std::string& path);
  ~Hdf5File();
  Hdf5File(const Hdf5File&) = delete;
  Hdf5File& operator=(const Hdf5File&) = delete;

  const std::string& path() const { return path_; }

  bool Has(const std::string& object);
  // Names of the links of a group, in natural order; none if there is no such group. ResourceExhausted: more than kMostNames.
  static constexpr std::size_t kMostNames = 65536;
  Result<std::vector<std::string>> Names(const std::string& group);

  // Attributes of an object. nullopt: there is none, or it holds something else or too much (64 KiB). A text may also be stored as an array
  // of characters, as Imaris writes them.
  std::optional<std::string> Text(const std::string& object, const std::string& attribute);
  std::optional<std::vector<std::string>> Texts(const std::string& object, const std::string& attribute);  // one or more
  std::optional<std::vector<double>> Numbers(const std::string& object, const std::string& attribute);

  // Paths of the dimension scales of a dataset, one for each axis, "" where there is none; empty: it has no list of them.
  std::vector<std::string> DimensionScales(const std::string& dataset);

  // Paths of datasets. Follows no links but hard ones, and looks at kMostNames objects at most.
  struct Found {
    std::vector<std::string> paths;   // paths of datasets with at least `axes` axes, sorted
    std::vector<std::string> closed;  // paths of objects that cannot be opened
  };
  Found Datasets(int axes);

  // NotFound: there is no such dataset. InvalidArgument: a later version of HDF5 wrote it; its type, its layout or one of its filters is
  // not supported; the message names it. ResourceExhausted: chunks of more than kMostChunkBytes.
  Result<std::shared_ptr<Hdf5Dataset>> Dataset(const std::string& path);
  // The numbers in a small dataset (at most kMostSmallNumbers), row by row. Errors of Dataset; ResourceExhausted; DataLoss.
  static constexpr std::uint64_t kMostSmallNumbers = 1 << 20;
  Result<std::vector<double>> SmallDataset(const std::string& path);

  // "a.h5: dataset '/x'"
  std::string Named(const std::string& dataset) const;

 private:
  friend class Hdf5Dataset;
  Hdf5File(std::string path, hid_t id) : path_(std::move(path)), id_(id) {}
  Status CannotOpen(const std::string& dataset) const;

  const std::string path_;
  const hid_t id_;
};

struct Hdf5Filter {
  int id = 0;
  std::string name;              // as the file calls it; may be empty
  std::vector<unsigned> values;  // its parameters
};

// Where in the file a chunk lies.
struct Hdf5StoredChunk {
  std::uint64_t begin = 0, bytes = 0;
  std::uint32_t left_out = 0;  // bit i: filter i was not applied to this chunk
};

class Hdf5Dataset {
 public:
  enum class Layout : std::uint8_t { kCompact, kContiguous, kChunked };

  ~Hdf5Dataset();
  Hdf5Dataset(const Hdf5Dataset&) = delete;
  Hdf5Dataset& operator=(const Hdf5Dataset&) = delete;

  const std::string& path() const { return path_; }
  const std::string& file() const { return file_->path(); }
  const std::vector<std::uint64_t>& size() const { return size_; }
  SampleType type() const { return type_; }
  bool big_endian() const { return big_endian_; }
  bool enumeration() const { return enumeration_; }  // an enumeration of more than truth values, which are uint8
  Layout layout() const { return layout_; }
  const std::vector<std::byte>& fill() const { return fill_; }  // one element, in this machine's byte order

  // kChunked.
  const std::vector<std::uint64_t>& chunk() const { return chunk_; }
  const std::vector<Hdf5Filter>& filters() const { return filters_; }  // in the order in which they were applied
  bool filters_cut_chunks() const { return filters_cut_chunks_; }      // those that reach beyond the dataset are filtered, too
  // nullopt: it was never written. DataLoss.
  Result<std::optional<Hdf5StoredChunk>> Find(std::span<const std::uint64_t> index) const;

  // kContiguous: where in the file its samples begin. nullopt: they were never written.
  std::optional<std::uint64_t> begin() const { return begin_; }

  // kCompact: all samples, in this machine's byte order. DataLoss.
  Result<Bytes> ReadCompact() const;

 private:
  friend class Hdf5File;
  Hdf5Dataset(std::shared_ptr<Hdf5File> file, std::string path, hid_t id) : file_(std::move(file)), path_(std::move(path)), id_(id) {}
  Status Describe();
  Status DescribeLayout(hid_t creation);
  Status DescribeType(hid_t stored);
  Status Refused(const std::string& why) const { return Status::InvalidArgument(file_->Named(path_) + " " + why); }

  const std::shared_ptr<Hdf5File> file_;
  const std::string path_;
  const hid_t id_;
  std::vector<std::uint64_t> size_, chunk_;
  SampleType type_ = SampleType::kUint8;
  bool big_endian_ = false, enumeration_ = false, filters_cut_chunks_ = true;
  Layout layout_ = Layout::kCompact;
  std::vector<Hdf5Filter> filters_;
  std::vector<std::byte> fill_;
  std::optional<std::uint64_t> begin_;
};

}  // namespace slabstream
