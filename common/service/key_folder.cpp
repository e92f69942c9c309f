#include "common/service/key_folder.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <ctime>

#include "common/base/printable.h"
#include "common/files/files.h"
#include "common/json/json.h"
#include "common/wire/any_message.h"

namespace slabstream {
namespace {

constexpr std::size_t kMaxFileBytes = std::size_t{1} << 20;

std::string Now() { return fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr))); }

}  // namespace

bool IsHolderName(std::string_view name) {
  return !name.empty() && name.size() <= kMaxHolderNameBytes && name.front() != '.' && name.front() != ' ' && name.back() != ' ' &&
         name.find('/') == std::string_view::npos && Printable(std::string(name)) == name;
}

Result<KeyFolder> KeyFolder::Open(const std::string& path) {
  if (::mkdir(path.c_str(), 0700) != 0 && errno != EEXIST)
    return Status::Unavailable(fmt::format("cannot make the folder of keys '{}': {}", path, std::strerror(errno)));
  struct stat info {};
  if (::stat(path.c_str(), &info) != 0 || !S_ISDIR(info.st_mode) || info.st_uid != ::getuid() || (info.st_mode & 077) != 0)
    return Status::Unavailable(fmt::format("the folder of keys '{}' must be a folder of this user alone (chmod 700)", path));
  KeyFolder folder(path);
  const Status read = folder.Read();
  if (read.code() == StatusCode::kNotFound) {
    folder.server_ = MakeKeyPair();
    if (Status saved = folder.Save(); !saved.ok()) return saved;
  } else if (!read.ok()) {
    return read;
  }
  return folder;
}

Status KeyFolder::Read() {
  const std::string path = path_ + "/keys.json";
  const Result<std::string> text = ReadPrivateTextFile(path, kMaxFileBytes);
  if (!text.ok()) return text.status();
  const Result<Json> json = Json::Parse(*text);
  const auto damaged = [&] { return Status::InvalidArgument(fmt::format("'{}' is damaged; delete it to make new keys", path)); };
  if (!json.ok()) return damaged();
  try {
    server_.secret_key = json->at("server_secret_key").text();
    const std::optional<std::string> public_key = PublicKeyOf(server_.secret_key);
    if (!public_key) return Status::InvalidArgument(fmt::format("'{}': server_secret_key is no key", path));
    server_.public_key = *public_key;
    for (const Json& entry : json->at("admitted")) {
      const std::optional<Role> role = FindRole(entry.at("role").text());
      AdmittedKey key{entry.at("public_key").text(), role.value_or(Role::kClient), entry.at("made").text(),
                      entry.value("name", std::string())};
      if (!role || !IsKey(key.public_key))
        return Status::InvalidArgument(fmt::format("'{}': an admitted key has no role or is none", path));
      admitted_.push_back(std::move(key));
    }
  } catch (const std::runtime_error&) {
    return damaged();
  }
  return Status::Ok();
}

Status KeyFolder::Save() const {
  Json json = {{"server_secret_key", server_.secret_key}, {"admitted", Json::array()}};
  for (const AdmittedKey& key : admitted_) {
    Json entry = {{"public_key", key.public_key}, {"role", NameOf(key.role)}, {"made", key.made}};
    if (!key.name.empty()) entry["name"] = key.name;
    json["admitted"].push_back(std::move(entry));
  }
  return WritePrivateTextFile(path_ + "/keys.json", json.dump(2) + "\n");
}

std::string KeyFolder::FileOf(Role role) const { return fmt::format("{}/{}.json", path_, NameOf(role)); }

std::set<std::string> KeyFolder::KeysOf(const std::set<Role>& roles) const {
  std::set<std::string> keys;
  for (const AdmittedKey& key : admitted_) {
    if (roles.contains(key.role)) keys.insert(key.public_key);
  }
  return keys;
}

const AdmittedKey* KeyFolder::Find(const std::string& public_key) const {
  const auto found = std::ranges::find(admitted_, public_key, &AdmittedKey::public_key);
  return found == admitted_.end() ? nullptr : &*found;
}

Status KeyFolder::WriteFile(Role role, const KeyPair& own, const std::string& made) const {
  return WriteServiceFile(FileOf(role), {.role = role,
                                         .endpoint = IsOfClients(role) ? service_.client_endpoint : service_.worker_endpoint,
                                         .server_key = server_.public_key,
                                         .own = own,
                                         .epoch = service_.epoch,
                                         .wire_version = kWireVersion,
                                         .made = made});
}

Status KeyFolder::Publish(const Service& service) {
  service_ = service;
  for (const Role role : kRoles) {
    const Result<ServiceFile> file = ReadServiceFile(FileOf(role));
    const AdmittedKey* const known = file.ok() ? Find(file->own.public_key) : nullptr;
    if (known != nullptr && known->role == role) {
      if (Status written = WriteFile(role, file->own, known->made); !written.ok()) return written;
    } else if (const Result<AdmittedKey> made = Rotate(role); !made.ok()) {
      return made.status();
    }
  }
  return Status::Ok();
}

Result<AdmittedKey> KeyFolder::Rotate(Role role) {
  const KeyPair pair = MakeKeyPair();
  AdmittedKey key{pair.public_key, role, Now()};
  admitted_.push_back(key);
  Status done = Save();
  if (done.ok()) done = WriteFile(role, pair, key.made);
  if (done.ok()) return key;
  admitted_.pop_back();
  return done;
}

Result<AdmittedKey> KeyFolder::Issue(const std::string& public_key, Role role, const std::string& name) {
  if (!IsOfClients(role))
    return Status::InvalidArgument("a key with a name is of role client or admin; others share the file of their role");
  if (!IsHolderName(name)) {
    return Status::InvalidArgument(
        fmt::format("name '{}' must be 1 to {} bytes of printable text that can name a file: no '/', no '.' at the beginning",
                    Printable(name), kMaxHolderNameBytes));
  }
  if (const auto found = std::ranges::find(admitted_, name, &AdmittedKey::name); found != admitted_.end()) {
    return Status::InvalidArgument(
        fmt::format("'{}' has the key {} already: revoke that one, or choose another name", name, IdOfKey(found->public_key)));
  }
  if (!IsKey(public_key) || Find(public_key) != nullptr) return Status::InvalidArgument("the key is none, or is admitted already");
  admitted_.push_back({public_key, role, Now(), name});
  if (Status saved = Save(); !saved.ok()) {
    admitted_.pop_back();
    return saved;
  }
  return admitted_.back();
}

Result<std::string> KeyFolder::Revoke(const std::string& key) {
  const auto is_it = [&](const AdmittedKey& admitted) {
    return admitted.public_key == key || IdOfKey(admitted.public_key) == key || (!key.empty() && admitted.name == key);
  };
  const auto found = std::ranges::find_if(admitted_, is_it);
  if (found == admitted_.end())
    return Status::NotFound(fmt::format("no key '{}' is admitted; `slabstream keys list` prints the admitted keys", key));
  std::string public_key = found->public_key;
  if (std::ranges::count_if(admitted_, is_it) > 1)
    return Status::InvalidArgument(fmt::format("'{}' is the id or the name of several keys: give one of the public keys in full", key));
  admitted_.erase(found);
  if (Status saved = Save(); !saved.ok()) return saved;
  return public_key;
}

}  // namespace slabstream
