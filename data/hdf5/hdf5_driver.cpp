#include "data/hdf5/hdf5_driver.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <functional>
#include <limits>
#include <new>
#include <type_traits>

#include "common/files/file_descriptor.h"

namespace slabstream {
namespace {

constexpr haddr_t kMostAddress = std::numeric_limits<std::int64_t>::max();

struct OpenFile {
  H5FD_t library;  // first: the library's view
  int descriptor;
  haddr_t end_of_addresses, end_of_file;
  // What is read into this buffer is not read: its place goes here.
  const void* looked_for;
  std::optional<Hdf5Place> place;
};
static_assert(std::is_standard_layout_v<OpenFile>);

OpenFile& Ours(H5FD_t* file) { return *reinterpret_cast<OpenFile*>(file); }
const OpenFile& Ours(const H5FD_t* file) { return *reinterpret_cast<const OpenFile*>(file); }

H5FD_t* Open(const char*, unsigned flags, hid_t access, haddr_t) {
  const auto* const descriptor = static_cast<const int*>(H5Pget_driver_info(access));
  if (descriptor == nullptr || (flags & (H5F_ACC_RDWR | H5F_ACC_CREAT | H5F_ACC_TRUNC)) != 0) return nullptr;
  struct stat status {};
  FileDescriptor ours(::fcntl(*descriptor, F_DUPFD_CLOEXEC, 0));
  if (ours.number() < 0 || ::fstat(ours.number(), &status) != 0) return nullptr;
  auto* const file = new (std::nothrow) OpenFile{};
  if (file == nullptr) return nullptr;
  file->descriptor = ours.Release();
  file->end_of_file = haddr_t(status.st_size);
  return &file->library;
}

herr_t Close(H5FD_t* file) {
  (void)::close(Ours(file).descriptor);
  delete &Ours(file);
  return 0;
}

// Every opening is a file of its own.
int Compare(const H5FD_t* a, const H5FD_t* b) { return std::less<>()(a, b) ? -1 : a == b ? 0 : 1; }

herr_t Query(const H5FD_t*, unsigned long* flags) {
  if (flags != nullptr) *flags = 0;
  return 0;
}

haddr_t EndOfAddresses(const H5FD_t* file, H5FD_mem_t) { return Ours(file).end_of_addresses; }
herr_t SetEndOfAddresses(H5FD_t* file, H5FD_mem_t, haddr_t end) {
  Ours(file).end_of_addresses = end;
  return 0;
}
haddr_t EndOfFile(const H5FD_t* file, H5FD_mem_t) { return Ours(file).end_of_file; }

herr_t Handle(H5FD_t* file, hid_t, void** handle) {
  *handle = &Ours(file);
  return 0;
}

herr_t Read(H5FD_t* library, H5FD_mem_t, hid_t, haddr_t begin, std::size_t bytes, void* buffer) {
  OpenFile& file = Ours(library);
  if (begin > file.end_of_file || bytes > file.end_of_file - begin) return -1;
  if (buffer == file.looked_for) {
    file.place = Hdf5Place{begin, bytes};
    return 0;
  }
  return ReadBytesAt(file.descriptor, begin, {static_cast<std::byte*>(buffer), bytes}) == bytes ? 0 : -1;
}

herr_t Write(H5FD_t*, H5FD_mem_t, hid_t, haddr_t, std::size_t, const void*) { return -1; }

hid_t DriverId() {
  static const H5FD_class_t driver = [] {
    H5FD_class_t made{};
    made.name = "slabstream";
    made.maxaddr = kMostAddress;
    made.fc_degree = H5F_CLOSE_STRONG;
    made.fapl_size = sizeof(int);
    made.open = Open;
    made.close = Close;
    made.cmp = Compare;
    made.query = Query;
    made.get_eoa = EndOfAddresses;
    made.set_eoa = SetEndOfAddresses;
    made.get_eof = EndOfFile;
    made.get_handle = Handle;
    made.read = Read;
    made.write = Write;
    for (H5FD_mem_t& kind : made.fl_map) kind = H5FD_MEM_DEFAULT;
    return made;
  }();
  static const hid_t id = H5FDregister(&driver);
  return id;
}

}  // namespace

bool UseHdf5Driver(hid_t access, int descriptor) { return DriverId() >= 0 && H5Pset_driver(access, DriverId(), &descriptor) >= 0; }

bool ReadHdf5Bytes(hid_t file, std::uint64_t begin, std::span<std::byte> out) {
  void* handle = nullptr;
  if (H5Fget_vfd_handle(file, H5P_DEFAULT, &handle) < 0 || handle == nullptr) return false;
  return Read(&static_cast<OpenFile*>(handle)->library, H5FD_MEM_DEFAULT, H5P_DEFAULT, begin, out.size(), out.data()) >= 0;
}

std::optional<Hdf5Place> FindHdf5Chunk(hid_t file, hid_t dataset, const hsize_t* offset, std::uint32_t& left_out) {
  void* handle = nullptr;
  if (H5Fget_vfd_handle(file, H5P_DEFAULT, &handle) < 0 || handle == nullptr) return std::nullopt;
  auto& open = *static_cast<OpenFile*>(handle);
  std::byte never_filled{};
  open.looked_for = &never_filled;
  open.place.reset();
  const herr_t status = H5Dread_chunk(dataset, H5P_DEFAULT, offset, &left_out, &never_filled);
  open.looked_for = nullptr;
  return status < 0 ? std::nullopt : open.place;
}

}  // namespace slabstream
