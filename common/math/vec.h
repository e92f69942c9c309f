// Small fixed-size vectors: Vec3 (double, points and directions), Index3 (voxel indices), Axis. No I/O, no allocation.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace slabstream {

enum class Axis : std::uint8_t { kX = 0, kY = 1, kZ = 2 };
inline constexpr std::array<Axis, 3> kAxes = {Axis::kX, Axis::kY, Axis::kZ};
constexpr int Number(Axis axis) { return static_cast<int>(axis); }
constexpr char Letter(Axis axis) { return static_cast<char>('x' + Number(axis)); }

template <class T>
struct Vector3 {
  T x = 0, y = 0, z = 0;

  constexpr T operator[](int i) const { return i == 0 ? x : i == 1 ? y : z; }
  constexpr T& operator[](int i) { return i == 0 ? x : i == 1 ? y : z; }
  constexpr T operator[](Axis a) const { return (*this)[Number(a)]; }
  constexpr T& operator[](Axis a) { return (*this)[Number(a)]; }
  friend constexpr bool operator==(const Vector3&, const Vector3&) = default;
  friend constexpr auto operator<=>(const Vector3&, const Vector3&) = default;

  // By component. Quotients of integers are rounded towards 0.
  friend constexpr Vector3 operator+(const Vector3& a, const Vector3& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
  friend constexpr Vector3 operator-(const Vector3& a, const Vector3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
  friend constexpr Vector3 operator-(const Vector3& a) { return {-a.x, -a.y, -a.z}; }
  friend constexpr Vector3 operator*(T s, const Vector3& a) { return {s * a.x, s * a.y, s * a.z}; }
  friend constexpr Vector3 operator*(const Vector3& a, const Vector3& b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }
  friend constexpr Vector3 operator/(const Vector3& a, T s) { return {a.x / s, a.y / s, a.z / s}; }
  friend constexpr Vector3 operator/(const Vector3& a, const Vector3& b) { return {a.x / b.x, a.y / b.y, a.z / b.z}; }
};

using Vec3 = Vector3<double>;
constexpr double Dot(const Vec3& a, const Vec3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
constexpr Vec3 Cross(const Vec3& a, const Vec3& b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
inline double Length(const Vec3& a) { return std::sqrt(Dot(a, a)); }
inline Vec3 Normalized(const Vec3& a) { return (1.0 / Length(a)) * a; }
constexpr double Least(const Vec3& a) { return std::min({a.x, a.y, a.z}); }  // component
inline Vec3 Absolute(const Vec3& a) { return {std::abs(a.x), std::abs(a.y), std::abs(a.z)}; }

using Index3 = Vector3<std::int32_t>;
constexpr Index3 Min(const Index3& a, const Index3& b) { return {std::min(a.x, b.x), std::min(a.y, b.y), std::min(a.z, b.z)}; }
constexpr Index3 Max(const Index3& a, const Index3& b) { return {std::max(a.x, b.x), std::max(a.y, b.y), std::max(a.z, b.z)}; }
constexpr Index3 Uniform(std::int32_t s) { return {s, s, s}; }

// An array of size.x * size.y * size.z elements, x fastest: how many there are, and the number of the one at `at`, counted from 0.
constexpr std::size_t CountIn(const Index3& size) { return std::size_t(size.x) * std::size_t(size.y) * std::size_t(size.z); }
constexpr std::size_t NumberIn(const Index3& size, const Index3& at) {
  return (std::size_t(at.z) * std::size_t(size.y) + std::size_t(at.y)) * std::size_t(size.x) + std::size_t(at.x);
}
constexpr Index3 PlaceIn(const Index3& size, std::size_t number) {
  const auto x = std::size_t(size.x), y = std::size_t(size.y);
  return {std::int32_t(number % x), std::int32_t(number / x % y), std::int32_t(number / (x * y))};
}
// How many cubes of `side` along each axis cover `size`.
constexpr Index3 CubesOver(const Index3& size, std::int32_t side) { return (size + Uniform(side - 1)) / side; }

constexpr Vec3 ToVec3(const Index3& i) { return {double(i.x), double(i.y), double(i.z)}; }

}  // namespace slabstream
