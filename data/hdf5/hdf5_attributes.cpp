#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <utility>

#include "data/hdf5/hdf5_file.h"
#include "data/hdf5/hdf5_heap.h"
#include "data/hdf5/hdf5_library.h"

namespace slabstream {
namespace {

constexpr std::size_t kMostAttributeBytes = 64 << 10;

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
  if (count < 1 || bytes < 1 || bytes > kMostAttributeBytes || std::size_t(count) > kMostAttributeBytes / bytes) return std::nullopt;
  const H5T_class_t kind = H5Tget_class(type.id());
  return Attribute{std::move(id), std::move(type), std::size_t(count), bytes, kind};
}

bool IsNumber(hid_t type) {
  const H5T_class_t kind = H5Tget_class(type);
  return (kind == H5T_INTEGER || kind == H5T_FLOAT) && H5Tget_size(type) <= sizeof(double);
}

// `joined`: texts of a fixed length are one text, in parts.
std::optional<std::vector<std::string>> ReadTexts(hid_t file, const Attribute& attribute, bool joined) {
  if (attribute.kind != H5T_STRING) return std::nullopt;
  std::vector<std::string> texts;
  if (H5Tis_variable_str(attribute.type.id()) > 0) {
    const std::optional<std::vector<Hdf5HeapPlace>> places = Hdf5HeapPlaces(attribute.id.id(), attribute.count);
    if (!places) return std::nullopt;
    std::size_t left = kMostAttributeBytes;
    for (const Hdf5HeapPlace& place : *places) {
      std::optional<std::string> text = ReadHdf5Heap(file, place, 1, left);
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
  const std::optional<std::vector<Hdf5HeapPlace>> lists = Hdf5HeapPlaces(found->id.id(), found->count);
  std::vector<std::string> scales;
  for (const Hdf5HeapPlace& list : lists.value_or(std::vector<Hdf5HeapPlace>{})) {
    std::string& path = scales.emplace_back();
    hobj_ref_t reference{};  // the first one of each axis
    const std::optional<std::string> bytes_of_list = ReadHdf5Heap(id_, list, sizeof reference, sizeof reference);
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
