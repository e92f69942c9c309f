// First, what samples see becomes layers of pixels: the surfaces that a pixel sees, with the samples that see them. Then layers become
// fragments.
#include "worker/shapes/resolve_tile.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <tuple>
#include <utility>

#include "worker/shapes/key_plane.h"
#include "worker/shapes/surfaces.h"

namespace slabstream {
namespace {

struct Layer {
  std::uint32_t pixel = 0;
  float key = 0;  // mean of its samples, then that in the pixel's centre
  Element element = 0;
  std::uint32_t mask = 0;     // of samples
  std::uint32_t surface = 0;  // its number in Surfaces
};

class Resolving {
 public:
  Resolving(const ShapeScene& scene, const TileSamples& samples)
      : scene_(scene), samples_(samples), pixels_(samples.pixels()), count_(samples.count()), all_((1U << samples.count()) - 1) {}

  ShapeTile Resolve(const std::vector<ShapeHit>& hits) {
    FindLayers(hits);
    ShapeTile tile{.pixels = pixels_};
    if (layers_.empty()) return tile;
    FindSurfaces();
    const auto pixel_count = std::size_t(pixels_.pixel_count());
    tile.begin.reserve(pixel_count + 1);
    tile.fragments.reserve(layers_.size());
    tile.ends.assign(pixel_count, kRayGoesOn);
    for (std::size_t pixel = 0; pixel < pixel_count; ++pixel) {
      tile.begin.push_back(std::uint32_t(tile.fragments.size()));
      AddFragments(first_layer_[pixel], first_layer_[pixel + 1], tile);
      if (tile.fragments.size() > tile.begin.back() && tile.fragments.back().rgba[3] == 1) tile.ends[pixel] = tile.fragments.back().depth;
    }
    tile.begin.push_back(std::uint32_t(tile.fragments.size()));
    return tile;
  }

 private:
  // Less than FrameMap::MergedAt apart. Without divisions: depths of keys a and b differ by (a - b) / (a b w_per_depth), and w = -1 / a.
  bool Near(float key, float other) const {
    const FrameMap& map = scene_.map;
    const double a = double(key), b = double(other), distance = std::abs(a - b);
    if (!map.perspective()) return distance < std::max(map.merged_depth, map.merged_depth_of_pixel);
    return distance < map.w_per_depth * std::max(map.merged_depth * a * b, map.merged_depth_of_pixel * -b);
  }

  static float Samples(std::uint32_t mask) { return float((mask & 1) + (mask >> 1 & 1) + (mask >> 2 & 1) + (mask >> 3 & 1)); }

