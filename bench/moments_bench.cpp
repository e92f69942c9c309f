// The published alternative to groups by owner (docs/owners.md), for voxels that lie in pieces of any shape: approximate combining that
// needs no order. Huang, Usher and Pascucci, "Approximate Puzzlepiece Compositing", 2025, build it on Muenstermann, Krumpen, Klein and
// Peters, "Moment-based order-independent transparency", I3D 2018 (below: MBOIT):
//
//   1. Each owner draws its boxes. What a pixel has of a box is a fragment: a colour c, an opacity alpha, and the stretch of depth in the
//      box. Its absorbance -ln(1 - alpha) lies evenly on that stretch.
//   2. The power moments of absorbance over depth are summed over all owners, in any order, and each owner gets the sum.
//   3. From them each owner estimates the transmittance in front of each of its fragments, and weighs the fragment with it. The weighted
//      colours are summed over all owners, in any order. They are scaled to the whole opacity, which the moment of order 0 tells exactly.
//
// Groups have the same images of boxes, by the same renderer. A line of a Markdown table a volume, arrangement and number of owners: the
// difference from the picture of the whole volume as one box (root mean square and largest, over channels), bytes that travel, and the
// processor time of all owners beside drawing. Bytes are those of floats on bounding rectangles, not encoded. Groups: each run's image
// once. Moments: what an owner has of them goes and comes once, and its colours go once.
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <span>

#include "bench/program.h"
#include "client/pictures/picture_writer.h"
#include "common/kernels/combine.h"
#include "common/planning/placement.h"
#include "laboratory/experiments/compared_policies.h"
#include "laboratory/experiments/owner_arrangements.h"
#include "laboratory/measure/lab_worker.h"
#include "laboratory/measure/thread_time.h"

namespace slabstream {
namespace {

constexpr std::size_t kMostMoments = 6;  // beside that of order 0
using Moments = std::array<float, kMostMoments + 1>;

struct Options {
  SubjectOptions subject = {.renderer = FindRenderer("raycast")};
  std::vector<std::string> arrangements = {"hilbert", "jagged", "checkerboard", "scattered"};
  std::vector<int> owners = {4, 16, 64};
  std::string pictures;
};

using Between = std::array<double, 2>;  // begin and end along a ray; depths of the volume are in [-1, 1], as in MBOIT

// A box as its owner has drawn it.
struct DrawnBox {
  std::uint32_t owner = 0;
  LocalImage image;
  std::vector<Between> stretches = {};  // in the box, by pixel of the image
};

// The transmittance in front of a depth (MBOIT, section 3.2, by the canonical representation of Hamburger's problem): of all distributions
// with these moments, the one with a point mass at `depth` and as few other points as can be has the most, or the least, before it.
class Transmittance {
 public:
  // `count` is 4 or 6. MBOIT's bias keeps the matrix positive definite; the moments in `kBias` are those of an even distribution.
  Transmittance(const Moments& moments, std::size_t count) : points_(count / 2), whole_(moments[0]) {
    constexpr std::array<double, kMostMoments + 1> kBias4 = {1, 0, 0.375, 0, 0.375, 0, 0}, kBias6 = {1, 0, 0.48, 0, 0.451, 0, 0.45};
    const auto& towards = count == 4 ? kBias4 : kBias6;
    const double bias = count == 4 ? 5e-7 : 5e-6;
    std::array<double, kMostMoments + 1> of{};
    for (std::size_t i = 0; i <= count; ++i) of.at(i) = std::lerp(double(moments.at(i)) / whole_, towards.at(i), bias);
    // The Cholesky factor of the Hankel matrix.
    for (std::size_t row = 0; row <= points_; ++row) {
      for (std::size_t column = 0; column <= row; ++column) {
        double sum = of.at(row + column);
        for (std::size_t i = 0; i < column; ++i) sum -= factor_[row][i] * factor_[column][i];
        factor_[row][column] = row == column ? std::sqrt(std::max(sum, 1e-14)) : sum / factor_[column][column];
      }
    }
  }

  double Before(double depth) const {
    // A polynomial whose roots are the other points: the solution of matrix * polynomial = powers of depth.
    Vector polynomial = Forward(depth);
    double before = kOverestimation / Square(polynomial);
    for (std::size_t row = points_ + 1; row-- > 0;) {
      for (std::size_t below = row + 1; below <= points_; ++below) polynomial[row] -= factor_[below][row] * polynomial[below];
      polynomial[row] /= factor_[row][row];
    }
    for (const double root : Roots(polynomial)) {
      if (root < depth) before += 1 / Square(Forward(root));
    }
    return std::exp(-whole_ * std::clamp(before, 0.0, 1.0));
  }

