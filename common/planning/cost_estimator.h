// CostEstimator: the time that boxes of a volume take. Layouts, the choice of a policy and predicted frames all ask it.
//
// Until frames have been measured, the renderer's analytic cost answers (AnalyticCost), for any view. Measured frames replace it by what
// they taught about each part of the volume, on average over their views (LearntCost).
#pragma once

#include <memory>

#include "common/decomposition/work_field.h"
#include "common/renderers/renderer_kind.h"

namespace slabstream {

class CostEstimator {
 public:
  // What is given must outlive this. `measured`: seconds, of earlier frames; null: none were.
  CostEstimator(const RendererKind& renderer, const CostBasis& basis, const WorkField* measured)
      : analytic_(renderer.MakeCost(basis)), measured_(measured) {}

  // Seconds of one thread. `box` lies inside the volume and is not empty.
  double Seconds(const Box& box, const CostView& view) const {
    return measured_ != nullptr ? measured_->Sum(box) : Analytic(box, view);
  }
  // The same, as if no frame had been measured.
  double Analytic(const Box& box, const CostView& view) const { return analytic_->Seconds(box, view); }

 private:
  std::unique_ptr<AnalyticCost> analytic_;
  const WorkField* measured_;
};

}  // namespace slabstream
