// HDF5 files for tests, written by libhdf5 itself. One thread at a time, while no source reads.
#pragma once

#include <hdf5.h>

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "data/volume_io/sample_type.h"

namespace slabstream {

class Hdf5Writer {
 public:
  // `latest`: writes the newest version of everything, with other indices of chunks.
  explicit Hdf5Writer(const std::string& path, bool latest = false);
  ~Hdf5Writer();
  Hdf5Writer(const Hdf5Writer&) = delete;
  Hdf5Writer& operator=(const Hdf5Writer&) = delete;

  hid_t file() const { return file_; }

  struct Filters {
    bool shuffle = false, deflate = false, fletcher32 = false, not_of_cut_chunks = false;
  };
  struct Layout {
    std::vector<hsize_t> size, chunk = {};  // without chunks: in one piece
    SampleType type = SampleType::kUint16;
    bool big_endian = false, compact = false, grows = false;  // grows: without a largest size, which takes another index
    Filters filters = {};
    std::vector<std::byte> fill = {};  // one element, in this machine's order
  };
  // An open dataset, with the groups above it. Close it with H5Dclose.
  hid_t Create(const std::string& path, const Layout& layout);
  // With all its samples, in this machine's byte order.
  void Write(const std::string& path, const Layout& layout, const void* samples);

  void Group(const std::string& path);
  void Text(const std::string& object, const std::string& name, const std::string& value);                // one text
  void Characters(const std::string& object, const std::string& name, const std::string& value);          // as Imaris writes them
  void Texts(const std::string& object, const std::string& name, const std::vector<std::string>& value);  // an array of them
  void Numbers(const std::string& object, const std::string& name, const std::vector<double>& value);
  // A dataset of float64.
  void Doubles(const std::string& path, const std::vector<hsize_t>& size, const std::vector<double>& values);
  // The dimension scales of a dataset, by their paths, as the library's H5DS writes their list.
  void Scales(const std::string& dataset, const std::vector<std::string>& scales);

 private:
  hid_t file_;
};

hid_t NativeHdf5Type(SampleType type);

}  // namespace slabstream