 private:
  static constexpr double kOverestimation = 0.25;  // MBOIT, section 3.3: the share of the point at the depth that lies before it
  using Vector = std::array<double, kMostMoments / 2 + 1>;

  // The powers of a depth, solved by the factor: one over its square is the weight of that point.
  Vector Forward(double depth) const {
    Vector solved{};
    double power = 1;
    for (std::size_t row = 0; row <= points_; ++row, power *= depth) {
      solved[row] = power;
      for (std::size_t i = 0; i < row; ++i) solved[row] -= factor_[row][i] * solved[i];
      solved[row] /= factor_[row][row];
    }
    return solved;
  }
  static double Square(const Vector& of) {
    double sum = 0;
    for (const double each : of) sum += each * each;
    return sum;
  }
  // All are real.
  Vector Roots(const Vector& c) const {
    constexpr double kNone = std::numeric_limits<double>::infinity();
    if (points_ == 2) {
      const double half = -0.5 * (c[1] + std::copysign(std::sqrt(std::max(c[1] * c[1] - 4 * c[2] * c[0], 0.0)), c[1]));
      return {half / c[2], c[0] / half, kNone, kNone};
    }
    const double third = c[2] / c[3] / 3, p = c[1] / c[3] / 3 - third * third;
    const double q = third * third * third - third * c[1] / c[3] / 2 + c[0] / c[3] / 2, length = std::sqrt(std::max(-p, 1e-300));
    const double angle = std::acos(std::clamp(-q / (length * length * length), -1.0, 1.0)) / 3;
    Vector roots = {kNone, kNone, kNone, kNone};
    for (std::size_t i = 0; i < 3; ++i) roots[i] = 2 * length * std::cos(angle - 2 * std::numbers::pi * double(i) / 3) - third;
    return roots;
  }

