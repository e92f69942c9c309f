// The default view: what a view leaves to the volume. A patient is seen from the front, any other volume from a little beside and above,
// and the picture frames what shows. Every client's requests begin with it; this is the only place that decides.
#pragma once

#include <optional>

#include "common/view/camera.h"
#include "common/view/named_view.h"
#include "common/volume/orientation.h"

namespace slabstream {

// What users' options begin with: all of the default view.
inline constexpr ViewParameters kUnstatedView = {.azimuth_degrees = std::nullopt, .elevation_degrees = std::nullopt, .fit = std::nullopt};

// The first view of a volume that is no patient.
inline constexpr double kDefaultAzimuthDegrees = 30, kDefaultElevationDegrees = 20;

// The view with azimuth, elevation and `fit`. With an eye there are no angles. A view that says where it looks, or from where, frames
// nothing unless it says so.
inline ViewParameters WithDefaults(ViewParameters view, World world) {
  constexpr NamedView kFront = kNamedViews.front();
  static_assert(kFront.name == "anterior");
  const bool patient = world == World::kPatient;
  if (!view.eye) {
    if (!view.azimuth_degrees) view.azimuth_degrees = patient ? kFront.azimuth_degrees : kDefaultAzimuthDegrees;
    if (!view.elevation_degrees) view.elevation_degrees = patient ? kFront.elevation_degrees : kDefaultElevationDegrees;
  }
  if (!view.fit) view.fit = !view.look_at && !view.eye;
  return view;
}

}  // namespace slabstream
