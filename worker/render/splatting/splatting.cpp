#include "worker/render/splatting/splatting.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "worker/kernels/cull.h"
#include "worker/kernels/shade.h"
#include "worker/kernels/splat.h"
#include "worker/kernels/transform.h"
#include "worker/render/derived.h"
#include "worker/render/splatting/cell_piece.h"
#include "worker/render/splatting/footprints.h"
#include "worker/render/splatting/ownership.h"
#include "worker/render/splatting/sheet.h"
#include "worker/render/splatting/slice_projection.h"
#include "worker/render/stage_clock.h"

namespace slabstream {
namespace {

constexpr std::int32_t kCell = kFootprintCell;
constexpr double kFar = 1e9;  // pixels: beyond every image

constexpr std::int32_t kRecordsPerLine = 64 / sizeof(VoxelRecord);  // of the cache

// Pieces are cut so that they are at most about this long on the screen: they are culled and mark tiles as a whole.
constexpr double kPiecePixels = 32;

std::int32_t FloorToInt(double x) {
  const auto i = std::int32_t(x);
  return i - std::int32_t(i > x);
}

// Opacities are those of one sheet: of `opacity_distance` voxel lengths, corrected for the distance of sheets along the central ray.
ShadeTables MakeShadeTables(const ClassificationTable& table, const SliceProjection& projection, const FrameSetup& setup) {
  const Camera& camera = setup.camera;
  const double voxel_length = std::min({camera.spacing.x, camera.spacing.y, camera.spacing.z});
  const double exponent = projection.sheet_distance() / (table.opacity_distance * voxel_length);
  const double area = projection.perspective() ? 1.0 : projection.CellArea(0);
  ShadeTables tables;
  for (int bin = 0; bin < table.size(); ++bin) {
    const Rgb& color = table.color[std::size_t(bin)];
    const double opacity = -std::expm1(exponent * std::log1p(-double(table.opacity[std::size_t(bin)])));
    for (float f : {color.r, color.g, color.b, 1.0F}) tables.color.push_back(f);
    tables.opacity.push_back(float(area * opacity));
  }
  tables.by_normal = Phong(setup.shading, camera.view_direction).ByNormalCode();
  return tables;
}

// At least the radius, in pixels, of any footprint of `cells` (whose occupied part is not empty). Their shape varies over the volume
// (perspective): a quarter more than at the corners is enough for what lies between.
double LargestRadius(const OccupiedCells& cells, const SliceProjection& projection) {
  const auto [c, u, v] = cells.axes;
  double sigma = 0;
  for (std::int32_t at_u : {cells.occupied.begin[u], cells.occupied.end[u] - 1}) {
    for (std::int32_t at_v : {cells.occupied.begin[v], cells.occupied.end[v] - 1}) {
      for (std::int32_t at_c : {cells.occupied.begin[c], cells.occupied.end[c] - 1}) {
        const FootprintSigma at_corner = projection.SigmaAt(at_u, at_v, at_c);
        sigma = std::max({sigma, at_corner.x, at_corner.y});
      }
    }
  }
  return 1.25 * kFootprintCut * sigma;
}

// Pixels that samples of `box` can cover, seen from `cells` (whose occupied part is not empty).
PixelBounds ScreenBounds(const OccupiedCells& cells, const Box& box, const FrameSetup& setup, const SliceProjection& projection,
                         double largest_radius) {
  const Camera& camera = setup.camera;
  // Of all points within [low, high], grown by `margin` pixels.
  const auto bounds_of = [&](const Vec3& low, const Vec3& high, double margin) {
    double x_low = camera.width, y_low = camera.height, x_high = 0, y_high = 0;
    for (double x : {low.x, high.x}) {
      for (double y : {low.y, high.y}) {
        for (double z : {low.z, high.z}) {
          const Camera::ImagePoint p = camera.Project({x, y, z});
          x_low = std::min(x_low, p.x), x_high = std::max(x_high, p.x);
          y_low = std::min(y_low, p.y), y_high = std::max(y_high, p.y);
        }
      }
    }
    const auto column = [&](double x) { return std::int32_t(std::clamp(x, 0.0, double(camera.width))); };
    const auto row = [&](double y) { return std::int32_t(std::clamp(y, 0.0, double(camera.height))); };
    return PixelBounds{column(std::floor(x_low - margin)), row(std::floor(y_low - margin)), column(std::ceil(x_high + margin)),
                       row(std::ceil(y_high + margin))};
  };

  const auto [c, u, v] = cells.axes;
  const Vec3 low = ToVec3(cells.occupied.begin), high = ToVec3(cells.occupied.end) - Vec3{1, 1, 1};
  const PixelBounds reached = bounds_of(low, high, largest_radius + 2);  // what footprints reach

  // What the box owns: its own cross-section, and outside the volume without end; samples farther than the halo from any voxel are empty.
  const Index3& size = setup.description.geometry.size;
  Vec3 owned_low = low, owned_high = high;
  for (Axis axis : {u, v}) {
    owned_low[axis] = low[axis] - setup.halo;
    if (box.begin[axis] > 0) owned_low[axis] = std::max(owned_low[axis], box.begin[axis] - 0.5);
    owned_high[axis] = high[axis] + setup.halo;
    if (box.end[axis] < size[axis]) owned_high[axis] = std::min(owned_high[axis], box.end[axis] - 0.5);
    if (owned_low[axis] > owned_high[axis]) return {};
  }
  // Without a plane that cuts the image only footprints count: beyond the volume, corners of the halo may lie behind the eye.
  const bool cut = box.begin[u] > 0 || box.begin[v] > 0 || box.end[u] < size[u] || box.end[v] < size[v];
  if (!cut || projection.perspective()) return reached;
  return Intersection(reached, bounds_of(owned_low, owned_high, 1));
}

// One call of Render, from the first slice to the last.
class Pass {
 public:
  Pass(const OccupiedCells& cells, const Box& box, const FrameSetup& setup, const ShadeTables& tables, const SliceProjection& projection,
       const PixelBounds& bounds, double largest_radius, StageClock& clock, RankReport& report)
      : cells_(cells),
        tables_(tables),
        projection_(projection),
        footprints_(projection, setup.description.geometry, cells.occupied),
        ownership_(projection, box, setup.description.geometry),
        sheet_(bounds, setup.termination, 2 * largest_radius + 1),
        clock_(clock),
        report_(report) {
    if (projection.perspective()) sheet_.SetDistanceRatios(setup.camera);
  }

