#include "data/hdf5/hdf5_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <set>
#include <utility>

#include "common/base/printable.h"
#include "common/files/file_descriptor.h"
#include "common/text/natural_order.h"
#include "data/hdf5/hdf5_driver.h"
#include "data/hdf5/hdf5_library.h"

namespace slabstream {
namespace {

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

// Of something that libhdf5 does not know because a later version of HDF5 has brought it: what to do; else "".
std::string NewerThanLibrary(const std::string& complaint) {
  if (complaint.find("version number") == std::string::npos) return "";
  return fmt::format(
      " is stored in a way that came after HDF5 {}.{}.{}, which reads it here (\"{}\"); it can be read if it is written for the library's "
      "versions earliest to v110 (libver)",
      H5_VERS_MAJOR, H5_VERS_MINOR, H5_VERS_RELEASE, complaint);
}

// Names of links in the order of the file, until there are more than `most`.
struct LinkList {
  std::vector<std::string> names;
  std::size_t most = 0;
};

herr_t AddLink(hid_t, const char* name, const H5L_info_t* link, void* data) {
  auto& links = *static_cast<LinkList*>(data);
  if (links.names.size() >= links.most) return 1;
  if (link->type == H5L_TYPE_HARD) links.names.emplace_back(name);
  return 0;
}

LinkList HardLinks(hid_t file, const std::string& group, std::size_t most) {
  LinkList links{{}, most};
  hsize_t at = 0;
  (void)H5Literate_by_name(file, group.c_str(), H5_INDEX_NAME, H5_ITER_NATIVE, &at, AddLink, &links, H5P_DEFAULT);
  return links;
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
  if (!id.ok()) {
    const std::string complaint = Hdf5Complaint(), newer = NewerThanLibrary(complaint);
    return Status::InvalidArgument(path + (newer.empty() ? ": not an HDF5 file, or damaged: " + complaint : newer));
  }
  return std::shared_ptr<Hdf5File>(new Hdf5File(path, id.Release()));
}

Hdf5File::~Hdf5File() {
  const Hdf5Lock lock;
  (void)H5Fclose(id_);
}

std::string Hdf5File::format() { return Text("/", "_NCProperties") ? "netCDF-4" : "HDF5"; }

bool Hdf5File::Has(const std::string& object) {
  const Hdf5Lock lock;
  H5O_info_t info{};
  return H5Oget_info_by_name2(id_, object.c_str(), &info, H5O_INFO_BASIC, H5P_DEFAULT) >= 0;
}

Result<std::vector<std::string>> Hdf5File::Names(const std::string& group) {
  const Hdf5Lock lock;
  LinkList links = HardLinks(id_, group, kMostNames + 1);
  if (links.names.size() > kMostNames) {
    return Status::ResourceExhausted(fmt::format("{}: group '{}' holds more than {} names", path(), Printable(group), kMostNames));
  }
  std::ranges::sort(links.names, {}, InNaturalOrder);
  return std::move(links.names);
}

Hdf5File::Found Hdf5File::Datasets(int axes) {
  const Hdf5Lock lock;
  Found found;
  std::vector<std::string> groups = {""};
  std::set<haddr_t> seen;  // an object may have several names, and a group may lie in itself
  while (!groups.empty()) {
    const std::string group = std::move(groups.back());
    groups.pop_back();
    for (const std::string& name : HardLinks(id_, group.empty() ? "/" : group, kMostNames).names) {
      std::string path = group + "/" + name;
      H5O_info_t info{};
      if (seen.size() + found.closed.size() >= kMostNames || path.size() > 4096) break;
      if (H5Oget_info_by_name2(id_, path.c_str(), &info, H5O_INFO_BASIC, H5P_DEFAULT) < 0) {
        found.closed.push_back(std::move(path));
        continue;
      }
      if (!seen.insert(info.addr).second) continue;
      if (info.type == H5O_TYPE_GROUP) groups.push_back(std::move(path));
      if (info.type != H5O_TYPE_DATASET) continue;
      const Hdf5Id dataset(H5Dopen2(id_, path.c_str(), H5P_DEFAULT), H5Dclose);
      const Hdf5Id space(dataset.ok() ? H5Dget_space(dataset.id()) : -1, H5Sclose);
      if (!space.ok()) {
        found.closed.push_back(std::move(path));
      } else if (H5Sget_simple_extent_ndims(space.id()) >= axes) {
        found.paths.push_back(std::move(path));
      }
    }
  }
  std::ranges::sort(found.paths, {}, InNaturalOrder);
  return found;
}

Status Hdf5File::CannotOpen(const std::string& dataset) const {
  const std::string complaint = Hdf5Complaint();
  const std::string outward = OutwardLink(id_, dataset);
  if (!outward.empty()) {
    return Status::InvalidArgument(Named(dataset) + " lies in another file: '" + Printable(outward) +
                                   "' is an external link, and those are not followed");
  }
  if (const std::string newer = NewerThanLibrary(complaint); !newer.empty()) return Status::InvalidArgument(Named(dataset) + newer);
  return Status::NotFound(Named(dataset) + " cannot be opened: " + complaint);
}

Result<std::shared_ptr<Hdf5Dataset>> Hdf5File::Dataset(const std::string& path) {
  std::shared_ptr<Hdf5Dataset> dataset;  // given back after the lock, which it takes
  const Hdf5Lock lock;
  Hdf5Id id(H5Dopen2(id_, path.c_str(), H5P_DEFAULT), H5Dclose);
  if (!id.ok()) return CannotOpen(path);
  dataset.reset(new Hdf5Dataset(shared_from_this(), path, id.Release()));
  if (Status status = dataset->Describe(); !status.ok()) return status;
  return dataset;
}

Result<DatasetFacts> Hdf5File::Describe(const std::string& dataset) {
  const Result<std::shared_ptr<Hdf5Dataset>> opened = Dataset(dataset);
  return opened.ok() ? Result<DatasetFacts>((*opened)->facts()) : opened.status();
}

Result<std::vector<double>> Hdf5File::SmallDataset(const std::string& path) {
  const Hdf5Lock lock;
  const Hdf5Id dataset(H5Dopen2(id_, path.c_str(), H5P_DEFAULT), H5Dclose);
  if (!dataset.ok()) return CannotOpen(path);
  const Hdf5Id creation(H5Dget_create_plist(dataset.id()), H5Pclose);
  const H5D_layout_t layout = H5Pget_layout(creation.id());
  if (layout < 0 || layout == H5D_VIRTUAL || H5Pget_external_count(creation.id()) != 0) {
    return Status::InvalidArgument(Named(path) + " has its numbers elsewhere, which are not read");
  }
  const Hdf5Id type(H5Dget_type(dataset.id()), H5Tclose), space(H5Dget_space(dataset.id()), H5Sclose);
  const H5T_class_t kind = H5Tget_class(type.id());
  if ((kind != H5T_INTEGER && kind != H5T_FLOAT) || !space.ok()) return Status::InvalidArgument(Named(path) + " holds no numbers");
  // The library takes memory for whole chunks.
  std::array<hsize_t, H5S_MAX_RANK> chunk{};
  const int axes = layout == H5D_CHUNKED ? H5Pget_chunk(creation.id(), int(chunk.size()), chunk.data()) : 0;
  hsize_t most = kMostSmallNumbers;
  for (int axis = 0; axis < axes; ++axis) most /= std::max<hsize_t>(1, chunk[std::size_t(axis)]);
  const hssize_t count = H5Sget_simple_extent_npoints(space.id());
  if (axes < 0 || count < 1 || std::uint64_t(count) > kMostSmallNumbers || most == 0) {
    return Status::ResourceExhausted(Named(path) + fmt::format(" has {} numbers, must have from 1 to {}", count, kMostSmallNumbers));
  }
  std::vector<double> numbers(static_cast<std::size_t>(count));
  if (H5Dread(dataset.id(), H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, numbers.data()) < 0) {
    return Status::DataLoss(Named(path) + " cannot be read: " + Hdf5Complaint());
  }
  return numbers;
}

}  // namespace slabstream
