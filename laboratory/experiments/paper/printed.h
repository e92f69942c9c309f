// The numbers printed by Yagel and Machiraju (Data-Parallel Volume Rendering Algorithms, tables 1 to 6 and section 4.1), as data: seconds
// on an IBM Power Visualization System with up to 30 Intel i860, class-I spheres, N = 200 unless stated otherwise. Their figures 7 to 11
// are curves without numbers; what the text says about them is here too.
#pragma once

#include <array>
#include <string_view>

namespace slabstream::printed {

inline constexpr int kSize = 200;  // N
inline constexpr std::array<int, 6> kWorkers = {5, 10, 15, 20, 25, 30};

// Table 1: the transform.
inline constexpr std::array<double, 6> kTransformProduct = {2.16, 1.11, 0.74, 0.57, 0.48, 0.38};
inline constexpr std::array<double, 6> kTransformIncrements = {0.36, 0.19, 0.14, 0.10, 0.09, 0.08};

// Section 4.1: 15 workers, incremental.
inline constexpr std::array<int, 2> kCubicSizes = {150, 300};
inline constexpr std::array<double, 2> kCubicSeconds = {5.97e-3, 43.21e-3};

// Table 2: frame times of splatting.
inline constexpr std::array<double, 6> kCentralized = {16.21, 9.51, 7.78, 7.43, 7.50, 7.69};
inline constexpr std::array<double, 6> kHierarchical = {15.92, 8.44, 5.92, 4.96, 4.20, 3.56};

// Tables 3 and 4: seconds a unit, upper bounds; for Eq. 21 (splatting) and Eq. 25 (Z-buffer).
struct Constant {
  std::string_view symbol;
  double seconds;
};
inline constexpr std::array<Constant, 5> kSplattingConstants = {
    {{"ct", 13e-6}, {"csh", 128e-6}, {"csp", 258e-6}, {"ccp", 61e-6}, {"cco", 60e-6}}};
inline constexpr std::array<Constant, 4> kZBufferConstants = {{{"ct", 13e-6}, {"cz", 52e-6}, {"csh", 2e-6}, {"cco", 43e-6}}};

// Tables 5 and 6: seconds of a frame, and the share of each stage in per cent.
inline constexpr std::array<int, 7> kStageWorkers = {1, 5, 10, 15, 20, 25, 30};
inline constexpr std::array<double, 7> kSplattingSeconds = {72.89, 15.90, 8.43, 5.91, 4.96, 4.19, 3.55};
// By stage: transform, shade, splat, composite, combine.
inline constexpr std::array<std::array<double, 7>, 5> kSplattingShares = {{{2, 2, 2, 2, 2, 2, 2},
                                                                           {22, 24, 22, 21, 17, 24, 24},
                                                                           {44, 34, 33, 32, 31, 20, 26},
                                                                           {32, 31, 31, 29, 27, 31, 26},
                                                                           {0, 9, 12, 18, 23, 23, 22}}};
inline constexpr std::array<double, 7> kZBufferSeconds = {8.46, 2.05, 1.42, 1.19, 1.15, 1.07, 1.38};
// By stage: transform, Z-buffer, shade, combine.
inline constexpr std::array<std::array<double, 7>, 4> kZBufferShares = {
    {{20, 18, 14, 11, 9, 8, 6}, {78, 61, 44, 31, 24, 21, 12}, {2, 7, 10, 13, 13, 14, 11}, {0, 14, 32, 45, 54, 57, 72}}};

}  // namespace slabstream::printed