  void AddSlice(std::int32_t k) {
    const auto [c, u, v] = cells_.axes;
    slice_ = k;
    footprints_.SetSlice(k);
    ownership_.SetSlice(k);
    area_ = projection_.perspective() ? float(projection_.CellArea(k)) : 1.0F;
    const Homogeneous middle = projection_.At(0.5 * (cells_.occupied.begin[u] + cells_.occupied.end[u]),
                                              0.5 * (cells_.occupied.begin[v] + cells_.occupied.end[v]), k);
    const Homogeneous& step = projection_.step_u();
    const double voxel_pixels = std::hypot(step.x - middle.x / middle.w * step.w, step.y - middle.y / middle.w * step.w) / middle.w;
    piece_voxels_ = std::int32_t(std::clamp(kPiecePixels / voxel_pixels, 1.0, double(kCell)));

    for (std::int32_t cell_v = cells_.occupied.begin[v] / kCell; cell_v * kCell < cells_.occupied.end[v]; ++cell_v) {
      if (!FindOpenBlocks(cell_v)) continue;
      const std::int32_t begin = std::max(cell_v * kCell, cells_.occupied.begin[v]);
      const std::int32_t end = std::min((cell_v + 1) * kCell, cells_.occupied.end[v]);
      for (std::int32_t row = begin; row < end; ++row) AddBeam(row);
    }
    Flush();
    sheet_.CompositeSlice(ownership_);
    clock_.Charge(Stage::kComposite);
  }

  LocalImage TakeImage(const Camera& camera) { return sheet_.TakeImage({0, 0, camera.width, camera.height}); }

