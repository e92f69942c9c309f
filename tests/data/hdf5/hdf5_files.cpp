#include "tests/data/hdf5/hdf5_files.h"

#include "common/base/check.h"

namespace slabstream {
namespace {

hid_t StoredType(SampleType type, bool big_endian) {
  const hid_t stored = H5Tcopy(NativeHdf5Type(type));
  CHECK(H5Tset_order(stored, big_endian ? H5T_ORDER_BE : H5T_ORDER_LE) >= 0);
  return stored;
}

void Must(herr_t status) { CHECK(status >= 0); }

}  // namespace

hid_t NativeHdf5Type(SampleType type) {
  return VisitSampleType(type, [](const auto* none) -> hid_t {
    using T = std::remove_cvref_t<decltype(*none)>;
    CHECK(!(std::is_same_v<T, Half>)) << "libhdf5 has no such type of its own";
    if constexpr (std::is_same_v<T, float>) return H5T_NATIVE_FLOAT;
    if constexpr (std::is_same_v<T, double>) return H5T_NATIVE_DOUBLE;
    switch (sizeof(T)) {
      case 1: return std::is_signed_v<T> ? H5T_NATIVE_INT8 : H5T_NATIVE_UINT8;
      case 2: return std::is_signed_v<T> ? H5T_NATIVE_INT16 : H5T_NATIVE_UINT16;
      case 4: return std::is_signed_v<T> ? H5T_NATIVE_INT32 : H5T_NATIVE_UINT32;
      default: return std::is_signed_v<T> ? H5T_NATIVE_INT64 : H5T_NATIVE_UINT64;
    }
  });
}

Hdf5Writer::Hdf5Writer(const std::string& path, bool latest) {
  const hid_t access = H5Pcreate(H5P_FILE_ACCESS);
  if (latest) Must(H5Pset_libver_bounds(access, H5F_LIBVER_LATEST, H5F_LIBVER_LATEST));
  file_ = H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, access);
  CHECK(file_ >= 0) << path;
  Must(H5Pclose(access));
}

Hdf5Writer::~Hdf5Writer() { (void)H5Fclose(file_); }

hid_t Hdf5Writer::Create(const std::string& path, const Layout& layout) {
  const hid_t creation = H5Pcreate(H5P_DATASET_CREATE), links = H5Pcreate(H5P_LINK_CREATE);
  Must(H5Pset_create_intermediate_group(links, 1));
  if (layout.compact) Must(H5Pset_layout(creation, H5D_COMPACT));
  if (!layout.chunk.empty()) {
    Must(H5Pset_chunk(creation, int(layout.chunk.size()), layout.chunk.data()));
    if (layout.filters.not_of_cut_chunks) Must(H5Pset_chunk_opts(creation, H5D_CHUNK_DONT_FILTER_PARTIAL_CHUNKS));
    if (layout.filters.shuffle) Must(H5Pset_shuffle(creation));
    if (layout.filters.deflate) Must(H5Pset_deflate(creation, 4));
    if (layout.filters.fletcher32) Must(H5Pset_fletcher32(creation));
  }
  if (!layout.fill.empty()) Must(H5Pset_fill_value(creation, NativeHdf5Type(layout.type), layout.fill.data()));
  const std::vector<hsize_t> most(layout.size.size(), H5S_UNLIMITED);
  const hid_t space = H5Screate_simple(int(layout.size.size()), layout.size.data(), layout.grows ? most.data() : nullptr);
  const hid_t type = StoredType(layout.type, layout.big_endian);
  const hid_t dataset = H5Dcreate2(file_, path.c_str(), type, space, links, creation, H5P_DEFAULT);
  CHECK(dataset >= 0) << path;
  Must(H5Tclose(type));
  Must(H5Sclose(space));
  Must(H5Pclose(creation));
  Must(H5Pclose(links));
  return dataset;
}

void Hdf5Writer::Write(const std::string& path, const Layout& layout, const void* samples) {
  const hid_t dataset = Create(path, layout);
  Must(H5Dwrite(dataset, NativeHdf5Type(layout.type), H5S_ALL, H5S_ALL, H5P_DEFAULT, samples));
  Must(H5Dclose(dataset));
}

void Hdf5Writer::Group(const std::string& path) {
  const hid_t links = H5Pcreate(H5P_LINK_CREATE);
  Must(H5Pset_create_intermediate_group(links, 1));
  const hid_t group = H5Gcreate2(file_, path.c_str(), links, H5P_DEFAULT, H5P_DEFAULT);
  CHECK(group >= 0) << path;
  Must(H5Gclose(group));
  Must(H5Pclose(links));
}

namespace {

void WriteAttribute(hid_t file, const std::string& object, const std::string& name, hid_t type, std::vector<hsize_t> size,
                    const void* value) {
  const hid_t space = size.empty() ? H5Screate(H5S_SCALAR) : H5Screate_simple(int(size.size()), size.data(), nullptr);
  const hid_t attribute = H5Acreate_by_name(file, object.c_str(), name.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
  CHECK(attribute >= 0) << object << " " << name;
  Must(H5Awrite(attribute, type, value));
  Must(H5Aclose(attribute));
  Must(H5Sclose(space));
}

}  // namespace

void Hdf5Writer::Text(const std::string& object, const std::string& name, const std::string& value) {
  const hid_t type = H5Tcopy(H5T_C_S1);
  Must(H5Tset_size(type, H5T_VARIABLE));
  const char* text = value.c_str();
  WriteAttribute(file_, object, name, type, {}, static_cast<const void*>(&text));
  Must(H5Tclose(type));
}

void Hdf5Writer::Characters(const std::string& object, const std::string& name, const std::string& value) {
  WriteAttribute(file_, object, name, H5T_C_S1, {value.size()}, value.data());
}

void Hdf5Writer::Numbers(const std::string& object, const std::string& name, const std::vector<double>& value) {
  WriteAttribute(file_, object, name, H5T_NATIVE_DOUBLE, {value.size()}, value.data());
}

void Hdf5Writer::Texts(const std::string& object, const std::string& name, const std::vector<std::string>& value) {
  const hid_t type = H5Tcopy(H5T_C_S1);
  Must(H5Tset_size(type, H5T_VARIABLE));
  std::vector<const char*> texts;
  for (const std::string& text : value) texts.push_back(text.c_str());
  WriteAttribute(file_, object, name, type, {texts.size()}, static_cast<const void*>(texts.data()));
  Must(H5Tclose(type));
}

void Hdf5Writer::Doubles(const std::string& path, const std::vector<hsize_t>& size, const std::vector<double>& values) {
  Write(path, {.size = size, .type = SampleType::kFloat64}, values.data());
}

void Hdf5Writer::Scales(const std::string& dataset, const std::vector<std::string>& scales) {
  std::vector<hobj_ref_t> references(scales.size());
  std::vector<hvl_t> lists;
  for (std::size_t i = 0; i < scales.size(); ++i) {
    if (!scales[i].empty()) Must(H5Rcreate(&references[i], file_, scales[i].c_str(), H5R_OBJECT, -1));
    lists.push_back({scales[i].empty() ? 0U : 1U, &references[i]});
  }
  const hid_t type = H5Tvlen_create(H5T_STD_REF_OBJ);
  WriteAttribute(file_, dataset, "DIMENSION_LIST", type, {lists.size()}, lists.data());
  Must(H5Tclose(type));
}

}  // namespace slabstream
