#include "common/planning/layout.h"

#include <algorithm>
#include <array>
#include <optional>

#include "common/decomposition/owner_partition.h"
#include "common/parallel/parallel.h"
#include "common/planning/brick_visibility.h"
#include "common/planning/level_partition.h"
#include "common/planning/measured_cost.h"
#include "common/planning/other_bricks.h"
#include "common/planning/unread_parts.h"
#include "common/planning/worker_memory.h"
#include "common/renderers/renderer_kind.h"
#include "common/view/sheet_grid.h"
#include "common/volume/indices.h"
#include "common/volume/missing.h"

namespace slabstream {
namespace {

constexpr std::int64_t kMostBoxes = std::int64_t{1} << 20;

// The smallest boxes that make sense hold three times as many voxels as they own, halo included: slabs of as many slices as the halo is
// thick, cubes of this many voxels a side. Those of grids may be bricks: their cells count more than voxels.
constexpr std::int64_t kSmallestCube = 36;

// Of boxes that are made on demand, a frame has about so many groups, if there are as many boxes: what is opaque in a group is known before
// the next but one is handed out, and boxes that it hides are not made.
constexpr std::uint64_t kGroupsToMake = 64;

// How many units along each axis cover so many voxels.
Index3 UnitsOver(const Index3& size, const Index3& unit) { return (size - Uniform(1)) / unit + Uniform(1); }

int MostGroups(const LayoutRequest& request, const ResolvedPolicy& policy) {
  const Index3& size = request.summary->description.geometry.size;
  const std::int64_t slots = request.slots;
  const std::int64_t cube = request.summary->cells.empty() ? kSmallestCube : kBrick;
  const std::int64_t boxes = policy.decomposition->one_axis ? size[policy.axis] / std::max(request.volume->renderer()->reach(), 1)
                                                            : Box{{0, 0, 0}, size}.voxel_count() / (cube * cube * cube);
  return int(std::clamp<std::int64_t>(boxes / slots, 1, kMaxGroups));
}

// The fields of work that layouts are made from, each made at its first use.
class WorkFields {
 public:
  explicit WorkFields(const LayoutRequest& request)
      : request_(request),
        visibility_(*request.summary, request.volume->renderer()->DrawnTable(request.volume->transfer(), *request.summary),
                    OtherBricks(*request.summary, *request.volume)),
        clip_(request.volume->clip()),
        voxels_(WorkField::Uniform(request.summary->description.geometry.size)) {}

  // Nothing is known of the work in voxels that nobody has read.
  const WorkField& Of(BalanceBy metric) {
    if (request_.summary->stored) return voxels_;
    if (metric == BalanceBy::kVoxels) return voxels_;
    if (metric == BalanceBy::kCost && request_.known.cost != nullptr) return *request_.known.cost;
    if (!occupied_) occupied_.emplace(Grid());
    return *occupied_;
  }

  const OccupancyGrid& Grid() {
    if (request_.known.occupied != nullptr && clip_.empty()) return *request_.known.occupied;
    if (!drawn_) {
      drawn_.emplace(request_.known.occupied != nullptr ? *request_.known.occupied : visibility_.VisibleCells());
      EmptyClippedCells(clip_, request_.summary->description.geometry, *drawn_);
    }
    return *drawn_;
  }

  const ClipRegion& clip() const { return clip_; }
  // Whether clipping may leave a sample in the box.
  bool Keeps(const Box& box) const { return clip_.MayKeep(request_.summary->description.geometry.InDataSpace(box)); }

  // Whether any sample that `box` owns may show something.
  bool Shows(const Box& box) {
    if (!Keeps(box)) return false;
    const Box with_halo = Grown(box, request_.volume->renderer()->reach(), request_.summary->description.geometry.bounds());
    if (request_.known.occupied == nullptr || request_.summary->stored) return visibility_.AnyVisible(with_halo);
    return !Of(BalanceBy::kOccupied).Hull(with_halo).empty();
  }

 private:
  const LayoutRequest& request_;
  const BrickVisibility visibility_;
  const ClipRegion& clip_;
  const WorkField voxels_;
  std::optional<OccupancyGrid> drawn_;
  std::optional<WorkField> occupied_;
};

}  // namespace

struct LayoutMaker::State {
  explicit State(const LayoutRequest& r) : request(r), fields(request) {}