 private:
  // Blocks of kCell x kCell voxels of the slice whose footprints may show: on the sheet, owned and not hidden. False if no block of this
  // row does.
  bool FindOpenBlocks(std::int32_t cell_v) {
    const Axis u = cells_.axes.u, v = cells_.axes.v;
    // Voxels of the cell that may be occupied: outside the volume a corner could lie behind the eye.
    const auto ends = [&](std::int32_t cell, Axis axis) {
      return std::array{std::max(cell * kCell, cells_.occupied.begin[axis]), std::min((cell + 1) * kCell, cells_.occupied.end[axis]) - 1};
    };
    open_cells_.clear();
    for (std::int32_t cell_u = cells_.occupied.begin[u] / kCell; cell_u * kCell < cells_.occupied.end[u]; ++cell_u) {
      double x_low = kFar, y_low = kFar, x_high = -kFar, y_high = -kFar;
      for (std::int32_t at_u : ends(cell_u, u)) {
        for (std::int32_t at_v : ends(cell_v, v)) {
          const Homogeneous p = projection_.At(at_u, at_v, slice_);
          const double x = p.x / p.w, y = p.y / p.w;
          x_low = std::min(x_low, x), x_high = std::max(x_high, x);
          y_low = std::min(y_low, y), y_high = std::max(y_high, y);
        }
      }
      const FootprintPair& footprint = footprints_.At(cell_u, cell_v);
      const double reach_x = footprint.x->radius + 1, reach_y = footprint.y->radius + 1;
      const PixelBounds pixels = {FloorToInt(x_low - reach_x), FloorToInt(y_low - reach_y), FloorToInt(x_high + reach_x) + 1,
                                  FloorToInt(y_high + reach_y) + 1};
      if (MayShow(pixels)) open_cells_.push_back(cell_u - cells_.first_cell);
    }
    return !open_cells_.empty();
  }

  bool MayShow(const PixelBounds& pixels) const {
    return !Intersection(pixels, sheet_.bounds()).empty() && ownership_.MayOwn(pixels) && !sheet_.Saturated(pixels);
  }

  // Seed of a beam: voxel u = 0 of it, and then cell by cell.
  void AddBeam(std::int32_t row) {
    const std::size_t beam = cells_.Beam(slice_, row);
    if (cells_.first_record[beam] == cells_.first_record[beam + 1]) return;
    const Homogeneous seed = projection_.SliceOrigin(slice_) + double(row) * projection_.step_v();
    const std::uint32_t* masks = cells_.Masks(beam);
    const std::uint16_t* offsets = cells_.RecordOffsets(beam);
    const VoxelRecord* beam_records = &cells_.records[cells_.first_record[beam]];
    for (const std::int32_t cell : open_cells_) {
      const std::uint32_t mask = masks[cell];
      if (mask == 0) continue;
      const VoxelRecord* records = beam_records + offsets[cell];
      const std::int32_t number = cells_.first_cell + cell;
      BeamPiece piece =
          CellPiece(seed + double(number * kCell) * projection_.step_u(), projection_.step_u(), footprints_.At(number, row / kCell));
      piece.area = area_;
      piece.column -= sheet_.bounds().x_begin;
      piece.row -= sheet_.bounds().y_begin;
      for (std::int32_t begin = 0; begin < kCell; begin += piece_voxels_) {
        const std::uint64_t wanted = ((std::uint64_t{1} << piece_voxels_) - 1) << begin;
        piece.mask = mask & std::uint32_t(wanted);
        if (piece.mask == 0) continue;
        piece.count = std::popcount(piece.mask);
        piece.records = records;
        records += piece.count;
        AddPiece(piece);
      }
    }
  }

  // Pixels of the frame that footprints of the piece's voxels cover. A line stays a line, so the ends decide.
  PixelBounds PieceBounds(const BeamPiece& piece) const {
    const auto first = float(std::countr_zero(piece.mask)), last = float(31 - std::countl_zero(piece.mask));
    float per_w_first = 1, per_w_last = 1;
    if (projection_.perspective()) {
      per_w_first = 1 / (piece.w0 + first * piece.w_step);
      per_w_last = 1 / (piece.w0 + last * piece.w_step);
    }
    const std::int32_t xa = FloorToInt((piece.x0 + first * piece.x_step) * per_w_first),
                       xb = FloorToInt((piece.x0 + last * piece.x_step) * per_w_last);
    const std::int32_t ya = FloorToInt((piece.y0 + first * piece.y_step) * per_w_first),
                       yb = FloorToInt((piece.y0 + last * piece.y_step) * per_w_last);
    const std::int32_t x = piece.column + sheet_.bounds().x_begin, y = piece.row + sheet_.bounds().y_begin;
    const std::int32_t slack = projection_.perspective();  // a division more: the ends may round the other way
    return {x + std::min(xa, xb) - slack, y + std::min(ya, yb) - slack, x + std::max(xa, xb) + piece.kernel_x->taps + slack,
            y + std::max(ya, yb) + piece.kernel_y->taps + slack};
  }

