// What the sections of `experiment paper` share: which sizes and workers, which frames.
#pragma once

#include <vector>

#include "common/simulation/machine_model.h"
#include "laboratory/experiments/frame_case.h"

namespace slabstream {

class PaperSetup {
 public:
  explicit PaperSetup(ExperimentContext& context);

  ExperimentContext& context() const { return context_; }
  const std::vector<int>& sizes() const { return sizes_; }      // N; the paper's, scaled
  const std::vector<int>& workers() const { return workers_; }  // p
  std::vector<int> MeasuredWorkers() const;                     // those that this machine has cores for, of 1 and 2
  int table_size() const { return Scaled(200); }                // N of the paper's tables
  int large_size() const { return sizes_.back(); }              // N of its figures 8b and 8c
  int Scaled(int side) const { return context_.Scaled(side); }

  // Class I with 5 % of its voxels occupied, equal slabs, one group, on sqrt(3) N x sqrt(3) N pixels: a pixel a voxel, and the whole cube
  // in view whichever way it is turned.
  FrameCase Frame(RendererKind renderer, int size, int workers) const;

  // PaperMachine, by what a frame of the tables' N takes here.
  Result<MachineModel> Machine(RendererKind renderer) const;

  // All of (renderer, size, workers).
  std::vector<FrameCase> Frames() const;

 private:
  ExperimentContext& context_;
  std::vector<int> sizes_, workers_;
};

// Sections: what they need measured, and what they say about it.
std::vector<Trial> TransformTrials(const PaperSetup& setup);
Result<Section> TransformSection(const PaperSetup& setup);
std::vector<Trial> FootprintTrials(const PaperSetup& setup);
Result<Section> FootprintSection(const PaperSetup& setup);
std::vector<Trial> FrameTrials(const PaperSetup& setup);
Result<Section> ValidationSection(const PaperSetup& setup);
Result<Section> CombiningSection(const PaperSetup& setup);
Result<Section> ConstantsSection(const PaperSetup& setup);
Result<Section> PipelineSection(const PaperSetup& setup, RendererKind renderer);
std::vector<Trial> ImprovedTrials(const PaperSetup& setup);
Result<Section> ImprovedSection(const PaperSetup& setup);
Result<Section> PicturesSection(const PaperSetup& setup);

}  // namespace slabstream
