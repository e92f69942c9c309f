// Files by which programs of one service find each other: service files, the folder of keys, and what `up` records.
//
// input: u8 kind, the file
#include <sys/stat.h>

#include <array>
#include <cstdlib>

#include "client/service/service_state.h"
#include "common/files/files.h"
#include "common/service/key_folder.h"
#include "tests/fuzz/decoders.h"
#include "tests/support/temporary_directory.h"

namespace slabstream {
namespace {

constexpr char kEndpoint[] = "tcp://127.0.0.1:7420";

const TemporaryDirectory& Folder() {
  static const TemporaryDirectory folder(PlaceOfFuzzFiles());
  return folder;
}

bool DecodeServiceFileAt(const std::string& path) {
  const Result<ServiceFile> file = ReadServiceFile(path);
  if (!file.ok()) {
    CheckRefusal(file.status());
    return false;
  }
  const std::string copy = Folder() / "copy.json";
  CHECK(WriteServiceFile(copy, *file).ok());
  const Result<ServiceFile> again = ReadServiceFile(copy);
  CHECK(again.ok()) << again.status().message();
  CHECK(*again == *file);
  return true;
}

bool DecodeKeyFolder(const std::string& folder) {
  Result<KeyFolder> keys = KeyFolder::Open(folder);
  if (!keys.ok()) {
    CheckRefusal(keys.status());
    return false;
  }
  const std::vector<AdmittedKey> admitted = keys->admitted();
  CHECK(keys->Publish({kEndpoint, kEndpoint, 1}).ok());
  for (const Role role : kRoles) CHECK(ReadServiceFile(folder + "/" + std::string(NameOf(role)) + ".json").ok());
  const Result<KeyFolder> again = KeyFolder::Open(folder);
  CHECK(again.ok()) << again.status().message();
  CHECK(again->server().secret_key == keys->server().secret_key);
  CHECK(again->admitted() == keys->admitted());
  CHECK(admitted.size() <= again->admitted().size());
  return true;
}

// Records name processes that have ended, so nothing is found; what matters is that looking ends well.
bool DecodeState(const std::string& runtime) {
  CHECK_EQ(::setenv("XDG_RUNTIME_DIR", runtime.c_str(), 1), 0);
  (void)FindState(kEndpoint);
  (void)FindState("");
  return true;
}

}  // namespace

bool DecodeServiceFile(std::span<const std::byte> bytes) {
  FuzzInput input(bytes);
  const int kind = input.Take<std::uint8_t>() % 3;
  const std::string text(input.Text());
  if (kind == 0) {
    const std::string path = Folder() / "service.json";
    CHECK(WritePrivateTextFile(path, text).ok());
    return DecodeServiceFileAt(path);
  }
  const std::string folder = Folder() / (kind == 1 ? "keys" : "slabstream");
  std::filesystem::remove_all(folder);
  CHECK_EQ(::mkdir(folder.c_str(), 0700), 0);
  if (kind == 1) {
    CHECK(WritePrivateTextFile(folder + "/keys.json", text).ok());
    return DecodeKeyFolder(folder);
  }
  CHECK(WriteTextFile(folder + "/tcp___127.0.0.1_7420.json", text).ok());
  return DecodeState(Folder().path());
}

std::vector<FuzzBytes> ServiceFileSeeds() {
  const TemporaryDirectory parent(PlaceOfFuzzFiles());
  const std::string folder = parent / "keys";
  KeyFolder keys = KeyFolder::Open(folder).value();
  CHECK(keys.Publish({kEndpoint, "tcp://[::1]:7421", 12345}).ok());
  std::vector<FuzzBytes> seeds;
  for (const Role role : kRoles) {
    const std::string file = ReadPrivateTextFile(folder + "/" + std::string(NameOf(role)) + ".json", 1 << 16).value();
    seeds.push_back(FuzzSeed().Put(std::uint8_t{0}).Put(file).bytes());
  }
  seeds.push_back(FuzzSeed().Put(std::uint8_t{1}).Put(ReadPrivateTextFile(folder + "/keys.json", 1 << 16).value()).bytes());
  const char* const state = R"({"endpoint": "tcp://127.0.0.1:7420", "started_unix": 1, "coordinator": 2147483000, "workers": [2147483001],
    "log_directory": "/nowhere", "keys_folder": ""})";
  seeds.push_back(FuzzSeed().Put(std::uint8_t{2}).Put(std::string_view(state)).bytes());
  return seeds;
}

}  // namespace slabstream