  // Neighbouring parts of a shape that are about as deep are one layer.
  void FindLayers(const std::vector<ShapeHit>& hits) {
    const auto pixel_count = std::uint32_t(pixels_.pixel_count());
    first_layer_.reserve(pixel_count + std::size_t{1});
    layers_.reserve(pixel_count + hits.size());
    auto hit = hits.begin();
    std::uint32_t pixel = 0;
    for (std::int32_t y = 0; y < pixels_.height(); ++y) {
      for (std::int32_t x = 0; x < pixels_.width(); ++x, ++pixel) {
        first_layer_.push_back(std::uint32_t(layers_.size()));
        AddOpaque(pixel, samples_.First(x, y));
        const std::size_t first = layers_.size();
        for (float last_key = 0; hit != hits.end() && hit->pixel == pixel; ++hit) {
          AddToLayers(first, {pixel, hit->key, hit->element, hit->mask}, last_key);
          last_key = hit->key;
        }
      }
    }
    first_layer_.push_back(std::uint32_t(layers_.size()));
  }
  // The least and the largest of four.
  template <class T>
  static std::pair<T, T> Extremes(const T* four) {
    const auto [a, b] = std::minmax(four[0], four[1]);
    const auto [c, d] = std::minmax(four[2], four[3]);
    return {std::min(a, c), std::max(b, d)};
  }
  void AddOpaque(std::uint32_t pixel, std::size_t at) {
    const float* const keys = samples_.keys() + at;
    const Element* const elements = samples_.elements() + at;
    if (count_ == 1) {
      if (elements[0] != kNoElement) layers_.push_back({pixel, keys[0], elements[0], 1});
      return;
    }
    const auto [first_element, last_element] = Extremes(elements);
    if (first_element == kNoElement) return;
    // Most pixels see one surface.
    const auto [nearest, farthest] = Extremes(keys);
    const SceneShape& shape = ShapeOf(first_element);
    if (first_element == last_element || (shape.Has(last_element >> 8) && Near(nearest, farthest))) {
      // The part that most samples see is likely to be that in the centre.
      const bool most = elements[1] == elements[2] || elements[1] == elements[3];
      const Element element = most ? elements[1] : elements[2] == elements[3] ? elements[2] : elements[0];
      layers_.push_back({pixel, 0.25F * ((keys[0] + keys[1]) + (keys[2] + keys[3])), element, all_});
      return;
    }
    // Samples, nearest first.
    std::array<int, kMostSamples> seen{};
    int count = 0;
    for (int s = 0; s < count_; ++s) {
      if (elements[s] == kNoElement) continue;
      int place = count++;
      for (; place > 0; --place) {
        const int other = seen[std::size_t(place - 1)];
        if (!(keys[s] < keys[other] || (keys[s] == keys[other] && elements[s] < elements[other]))) break;
        seen[std::size_t(place)] = other;
      }
      seen[std::size_t(place)] = s;
    }
    const std::size_t first = layers_.size();
    float last_key = 0;
    for (int i = 0; i < count; ++i) {
      const int s = seen[std::size_t(i)];
      AddToLayers(first, {pixel, keys[s], elements[s], 1U << s}, last_key);
      last_key = keys[s];
    }
  }
  // As a layer of its own, unless it belongs to the last one from `first` on.
  void AddToLayers(std::size_t first, Layer next, float last_key) {
    if (layers_.size() > first) {
      Layer& last = layers_.back();
      const SceneShape& shape = ShapeOf(next.element);
      if (last.element == next.element || (shape.Has(last.element >> 8) && Near(last_key, next.key))) {
        // Pieces of a line overlap where they are joined.
        if (shape.view.info.kind == ShapeKind::kLines) next.mask &= ~last.mask;
        if (next.mask == 0) return;
        if ((last.mask & next.mask) == 0) {
          const float samples = Samples(last.mask), more = Samples(next.mask);
          last.key = (last.key * samples + next.key * more) / (samples + more);
          last.mask |= next.mask;
          return;
        }
      }
    }
    layers_.push_back(next);
  }
  // Neighbours mostly see one shape.
  const SceneShape& ShapeOf(Element element) {
    if (latest_ == nullptr || !latest_->Has(element >> 8)) latest_ = &scene_.ShapeOf(element >> 8);
    return *latest_;
  }

