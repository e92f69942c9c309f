#include "common/mesh/mesh_part.h"

#include <algorithm>
#include <bit>
#include <utility>

#include "common/mesh/point_gradients.h"

namespace slabstream {
namespace {

// Some points of a mesh, numbered anew in their order.
class KeptPoints {
 public:
  explicit KeptPoints(std::size_t points) : words_((points + 63) / 64) {}

  void Keep(PointNumber point) { words_[point / 64].kept |= std::uint64_t{1} << point % 64; }
  // After the last call of Keep. How many there are.
  std::size_t Count() {
    std::size_t count = 0;
    for (Word& word : words_) {
      word.before = PointNumber(count);
      count += std::size_t(std::popcount(word.kept));
    }
    return count;
  }
  // After Count.
  PointNumber NumberOf(PointNumber point) const {
    const Word& word = words_[point / 64];
    return word.before + PointNumber(std::popcount(word.kept & ((std::uint64_t{1} << point % 64) - 1)));
  }
  // Calls function(old number) in their order.
  template <class Function>
  void Visit(Function&& function) const {
    for (std::size_t i = 0; i < words_.size(); ++i) {
      for (std::uint64_t kept = words_[i].kept; kept != 0; kept &= kept - 1) function(i * 64 + std::size_t(std::countr_zero(kept)));
    }
  }

 private:
  struct Word {  // of 64 points
    std::uint64_t kept = 0;
    PointNumber before = 0;  // kept in the words in front
  };
  std::vector<Word> words_;
};

}  // namespace

MeshCutter::MeshCutter(std::shared_ptr<const Mesh> mesh) : mesh_(std::move(mesh)), gradients_(PointGradients(*mesh_)), runs_(*mesh_) {}

Mesh MeshCutter::Cut(const Box& box) const {
  Mesh part;
  part.at = mesh_->at;
  if (box.empty()) return part;
  KeptPoints kept(mesh_->points.size());
  runs_.Visit(*mesh_, SpaceOf(box), [&](std::size_t cell, const CellBounds&) {
    const Tetrahedron& t = mesh_->tetrahedra[cell];
    for (const PointNumber point : t) kept.Keep(point);
    part.tetrahedra.push_back(t);
    if (part.at == ValuesAt::kCells) part.values.push_back(mesh_->values[cell]);
  });
  const std::size_t points = kept.Count();
  part.points.reserve(points);
  part.gradients.reserve(points);
  if (part.at == ValuesAt::kPoints) part.values.reserve(points);
  kept.Visit([&](std::size_t point) {
    part.points.push_back(mesh_->points[point]);
    part.gradients.push_back(gradients_[point]);
    if (part.at == ValuesAt::kPoints) part.values.push_back(mesh_->values[point]);
  });
  for (Tetrahedron& t : part.tetrahedra) std::ranges::transform(t, t.begin(), [&](PointNumber point) { return kept.NumberOf(point); });
  return part;
}

}  // namespace slabstream
