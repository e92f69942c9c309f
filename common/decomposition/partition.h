// Partition: a kd-tree whose leaves are half-open boxes that tile the volume. It says where the boxes are; a Layout
// (common/planning/layout.h) says who owns them.
//
// Leaves are numbered by a BoxId. For slabs the ids ascend along the axis.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/view/camera.h"
#include "common/volume/box.h"

namespace slabstream {

using BoxId = std::uint32_t;

class Partition {
 public:
  // A node of the kd-tree: a leaf (box), or a plane `axis = position` (position is the first index of the upper side) with two children.
  struct Node {
    bool leaf = true;
    Axis axis = Axis::kX;
    std::int32_t position = 0;
    std::uint32_t lower = 0, upper = 0;  // node numbers
    BoxId box = 0;
    friend bool operator==(const Node&, const Node&) = default;
  };

  Partition() = default;
  // `nodes[0]` is the root. CHECKs that the leaves tile `bounds`.
  Partition(const Box& bounds, std::vector<Node> nodes);

  // The same partition of a volume that is cut in blocks: this one counts blocks of `block` voxels, and `bounds` holds as many, the last
  // ones cut off. Planes lie `before` voxels before the borders of blocks: then the box below a plane, with a halo as thick, touches no
  // block beyond the border, and only the box above it touches blocks on both sides. Along axes whose blocks are not thicker than twice
  // that, they lie at the borders.
  Partition OfBlocks(const Index3& block, const Box& bounds, std::int32_t before) const;

  const Box& bounds() const { return bounds_; }
  std::span<const Box> boxes() const { return boxes_; }  // by BoxId
  std::span<const Node> nodes() const { return nodes_; }
  friend bool operator==(const Partition&, const Partition&) = default;

 private:
  Box bounds_;
  std::vector<Node> nodes_;
  std::vector<Box> boxes_;
};

// Boxes nearest first: no ray of the camera enters a later box before an earlier one. One traversal of the tree: at each plane the eye's
// side comes first; an orthographic eye lies at infinity against the view direction. Where the eye lies in the plane itself, or the rays
// are parallel to it, no ray crosses from one side to the other, and the lower side comes first. `stretch`: of the volume.
std::vector<BoxId> VisibilityOrder(const Partition& partition, const Camera& camera, const Stretch& stretch = {});

// Two boxes with a face, an edge or a corner in common.
struct TouchingBoxes {
  BoxId first = 0, second = 0;  // first < second
  friend bool operator==(const TouchingBoxes&, const TouchingBoxes&) = default;
};
// All of them, each once, by ascending ids.
std::vector<TouchingBoxes> FindTouching(const Partition& partition);

// Whether a ray of the camera may pass from one of two boxes that touch into the other, and out of which. Since boxes tile the volume, an
// order that heeds all boxes that touch heeds all boxes.
enum class Passage : std::uint8_t { kNone, kFromFirst, kFromSecond };
Passage PassageBetween(const Box& first, const Box& second, const Camera& camera, const Stretch& stretch = {});

}  // namespace slabstream