  Partition MakePartition(const ResolvedPolicy& policy, int groups, const WorkField& field, const Partition* resized = nullptr,
                          int shape = 0) {
    const Index3& size = request.summary->description.geometry.size;
    const std::int64_t slots = request.slots, voxels = Box{{0, 0, 0}, size}.voxel_count();
    return policy.decomposition->make({.work = &field,
                                       .boxes = int(std::min({groups * slots, voxels, kMostBoxes})),
                                       .most_boxes = int(std::min(kMaxGroups * slots, kMostBoxes)),
                                       .together = int(std::min(slots, kMostBoxes)),
                                       .axis = policy.axis,
                                       .halo = request.volume->renderer()->reach(),
                                       .resized = resized,
                                       .shape = shape});
  }

  // Blocks of the source that are read for the boxes, in voxels.
  std::int64_t VoxelsRead(const Partition& partition, const Index3& block) {
    std::int64_t voxels = 0;
    for (const Box& box : partition.boxes()) {
      if (!fields.Shows(box)) continue;
      Box read = Grown(box, request.volume->renderer()->reach(), partition.bounds());
      for (const Axis axis : kAxes) {
        read.begin[axis] = read.begin[axis] / block[axis] * block[axis];
        read.end[axis] = (read.end[axis] - 1) / block[axis] * block[axis] + block[axis];
      }
      voxels += Intersection(read, partition.bounds()).voxel_count();
    }
    return voxels;
  }

  // The volume divided in units of `unit` voxels, in the fewest groups with which boxes are not too large. Nothing: they are, whatever the
  // number of groups.
  std::optional<Partition> PartitionInUnits(const ResolvedPolicy& policy, Partition (*make)(const DecompositionRequest&),
                                            const Index3& unit) {
    const Box bounds = request.summary->description.geometry.bounds();
    const Index3 units = UnitsOver(bounds.end, unit);
    const WorkField work = WorkField::Uniform(units);
    const std::int64_t slots = request.slots, count = std::int64_t(CountIn(units));
    const std::int64_t bytes = bounds.voxel_count() * std::int64_t(BytesPerSample(request.summary->description.type));
    const int least = int(std::clamp<std::int64_t>(bytes / (request.box_bytes_target * slots), 1, kMaxGroups));
    for (int groups = policy.groups > 0 ? policy.groups : least; groups <= kMaxGroups; groups += std::max(1, groups / 8)) {
      const std::int64_t boxes = std::min(groups * slots, kMostBoxes);
      Partition made = make({.work = &work,
                             .boxes = int(std::min(boxes, count)),
                             .most_boxes = int(std::min(kMaxGroups * slots, kMostBoxes)),
                             .together = int(std::min(slots, kMostBoxes)),
                             .axis = policy.axis})
                           .OfBlocks(unit, bounds, request.volume->renderer()->reach());
      if (policy.groups > 0 || BoxesFit(made)) return made;
      if (boxes >= count || stopped()) break;
    }
    return std::nullopt;
  }

  // Boxes of voxels that are read in parts end where blocks of their source end, so that few blocks are read for two boxes: those of the
  // policy's decomposition, or if they are too large or more would be read for them, cubes of blocks or smaller ones.
  Partition MakeStoredPartition(const ResolvedPolicy& policy) {
    constexpr std::int32_t kSmallUnit = 32;
    const Index3 block = request.summary->stored->block.end;
    const Index3 small = Min(block, Uniform(kSmallUnit));
    std::optional<Partition> best = PartitionInUnits(policy, policy.decomposition->make, block);
    double read = best ? double(VoxelsRead(*best, block)) : std::numeric_limits<double>::infinity();
    struct Other {
      Index3 unit;
      double worth_it;  // share of what is read otherwise
    };
    for (const auto& [unit, worth_it] : {Other{block, 0.95}, Other{small, 0.8}}) {  // blocks are cut for much only
      std::optional<Partition> cubes = PartitionInUnits(policy, &MakeSubcubes, unit);
      if (!cubes) continue;
      const auto voxels = double(VoxelsRead(*cubes, block));
      if (voxels > worth_it * read) continue;
      best = std::move(cubes);
      read = voxels;
    }
    // Too large even so: whoever wants the frame is told (FramesThatFit).
    return best ? *std::move(best) : MakePartition(policy, MostGroups(request, policy), fields.Of(BalanceBy::kVoxels));
  }

