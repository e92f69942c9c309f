// The sizes, workers and frames that the sections of `experiment paper` share.
#pragma once

#include <vector>

#include "common/simulation/machine_model.h"
#include "laboratory/experiments/frame_case.h"

namespace slabstream {

inline constexpr int kValidationTurns = 7;

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

  // Class I with 5 % of its voxels occupied, equal slabs, one group, on N x N pixels at zoom sqrt(3): a pixel a voxel. The whole sphere is
  // in view however it is turned.
  FrameCase Frame(const RendererKind* renderer, int size, int workers) const;

  // PaperMachine for the time of a frame of the tables' N on this machine.
  MachineModel Machine(const RendererKind* renderer) const;

  // All of (renderer, size, workers).
  std::vector<FrameCase> Frames() const;

 private:
  ExperimentContext& context_;
  std::vector<int> sizes_, workers_;
};

// Sections: the measurements that they need, and what they find.
std::vector<Trial> TransformTrials(const PaperSetup& setup);
void AddTransform(const PaperSetup& setup, Results& results);
std::vector<Trial> FootprintTrials(const PaperSetup& setup);
void AddFootprint(const PaperSetup& setup, Results& results);
std::vector<Trial> PointsTrials(const PaperSetup& setup);
void AddPoints(const PaperSetup& setup, Results& results);
std::vector<Trial> FrameTrials(const PaperSetup& setup);
Section ValidationSection(const PaperSetup& setup);
Section CombiningSection(const PaperSetup& setup);
Section ConstantsSection(const PaperSetup& setup);
Section PipelineSection(const PaperSetup& setup, const RendererKind* renderer);
std::vector<Trial> ImprovedTrials(const PaperSetup& setup);
Section ImprovedSection(const PaperSetup& setup);
void AddPictures(const PaperSetup& setup, Results& results);

}  // namespace slabstream
