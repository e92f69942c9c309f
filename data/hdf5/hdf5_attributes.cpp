// Texts and lists of any length in attributes are read from the heaps of the file that hold them. libhdf5 1.10 does that as well, but it
// believes both lengths that a file states, that of the attribute and that of the heap: where they differ, it writes beyond its memory.
// Here it only says where the values lie.
//
// Sources: the HDF5 File Format Specification 3.0, III.E (global heap) and IV.A.2.d (variable-length types).
#include <hdf5.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "data/hdf5/hdf5_driver.h"
#include "data/hdf5/hdf5_file.h"
#include "data/hdf5/hdf5_library.h"

namespace slabstream {
namespace {

// So many elements, in an object of that number in a heap at that address of the file.
struct HeapPlace {
  std::uint32_t elements = 0;
  std::uint64_t heap = 0;
  std::uint32_t number = 0;
};

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

// Where each value of an attribute lies that holds `count` texts or lists of any length. nullopt: the places cannot be
// told.
std::optional<std::vector<HeapPlace>> HeapPlaces(hid_t attribute, std::size_t count) {
  std::vector<StoredPlace> stored(count);
  if (H5Aget_storage_size(attribute) != count * kPlaceBytes || StoredPlaceType() < 0) return std::nullopt;
  if (H5Aread(attribute, StoredPlaceType(), stored.data()) < 0) return std::nullopt;
  std::vector<HeapPlace> places;
  for (const StoredPlace& each : stored) {
    const std::span<const std::byte> bytes = each;
    places.push_back({std::uint32_t(Little(bytes.first(4))), Little(bytes.subspan(4, 8)), std::uint32_t(Little(bytes.subspan(12)))});
  }
  return places;
}

// The bytes of a value, of which each element has so many; no more than `most`. nullopt: the file has fewer there, or the heap is damaged.
std::optional<std::string> ReadHeap(hid_t file, const HeapPlace& place, std::size_t element_bytes, std::size_t most) {
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

// An attribute that is small enough to be read, with its type and its number of elements.
struct Attribute {
  Hdf5Id id, type;
  std::size_t count = 0, bytes_each = 0;
  H5T_class_t kind = H5T_NO_CLASS;
};

std::optional<Attribute> OpenAttribute(hid_t file, const std::string& object, const std::string& name) {
  if (H5Aexists_by_name(file, object.c_str(), name.c_str(), H5P_DEFAULT) <= 0) return std::nullopt;
  Hdf5Id id(H5Aopen_by_name(file, object.c_str(), name.c_str(), H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  if (!id.ok()) return std::nullopt;
  Hdf5Id type(H5Aget_type(id.id()), H5Tclose);
  const Hdf5Id space(H5Aget_space(id.id()), H5Sclose);
  if (!type.ok() || !space.ok()) return std::nullopt;
  const hssize_t count = H5Sget_simple_extent_npoints(space.id());
  const std::size_t bytes = H5Tget_size(type.id());
  if (count < 1 || bytes < 1 || bytes > AttributedFile::kMostAttributeBytes ||
      std::size_t(count) > AttributedFile::kMostAttributeBytes / bytes)
    return std::nullopt;
  const H5T_class_t kind = H5Tget_class(type.id());
  return Attribute{std::move(id), std::move(type), std::size_t(count), bytes, kind};
}

bool IsNumber(hid_t type) {
  const H5T_class_t kind = H5Tget_class(type);
  return (kind == H5T_INTEGER || kind == H5T_FLOAT) && H5Tget_size(type) <= sizeof(long double);
}

// `joined`: texts of a fixed length are one text, in parts.
std::optional<std::vector<std::string>> ReadTexts(hid_t file, const Attribute& attribute, bool joined) {
  if (attribute.kind != H5T_STRING) return std::nullopt;
  std::vector<std::string> texts;
  if (H5Tis_variable_str(attribute.type.id()) > 0) {
    const std::optional<std::vector<HeapPlace>> places = HeapPlaces(attribute.id.id(), attribute.count);
    if (!places) return std::nullopt;
    std::size_t left = AttributedFile::kMostAttributeBytes;
    for (const HeapPlace& place : *places) {
      std::optional<std::string> text = ReadHeap(file, place, 1, left);
      if (!text) return std::nullopt;
      left -= text->size();
      text->resize(std::min(text->find('\0'), text->size()));
      texts.push_back(*std::move(text));
    }
    return texts;
  }
  std::string all(attribute.count * attribute.bytes_each, '\0');
  if (H5Aread(attribute.id.id(), attribute.type.id(), all.data()) < 0) return std::nullopt;
  const std::size_t bytes = joined ? all.size() : attribute.bytes_each;
  for (std::size_t begin = 0; begin < all.size(); begin += bytes) {
    std::string text = all.substr(begin, bytes);
    text.resize(std::min(text.find('\0'), text.size()));
    text.resize(text.find_last_not_of(' ') + 1);
    texts.push_back(std::move(text));
  }
  return texts;
}

}  // namespace

std::optional<std::string> Hdf5File::Text(const std::string& object, const std::string& attribute) {
  const Hdf5Lock lock;
  const std::optional<Attribute> found = OpenAttribute(id_, object, attribute);
  std::optional<std::vector<std::string>> texts = found ? ReadTexts(id_, *found, true) : std::nullopt;
  return texts && texts->size() == 1 ? std::optional(std::move(texts->front())) : std::nullopt;
}

std::optional<std::vector<std::string>> Hdf5File::Texts(const std::string& object, const std::string& attribute) {
  const Hdf5Lock lock;
  const std::optional<Attribute> found = OpenAttribute(id_, object, attribute);
  return found ? ReadTexts(id_, *found, false) : std::nullopt;
}

std::optional<std::vector<double>> Hdf5File::Numbers(const std::string& object, const std::string& attribute) {
  const Hdf5Lock lock;
  const std::optional<Attribute> found = OpenAttribute(id_, object, attribute);
  if (!found || !IsNumber(found->type.id())) return std::nullopt;
  std::vector<double> numbers(found->count);
  if (H5Aread(found->id.id(), H5T_NATIVE_DOUBLE, numbers.data()) < 0) return std::nullopt;
  return numbers;
}

std::vector<std::string> Hdf5File::DimensionScales(const std::string& dataset) {
  const Hdf5Lock lock;
  const std::optional<Attribute> found = OpenAttribute(id_, dataset, "DIMENSION_LIST");
  if (!found || found->kind != H5T_VLEN) return {};
  const Hdf5Id element(H5Tget_super(found->type.id()), H5Tclose);
  if (!element.ok() || H5Tequal(element.id(), H5T_STD_REF_OBJ) <= 0) return {};
  const std::optional<std::vector<HeapPlace>> lists = HeapPlaces(found->id.id(), found->count);
  std::vector<std::string> scales;
  for (const HeapPlace& list : lists.value_or(std::vector<HeapPlace>{})) {
    std::string& path = scales.emplace_back();
    hobj_ref_t reference{};  // the first one of each axis
    const std::optional<std::string> bytes_of_list = ReadHeap(id_, list, sizeof reference, sizeof reference);
    if (!bytes_of_list || bytes_of_list->size() != sizeof reference) continue;
    std::memcpy(&reference, bytes_of_list->data(), sizeof reference);
    const Hdf5Id scale(H5Rdereference2(found->id.id(), H5P_DEFAULT, H5R_OBJECT, &reference), H5Oclose);
    constexpr std::size_t kMostPathBytes = 4096;
    const ssize_t bytes = scale.ok() ? H5Iget_name(scale.id(), nullptr, 0) : -1;
    if (bytes < 1 || std::size_t(bytes) > kMostPathBytes) continue;
    path.resize(std::size_t(bytes));
    (void)H5Iget_name(scale.id(), path.data(), path.size() + 1);
  }
  return scales;
}

}  // namespace slabstream