  // Of the volume (0), or a coarser level.
  const VolumeSummary& SummaryOf(std::uint8_t level) const {
    return level == 0 ? *request.summary : *request.coarser[level - std::size_t{1}].summary;
  }
  Box PaddedBoxOf(const LevelBox& at) const {
    const VolumeGeometry& geometry = SummaryOf(at.level).description.geometry;
    return Grown(CoveringVoxels(at.box, request.summary->description.geometry, geometry), request.volume->renderer()->reach(),
                 geometry.bounds());
  }

  std::int64_t BytesOf(const LevelBox& at) const {
    return PaddedBoxOf(at).voxel_count() * std::int64_t(BytesPerSample(request.summary->description.type));
  }
  int LeastBoxes(const ResolvedPolicy& policy) const {
    return int(std::min<std::int64_t>(std::int64_t{request.slots} * std::max(policy.groups, 1), kMostBoxes));
  }

  // The zones that the picture shows of a level (ShownZones), in boxes of whole blocks if one of them is not too large.
  std::optional<LevelPartition> DivideShownBlocks(const ResolvedPolicy& policy) const {
    const Box bounds = request.summary->description.geometry.bounds();
    const Index3 block = request.summary->stored->block.end;
    if (BytesOf({Intersection({{0, 0, 0}, block}, bounds), 0}) > request.box_bytes_target) return std::nullopt;
    LevelMap in_blocks = *request.map;
    in_blocks.side = in_blocks.side / block;
    const auto bytes_of = [&](const LevelBox& at) {
      return BytesOf({Intersection({at.box.begin * block, at.box.end * block}, bounds), at.level});
    };
    LevelPartition made = DivideByLevels({.map = &in_blocks,
                                          .size = UnitsOver(bounds.end, block),
                                          .least_boxes = LeastBoxes(policy),
                                          .most_bytes = request.box_bytes_target,
                                          .bytes_of = bytes_of,
                                          .blocks_of = [](std::uint8_t) { return Uniform(1); }});
    made.partition = made.partition.OfBlocks(block, bounds, request.volume->renderer()->reach());
    return made;
  }

  LevelPartition DivideAtZones(const ResolvedPolicy& policy) const {
    return DivideByLevels({.map = request.map,
                           .size = request.summary->description.geometry.size,
                           .least_boxes = LeastBoxes(policy),
                           .most_bytes = request.box_bytes_target,
                           .bytes_of = [&](const LevelBox& at) { return BytesOf(at); },
                           .blocks_of =
                               [&](std::uint8_t level) {
                                 Index3 voxels;
                                 const std::optional<StoredAt>& stored = SummaryOf(level).stored;
                                 const Vec3 voxel =
                                     SummaryOf(level).description.geometry.spacing / request.summary->description.geometry.spacing;
                                 for (const Axis axis : kAxes)
                                   voxels[axis] = stored ? std::int32_t(stored->block.end[axis] * voxel[axis] + 0.5) : 0;
                                 return voxels;
                               }});
  }

