// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "geometry/body/body_model.h"
#include "geometry/clip/clip.h"
#include "geometry/mesh/mesh.h"

namespace holdfast {

/// Points of an object's surface that are looked for in the body, besides all its vertices: spread
/// evenly by area (SampleSurface).
inline constexpr int kOwnBodySamples = 2000;

/// How deep something is in the person's own body, frame by frame.
struct BodyDepth {
  std::vector<double> depth_mm;  ///< T, of the deepest point; 0 where none is inside
  double max_mm = 0.0, mean_mm = 0.0;
  int worst_frame = 0;  ///< the first with the greatest depth

  /// Share of frames deeper than this.
  double DeepRatio(double deep_mm) const;
};

/// The object and the arms in the person's own body over a clip.
struct OwnBodyScore {
  /// The object's vertices and kOwnBodySamples points of its surface in trunk, neck, head, legs
  /// and any arm that holds it in no frame. Nothing without an object.
  std::optional<BodyDepth> object;
  /// Skin of both forearms and hands (OwnBody::ForearmAndHand) in trunk, neck, head and legs.
  BodyDepth arms;
  int object_points = 0;
};

/// Measures every frame; nothing for a hand alone. `body` has all vertices; `object` may be null.
/// `holders`: arms that hold the object in some frame (bits as in Clip::holding_hand). Frames are
/// shared among `threads`; the result does not depend on them. `progress` (frames done, frames) may
/// be empty, is called one at a time, and stops the measurement by returning false.
std::optional<OwnBodyScore> MeasureOwnBody(const Clip& clip, const BodySurface& body,
                                           const TriangleMesh* object, std::uint8_t holders,
                                           int threads = 1,
                                           const std::function<bool(int, int)>& progress = {});

}  // namespace holdfast
