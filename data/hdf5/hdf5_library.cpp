#include "data/hdf5/hdf5_library.h"

#include "common/base/printable.h"

namespace slabstream {
namespace {

std::mutex& LibraryMutex() {
  static auto* const mutex = new std::mutex;  // outlives every thread
  return *mutex;
}

void SetUp() {
  (void)H5dont_atexit();  // threads may still read when the process ends
  (void)H5open();
  (void)H5PLset_loading_state(0);
  (void)H5Lunregister(H5L_TYPE_EXTERNAL);
}

}  // namespace

Hdf5Lock::Hdf5Lock() : lock_(LibraryMutex()) {
  static std::once_flag once;
  std::call_once(once, SetUp);
  (void)H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);  // of this thread, if the library has a stack of errors for each
  (void)H5Eclear2(H5E_DEFAULT);
}

namespace {

// The first of the failures of which a call's failure is made.
struct FirstFailure {
  hid_t major = -1, minor = -1;
  std::string text;
};

FirstFailure FindFirstFailure() {
  FirstFailure first;
  const auto keep = [](unsigned number, const H5E_error2_t* error, void* data) -> herr_t {
    if (number == 0) *static_cast<FirstFailure*>(data) = {error->maj_num, error->min_num, error->desc == nullptr ? "" : error->desc};
    return 0;
  };
  (void)H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, keep, &first);
  return first;
}

}  // namespace

std::string Hdf5Complaint() {
  const std::string text = FindFirstFailure().text;
  return Printable(text.empty() ? "libhdf5 gives no reason" : text);
}

bool Hdf5FailedFirst(hid_t major, hid_t minor) {
  const FirstFailure first = FindFirstFailure();
  return first.major == major && first.minor == minor;
}

}  // namespace slabstream
