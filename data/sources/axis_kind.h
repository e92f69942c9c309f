// What an axis of an array stands for, by the name that writers give it.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

namespace slabstream {

enum class AxisKind : std::uint8_t { kX, kY, kZ, kTime, kChannel, kOther };

constexpr bool IsSpace(AxisKind kind) { return kind == AxisKind::kX || kind == AxisKind::kY || kind == AxisKind::kZ; }

// In upper or lower case: x, y, z, t and c, and the names of microscopy and climate for them, such as depth, lat or frame. kOther: none of
// these.
AxisKind AxisNamed(std::string_view name);
// "z", "time", "channel", "none".
std::string_view NameOf(AxisKind kind);

// With these attributes of CF arrays name others that only say where elements lie.
inline constexpr std::array<std::string_view, 3> kNamingAttributes = {"bounds", "climatology", "coordinates"};

}  // namespace slabstream