  std::size_t points_;
  double whole_;
  std::array<Vector, kMostMoments / 2 + 1> factor_{};
};

// Where the rays of an image are in a box. `range`: the depth in the middle of the volume, and its radius.
std::vector<Between> StretchesIn(const Box& box, const PixelBounds& pixels, const Camera& camera, const Between& range) {
  std::vector<Between> stretches;
  for (std::int32_t y = pixels.y_begin; y < pixels.y_end; ++y) {
    for (std::int32_t x = pixels.x_begin; x < pixels.x_end; ++x) {
      const Camera::Ray ray = camera.RayAt(x + 0.5, y + 0.5);
      double enters = range[0] - range[1], leaves = range[0] + range[1];
      for (const Axis axis : kAxes) {
        if (std::abs(ray.direction[axis]) < 1e-12) continue;
        const double a = (box.begin[axis] - 0.5 - ray.origin[axis]) / ray.direction[axis];
        const double b = (box.end[axis] - 0.5 - ray.origin[axis]) / ray.direction[axis];
        enters = std::max(enters, std::min(a, b));
        leaves = std::min(leaves, std::max(a, b));
      }
      enters = (enters - range[0]) / range[1];
      stretches.push_back({enters, std::max((leaves - range[0]) / range[1], enters + 1e-6)});
    }
  }
  return stretches;
}

void ForEachFragment(std::span<const DrawnBox> boxes, const PixelBounds& bounds, const auto& visit) {
  for (const DrawnBox& each : boxes) {
    const PixelBounds& of = each.image.bounds;
    std::size_t i = 0;
    for (std::int32_t y = of.y_begin; y < of.y_end; ++y) {
      const std::size_t row = std::size_t(y - bounds.y_begin) * std::size_t(bounds.width()) + std::size_t(of.x_begin - bounds.x_begin);
      for (std::size_t x = 0; x < std::size_t(of.width()); ++x, ++i) {
        const float* const rgba = &each.image.rgba[4 * i];
        if (rgba[3] > 0) visit(each.stretches[i], rgba, row + x);
      }
    }
  }
}

// `count` moments, beside that of order 0.
LocalImage CombineByMoments(std::span<const DrawnBox> boxes, const PixelBounds& bounds, std::size_t count) {
  LocalImage sum = MakeLocalImage(PixelFormat::kRgba, bounds);
  std::vector<Moments> moments(std::size_t(bounds.pixel_count()));
  ForEachFragment(boxes, bounds, [&](const Between& stretch, const float* rgba, std::size_t pixel) {
    constexpr double kMostAbsorbance = 10;  // MBOIT's limit
    const double absorbance = std::min(-std::log1p(-std::min(double(rgba[3]), 0.9999999)), kMostAbsorbance);
    const double density = absorbance / (stretch[1] - stretch[0]);
    double low = stretch[0], high = stretch[1];
    for (std::size_t i = 0; i <= count; ++i, low *= stretch[0], high *= stretch[1]) {
      moments[pixel].at(i) += float(density * (high - low) / double(i + 1));
    }
  });
  ForEachFragment(boxes, bounds, [&](const Between& stretch, const float* rgba, std::size_t pixel) {
    const auto transmittance = float(Transmittance(moments[pixel], count).Before(stretch[0]));
    for (std::size_t i = 0; i < 4; ++i) sum.rgba[4 * pixel + i] += transmittance * rgba[i];
  });
  for (std::size_t pixel = 0; pixel < moments.size(); ++pixel) {
    float* const rgba = &sum.rgba[4 * pixel];
    const float scale = rgba[3] > 0 ? -std::expm1(-moments[pixel][0]) / rgba[3] : 0;
    for (std::size_t i = 0; i < 4; ++i) rgba[i] *= scale;
  }
  return sum;
}

struct Difference {
  double root_mean_square = 0, largest = 0;
};
// Over channels of pixels that either has.
Difference DifferenceOf(LocalImage a, const LocalImage& b) {
  for (float& each : a.rgba) each = -each;
  LocalImage difference = MakeLocalImage(PixelFormat::kRgba, Union(a.bounds, b.bounds));
  for (const LocalImage* const image : {&std::as_const(a), &b}) {
    const float* from = image->rgba.data();
    for (std::int32_t y = image->bounds.y_begin; y < image->bounds.y_end; ++y, from += 4 * image->bounds.width()) {
      const PixelBounds& to = difference.bounds;
      float* const row =
          &difference.rgba[4 * (std::size_t(y - to.y_begin) * std::size_t(to.width()) + std::size_t(image->bounds.x_begin - to.x_begin))];
      SumRow(row, from, row, std::size_t(image->bounds.width()));
    }
  }
  Difference found;
  double squares = 0;
  for (const float each : difference.rgba) {
    squares += double(each) * each;
    found.largest = std::max(found.largest, double(std::abs(each)));
  }
  found.root_mean_square = std::sqrt(squares / double(std::max<std::size_t>(difference.rgba.size(), 1)));
  return found;
}

std::string Column(const Difference& difference, double bytes, double seconds) {
  return fmt::format("{:.1e} / {:.1e} / {:.1f} MB / {:.1f} ms", difference.root_mean_square, difference.largest, bytes * 1e-6,
                     seconds * 1e3);
}

Status WriteIf(const std::string& folder, const std::string& name, const LocalImage& image, ImageSize size) {
  if (folder.empty()) return Status::Ok();
  return WritePicture(PictureImage(image), size, folder + "/" + name + ".png", {.background = {0, 0, 0, 1}});
}

Status Compare(const Subject& subject, LabWorker& worker, const std::string& arrangement, int owners, const std::string& pictures) {
  FrameRequest request = subject.request;
  request.termination = 0;
  request.policy = {.groups = 1, .assignment = arrangement};
  const Result<ResolvedRequest> resolved = ResolveCompared(request, 1, subject.summary, std::uint32_t(owners));
  if (!resolved.ok()) return resolved.status();
  const Layout layout = MakeLayout(
      {.summary = resolved->summary.get(), .volume = &resolved->volume, .policy = &resolved->policy, .slots = std::uint32_t(owners)});
  const Result<FrameSetup> setup = MakeFrameSetup(*resolved);
  if (!setup.ok()) return setup.status();
  const Result<FramePlan> plan =
      PlanFrame(*setup, resolved->policy, RosterOf(std::uint32_t(owners)), std::make_shared<const Layout>(layout));
  if (!plan.ok()) return plan.status();

  std::vector<DrawnBox> boxes;
  std::map<std::uint32_t, PixelBounds> bounds_of;  // owners
  const Vec3 middle = 0.5 * (ToVec3(subject.volume->block.box.size()) - Vec3{1, 1, 1});
  const Between range = {setup->camera.Project(middle).depth, BoundingRadius(setup->description.geometry)};
  for (const Placement& each : PlacementsOf(*plan)) {
    DrawnBox& box = boxes.emplace_back(DrawnBox{std::uint32_t(each.worker), worker.Render(each.box, *setup).image});
    box.stretches = StretchesIn(each.box, box.image.bounds, setup->camera, range);
    bounds_of[box.owner] = Union(bounds_of[box.owner], box.image.bounds);
  }
  const LocalImage one_box = worker.Render(subject.volume->block.box, *setup).image;
  worker.KeepOnly({}, *setup);
  PixelBounds room = one_box.bounds;
  for (const auto& [owner, bounds] : bounds_of) room = Union(room, bounds);

  LocalImage in_groups = MakeEmptyRows(PixelFormat::kRgba, room);
  double image_bytes = 0;
  std::size_t images = 0;
  const double seconds = SecondsOf([&] {
    std::size_t next = 0;
    for (const GroupPlan& group : plan->groups) {
      const ScheduleName runs = AmongRuns(group.schedule);
      for (std::size_t i = 0; i < runs.ranks; ++i) {
        LocalImage run = boxes[next++].image;
        const std::size_t more = group.schedule.runs.empty() ? 0 : EndOfRun(group.schedule, i) - group.schedule.runs[i] - 1;
        for (std::size_t rank = 0; rank < more; ++rank) Combine(run, boxes[next++].image, Side::kBack);
        ++images;
        image_bytes += 16 * double(run.bounds.pixel_count());
        Combine(in_groups, ViewOf(run), Side::kBack, room);
      }
    }
  });
  FillRows(in_groups);
  std::string line = fmt::format("| {} | {} | {} | {} / {} / {} | {} |", subject.name, arrangement, owners, boxes.size(),
                                 plan->groups.size(), images, Column(DifferenceOf(in_groups, one_box), image_bytes, seconds));

  double pixels = 0;
  for (const auto& [owner, bounds] : bounds_of) pixels += double(bounds.pixel_count());
  const std::string name = fmt::format("{}-{}-{}", subject.name, arrangement, owners);
  Status written = WriteIf(pictures, name + "-exact", in_groups, request.size);
  for (const std::size_t count : {std::size_t{4}, kMostMoments}) {
    LocalImage image;
    const double taken = SecondsOf([&] { image = CombineByMoments(boxes, room, count); });
    line += fmt::format(" {} |", Column(DifferenceOf(image, one_box), pixels * 4 * double(2 * (count + 1) + 4), taken));
    if (written.ok()) written = WriteIf(pictures, fmt::format("{}-{}-moments", name, count), image, request.size);
  }
  fmt::print("{}\n", line);
  (void)std::fflush(stdout);
  return written;
}

Status Run(const Options& options) {
  if (options.subject.renderer->name() != "raycast") return Status::InvalidArgument("--renderer must be raycast: fragments lie on rays");
  fmt::print(
      "| volume | arrangement | owners | boxes / groups / images | groups: RMS / largest / bytes / time | 4 moments | 6 moments |\n"
      "|---|---|---|---|---|---|---|\n");
  for (const std::string& text : options.subject.volumes) {
    const Result<Subject> subject = LoadSubject(options.subject, text);
    if (!subject.ok()) return subject.status();
    LabWorker worker(*subject->volume);
    for (const std::string& arrangement : options.arrangements) {
      for (const int owners : options.owners) {
        if (Status status = Compare(*subject, worker, arrangement, owners, options.pictures); !status.ok()) return status;
      }
    }
  }
  return Status::Ok();
}

void AddOptions(const Command& app, Options& options) {
  AddSubjectOptions(app, options.subject);
  AddList(app, "--arrangement", options.arrangements, OneOf(NameList(OwnerArrangements())), "Who holds which voxels");
  AddList(app, "--owners", options.owners, Integers(1, 4096), "Numbers of owners");
  app.AddText("--pictures", options.pictures, "Folder for the pictures over black; empty: none");
}

}  // namespace
}  // namespace slabstream

int main(int argc, char** argv) {
  return slabstream::BenchMain(argc, argv, "moments_bench", "Groups by owner beside approximate combining by moments",
                               slabstream::AddOptions, slabstream::Run);
}
