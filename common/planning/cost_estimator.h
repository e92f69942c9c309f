// CostEstimator: the time that boxes of a volume take, for layouts.
//
// Without measured frames it returns the renderer's analytic cost (AnalyticCost) for the view. With them it returns the measured cost of
// each part of the volume, an average over the frames' views (MeasuredCost).
#pragma once

#include <memory>

#include "common/decomposition/work_field.h"
#include "common/renderers/renderer_kind.h"

namespace slabstream {

class CostEstimator {
 public:
  // All arguments must outlive this. `measured`: seconds, from earlier frames; null: there are none.
  CostEstimator(const RendererKind& renderer, const CostBasis& basis, const WorkField* measured)
      : analytic_(renderer.MakeCost(basis)), measured_(measured) {}

  // Seconds of one thread. `box` lies inside the volume and is not empty.
  double Seconds(const Box& box, const CostView& view) const { return measured_ != nullptr ? measured_->Sum(box) : Analytic(box, view); }
  // The same, as if no frame had been measured.
  double Analytic(const Box& box, const CostView& view) const { return analytic_->Seconds(box, view); }

 private:
  std::unique_ptr<AnalyticCost> analytic_;
  const WorkField* measured_;
};

}  // namespace slabstream
