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
#include "data/hdf5/attributed_file.h"
#include "data/sources/chunked_array.h"

namespace slabstream {

class Hdf5Dataset;

class Hdf5File : public AttributedFile, public std::enable_shared_from_this<Hdf5File> {
 public:
  // NotFound, Unavailable: it cannot be opened. InvalidArgument: it is no HDF5 file, or is damaged. Messages name the path.
  static Result<std::shared_ptr<Hdf5File>> Open(const std::string& path);
  ~Hdf5File() override;

  std::string format() override;
  bool Has(const std::string& object) override;
  Result<std::vector<std::string>> Names(const std::string& group) override;

  // A text may also be stored as an array of characters, as Imaris writes them.
  std::optional<std::string> Text(const std::string& object, const std::string& attribute) override;
  std::optional<std::vector<std::string>> Texts(const std::string& object, const std::string& attribute) override;
  std::optional<std::vector<double>> Numbers(const std::string& object, const std::string& attribute) override;
  std::vector<std::string> DimensionScales(const std::string& dataset) override;

  // Follows no links but hard ones, and looks at kMostNames objects at most.
  Found Datasets(int axes) override;

  // NotFound: there is no such dataset. InvalidArgument: a later version of HDF5 wrote it; its type, its layout or one of its filters is
  // not supported; the message names it. ResourceExhausted: chunks of more than kMostChunkBytes.
  Result<std::shared_ptr<Hdf5Dataset>> Dataset(const std::string& path);
  Result<DatasetFacts> Describe(const std::string& dataset) override;
  Result<std::shared_ptr<ChunkedArray>> Array(const std::string& dataset, const SourceContext& context,
                                              std::optional<SampleType> as) override;
  Result<std::vector<double>> SmallDataset(const std::string& path) override;

 private:
  friend class Hdf5Dataset;
  Hdf5File(std::string path, hid_t id) : AttributedFile(std::move(path)), id_(id) {}
  Status CannotOpen(const std::string& dataset) const;

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

  const DatasetFacts& facts() const { return facts_; }
  const std::string& file() const { return file_->path(); }
  std::string named() const { return file_->Named(facts_.path); }
  const std::vector<std::uint64_t>& size() const { return facts_.size; }
  SampleType type() const { return facts_.type; }
  bool big_endian() const { return big_endian_; }
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
  Hdf5Dataset(std::shared_ptr<Hdf5File> file, std::string path, hid_t id)
      : file_(std::move(file)), facts_{.path = std::move(path)}, id_(id) {}
  Status Describe();
  Status DescribeLayout(hid_t creation);
  Status DescribeType(hid_t stored);
  Status Refused(const std::string& why) const { return Status::InvalidArgument(named() + " " + why); }

  const std::shared_ptr<Hdf5File> file_;
  DatasetFacts facts_;
  const hid_t id_;
  std::vector<std::uint64_t> chunk_;
  bool big_endian_ = false, filters_cut_chunks_ = true;
  Layout layout_ = Layout::kCompact;
  std::vector<Hdf5Filter> filters_;
  std::vector<std::byte> fill_;
  std::optional<std::uint64_t> begin_;
};

}  // namespace slabstream
