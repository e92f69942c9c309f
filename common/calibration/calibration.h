// All constants that were fitted to measurements: what the cost estimator, the choice of a policy and simulated machines assume of a
// processor. Code that becomes faster needs new numbers here and nowhere else.
//
// Machine: two cores of an AMD EPYC (Zen 5). Unit: seconds of one thread, unless a comment says otherwise. Each group names the program
// that measures it on any machine; programs are in build/bin.
#pragma once

namespace slabstream::calibration {

// Splatting, at about a pixel a voxel (common/renderers/splat). Fitted to kd-trees and beams of 8 and 16 boxes of equal numbers of voxels
// and of occupied voxels, over a class-I sphere, vessels, heptane, bonsai and an MR brain in views along x and along y. Root mean square of
// the relative error over 16 boxes, in brackets when fitted to the other four volumes: sphere 0.05 (0.05), vessels 0.05 (0.06), heptane
// 0.05 (0.05), bonsai 0.11 (0.12: its pot is denser than its median voxel), MR brain 0.07 (0.07).
//   balance_bench VOLUME --decomposition kd-tree --balance-by occupied
namespace splat {
inline constexpr double kBox = 39e-6;
inline constexpr double kSlice = 1e-6;       // a slice of a box
inline constexpr double kRow = 49e-9;        // a row of samples, in each slice, if it is not empty
inline constexpr double kSegment = 7.5e-9;   // a segment of a row, a cell long, if it is not empty
inline constexpr double kRun = 16e-9;        // a run of such segments
inline constexpr double kOctet = 18e-9;      // an octet of voxels that are shaded
inline constexpr float kOpaqueDepth = 1.5F;  // mean optical depth of a segment's rays when the last one ends, as a multiple of that ray's
}  // namespace splat

// Z-buffer, at about a pixel a voxel (common/renderers/zbuffer). Fitted to boxes of vessels (root mean square of the relative error 0.19)
// and heptane (0.27).
//   balance_bench VOLUME --renderer zbuffer --decomposition kd-tree --balance-by occupied
namespace zbuffer {
inline constexpr double kBox = 1.5e-6;
inline constexpr double kSurfaceCell = 230e-9;  // a cell through which a surface passes
inline constexpr double kPixel = 1.5e-9;        // a pixel of the image
}  // namespace zbuffer

// Ray casting (common/renderers/raycast). Measured with the two spheres of 256 voxels a side that `slabstream bench` renders.
//   balance_bench VOLUME --renderer raycast --decomposition kd-tree --balance-by occupied
namespace raycast {
inline constexpr double kBox = 30e-6;
inline constexpr double kPixel = 60e-9;   // a pixel that the box covers
inline constexpr double kSample = 11e-9;  // a sample that is shaded
}  // namespace raycast

// Multi-pass shears (common/renderers/shear).
//   balance_bench VOLUME --renderer shear --decomposition kd-tree --balance-by occupied
namespace shear {
inline constexpr double kBox = 50e-6;
inline constexpr double kResample = 4e-9;  // a voxel of a cell that is drawn, at a pixel a voxel
inline constexpr double kSample = 6e-9;    // a sample that is shaded
}  // namespace shear

// Projections of values (common/renderers/projection_kind.h).
//   balance_bench VOLUME --renderer mip --decomposition kd-tree --balance-by voxels
namespace projection {
inline constexpr double kBox = 30e-6;
inline constexpr double kSample = 4e-9;
}  // namespace projection

// Slicing of unstructured grids (common/renderers/slice). Measured with 187395 and 430000 tetrahedra at 512 x 512, at 1, 2 and 4 planes a
// voxel length: about 200 ns a tetrahedron, and 8 ns a sample.
namespace slice {
inline constexpr double kBox = 100e-6;
inline constexpr double kTetrahedron = 200e-9;
inline constexpr double kSample = 8e-9;
}  // namespace slice

// Work of a cell that holds anything, in occupied voxels that take as long: rows are composited in segments, however little of them is
// covered. Over five volumes and all decompositions (splatting).
//   balance_bench VOLUME
inline constexpr double kMacrocellWork = 512;

// A worker's combining thread, for each pixel that is not empty (CombiningCosts), if images travel in messages.
//   simulation_bench CASE  (laboratory/measure/calibrate.h)
namespace combining {
inline constexpr double kScan = 0.2e-9;     // searched for runs, empty or not
inline constexpr double kEncode = 1.5e-9;   // copied into a message
inline constexpr double kCombine = 1.5e-9;  // onto what is there, and checked
inline constexpr double kLocal = 1e-9;      // of one image of this worker onto another one
inline constexpr double kHidden = 0.1e-9;   // a pixel of the frame, searched for opaque tiles
}  // namespace combining

// Threads and processes of the service (MachineModel).
//   simulation_bench CASE  (laboratory/measure/calibrate.h; plan, message and client are estimates)
namespace service {
inline constexpr double kAwake = 25e-6, kAsleep = 60e-6, kDoze = 500e-6;  // WakeUps
// What the coordinator does for a plan, a message and a client.
inline constexpr double kPlan = 200e-6, kMessage = 5e-6, kClient = 50e-6;
// Processor time of a byte at each end: 16 MiB sealed and opened in 6.2 ms (combining_bench).
inline constexpr double kCipherByte = 0.19e-9;
inline constexpr double kCurveByte = 1.2e-9;  // processor time to encrypt and send, or receive and decrypt, a byte over CURVE
inline constexpr double kVoxelRate = 5e8;     // bytes a second of voxels that reach a new owner: an order of magnitude
}  // namespace service

}  // namespace slabstream::calibration
