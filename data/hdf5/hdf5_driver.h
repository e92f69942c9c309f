// Hdf5Driver: how libhdf5 reads a file here. It is a file driver of the library (H5FD_class_t) over a descriptor that is open already, so
// whatever a file says, the library opens no other one.
//
// It also finds chunks: asked for a chunk as it is stored (H5Dread_chunk), the library looks its place up and tells its driver to read it.
// The driver then remembers the place instead. The library's own functions for that look at all chunks for each one.
//
// Under Hdf5Lock.
#pragma once

#include <hdf5.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

namespace slabstream {

struct Hdf5Place {
  std::uint64_t begin = 0, bytes = 0;  // a piece of the file
};

// Lets `access`, a file access property list, open the file behind `descriptor`, of which the library takes a duplicate.
bool UseHdf5Driver(hid_t access, int descriptor);

// Where the chunk lies whose first element is at `offset`. nullopt: it cannot be found. `left_out`: bits of filters that were not applied.
std::optional<Hdf5Place> FindHdf5Chunk(hid_t file, hid_t dataset, const hsize_t* offset, std::uint32_t& left_out);

// The bytes of the file from `begin` on. False: it has fewer there, or they cannot be read.
bool ReadHdf5Bytes(hid_t file, std::uint64_t begin, std::span<std::byte> out);

}  // namespace slabstream
