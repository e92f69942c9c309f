#include "common/keys/role.h"

namespace slabstream {

std::string_view NameOf(Role role) {
  switch (role) {
    case Role::kClient: return "client";
    case Role::kWorker: return "worker";
    case Role::kOwner: return "owner";
    case Role::kAdmin: break;
  }
  return "admin";
}

std::optional<Role> FindRole(std::string_view name) {
  for (const Role role : kRoles) {
    if (NameOf(role) == name) return role;
  }
  return std::nullopt;
}

}  // namespace slabstream