  Layout MakeByLevels(const ResolvedPolicy& policy) {
    std::optional<LevelPartition> blocks = request.coarser.empty() ? DivideShownBlocks(policy) : std::nullopt;
    LevelPartition made = blocks ? *std::move(blocks) : DivideAtZones(policy);
    std::vector<BrickVisibility> visible;
    for (std::size_t level = 0; level <= request.coarser.size(); ++level) {
      const VolumeSummary& summary = SummaryOf(std::uint8_t(level));
      const BrickRangeList& bricks = summary.indexed == nullptr ? summary.bricks : *summary.indexed;
      visible.emplace_back(summary, bricks, request.volume->renderer()->DrawnTable(request.volume->transfer(), summary));
    }
    const auto shows = [&](const Box& box, BoxId id) {
      const LevelBox at(box, made.levels[id]);
      const Box place = request.summary->description.geometry.InDataSpace(box);
      return at.level != LevelMap::kOutside && request.volume->clip().MayKeep(place) && visible[at.level].AnyVisible(PaddedBoxOf(at));
    };
    // Parts of boxes are known of one level alone.
    const std::optional<UnreadParts> unread = request.coarser.empty() ? FindUnread() : std::nullopt;
    std::vector<std::vector<FilledBox>> filled(unread ? made.levels.size() : 0);
    Layout layout = Share(std::move(made.partition), policy, shows, [&](const Box& box, BoxId id) {
      const Box padded = PaddedBoxOf({box, made.levels[id]});
      return double(unread ? VoxelsRead(*unread, padded, filled[id]) : padded.voxel_count());
    });
    layout.levels = std::move(made.levels);
    std::ranges::replace(layout.levels, LevelMap::kOutside, std::uint8_t(request.coarser.size()));
    layout.filled = std::move(filled);
    return layout;
  }

  bool stopped() const { return request.stop.stop_requested(); }

  bool BoxesFit(const Partition& partition) {
    const auto sample_bytes = std::int64_t(BytesPerSample(request.summary->description.type));
    return std::ranges::all_of(partition.boxes(), [&](const Box& box) {
      const Box padded = Grown(box, request.volume->renderer()->reach(), partition.bounds());
      const std::int64_t bytes = padded.voxel_count() * sample_bytes + BoxBytesOfCells(padded, *request.summary);
      return bytes <= request.box_bytes_target || !fields.Shows(box);
    });
  }

  // Seconds of a box in views along x and along y: views turn about z.
  static constexpr std::size_t kViews = 2;
  static constexpr std::array<CostView, kViews> kCostViews = {{{.along = Axis::kX}, {.along = Axis::kY}}};
  using ByView = std::array<double, kViews>;
  // As if no frame had been measured.
  const AnalyticCost& Analytic() {
    if (!analytic) analytic = request.volume->renderer()->MakeCost({&fields.Grid(), request.summary, &request.volume->transfer()});
    return analytic;
  }

  // Mean over views: measured, if earlier frames were.
  double MeanSeconds(const Box& box) {
    if (request.known.cost != nullptr) return request.known.cost->Sum(box);
    return (Analytic()(box, kCostViews[0]) + Analytic()(box, kCostViews[1])) / kViews;
  }

  // An index says which boxes are rendered, and what of them is read. It does not say where they are: boxes are those that would be
  // made without it.
  // `holders`: by box (AssignmentRequest); empty: it does not matter who holds which voxels.
  Layout Assign(Partition partition, const ResolvedPolicy& policy, std::span<const std::uint32_t> holders = {}) {
    const bool by_cost = policy.assignment->by_cost && !request.summary->stored;
    const std::optional<UnreadParts> unread = FindUnread();
    std::vector<std::vector<FilledBox>> filled(unread ? partition.boxes().size() : 0);
    const auto shows = [&](const Box& box, BoxId) { return InPicture(box) && fields.Shows(box) && (!unread || unread->Shows(box)); };
    const auto cost_of = [&](const Box& box, BoxId id) {
      if (!unread) return by_cost ? MeanSeconds(box) : 1;
      return double(VoxelsRead(*unread, PaddedBoxOf({box, 0}), filled[id]));
    };
    Layout layout = Share(std::move(partition), policy, shows, cost_of, holders);
    layout.filled = std::move(filled);
    if (!extinction) extinction = FindLeastExtinction(*request.summary, *request.volume);
    layout.extinction = *extinction;
    return layout;
  }

  // Of a padded box. `filled`: becomes what need not be read of it.
  static std::int64_t VoxelsRead(const UnreadParts& unread, const Box& padded, std::vector<FilledBox>& filled) {
    filled = unread.Of(padded);
    std::int64_t read = padded.voxel_count();
    for (const FilledBox& part : filled) read -= part.box.voxel_count();
    return read;
  }

