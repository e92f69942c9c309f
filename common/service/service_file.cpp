#include "common/service/service_file.h"

#include <fmt/format.h>

#include <limits>

#include "common/base/printable.h"
#include "common/files/files.h"
#include "common/json/json.h"
#include "common/transport/endpoint.h"

namespace slabstream {
namespace {

constexpr std::size_t kMaxFileBytes = std::size_t{1} << 16;

// Reads the fields of one file. The first mistake stays.
class Reader {
 public:
  Reader(const std::string& path, const Json& json) : path_(path), json_(json) {}

  std::string Text(const char* field) {
    const Json* const found = json_.find(field);
    if (found != nullptr && found->is_string()) return found->text();
    Complain(field, "is missing or no text");
    return "";
  }
  template <class T>
  T Number(const char* field) {
    const Json* const found = json_.find(field);
    constexpr T kMost = std::numeric_limits<T>::max();
    if (found != nullptr && found->is_number_unsigned() && found->get<std::uint64_t>() <= kMost) return found->get<T>();
    Complain(field, fmt::format("is missing or no whole number in [0, {}]", kMost));
    return 0;
  }
  std::string Key(const char* field) {
    std::string key = Text(field);
    if (!IsKey(key)) Complain(field, "is no key");
    return key;
  }
  void Complain(const char* field, const std::string& what) {
    if (status_.ok()) status_ = Printable(Status::InvalidArgument(fmt::format("service file '{}': {} {}", path_, field, what)));
  }
  const Status& status() const { return status_; }

 private:
  const std::string& path_;
  const Json& json_;
  Status status_;
};

}  // namespace

Status WriteServiceFile(const std::string& path, const ServiceFile& file) {
  const Json json = {{"role", NameOf(file.role)},         {"endpoint", file.endpoint},
                     {"server_key", file.server_key},     {"public_key", file.own.public_key},
                     {"secret_key", file.own.secret_key}, {"epoch", file.epoch},
                     {"wire_version", file.wire_version}, {"made", file.made}};
  return WritePrivateTextFile(path, json.dump(2) + "\n");
}

Result<ServiceFile> ReadServiceFile(const std::string& path) {
  const Result<std::string> text = ReadPrivateTextFile(path, kMaxFileBytes);
  if (!text.ok()) return text.status();
  const Result<Json> json = Json::Parse(*text);
  if (!json.ok() || !json->is_object())
    return Status::InvalidArgument(fmt::format("'{}' is no service file: it is not one JSON object", path));
  Reader reader(path, *json);
  ServiceFile file;
  const std::optional<Role> role = FindRole(reader.Text("role"));
  if (!role) reader.Complain("role", "is not client, worker, admin or owner");
  file.role = role.value_or(Role::kClient);
  file.endpoint = reader.Text("endpoint");
  if (const auto endpoint = ParseEndpoint(file.endpoint, false); !endpoint.ok()) reader.Complain("endpoint", endpoint.status().message());
  file.server_key = reader.Key("server_key");
  file.own = {reader.Key("public_key"), reader.Key("secret_key")};
  if (PublicKeyOf(file.own.secret_key) != file.own.public_key) reader.Complain("secret_key", "does not belong to public_key");
  file.epoch = reader.Number<std::uint64_t>("epoch");
  file.wire_version = reader.Number<std::uint32_t>("wire_version");
  file.made = reader.Text("made");
  if (!reader.status().ok()) return reader.status();
  return file;
}

}  // namespace slabstream
