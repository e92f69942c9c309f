#include "data/hdf5/hdf5_file.h"

#include <fcntl.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <set>
#include <string_view>
#include <utility>

#include "common/base/file_descriptor.h"
#include "common/base/natural_order.h"
#include "common/base/printable.h"
#include "data/hdf5/hdf5_driver.h"
#include "data/hdf5/hdf5_library.h"

namespace slabstream {
namespace {

constexpr std::size_t kMostAttributeBytes = 64 << 10;

// libhdf5's own cache of metadata grows up to this.
constexpr std::size_t kMetadataCacheBytes = 8 << 20;

Hdf5Id FileAccess(int descriptor) {
  Hdf5Id access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  H5AC_cache_config_t cache{};
  cache.version = H5AC__CURR_CACHE_CONFIG_VERSION;
  if (H5Pget_mdc_config(access.id(), &cache) >= 0) {
    cache.max_size = kMetadataCacheBytes;
    (void)H5Pset_mdc_config(access.id(), &cache);
  }
  return UseHdf5Driver(access.id(), descriptor) ? std::move(access) : Hdf5Id(-1, H5Pclose);
}

// The last part of a path that leads to another file, or "".
std::string OutwardLink(hid_t file, const std::string& path) {
  for (std::size_t end = path.find('/', 1);; end = path.find('/', end + 1)) {
    const std::string part = path.substr(0, end);
    H5L_info_t link{};
    if (H5Lget_info(file, part.c_str(), &link, H5P_DEFAULT) < 0) return "";
    if (link.type == H5L_TYPE_EXTERNAL) return part;
    if (end == std::string::npos) return "";
  }
}

// Names of links in the order of the file, until there are more than `most`.
struct Links {
  std::vector<std::string> names;
  std::size_t most = 0;
};

herr_t AddLink(hid_t, const char* name, const H5L_info_t* link, void* data) {
  auto& links = *static_cast<Links*>(data);
  if (links.names.size() >= links.most) return 1;
  if (link->type == H5L_TYPE_HARD) links.names.emplace_back(name);
  return 0;
}

Links HardLinks(hid_t file, const std::string& group, std::size_t most) {
  Links links{{}, most};
  hsize_t at = 0;
  (void)H5Literate_by_name(file, group.c_str(), H5_INDEX_NAME, H5_ITER_NATIVE, &at, AddLink, &links, H5P_DEFAULT);
  return links;
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
  if (count < 1 || bytes < 1 || bytes > kMostAttributeBytes || std::size_t(count) > kMostAttributeBytes / bytes) return std::nullopt;
  const H5T_class_t kind = H5Tget_class(type.id());
  return Attribute{std::move(id), std::move(type), std::size_t(count), bytes, kind};
}

bool IsNumber(hid_t type) {
  const H5T_class_t kind = H5Tget_class(type);
  return (kind == H5T_INTEGER || kind == H5T_FLOAT) && H5Tget_size(type) <= sizeof(double);
}

}  // namespace

Result<std::shared_ptr<Hdf5File>> Hdf5File::Open(const std::string& path) {
  const FileDescriptor descriptor(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (descriptor.number() < 0) {
    const int error = errno;
    return Status(error == ENOENT ? StatusCode::kNotFound : StatusCode::kUnavailable, path + ": " + std::strerror(error));
  }
  const Hdf5Lock lock;
  const Hdf5Id access = FileAccess(descriptor.number());
  if (!access.ok()) return Status::Internal(path + ": libhdf5 takes no file driver: " + Hdf5Complaint());
  Hdf5Id id(H5Fopen(path.c_str(), H5F_ACC_RDONLY, access.id()), H5Fclose);
  if (!id.ok()) return Status::InvalidArgument(path + ": not an HDF5 file, or damaged: " + Hdf5Complaint());
  return std::shared_ptr<Hdf5File>(new Hdf5File(path, id.Release()));
}

Hdf5File::~Hdf5File() {
  const Hdf5Lock lock;
  (void)H5Fclose(id_);
}

bool Hdf5File::Has(const std::string& object) {
  const Hdf5Lock lock;
  H5O_info_t info{};
  return H5Oget_info_by_name2(id_, object.c_str(), &info, H5O_INFO_BASIC, H5P_DEFAULT) >= 0;
}

Result<std::vector<std::string>> Hdf5File::Names(const std::string& group) {
  const Hdf5Lock lock;
  Links links = HardLinks(id_, group, kMostNames + 1);
  if (links.names.size() > kMostNames) {
    return Status::ResourceExhausted(fmt::format("{}: group '{}' holds more than {} names", path_, Printable(group), kMostNames));
  }
  std::ranges::sort(links.names, {}, InNaturalOrder);
  return std::move(links.names);
}

std::optional<std::string> Hdf5File::Text(const std::string& object, const std::string& attribute) {
  const Hdf5Lock lock;
  const std::optional<Attribute> found = OpenAttribute(id_, object, attribute);
  if (!found || found->kind != H5T_STRING) return std::nullopt;
  if (H5Tis_variable_str(found->type.id()) > 0) {
    if (found->count != 1) return std::nullopt;
    char* text = nullptr;
    if (H5Aread(found->id.id(), found->type.id(), static_cast<void*>(&text)) < 0 || text == nullptr) return std::nullopt;
    std::string copy(text, ::strnlen(text, kMostAttributeBytes));
    (void)H5free_memory(text);
    return copy;
  }
  std::string text(found->count * found->bytes_each, '\0');
  if (H5Aread(found->id.id(), found->type.id(), text.data()) < 0) return std::nullopt;
  text.resize(std::min(text.find('\0'), text.size()));
  text.resize(text.find_last_not_of(' ') + 1);
  return text;
}

std::optional<std::vector<double>> Hdf5File::Numbers(const std::string& object, const std::string& attribute) {
  const Hdf5Lock lock;
  const std::optional<Attribute> found = OpenAttribute(id_, object, attribute);
  if (!found || !IsNumber(found->type.id())) return std::nullopt;
  std::vector<double> numbers(found->count);
  if (H5Aread(found->id.id(), H5T_NATIVE_DOUBLE, numbers.data()) < 0) return std::nullopt;
  return numbers;
}

std::vector<std::string> Hdf5File::Datasets(int axes) {
  const Hdf5Lock lock;
  std::vector<std::string> found, groups = {""};
  std::set<haddr_t> seen;  // an object may have several names, and a group may lie in itself
  while (!groups.empty()) {
    const std::string group = std::move(groups.back());
    groups.pop_back();
    for (const std::string& name : HardLinks(id_, group.empty() ? "/" : group, kMostNames).names) {
      std::string path = group + "/" + name;
      H5O_info_t info{};
      if (seen.size() >= kMostNames || path.size() > 4096) break;
      if (H5Oget_info_by_name2(id_, path.c_str(), &info, H5O_INFO_BASIC, H5P_DEFAULT) < 0 || !seen.insert(info.addr).second) continue;
      if (info.type == H5O_TYPE_GROUP) groups.push_back(std::move(path));
      if (info.type != H5O_TYPE_DATASET) continue;
      const Hdf5Id dataset(H5Dopen2(id_, path.c_str(), H5P_DEFAULT), H5Dclose);
      const Hdf5Id space(dataset.ok() ? H5Dget_space(dataset.id()) : -1, H5Sclose);
      if (space.ok() && H5Sget_simple_extent_ndims(space.id()) >= axes) found.push_back(std::move(path));
    }
  }
  std::ranges::sort(found, {}, InNaturalOrder);
  return found;
}

Status Hdf5File::CannotOpen(const std::string& dataset) const {
  const std::string complaint = Hdf5Complaint();
  const std::string outward = OutwardLink(id_, dataset);
  if (!outward.empty()) {
    return Status::InvalidArgument(Named(dataset) + " lies in another file: '" + Printable(outward) +
                                   "' is an external link, and those are not followed");
  }
  return Status::NotFound(Named(dataset) + " cannot be opened: " + complaint);
}

std::string Hdf5File::Named(const std::string& dataset) const { return path_ + ": dataset '" + Printable(dataset) + "'"; }

Result<std::shared_ptr<Hdf5Dataset>> Hdf5File::Dataset(const std::string& path) {
  std::shared_ptr<Hdf5Dataset> dataset;  // given back after the lock, which it takes
  const Hdf5Lock lock;
  Hdf5Id id(H5Dopen2(id_, path.c_str(), H5P_DEFAULT), H5Dclose);
  if (!id.ok()) return CannotOpen(path);
  dataset.reset(new Hdf5Dataset(shared_from_this(), path, id.Release()));
  if (Status status = dataset->Describe(); !status.ok()) return status;
  return dataset;
}

Result<std::vector<double>> Hdf5File::SmallDataset(const std::string& path) {
  constexpr std::uint64_t kMost = 8192;
  const Result<std::shared_ptr<Hdf5Dataset>> dataset = Dataset(path);
  if (!dataset.ok()) return dataset.status();
  const auto too_many = [&](const std::vector<std::uint64_t>& sizes) {
    std::uint64_t count = 1;
    for (const std::uint64_t size : sizes) {
      if (size > kMost) return true;
      count *= size;  // at most kMost * kMost
      if (count > kMost) return true;
    }
    return false;
  };
  // The library takes memory for whole chunks.
  if (too_many((*dataset)->size()) || too_many((*dataset)->chunk())) {
    return Status::ResourceExhausted(Named(path) + fmt::format(" has more than {} numbers", kMost));
  }
  std::uint64_t count = 1;
  for (const std::uint64_t size : (*dataset)->size()) count *= size;
  std::vector<double> numbers(count);
  const Hdf5Lock lock;
  if (H5Dread((*dataset)->id_, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, numbers.data()) < 0) {
    return Status::DataLoss(Named(path) + " cannot be read: " + Hdf5Complaint());
  }
  return numbers;
}

}  // namespace slabstream