  // Gives boxes that show something to slots. Asks for the cost of each of them once.
  template <class Shows, class CostOf>
  Layout Share(Partition partition, const ResolvedPolicy& policy, Shows&& shows, CostOf&& cost_of,
               std::span<const std::uint32_t> holders = {}) {
    std::vector<BoxId> shown;
    std::vector<double> box_costs;
    std::vector<std::uint32_t> box_holders;
    for (BoxId id = 0; id < partition.boxes().size(); ++id) {
      const Box& box = partition.boxes()[id];
      if (!shows(box, id) || (!holders.empty() && holders[id] == kNoOwner)) continue;
      shown.push_back(id);
      box_costs.push_back(cost_of(box, id));
      if (!holders.empty()) box_holders.push_back(holders[id]);
    }
    std::uint32_t holder_count = 0;
    for (const std::uint32_t holder : holders) holder_count = std::max(holder_count, holder == kNoOwner ? 0 : holder + 1);
    Layout layout{std::move(partition), {}};
    layout.owners.assign(layout.partition.boxes().size(), kNoSlot);
    const std::vector<std::uint32_t> owners = policy.assignment->assign({.costs = box_costs,
                                                                         .slots = request.slots,
                                                                         .holders = box_holders,
                                                                         .holder_count = holder_count,
                                                                         .holder_hosts = request.summary->owner_hosts,
                                                                         .slot_hosts = request.hosts});
    for (std::size_t i = 0; i < shown.size(); ++i) layout.owners[shown[i]] = owners[i];
    return layout;
  }

  // Whether the picture shows some of the box; true if it is not known which zones it shows (ShownZones).
  bool InPicture(const Box& box) const {
    if (request.map == nullptr || request.map->one_level()) return true;
    const Index3& side = request.map->side;
    for (const Index3& zone : IndicesIn(Box{box.begin / side, (box.end - Uniform(1)) / side + Uniform(1)})) {
      if (request.map->Of(zone) != LevelMap::kOutside) return true;
    }
    return false;
  }

  // Boxes as their owners hold them, or parts of these that fit the target. Those that are made on demand are not joined: of a joined box
  // all would be made where one shows.
  Layout MakeByOwner(const ResolvedPolicy& policy) {
    const auto fits = [&](const Box& box) { return BytesOf({box, 0}) <= request.box_bytes_target || box.voxel_count() == 1; };
    OwnedBoxes owned = *request.summary->owned;
    for (std::uint32_t i = 0; request.summary->on_demand && i < owned.size(); ++i) owned[i].owner = i;
    OwnerPartition made = DivideByOwners(request.summary->description.geometry.bounds(), owned, fits);
    for (std::uint32_t& owner : made.owners) owner = request.summary->on_demand ? (*request.summary->owned)[owner].owner : owner;
    Layout layout = Assign(std::move(made.partition), policy, made.owners);
    layout.touching = FindTouching(layout.partition);
    if (request.summary->on_demand && !fields.clip().empty()) FillClipped(layout);
    layout.group_bytes = std::uint64_t(request.box_bytes_target);
    if (request.summary->on_demand) layout.group_bytes = std::min(layout.group_bytes, BytesShown(layout) / request.slots / kGroupsToMake);
    return layout;
  }

  std::uint64_t BytesShown(const Layout& layout) const {
    std::uint64_t bytes = 0;
    for (BoxId id = 0; id < layout.owners.size(); ++id) {
      if (layout.owners[id] != kNoSlot) bytes += std::uint64_t(BytesOf({layout.partition.boxes()[id], 0}));
    }
    return bytes;
  }

  // Voxels of other boxes in the halo of one are not read if clipping leaves nothing that reads them.
  void FillClipped(Layout& layout) {
    const std::span<const Box> boxes = layout.partition.boxes();
    const auto fill = [&](BoxId of, BoxId other) {
      const std::int32_t reach = request.volume->renderer()->reach();
      if (layout.owners[of] == kNoSlot || layout.filled[of].size() == kMaxFilled) return;
      const Box part = Intersection(PaddedBoxOf({boxes[of], 0}), boxes[other]);
      if (!part.empty() && !fields.Keeps(Grown(part, reach, layout.partition.bounds()))) layout.filled[of].push_back({part, 0});
    };
    layout.filled.resize(boxes.size());
    for (const TouchingBoxes& pair : layout.touching) {
      fill(pair.first, pair.second);
      fill(pair.second, pair.first);
    }
  }

