// Sources: the HDF5 File Format Specification 3.0, III.E (global heap) and IV.A.2.d (variable-length types).
#include "data/hdf5/hdf5_heap.h"

#include <algorithm>
#include <array>
#include <span>
#include <string_view>

#include "data/hdf5/hdf5_driver.h"
#include "data/hdf5/hdf5_library.h"

namespace slabstream {
namespace {

// On disk: 32 bits of elements, 64 of the address and 32 of the number.
constexpr std::size_t kPlaceBytes = 16;
using StoredPlace = std::array<std::byte, kPlaceBytes>;

std::uint64_t Little(std::span<const std::byte> bytes) {
  std::uint64_t number = 0;
  for (std::size_t i = bytes.size(); i-- > 0;) number = number << 8 | std::to_integer<std::uint64_t>(bytes[i]);
  return number;
}

// A type of the library to which it "converts" places by leaving their bytes as they are.
hid_t StoredPlaceType() {
  static const hid_t type = [] {
    const hid_t made = H5Tcreate(H5T_OPAQUE, kPlaceBytes);
    const Hdf5Id list(H5Tvlen_create(H5T_NATIVE_UCHAR), H5Tclose);
    const auto leave = [](hid_t, hid_t, H5T_cdata_t* conversion, std::size_t, std::size_t, std::size_t, void*, void*, hid_t) -> herr_t {
      if (conversion->command == H5T_CONV_INIT) conversion->need_bkg = H5T_BKG_NO;
      return 0;
    };
    return H5Tregister(H5T_PERS_SOFT, "slabstream", list.id(), made, leave) < 0 ? hid_t{-1} : made;
  }();
  return type;
}

// Bytes before the address 0, and whether addresses have 64 bits.
std::optional<std::uint64_t> FirstAddress(hid_t file) {
  const Hdf5Id creation(H5Fget_create_plist(file), H5Pclose);
  hsize_t before = 0;
  std::size_t address_bytes = 0, size_bytes = 0;
  if (H5Pget_userblock(creation.id(), &before) < 0 || H5Pget_sizes(creation.id(), &address_bytes, &size_bytes) < 0) return std::nullopt;
  return address_bytes == 8 && size_bytes == 8 ? std::optional<std::uint64_t>(before) : std::nullopt;
}

}  // namespace

std::optional<std::vector<Hdf5HeapPlace>> Hdf5HeapPlaces(hid_t attribute, std::size_t count) {
  std::vector<StoredPlace> stored(count);
  if (H5Aget_storage_size(attribute) != count * kPlaceBytes || StoredPlaceType() < 0) return std::nullopt;
  if (H5Aread(attribute, StoredPlaceType(), stored.data()) < 0) return std::nullopt;
  std::vector<Hdf5HeapPlace> places;
  for (const StoredPlace& each : stored) {
    const std::span<const std::byte> bytes = each;
    places.push_back({std::uint32_t(Little(bytes.first(4))), Little(bytes.subspan(4, 8)), std::uint32_t(Little(bytes.subspan(12)))});
  }
  return places;
}

std::optional<std::string> ReadHdf5Heap(hid_t file, const Hdf5HeapPlace& place, std::size_t element_bytes, std::size_t most) {
  if (place.elements == 0) return "";
  const std::uint64_t bytes = std::min<std::uint64_t>(std::uint64_t{place.elements} * element_bytes, most);
  const std::optional<std::uint64_t> first = FirstAddress(file);
  std::array<std::byte, 16> header;
  std::uint64_t at = first.value_or(0) + place.heap;
  if (!first || !ReadHdf5Bytes(file, at, header)) return std::nullopt;
  constexpr std::string_view kSignature = "GCOL";
  if (!std::ranges::equal(std::span(header).first(4), std::as_bytes(std::span(kSignature)))) return std::nullopt;
  const std::uint64_t end = at + Little(std::span(header).subspan(8));
  // Each object has its number and the number of its bytes before it; number 0 is the free space behind the last one.
  for (at += header.size(); at < end && ReadHdf5Bytes(file, at, header);) {
    const std::uint64_t number = Little(std::span(header).first(2)), size = Little(std::span(header).subspan(8));
    at += header.size();
    if (number == 0 || size > end - std::min(at, end)) break;
    if (number == place.number) {
      std::string value(bytes, '\0');
      if (bytes > size || !ReadHdf5Bytes(file, at, std::as_writable_bytes(std::span(value)))) return std::nullopt;
      return value;
    }
    at += (size + 7) / 8 * 8;
  }
  return std::nullopt;
}

}  // namespace slabstream