  // Surfaces are by shape, and those of a shape by pixel.
  void FindSurfaces() {
    const std::size_t lights = scene_.light ? std::max(scene_.shading.lights.size(), std::size_t{1}) : 0;
    // Those of a shape begin a vector.
    std::vector<std::uint32_t> ends(scene_.shapes.size() + 1);
    const auto number = [&](const Layer& layer) { return std::size_t(&ShapeOf(layer.element) - scene_.shapes.data()); };
    for (const Layer& layer : layers_) ++ends[number(layer) + 1];
    for (std::size_t i = 1; i < ends.size(); ++i) ends[i] = ends[i - 1] + Surfaces::WholeVectors(ends[i]);
    const std::uint32_t count = ends.back();
    surfaces_.Resize(count, lights);
    const std::vector<std::uint32_t> begins = ends;
    for (Layer& layer : layers_) {
      layer.surface = ends[number(layer)]++;
      const std::uint32_t width = std::uint32_t(pixels_.width()), x = layer.pixel % width, y = layer.pixel / width;
      surfaces_.column[layer.surface] = float(x) + 0.5F;
      surfaces_.row[layer.surface] = float(y) + 0.5F;
      const SceneShape& shape = ShapeOf(layer.element);
      if (shape.view.info.kind == ShapeKind::kMesh) {
        PlaceOnTriangle(shape, pixels_.x_begin + x + 0.5, pixels_.y_begin + y + 0.5, layer);
      } else {
        PlaceOnCapsule(shape, pixels_.x_begin + x + 0.5, pixels_.y_begin + y + 0.5, layer);
      }
      surfaces_.key[layer.surface] = layer.key;
    }
    for (std::size_t i = 0; i < scene_.shapes.size(); ++i) {
      const SceneShape& shape = scene_.shapes[i];
      if (shape.view.info.kind == ShapeKind::kMesh) {
        WeighTriangles(shape, pixels_.x_begin, pixels_.y_begin, begins[i], ends[i], surfaces_);
      }
      if (!shape.look.unlit) ColorSurfaces(shape, begins[i], ends[i], surfaces_);
    }
    FindDepths(scene_.map, count, surfaces_);
    if (lights > 0) FindShares(scene_, pixels_.x_begin, pixels_.y_begin, count, surfaces_);
    LightSurfaces(scene_.shading, -scene_.camera.view_direction, lights > 0, count, surfaces_);
    for (std::size_t i = 0; i < scene_.shapes.size(); ++i) {
      if (scene_.shapes[i].look.unlit) ColorSurfaces(scene_.shapes[i], begins[i], ends[i], surfaces_);
    }
  }

  void PlaceOnTriangle(const SceneShape& shape, double column, double row, Layer& layer) {
    const std::uint32_t i = layer.surface;
    const ShapePiece& piece = shape.view.pieces[(layer.element >> 8) - shape.first_piece];
    const std::uint8_t* const local = shape.view.corners.data() + 3 * (std::size_t{piece.first_part} + (layer.element & 255));
    for (std::size_t c = 0; c < 3; ++c) surfaces_.vertex[c][i] = std::int32_t(piece.first_vertex + local[c]);
    // The samples lie evenly round the centre, so the mean of all is the plane there.
    if (layer.mask == all_) return;
    std::array<Corner, 3> corners;
    for (std::size_t c = 0; c < 3; ++c) corners[c] = CornerOf(scene_, shape, std::size_t{piece.first_vertex} + local[c], column, row);
    const auto key = float(PlaneOf(scene_, corners[0], corners[1], corners[2]).plane.c);
    if (Near(layer.key, key)) layer.key = key;
  }

  void PlaceOnCapsule(const SceneShape& shape, double column, double row, Layer& layer) {
    const std::uint32_t i = layer.surface;
    const ShapePiece& piece = shape.view.pieces[(layer.element >> 8) - shape.first_piece];
    const std::uint32_t part = layer.element & 255;
    const Capsule capsule = shape.CapsuleOf(scene_.camera, piece, part);
    ShapeScene::CapsuleHit hit = scene_.HitOn(capsule, column, row);
    if (hit.seen) {
      layer.key = float(hit.key);
    } else {
      const SamplePoint& point = samples_.points()[std::size_t(std::countr_zero(layer.mask))];
      hit = scene_.HitOn(capsule, column - 0.5 + double(point.x) / kSteps, row - 0.5 + double(point.y) / kSteps);
    }
    const double length = Length(hit.normal);
    for (std::size_t axis = 0; axis < 3; ++axis) surfaces_.normal[axis][i] = length > 0 ? float(hit.normal[int(axis)] / length) : 0;
    const std::array<std::uint32_t, 2> ends = shape.EndsOf(piece, part);
    surfaces_.vertex[0][i] = surfaces_.vertex[2][i] = std::int32_t(ends[0]);
    surfaces_.vertex[1][i] = std::int32_t(ends[1]);
    surfaces_.weight[0][i] = float(1 - hit.s);
    surfaces_.weight[1][i] = float(hit.s);
    surfaces_.weight[2][i] = 0;
  }