  std::optional<UnreadParts> FindUnread() const {
    if (request.summary->indexed == nullptr) return std::nullopt;
    const RendererKind& renderer = *request.volume->renderer();
    return UnreadParts(*request.summary, renderer.DrawnTable(request.volume->transfer(), *request.summary), renderer.reach(),
                       OtherBricks(*request.summary, *request.volume));
  }

  // Of a layout: the render time of a frame, averaged over views, and each box's largest share of the work of any view. Boxes of equal work
  // on average may each be the slowest in some view; boxes that are equal by this measure are equal in all views.
  struct Predicted {
    double frame = 0;
    double shared_out = 0;  // the same if all slots had equal work
    std::vector<BoxSeconds> shares;
  };
  Predicted Predict(const Layout& layout) {
    Predicted predicted;
    std::vector<std::uint32_t> owners;
    for (std::size_t box = 0; box < layout.owners.size(); ++box) {
      if (layout.owners[box] == kNoSlot) continue;
      predicted.shares.push_back({layout.partition.boxes()[box]});
      owners.push_back(layout.owners[box]);
    }
    std::vector<ByView> times(owners.size()), slots(request.slots);
    const AnalyticCost& cost = Analytic();
    // The frame waits for this.
    ParallelFor(std::size_t{0}, kViews * times.size(),
                [&](std::size_t i) { times[i / kViews][i % kViews] = cost(predicted.shares[i / kViews].box, kCostViews[i % kViews]); });
    ByView sum{};
    for (std::size_t i = 0; i < times.size(); ++i) {
      for (std::size_t view = 0; view < kViews; ++view) {
        slots[owners[i]][view] += times[i][view];
        sum[view] += times[i][view];
      }
    }
    for (std::size_t view = 0; view < kViews; ++view) {
      if (sum[view] == 0) continue;
      predicted.shared_out += sum[view] / (kViews * request.slots);
      for (std::size_t i = 0; i < times.size(); ++i) {
        predicted.shares[i].seconds = std::max(predicted.shares[i].seconds, times[i][view] / sum[view]);
      }
      predicted.frame += std::ranges::max(slots, {}, [view](const ByView& slot) { return slot[view]; })[view] / kViews;
    }
    return predicted;
  }

  // A sequence of layouts: each is cut by the predicted times of the last one's boxes.
  struct Refined {
    explicit Refined(const OccupancyGrid& grid) : cost(grid) {}
    // The best one is as even as it gets: nothing is left to gain.
    bool even() const { return frame <= 1.01 * shared_out; }

    MeasuredCost cost;
    Layout best;
    double frame = std::numeric_limits<double>::infinity(), shared_out = 0;  // of the best one
  };
  void Refine(const ResolvedPolicy& policy, Partition partition, Refined& refined) {
    Layout layout = Assign(std::move(partition), policy);
    const Predicted predicted = Predict(layout);
    refined.cost.Learn(predicted.shares, 1);
    if (predicted.frame >= refined.frame) return;
    refined.frame = predicted.frame;
    refined.shared_out = predicted.shared_out;
    refined.best = std::move(layout);
  }

  // First cuts boxes anew in each shape, then resizes those of the best shape.
  Layout MakeByPredictedCost(const ResolvedPolicy& policy, int groups) {
    constexpr int kCuts = 2, kResizings = 3;
    std::optional<Refined> best;
    std::vector<std::vector<Box>> begun;  // the first cut of each shape: shapes of few boxes are often the same
    for (int shape = 0; shape < policy.decomposition->shapes && (shape == 0 || !(stopped() || best->even())); ++shape) {
      Refined refined(fields.Grid());
      Partition made = MakePartition(policy, groups, refined.cost.Field(), nullptr, shape);
      const std::span<const Box> boxes = made.boxes();
      if (std::ranges::any_of(begun, [&](const std::vector<Box>& other) { return std::ranges::equal(other, boxes); })) continue;
      begun.emplace_back(boxes.begin(), boxes.end());
      Refine(policy, std::move(made), refined);
      for (int cut = 1; cut < kCuts && !stopped() && !refined.even(); ++cut) {
        Refine(policy, MakePartition(policy, groups, refined.cost.Field(), nullptr, shape), refined);
      }
      if (!best || refined.frame < best->frame) best.emplace(std::move(refined));
    }
    for (int i = 0; i < kResizings && !stopped() && !best->even(); ++i) {
      Partition made = MakePartition(policy, groups, best->cost.Field(), &best->best.partition);
      if (std::ranges::equal(made.boxes(), best->best.partition.boxes())) break;
      Refine(policy, std::move(made), *best);
    }
    return std::move(best->best);
  }

