// Texts and lists of any length in attributes, read from the heaps of the file that hold them. libhdf5 1.10 does that as well, but it
// believes both lengths that a file states, that of the attribute and that of the heap: where they differ, it writes beyond its memory.
// Here it only says where the values lie.
//
// Under Hdf5Lock.
#pragma once

#include <hdf5.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace slabstream {

// So many elements, in an object of that number in a heap at that address of the file.
struct Hdf5HeapPlace {
  std::uint32_t elements = 0;
  std::uint64_t heap = 0;
  std::uint32_t number = 0;
};

// Where each value of an attribute lies that holds `count` texts or lists of any length. nullopt: the places cannot be
// told.
std::optional<std::vector<Hdf5HeapPlace>> Hdf5HeapPlaces(hid_t attribute, std::size_t count);

// The bytes of a value, of which each element has so many; no more than `most`. nullopt: the file has fewer there, or the heap is damaged.
std::optional<std::string> ReadHdf5Heap(hid_t file, const Hdf5HeapPlace& place, std::size_t element_bytes, std::size_t most);

}  // namespace slabstream
