// Roles: what whoever holds a key may do.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

namespace slabstream {

enum class Role : std::uint8_t {
  kClient = 1,  // ask for pictures and for the service's status
  kWorker = 2,  // take voxels and render
  kAdmin = 3,   // what clients may, end the service, and change its keys
  kOwner = 4,   // give voxels that it holds, and nothing else
};
inline constexpr std::array<Role, 4> kRoles = {Role::kClient, Role::kWorker, Role::kAdmin, Role::kOwner};

// Whether it uses the client plane; others use the control plane.
constexpr bool IsOfClients(Role role) { return role == Role::kClient || role == Role::kAdmin; }

std::string_view NameOf(Role role);
std::optional<Role> FindRole(std::string_view name);

}  // namespace slabstream