  // The whole volume in one box, if it is not too large: with a single worker there is nothing to divide, and no look changes its box.
  std::optional<Partition> OneBox(int groups) {
    if (groups * request.slots > 1) return std::nullopt;
    Partition whole = MakeSlabs({.work = &fields.Of(BalanceBy::kVoxels)});
    return BoxesFit(whole) ? std::optional(std::move(whole)) : std::nullopt;
  }

  // Voxels that move take time, and so does cutting a volume for each of many looks. So earlier boxes stay while workers have about the
  // same to do, or if new boxes gain little.
  Layout MakeByBricks(const ResolvedPolicy& policy, int groups) {
    constexpr double kEven = 1.1, kLeastGain = 0.1;
    if (std::optional<Partition> whole = OneBox(groups)) return Assign(*std::move(whole), policy);
    if (request.earlier == nullptr || !BoxesFit(*request.earlier)) return MakeByPredictedCost(policy, groups);
    Layout kept = Assign(*request.earlier, policy);
    const Predicted now = Predict(kept);
    const bool in_groups = now.shares.size() <= std::size_t(groups) * request.slots;
    if (in_groups && now.frame <= kEven * now.shared_out) return kept;
    Layout anew = MakeByPredictedCost(policy, groups);
    return in_groups && Predict(anew).frame >= (1 - kLeastGain) * now.frame ? kept : anew;
  }

  const LayoutRequest request;
  WorkFields fields;
  AnalyticCost analytic;  // made at its first use
  std::optional<LeastExtinction> extinction;
};

LayoutMaker::LayoutMaker(const LayoutRequest& request) : state_(std::make_unique<State>(request)) {}
LayoutMaker::~LayoutMaker() = default;
LayoutMaker::LayoutMaker(LayoutMaker&&) noexcept = default;

int LayoutMaker::FewestGroups(const ResolvedPolicy& policy) {
  if (policy.groups > 0) return policy.groups;
  const int most = MostGroups(state_->request, policy);
  const WorkField& work = state_->fields.Of(policy.balance_by);
  int groups = 1;
  while (groups < most && !state_->stopped() && !state_->BoxesFit(state_->MakePartition(policy, groups, work))) ++groups;
  return groups;
}

Layout LayoutMaker::Make(const ResolvedPolicy& policy) {
  if (policy.assignment->by_owner) return state_->MakeByOwner(policy);
  if (state_->request.map != nullptr) return state_->MakeByLevels(policy);
  if (state_->request.summary->stored) return state_->Assign(state_->MakeStoredPartition(policy), policy);
  const BalanceBy metric = policy.balance_by;
  const int groups = FewestGroups(policy);
  if (metric == BalanceBy::kBricks) return state_->MakeByBricks(policy, groups);
  if (metric != BalanceBy::kVoxels && (metric != BalanceBy::kCost || state_->request.known.cost == nullptr)) {
    return state_->MakeByPredictedCost(policy, groups);
  }
  return state_->Assign(state_->MakePartition(policy, groups, state_->fields.Of(metric), state_->request.resized), policy);
}

void EmptyClippedCells(const ClipRegion& clip, const VolumeGeometry& geometry, OccupancyGrid& grid) {
  if (clip.empty()) return;
  const Index3 cells = OccupancyCells(grid.size);
  for (std::size_t i = 0; i < grid.cells.size(); ++i) {
    const Box place = geometry.InDataSpace(OccupancyCellBox(PlaceIn(cells, i), grid.size));
    if (grid.cells[i].voxels != 0 && !clip.MayKeep(place)) grid.cells[i] = {};
  }
}

Layout MakeLayout(const LayoutRequest& request) { return LayoutMaker(request).Make(*request.policy); }

}  // namespace slabstream