  void AddPiece(const BeamPiece& piece) {
    const PixelBounds pixels = PieceBounds(piece);
    if (!MayShow(pixels)) return;
    sheet_.Touch(pixels);
    for (std::int32_t i = 0; i < piece.count; i += kRecordsPerLine) __builtin_prefetch(piece.records + i);  // read by the transform
    if (batch_.voxel_count + std::size_t(piece.count) > VoxelBatch::kVoxels) Flush();
    batch_.pieces.push_back(piece);
    batch_.voxel_count += std::size_t(piece.count);
  }

  // Runs the stages over the batch. Finding pieces and culling count as transform.
  void Flush() {
    if (batch_.voxel_count == 0) return;
    TransformPieces(projection_.perspective() ? Projection::kPerspective : Projection::kOrthographic, batch_);
    if (sheet_.culls_voxels()) CullHiddenVoxels(sheet_.hidden_tiles(), batch_);
    clock_.Charge(Stage::kTransform);
    ShadePieces(tables_, projection_.perspective(), batch_);
    clock_.Charge(Stage::kShade);
    SplatPieces(batch_, sheet_.view());
    clock_.Charge(Stage::kSplat);
    report_.drawn_voxels += batch_.voxel_count;
    batch_.pieces.clear();
    batch_.voxel_count = 0;
  }

  const OccupiedCells& cells_;
  const ShadeTables& tables_;
  const SliceProjection& projection_;
  Footprints footprints_;
  Ownership ownership_;
  SheetBuffer sheet_;
  VoxelBatch batch_;
  StageClock& clock_;
  RankReport& report_;
  // Of the slice at hand.
  std::int32_t slice_ = 0, piece_voxels_ = kCell;
  std::vector<std::int32_t> open_cells_;  // along u, of the row of blocks at hand
  float area_ = 1;
};

}  // namespace

Result<LocalImage> SplattingRenderer::Render(SlabData& slab, const Box& box, const FrameSetup& setup, const std::atomic<bool>& cancelled,
                                             RankReport& report) {
  StageClock clock(report);
  const ClassificationTable& table = slab.derived().Classification(setup);
  const OccupiedCells& cells = slab.derived().Occupied(setup, box);
  report.occupied_voxels += cells.occupied_in_box;
  const SliceProjection projection(setup.camera, setup.description.geometry);
  const double largest_radius = cells.occupied.empty() ? 0 : LargestRadius(cells, projection);
  const PixelBounds bounds = cells.occupied.empty() ? PixelBounds{} : ScreenBounds(cells, box, setup, projection, largest_radius);
  LocalImage image = MakeLocalImage(PixelFormat::kRgba, {});
  clock.Charge(Stage::kPrepare);
  if (!bounds.empty()) {
    const ShadeTables tables = MakeShadeTables(table, projection, setup);
    clock.Charge(Stage::kShade);
    Pass pass(cells, box, setup, tables, projection, bounds, largest_radius, clock, report);
    const std::int32_t begin = cells.occupied.begin[cells.axes.c], end = cells.occupied.end[cells.axes.c];
    for (std::int32_t i = 0; i < end - begin; ++i) {
      if (cancelled) return Status::Cancelled("rendering was cancelled");
      pass.AddSlice(setup.camera.ascending ? begin + i : end - 1 - i);
    }
    image = pass.TakeImage(setup.camera);
    clock.Charge(Stage::kComposite);
  }
  clock.Finish(Stage::kRender);
  return image;
}

}  // namespace slabstream
