// ClassifiedVolume: a loaded volume under one transfer function, as one renderer draws it. Occupied voxels, layouts, chosen policies and
// learnt costs belong to one of these, so it is their key. The hash is computed once; copies share the transfer function.
#pragma once

#include <cstddef>
#include <memory>

#include "common/planning/frame_plan.h"

namespace slabstream {

class ClassifiedVolume {
 public:
  ClassifiedVolume(DatasetId dataset, TransferFunction transfer, RendererKind renderer);

  DatasetId dataset() const { return dataset_; }
  const TransferFunction& transfer() const { return *transfer_; }
  RendererKind renderer() const { return renderer_; }
  std::size_t hash() const { return hash_; }

  friend bool operator==(const ClassifiedVolume& a, const ClassifiedVolume& b) {
    return a.hash_ == b.hash_ && a.dataset_ == b.dataset_ && a.renderer_ == b.renderer_ &&
           (a.transfer_ == b.transfer_ || *a.transfer_ == *b.transfer_);
  }

 private:
  DatasetId dataset_;
  std::shared_ptr<const TransferFunction> transfer_;
  RendererKind renderer_;
  std::size_t hash_;
};

}  // namespace slabstream

template <>
struct std::hash<slabstream::ClassifiedVolume> {
  std::size_t operator()(const slabstream::ClassifiedVolume& volume) const { return volume.hash(); }
};
