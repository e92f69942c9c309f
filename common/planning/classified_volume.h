// ClassifiedVolume: a loaded volume under one transfer function, as one renderer draws it, perhaps with other fields, perhaps clipped.
// Layouts, chosen policies and learnt costs belong to one of these, so it is their key; occupied voxels are counted of the whole volume.
// Copies share the transfer function and the looks of fields.
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "common/frame/frame_setup.h"

namespace slabstream {

// Another field that shows: its finest level, and its look, which is that of values or of labels.
struct ClassifiedField {
  DatasetId dataset = 0;
  std::shared_ptr<const VolumeSummary> summary;  // never null
  FieldLook look = {};
  std::optional<LabelLook> labels = {};
  friend bool operator==(const ClassifiedField& a, const ClassifiedField& b) {
    return a.dataset == b.dataset && a.look == b.look && a.labels == b.labels;
  }
};

class ClassifiedVolume {
 public:
  ClassifiedVolume(DatasetId dataset, TransferFunction transfer, const RendererKind* renderer, ClipRegion clip = {},
                   std::vector<ClassifiedField> fields = {})
      : dataset_(dataset),
        transfer_(std::make_shared<const TransferFunction>(std::move(transfer))),
        renderer_(renderer),
        clip_(std::move(clip)),
        fields_(std::make_shared<const std::vector<ClassifiedField>>(std::move(fields))) {}

  DatasetId dataset() const { return dataset_; }
  const TransferFunction& transfer() const { return *transfer_; }
  const RendererKind* renderer() const { return renderer_; }
  const ClipRegion& clip() const { return clip_; }
  const std::vector<ClassifiedField>& fields() const { return *fields_; }  // the other fields that show

  ClassifiedVolume Whole() const {
    ClassifiedVolume whole = *this;
    whole.clip_ = {};
    return whole;
  }

  friend bool operator==(const ClassifiedVolume& a, const ClassifiedVolume& b) {
    return a.dataset_ == b.dataset_ && a.renderer_ == b.renderer_ && a.clip_ == b.clip_ &&
           (a.transfer_ == b.transfer_ || *a.transfer_ == *b.transfer_) && (a.fields_ == b.fields_ || *a.fields_ == *b.fields_);
  }

 private:
  DatasetId dataset_;
  std::shared_ptr<const TransferFunction> transfer_;
  const RendererKind* renderer_;
  ClipRegion clip_;
  std::shared_ptr<const std::vector<ClassifiedField>> fields_;
};

}  // namespace slabstream
