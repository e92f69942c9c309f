// Messages by which a client sends a dataset.
#pragma once

#include "common/frame/dataset_name.h"
#include "common/wire/value_fields.h"
#include "common/wire/volume_messages.h"
#include "slabstream/v1/client.pb.h"

namespace slabstream {

inline void Write(const NewLabel& in, v1::NewLabel& out) {
  out.set_value(in.value);
  out.set_name(WireText(in.name, kMaxLabelNameBytes));
  if (!in.color) return;
  out.set_colored(true);
  out.set_red((*in.color)[0]);
  out.set_green((*in.color)[1]);
  out.set_blue((*in.color)[2]);
}
inline void Read(const v1::NewLabel& in, NewLabel& out, Checker& check) {
  out.value = check.Range("value", in.value(), 1, kMaxLabelValue);
  out.name = check.Text("name", in.name(), 0, kMaxLabelNameBytes);
  const auto channel = [&](std::string_view field, float value) { return float(check.Between(field, double(value), 0, 1)); };
  const std::array<float, 3> color = {channel("red", in.red()), channel("green", in.green()), channel("blue", in.blue())};
  if (in.colored()) out.color = color;
}

inline void Write(const SentFile& in, v1::SentFile& out) {
  out.set_name(in.name);
  out.set_bytes(in.bytes);
}
inline void Read(const v1::SentFile& in, SentFile& out, Checker& check) {
  out.name = check.Text("name", in.name(), 1, kMaxNameBytes);
  if (check.ok()) check.Adopt(CheckDatasetName(out.name));
  check.That(!out.name.starts_with('.'), "name", "begins with a dot");
  out.bytes = check.Range("bytes", in.bytes(), 1, kMaxSentFileBytes);
}

v1::AddVolume ProtoOf(const AddVolume&);
void Fields(auto& io, Is<AddVolume> auto& m) {
  using P = v1::AddVolume;
  io.Any(m.nonce, &P::nonce, &P::set_nonce);
  io.Text("name", m.name, &P::name, &P::mutable_name, 1, kMaxNameBytes);
  io.Optional("file", m.file, &P::has_file, &P::file, &P::mutable_file);
  if (m.file) return;
  io.Message("description", m.description, &P::description, &P::mutable_description);
  io.Message("layers", m.layers, &P::layers, &P::mutable_layers);
  io.Messages("labels", m.labels, &P::labels, &P::mutable_labels, kMaxLabels);
  io.Check([&](Checker& check) {
    if (m.layers.cells) check.Fail("layers.cells", "cells cannot be sent");
    const std::size_t most = !m.layers.labels ? 0 : *m.layers.labels == ScalarType::kUint8 ? 255 : kMaxLabels;
    if (m.labels.size() > most) check.Fail("labels", "more than numbers of the layer's samples");
    for (std::size_t i = 1; i < m.labels.size(); ++i) check.That(m.labels[i - 1].value < m.labels[i].value, "labels", "values do not rise");
  });
}

v1::VolumeCredit ProtoOf(const VolumeCredit&);
void Fields(auto& io, Is<VolumeCredit> auto& m) {
  using P = v1::VolumeCredit;
  io.Any(m.nonce, &P::nonce, &P::set_nonce);
  io.Any(m.received, &P::received, &P::set_received);
  io.Range("allowed", m.allowed, &P::allowed, &P::set_allowed, m.received, kMaxUint64);
}

v1::VolumePart ProtoOf(const VolumePart&);
void Fields(auto& io, Is<VolumePart> auto& m) {
  using P = v1::VolumePart;
  io.Any(m.nonce, &P::nonce, &P::set_nonce);
  io.Any(m.begin, &P::begin, &P::set_begin);
  io.Range("bytes", m.bytes, &P::bytes, &P::set_bytes, 1, kMaxVolumePartBytes);
}

v1::DropVolume ProtoOf(const DropVolume&);
void Fields(auto& io, Is<DropVolume> auto& m) { io.Any(m.nonce, &v1::DropVolume::nonce, &v1::DropVolume::set_nonce); }

}  // namespace slabstream
