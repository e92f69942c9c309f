// Samples of any type as numbers of another one.
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>

#include "common/memory/aligned_buffer.h"
#include "data/volume_io/sample_type.h"

namespace slabstream {

template <class T>
AlignedVector<T> Converted(SampleType type, const AlignedVector<std::byte>& bytes) {
  AlignedVector<T> out(bytes.size() / BytesPerSample(type));
  VisitSampleType(type, [&]<class S>(const S*) {
    const std::span samples(reinterpret_cast<const S*>(bytes.data()), out.size());
    std::ranges::transform(samples, out.begin(), [](S sample) { return static_cast<T>(sample); });
  });
  return out;
}

}  // namespace slabstream