  // Of the layers [begin, end) of a pixel. A fragment takes from each sample's light what its layers there take.
  void AddFragments(std::uint32_t begin, std::uint32_t end, ShapeTile& tile) {
    if (begin == end) return;
    if (end == begin + 1) {
      const Layer& layer = layers_[begin];
      const float opacity = surfaces_.opacity[layer.surface];
      const float alpha = layer.mask == all_ ? opacity : opacity * Samples(layer.mask) / float(count_);
      if (!(alpha > 0)) return;
      const auto channel = [&](std::size_t c) { return alpha * surfaces_.color[c][layer.surface]; };
      tile.fragments.push_back({surfaces_.depth[layer.surface], {channel(0), channel(1), channel(2), alpha}});
      return;
    }
    order_.clear();
    for (std::uint32_t i = begin; i < end; ++i) order_.push_back(i);
    std::ranges::sort(order_, {}, [this](std::uint32_t i) { return std::tuple(layers_[i].key, layers_[i].element, layers_[i].mask); });
    std::array<float, kMostSamples> left;  // of each sample's light
    left.fill(1);
    const auto sum = [&] {
      float all = 0;
      for (int s = 0; s < count_; ++s) all += left[std::size_t(s)];
      return all;
    };
    const std::size_t first = tile.fragments.size();
    for (std::size_t i = 0; i < order_.size();) {
      const float before = sum();
      if (before == 0) return;
      std::array<float, 3> color{};
      float weights = 0, depths = 0;
      // Opaque layers that are about as deep are one fragment, and so are all that are too many.
      for (bool more = true; more; ++i) {
        const Layer& layer = layers_[order_[i]];
        const float opacity = surfaces_.opacity[layer.surface];
        float weight = 0;
        for (int s = 0; s < count_; ++s) {
          if ((layer.mask >> s & 1) == 0) continue;
          weight += left[std::size_t(s)] * opacity;
          left[std::size_t(s)] *= 1 - opacity;
        }
        for (std::size_t c = 0; c < 3; ++c) color[c] += weight * surfaces_.color[c][layer.surface];
        depths += weight * surfaces_.depth[layer.surface];
        weights += weight;
        more = i + 1 < order_.size();
        if (more && tile.fragments.size() - first + 1 < kMostShapeFragments) {
          const Layer& next = layers_[order_[i + 1]];
          more = opacity == 1 && surfaces_.opacity[next.surface] == 1 && Near(layer.key, next.key);
        }
      }
      if (!(weights > 0)) continue;
      const float after = sum();
      const float alpha = after == 0 ? 1 : std::min((before - after) / before, 1.0F);
      if (!(alpha > 0)) continue;
      const auto channel = [&](std::size_t c) { return std::min(color[c] / before, alpha); };
      tile.fragments.push_back({depths / weights, {channel(0), channel(1), channel(2), alpha}});
    }
  }

  const ShapeScene& scene_;
  const TileSamples& samples_;
  const PixelBounds pixels_;
  const int count_;          // of samples a pixel
  const std::uint32_t all_;  // bits of all samples
  std::vector<Layer> layers_;
  std::vector<std::uint32_t> first_layer_;  // by pixel
  std::vector<std::uint32_t> order_;
  Surfaces surfaces_;
  const SceneShape* latest_ = nullptr;
};

}  // namespace

ShapeTile ResolveTile(const ShapeScene& scene, const TileSamples& samples, const std::vector<ShapeHit>& hits) {
  return Resolving(scene, samples).Resolve(hits);
}

}  // namespace slabstream
