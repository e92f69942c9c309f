// The sizes, workers and frames that the sections of `experiment paper` share.
#pragma once

#include <string_view>
#include <vector>

#include "client/client.h"
#include "laboratory/experiments/figures.h"
#include "laboratory/experiments/frame_case.h"
#include "laboratory/measure/paper_model.h"
#include "laboratory/results/results.h"

namespace slabstream {

inline constexpr int kRunsOfALoop = 3;  // the median of so many runs is taken

// Images are sent whole, as in the paper, or without their empty pixels, as in Slabstream.
enum class Images { kWhole, kWithoutEmpty };
constexpr std::string_view NameOf(Images images) { return images == Images::kWhole ? "whole images" : "without empty pixels"; }

class PaperSetup {
 public:
  explicit PaperSetup(ExperimentContext& context);

  ExperimentContext& context() const { return context_; }
  const std::vector<int>& sizes() const { return sizes_; }      // N; the paper's, scaled
  const std::vector<int>& workers() const { return workers_; }  // p
  std::vector<int> MeasuredWorkers() const;                     // 1 and 2, if this machine has the cores
  int table_size() const { return Scaled(200); }                // N of the paper's tables
  int large_size() const { return sizes_.back(); }              // N of its figures 8b and 8c
  int Scaled(int side) const { return context_.Scaled(side); }

  // Class I with 5 % of its voxels occupied, on N x N pixels at zoom sqrt(3): a pixel a voxel. The whole sphere is in view however it is
  // turned. As in the paper, a slab is N/p whole slices, of those that are traversed; one group, combined hierarchically.
  FrameCase Frame(const RendererKind* renderer, int size, int workers) const;

  // The trials that Recall needs of each of these.
  std::vector<Trial> TrialsOf(const std::vector<FrameCase>& frames) const;

  // What the paper counts: neither the picture nor its way to a client.
  static MeasuredFrame AsPaper(MeasuredFrame frame, Images images);

  // PaperMachine for the time of a frame of the tables' N on this machine, one for each repeat.
  std::vector<MachineModel> Machines(const RendererKind* renderer) const;

  // A square picture by the embedded service with one worker of one thread.
  Picture RenderAlone(const BenchCase& volume, const ViewParameters& view, int pixels) const;

 private:
  ExperimentContext& context_;
  std::vector<int> sizes_, workers_;
};

// Instead of the sections: the frames of tables 2, 5 and 6 and figures 9 to 11 at a running service, with as many workers as it has.
void RunPaperAtService(const PaperSetup& setup, Results& results);

// Sections: the measurements that they need, and what they add to the results.
std::vector<Trial> TransformTrials(const PaperSetup& setup);
void AddTransform(const PaperSetup& setup, Results& results);
std::vector<Trial> FootprintTrials(const PaperSetup& setup);
void AddFootprint(const PaperSetup& setup, Results& results);
std::vector<Trial> PointsTrials(const PaperSetup& setup);
void AddPoints(const PaperSetup& setup, Results& results);
std::vector<Trial> GridTrials(const PaperSetup& setup);
void AddGrids(const PaperSetup& setup, Results& results);
std::vector<Trial> FrameTrials(const PaperSetup& setup);
void AddFrames(const PaperSetup& setup, Results& results);
std::vector<Trial> OccupancyTrials(const PaperSetup& setup);
void AddOccupancy(const PaperSetup& setup, Results& results);
void AddModel(const PaperSetup& setup, Results& results);
std::vector<Trial> ConstantsTrials(const PaperSetup& setup);
void AddConstants(const PaperSetup& setup, Results& results);
std::vector<Trial> ImprovedTrials(const PaperSetup& setup);
void AddImproved(const PaperSetup& setup, Results& results);
std::vector<Trial> ClaimTrials(const PaperSetup& setup);
void AddClaims(const PaperSetup& setup, Results& results);
std::vector<Trial> ValidationTrials(const PaperSetup& setup);
void AddValidation(const PaperSetup& setup, Results& results);
void AddPictures(const PaperSetup& setup, Results& results);

}  // namespace slabstream
